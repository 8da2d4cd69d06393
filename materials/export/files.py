"""Export of catalogue materials to files of other programs."""

from __future__ import annotations

import shutil
import uuid
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from ...runtime.errors import InputError, UnknownNameError
from ...runtime.files import made_folder
from ...runtime.locks import made_and_held, remove_abandoned
from ...runtime.shutdown import clearing
from ...spectral.formats.registry import SpectralEntry
from ...spectral.spectrum import Spectrum
from ..records.material import MaterialRecord
from .spectrum import COMPUTED, exported_spectrum, provenance_tags
from .table import write_material_parquet, write_material_workbook

# Prefix of our temporary folders: those of killed exports are deleted.
_WORKPLACE = ".metamer-export."
# Sides of the pictures that hold one colour, pixels; a fluorescent one has thousands of channels.
_SWATCH, _FLUORESCENT_SWATCH = (16, 16), (2, 2)


@dataclass(frozen=True)
class Exported:
    """A written file or folder, and notes on it."""

    path: Path
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class ExportFormat:
    """Format of exported files.

    Attributes
    ----------
    suffix : of its files; "" if a material becomes a folder.
    together : one file can hold several materials.
    write : (path, records) -> notes; a folder exists and is empty.
    words : description of the output, for the help.
    counts : `write` takes a third argument, a callback for the numbers of files written and in total, since there are
        thousands.
    """

    suffix: str
    together: bool
    write: Callable[..., tuple[str, ...]]
    words: str
    counts: bool = False


