"""Slices of facets over a matt body, for every roughness: what all surfaces of maps gather of light from all around.

Of the terms of a surface of maps (`map_planes`) four geometries are common to all texels. At each of a few alphas,
each a fixed ratio from the next, their slices are mixtures of the same Gaussians and bent cosines over a grid of
viewers. A slice between two alphas is a share of both: their Gaussians are not each other's, and means of them would
be none.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Float

from ..analytic.metallic_roughness import schlick
from ..slices.fit import mixtures
from ..slices.view_slices import places_of
from .facets import facets

#: Gaussians a slice.
LOBES = 6
#: From one tabulated alpha to the next.
RATIO = 1.5
#: The geometries: body and body at grazing, facets and facets at grazing.
KINDS = 4
# What counts where Gaussians are placed: highlights, at grazing those that all materials share the more; of the body
# they only take what its bent cosine leaves over.
_COUNTS = np.array([0.1, 0.1, 1.0, 4.0])
# Integrals of `bends` over the cosine's hemisphere, over pi.
_MOMENTS = np.array([1.0, 0.0, 0.0, 2.0 / 3.0, 0.0, 0.0, 0.0, 0.0, 0.5])


@dataclass(frozen=True, eq=False)
class FacetSlices:
    """Slices at A alphas and T polar angles of the viewer, who stands above +x.

    alphas (A,) : rising. directions (A,T,Q,3) : unit, of the Gaussians. widths (A,T,Q) : logarithms of 1 / lambda.
    values (A,T,Q+9,4) : integrals of each geometry over the Gaussians, and of the cosine, last, pi times what each of
    `bends` is multiplied with.
    """

    alphas: Float[np.ndarray, " A"]
    directions: Float[np.ndarray, "A T Q 3"]
    widths: Float[np.ndarray, "A T Q"]
    values: Float[np.ndarray, "A T QB 4"]

    @cached_property
    def energies(self) -> Float[np.ndarray, "A T 4"]:
        """The integral of each geometry over all directions."""
        count = self.widths.shape[2]
        return self.values[:, :, :count].sum(axis=2) + np.einsum("b,atbk->atk", _MOMENTS, self.values[:, :, count:])

    def energy(self, theta_o: Float[np.ndarray, " N"], alpha: Float[np.ndarray, " N"]) -> Float[np.ndarray, "N 4"]:
        """`energies`, between the tabulated ones."""
        rough, place = self._rough(alpha), places_of(theta_o, self.widths.shape[1])
        a = np.minimum(rough.astype(np.int64), max(len(self.alphas) - 2, 0))
        t = np.minimum(place.astype(np.int64), self.widths.shape[1] - 2)
        part, above = (place - t)[:, None], np.minimum(a + 1, len(self.alphas) - 1)
        smoother, rougher = (
            (1.0 - part) * self.energies[side, t] + part * self.energies[side, t + 1] for side in (a, above)
        )
        return smoother + (rough - a)[:, None] * (rougher - smoother)

    def _rough(self, alpha: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
        """Where among the tabulated alphas one is; held beyond the first and the last."""
        return np.clip(np.log(alpha / self.alphas[0]) / np.log(RATIO), 0.0, len(self.alphas) - 1.0)

    def at(
        self, theta_o: Float[np.ndarray, " N"], alpha: Float[np.ndarray, " N"]
    ) -> tuple[Float[np.ndarray, "N Q 3"], Float[np.ndarray, "N Q"], Float[np.ndarray, "N QB 4"]]:
        """Unit directions, sharpness and values: the Gaussians of the alphas on both sides, where there are several,
        each by its share; held beyond the first and the last alpha.
        """
        rough = self._rough(alpha)
        polar, count = self.widths.shape[1:]
        place = places_of(theta_o, polar)
        below = np.minimum(place.astype(np.int64), polar - 2)
        smoother = np.minimum(rough.astype(np.int64), max(len(self.alphas) - 2, 0))
        sides = [(smoother, 1.0 - (rough - smoother)), (smoother + 1, rough - smoother)]
        parts = []
        for a, share in sides[: len(self.alphas)]:

            def mixed(table: np.ndarray, a: np.ndarray = a) -> np.ndarray:
                part = (place - below).reshape(-1, *(1,) * (table.ndim - 2))
                return (1.0 - part) * table[a, below] + part * table[a, below + 1]

            directions, value = mixed(self.directions), mixed(self.values) * share[:, None, None]
            directions /= np.linalg.norm(directions, axis=2, keepdims=True)
            parts.append((directions, np.exp(-mixed(self.widths)), value[:, :count], value[:, count:]))
        directions, sharpness, gaussians, cosines = zip(*parts, strict=True)
        cosine = cosines[0] if len(parts) == 1 else cosines[0] + cosines[1]
        return (
            np.concatenate(directions, axis=1),
            np.concatenate(sharpness, axis=1),
            np.concatenate([*gaussians, cosine], axis=1),
        )


def facet_slices(low: float, high: float) -> FacetSlices:
    """Slices of the alphas from `low` to `high`: of powers of `RATIO` around, or of that alone where both are equal but
    for rounding.

    Worked out when first asked for, and shared by all whose powers are the same.
    """
    if high <= low * (1.0 + 1.0e-6):
        return _slices((float(low),))
    first, last = np.floor(np.log(low) / np.log(RATIO)), np.ceil(np.log(high) / np.log(RATIO))
    return _slices(tuple(RATIO**power for power in range(int(first), int(last) + 1)))


@lru_cache(maxsize=32)
def _slices(alphas: tuple[float, ...]) -> FacetSlices:
    found = [_of_alpha(alpha) for alpha in alphas]
    return FacetSlices(np.array(alphas), *(np.stack(each) for each in zip(*found, strict=True)))


@lru_cache(maxsize=64)
def _of_alpha(alpha: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    def terms(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        fall = schlick(wi, wo)
        spread = np.broadcast_to(alpha * alpha * np.array([1.0, 0.0, 1.0]), wi.shape)
        body, shine = np.full(len(wi), 1.0 / np.pi), facets(wi, wo, spread)
        rest = 1.0 - fall
        return _COUNTS * np.stack([rest * body, fall * body, rest * shine, fall * shine], axis=1)

    directions, sharpness, values = mixtures(terms, KINDS, True, LOBES)
    return directions[:, 0], -np.log(sharpness[:, 0]), values[:, 0] / _COUNTS
