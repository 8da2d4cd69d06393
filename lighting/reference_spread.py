"""What lights that spread over directions give each pixel of a reference: drawn directions, until the noise is small.

Directions are drawn in two ways, as the light shines and as the surface scatters, equally many of each, and each counts
by both densities together: the balance heuristic (Veach and Guibas, "Optimally combining sampling techniques for Monte
Carlo rendering", SIGGRAPH 1995, section 3.3). With n of each kind, p_l and p_b, the integral over directions is

    1/n sum over all 2n of f_r cos(theta_i) V L / (p_l + p_b).

Each picture is the mean of two halves that are drawn alike and independently. Their difference tells the noise: the
error of the mean is spread as half the difference of the halves is, which is the difference of one half and the mean.
ΔE94 of those two is what is stated, by pixel.

The points that directions are drawn from are Sobol's (scipy's `qmc`), one sequence for all samples of a pixel: one of
its dimensions says which sample. In each pixel and half it is scrambled anew, by the exclusive or with random numbers
(Kollig and Keller, "Efficient multidimensional sampling", Computer Graphics Forum 21(3), 2002). More directions carry
the same sequence on, to the next power of two, where such points are most even.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, UInt32

from ..materials.points import Points
from ..materials.sampling import DirectionSampler
from ..materials.surface import Surface
from ..spectral.difference import delta_e_xyz
from ..spectral.errors import InputError
from ..spectral.folding import Folding
from ..spectral.spectrum import Spectrum
from .geometry import Tracer, VisibleGeometry
from .lights import SpreadLight
from .scene import Scene

#: Share of the budget that a reference's own noise may be, as the mean of its pixels.
NOISE_SHARE = 0.1
#: Directions of each kind for a pixel, in each half, after which no more are drawn.
MOST_DIRECTIONS = 4096
# In the first round.
_FIRST_DIRECTIONS = 64
# Pairs of a sample and a direction worked on at once: 81 wavelengths of them, in float64, are some 5 MB.
_PAIRS = 8192
# Pixels that are covered as much are judged: others are dark by premultiplication.
_WHOLE = 1.0 - 1e-3


@dataclass(frozen=True)
class Noise:
    """How far off a reference's pixels are by chance, in ΔE94 over its wholly covered and lit pixels.

    mean, p99 : one a picture; `aimed` : what the largest mean should not exceed.
    directions : drawn for a pixel at the most, of both kinds and in both halves.
    limited : whether no more were allowed although the noise was not yet as small as that.
    """

    mean: tuple[float, ...]
    p99: tuple[float, ...]
    aimed: float
    directions: int
    limited: bool

    @property
    def words(self) -> str:
        """For a person."""
        said = f"noise of ΔE94 {max(self.mean):.2g} (mean) and {max(self.p99):.2g} (p99)"
        said += f" with {self.directions:,} directions a pixel"
        return f"{said}, the most allowed: {self.aimed:.2g} was aimed at" if self.limited else said


class SpreadSum:
    """Sums over drawn directions for one geometry: what each light that spreads gives each pixel, in two halves.

    Parameters
    ----------
    geometry : with `frame` and `geometric`. tracer : of the same scene.
    surfaces, samplers : by material id. illuminants : see `reference.reference_images`.
    seed : of the scrambling; equal seeds give equal pictures.

    Raises
    ------
    InputError : the geometry was made for a scene without lights that spread.
    """

    def __init__(
        self,
        scene: Scene,
        geometry: VisibleGeometry,
        surfaces: Mapping[str, Surface],
        samplers: Mapping[str, DirectionSampler],
        illuminants: Sequence[Spectrum | None],
        tracer: Tracer,
        seed: tuple[int, ...],
    ) -> None:
        if geometry.frame is None:
            raise InputError(
                "this geometry does not know how surfaces lie",
                field="geometry",
                found="one of a scene without lights that spread",
                expected="`visible_geometry` of the scene itself",
            )
        self._scene, self._geometry, self._tracer = scene, geometry, tracer
        self._surfaces, self._samplers, self._seed = surfaces, samplers, seed
        self._lights = [_Shining(scene, light, illuminants) for light in scene.spread_lights]
        self._sums = np.zeros((2, geometry.rows * geometry.width, 3 * len(illuminants)))
        self._order = np.argsort(geometry.pixel, kind="stable")
        self._hits = np.bincount(geometry.pixel, minlength=self._sums.shape[1])
        self._first = np.cumsum(self._hits) - self._hits
        self._pixels = np.flatnonzero(self._hits)
        self.directions = 0

    def extend(self, directions: int) -> None:
        """Carry on to so many directions of each kind for each pixel and half."""
        points = _sobol(directions)
        for number, light in enumerate(self._lights):
            for half in range(2):
                rng = np.random.default_rng([*self._seed, number, half])
                scrambling = rng.integers(0, 2**32, (self._sums.shape[1], 5), dtype=np.uint32)
                for pixel, which in _pairs(self._pixels, self.directions, directions):
                    uniform = ((points[which] ^ scrambling[pixel]) + 0.5) * 2.0**-32
                    of_pixel = (uniform[:, 4] * self._hits[pixel]).astype(np.int64)
                    sample = self._order[self._first[pixel] + of_pixel]
                    worn = self._geometry.part[sample]
                    for index in np.unique(worn):
                        mine = np.flatnonzero(worn == index)
                        material = self._scene.parts[index].material
                        self._add(self._sums[half], light, material, sample[mine], uniform[mine, :4])
        self.directions = directions

    @property
    def halves(self) -> Float[np.ndarray, "2 H W M 3"]:
        """XYZ by each half alone."""
        geometry = self._geometry
        # A sample of a pixel stands for all that meet a surface.
        scale = np.pi / self._scene.viewing.reference_illuminance_lux / (geometry.samples * max(self.directions, 1))
        return (self._sums * (self._hits * scale)[:, None]).reshape(2, geometry.rows, geometry.width, -1, 3)

    def _add(
        self,
        sums: Float[np.ndarray, "P C"],
        light: _Shining,
        material: str,
        sample: Int[np.ndarray, " n"],
        uniform: Float[np.ndarray, "n 4"],
    ) -> None:
        """One direction of each kind for each pair of a sample and a direction's numbers."""
        geometry, shining = self._geometry, light.light
        surface, sampler = self._surfaces[material], self._samplers[material]
        assert geometry.frame is not None and geometry.geometric is not None
        frame, position, wo = geometry.frame[sample], geometry.position[sample], geometry.wo[sample]
        towards, by_light = shining.drawn(position, uniform[:, :2])
        local = sampler.drawn(wo, uniform[:, 2:])
        scattered = np.einsum("nji,nj->ni", frame, local)
        towards = np.concatenate([towards, scattered])
        wi = np.concatenate([np.einsum("nij,nj->ni", frame, towards[: len(sample)]), local])
        by_light = np.concatenate([by_light, shining.density(position, scattered)])
        twice = np.tile(np.arange(len(sample)), 2)
        up = wi[:, 2] > 0.0
        up &= np.einsum("ni,ni->n", geometry.geometric[sample][twice], towards) > 0.0
        some = np.flatnonzero(up)
        luminance = shining.luminance(position[twice[some]], towards[some])
        some, luminance = (values[(luminance > 0.0).any(axis=1)] for values in (some, luminance))
        at, towards, wi = twice[some], np.ascontiguousarray(towards[some]), wi[some]
        start = self._tracer.lifted(position[at], geometry.geometric[sample[at]])
        free = np.flatnonzero(self._tracer.free(start, towards, shining.distance(start, towards)))
        if not len(free):
            return
        at, wi, luminance = at[free], wi[free], luminance[free]
        density = by_light[some[free]] + sampler.density(wo[at], wi)
        own = sample[at]
        uv, footprint = (None if one is None else one[own] for one in (geometry.uv, geometry.footprint))
        # What was drawn has a density, but for the last bit at a cell's border.
        weight = np.where(density > 0.0, wi[:, 2], 0.0) / np.where(density > 0.0, density, 1.0)
        f_r = surface.xyz(Points(wi, wo[at], uv, footprint), light.folding)
        values = light.added(f_r, luminance * weight[:, None])
        pixel = geometry.pixel[own]
        low = geometry.pixel[sample[0]]
        for channel in range(values.shape[1]):
            found = np.bincount(pixel - low, values[:, channel])
            sums[low : low + len(found), channel] += found


