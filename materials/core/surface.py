"""The interface of everything that light falls on: originals, and the fast forms that stand for them."""

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

    key : equal for equal functions, of whichever surface: sums of them over light are the same.
    """

    terms: Directed
    spectra: Float[np.ndarray, "R L"]
    key: tuple[Hashable, ...]

    def __call__(self, weights: Float[np.ndarray, "L C"]) -> Directed:
        """Fold the spectra: what gives the BRDF `@ weights`, (N,C)."""
        return partial(_times, self.terms, self.spectra @ weights)


def constant_term(spectrum: Float[np.ndarray, " L"]) -> SumOfTerms:
    """Terms of a surface that scatters alike in all directions."""
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
    isotropic : True where turning both directions about the normal changes nothing.
    bispectral : what also leaves at other wavelengths than it came in (`fluorescent`); None where nothing does.
    uses_uv : whether it has to know where on its texture a point is.
    points_at_once : as many as it is best asked for in one call, of points of which nothing large is held.
    """

    wavelengths_nm: Float[np.ndarray, " L"]
    isotropic: bool
    bispectral: Bispectral | None = None
    uses_uv: ClassVar[bool] = False
    points_at_once: ClassVar[int] = 8192

    def own_form(self, budget: float = 0.5) -> Surface | None:
        """Return the fast form (`fast.Fast`) that this surface knows itself; None where one has to be fitted.

        budget : ΔE94 that the 99th percentile should not exceed, for those that are not exact.
        """
        return None

    @property
    def measured_to(self) -> tuple[float, float] | None:
        """Degrees from the normal beyond which views, and beyond which light, were not measured and are held; 90 where
        all are. None where a rule or a formula says all, or nobody says.
        """
        return None

    @property
    def cutout(self) -> Cutout | None:
        """Opacity mask of the surface; None if it has no holes."""
        return None

    def average(self) -> Surface:
        """Average the surface into one that is alike everywhere, as it is seen from afar."""
        return self

    def from_afar(self) -> Surface:
        """`average`, also of forms that have none of their own kind."""
        return self.average()

    @property
    def sum_of_terms(self) -> SumOfTerms | None:
        """The surface as terms that others may have too; None where it is not known as such."""
        return None

    @abc.abstractmethod
    def at(self, points: Points) -> Float[np.ndarray, "N L"]:
        """f_r in 1/sr at each point, without the cosine; zero where either direction is on or below the horizon."""

    def xyz(self, points: Points, folding: Folding) -> Float[np.ndarray, "N M3"]:
        """Return all that leaves in colour, at every wavelength, under each of M lights; 1/sr, without the cosine."""
        return self.at(points) @ folding.weights(self.wavelengths_nm)


class Cutout(abc.ABC):
    """Opacity mask of a surface: what is there is seen, casts shadows and stops rays, a hole does none of these."""

    @abc.abstractmethod
    def holes(self, uv: Float[np.ndarray, "N 2"]) -> Bool[np.ndarray, " N"]:
        """Return whether nothing is there, at texture coordinates of the mesh."""
