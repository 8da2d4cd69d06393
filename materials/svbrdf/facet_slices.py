"""Slices of facets over a matt body, for every roughness: environment light on all surfaces of maps.

The terms of a surface of maps (`map_planes`) share four geometries over all texels. At each of a few alphas, in a
geometric series, their slices are mixtures of the same Gaussians and bent cosines over a grid of viewers. A slice
between two alphas is a weighted sum of both mixtures: their Gaussians do not correspond, so that averaging parameters
would be meaningless.
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

    alphas (A,) : ascending. directions (A,T,Q,3) : unit, of the Gaussians. widths (A,T,Q) : logarithms of 1 / lambda.
    values (A,T,Q+9,K) : integrals of each geometry over the Gaussians; last, for the cosine, pi times the coefficients
    of `bends`. K is 4, or 6 under a coat.
    """

    alphas: Float[np.ndarray, " A"]
    directions: Float[np.ndarray, "A T Q 3"]
    widths: Float[np.ndarray, "A T Q"]
    values: Float[np.ndarray, "A T QB K"]

    @cached_property
    def energies(self) -> Float[np.ndarray, "A T K"]:
        """Integral of each geometry over all directions."""
        count = self.widths.shape[2]
        return self.values[:, :, :count].sum(axis=2) + np.einsum("b,atbk->atk", _MOMENTS, self.values[:, :, count:])

    def energy(
        self,
        theta_o: Float[np.ndarray, " N"],
        alpha: Float[np.ndarray, " N"],
        coat: Float[np.ndarray, " N"] | None = None,
    ) -> Float[np.ndarray, "N 4"]:
        """Interpolate `energies` between tabulated viewers and alphas, under a coat if there is one (`under_coat`)."""
        rough, place = self._rough(alpha), places_of(theta_o, self.widths.shape[1])
        a = np.minimum(rough.astype(np.int64), max(len(self.alphas) - 2, 0))
        t = np.minimum(place.astype(np.int64), self.widths.shape[1] - 2)
        part, above = (place - t)[:, None], np.minimum(a + 1, len(self.alphas) - 1)
        smoother, rougher = (
            (1.0 - part) * self.energies[side, t] + part * self.energies[side, t + 1] for side in (a, above)
        )
        return under_coat(smoother + (rough - a)[:, None] * (rougher - smoother), coat)

    def texels(self, energies: bool) -> tuple[Float[np.ndarray, "AT Q 4"], Float[np.ndarray, "AT C 4"]]:
        """Make the textures for the GPU, a row per alpha and viewer, float32.

        The first has axes with logarithms of 1 / lambda; the second values, followed by `energies` if requested, and
        all of the further kinds after the first four.
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
        """Locate alphas among the tabulated ones, in steps; clamped to the first and the last."""
        return np.clip(np.log(alpha / self.alphas[0]) / np.log(RATIO), 0.0, len(self.alphas) - 1.0)

    def at(
        self,
        theta_o: Float[np.ndarray, " N"],
        alpha: Float[np.ndarray, " N"],
        coat: Float[np.ndarray, " N"] | None = None,
    ) -> tuple[Float[np.ndarray, "N Q 3"], Float[np.ndarray, "N Q"], Float[np.ndarray, "N QB 4"]]:
        """Evaluate unit directions, sharpness and values, under a coat if one is given (`under_coat`).

        The Gaussians are those of the alphas on both sides, if there are several, weighted by distance; alphas beyond
        the first and the last are clamped.
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
    """Multiply the value of each geometry by the coat's transmission, 1 - w (0.04 + 0.96 fall), from `COATED_KINDS`.

    coat : w; None: return the four geometries unchanged.
    """
    if coat is None:
        return values[..., :KINDS]
    share = coat.reshape(-1, *(1,) * (values.ndim - 1))
    falls = np.stack(
        [values[..., 1] - values[..., 4], values[..., 4], values[..., 3] - values[..., 5], values[..., 5]], -1
    )
    return (1.0 - COAT_F0 * share) * values[..., :KINDS] - (1.0 - COAT_F0) * share * falls


def facet_slices(low: float, high: float, coated: bool = False) -> FacetSlices:
    """Compute slices for alphas from `low` to `high`, at the powers of `RATIO` around them; cached by these powers.

    Equal `low` and `high`, up to rounding, need that alpha alone. coated : with all `COATED_KINDS`.
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
    """Compute the slices of one alpha, cached in the user's cache directory under a hash of the code."""
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
