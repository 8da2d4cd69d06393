"""BTFs by local PCA: each texel a few weights of components shared by its cluster of texels.

Mueller, Meseth and Klein 2004 (section 3) write a texel's BRDF as the mean of its cluster and weighted eigen-BRDFs of
that cluster, B_x = B_k(x) + sum of <B_x - B_k(x), E_i,k(x)> E_i,k(x). Here the means and eigen-BRDFs of all clusters
are vectors of one shared space (`dictionary`), found once; residuals are weighted by their visibility (`metric`);
images are first registered to the sample's surface; and a texel has spectral coefficients.
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
from .cluster_metric import seen_by_clusters
from .clustered_form import decoded
from .clusters import Clusters, clustered
from .dictionary import Dictionary, dictionary_of
from .hemisphere import Hemisphere
from .images import BtfImages
from .mip_levels import Span, TexelLevel, coarser
from .rounded_mean import rounded_mean

# Texels that the dictionary is fitted to, most numbers of these, and texels that forms are only judged by.
_LEARNT, _NUMBERS, JUDGED = 2048, 48 << 20, 256
# Functions that hold no more than this share of the largest are noise of the arithmetic.
_NOTHING = 1e-9
# Largest quantised magnitude, in steps.
_STEPS = 127


@dataclass(frozen=True)
class Size:
    """Size of a form.

    dimensions : G of the dictionary. clusters : k <= 256. components : c of each cluster. rounded : steps of the
    dictionary, in root mean squares of its numbers; weights : steps of texels' weights, in root mean squares of those
    of the last component.
    """

    dimensions: int
    clusters: int
    components: int
    rounded: float
    weights: float

    @property
    def text(self) -> str:
        """Size in words."""
        return f"{self.clusters} clusters of {self.components} components, a dictionary of {self.dimensions}"


@dataclass(frozen=True, eq=False)
class LocalPca:
    """H x W texels, each a cluster's mean and weighted components.

    views, lights : V and Lt directions. number (H,W) : cluster, of k. weights (H,W,c) : integers, of the cluster's
    components. parts (k,c+1,G) : coefficients of the dictionary's functions, normalised, for the mean and then the
    components, in whole multiples of `part_steps` (k,c+1).
    """

    views: Hemisphere
    lights: Hemisphere
    dictionary: Dictionary
    number: UInt8[np.ndarray, "H W"]
    weights: Int8[np.ndarray, "H W c"]
    parts: Int8[np.ndarray, "k c1 G"]
    part_steps: Float[np.ndarray, "k c1"]

    @property
    def basis(self) -> SpectralBasis:
        """Basis of the coefficients."""
        return self.dictionary.basis

    def table(self) -> Float[np.ndarray, "k V Lt c1 J"]:
        """Return f_r cos(theta_i), 1/sr, of each cluster's mean and of its components at weight 1; float32."""
        return self._tabled(self.parts * self.part_steps[..., None].astype(np.float32))

    def _tabled(self, parts: Float[np.ndarray, "q c1 G"]) -> Float[np.ndarray, "q V Lt c1 J"]:
        """Tabulate coefficients of the dictionary's normalised functions; the first row of each cluster is its mean."""
        functions = self.dictionary.functions() / self.dictionary.lengths[:, None, None, None].astype(np.float32)
        count, views, lights, size = len(parts), len(self.views), len(self.lights), self.basis.size
        numbers = views * lights * size
        rows = parts.reshape(count * parts.shape[1], parts.shape[2]).astype(np.float32) @ functions.reshape(
            len(functions), numbers
        )
        found = rows.reshape(count, parts.shape[1], views, lights, size)
        found[:, 0] += self.dictionary.average
        return np.ascontiguousarray(found.transpose(0, 2, 3, 1, 4))

    def coarser(self) -> tuple[TexelLevel, ...]:
        """Implement `ClusteredForm.coarser`."""
        return self._coarser

    @cached_property
    def _coarser(self) -> tuple[TexelLevel, ...]:
        _, back = _orthonormal(self.dictionary)
        lengths = self.dictionary.lengths.astype(np.float32)
        rows = (self.parts * self.part_steps[..., None].astype(np.float32) / lengths) @ np.linalg.pinv(back)
        span = Span(rows, lambda found: self._tabled((found @ back) * lengths))
        return coarser(self.number, self.weights, span)

    def decoded(self, texels: Int[np.ndarray, " n"]) -> Iterator[Float[np.ndarray, "V Lt J"]]:
        """Implement `ClusteredForm.decoded`."""
        return decoded(self, texels)

    def stored(self) -> dict[str, Any]:
        """Return the stored fields, without the basis."""
        arrays = {name: getattr(self, name) for name in ("number", "weights", "parts", "part_steps")}
        directions = {"views": self.views.directions, "lights": self.lights.directions}
        return arrays | directions | {"dictionary": self.dictionary.stored()}

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any], basis: SpectralBasis) -> LocalPca:
        """Return the form whose `stored()` this is."""
        arrays = {name: np.asarray(kept[name]) for name in ("number", "weights", "parts", "part_steps")}
        views, lights = (Hemisphere(np.asarray(kept[name])) for name in ("views", "lights"))
        return cls(views, lights, Dictionary.from_stored(kept["dictionary"], basis), **arrays)


