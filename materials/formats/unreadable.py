"""Formats of materials and colours that are known by name and not read: each with what to export instead.

The last of the readers to be asked: what another one knows never comes here.
"""

from __future__ import annotations

import re
import struct
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from ...spectral.errors import InputError
from ..input_file import is_zip
from ..source import MaterialSource, Rejected
from .pictures.map_names import map_name, pictures_in

NAME = "formats that are not read"
SUFFIXES = ()
_READ = "CxF3, CGATS, CSV, MERL, RGL, spectral OpenEXR, glTF or texture maps"
_AS_GLTF = "export it as glTF (.glb), or bake its maps (albedo, roughness, metallic) as PNG or OpenEXR"
_AS_SPECTRA = "export the spectra as CxF3, CGATS or CSV"
_UNPACK = "unpack it, and import the folder"


@dataclass(frozen=True)
class Unread:
    """One format that is not read.

    Parameters
    ----------
    name : what people call it.
    why : what stands in the way.
    hint : what to export instead, and from where.
    suffixes : what the names of such files end in.
    mark : pattern that the first bytes of such a file hold, whatever its name.
    needs : pattern that the first bytes hold as well where only the name speaks for the format.
    member : pattern that the name of a member begins with, where such a file is a zip container.
    beside_maps : True where such a file often lies beside a set of texture maps, which then say all that it does.
    """

    name: str
    why: str
    hint: str
    suffixes: tuple[str, ...] = ()
    mark: re.Pattern[bytes] | None = None
    beside_maps: bool = False
    needs: re.Pattern[bytes] | None = None
    member: re.Pattern[str] | None = None

    def fits(self, path: Path, head: bytes, members: tuple[str, ...]) -> bool:
        """Whether a file is of this kind, by its first bytes, its members or its name."""
        marked = self.mark is not None and self.mark.search(head) is not None
        marked = marked or (self.member is not None and any(self.member.match(name) for name in members))
        named = path.suffix.lower() in self.suffixes and (self.needs is None or self.needs.search(head) is not None)
        if not marked and not named:
            return False
        return not (self.beside_maps and _lies_beside_maps(path))


def _starts(*marks: bytes) -> re.Pattern[bytes]:
    return re.compile(rb"\A(?:" + b"|".join(map(re.escape, marks)) + rb")")


