"""BTFs by local PCA as published, as a baseline.

Mueller, Meseth and Klein 2004 (section 3): clusters of texels, each with a mean and eigen-BRDFs of its own, by plain
least squares of linear values; images as they were measured, not registered. Numbers are stored with 8 bits each.
`local_pca` lists the differences.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float, Int, Int8, UInt8

from ...runtime.errors import InputError
from ...spectral.basis import SpectralBasis
from .clustered_form import decoded
from .clusters import clustered
from .hemisphere import Hemisphere
from .images import BtfImages
from .metric import seen
from .mip_levels import Span, TexelLevel, coarser

# Principal components of all texels in whose span clusters are searched; texels that these are found on.
_SPAN, _LEARNT = 256, 2048
# Values of those texels in memory; as float32, 192 MB.
_NUMBERS = 48 << 20
# A component beyond which this share of the first is left is rounding.
_NOTHING = 1e-9
_STEPS = 127


@dataclass(frozen=True, eq=False)
class PaperPca:
    """H x W texels, each a cluster's mean and weighted eigen-BRDFs.

    views, lights : V and Lt directions. basis : of the J coefficients. number (H,W) : cluster, of k. weights (H,W,c) :
    whole numbers. brdfs (k,c+1,V,Lt,J) : of each cluster the mean, then the eigen-BRDFs, whole numbers of `steps`
    (k,c+1), 1/sr.
    """

    views: Hemisphere
    lights: Hemisphere
    basis: SpectralBasis
    number: UInt8[np.ndarray, "H W"]
    weights: Int8[np.ndarray, "H W c"]
    brdfs: Int8[np.ndarray, "k c1 V Lt J"]
    steps: Float[np.ndarray, "k c1"]

    def table(self) -> Float[np.ndarray, "k V Lt c1 J"]:
        """Implement `ClusteredForm.table`."""
        return np.ascontiguousarray(self._scaled.transpose(0, 2, 3, 1, 4))

    @property
    def _scaled(self) -> Float[np.ndarray, "k c1 V Lt J"]:
        return self.brdfs * self.steps[:, :, None, None, None].astype(np.float32)

    def coarser(self) -> tuple[TexelLevel, ...]:
        """Implement `ClusteredForm.coarser`."""
        return self._coarser

    @cached_property
    def _coarser(self) -> tuple[TexelLevel, ...]:
        return coarser(self.number, self.weights, self._span())

    def _span(self) -> Span:
        """Compute the span of all rows, about the mean of all texels."""
        rows, count = self._scaled, len(self.brdfs)
        shape, texels = rows.shape[1:], np.bincount(self.number.ravel(), minlength=count) / self.number.size
        average = np.tensordot(texels.astype(np.float32), rows[:, 0], axes=1)
        rows[:, 0] -= average
        metric = seen(average, self.basis).astype(np.float32)
        looks = np.einsum("kcvlj,vljm->kcvlm", rows, metric, optimize=True).reshape(count * shape[0], -1)
        squares, turn = np.linalg.eigh((looks @ looks.T).astype(np.float64))
        some = squares > _NOTHING * max(float(squares[-1]), np.finfo(np.float32).tiny)
        lengths, turn = np.sqrt(squares[some]), turn[:, some]
        functions = (turn / lengths).T.astype(np.float32) @ rows.reshape(len(looks), -1)

        def tabled(found: Float[np.ndarray, "q c1 n"]) -> Float[np.ndarray, "q V Lt c1 J"]:
            values = (found @ functions).reshape(len(found), *shape)
            values[:, 0] += average
            return np.ascontiguousarray(values.transpose(0, 2, 3, 1, 4))

        return Span((turn * lengths).astype(np.float32).reshape(count, shape[0], -1), tabled)

    def decoded(self, texels: Int[np.ndarray, " n"]) -> Iterator[Float[np.ndarray, "V Lt J"]]:
        """Implement `ClusteredForm.decoded`."""
        return decoded(self, texels)

    def stored(self) -> dict[str, Any]:
        """Return the stored fields, without the basis."""
        arrays = {name: getattr(self, name) for name in ("number", "weights", "brdfs", "steps")}
        return arrays | {"views": self.views.directions, "lights": self.lights.directions}

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any], basis: SpectralBasis) -> PaperPca:
        """Return the form whose `stored()` this is."""
        arrays = {name: np.asarray(kept[name]) for name in ("number", "weights", "brdfs", "steps")}
        views, lights = (Hemisphere(np.asarray(kept[name])) for name in ("views", "lights"))
        return cls(views, lights, basis, **arrays)


def paper_pca(
    images: BtfImages,
    clusters: int = 32,
    components: int = 8,
    seed: int = 0,
    heard: Callable[[float], None] = lambda share: None,
) -> PaperPca:
    """Fit `clusters` clusters of `components` components to a BTF.

    heard : receives the fraction of the work done, from 0 to 1.

    Raises
    ------
    InputError : images that are not finite; fewer clusters than 1 or more than 256.
    """
    if not 1 <= clusters <= 256:
        raise InputError("not a number of clusters", field="clusters", found=clusters, expected="1 to 256")
    mean, span = _span(images, seed, lambda share: heard(0.45 * share))
    places = _coordinates(images, mean, span, lambda share: heard(0.45 + 0.45 * share))
    found = clustered(places, clusters, components, seed)
    shape = (len(images.views), len(images.lights), images.basis.size)
    count = found.axes.shape[1] + 1
    brdfs = np.empty((len(found.origin), count, *shape), dtype=np.int8)
    steps = np.empty((len(found.origin), count))
    # The largest weight of each eigen-BRDF is 127 of its steps.
    weights = np.zeros(found.weights.shape, dtype=np.int8)
    for cluster in range(len(found.origin)):
        here = found.number == cluster
        tallest = np.abs(found.weights[here]).max(axis=0)
        step = np.where(tallest > 0.0, tallest / _STEPS, 1.0)
        weights[here] = np.rint(found.weights[here] / step)
        rows = np.concatenate([found.origin[cluster][None], found.axes[cluster] * step[:, None]]) @ span
        rows[0] += mean
        largest = np.abs(rows).max(axis=1)
        steps[cluster] = np.where(largest > 0.0, largest / _STEPS, 1.0)
        brdfs[cluster] = np.rint(rows / steps[cluster][:, None]).reshape(count, *shape)
    heard(1.0)
    size = (images.height, images.width)
    number = found.number.astype(np.uint8).reshape(size)
    return PaperPca(images.views, images.lights, images.basis, number, weights.reshape(*size, -1), brdfs, steps)


def _span(
    images: BtfImages, seed: int, heard: Callable[[float], None]
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, "G n"]]:
    """Return the mean of texels drawn at random, and their principal components, orthonormal."""
    texels, lights = images.height * images.width, len(images.lights)
    numbers = len(images.views) * lights * images.basis.size
    count = max(1, min(_LEARNT, _NUMBERS // numbers, texels))
    some = np.sort(np.random.default_rng(seed).permutation(texels)[:count])
    values = np.empty((count, len(images.views), lights, images.basis.size), dtype=np.float32)
    for view in range(len(images.views)):
        for light in range(lights):
            values[:, view, light] = images.image(view, light).reshape(texels, -1)[some]
        heard((view + 1) / len(images.views))
    _check_finite(values)
    rows = values.reshape(count, numbers)
    mean = rows.mean(axis=0, dtype=np.float64).astype(np.float32)
    rows -= mean
    squares, mixed = np.linalg.eigh((rows @ rows.T).astype(np.float64))
    squares, mixed = squares[::-1][:_SPAN], mixed[:, ::-1][:, :_SPAN]
    kept = squares > _NOTHING * max(float(squares[0]), np.finfo(np.float32).tiny)
    shares = (mixed[:, kept] / np.sqrt(squares[kept])).astype(np.float32)
    return mean, shares.T @ rows


def _coordinates(
    images: BtfImages, mean: Float[np.ndarray, " n"], span: Float[np.ndarray, "G n"], heard: Callable[[float], None]
) -> Float[np.ndarray, "N G"]:
    """Project each texel onto each component, one view at a time."""
    texels, lights, size = images.height * images.width, len(images.lights), images.basis.size
    total = np.zeros((texels, len(span)), dtype=np.float32)
    rows = np.empty((texels, lights, size), dtype=np.float32)
    width = lights * size
    for view in range(len(images.views)):
        for light in range(lights):
            rows[:, light] = images.image(view, light).reshape(texels, size)
        here = slice(view * width, (view + 1) * width)
        total += (rows.reshape(texels, width) - mean[here]) @ span[:, here].T
        heard((view + 1) / len(images.views))
    _check_finite(total)
    return total


def _check_finite(values: Float[np.ndarray, "..."]) -> None:
    if not np.isfinite(values).all():
        raise InputError("a BTF that is not finite", field="images", found="NaN or infinity", expected="numbers")