def local_pca(
    images: BtfImages, size: Size, seed: int = 0, heard: Callable[[float], None] = lambda share: None
) -> LocalPca:
    """Fit local PCA of a given size to a BTF.

    heard : receives the fraction of the work done, from 0 to 1.

    Raises
    ------
    InputError : images that are not finite; fewer clusters than 1 or more than 256.
    """
    if not 1 <= size.clusters <= 256:
        raise InputError("not a number of clusters", field="clusters", found=size.clusters, expected="1 to 256")
    texels = images.height * images.width
    numbers = len(images.views) * len(images.lights) * images.basis.size
    count = max(1, min(_LEARNT, _NUMBERS // numbers, texels))
    learnt = np.sort(np.random.default_rng(seed).permutation(texels)[:count])
    values = gathered(images, learnt, lambda share: heard(0.3 * share))
    mean = rounded_mean(values.mean(axis=0), images.basis)
    empty = dictionary_of(np.zeros((0, *values.shape[1:]), np.float32), mean, images.basis, size.rounded)
    found = dictionary_of(_functions(values, empty, size.dimensions), mean, images.basis, size.rounded)
    del values
    orthonormal, back = _orthonormal(found)
    coordinates = _coordinates(images, found, orthonormal, lambda share: heard(0.3 + 0.3 * share))
    clusters = clustered(coordinates, size.clusters, size.components, seed)
    del coordinates
    clusters = seen_by_clusters(images, found, orthonormal, clusters, lambda share: heard(0.65 + 0.3 * share))
    number, weights, parts, steps = _rounded(clusters, back * found.lengths.astype(np.float32), size.weights)
    shape = (images.height, images.width)
    heard(1.0)
    return LocalPca(
        images.views, images.lights, found, number.reshape(shape), weights.reshape(*shape, -1), parts, steps
    )


def gathered(
    images: BtfImages, texels: Int[np.ndarray, " n"], heard: Callable[[float], None] = lambda share: None
) -> Float[np.ndarray, "n V Lt J"]:
    """Read some texels of all registered images.

    Raises
    ------
    InputError : an image that is not finite.
    """
    views, lights, basis = len(images.views), len(images.lights), images.basis
    found = np.empty((len(texels), views, lights, basis.size), dtype=np.float32)
    for view in range(views):
        for light in range(lights):
            found[:, view, light] = images.registered(view, light).reshape(-1, basis.size)[texels]
        heard((view + 1) / views)
    bad = np.argwhere(~np.isfinite(found).all(axis=(0, 3)))
    if len(bad):
        where = f"image of view {bad[0][0]}, light {bad[0][1]}"
        raise InputError("a BTF that is not finite", field=where, found="NaN or infinity", expected="numbers")
    return found


def _functions(values: Float[np.ndarray, "n V Lt J"], empty: Dictionary, most: int) -> Float[np.ndarray, "G V Lt J"]:
    """Compute principal components of texels in the perceptual metric, scaled as they occur; overwrites `values`."""
    values -= empty.average
    # In place: this is the largest array.
    for view in range(values.shape[1]):
        for light in range(values.shape[2]):
            values[:, view, light] = values[:, view, light] @ empty.seen[view, light]
    rows = values.reshape(len(values), -1)
    squares, mixed = np.linalg.eigh((rows @ rows.T).astype(np.float64))
    squares, mixed = squares[::-1][:most], mixed[:, ::-1][:, :most]
    some = squares > _NOTHING * max(float(squares[0]), np.finfo(np.float32).tiny)
    largest = np.abs(mixed).argmax(axis=0)
    signed = mixed * np.sign(mixed[largest, np.arange(mixed.shape[1])]) / np.sqrt(len(rows))
    return (signed[:, some].T.astype(np.float32) @ rows).reshape(-1, *values.shape[1:])


def _orthonormal(found: Dictionary) -> tuple[Float[np.ndarray, "n V Lt J"], Float[np.ndarray, "n G"]]:
    """Orthonormalise a rounded dictionary in the perceptual metric; return functions and their coefficients in it."""
    functions = found.as_seen()
    rows = functions.reshape(len(functions), np.prod(functions.shape[1:], dtype=int))
    squares, turn = np.linalg.eigh((rows @ rows.T).astype(np.float64))
    some = squares > _NOTHING * max(float(squares.max(initial=0.0)), np.finfo(np.float32).tiny)
    back = (turn[:, some] / np.sqrt(squares[some])).T[::-1].astype(np.float32)
    return (back @ rows).reshape(-1, *functions.shape[1:]), back


def _coordinates(
    images: BtfImages,
    found: Dictionary,
    orthonormal: Float[np.ndarray, "n V Lt J"],
    heard: Callable[[float], None],
) -> Float[np.ndarray, "N n"]:
    """Project each texel onto each function in the perceptual metric, one view at a time."""
    texels, lights, size = images.height * images.width, len(images.lights), images.basis.size
    total = np.zeros((texels, len(orthonormal)), dtype=np.float32)
    rows = np.empty((lights, texels, size), dtype=np.float32)
    for view in range(len(images.views)):
        for light in range(lights):
            image = images.registered(view, light).reshape(-1, size)
            rows[light] = (image - found.average[view, light]) @ found.seen[view, light]
        # One product for all lights of the view, since the sum is read and written each time.
        across = rows.transpose(1, 0, 2).reshape(texels, lights * size)
        total += across @ orthonormal[:, view].reshape(len(orthonormal), lights * size).T
        heard((view + 1) / len(images.views))
    if not np.isfinite(total).all():
        raise InputError("a BTF that is not finite", field="images", found="NaN or infinity", expected="numbers")
    return total


def _rounded(
    clusters: Clusters, back: Float[np.ndarray, "n G"], step: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Quantise clusters: cluster numbers, weights, coefficients in the dictionary, and the steps of these."""
    weights = clusters.weights
    size = float(np.sqrt(np.mean(np.square(weights[:, -1], dtype=np.float64)))) if weights.shape[1] else 0.0
    # No step is so small that the largest weight would not be held.
    largest = np.abs(weights).max(axis=0, initial=0.0)
    steps = np.maximum(step * size, largest / _STEPS)
    steps = np.where(steps > 0.0, steps, 1.0)
    whole = np.rint(weights / steps).astype(np.int8)
    rows = np.concatenate([clusters.origin[:, None], clusters.axes * steps[:, None]], axis=1) @ back
    tallest = np.abs(rows).max(axis=2, initial=0.0)
    part_steps = np.where(tallest > 0.0, tallest / _STEPS, 1.0)
    parts = np.rint(rows / part_steps[..., None]).astype(np.int8)
    return clusters.number.astype(np.uint8), whole, parts, part_steps.astype(np.float32)