class _Shining:
    """A light ready to be folded: a column of XYZ for each spectrum that it has in each picture."""

    def __init__(self, scene: Scene, light: SpreadLight, illuminants: Sequence[Spectrum | None]) -> None:
        self.light = light
        spectra = [tuple(light.spectra) if other is None else (other,) for other in illuminants]
        self.folding = Folding(scene.observer, [one for each in spectra for one in each])
        self._whole = [other is not None for other in illuminants]
        self._first = np.cumsum([0, *(len(each) for each in spectra)])[:-1]

    def added(self, f_r: Float[np.ndarray, "n C3"], fields: Float[np.ndarray, "n K"]) -> Float[np.ndarray, "n M3"]:
        """f_r times what arrives of each spectrum, added up by picture."""
        total = fields.sum(axis=1, keepdims=True)
        columns = np.concatenate([total if whole else fields for whole in self._whole], axis=1)
        each = f_r.reshape(len(f_r), -1, 3) * columns[:, :, None]
        return np.add.reduceat(each, self._first, axis=1).reshape(len(f_r), -1)


@dataclass(frozen=True, eq=False)
class Found:
    """What `gathered` gives: XYZ (M, H, W, 3), ΔE94 (M, n) by which judged pixels are off, and `Noise`'s directions."""

    xyz: Float[np.ndarray, "M H W 3"]
    off: Float[np.ndarray, "M n"]
    directions: int
    limited: bool


