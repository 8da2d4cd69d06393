"""A family as a tensor of three factors: of its members, of the view and of the light.

Sun et al. 2007 (eq. 2): f_r(h, wo, wi) = sum_ijk D(i,j,k) U_h(h,i) U_o(wo,j) U_i(wi,k), which is what lets light,
view and BRDF change each for itself. Directions lie on a disc; what is narrow has been taken out (`separation`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ....materials.fitting.tucker import compressed
from .disc import Disc, raised
from .families import Family
from .separation import Separated, separated

#: n_h, n_o and n_i of the paper, for Cook-Torrance; it takes 3 members for Blinn-Phong.
RANKS = (4, 8, 8)
# Places of a grid's cell that a light's value is the mean of, each way.
_PLACES = 3
# Share of the table's energy left out before the best factors of a small size are looked for.
_LOST = 1e-7


@dataclass(frozen=True, eq=False)
class BrdfTensor:
    """A family's remainder as D, U_h, U_o and U_i, and its separated highlights.

    core (h,o,i) : D. by_member (N,h), by_view (M,o), by_light (M,i) : U_h, U_o, U_i; M nodes of the disc.
    error : squared, relative to the remainder's, on the grid (what the paper's figure 5 shows).
    """

    family: Family
    highlights: Separated
    disc: Disc
    core: Float[np.ndarray, "h o i"]
    by_member: Float[np.ndarray, "N h"]
    by_view: Float[np.ndarray, "M o"]
    by_light: Float[np.ndarray, "M i"]
    error: float

    def view_weights(self, weights: Float[np.ndarray, " N"], wo: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n i"]:
        """Compute the weight of each light factor for a mixture of members, seen from `wo`: eq. 3 but for the light."""
        chosen = np.einsum("h,hoi->oi", weights @ self.by_member, self.core)
        return self.disc.look_up(self.by_view, wo) @ chosen

    def remainder(
        self, weights: Float[np.ndarray, " N"], wi: Float[np.ndarray, "n 3"], wo: Float[np.ndarray, "n 3"]
    ) -> Float[np.ndarray, " n"]:
        """f_r without the highlight, 1/sr; it may be below 0, as any truncated sum."""
        return np.sum(self.view_weights(weights, wo) * self.disc.look_up(self.by_light, wi), axis=1)

    def values(
        self, weights: Float[np.ndarray, " N"], wi: Float[np.ndarray, "n 3"], wo: Float[np.ndarray, "n 3"]
    ) -> Float[np.ndarray, " n"]:
        """f_r of a mixture of members, 1/sr."""
        amplitudes = self.highlights.amplitudes_at(weights, wo[:, 2])
        return self.remainder(weights, wi, wo) + self.highlights.values(amplitudes, wi, wo)


def brdf_tensor(
    family: Family, ranks: tuple[int, int, int] = RANKS, disc: Disc | None = None, separate: bool = True
) -> BrdfTensor:
    """Return the tensor of a family, its best of that size in the sense of squares on the disc.

    separate : whether highlights are taken out before.
    """
    from tensorly.decomposition import tucker

    disc = Disc() if disc is None else disc
    highlights = separated(family)
    if not separate:
        highlights = Separated(highlights.cosines, np.zeros_like(highlights.amplitudes), highlights.sharpness)
    table = _table(family, highlights, disc)
    few = compressed(table, _LOST)
    energy = float(np.vdot(table, table))
    kept = tuple(min(rank, size) for rank, size in zip(ranks, few.core.shape, strict=True))
    core, bases = tucker(few.core, rank=list(kept))
    core = np.asarray(core)
    by_member, by_view, by_light = (outer @ inner for outer, inner in zip(few.bases, bases, strict=True))
    left = energy - float(np.vdot(core, core))
    return BrdfTensor(family, highlights, disc, core, by_member, by_view, by_light, max(left, 0.0) / energy)


def _table(family: Family, highlights: Separated, disc: Disc) -> Float[np.ndarray, "N M M"]:
    """f_r - f_s of all members, at the disc's nodes: of the light, means over what a node stands for."""
    nodes, used = disc.nodes, np.flatnonzero(disc.used)
    wide = 2.0 / (disc.across - 1)
    at = ((np.arange(_PLACES) + 0.5) / _PLACES - 0.5) * wide
    around = np.stack(np.meshgrid(at, at), axis=-1).reshape(-1, 2)
    flat = np.linspace(-1.0, 1.0, disc.across)
    flat = np.stack(np.meshgrid(flat, flat), axis=-1).reshape(-1, 2)
    lights = [raised(flat[used] + shift) for shift in around]
    table = np.zeros((len(family), len(nodes), len(nodes)))
    eye = np.eye(len(family))
    for view in used:
        wo = nodes[view]
        seen = np.broadcast_to(wo, (len(used), 3))
        amplitudes = np.stack([highlights.amplitudes_at(one, wo[2:]) for one in eye])[:, 0]
        for wi in lights:
            away = (wi @ (wo * (-1.0, -1.0, 1.0)) - 1.0)[:, None] * highlights.sharpness
            table[:, view, used] += family.values(wi, seen) - amplitudes @ np.exp(away).T
    return table / len(lights)
