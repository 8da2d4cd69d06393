"""Division of a surface into an even part, for which sampling the light suffices, and a glossy part."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Float

from ...spectral.folding import Folding
from .brdf import Brdf, eval_lit
from .points import Points
from .sampling import DirectionSampler
from .surface import SumOfTerms, Surface


class Scattering:
    """A surface and its parts as used in sums over sampled directions; sampling tables are made on request.

    Parameters
    ----------
    surface : any. One that varies over a texture, or is fluorescent, is not divided.

    Attributes
    ----------
    even, glossy : `Surface`s whose sum is `surface`; None if there is no such part.
    """

    def __init__(self, surface: Surface) -> None:
        self.surface = surface
        apart = isinstance(surface, Brdf) and surface.bispectral is None and not surface.uses_uv
        lobes = [lobe.brdf for lobe in surface.lobes()] if apart else [surface]
        drawn = [_sampler(lobe) for lobe in lobes]
        even = [lobe for lobe, sampler in zip(lobes, drawn, strict=True) if sampler.even]
        glossy = [(lobe, sampler) for lobe, sampler in zip(lobes, drawn, strict=True) if not sampler.even]
        self.even = _together(even)
        self.glossy = _together([lobe for lobe, _ in glossy])
        self._glossy = glossy[0][1] if len(glossy) == 1 else None

    @cached_property
    def sampler(self) -> DirectionSampler:
        """Sampler of the whole surface."""
        return _sampler(self.surface)

    @cached_property
    def glossy_sampler(self) -> DirectionSampler:
        """Sampler of `glossy`, which must not be None."""
        if self.glossy is None:
            raise ValueError("a surface without highlights")
        return self._glossy or _sampler(self.glossy)


def sampling_key(surface: Surface) -> tuple[Hashable, ...] | None:
    """Return a key that is equal for surfaces sampled alike; None if the surface is not known as terms.

    Several terms are sampled in proportion to their spectra, a single one whatever its colour.
    """
    terms = surface.sum_of_terms
    if terms is None:
        return None
    if len(terms.spectra) == 1 and terms.spectra.any():
        return terms.key
    return (*terms.key, terms.spectra.tobytes(), surface.wavelengths_nm.tobytes())


def _sampler(surface: Surface) -> DirectionSampler:
    """Return the sampler of a surface, cached for consecutive surfaces that are sampled alike."""
    key, terms = sampling_key(surface), surface.sum_of_terms
    if key is None or terms is None:
        return DirectionSampler(surface)
    return _kept_sampler(_Lobe(key, surface if key != terms.key else _Grey(surface, terms)))


@dataclass(frozen=True)
class _Lobe:
    key: tuple[Hashable, ...]
    surface: Surface = field(compare=False)


@lru_cache(maxsize=32)
def _kept_sampler(lobe: _Lobe) -> DirectionSampler:
    return DirectionSampler(lobe.surface)


class _Grey(Surface):
    """A single term with a constant spectrum, so that equal terms have bit-equal tables."""

    def __init__(self, surface: Surface, terms: SumOfTerms) -> None:
        self.wavelengths_nm, self.isotropic, self._terms = surface.wavelengths_nm, surface.isotropic, terms.terms

    def at(self, points: Points) -> Float[np.ndarray, "N L"]:
        """Return the term."""
        return np.repeat(eval_lit(self._terms, 1, points.wi, points.wo), len(self.wavelengths_nm), axis=1)

    def xyz(self, points: Points, folding: Folding) -> Float[np.ndarray, "N M3"]:
        """Return the term as each of X, Y and Z."""
        return np.repeat(eval_lit(self._terms, 1, points.wi, points.wo), 3 * len(folding.lights), axis=1)


@dataclass(frozen=True, eq=False)
class _Sum(Surface):
    """Sum of several surfaces."""

    lobes: Sequence[Surface]

    @property
    def wavelengths_nm(self) -> Float[np.ndarray, " L"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Wavelengths of each of them, nm."""
        return self.lobes[0].wavelengths_nm

    @property
    def isotropic(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        """True if all are."""
        return all(lobe.isotropic for lobe in self.lobes)

    @property
    def sum_of_terms(self) -> SumOfTerms | None:
        """Terms of all summands, if all have some."""
        each = [lobe.sum_of_terms for lobe in self.lobes]
        if any(terms is None for terms in each):
            return None
        known = [terms for terms in each if terms is not None]

        def joined(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
            return np.concatenate([terms.terms(wi, wo) for terms in known], axis=1)

        return SumOfTerms(joined, np.concatenate([terms.spectra for terms in known]), tuple(t.key for t in known))

    def at(self, points: Points) -> Float[np.ndarray, "N L"]:
        """Return the sum."""
        return np.sum([lobe.at(points) for lobe in self.lobes], axis=0)

    def xyz(self, points: Points, folding: Folding) -> Float[np.ndarray, "N M3"]:
        """Return the sum, each summand folded separately."""
        return np.sum([lobe.xyz(points, folding) for lobe in self.lobes], axis=0)


def _together(lobes: Sequence[Surface]) -> Surface | None:
    if len(lobes) < 2:
        return lobes[0] if lobes else None
    return _Sum(lobes)