def gathered(
    sums: SpreadSum,
    beside: Float[np.ndarray, "M H W 3"],
    coverage: Float[np.ndarray, "H W"],
    whites: Float[np.ndarray, "M 3"],
    aimed: float,
    most: int,
    say: Callable[[str], None],
) -> Found:
    """Draw, twice as much each time, until the noise is small.

    beside : what other lights give. aimed : mean ΔE94 of the noise. most : directions of each kind and half, at which
    it ends in any case. say : is told what is done.
    """
    directions = min(_FIRST_DIRECTIONS, most)
    while True:
        sums.extend(directions)
        halves = np.moveaxis(sums.halves, 3, 1)
        off = noise_of(halves, beside, coverage, whites)
        # The mean of few pixels is itself uncertain: two of its standard errors are counted with it.
        uncertain = 1.0 + 1.5 / np.sqrt(max(off.shape[1], 1))
        noise = float(off.mean(axis=1).max()) if off.size else 0.0
        enough = noise * uncertain <= aimed
        if enough or directions >= most:
            return Found(beside + halves.mean(axis=0), off, 4 * directions, not enough)
        directions = min(2 * directions, most)
        say(f"drawing {4 * directions:,} directions a pixel; noise of ΔE94 {noise:.2g} so far, {aimed:.2g} is aimed at")


def noise_of(
    halves: Float[np.ndarray, "2 M H W 3"],
    beside: Float[np.ndarray, "M H W 3"],
    coverage: Float[np.ndarray, "H W"],
    whites: Float[np.ndarray, "M 3"],
) -> Float[np.ndarray, "M n"]:
    """ΔE94 by which each wholly covered pixel (each covered one, where none is) is off by chance, in each picture.

    `beside` is what other lights give, without noise. A pixel that no light reaches is left out.
    """
    judged = coverage >= _WHOLE
    if not judged.any():
        judged = coverage > 0.0
    lit = judged & ((halves != 0.0).any(axis=(0, 1, 4)) | (beside != 0.0).any(axis=(0, 3)))
    pictures = zip(halves[0], halves.mean(axis=0), beside, whites, strict=True)
    off = [delta_e_xyz(mean[lit] + other[lit], half[lit] + other[lit], white) for half, mean, other, white in pictures]
    return np.stack(off)


def noise_stated(found: Sequence[Found], aimed: float) -> Noise:
    """The noise of pictures that were made in parts, one above the other."""
    off = np.concatenate([one.off for one in found], axis=1)
    mean, p99 = (off.mean(axis=1), np.percentile(off, 99.0, axis=1)) if off.size else (np.zeros(len(off)),) * 2
    limited = any(one.limited for one in found)
    return Noise(tuple(mean.tolist()), tuple(p99.tolist()), aimed, max(one.directions for one in found), limited)


def _pairs(
    pixels: Int[np.ndarray, " n"], start: int, stop: int
) -> Iterator[tuple[Int[np.ndarray, " p"], Int[np.ndarray, " p"]]]:
    """Pixels and numbers of directions, about `_PAIRS` of them at a time; pixels stay in order."""
    for first in range(start, stop, _PAIRS):
        numbers = np.arange(first, min(first + _PAIRS, stop))
        step = max(1, _PAIRS // len(numbers))
        for begin in range(0, len(pixels), step):
            some = pixels[begin : begin + step]
            yield np.repeat(some, len(numbers)), np.tile(numbers, len(some))


def _sobol(count: int) -> UInt32[np.ndarray, "n 5"]:
    """At least so many points of Sobol's sequence, as whole numbers of 32 bits."""
    from scipy.stats import qmc

    points = qmc.Sobol(5, scramble=False, bits=32).random_base2(max(count - 1, 1).bit_length())
    return (points * 2.0**32).astype(np.uint32)
