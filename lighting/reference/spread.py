"""Area and environment light at each pixel of a reference, by Monte Carlo integration.

Equal numbers of directions are sampled from the light (density p_l, 1/sr) and from the BRDF (p_s), weighted by the
balance heuristic (Veach and Guibas, "Optimally combining sampling techniques for Monte Carlo rendering", SIGGRAPH 1995,
section 3.3). With n of each, the integral over directions is

    1/n sum over all 2n of f_r cos(theta_i) V L / (p_s + p_l).

The diffuse part of a BRDF needs no BRDF sampling if the light is even or a single rectangle: its integral is 1/n sum of
f_r cos(theta_i) V L / p_l over n directions from the light, with noise only from f_r cos(theta_i) and V. Highlights use
both kinds.

Each image is the mean of two halves, sampled independently in the same way; `noise` estimates the noise from their
difference.

Directions are generated from Sobol points (scipy's `qmc`), one dimension of which selects the sample of a pixel. In
each half all points are scrambled by exclusive or with random numbers (Kollig and Keller, "Efficient multidimensional
sampling", Computer Graphics Forum 21(3), 2002). Each pixel permutes the sequence, from j to (j xor a random number), so
that its first 2^k points are 2^k consecutive points of the sequence, which are as uniform as the first. So directions
and luminance of an environment are computed once for all pixels.

Materials may share functions of direction, as coats of one roughness over bodies of any colour. Their sums over
directions are cached with the geometry (`_Drawn`) and reused with the colours of the next such material.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from jaxtyping import Bool, Float, Int

from ...materials.core.brdf import eval_lit
from ...materials.core.points import Points
from ...materials.core.sampling import DirectionSampler
from ...materials.core.scattering import Scattering, sampling_key
from ...materials.core.surface import SumOfTerms, Surface
from ...runtime.errors import InputError
from ...spectral.folding import Folding
from ...spectral.spectrum import Spectrum
from ..environment.softbox import SoftboxLight
from ..lights import SpreadLight
from ..mesh.convexity import is_convex
from ..mesh.mesh import Mesh
from ..scene import Scene
from ..vectors import dot
from .direction_sampling import DrawnDirections, drawn_pool, is_even
from .geometry import Tracer, VisibleGeometry
from .noise import Heard, unheard

# Pairs of sample and direction per block: some 3 MB, to fit the processor's cache.
_PAIRS = 16384
# Directions of each kind for highlights, per direction for the diffuse part, under an even light.
_GLOSSY = 0.5
# Limit of cached sums per geometry, bytes.
_KEPT_BYTES = 256_000_000


class SpreadSum:
    """Monte Carlo sums of area and environment lights for one geometry, by pixel, in two halves.

    Parameters
    ----------
    geometry : with `frame` and `geometric`. tracer : returns that of the same scene on demand.
    surfaces : by material id. illuminants : see `reference.reference_images`.
    seed : of the scrambling; equal seeds give equal images.
    most : largest number of directions per pixel, of each kind and half.

    Raises
    ------
    InputError : a geometry without frames, from a scene without area or environment lights.
    """

    def __init__(
        self,
        scene: Scene,
        geometry: VisibleGeometry,
        surfaces: Mapping[str, Scattering],
        illuminants: Sequence[Spectrum | None],
        tracer: Callable[[], Tracer],
        seed: tuple[int, ...],
        most: int,
    ) -> None:
        if geometry.frame is None or geometry.geometric is None:
            raise InputError(
                "this geometry does not know how surfaces lie",
                field="geometry",
                found="one of a scene without lights that spread",
                expected="`visible_geometry` of the scene itself",
            )
        self._scene, self._geometry, self._surfaces = scene, geometry, surfaces
        self._frame, self._outwards = geometry.frame, geometry.geometric
        self._tracer = None if _nothing_hides(scene, geometry) else tracer()
        self._lights = [_Shining(scene, light, illuminants) for light in scene.spread_lights]
        self._sums = np.zeros((2, geometry.rows * geometry.width, 3 * len(illuminants)))
        self._order = np.argsort(geometry.pixel, kind="stable")
        self._hits = np.bincount(geometry.pixel, minlength=self._sums.shape[1])
        self._first = np.cumsum(self._hits) - self._hits
        self._drawn = _Drawn.of(geometry, tuple(scene.spread_lights), seed, most)
        #: (H W,) number of directions of each kind per pixel, in each half.
        self.directions = np.zeros(self._sums.shape[1], dtype=np.int64)
        #: (H W,) mask of pixels that see a surface.
        self.covered = self._hits > 0

    def extend(self, directions: int, pixels: Int[np.ndarray, " n"] | None = None, heard: Heard = unheard) -> None:
        """Continue pixels (ascending), with equal numbers of directions so far, to `directions` of each kind and half.

        directions : a multiple of 2. heard : receives the share done.
        """
        pixels = np.flatnonzero(self.covered) if pixels is None else pixels
        if not len(pixels):
            return
        start = int(self.directions[pixels[0]])
        each = [
            (number, half, task)
            for number, light in enumerate(self._lights)
            for half in range(2)
            for task in light.tasks(start, directions)
        ]
        for done, (number, half, task) in enumerate(each):
            heard(done / len(each))
            self._carry_on(number, half, task, pixels)
        self.directions[pixels] = directions

    def _carry_on(self, number: int, half: int, task: _Task, pixels: Int[np.ndarray, " n"]) -> None:
        """Perform one task for some pixels."""
        light, sums = self._lights[number], self._sums[half]
        pool, shift = self._drawn.pool(number, half)
        wearing: dict[int, _Part] = {}
        for index, one in enumerate(self._scene.parts):
            worn = task.part(self._surfaces[one.material])
            if worn is not None:
                at = (number, half, task, index)
                wearing[index] = _Part(worn, self._drawn.moments(at, worn, light.count))
        missing = np.zeros(len(pixels), dtype=bool)
        for part in wearing.values():
            open_ = part.missing(pixels)
            missing |= open_
            if part.moments is not None:
                # A previous run may have been interrupted here.
                part.moments.sums[pixels[open_]] = 0.0
        for pixel, which in _pairs(pixels[missing], task.start, task.stop):
            row = which ^ shift[pixel]
            of_pixel = (pool.uniform[row, 4] * self._hits[pixel]).astype(np.int64)
            sample = self._order[self._first[pixel] + of_pixel]
            if len(self._scene.parts) == 1:  # all samples are of it, and all pixels missing
                self._add(sums, light, pool, task, wearing[0], sample, row)
                continue
            seen = self._geometry.part[sample]
            for index, part in wearing.items():
                mine = np.flatnonzero((seen == index) & part.missing(pixel))
                self._add(sums, light, pool, task, part, sample[mine], row[mine])
        for part in wearing.values():
            if part.moments is not None and part.worn.terms is not None:
                part.moments.known[pixels] = True
                colours = light.colours(part.worn.terms.spectra, part.worn.surface.wavelengths_nm)
                sums[pixels] += part.moments.sums[pixels] @ colours

    @property
    def halves(self) -> Float[np.ndarray, "2 H W M 3"]:
        """XYZ of each half."""
        geometry = self._geometry
        # Each chosen sample represents all covered samples of its pixel.
        scale = (
            np.pi / self._scene.viewing.reference_illuminance_lux / (geometry.samples * np.maximum(self.directions, 1))
        )
        return (self._sums * (self._hits * scale)[:, None]).reshape(2, geometry.rows, geometry.width, -1, 3)

    def _add(
        self,
        sums: Float[np.ndarray, "P C"],
        light: _Shining,
        pool: DrawnDirections,
        task: _Task,
        part: _Part,
        sample: Int[np.ndarray, " n"],
        row: Int[np.ndarray, " n"],
    ) -> None:
        """Evaluate one direction for each pair of sample and pool row; add to `sums` or to the part's moments."""
        if not len(sample):
            return
        low, worn = self._geometry.pixel[sample[0]], part.worn
        arriving = (
            self._scattered(light, pool, worn, sample, row) if task.scattered else self._shone(light, pool, sample, row)
        )
        sample, towards, wi, luminance, by_light = arriving
        if self._tracer is not None and len(sample):
            start = self._tracer.lifted(*_rows((self._geometry.position, self._outwards), sample))
            towards = np.ascontiguousarray(towards)
            free = np.flatnonzero(self._tracer.free(start, towards, light.light.distance(start, towards)))
            sample, wi, luminance, by_light = _rows((sample, wi, luminance, by_light), free)
        if not len(sample):
            return
        geometry = self._geometry
        wo = geometry.wo.take(sample, axis=0)
        density = by_light
        if worn.sampler is not None:
            density = task.of_n * (worn.sampler.density(wo, wi) + by_light)
        uv, footprint = (None if one is None else one.take(sample, axis=0) for one in (geometry.uv, geometry.footprint))
        # Sampled directions have a positive density, except by rounding at a cell's border.
        weight = np.where(density > 0.0, wi[:, 2], 0.0) / np.where(density > 0.0, density, 1.0)
        arriving = luminance * weight[:, None]
        if part.moments is not None and worn.terms is not None:
            sums, fields = part.moments.sums, light.fields(arriving)
            terms = eval_lit(worn.terms.terms, len(worn.terms.spectra), wi, wo)
            values = (terms[:, :, None] * fields[:, None]).reshape(len(wi), -1)
        else:
            values = light.added(worn.surface.xyz(Points(wi, wo, uv, footprint), light.folding), arriving)
        pixel = geometry.pixel[sample] - low
        for channel in range(values.shape[1]):
            found = np.bincount(pixel, values[:, channel])
            sums[low : low + len(found), channel] += found

    def _shone(
        self, light: _Shining, pool: DrawnDirections, sample: Int[np.ndarray, " n"], row: Int[np.ndarray, " n"]
    ) -> tuple[np.ndarray, ...]:
        """Sample the light: return samples, directions in the world and in local frames, luminance and density."""
        if pool.towards is None or pool.luminance is None or pool.density is None:
            position = self._geometry.position.take(sample, axis=0)
            towards, density = light.light.drawn(position, pool.uniform[row, :2])
            luminance = light.light.luminance(position, towards)
        else:
            towards, density, luminance = _rows((pool.towards, pool.density, pool.luminance), row)
        frame, outwards = _rows((self._frame, self._outwards), sample)
        wi = np.einsum("nij,nj->ni", frame, towards)
        up = (wi[:, 2] > 0.0) & (dot(outwards, towards) > 0.0) & luminance.any(axis=1)
        return _rows((sample, towards, wi, luminance, density), np.flatnonzero(up))

    def _scattered(
        self,
        light: _Shining,
        pool: DrawnDirections,
        worn: _Worn,
        sample: Int[np.ndarray, " n"],
        row: Int[np.ndarray, " n"],
    ) -> tuple[np.ndarray, ...]:
        """Sample the BRDF; return the same."""
        assert worn.sampler is not None
        wo, uniform = self._geometry.wo.take(sample, axis=0), pool.uniform.take(row, axis=0)
        wi = worn.sampler.drawn(wo, uniform[:, 2:4])
        sample, wi = _rows((sample, wi), np.flatnonzero(wi[:, 2] > 0.0))
        frame, outwards = _rows((self._frame, self._outwards), sample)
        towards = np.einsum("nji,nj->ni", frame, wi)
        sample, wi, towards = _rows((sample, wi, towards), np.flatnonzero(dot(outwards, towards) > 0.0))
        position = self._geometry.position.take(sample, axis=0)
        luminance, density = light.light.luminance_and_density(position, towards)
        return _rows((sample, towards, wi, luminance, density), np.flatnonzero(luminance.any(axis=1)))


