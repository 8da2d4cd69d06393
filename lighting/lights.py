"""Lights: base classes, and delta lights, each with a spectrum and a photometric strength.

A new light is a class, here or in `environment/`, and an entry of `light_tables.LIGHTS`.
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

#: Least distance, as a share of the scene's radius, of a point light from the scene's centre for its illuminance there.
LEAST_SHARE = 0.25


@dataclass(frozen=True, eq=False)
class Arrivals:
    """Incident light of a delta light at points.

    directions (..., 3) : unit, towards the light. illuminance_lux (...) : on a surface facing it. distance (...) : to
    the light, world units; infinite for parallel rays.
    """

    directions: Float[np.ndarray, "*n 3"]
    illuminance_lux: Float[np.ndarray, "*n"]
    distance: Float[np.ndarray, "*n"]


class Light(ABC):
    """Base class of lights: a relative emission, a name, a strength.

    spectra : all that it emits; several if they depend on direction. spectrum : their mixture.
    notes : assumptions and omissions made while constructing it.

    KIND, KEYS, REQUIRED, DEFAULTS : for scene files: value of `kind`, own keys with the kind of their values
    (`scene_file.keys`), required keys, and defaults of optional ones.
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
        """Position of the light, world; None at infinity."""
        return None

    @abstractmethod
    def counted_from(self, low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"]) -> tuple[float, float, float]:
        """Return the illuminance on a surface at the centre of the box from `low` to `high` that faces the light, lx;
        its distance; and the distance used for the illuminance (`LEAST_SHARE`).
        """

    def with_spectrum(self, spectrum: Spectrum, name: str = "") -> Light:
        """Return the same light with another spectrum at the same strength."""
        return replace(cast(Any, self), spectrum=spectrum, spectrum_name=name)

    def for_observer(self, seen_by: Observer) -> Light:
        """Return the light with its spectra weighted for an observer; the same object unless it has several spectra."""
        return self


class DeltaLight(Light):
    """Light that reaches each point from one direction."""

    @property
    def spectra(self) -> tuple[Spectrum, ...]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """`spectrum` alone."""
        return (self.spectrum,)

    @abstractmethod
    def arrivals(self, points: Float[np.ndarray, "*n 3"]) -> Arrivals:
        """Compute the unoccluded light incident at each point (..., 3), world."""

    @abstractmethod
    def homogeneous(self, centre: Float[np.ndarray, "3"], radius: float) -> tuple[Float[np.ndarray, "4"], float]:
        """Return the light in homogeneous coordinates, in lengths of `radius` about `centre`.

        Returns (x, y, z, w) and E (lx): at a point p the vector to the light is (x, y, z) - w p, and the illuminance on
        a surface facing it is E over its squared length.
        """


class SpreadLight(Light):
    """Area or environment light: K `spectra`, each times a luminance over directions.

    `spectrum` is the mixture of the spectra incident on a horizontal plane. Points and directions are in the world.
    Luminance is in cd/m^2; the scale of spectra does not matter.
    """

    @abstractmethod
    def luminance(self, points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]) -> LuminanceByField:
        """Return the unoccluded luminance (n, K), cd/m^2, at each point from each unit direction."""

    @abstractmethod
    def drawn(
        self, points: Float[np.ndarray, "n 3"], uniform: Float[np.ndarray, "n 2"]
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
        """Importance sample a unit direction for each point and pair of numbers in [0, 1); return it and its
        probability density, 1/sr.
        """

    @abstractmethod
    def density(
        self, points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]
    ) -> Float[np.ndarray, " n"]:
        """Return the probability density of `drawn` for these directions, 1/sr."""

    def luminance_and_density(
        self, points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]
    ) -> tuple[LuminanceByField, Float[np.ndarray, " n"]]:
        """Return `luminance` and `density` of the same directions."""
        return self.luminance(points, directions), self.density(points, directions)

    @abstractmethod
    def distance(
        self, points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]
    ) -> Float[np.ndarray, " n"]:
        """Compute the distance of the light in each direction, world units; geometry beyond it does not occlude it."""


def strength(value: Number, field: str, unit: str) -> float:
    """Return a light's strength as a float; InputError unless it is positive and finite."""
    found = as_float(value)
    if not (0.0 < found < np.inf):
        raise InputError("a light of no power", field=field, found=value, expected=f"more than 0 {unit}")
    return found


def check_spectrum(spectrum: Spectrum) -> None:
    """Raise InputError if a spectrum is not an emission."""
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
    spectrum_name : name of the spectrum, for reports.

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
        """Return the same direction and illuminance everywhere."""
        whole = points.shape[:-1]
        return Arrivals(
            np.broadcast_to(self.direction_to_light, points.shape),
            np.broadcast_to(np.float64(self.illuminance_lux), whole),
            np.broadcast_to(np.inf, whole),
        )

    def homogeneous(self, centre: Float[np.ndarray, "3"], radius: float) -> tuple[Float[np.ndarray, "4"], float]:
        """Return w = 0: at infinity."""
        return np.append(self.direction_to_light, 0.0), float(self.illuminance_lux)

    def counted_from(self, low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"]) -> tuple[float, float, float]:
        """Return its illuminance and infinite distances."""
        return float(self.illuminance_lux), np.inf, np.inf


@dataclass(frozen=True, eq=False)
class PointLight(DeltaLight):
    """Isotropic point light: illuminance falls with the square of the distance (E = I / d^2).

    Parameters
    ----------
    position : (3,) world coordinates; one world unit is a metre.
    spectrum : emission, relative: its scale does not matter.
    intensity_cd : luminous intensity, cd, > 0. It does not illuminate a surface at its own position.
    spectrum_name : name of the spectrum, for reports.

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
        """Apply the inverse square law; 0 at the light's own position."""
        offset = self.position - points
        squared = np.sum(offset * offset, axis=-1)
        apart = squared > 0.0
        safe = np.where(apart, squared, 1.0)
        distance = np.sqrt(safe)
        lux = np.where(apart, self.intensity_cd / safe, 0.0)
        return Arrivals(offset / distance[..., None], lux, np.where(apart, distance, 0.0))

    def homogeneous(self, centre: Float[np.ndarray, "3"], radius: float) -> tuple[Float[np.ndarray, "4"], float]:
        """Return w = 1 and the position."""
        return np.append((self.position - centre) / radius, 1.0), self.intensity_cd / radius**2

    def counted_from(self, low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"]) -> tuple[float, float, float]:
        """Return illuminance and distances, with the distance clamped to `LEAST_SHARE` of the box's half diagonal: near
        a light the illuminance at one point does not represent that of the surfaces around it.
        """
        distance = float(np.linalg.norm(self.position - 0.5 * (low + high)))
        counted = max(distance, LEAST_SHARE * 0.5 * float(np.linalg.norm(high - low)))
        return self.intensity_cd / counted**2, distance, counted
