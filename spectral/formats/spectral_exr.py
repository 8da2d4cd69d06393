"""Spectral OpenEXR images in the layout of Fichet, Pacanowski and Wilkie (JCGT 10(3), 2021).

Channels `S0.<wavelength>` carry emission, `T.<wavelength>` reflectance, `T.<in>.<out>` re-radiation of a fluorescent
surface; wavelengths are written as `550,000000nm`, with a comma for the decimal mark, in any unit of metres, or as
frequencies in hertz.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ..axis_letters import Wavelengths
from ..bispectral import Bispectral
from ..illuminants import illuminant
from ..observers import observer
from ..spectrum import Quantity, Spectrum, check_values
from ..upsampling import xyz_from_rgb
from .exr import MAGIC, MOST_SAMPLES, read_picture, write_exr
from .import_options import NO_ANSWER, ImportOptions
from .registry import SpectralFile, names_its_file
from .shared.decisions import divisor_by_format
from .shared.entry_rules import Gathering, in_visible

NAME = "spectral OpenEXR"
SUFFIXES = (".exr",)
#: A person may say that reflectances are in percent, or as dark as they are, against the names of the channels.
SCALED = True
# A picture of more colours than this is a texture, not a chart.
MOST_COLOURS = 64

#: Radiances whose Y is 1 where the perfect diffuser would be seen under the scene's reference illuminance.
RELATIVE_UNITS = "relative, 1 for the perfect diffuser under equal energy"
#: A length or a frequency in the name of a channel: number, prefix and unit, as `wavelength_of` takes them.
LENGTH = r"(\d+(?:[.,]\d*)?(?:[eE][+-]?\d+)?)(da|[YZEPTGMkhdcmunpfazy])?(m|Hz)"
#: Names of channels that keep their wavelength, and of pairs of wavelengths.
PLAIN = re.compile(rf"^(?:.*\.)?(S0|T)\.{LENGTH}$")
BISPECTRAL = re.compile(rf"^(?:.*\.)?T\.{LENGTH}\.{LENGTH}$")
_UNIT = rb"(?:da|[YZEPTGMkhdcmunpfazy])?(?:m|Hz)"
_IN_HEADER = re.compile(rb"(?:S0|T)\.\d[\d,.eE+-]*" + _UNIT + rb"(?:\.\d[\d,.eE+-]*" + _UNIT + rb")?\0")
_LONGEST_HEADER = 2**20
_POWERS = {"Y": 24, "Z": 21, "E": 18, "P": 15, "T": 12, "G": 9, "M": 6, "k": 3, "h": 2, "da": 1, "d": -1, "c": -2}
_POWERS |= {"m": -3, "u": -6, "n": -9, "p": -12, "f": -15, "a": -18, "z": -21, "y": -24}
_LIGHT_M_PER_S = 299792458.0
_QUANTITY: dict[str, Quantity] = {"S0": "emission", "T": "reflectance"}


def recognises(path: Path, head: bytes) -> bool:
    """True for OpenEXR with spectral channels, which stand in its header, after attributes of any length."""
    if not head.startswith(MAGIC):
        return False
    if _IN_HEADER.search(head):
        return True
    with path.open("rb") as file:
        return _IN_HEADER.search(file.read(_LONGEST_HEADER)) is not None


@names_its_file
def read(path: Path, answer: ImportOptions = NO_ANSWER) -> SpectralFile:
    """One spectrum for each colour of a chart, in the order in which its rows show them.

    Raises
    ------
    InputError
        Not a spectral picture, of more than `MOST_COLOURS` colours (a texture), or fluorescent; all of it darker than
        any surface, unless a person says so.
    """
    image = read_spectral_exr(path)
    if image.reradiation is not None:
        raise InputError(
            "a fluorescent surface is more than one spectrum",
            found="re-radiation channels",
            expected="plain reflectance or emission",
            hint="import it as a material: metamer catalogue import",
        )
    samples = image.spectrum.samples
    pixels = samples.reshape(-1, samples.shape[-1])
    # A texture shows in a few thousand pixels; sorting all of them would take long.
    few = np.unique(pixels[:: max(len(pixels) // 4096, 1)], axis=0)
    colours, first, count = np.unique(
        pixels if len(few) <= MOST_COLOURS else few, axis=0, return_index=True, return_counts=True
    )
    if len(colours) > MOST_COLOURS:
        raise InputError(
            "a texture, not a chart of spectra",
            found=f"{len(colours)} different pixels or more",
            expected=f"at most {MOST_COLOURS} colours",
            hint="import it as a material: metamer catalogue import",
        )
    grid, quantity = image.spectrum.wavelengths_nm, image.spectrum.quantity
    scale = divisor_by_format(colours[:, in_visible(grid)].ravel(), quantity, NAME, answer)
    gathered = Gathering(path, NAME)
    units = {"units": image.units or "not stated"} if quantity == "emission" else {}
    for place, index in enumerate(np.argsort(first), 1):
        row, column = divmod(int(first[index]), samples.shape[1])
        name = path.stem if len(colours) == 1 else f"{path.stem} {place}"
        details = {"first pixel": f"row {row}, column {column}", "pixels": str(int(count[index]))} | units
        gathered.add_of_format(name, grid, colours[index], quantity, scale, details=details)
    return gathered.finish({"picture": f"{samples.shape[1]} x {samples.shape[0]}"})


@dataclass(frozen=True, eq=False)
class SpectralImage:
    """One spectrum a pixel.

    Parameters
    ----------
    spectrum : values (H,W,L); for a fluorescent surface the part that keeps its wavelength.
    reradiation : (H,W,L,L) or None; [..., out, in], the diagonal included: a Donaldson matrix a pixel.
    units : of emission, as the file gives them.
    half : whether the file holds some of it in half precision.
    """

    spectrum: Spectrum
    reradiation: Float[np.ndarray, "H W L L"] | None = None
    units: str | None = None
    half: bool = False

    def bispectral(self, row: int, column: int) -> Bispectral:
        """Return the Donaldson matrix of one pixel; an ordinary reflectance where the file holds no re-radiation.

        The layout leaves the unit of re-radiation open. It is taken as power in a band for power in a band, as
        `Bispectral` has it; a file in other units sends out more than it takes in and is refused, or nearly nothing.
        """
        grid = self.spectrum.wavelengths_nm
        if self.reradiation is None:
            pixel = Spectrum.sampled(grid, self.spectrum.samples[row, column], self.spectrum.quantity)
            return Bispectral.diagonal(pixel)
        return Bispectral(grid, grid, self.reradiation[row, column])


def write_spectral_exr(
    path: str | Path,
    image: Spectrum,
    units: str = "W.m^-2.sr^-1.nm^-1",
    attributes: Mapping[str, str] | None = None,
) -> None:
    """Write a spectral image with values (H,W,L): emission as `S0`, reflectance as `T`, and an sRGB preview.

    The preview integrates emission with the CIE 1931 2 degree observer and shows reflectance under D65.

    Parameters
    ----------
    attributes : further text for the header, by name.
    """
    values, wavelengths_nm = image.samples, image.wavelengths_nm
    if values.ndim != 3:
        raise InputError("not an image", field="values", found=f"shape {values.shape}", expected="(H, W, L)")
    if image.quantity == "transmittance":
        raise InputError(
            "the layout has no channels for transmittance",
            file=path,
            field="quantity",
            found=image.quantity,
            expected="reflectance or emission",
        )
    write_spectral_texture(path, values, wavelengths_nm, image.quantity == "emission", units, attributes)


def write_spectral_texture(
    path: str | Path,
    values: Float[np.ndarray, "H W L"],
    wavelengths_nm: Wavelengths,
    emits: bool,
    units: str = "W.m^-2.sr^-1.nm^-1",
    attributes: Mapping[str, str] | None = None,
) -> None:
    """Write values as they are, reflectances below 0 and above 1 too: what a texture holds is kept, not judged."""
    light = illuminant("E" if emits else "D65")
    # Linear sRGB, the preview that the layout asks for.
    preview = values @ np.linalg.solve(xyz_from_rgb(), observer("1931_2").weights(light, wavelengths_nm)).T
    channels = {name: preview[..., index] for index, name in enumerate("RGB")}
    for index, wavelength in enumerate(wavelengths_nm):
        channels[f"{'S0' if emits else 'T'}.{_length(wavelength)}"] = values[..., index]
    header = {**(attributes or {}), "spectralLayoutVersion": "1.0"}
    if emits:
        header["emissiveUnits"] = units
    write_exr(path, header, channels)


def write_bispectral_exr(
    path: str | Path, surface: Bispectral, size: tuple[int, int] = (1, 1), attributes: Mapping[str, str] | None = None
) -> None:
    """Write a fluorescent surface as a picture of one colour: `T.<nm>` its reflectance, `T.<in>.<out>` re-radiation.

    Entries of the matrix are power in a band for power in a band, as `SpectralImage` reads them. Bands that excite
    where nothing leaves get a reflectance of 0. The preview is what shows under D65, fluorescence included.
    """
    into, out = surface.wavelengths_in_nm, surface.wavelengths_out_nm
    xyz = surface.fold(illuminant("D65"), observer("1931_2"))
    values = dict(zip("RGB", np.linalg.solve(xyz_from_rgb(), xyz).tolist(), strict=True))
    row = {wavelength: index for index, wavelength in enumerate(out.tolist())}
    for column, absorbed in enumerate(into.tolist()):
        leaving = surface.matrix[:, column]
        values[f"T.{_length(absorbed)}"] = leaving[row[absorbed]] if absorbed in row else 0.0
        for emitted, value in zip(out.tolist(), leaving.tolist(), strict=True):
            if value > 0 and emitted != absorbed:
                values[f"T.{_length(absorbed)}.{_length(emitted)}"] = value
    header = {**(attributes or {}), "spectralLayoutVersion": "1.0"}
    write_exr(path, header, {name: np.full(size, value) for name, value in values.items()})


def _length(wavelength_nm: float) -> str:
    """Return a wavelength as the layout writes it: 550,000000nm."""
    return f"{wavelength_nm:.6f}nm".replace(".", ",")


@names_its_file
def read_spectral_exr(path: Path) -> SpectralImage:
    """Read emission, reflectance or a bispectral reflectance; wavelengths are sorted by number.

    Raises
    ------
    InputError
        No spectral channels, emission and reflectance in one file, or values that the quantity cannot take.
    """
    picture = read_picture(path, MOST_SAMPLES)
    plain, shifted = {}, {}
    for name, pixels in picture.channels.items():
        if match := PLAIN.match(name):
            held, key = plain, (match[1], wavelength_of(*match.group(2, 3, 4)))
        elif match := BISPECTRAL.match(name):
            held, key = shifted, (wavelength_of(*match.group(1, 2, 3)), wavelength_of(*match.group(4, 5, 6)))
        else:
            continue
        if key in held:
            raise InputError(
                "two channels hold the same wavelength",
                field=name,
                expected="each wavelength once",
                hint="the file has layers or views; save one of them alone",
            )
        held[key] = pixels
    _check_shapes([*plain.values(), *shifted.values()], len(plain) if shifted else 1)
    kinds = sorted({kind for kind, _ in plain})
    if len(kinds) != 1:
        raise InputError(
            "no spectral channels" if not kinds else "emission and reflectance in one file",
            field="channels",
            found=", ".join(list(picture.channels)[:6]),
            expected="channels such as T.550,000000nm or S0.550,000000nm",
        )
    quantity = _QUANTITY[kinds[0]]
    wavelengths_nm = np.array(sorted(wavelength for _, wavelength in plain))
    values = np.stack([plain[kinds[0], wavelength] for wavelength in wavelengths_nm], axis=-1).astype(np.float64)
    check_values(values, wavelengths_nm, quantity, field=f"{kinds[0]} channels")
    spectrum = Spectrum.sampled(wavelengths_nm, values, quantity)
    # A damaged header may have an attribute of a type of its own, which is no text.
    units = stated if isinstance(stated := picture.attributes.get("emissiveUnits"), str) else None
    half = any(pixels.dtype == np.float16 for pixels in (*plain.values(), *shifted.values()))
    if not shifted:
        return SpectralImage(spectrum, None, units, half)
    index = {wavelength: position for position, wavelength in enumerate(wavelengths_nm)}
    reradiation = np.zeros((*values.shape, wavelengths_nm.size))
    diagonal = np.arange(wavelengths_nm.size)
    reradiation[..., diagonal, diagonal] = values
    for (absorbed, emitted), pixels in shifted.items():
        if absorbed not in index or emitted not in index:
            raise InputError(
                "a re-radiation channel without its wavelength",
                field=f"T.{absorbed:g}nm.{emitted:g}nm",
                expected="both wavelengths among the T channels",
            )
        if not np.isfinite(pixels).all() or pixels.min() < 0:
            raise InputError(
                "re-radiation is negative or not a number",
                field=f"T.{absorbed:g}nm.{emitted:g}nm",
                found=f"{pixels[~np.isfinite(pixels) | (pixels < 0)][0]:g}",
                expected="finite values, >= 0",
            )
        reradiation[..., index[emitted], index[absorbed]] = pixels
    return SpectralImage(spectrum, reradiation, units, half)


def _check_shapes(channels: list[np.ndarray], bands: int) -> None:
    """One size for all channels, and few enough samples: a matrix of all pairs of bands takes `bands` times as many."""
    shapes = sorted({pixels.shape for pixels in channels})
    if len(shapes) > 1:
        raise InputError(
            "channels of different sizes",
            field="channels",
            found=" and ".join(f"{width} x {height}" for height, width in shapes[:2]),
            expected="one size for all wavelengths",
            hint="save the picture without subsampling",
        )
    samples = bands**2 * shapes[0][0] * shapes[0][1] if shapes and bands > 1 else 0
    if samples > MOST_SAMPLES:
        raise InputError(
            "too large a picture",
            field="re-radiation",
            found=f"{shapes[0][1]} x {shapes[0][0]} pixels of {bands} x {bands} bands",
            expected=f"at most {MOST_SAMPLES} samples in all",
            hint="cut out a part, or save it smaller",
        )


def wavelength_of(number: str, prefix: str | None, unit: str) -> float:
    """Nanometres of a channel's name, such as ("550,0", "n", "m") or ("545.0", "T", "Hz")."""
    value = float(number.replace(",", ".")) * 10.0 ** _POWERS.get(prefix or "", 0)
    if unit == "Hz":
        value = _LIGHT_M_PER_S / value if value > 0 else np.inf
    return round(value * 1e9, 6)
