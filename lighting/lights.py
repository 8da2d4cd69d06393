"""Lights: what arrives from them where, each a spectrum and a photometric strength.

A new light is a class, here or in `environment/`, and a line in `light_tables.LIGHTS`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, cast

import numpy as np
from jaxtyping import Float

from ..runtime.errors import InputError
from ..spectral.observers import Observer
from ..spectral.spectrum import Spectrum, as_float
from .vectors import Number, VectorLike, finite_vector

LuminanceByField = Float[np.ndarray, "n K"]

#: A point light nearer to the middle of a scene than this share of its radius counts as if it stood that far off.
LEAST_SHARE = 0.25


@dataclass(frozen=True, eq=False)
class Arrivals:
    """Light that arrives at points.

    directions (..., 3) : unit, towards the light. illuminance_lux (...) : on a surface that faces it. distance (...) :
    to where it comes from, world units; infinite where its rays are parallel.
    """

    directions: Float[np.ndarray, "*n 3"]
    illuminance_lux: Float[np.ndarray, "*n"]
    distance: Float[np.ndarray, "*n"]


class Light(ABC):
    """Light: a relative emission, a name, a strength.

    spectra : all that it sends; several where they arrive from different directions. spectrum : their mixture.
    notes : what was assumed or left out where it was made.

    KIND, KEYS, REQUIRED, DEFAULTS : of a scene file: what `kind` calls it, its own keys with the kind of their values
    (`scene_file.keys`), those of them that must be there, and what stands for some that need not.
    """

    KIND: ClassVar[str]
    KEYS: ClassVar[Mapping[str, str]]
    REQUIRED: ClassVar[tuple[str, ...]] = ()
    DEFAULTS: ClassVar[Mapping[str, Any]] = {}

    spectrum: Spectrum
    spectra: tuple[Spectrum, ...]
    name: str
    spectrum_name: str
    notes: tuple[str, ...] = ()

    @property
    def place(self) -> Float[np.ndarray, "3"] | None:
        """Place of the light, world; None if it is infinitely far off."""
        return None

    @abstractmethod
    def counted_from(self, low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"]) -> tuple[float, float, float]:
        """Compute the illuminance on a surface that faces the light in the middle of the box from `low` to `high`, lx;
        how far off it stands; and how far off it counts as standing for that (`LEAST_SHARE`).
        """

    def with_spectrum(self, spectrum: Spectrum, name: str = "") -> Light:
        """Return the same light with another spectrum at the same strength."""
        return replace(cast(Any, self), spectrum=spectrum, spectrum_name=name)

    def for_observer(self, seen_by: Observer) -> Light:
        """Return the same light as this observer is to see it: another object only where several spectra are
        weighed."""
        return self


class DeltaLight(Light):
    """A light that reaches each point from one direction."""

    @property
    def spectra(self) -> tuple[Spectrum, ...]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Its one spectrum."""
        return (self.spectrum,)

    @abstractmethod
    def arrivals(self, points: Float[np.ndarray, "*n 3"]) -> Arrivals:
        """Compute the light arriving at each point of the world (..., 3), were nothing in between."""

    @abstractmethod
    def homogeneous(self, centre: Float[np.ndarray, "3"], radius: float) -> tuple[Float[np.ndarray, "4"], float]:
        """Return the light as renderers take it, in lengths of `radius` about `centre`.

        Returns (x, y, z, w) and E (lx): at a point p the light lies towards (x, y, z) - w p, and gives a surface that
        faces it E over the squared length of that.
        """


class SpreadLight(Light):
    """A light that reaches each point from many directions: K `spectra`, each times a luminance over directions.

    `spectrum` is the mixture of the spectra as it arrives on a horizontal plane. Points and directions are of the
    world. Luminance is in cd/m^2, of spectra whose scale does not matter.
    """

    @abstractmethod
    def luminance(self, points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]) -> LuminanceByField:
        """(n, K) cd/m^2 that arrives at each point from each unit direction, were nothing in between."""

    @abstractmethod
    def drawn(
        self, points: Float[np.ndarray, "n 3"], uniform: Float[np.ndarray, "n 2"]
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
        """Return a unit direction for each point and each pair of numbers in [0, 1), more often where more light comes
        from, and its density, 1/sr.
        """

    @abstractmethod
    def density(
        self, points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]
    ) -> Float[np.ndarray, " n"]:
        """1/sr with which `drawn` gives these directions."""

    def luminance_and_density(
        self, points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]
    ) -> tuple[LuminanceByField, Float[np.ndarray, " n"]]:
        """`luminance` and `density` of the same directions."""
        return self.luminance(points, directions), self.density(points, directions)

    @abstractmethod
    def distance(
        self, points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]
    ) -> Float[np.ndarray, " n"]:
        """Compute the distance of the light in each direction, world units: what lies beyond shades nothing."""