@dataclass(frozen=True, eq=False)
class _Worn:
    """Material of a task, and its sampler; None for light sampling alone."""

    surface: Surface
    sampler: DirectionSampler | None

    @property
    def terms(self) -> SumOfTerms | None:
        """Terms of the material, or None."""
        return self.surface.sum_of_terms

    @property
    def key(self) -> Hashable:
        """Key that is equal for materials with the same terms and sampling; None without terms."""
        terms = self.terms
        return None if terms is None else terms.key if self.sampler is None else sampling_key(self.surface)


@dataclass(frozen=True, eq=False)
class _Moments:
    """Sums over the directions of a task, for each of R terms and K fields of a light.

    sums (P, R K) : by pixel; known (P,) : mask of finished pixels.
    """

    sums: Float[np.ndarray, "P RK"]
    known: Bool[np.ndarray, " P"]


class _Drawn:
    """Cache of sampled directions for one geometry and its lights, and of sums shared by materials."""

    def __init__(self, geometry: VisibleGeometry, lights: tuple[SpreadLight, ...], seed: tuple[int, ...], most: int):
        self._lights, self._seed, self._most = lights, seed, most
        self._pixels = geometry.rows * geometry.width
        self._pools: dict[tuple[int, int], tuple[DrawnDirections, Int[np.ndarray, " P"]]] = {}
        self._moments: OrderedDict[Hashable, _Moments] = OrderedDict()

    @classmethod
    def of(cls, geometry: VisibleGeometry, lights: tuple[SpreadLight, ...], seed: tuple[int, ...], most: int) -> _Drawn:
        """Return the cache of a geometry, renewed if lights, seed or `most` differ from the last."""
        last = _drawn.get(geometry)
        if last is None or (last._lights, last._seed, last._most) != (lights, seed, most):
            last = _drawn[geometry] = cls(geometry, lights, seed, most)
        return last

    def pool(self, number: int, half: int) -> tuple[DrawnDirections, Int[np.ndarray, " P"]]:
        """Return the points for a light, and each pixel's offset in them."""
        if (number, half) not in self._pools:
            rng = np.random.default_rng([*self._seed, number, half])
            pool = drawn_pool(self._lights[number], self._most, rng)
            self._pools[number, half] = pool, rng.integers(0, len(pool.uniform), self._pixels)
        return self._pools[number, half]

    def moments(self, at: tuple[Hashable, ...], worn: _Worn, fields: int) -> _Moments | None:
        """Return the cached sums of a material for `fields` fields of a light; None for a material without terms.

        The least recently used ones are evicted to limit memory.
        """
        if worn.terms is None:
            return None
        key = (*at, worn.key)
        if key not in self._moments:
            sums = np.zeros((self._pixels, len(worn.terms.spectra) * fields))
            new = _Moments(sums, np.zeros(self._pixels, dtype=bool))
            self._moments[key] = new
            while sum(one.sums.nbytes for one in self._moments.values()) > _KEPT_BYTES and len(self._moments) > 1:
                self._moments.popitem(last=False)
        self._moments.move_to_end(key)
        return self._moments[key]


