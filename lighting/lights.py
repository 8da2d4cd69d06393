"""Lights of no size: a far one and a near one, each a spectrum and a photometric strength."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ..spectral.errors import InputError
from ..spectral.spectrum import Spectrum, as_float
from .vectors import Number, VectorLike, finite_vector


def _strength(value: Number, field: str, unit: str) -> float:
    strength = as_float(value)
    if not (0.0 < strength < np.inf):
        raise InputError("a light of no power", field=field, found=value, expected=f"more than 0 {unit}")
    return strength


def _check_spectrum(spectrum: Spectrum) -> None:
    if spectrum.quantity != "emission":
        raise InputError("not the spectrum of a light", field="spectrum", found=spectrum.quantity, expected="emission")


@dataclass(frozen=True, eq=False)
class DirectionalLight:
    """Parallel light, as from the sun.

    Parameters
    ----------
    direction_to_light : (3,) from the scene towards the light; made a unit vector.
    spectrum : emission, relative: its scale does not matter.
    illuminance_lux : on a surface that faces the light, lx, > 0.
    spectrum_name : what reports call the spectrum.

    Raises
    ------
    InputError : no power, no direction, or a spectrum that is not an emission.
    """

    direction_to_light: VectorLike
    spectrum: Spectrum
    illuminance_lux: Number = 1000.0
    name: str = "light"
    spectrum_name: str = ""

    def __post_init__(self) -> None:
        direction = finite_vector(self.direction_to_light, "direction_to_light")
        length = float(np.linalg.norm(direction))
        if length == 0.0:
            raise InputError(
                "a direction of no length",
                field="direction_to_light",
                found=direction.tolist(),
                expected="three numbers that are not all 0",
            )
        object.__setattr__(self, "direction_to_light", direction / length)
        _check_spectrum(self.spectrum)
        object.__setattr__(self, "illuminance_lux", _strength(self.illuminance_lux, "illuminance_lux", "lx"))

    def incident(self, points: Float[np.ndarray, "*n 3"]) -> tuple[Float[np.ndarray, "*n 3"], Float[np.ndarray, "*n"]]:
        """Unit directions to the light and the illuminance (lx) on a surface that faces it, at each point."""
        return (
            np.broadcast_to(self.direction_to_light, points.shape),
            np.broadcast_to(np.float64(self.illuminance_lux), points.shape[:-1]),
        )

    def with_spectrum(self, spectrum: Spectrum, name: str = "") -> DirectionalLight:
        """The same light with another spectrum at the same illuminance."""
        return replace(self, spectrum=spectrum, spectrum_name=name)


@dataclass(frozen=True, eq=False)
class PointLight:
    """Light from one point, equal in all directions: illuminance falls with the square of the distance (E = I / d^2).

    Parameters
    ----------
    position : (3,) world coordinates; one world unit is a metre.
    spectrum : emission, relative: its scale does not matter.
    intensity_cd : luminous intensity, cd, > 0. It does nothing to a surface at the very point where it stands.
    spectrum_name : what reports call the spectrum.

    Raises
    ------
    InputError : no power, or a spectrum that is not an emission.
    """

    position: VectorLike
    spectrum: Spectrum
    intensity_cd: Number = 1000.0
    name: str = "light"
    spectrum_name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", finite_vector(self.position, "position"))
        _check_spectrum(self.spectrum)
        object.__setattr__(self, "intensity_cd", _strength(self.intensity_cd, "intensity_cd", "cd"))

    def incident(self, points: Float[np.ndarray, "*n 3"]) -> tuple[Float[np.ndarray, "*n 3"], Float[np.ndarray, "*n"]]:
        """Unit directions to the light and the illuminance (lx) on a surface that faces it, at each point."""
        offset = self.position - points
        squared = np.sum(offset * offset, axis=-1)
        apart = squared > 0.0
        safe = np.where(apart, squared, 1.0)
        return offset / np.sqrt(safe)[..., None], np.where(apart, self.intensity_cd / safe, 0.0)

    def with_spectrum(self, spectrum: Spectrum, name: str = "") -> PointLight:
        """The same light with another spectrum at the same intensity."""
        return replace(self, spectrum=spectrum, spectrum_name=name)


Light = DirectionalLight | PointLight
