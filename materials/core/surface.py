"""Interface of all surfaces: originals, and the fast forms that approximate them."""

from __future__ import annotations

import abc
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np
from jaxtyping import Bool, Float

from ...spectral.bispectral import Bispectral
from ...spectral.folding import Folding
from .points import Points

#: A function of N directions to the light and N to the viewer.
Directed = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class SumOfTerms:
    """A BRDF as R functions of direction, `terms(wi, wo)` (N,R) above the horizon, times R spectra (R,L).

    key : equal for equal functions of any surfaces, whose sums over light are equal too.
    """

    terms: Directed
    spectra: Float[np.ndarray, "R L"]
    key: tuple[Hashable, ...]

    def __call__(self, weights: Float[np.ndarray, "L C"]) -> Directed:
        """Fold the spectra: return the function that evaluates the BRDF `@ weights`, (N,C)."""
        return partial(_times, self.terms, self.spectra @ weights)


def constant_term(spectrum: Float[np.ndarray, " L"]) -> SumOfTerms:
    """Make the term of an ideally diffuse surface."""
    return SumOfTerms(_one, spectrum[None], ("constant",))


def _one(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    return np.ones((len(wi), 1))


def _times(terms: Directed, colours: np.ndarray, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    return terms(wi, wo) @ colours


class Surface(abc.ABC):
    """Surface that scatters light, point by point.

    Attributes
    ----------
    wavelengths_nm : (L,) ascending.
    isotropic : True if rotating both directions about the normal changes nothing.
    bispectral : fluorescence, light that leaves at other wavelengths than it came in (`fluorescent`); None without any.
    uses_uv : True if it needs the texture coordinates of points.
    points_at_once : preferred number of points per call, if the caller stores nothing large per point.
    """

    wavelengths_nm: Float[np.ndarray, " L"]
    isotropic: bool
    bispectral: Bispectral | None = None
    uses_uv: ClassVar[bool] = False
    points_at_once: ClassVar[int] = 8192

    def own_form(self, budget: float = 0.5) -> Surface | None:
        """Return the fast form (`fast.Fast`) that this surface derives itself; None if one has to be fitted.

        budget : ΔE94 that the 99th percentile should not exceed, for forms that are not exact.
        """
        return None

    @property
    def measured_to(self) -> tuple[float, float] | None:
        """Polar angles, degrees, of the outermost measured views and lights, beyond which values are clamped.

        90 if all angles were measured. None if the surface is defined by a formula, or if the angles are unknown.
        """
        return None

    @property
    def cutout(self) -> Cutout | None:
        """Opacity mask of the surface; None if it has no holes."""
        return None

    def average(self) -> Surface:
        """Average the surface over its texture into a uniform one, as seen from afar."""
        return self

    def from_afar(self) -> Surface:
        """Return `average`, also for forms without one of their own kind."""
        return self.average()

    @property
    def sum_of_terms(self) -> SumOfTerms | None:
        """The surface as terms that others may share; None if it is not known as such."""
        return None

    @abc.abstractmethod
    def at(self, points: Points) -> Float[np.ndarray, "N L"]:
        """Evaluate f_r in 1/sr at each point, without the cosine; zero if a direction is on or below the horizon."""

    def xyz(self, points: Points, folding: Folding) -> Float[np.ndarray, "N M3"]:
        """Compute reflected and emitted colour, over all wavelengths, under M lights; 1/sr, without the cosine."""
        return self.at(points) @ folding.weights(self.wavelengths_nm)


class Cutout(abc.ABC):
    """Opacity mask of a surface: opaque parts are visible, cast shadows and stop rays, holes do none of these."""

    @abc.abstractmethod
    def holes(self, uv: Float[np.ndarray, "N 2"]) -> Bool[np.ndarray, " N"]:
        """Return whether there is a hole at texture coordinates of the mesh."""
