"""Tristimulus values stated by a file, compared with those of its spectra."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..runtime.errors import InputError
from .difference import delta_e_lab, lab_from_xyz, xyz_from_lab
from .formats.registry import SpectralEntry, StatedColour
from .illuminants import illuminant
from .observers import EFFICACY, Observer, observer
from .spectrum import Spectrum

#: Conditions of graphic arts (ISO 13655), taken for a file that does not state any.
USUAL_ILLUMINANT, USUAL_OBSERVER = "D50", "1931_2"

# Whites that instruments and charts are computed for, in the order of how common they are.
_WHITES = [(light, angle) for light in ("D50", "D65", "A", "C", "FL2", "FL11") for angle in ("1931_2", "1964_10")]


@dataclass(frozen=True, eq=False)
class StatedComparison:
    """Stated colour and its recomputation.

    Parameters
    ----------
    stated : as in the file, the reference of the difference.
    recomputed : (3,) in the space and on the scale of `stated`.
    delta_e94 : CIE 1994; a light, scaled to the stated luminance, is compared with the stated light as white.
    illuminant, observer : of the computation; no illuminant for a light.
    assumed : assumptions about unstated facts, a clause each.
    lumens_ratio : for a light, stated Y over 683 lm/W times the integral of y-bar and the spectrum: 1 if the spectrum
        is in W and Y in lm per the same area and angle, 0.001 if it is in mW.
    """

    stated: StatedColour
    recomputed: Float[np.ndarray, "3"]
    delta_e94: float
    illuminant: str | None
    observer: str
    assumed: tuple[str, ...] = ()
    lumens_ratio: float | None = None


def compared(entry: SpectralEntry) -> tuple[StatedComparison, ...]:
    """Recompute every colour stated with a spectrum.

    The file's illuminant and observer are used; if it states XYZ and Lab together without these, they follow from the
    white between the two (`implied_white`); else D50 and 2 degrees are assumed.

    Raises
    ------
    InputError
        An illuminant or observer that is not tabulated here.
    """
    return tuple(
        _light(entry.spectrum, stated) if entry.spectrum.quantity == "emission" else _surface(entry, stated)
        for stated in entry.stated
        if entry.spectrum.quantity != "emission" or stated.space == "XYZ"
    )


def _surface(entry: SpectralEntry, stated: StatedColour) -> StatedComparison:
    light, angle, assumed = stated.illuminant, stated.observer, []
    if light is None or angle is None:
        implied = implied_white(entry.stated)
        if implied and light in (None, implied[0]) and angle in (None, implied[1]):
            assumed.append(f"the file's XYZ and Lab belong to {implied[0]} and {implied[1]}")
            light, angle = implied
    if light is None:
        light = USUAL_ILLUMINANT
        assumed.append(f"illuminant {light}, for the file names none")
    if angle is None:
        angle = USUAL_OBSERVER
        assumed.append(f"observer {angle}, for the file names none")
    seen, power = observer(angle), illuminant(light)
    white = seen.white(power)
    xyz = seen.weights(power, entry.spectrum.wavelengths_nm) @ entry.spectrum.samples
    lab = lab_from_xyz(xyz, white)
    reference = lab_from_xyz(stated.values / 100.0, white) if stated.space == "XYZ" else stated.values
    recomputed = 100.0 * xyz if stated.space == "XYZ" else lab
    return StatedComparison(stated, recomputed, float(delta_e_lab(reference, lab)), light, angle, tuple(assumed))


def _light(spectrum: Spectrum, stated: StatedColour) -> StatedComparison:
    angle = stated.observer or USUAL_OBSERVER
    assumed = () if stated.observer else (f"observer {angle}, for the file names none",)
    seen = observer(angle)
    xyz = _tristimulus(seen, spectrum)
    if not (stated.values > 0.0).all() or not xyz[1] > 0.0:
        raise InputError(
            "a light without luminance cannot be compared",
            field="stated XYZ",
            found=f"{stated.values}, and {xyz} from the spectrum",
            expected="positive tristimulus values",
        )
    scaled = xyz * (stated.values[1] / xyz[1])
    white = stated.values / stated.values[1]
    difference = delta_e_lab(lab_from_xyz(white, white), lab_from_xyz(scaled / stated.values[1], white))
    ratio = float(stated.values[1] / (EFFICACY * xyz[1]))
    return StatedComparison(stated, scaled, float(difference), None, angle, assumed, ratio)


def _tristimulus(seen: Observer, spectrum: Spectrum) -> np.ndarray:
    """Integrate (3,) the colour-matching functions times a spectrum, zero beyond its samples."""
    return seen.sensitivity(spectrum.wavelengths_nm) @ spectrum.samples


def implied_white(stated: tuple[StatedColour, ...]) -> tuple[str, str] | None:
    """Find the illuminant and observer of the white that converts a stated XYZ to the stated Lab.

    CIELAB solved for the white (CIE 015:2018 eq. 8.3-8.5). None if a space is missing, the sample is too dark, or the
    white is none of the usual ones to half a percent.
    """
    by_space = {colour.space: colour.values for colour in reversed(stated)}
    if len(by_space) < 2 or by_space["Lab"][0] < 20.0 or not (by_space["XYZ"] > 0.5).all():
        return None
    relative = xyz_from_lab(by_space["Lab"], np.ones(3))
    if not (relative > 1e-3).all():
        return None
    white = by_space["XYZ"] / 100.0 / relative
    distances = [float(np.abs(observer(angle).white(illuminant(light)) - white).max()) for light, angle in _WHITES]
    nearest = int(np.argmin(distances))
    return _WHITES[nearest] if distances[nearest] < 0.005 else None