def export(
    records: Collection[MaterialRecord],
    format_name: str,
    out: str | Path,
    *,
    force: bool = False,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[Exported, ...]:
    """Write materials in a format of `FORMATS`.

    `out` is the file, or the folder of files named after the materials if it is a folder, or if each of several
    materials needs a file of its own. A Mitsuba scene is a folder itself. Either everything is written or nothing.
    `records` are iterated once. `progress` receives the numbers of files written and in total, for materials with
    thousands of files.

    Raises
    ------
    InputError
        The output exists already (unless `force`), a material lacks data that the format needs, or the folder is
        missing. UnknownNameError The format is unknown.
    """
    if format_name not in FORMATS:
        raise UnknownNameError("export format", format_name, FORMATS, field="--format")
    if not records:
        raise InputError("nothing to export", expected="one material or more")
    how, out = FORMATS[format_name], Path(out)
    into_folder = (out.is_dir() and bool(how.suffix)) or not (how.together or len(records) == 1)
    folder = out if into_folder else out.parent
    parent = folder.parent if into_folder and not folder.exists() else folder
    groups = ((_file_name(record, how), [record]) for record in records) if into_folder else [(out.name, records)]
    done: dict[str, tuple[str, ...]] = {}
    with _workplace(parent) as work:
        for name, group in groups:
            if name in done:
                raise InputError(
                    "two materials would share a file", file=folder / name, hint="export one of them alone"
                )
            _check_free(folder, [name], force, how)
            place = work / name
            if not how.suffix:
                place.mkdir()
            with _placed(work, folder):
                done[name] = how.write(place, group, progress) if how.counts else how.write(place, group)
        written = sorted(path.relative_to(work) for path in work.rglob("*") if path.is_file())
        _check_free(folder, map(str, written), force, how)
        if into_folder:
            made_folder(folder)
        for path in written:
            (folder / path).parent.mkdir(exist_ok=True)
            (work / path).replace(folder / path)
    return tuple(Exported(folder / name, notes) for name, notes in done.items())


def _file_name(record: MaterialRecord, how: ExportFormat) -> str:
    return record.id.replace("/", "-") + how.suffix


def _check_free(folder: Path, names: Iterable[str], force: bool, how: ExportFormat) -> None:
    for name in names:
        place = folder / name
        if place.is_dir() and how.suffix:
            raise InputError("a folder stands where the file should go", file=place, hint="name a file")
        if place.exists() and not force:
            hint = "name another, or add --force to write over it"
            raise InputError("there is something of that name already", file=place, hint=hint)


@contextmanager
def _workplace(folder: Path) -> Iterator[Path]:
    """Make a folder inside `folder`, on the same disk, and remove it with its contents at the end.

    Leftovers of a killed export are removed too.
    """
    if not folder.is_dir():
        raise InputError("no such folder to write to", file=folder, hint="make the folder first, or name another")
    for left in folder.glob(f"{_WORKPLACE}????????"):
        remove_abandoned(left)
    work = folder / f"{_WORKPLACE}{uuid.uuid4().hex[:8]}"
    with clearing(lambda: shutil.rmtree(work, ignore_errors=True)), ExitStack() as stack:
        try:
            stack.enter_context(made_and_held(work, work.mkdir))
            # A lock on the folder may be a file in it, which is not part of the export.
            (inner := work / "files").mkdir()
        except OSError as reason:
            hint = "name a folder that you may write to, on a disk with room: -o"
            raise InputError("the folder cannot be written to", file=folder, found=reason.strerror, hint=hint) from None
        yield inner


@contextmanager
def _placed(work: Path, folder: Path) -> Iterator[None]:
    """Report errors under the name that the file was to have."""
    try:
        yield
    except InputError as reason:
        if reason.file is None or not Path(reason.file).is_relative_to(work):
            raise
        raise reason.at(file=folder / Path(reason.file).relative_to(work)) from None


@contextmanager
def _of(record: MaterialRecord) -> Iterator[None]:
    """Report errors of a material under its id."""
    try:
        yield
    except InputError as reason:
        raise reason.at(field=record.id) from None


def _lines(material_id: str, tags: Mapping[str, str]) -> list[str]:
    return [f"{material_id}: {name}: {' '.join(text.split())}" for name, text in tags.items()]


def _beside(path: Path, lines: Sequence[str]) -> str:
    """Write information that a format has no room for into a text file beside it; return a note about that."""
    path.with_name(f"{path.name}.txt").write_text("\n".join((*lines, "")), encoding="utf-8")
    return f"where it comes from is in {path.name}.txt"


def _spectra(records: Iterable[MaterialRecord]) -> tuple[list[SpectralEntry], list[str], list[dict[str, str]]]:
    """Return the spectrum of each material, the notes on them, and the origin of each."""
    entries, notes, tags = [], [], []
    for record in records:
        entries.append(exported_spectrum(record))
        notes += _notes(record, entries[-1])
        tags.append(provenance_tags(record))
    return entries, notes, tags


def _csv(path: Path, records: Iterable[MaterialRecord]) -> tuple[str, ...]:
    from ...spectral.formats.csv_writer import write_csv

    entries, notes, tags = _spectra(records)
    lines = [line for entry, said in zip(entries, tags, strict=True) for line in _lines(entry.name, said)]
    write_csv(path, entries)
    # Readers of tables look for words such as transmittance around the numbers: other words stay away from them.
    return (*notes, _beside(path, lines + notes))


def _cxf(path: Path, records: Iterable[MaterialRecord]) -> tuple[str, ...]:
    from ...spectral.formats.cxf_writer import write_cxf

    entries, notes, tags = _spectra(records)
    about = {"creator": "Metamer", "description": ", ".join(entry.name for entry in entries)[:1000]}
    about["comment"] = "Where each object comes from is in its tags, collection provenance."
    write_cxf(path, entries, about | (tags[0] if len(tags) == 1 else {}), tags)
    return tuple(notes)


def _notes(record: MaterialRecord, entry: SpectralEntry) -> list[str]:
    """Describe how a spectrum that was not measured was derived, and what is lost of a material with pictures."""
    computed = [f"{entry.name}: {entry.details[COMPUTED]}"] if COMPUTED in entry.details else []
    return computed + _mean_only(record)


def _exr(path: Path, records: Iterable[MaterialRecord]) -> tuple[str, ...]:
    from ...spectral.formats.spectral_exr import write_bispectral_exr, write_spectral_exr

    (record,) = records
    attributes = {f"metamer_{name.replace(' ', '_')}": text for name, text in provenance_tags(record).items()}
    if "texture.quantity" in record.original:
        return _texture(path, record, attributes)
    with _of(record):
        if record.quantity == "bispectral":
            surface = record.brdf().bispectral
            assert surface is not None
            write_bispectral_exr(path, surface, _FLUORESCENT_SWATCH, attributes)
            return ("values are float32, as the layout has them",)
        entry = exported_spectrum(record)
        spectrum = entry.spectrum
        if spectrum.quantity == "radiance factor" and spectrum.samples.max() > 1.0:
            raise InputError(
                "the layout has no channels for a radiance factor above 1",
                found=f"{spectrum.samples.max():g}",
                expected="a reflectance or an emission",
                hint="use --format cxf or csv",
            )
        values = np.broadcast_to(spectrum.samples, (*_SWATCH, spectrum.samples.size))
        quantity = "reflectance" if spectrum.quantity == "radiance factor" else spectrum.quantity
        units = entry.details.get("units", "not stated")
        picture = Spectrum.sampled(spectrum.wavelengths_nm, values, quantity)
        write_spectral_exr(path, picture, units, attributes)
    return ("values are float32, as the layout has them", *_notes(record, entry))


def _texture(path: Path, record: MaterialRecord, attributes: dict[str, str]) -> tuple[str, ...]:
    """Return every texel of a spectral texture, as imported."""
    from ...spectral.formats.spectral_exr import write_spectral_texture

    kept = record.original
    values = np.asarray(kept["texture.values"] if "texture.values" in kept else record.parameters["texture"])
    grid = np.asarray(kept["texture.wavelengths_nm"], dtype=np.float64)
    units = str(kept.get("exr.emissiveUnits", "not stated"))
    write_spectral_texture(path, values, grid, kept["texture.quantity"] == "emission", units, attributes)
    return ("the whole texture",)


def _mean_only(record: MaterialRecord) -> list[str]:
    """Note that only the mean is exported, if the format has room for one colour of a material with pictures."""
    pictures = any(name.startswith(("texture.", "maps.")) for name in record.original)
    return [f"{record.id}: its textures are left out; this is their mean"] if pictures else []


def _merl(path: Path, records: Iterable[MaterialRecord]) -> tuple[str, ...]:
    from ..formats.merl import merl_table, write_merl

    (record,) = records
    with _of(record):
        values, notes = merl_table(record.brdf())
        write_merl(path, values)
    notes = (*notes, *_mean_only(record))
    return (
        *notes,
        _beside(path, [*_lines(record.id, provenance_tags(record)), *(f"{record.id}: {note}" for note in notes)]),
    )


def _mitsuba(path: Path, records: Iterable[MaterialRecord]) -> tuple[str, ...]:
    from ..formats.mitsuba_maps import write_mitsuba_maps
    from ..formats.mitsuba_writer import write_mitsuba
    from ..svbrdf.maps import MappedSurface

    (record,) = records
    with _of(record):
        surface = record.surface()
        if isinstance(surface, MappedSurface) and not surface.glossy:
            return write_mitsuba_maps(path, surface, "; ".join(_lines(record.id, provenance_tags(record))))
        said = _lines(record.id, provenance_tags(record)) + _mean_only(record)
        notes = write_mitsuba(path, record.brdf(), "; ".join(said))
    return (*notes, *_mean_only(record))


def _gltf(path: Path, records: Iterable[MaterialRecord]) -> tuple[str, ...]:
    from ..formats.gltf_material import gltf_material
    from ..formats.gltf_writer import GltfWriter

    writer, notes = GltfWriter(), []
    licences: dict[str, None] = {}
    for record in records:
        with _of(record):
            surface = record.surface()
            material, said = gltf_material(surface, record.id, writer)
        if record.model not in ("maps", "spectral_texture") and _mean_only(record):
            said.append("its textures are left out; this is their mean")
        said += [
            f"not written either: {note}" for note in record.provenance.notes.split(" + ") if "not rendered" in note
        ]
        method = getattr(surface, "uplift", record.original.get("uplift.method", ""))
        said += [f"its spectra are by {method}: import it again with --uplift {method}"] if method else []
        licences |= {record.provenance.licence: None}
        material["extras"] = {"metamer": provenance_tags(record) | {"export": " + ".join(said)}}
        writer.add(material)
        notes += [f"{record.id}: {note}" for note in said]
    writer.write(path, {"copyright": "; ".join(licences)})
    return tuple(notes)


def _materialx(path: Path, records: Iterable[MaterialRecord]) -> tuple[str, ...]:
    from ..formats.materialx_writer import open_pbr, write_materialx

    written, notes = [], []
    for record in records:
        with _of(record):
            written.append(open_pbr(record.id, record.surface(), "; ".join(_lines(record.id, provenance_tags(record)))))
        notes += [*written[-1].notes, *_mean_only(record)]
    table = write_materialx(path, written)
    return (*notes, f"spectra are in {table.name}; red, green and blue are what D65 shows of them")


def _btf(
    path: Path, records: Iterable[MaterialRecord], heard: Callable[[int, int], None], spectral: bool = False
) -> tuple[str, ...]:
    """Write the images as they were measured; their files must still exist."""
    from ..btf.surface import MeasuredBtf
    from ..formats.btf_writer import write_btf

    (record,) = records
    with _of(record):
        surface = record.surface()
        if not isinstance(surface, MeasuredBtf):
            expected = "a BTF, which has images from many sides under many lights"
            raise InputError("no images to write", found=record.model, expected=expected, hint="use another --format")
        measured = surface.images.basis.is_sampled
        words = "are made up of red, green and blue" if spectral else "are left out; --format ubo-spectral has them"
        said = [] if measured == spectral else [f"{record.id}: its spectra {words}"]
        notes = write_btf(path, surface.images, spectral, _lines(record.id, provenance_tags(record)) + said, heard)
    return (*notes, *said)


FORMATS = {
    "csv": ExportFormat(".csv", True, _csv, "table of spectra"),
    "cxf": ExportFormat(".cxf", True, _cxf, "CxF3: spectra, Lab under D50, provenance"),
    "exr": ExportFormat(".exr", False, _exr, "spectral OpenEXR: reflectance, emission or fluorescence"),
    "gltf": ExportFormat(
        ".glb", True, _gltf, "glTF 2.0: maps, textures, and what is matt or metal and roughness, in RGB"
    ),
    "materialx": ExportFormat(
        ".mtlx",
        True,
        _materialx,
        "MaterialX: OpenPBR surfaces of what is matt or metal and roughness; spectra beside it",
    ),
    "merl": ExportFormat(".binary", False, _merl, "MERL table of the BRDF in red, green and blue"),
    "mitsuba": ExportFormat("", False, _mitsuba, "folder with a Mitsuba 3 scene of the material on a sphere"),
    "parquet": ExportFormat(
        ".parquet", True, write_material_parquet, "table of names, colours, errors and spectra for data frames"
    ),
    "ubo": ExportFormat("", False, _btf, "folder of a BTF's images under UBO2003's names: OpenEXR, linear sRGB", True),
    "ubo-spectral": ExportFormat("", False, partial(_btf, spectral=True), "the same, a channel a wavelength", True),
    "xlsx": ExportFormat(".xlsx", True, write_material_workbook, "the table of parquet as a workbook"),
}