def strength(value: Number, field: str, unit: str) -> float:
    """Return a light's strength as a float; InputError where it is not above 0 and finite."""
    found = as_float(value)
    if not (0.0 < found < np.inf):
        raise InputError("a light of no power", field=field, found=value, expected=f"more than 0 {unit}")
    return found


def check_spectrum(spectrum: Spectrum) -> None:
    """InputError where a spectrum is not an emission."""
    if spectrum.quantity != "emission":
        raise InputError("not the spectrum of a light", field="spectrum", found=spectrum.quantity, expected="emission")


@dataclass(frozen=True, eq=False)
class DirectionalLight(DeltaLight):
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

    KIND = "directional"
    KEYS: ClassVar = {"direction_to_light": "vector", "illuminance_lux": "number"}
    DEFAULTS: ClassVar = {"direction_to_light": (-0.5, 0.6, 1.0)}

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
        check_spectrum(self.spectrum)
        object.__setattr__(self, "illuminance_lux", strength(self.illuminance_lux, "illuminance_lux", "lx"))

    def arrivals(self, points: Float[np.ndarray, "*n 3"]) -> Arrivals:
        """Return the same everywhere."""
        whole = points.shape[:-1]
        return Arrivals(
            np.broadcast_to(self.direction_to_light, points.shape),
            np.broadcast_to(np.float64(self.illuminance_lux), whole),
            np.broadcast_to(np.inf, whole),
        )

    def homogeneous(self, centre: Float[np.ndarray, "3"], radius: float) -> tuple[Float[np.ndarray, "4"], float]:
        """w = 0: infinitely far off."""
        return np.append(self.direction_to_light, 0.0), float(self.illuminance_lux)

    def counted_from(self, low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"]) -> tuple[float, float, float]:
        """Return its illuminance, from infinitely far off."""
        return float(self.illuminance_lux), np.inf, np.inf


@dataclass(frozen=True, eq=False)
class PointLight(DeltaLight):
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

    KIND = "point"
    KEYS: ClassVar = {"position": "vector", "intensity_cd": "number"}
    REQUIRED = ("position", "intensity_cd")

    position: VectorLike
    spectrum: Spectrum
    intensity_cd: Number = 1000.0
    name: str = "light"
    spectrum_name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", finite_vector(self.position, "position"))
        check_spectrum(self.spectrum)
        object.__setattr__(self, "intensity_cd", strength(self.intensity_cd, "intensity_cd", "cd"))

    @property
    def place(self) -> Float[np.ndarray, "3"]:
        """`position`."""
        return self.position

    def arrivals(self, points: Float[np.ndarray, "*n 3"]) -> Arrivals:
        """Apply the inverse square law; nothing at the very point where the light stands."""
        offset = self.position - points
        squared = np.sum(offset * offset, axis=-1)
        apart = squared > 0.0
        safe = np.where(apart, squared, 1.0)
        distance = np.sqrt(safe)
        lux = np.where(apart, self.intensity_cd / safe, 0.0)
        return Arrivals(offset / distance[..., None], lux, np.where(apart, distance, 0.0))

    def homogeneous(self, centre: Float[np.ndarray, "3"], radius: float) -> tuple[Float[np.ndarray, "4"], float]:
        """w = 1: where it stands."""
        return np.append((self.position - centre) / radius, 1.0), self.intensity_cd / radius**2

    def counted_from(self, low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"]) -> tuple[float, float, float]:
        """Return the inverse square law of one point says nothing of what surfaces about it receive, and there is none
        near the middle of a room: a light that is nearer than `LEAST_SHARE` of the box's half diagonal counts from
        there.
        """
        distance = float(np.linalg.norm(self.position - 0.5 * (low + high)))
        counted = max(distance, LEAST_SHARE * 0.5 * float(np.linalg.norm(high - low)))
        return self.intensity_cd / counted**2, distance, counted
