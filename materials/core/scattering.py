"""A surface in two: what it scatters so evenly that light alone says where to look, and what has highlights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ...spectral.folding import Folding
from .brdf import Brdf
from .points import Points
from .sampling import DirectionSampler
from .surface import Surface


class Scattering:
    """A surface and its lobes as sums over drawn directions take them; tables of directions are made when asked for.

    Parameters
    ----------
    surface : any. One that varies over a texture, or sends out light at other wavelengths, is not taken apart.

    Attributes
    ----------
    even, glossy : `Surface`s whose sum is `surface`; None where there is no such part.
    """

    def __init__(self, surface: Surface) -> None:
        self.surface = surface
        apart = isinstance(surface, Brdf) and surface.bispectral is None and not surface.uses_uv
        lobes = [lobe.brdf for lobe in surface.lobes()] if apart else [surface]
        drawn = [DirectionSampler(lobe) for lobe in lobes]
        even = [lobe for lobe, sampler in zip(lobes, drawn, strict=True) if sampler.even]
        glossy = [(lobe, sampler) for lobe, sampler in zip(lobes, drawn, strict=True) if not sampler.even]
        self.even = _together(even)
        self.glossy = _together([lobe for lobe, _ in glossy])
        self._glossy = glossy[0][1] if len(glossy) == 1 else None

    @cached_property
    def sampler(self) -> DirectionSampler:
        """Sampler of all that the surface scatters."""
        return DirectionSampler(self.surface)

    @cached_property
    def glossy_sampler(self) -> DirectionSampler:
        """Sampler of `glossy`, where that is not None."""
        if self.glossy is None:
            raise ValueError("a surface without highlights")
        return self._glossy or DirectionSampler(self.glossy)


@dataclass(frozen=True, eq=False)
class _Sum(Surface):
    """Several surfaces at once."""

    lobes: Sequence[Surface]

    @property
    def wavelengths_nm(self) -> Float[np.ndarray, " L"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Wavelengths of each of them, nm."""
        return self.lobes[0].wavelengths_nm

    @property
    def isotropic(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        """True if all are."""
        return all(lobe.isotropic for lobe in self.lobes)

    def at(self, points: Points) -> Float[np.ndarray, "N L"]:
        """The sum."""
        return np.sum([lobe.at(points) for lobe in self.lobes], axis=0)

    def xyz(self, points: Points, folding: Folding) -> Float[np.ndarray, "N M3"]:
        """The sum, each folded for itself."""
        return np.sum([lobe.xyz(points, folding) for lobe in self.lobes], axis=0)


def _together(lobes: Sequence[Surface]) -> Surface | None:
    if len(lobes) < 2:
        return lobes[0] if lobes else None
    return _Sum(lobes)
