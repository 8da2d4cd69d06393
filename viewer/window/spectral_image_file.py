"""Reader of OpenEXR images as planes: spectral ones, with a known memory bound, and those in XYZ."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...calibration.regression.picture_files import header, read_xyz
from ...runtime.errors import InputError, UnknownNameError
from ...runtime.files import existing_file
from ...runtime.memory import check_room, gigabytes
from ...spectral.formats.exr import channel_names, read_picture, samples_in
from ...spectral.formats.spectral_exr import BISPECTRAL, PLAIN, wavelength_of
from ...spectral.illuminants import illuminant
from ...spectral.observers import OBSERVERS
from .spectral_image import SpectralPicture, XyzPicture

# Bytes per sample: as read from the file, and as stored.
_READING, _KEPT = 8, 4


@dataclass(frozen=True)
class PictureMemory:
    """Memory of a spectral image, bytes: while reading, and afterwards."""

    samples: int

    @property
    def reading(self) -> int:
        """Peak bytes while reading."""
        return _READING * self.samples

    @property
    def kept(self) -> int:
        """Bytes while shown."""
        return _KEPT * self.samples

    @property
    def words(self) -> str:
        """Describe both."""
        return f"{gigabytes(self.reading)} while it is read, {gigabytes(self.kept)} afterwards"


def picture_memory(path: str | Path) -> PictureMemory:
    """Estimate the memory of an image from its header."""
    return PictureMemory(samples_in(Path(path)))


def read_looked_at(path: str | Path) -> SpectralPicture | XyzPicture:
    """Read an image of either kind: spectral, or XYZ with its white.

    Raises
    ------
    InputError : see `read_spectral_picture`; an image in XYZ without white.
    """
    path = existing_file(Path(path))
    with path.open("rb") as file:
        names = channel_names(path, file.read(4))
    if not set("XYZ") <= set(names) or any(PLAIN.match(name) for name in names):
        return read_spectral_picture(path)
    pixels, said = read_xyz(path), header(path)
    who = said.get("observer", "")
    notes = [f"{what} is not said in the file" for what in ("illuminant", "observer") if not said.get(what)]
    if who and who not in OBSERVERS.values():
        notes, who = [*notes, f"its observer is not known here: {who}"], ""
    planes = np.ascontiguousarray(np.moveaxis(pixels.xyz, 2, 0))
    return XyzPicture(
        planes, pixels.coverage, pixels.white_xyz, said.get("illuminant", ""), who, (*notes, *_notes(planes))
    )


def read_spectral_picture(path: str | Path) -> SpectralPicture:
    """Read a spectral image; one that does not fit into free memory is refused before reading.

    Values are unchanged; `notes` has the numbers of non-finite and negative ones.

    Raises
    ------
    InputError : a missing or damaged file, not OpenEXR; no spectral channels, several kinds or layers, a duplicate
        wavelength, channels of different sizes; too little memory.
    """
    path = Path(path)
    memory = picture_memory(path)
    problem, hint = "not enough memory for a spectral picture", "cut out a part, or save it with fewer wavelengths"
    check_room(memory.reading, problem, memory.words, hint, file=path)
    try:
        return _read(path, memory)
    except InputError as error:
        raise (error.at(file=path) if error.file is None else error) from None


def _read(path: Path, memory: PictureMemory) -> SpectralPicture:
    picture = read_picture(path, max(memory.samples, 1))
    said, channels = picture.attributes, dict(picture.channels)
    # Otherwise the channels removed below would stay alive.
    del picture
    plain: dict[float, str] = {}
    pairs: dict[tuple[float, float], str] = {}
    kinds: set[str] = set()
    for name in channels:
        if found := PLAIN.match(name):
            kinds.add(found[1])
            key = wavelength_of(found[2], found[3], found[4])
            held: dict = plain
        elif found := BISPECTRAL.match(name):
            key = (wavelength_of(found[1], found[2], found[3]), wavelength_of(found[4], found[5], found[6]))
            held = pairs
        else:
            continue
        if key in held:
            expected, hint = "each wavelength once", "the file has layers or views; save one of them alone"
            raise InputError("two channels hold the same", field=name, found=held[key], expected=expected, hint=hint)
        held[key] = name
    if len(kinds) != 1:
        raise InputError(
            "emission and reflectance in one file" if kinds else "no spectral channels",
            field="channels",
            found=", ".join(list(channels)[:6]),
            expected="channels such as T.550,000000nm or S0.550,000000nm",
        )
    nm = np.array(sorted(plain))
    if len(nm) < 2:
        raise InputError(
            "one wavelength is no spectrum", field="channels", found=f"{nm[0]:g} nm", expected="two or more"
        )
    for absorbed, emitted in pairs:
        if absorbed not in plain or emitted not in plain or absorbed == emitted or kinds == {"S0"}:
            expected = "two different wavelengths of reflectance channels"
            raise InputError("re-radiation without its wavelengths", field=pairs[absorbed, emitted], expected=expected)
    ordered = [plain[one] for one in nm.tolist()] + [pairs[one] for one in sorted(pairs)]
    shapes = {channels[name].shape for name in ordered}
    if len(shapes) > 1:
        found = " and ".join(f"{width} x {height}" for height, width in sorted(shapes)[:2])
        hint = "save the picture without subsampling"
        raise InputError("channels of different sizes", field="channels", found=found, expected="one size", hint=hint)
    planes = np.empty((len(ordered), *shapes.pop()), dtype=np.float32)
    for number, name in enumerate(ordered):
        # One by one, so that data are not in memory twice.
        planes[number] = channels.pop(name)
    into = np.concatenate([nm, [one for one, _ in sorted(pairs)]])
    out = np.concatenate([nm, [other for _, other in sorted(pairs)]])
    units, light = (value if isinstance(value := said.get(key), str) else "" for key in ("emissiveUnits", "illuminant"))
    kind = "emission" if kinds == {"S0"} else "reflectance"
    return SpectralPicture(kind, planes, into, out, nm, units, _known(light), tuple(_notes(planes)))


def _known(light: str) -> str | None:
    """Return the name if it is that of an illuminant."""
    try:
        illuminant(light)
    except UnknownNameError:
        return None
    return light


def _notes(planes: Float[np.ndarray, "C H W"]) -> list[str]:
    missing = sum(int(np.count_nonzero(~np.isfinite(plane))) for plane in planes)
    below = sum(int(np.count_nonzero(plane < 0.0)) for plane in planes)
    notes = [f"{missing} of {planes.size} values are no numbers"] if missing else []
    return [*notes, f"{below} of {planes.size} values are below 0"] if below else notes
