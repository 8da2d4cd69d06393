"""BTFs in light from all around: what a basis of light loses, and what all of it together does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from ...materials.btf.gathering import BtfGathering
from ...materials.btf.hemisphere import Hemisphere
from ...materials.btf.images import BtfImages
from ...materials.btf.light_basis import balanced_lights, hats_at, light_functions, spread
from ...materials.btf.texels import BtfTexels
from ...spectral.basis import SpectralBasis
from ...spectral.difference import delta_e_xyz
from ..papers.harmonics import harmonics
from .environments import PlacedLight, environments, tilted_lights

#: Terms of the balanced light basis that is judged without a codec.
TERMS = 16
# Texels that are judged, and others that the basis is balanced for; one view of so many.
_JUDGED, _LEARNT, _VIEWS = 96, 64, 3
# Rows that the basis is balanced for.
_ROWS = 6000
# Directions that hats are written in harmonics by.
_DIRECTIONS = 20000

#: Function from one light's hats, looked-up functions or harmonics to weights of measured lights, (Lt,K).
Weights = Callable[[PlacedLight], Float[np.ndarray, "Lt K"]]


@dataclass(frozen=True, eq=False)
class Surround:
    """Some texels of a BTF, seen from some views in every light.

    texels (T,) : which. views (V',) : which. values (T,V',Lt,J) : as measured. learnt (n,Lt) : rows of other texels.
    """

    lights: Hemisphere
    basis: SpectralBasis
    placed: Sequence[PlacedLight]
    environments: int
    texels: Int[np.ndarray, " T"]
    views: Int[np.ndarray, " v"]
    values: Float[np.ndarray, "T v Lt J"]
    learnt: Float[np.ndarray, "n Lt"]

    @classmethod
    def of(cls, images: BtfImages, lights: Sequence[PlacedLight], environments: int, seed: int = 0) -> Surround:
        """Texels drawn at random, and each third view."""
        count = images.height * images.width
        drawn = np.random.default_rng(seed).permutation(count)[: _JUDGED + _LEARNT]
        views = np.arange(0, len(images.views), _VIEWS)
        found = np.empty((len(drawn), len(views), len(images.lights), images.basis.size), dtype=np.float32)
        for place, view in enumerate(views.tolist()):
            for light in range(len(images.lights)):
                found[:, place, light] = images.image(view, light).reshape(count, -1)[drawn]
        # A small sample has no further texels: the same ones are learnt from and judged.
        judged = drawn[:_JUDGED]
        rest = found[_JUDGED:] if count > _JUDGED else found
        rows = rest.transpose(0, 1, 3, 2).reshape(-1, len(images.lights)).astype(np.float64)
        some = rows[:: max(1, len(rows) // _ROWS)]
        values = found[: len(judged)]
        return cls(images.lights, images.basis, lights, environments, judged, views, values, some)

    @property
    def light(self) -> str:
        """Light in words, for rows."""
        return f"{self.environments} environments x {len(self.placed) // self.environments} turns"

    def error(
        self,
        weights: Weights,
        values: Float[np.ndarray, "T v Lt J"] | None = None,
        basis: SpectralBasis | None = None,
    ) -> tuple[float, float, float]:
        """ΔE94 (mean, 95th and 99th percentile) over texels, views and lights.

        values : decoded ones, in `basis`; None: what was measured.
        """
        shown = self.values if values is None else values
        off = []
        for light in self.placed:
            xyz = _colours(self.values, light.hats, light, self.basis)
            made = _colours(shown, weights(light), light, self.basis if basis is None else basis)
            off.append(delta_e_xyz(xyz, made, light.white).ravel())
        every = np.concatenate(off)
        p95, p99 = np.percentile(every, (95.0, 99.0))
        return float(every.mean()), float(p95), float(p99)

    def balanced(self, terms: int = TERMS) -> Weights:
        """Weigh by the balanced light basis of so many terms."""
        found = balanced_lights(self.learnt, self.lights, terms)
        both = found.analysis @ found.synthesis.T
        return lambda light: both @ light.hats

    def harmonic(self) -> Weights:
        """Weigh by 25 spherical harmonics of hats and light (Mueller, Meseth and Klein 2004, section 4.1)."""
        around = spread(_DIRECTIONS, -1.0)
        both = hats_at(self.lights, around).T @ harmonics(around) * (4.0 * np.pi / len(around))
        return lambda light: both @ light.harmonics

    def decoded(self, texels: BtfTexels) -> Float[np.ndarray, "T v Lt J"]:
        """Return the judged texels of a form."""
        numbers = texels.form.number.ravel()[self.texels]
        found = [
            np.einsum("vlcj,c->vlj", texels.table[cluster][self.views], texels.weights[texel], optimize=True)
            for cluster, texel in zip(numbers, self.texels, strict=True)
        ]
        return np.stack(found)


def gather_form(texels: BtfTexels) -> Weights:
    """Gather as renderers do: Gaussians and a bent cosine are looked up, and go through the form's light basis."""
    form = BtfGathering(texels=texels)
    both = form.basis.analysis @ form.lights
    return lambda light: both @ light.functions


def _colours(
    values: Float[np.ndarray, "T v Lt J"], weights: Float[np.ndarray, "Lt K"], light: PlacedLight, basis: SpectralBasis
) -> Float[np.ndarray, "T v 3"]:
    """XYZ of rows that take so much of each measured light."""
    coefficients = light.folding.coefficients(basis)
    # (J, 3K) to K of (J, 3).
    fold = coefficients.reshape(len(coefficients), weights.shape[1], 3)
    return np.einsum("tvlj,lk,jkc->tvc", values, weights, fold, optimize=True)


def all_placed(lights: Hemisphere, data: Path | None) -> tuple[list[PlacedLight], int]:
    """Return every environment in every turn about a BTF of these lights, and how many environments there are."""
    functions, made = light_functions(lights), environments(data)
    return [one for environment in made.values() for one in tilted_lights(environment(), lights, functions)], len(made)
