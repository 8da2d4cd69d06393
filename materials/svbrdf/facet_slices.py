"""Slices of facets over a matt body, for every roughness: what all surfaces of maps gather of light from all around.

Of the terms of a surface of maps (`map_planes`) four geometries are common to all texels. At each of a few alphas,
each a fixed ratio from the next, their slices are mixtures of the same Gaussians and bent cosines over a grid of
viewers. A slice between two alphas is a share of both: their Gaussians are not each other's, and means of them would
be none.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property, lru_cache, partial
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...runtime.code_hash import files_hash
from ...runtime.disk_cache import cache_folder
from ...runtime.kept_arrays import kept
from ..analytic.metallic_roughness import schlick
from ..slices.fit import mixtures
from ..slices.view_slices import places_of
from .coat import COAT_F0
from .facets import facets

#: Gaussians a slice.
LOBES = 6
#: Ratio of one tabulated alpha to the one before.
RATIO = 1.5
#: The geometries: body and body at grazing, facets and facets at grazing.
KINDS = 4
#: Under a coat also those of body and facets with the fall twice over, which the coat's own multiplies them by.
COATED_KINDS = 6
# Rooms of `materials` whose code decides them.
_CODE = ("analytic", "core", "slices", "svbrdf")
# Weights in the placement of Gaussians: of highlights, the more at grazing, where all materials share them; of the body
# they only take what its bent cosine leaves over.
_COUNTS = np.array([0.1, 0.1, 1.0, 4.0])
# Kinds that are subtracted under a coat move no Gaussian.
_COATED_COUNTS = np.array([*_COUNTS, 1e-3, 1e-3])
# Integrals of `bends` over the cosine's hemisphere, over pi.
_MOMENTS = np.array([1.0, 0.0, 0.0, 2.0 / 3.0, 0.0, 0.0, 0.0, 0.0, 0.5])


@dataclass(frozen=True, eq=False)
class FacetSlices:
    """Slices at A alphas and T polar angles of the viewer, who stands above +x.

    alphas (A,) : rising. directions (A,T,Q,3) : unit, of the Gaussians. widths (A,T,Q) : logarithms of 1 / lambda.
    values (A,T,Q+9,K) : integrals of each geometry over the Gaussians, and of the cosine, last, pi times what each of
    `bends` is multiplied with. K is 4, or 6 under a coat.
    """

    alphas: Float[np.ndarray, " A"]
    directions: Float[np.ndarray, "A T Q 3"]
    widths: Float[np.ndarray, "A T Q"]
    values: Float[np.ndarray, "A T QB K"]

    @cached_property
    def energies(self) -> Float[np.ndarray, "A T K"]:
        """The integral of each geometry over all directions."""
        count = self.widths.shape[2]
        return self.values[:, :, :count].sum(axis=2) + np.einsum("b,atbk->atk", _MOMENTS, self.values[:, :, count:])

    def energy(
        self,
        theta_o: Float[np.ndarray, " N"],
        alpha: Float[np.ndarray, " N"],
        coat: Float[np.ndarray, " N"] | None = None,
    ) -> Float[np.ndarray, "N 4"]:
        """`energies`, between the tabulated ones, `under_coat`."""
        rough, place = self._rough(alpha), places_of(theta_o, self.widths.shape[1])
        a = np.minimum(rough.astype(np.int64), max(len(self.alphas) - 2, 0))
        t = np.minimum(place.astype(np.int64), self.widths.shape[1] - 2)
        part, above = (place - t)[:, None], np.minimum(a + 1, len(self.alphas) - 1)
        smoother, rougher = (
            (1.0 - part) * self.energies[side, t] + part * self.energies[side, t + 1] for side in (a, above)
        )
        return under_coat(smoother + (rough - a)[:, None] * (rougher - smoother), coat)

    def texels(self, energies: bool) -> tuple[Float[np.ndarray, "AT Q 4"], Float[np.ndarray, "AT C 4"]]:
        """Make the texels for the GPU, a row an alpha and viewer, float32: axes with logarithms of 1 / lambda; values
        with, where it is asked for, `energies` behind them, and behind the first four kinds of all the next.
        """
        rows = self.widths.shape[0] * self.widths.shape[1]
        axes = np.concatenate([self.directions, self.widths[..., None]], axis=-1)
        tabled = np.concatenate([self.values, self.energies[:, :, None]], axis=2) if energies else self.values
        fours = [tabled[..., :KINDS]]
        if tabled.shape[3] > KINDS:
            fours.append(np.pad(tabled[..., KINDS:], [(0, 0)] * 3 + [(0, 2 * KINDS - tabled.shape[3])]))
        return (
            axes.reshape(rows, -1, 4).astype(np.float32),
            np.concatenate(fours, axis=2).reshape(rows, -1, KINDS).astype(np.float32),
        )

    def _rough(self, alpha: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
        """Find where among the tabulated alphas one is; held beyond the first and the last."""
        return np.clip(np.log(alpha / self.alphas[0]) / np.log(RATIO), 0.0, len(self.alphas) - 1.0)

    def at(
        self,
        theta_o: Float[np.ndarray, " N"],
        alpha: Float[np.ndarray, " N"],
        coat: Float[np.ndarray, " N"] | None = None,
    ) -> tuple[Float[np.ndarray, "N Q 3"], Float[np.ndarray, "N Q"], Float[np.ndarray, "N QB 4"]]:
        """Unit directions, sharpness and values, `under_coat`: the Gaussians of the alphas on both sides, where there
        are several, each by its share; held beyond the first and the last alpha.
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
            under_coat(np.concatenate([*gaussians, cosine], axis=1), coat),
        )


