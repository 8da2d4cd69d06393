"""Pictures in files as layers: linear XYZ and spectra in OpenEXR."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError, UnknownNameError
from ...runtime.files import existing_file
from ...spectral.bispectral import ANTI_STOKES_TOLERANCE, band_widths
from ...spectral.formats.exr import MOST_SAMPLES, channel_names, check_size, read_picture
from ...spectral.formats.import_options import NO_ANSWER, ImportOptions
from ...spectral.formats.spectral_exr import BISPECTRAL, RELATIVE_UNITS, SpectralImage, read_spectral_exr
from ...spectral.illuminants import illuminant
from ...spectral.observers import Observer, observer
from ...spectral.spectrum import Spectrum
from .row import FLOAT32_ROUNDOFF, HALF_ROUNDOFF, PixelLayer, Pixels, Row, RowName

# Attributes of a header that are part of a picture's name or worth a line.
_SAID = ("scene", "camera", "material", "illuminant", "observer", "renderer", "software", "picture")


@dataclass(frozen=True)
class SeenSpectra:
    """Lights and observer by which spectra become colours; `answer`: for readings with missing information."""

    lights: tuple[str, ...] = ("D65", "A", "FL11")
    observer: str = "1931_2"
    answer: ImportOptions = NO_ANSWER

    @property
    def words(self) -> str:
        """Lights and observer as a sentence."""
        return f"Spectra are seen under {', '.join(self.lights)} by the {observer(self.observer).name}."


def header(path: Path) -> dict[str, str]:
    """Return the texts of an OpenEXR's header that describe its content.

    Raises
    ------
    InputError : no OpenEXR picture, or damaged.
    """
    attributes = check_size(path, MOST_SAMPLES)[0].attributes
    return {key: text for key in _SAID if isinstance(text := attributes.get(key), str)}


def xyz_layer(path: Path) -> PixelLayer:
    """Return a picture in XYZ; its header is read now, its pixels on demand."""
    path = existing_file(path)
    return PixelLayer(partial(read_xyz, path), path, header(path))


def read_xyz(path: Path) -> Pixels:
    """Return an OpenEXR picture with channels X, Y, Z, a white in `whiteXYZ`, and coverage A if present.

    Raises
    ------
    InputError : no whole picture, other channels, or no white.
    """
    picture = read_picture(path, MOST_SAMPLES)
    planes = [picture.channels.get(name) for name in "XYZ"]
    if any(plane is None for plane in planes):
        raise InputError(
            "not a picture in XYZ",
            file=path,
            field="channels",
            found=", ".join(list(picture.channels)[:6]),
            expected="X, Y and Z",
            hint="write it with `metamer render -o picture.exr`",
        )
    half = any(plane.dtype == np.float16 for plane in planes if plane is not None)
    xyz = np.stack([np.asarray(plane, dtype=np.float32) for plane in planes], axis=-1)
    coverage = picture.channels.get("A")
    coverage = np.ones(xyz.shape[:2], np.float32) if coverage is None else coverage.astype(np.float32)
    return Pixels(xyz, coverage, _white(path, picture.attributes), HALF_ROUNDOFF if half else FLOAT32_ROUNDOFF)


def _white(path: Path, attributes: Mapping[str, Any]) -> Float[np.ndarray, "3"]:
    found = np.asarray(attributes.get("whiteXYZ", ()), dtype=np.float64).ravel()
    if found.shape != (3,) or not (np.isfinite(found).all() and (found > 0).all()):
        raise InputError(
            "the picture does not say its white",
            file=path,
            field="whiteXYZ",
            found=attributes.get("whiteXYZ", "nothing"),
            expected="X, Y and Z of the perfect diffuser, as an attribute of the header",
            hint="colour differences are relative to a white: write the picture with one",
        )
    return found


def is_spectral(path: Path) -> bool:
    """Return whether an OpenEXR picture has spectra and no XYZ."""
    with path.open("rb") as file:
        names = channel_names(path, file.read(16))
    return not {"X", "Y", "Z"} <= set(names) and any(name.split(".")[0] in ("T", "S0") for name in names)


def picture_rows(path: Path, material: str | None, seen: SeenSpectra) -> list[Row]:
    """Return the rows of one picture: one for XYZ; one per light for reflectances; one for emission.

    An emission is relative to its own light.

    Parameters
    ----------
    material : the name of its rows; None takes that of the header.

    Raises
    ------
    InputError : the header cannot be read, or an emission without a light that is known.
    """
    path = existing_file(path)
    said = header(path)
    scene, view = (said.get("scene", ""), said.get("camera", "")) if material is None else ("", "")
    name = RowName(material or said.get("material", ""), said.get("illuminant", ""), said.get("observer", ""))
    name = name._replace(scene=scene, view=view)
    if not is_spectral(path):
        return [Row(name, {"picture": xyz_layer(path)})]
    eye = observer(seen.observer).name
    names = _names(path)
    if any(channel.startswith("T.") for channel in names):
        # The light of a fluorescent surface is no multiple of the illuminant: there is no one spectrum to draw.
        spectrum = None if any(BISPECTRAL.match(channel) for channel in names) else partial(_spectrum, path)
        return [
            Row(
                name._replace(light=light, observer=eye),
                {"picture": PixelLayer(partial(_reflected, path, light, seen.observer), path, said, spectrum=spectrum)},
            )
            for light in seen.lights
        ]
    name = name._replace(observer=eye)
    load = partial(_emitted, path, name.light, seen.observer)
    return [Row(name, {"picture": PixelLayer(load, path, said, spectrum=partial(_spectrum, path))})]


def _names(path: Path) -> Sequence[str]:
    with path.open("rb") as file:
        return channel_names(path, file.read(16))


def _reflected(path: Path, light: str, eye: str) -> Pixels:
    """Return a picture of reflectances under one light."""
    image = read_spectral_exr(path)
    source, sees = illuminant(light), observer(eye)
    weights = sees.weights(source, image.spectrum.wavelengths_nm)
    if image.reradiation is None:
        return _folded(image, image.spectrum.samples @ weights.T, weights.sum(axis=1))
    try:
        xyz = fluorescent_xyz(image, source, sees)
    except InputError as refusal:
        raise refusal.at(file=path) from None
    return _folded(image, xyz, weights.sum(axis=1))


def _emitted(path: Path, light: str, eye: str) -> Pixels:
    """Return a picture of radiances, relative to the perfect diffuser under the light named in the header."""
    image = read_spectral_exr(path)
    if image.units != RELATIVE_UNITS or not light:
        raise InputError(
            "radiances without a white",
            file=path,
            field="emissiveUnits" if light else "illuminant",
            found=(image.units or "nothing") if light else "nothing",
            expected=f'"{RELATIVE_UNITS}", and the name of the light',
            hint="write it with `metamer render --spectral --illuminant NAME`",
        )
    seen = observer(eye)
    try:
        white = seen.white(illuminant(light))
    except UnknownNameError as reason:
        raise reason.at(file=path, field="illuminant") from None
    # Under E the weights are the colour-matching functions: Y of radiance 1 is 1.
    weights = seen.weights(illuminant("E"), image.spectrum.wavelengths_nm)
    return _folded(image, image.spectrum.samples @ weights.T, white)


def _spectrum(path: Path, place: tuple[int, int]) -> tuple[Float[np.ndarray, " L"], Float[np.ndarray, " L"]]:
    """Read the spectrum of one pixel."""
    spectrum = read_spectral_exr(path).spectrum
    return spectrum.wavelengths_nm, spectrum.samples[place].astype(np.float64)


def _folded(image: SpectralImage, xyz: Float[np.ndarray, "H W 3"], white: Float[np.ndarray, "3"]) -> Pixels:
    """Return folded spectra; sums have at least the precision of their terms."""
    stored = HALF_ROUNDOFF if image.half else FLOAT32_ROUNDOFF
    return Pixels(xyz, np.ones(xyz.shape[:2], np.float32), white, stored)


def fluorescent_xyz(image: SpectralImage, light: Spectrum, observer: Observer) -> Float[np.ndarray, "H W 3"]:
    """Compute XYZ of the light from each pixel under `light`; Y of the perfect diffuser is 1, pixels may exceed it.

    Raises
    ------
    InputError : a pixel emits more power than it absorbs, or light at shorter wavelengths.
    """
    assert image.reradiation is not None
    height, width, bands, _ = image.reradiation.shape
    matrices = image.reradiation.reshape(-1, bands, bands)
    widths = band_widths(image.spectrum.wavelengths_nm)
    power = np.einsum("noi,o->ni", matrices, widths) / widths
    upward = np.max([matrices[:, out, out + 1 :].max(axis=1) for out in range(bands - 1)], axis=0)
    # A matrix is checked as it is made: those of the pixels that are likeliest to be refused.
    surface = image.bispectral(*divmod(int(power.max(axis=1).argmax()), width))
    if upward.max() > ANTI_STOKES_TOLERANCE:
        image.bispectral(*divmod(int(upward.argmax()), width))
    # All matrices have the axes of this one, and so what its bands take of the light, and what is seen of them.
    weights = observer.sensitivity(surface.wavelengths_out_nm)[:, :, None] * surface.excitation(light)
    weights /= observer.luminous(light)
    diagonal = np.arange(bands)
    weights[:, diagonal, diagonal] = observer.weights(light, surface.wavelengths_out_nm)
    return (matrices.reshape(len(matrices), -1) @ weights.reshape(3, -1).T).reshape(height, width, 3)
