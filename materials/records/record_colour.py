"""Colour of a material for lists: the reading of a 45:0 instrument under D65."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from jaxtyping import Float

from ...spectral.difference import lab_from_xyz
from ...spectral.folding import Folding
from ...spectral.illuminants import illuminant
from ...spectral.observers import Observer, observer
from ...spectral.spectrum import Spectrum
from ..core.brdf import Brdf
from ..core.directions import spherical
from ..core.fast import Fast
from ..core.points import Points
from ..core.surface import Surface
from .material import MaterialRecord

LIGHT, OBSERVER = "D65", "1931_2"
_COSINE = np.sqrt(0.5)


def record_colour(record: MaterialRecord) -> dict[str, Any] | None:
    """Compute XYZ, Lab and their conditions, rounded to four decimals, for the head; None without any colour."""
    light, eye = _conditions()
    if record.fast is not None:
        mean = from_afar(record.fast, record.surface)
        if mean is None:
            return None
        if isinstance(mean, Fast):
            xyz = xyz_at_45_0(mean, light, eye)
        else:
            xyz = np.pi * mean.xyz(Points(*annular_45_0()), Folding(eye, [light])).mean(axis=0)
        geometry = "45a:0"
    else:
        spectrum = record.measured_spectrum()
        if spectrum is None or spectrum.samples.ndim != 1:
            return None
        if spectrum.quantity == "emission":
            # A light has no white to relate to.
            xyz = eye.sensitivity(spectrum.wavelengths_nm) @ spectrum.samples
            if not xyz[1] > 0:
                return None
            return {"XYZ": _rounded(xyz / xyz[1]), "observer": OBSERVER}
        xyz, geometry = eye.weights(light, spectrum.wavelengths_nm) @ spectrum.samples, "as measured"
    lab = lab_from_xyz(xyz, _white())
    return {
        "Lab": _rounded(lab),
        "XYZ": _rounded(xyz),
        "illuminant": LIGHT,
        "observer": OBSERVER,
        "geometry": geometry,
    }


def from_afar(fast: Fast, original: Callable[[], Surface]) -> Surface | None:
    """Average a form as an instrument with an aperture wider than a texel does.

    Return the mean of a fast form, or that of the original if the form has none; None without either.
    """
    average = fast.average()
    if not average.uses_uv:
        return average
    mean = original().average()
    return None if mean.uses_uv else mean


def colour_folding() -> Folding:
    """Return the light and the observer of `record_colour`."""
    light, eye = _conditions()
    return Folding(eye, [light])


def xyz_at_45_0(fast: Fast, light: Spectrum, eye: Observer) -> Float[np.ndarray, "3"]:
    """Compute XYZ of a fast form at annular 45:0; the perfect diffuser has Y = 1."""
    wi, wo = annular_45_0()
    xyz = fast.shaded_xyz(Points(wi, wo), Folding(eye, [light]))
    return np.pi * xyz.mean(axis=0) / _COSINE


def annular_45_0() -> tuple[Float[np.ndarray, "8 3"], Float[np.ndarray, "8 3"]]:
    """Return directions to the light and to the viewer: lit at 45 degrees from eight sides, viewed along the normal.

    Eight, so that an anisotropic material has one reading for any rotation of the sample.
    """
    azimuths = np.arange(8) * np.pi / 4
    wi = spherical(np.full(azimuths.shape, np.pi / 4), azimuths)
    return wi, np.broadcast_to([0.0, 0.0, 1.0], wi.shape)


def radiance_factor_45_0(brdf: Brdf) -> Float[np.ndarray, " L"]:
    """Compute pi f_r (L,) of an annular 45:0 reading, at the BRDF's own wavelengths; the perfect diffuser has 1."""
    return np.pi * np.asarray(brdf.eval(*annular_45_0()), dtype=np.float64).mean(axis=0)


@cache
def _conditions() -> tuple[Spectrum, Observer]:
    return illuminant(LIGHT), observer(OBSERVER)


@cache
def _white() -> np.ndarray:
    light, eye = _conditions()
    return eye.white(light)


def _rounded(values: np.ndarray) -> list[float]:
    # Adding zero turns -0.0 into 0.0.
    return [round(float(value), 4) + 0.0 for value in values]