def under_coat(
    values: Float[np.ndarray, "N *Q K"], coat: Float[np.ndarray, " N"] | None
) -> Float[np.ndarray, "N *Q 4"]:
    """Compute the transmission of a coat in each geometry, 1 - w (0.04 + 0.96 fall), of `COATED_KINDS`; of four without
    one.
    """
    if coat is None:
        return values[..., :KINDS]
    share = coat.reshape(-1, *(1,) * (values.ndim - 1))
    falls = np.stack(
        [values[..., 1] - values[..., 4], values[..., 4], values[..., 3] - values[..., 5], values[..., 5]], -1
    )
    return (1.0 - COAT_F0 * share) * values[..., :KINDS] - (1.0 - COAT_F0) * share * falls


def facet_slices(low: float, high: float, coated: bool = False) -> FacetSlices:
    """Slices of the alphas from `low` to `high`: of powers of `RATIO` around, or of that alone where both are equal but
    for rounding. coated : of all `COATED_KINDS`.

    Worked out when first asked for, and shared by all whose powers are the same.
    """
    if high <= low * (1.0 + 1.0e-6):
        return _slices((float(low),), coated)
    first, last = np.floor(np.log(low) / np.log(RATIO)), np.ceil(np.log(high) / np.log(RATIO))
    return _slices(tuple(RATIO**power for power in range(int(first), int(last) + 1)), coated)


@lru_cache(maxsize=32)
def _slices(alphas: tuple[float, ...], coated: bool) -> FacetSlices:
    found = [_of_alpha(alpha, coated) for alpha in alphas]
    return FacetSlices(np.array(alphas), *(np.stack(each) for each in zip(*found, strict=True)))


@lru_cache(maxsize=64)
def _of_alpha(alpha: float, coated: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Kept from run to run in the user's cache, by the code that works it out."""
    name = f"{_code()[:16]}-{float(alpha).hex()}{'-coated' if coated else ''}.npz"
    held = kept(cache_folder("facets") / name, partial(_worked_out, alpha, coated))
    return held["directions"], held["widths"], held["values"]


@cache
def _code() -> str:
    root = Path(__file__).parents[2]
    files = [file for folder in _CODE for file in (root / "materials" / folder).rglob("*.py")]
    return files_hash(root, files, ("numpy", "scipy"))


def _worked_out(alpha: float, coated: bool) -> dict[str, np.ndarray]:
    counts = _COATED_COUNTS if coated else _COUNTS

    def terms(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        fall = schlick(wi, wo)
        spread = np.broadcast_to(alpha * alpha * np.array([1.0, 0.0, 1.0]), wi.shape)
        body, shine = np.full(len(wi), 1.0 / np.pi), facets(wi, wo, spread)
        rest = 1.0 - fall
        kinds = [rest * body, fall * body, rest * shine, fall * shine]
        kinds += [fall * fall * body, fall * fall * shine] if coated else []
        return counts * np.stack(kinds, axis=1)

    directions, sharpness, values = mixtures(terms, len(counts), True, LOBES)
    return {"directions": directions[:, 0], "widths": -np.log(sharpness[:, 0]), "values": values[:, 0] / counts}