@dataclass(frozen=True, eq=False)
class _Part:
    """Part of the scene in a task: its material, and the moments that are summed instead of colours."""

    worn: _Worn
    moments: _Moments | None

    def missing(self, pixels: Int[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
        """Return a mask of pixels without finished sums."""
        return np.ones(len(pixels), dtype=bool) if self.moments is None else ~self.moments.known[pixels]


_drawn: WeakKeyDictionary[VisibleGeometry, _Drawn] = WeakKeyDictionary()


@dataclass(frozen=True)
class _Task:
    """Directions from `start` to `stop` of one kind, for one part of the BRDF.

    scattered : BRDF sampling, else light sampling. share : "even" (diffuse), "glossy" or "all".
    of_n : number of directions of each kind, relative to n.
    """

    scattered: bool
    share: str
    start: int
    stop: int
    of_n: float = 1.0

    def part(self, scattering: Scattering) -> _Worn | None:
        """Return the task's part of a material; None without such a part."""
        if self.share == "all":
            return _Worn(scattering.surface, scattering.sampler)
        if self.share == "even":
            return None if scattering.even is None else _Worn(scattering.even, None)
        return None if scattering.glossy is None else _Worn(scattering.glossy, scattering.glossy_sampler)


class _Shining:
    """Light prepared for folding, with an XYZ column for each of its spectra in each image."""

    def __init__(self, scene: Scene, light: SpreadLight, illuminants: Sequence[Spectrum | None]) -> None:
        self.light = light
        # Fields with the same spectrum are merged.
        own = {spectrum.key: spectrum for spectrum in light.spectra}
        numbers = {key: number for number, key in enumerate(own)}
        self._fields_of = np.zeros((len(light.spectra), len(own)))
        self._fields_of[range(len(light.spectra)), [numbers[spectrum.key] for spectrum in light.spectra]] = 1.0
        spectra = [tuple(own.values()) if other is None else (other,) for other in illuminants]
        self.folding = Folding(scene.observer, [one for each in spectra for one in each])
        self._whole = [other is not None for other in illuminants]
        self._first = np.cumsum([0, *(len(each) for each in spectra)])[:-1]
        self._even = is_even(light)
        # A rectangle is sampled uniformly by solid angle.
        self._alone = self._even or isinstance(light, SoftboxLight)

    def tasks(self, start: int, stop: int) -> Iterator[_Task]:
        """Yield the tasks that continue from `start` to `stop` directions."""
        if self._alone:
            yield _Task(False, "even", start, stop)
        of_n = _GLOSSY if self._even else 1.0
        for scattered in (False, True):
            yield _Task(scattered, "glossy" if self._alone else "all", round(of_n * start), round(of_n * stop), of_n)

    @property
    def count(self) -> int:
        """Number of fields with distinct spectra."""
        return self._fields_of.shape[1]

    def fields(self, columns: Float[np.ndarray, "n J"]) -> Float[np.ndarray, "n K"]:
        """Sum columns with the same spectrum."""
        return columns if columns.shape[1] == self.count else columns @ self._fields_of

    def colours(self, spectra: Float[np.ndarray, "R L"], nm: Float[np.ndarray, " L"]) -> Float[np.ndarray, "RK M3"]:
        """Return XYZ of each term in each field, for each image."""
        each = (spectra @ self.folding.weights(nm)).reshape(len(spectra), -1, 3)
        out = np.empty((len(spectra), self.count, len(self._whole), 3))
        for number, (whole, first) in enumerate(zip(self._whole, self._first, strict=True)):
            out[:, :, number] = each[:, first : first + (1 if whole else self.count)]
        return out.reshape(len(spectra) * self.count, -1)

    def added(self, f_r: Float[np.ndarray, "n C3"], fields: Float[np.ndarray, "n K"]) -> Float[np.ndarray, "n M3"]:
        """Multiply f_r with the light of each spectrum and sum by image."""
        total = fields.sum(axis=1, keepdims=True)
        if all(self._whole):
            return f_r * total
        fields = self.fields(fields)
        columns = np.concatenate([total if whole else fields for whole in self._whole], axis=1)
        each = f_r.reshape(len(f_r), -1, 3) * columns[:, :, None]
        return np.add.reduceat(each, self._first, axis=1).reshape(len(f_r), -1)


def _rows(arrays: Sequence[np.ndarray], which: Int[np.ndarray, " n"]) -> tuple[np.ndarray, ...]:
    """Select rows of each array; `take` is many times faster than indexing for short rows."""
    return tuple(each.take(which, axis=0) for each in arrays)


def _nothing_hides(scene: Scene, geometry: VisibleGeometry) -> bool:
    """Return whether only one convex body is visible, from outside, so that shadow rays are not needed."""
    if len(scene.parts) != 1 or geometry.geometric is None:
        return False
    mesh = scene.parts[0].mesh
    if not (dot(geometry.geometric, geometry.position - mesh.vertices.mean(axis=0)) > 0.0).all():
        return False
    if mesh not in _convex:
        _convex[mesh] = is_convex(mesh)
    return _convex[mesh]


# Cached, since a mesh is rendered with many materials and in many bands.
_convex: WeakKeyDictionary[Mesh, bool] = WeakKeyDictionary()


def _pairs(
    pixels: Int[np.ndarray, " n"], start: int, stop: int
) -> Iterator[tuple[Int[np.ndarray, " p"], Int[np.ndarray, " p"]]]:
    """Yield about `_PAIRS` pairs of pixel and direction index at a time, pixels in order."""
    for first in range(start, stop, _PAIRS):
        numbers = np.arange(first, min(first + _PAIRS, stop))
        step = max(1, _PAIRS // len(numbers))
        for begin in range(0, len(pixels), step):
            some = pixels[begin : begin + step]
            yield np.repeat(some, len(numbers)), np.tile(numbers, len(some))