FORMATS = (
    Unread(
        "X-Rite AxF",
        "the container is closed: only X-Rite's own library reads it",
        "in PANTORA, export its maps as PNG or OpenEXR, and the spectra of a paint as CxF3",
        (".axf",),
        re.compile(rb"com\.xrite\.Material"),
    ),
    Unread(
        "a material of a catalogue",
        "it is what an import writes, not what it reads",
        "open the folder that it lies in: metamer catalogue list FOLDER",
        mark=re.compile(rb'\A\s*\{[^\0]*"metamer-material"'),
    ),
    Unread(
        "X-Rite MIF, of Ink Master or PantoneLIVE",
        "it is a format of one program, and encrypted where it comes from PantoneLIVE",
        f"in the program that opens it, {_AS_SPECTRA}",
        (".mif", ".pantonelive"),
        re.compile(rb"\A(?:\xef\xbb\xbf)?\s*\[FILE INFO\]"),
    ),
    Unread(
        "Datacolor QTX",
        "it is a format of one maker's programs",
        f"in Datacolor Tools, {_AS_SPECTRA}",
        (".qtx",),
        re.compile(rb"\[(?:STANDARD|BATCH)_DATA"),
    ),
    Unread(
        "a Konica Minolta SpectraMagic document",
        "it is a format of one program",
        "in SpectraMagic NX, export the data as text or CSV, with the spectral values",
        (".mes", ".mesx"),
    ),
    Unread(
        "an X-Rite job or data base",
        "it is a format of one program",
        f"in the program that opens it, {_AS_SPECTRA}",
        (".xrc", ".xcm", ".xrcg"),
    ),
    Unread(
        "colour swatches",
        "swatches hold RGB, CMYK or Lab, and no spectra",
        f"measure the colours, or {_AS_SPECTRA} from the library that they come from",
        (".ase", ".aco", ".acb"),
        _starts(b"ASEF", b"8BCB"),
    ),
    Unread(
        "an ICC profile",
        "a profile describes a device, not a material",
        "import the measurements that it was made from (CGATS)",
        (".icc", ".icm"),
        re.compile(rb"\A.{36}acsp", re.DOTALL),
    ),
    Unread("Adobe Substance", "it is a program that makes maps", _AS_GLTF, (".sbsar", ".sbs", ".sbsprs"), None, True),
    Unread("MaterialX", "it is a graph of nodes", _AS_GLTF, (".mtlx",), re.compile(rb"<materialx[\s>]"), True),
    Unread(
        "NVIDIA MDL",
        "it is source code of a shader",
        f"{_AS_GLTF}; a measured BSDF (.mbsdf) as MERL or RGL",
        (".mdl", ".mdr", ".mdle", ".mbsdf"),
        re.compile(rb"\A(?:\s|//[^\n]*\n|/\*.*?\*/)*mdl\s+1\.\d+\s*;", re.DOTALL),
        True,
    ),
    Unread("KeyShot", "it is a format of one program", _AS_GLTF, (".kmp", ".kmt", ".ksp", ".bip"), None, True),
    Unread(
        "V-Ray",
        "it is a format of one renderer",
        _AS_GLTF,
        (".vrmat", ".vrmesh", ".vrscene", ".vrscan", ".vismat"),
        None,
        True,
    ),
    Unread(
        "Autodesk VRED or 3ds Max",
        "it is a format of one program",
        _AS_GLTF,
        (".vpb", ".osb", ".osbt", ".max"),
        None,
        True,
    ),
    Unread(
        "OpenUSD",
        "it is a scene",
        _AS_GLTF,
        (".usd", ".usda", ".usdc", ".usdz"),
        _starts(b"#usda", b"PXR-USDC"),
        True,
    ),
    Unread(
        "a scene of a modelling program",
        "it is a format of one program",
        _AS_GLTF,
        (".fbx", ".blend", ".c4d", ".3dm", ".ma", ".mb", ".uasset", ".unitypackage"),
        _starts(b"Kaydara FBX Binary", b"BLENDER"),
        True,
    ),
    Unread(
        "a bidirectional texture (BTF)",
        "textures of many directions are not rendered yet",
        "export single points of it as MERL or RGL",
        (".btf",),
        _starts(b"!6FB"),
    ),
    Unread(
        "a BSDF of a window (WINDOW, Radiance)",
        "it holds averages over patches of directions, and no spectra",
        "import the spectra of the glass (CSV), or measure it as RGL",
        mark=re.compile(rb"<WindowElement[\s>]"),
    ),
    Unread(
        "a compressed texture",
        "its blocks have lost the colours of texels",
        "save it as PNG or OpenEXR",
        (".ktx", ".ktx2", ".dds", ".basis"),
        _starts(b"\xabKTX ", b"DDS "),
        True,
    ),
    Unread(
        "an Excel workbook",
        "it is no text",
        "save the sheet as CSV",
        (".xls", ".xlsb", ".xlsx", ".xlsm"),
        _starts(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"),
        member=re.compile(r"xl/workbook\."),
    ),
    Unread(
        "an OpenDocument spreadsheet",
        "it is no text",
        "save the sheet as CSV",
        (".ods",),
        re.compile(rb"\APK\x03\x04.{26}mimetypeapplication/vnd\.oasis\.opendocument\.spreadsheet", re.DOTALL),
    ),
    Unread(
        "JCAMP-DX",
        "its numbers may be packed in several ways that look like a table and are none",
        "in the program that opens it, save the spectrum as CSV: a wavelength in nm and a value in each row",
        (".jdx",),
        re.compile(rb"\A(?:\xef\xbb\xbf)?\s*##(?:TITLE|JCAMP-?DX)\s*=", re.IGNORECASE),
    ),
    Unread(
        "Galactic SPC",
        "it is a binary format of spectrometers",
        "in the program that opens it (GRAMS, Spectragryph), save the spectrum as CSV or text",
        (".spc",),
        needs=re.compile(rb"\A.[\x4b\x4c\x4d\xcf]", re.DOTALL),
    ),
    Unread(
        "a binary file of an ASD spectrometer",
        "it is a format of one maker's programs",
        "in ViewSpec Pro, export it as ASCII: reflectance, with a header",
        mark=re.compile(rb"\A(?:ASD|as[2-8])[^\0]{0,157}\0"),
    ),
    Unread(
        "Ocean Optics ProcSpec",
        "it is a format of one maker's programs",
        "in SpectraSuite or OceanView, save the spectrum as tab-delimited text",
        (".procspec",),
        member=re.compile(r"OOISignatures\.xml|OOIVersion\.txt"),
    ),
    Unread(
        "optical constants (refractiveindex.info)",
        "n and k of a substance are not the spectrum of a surface",
        "write n and k as CSV, and beside it a family description (.toml) of a metal, with eta and k, that names it",
        mark=re.compile(rb"^DATA:\s*$.{0,200}?^\s*-\s*type:\s*[\"']?(?:tabulated (?:nk?|k)|formula \d)", re.M | re.S),
    ),
    Unread(
        "a colour look-up table",
        "it turns colours of one device into those of another, and holds no spectra",
        "name it as the look of a display, in OpenColorIO; import the measurements that it was made from",
        (".cube", ".csp", ".spi1d", ".spi3d", ".3dl", ".mga", ".look"),
        re.compile(rb"\A(?:[^\0]{0,2000}\n)?\s*(?:LUT_[13]D_SIZE|CSPLUTV100|SPILUT 1\.0)"),
    ),
    Unread(
        "a photometric file (IES LM-63, EULUMDAT)",
        "it says how much light goes where, and holds no spectrum",
        "export the spectrum of the lamp as IES TM-27 (.spdx) or CSV",
        (".ies", ".ldt"),
        re.compile(rb"\A\s*IESNA|^TILT=(?:NONE|INCLUDE)", re.M),
    ),
    Unread(
        "a polarised BSDF (KAIST)",
        "it holds Mueller matrices, and polarisation is not rendered",
        "export what it does to unpolarised light, the first element of each matrix, as RGL or MERL",
        (".pbsdf", ".pbrdf"),
        re.compile(rb"\Atensor_file\0(?=.*wvls)(?=.*theta_[dh])", re.DOTALL),
    ),
    Unread(
        "a tensor file of something else than a BRDF",
        "its fields are others, such as those of a model of the sky",
        "name the .bsdf of the measurement; a light is imported from its spectrum (CSV, IES TM-27)",
        mark=re.compile(
            rb"\Atensor_file\0(?!.*(?:phi_i|theta_i|ndf|sigma|luminance|spectra|rgb|jacobian|wavelengths|description)).{53}",
            re.DOTALL,
        ),
    ),
    Unread(
        "a packed archive",
        "only zip files are unpacked",
        _UNPACK,
        (".7z", ".rar", ".tgz", ".tar", ".gz", ".xz"),
        _starts(b"7z\xbc\xaf\x27\x1c", b"Rar!", b"\x1f\x8b", b"\xfd7zXZ"),
    ),
)


def recognises(path: Path, head: bytes) -> bool:
    """True for a file of one of `FORMATS`."""
    return unread(path, head) is not None


def label(path: Path) -> str:
    """The name of the file's format."""
    found = unread(path, _head(path))
    return found.name if found else NAME


def read_sources(path: Path, uplift: str) -> Iterator[MaterialSource | Rejected]:
    """Nothing: raises the `InputError` that says what the file is, and what to export instead."""
    yield refuse(path, _head(path))


def unread(path: Path, head: bytes) -> Unread | None:
    """Which of `FORMATS` the file is of, by its name and its first bytes; None where it is of none."""
    members = _members(path) if is_zip(head) else ()
    return next((known for known in FORMATS if known.fits(path, head, members)), None)


def refuse(path: Path, head: bytes) -> NoReturn:
    """Raise what is to be said of a file that is not read."""
    known = unread(path, head)
    raise InputError(
        f"not read: {known.why}" if known else "not a format of materials or spectra",
        file=path,
        field="format",
        found=known.name if known else f"first bytes {head[:12]!r}",
        expected=_READ,
        hint=known.hint if known else f"export it as {_READ}",
    )


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(4096)
    except OSError as reason:
        raise InputError(
            "cannot be read",
            file=path,
            field="file",
            found=reason.strerror or str(reason),
            expected="a readable file",
            hint="check its name and its permissions",
        ) from None


def _members(path: Path) -> tuple[str, ...]:
    """Names in a zip container, as far as it can be read."""
    try:
        with zipfile.ZipFile(path) as opened:
            return tuple(opened.namelist())
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError, EOFError, RuntimeError, struct.error):
        return ()


def _lies_beside_maps(path: Path) -> bool:
    return any((name := map_name(other)) is not None and name.role == "albedo" for other in pictures_in(path.parent))
