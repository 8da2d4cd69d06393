"""Indirect light at each pixel of a reference: path tracing at every wavelength, with the original surfaces, also
fluorescent ones (`path_colours`).

A path starts at a sample of the image and continues in a direction sampled from the BRDF. At each further hit point
direct light is added: of delta lights exactly; of area and environment lights from one direction sampled from the light
and from the path's next direction, weighted by the balance heuristic (as in `spread`). A path ends after the requested
number of bounces, or earlier by Russian roulette (Arvo and Kirk, "Particle transport and image synthesis", SIGGRAPH
1990). So the mean over paths is unbiased at every wavelength.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, Int

from ...materials.core.scattering import Scattering
from ...spectral.spectrum import Spectrum
from ..lights import DeltaLight, SpreadLight
from ..scene import Scene
from ..vectors import dot
from .geometry import Met, Tracer, VisibleGeometry
from .noise import Heard, unheard
from .path_colours import Carried, PathColours

# Paths per block: 10 MB at 81 wavelengths. Fewer for more wavelengths.
_PATHS, _WAVELENGTHS = 16384, 81
# First bounce with Russian roulette; least probability of continuing.
_ROULETTE, _LEAST = 3, 0.05


class BounceSum:
    """Sums over sampled paths of light via 1 to `bounces` further surfaces, in two halves, as in `SpreadSum`.

    Parameters
    ----------
    geometry : with `frame` and `geometric`. tracer : of the same scene. surfaces : by material id.
    illuminants : see `reference.reference_images`. seed : equal seeds give equal images. most : largest number of paths
    per pixel, in each half. bounces : surfaces besides the visible one, 1 or more.
    """

    def __init__(
        self,
        scene: Scene,
        geometry: VisibleGeometry,
        surfaces: Mapping[str, Scattering],
        illuminants: Sequence[Spectrum | None],
        tracer: Tracer,
        seed: tuple[int, ...],
        most: int,
        bounces: int,
    ) -> None:
        assert geometry.frame is not None
        assert geometry.geometric is not None
        self._scene, self._geometry, self._tracer, self._bounces = scene, geometry, tracer, bounces
        self._wearing = [surfaces[part.material] for part in scene.parts]
        self._colours = PathColours(scene, surfaces, illuminants)
        self._sums = np.zeros((2, geometry.rows * geometry.width, 3 * len(illuminants)))
        self._order = np.argsort(geometry.pixel, kind="stable")
        self._hits = np.bincount(geometry.pixel, minlength=self._sums.shape[1])
        self._first = np.cumsum(self._hits) - self._hits
        self._seed = seed
        self._pools = [self._pool(half, most) for half in range(2)]
        #: (H W,) number of paths of each pixel, in each half.
        self.directions = np.zeros(self._sums.shape[1], dtype=np.int64)
        #: (H W,) mask of pixels that see a surface.
        self.covered = self._hits > 0

    @property
    def _dimensions(self) -> int:
        """Random numbers per bounce: a direction from the surface, one from each light, and Russian roulette."""
        return 3 + 2 * len(self._scene.spread_lights)

    def _pool(self, half: int, most: int) -> tuple[Float[np.ndarray, "P d"], Int[np.ndarray, " pixels"]]:
        """Return scrambled Sobol points for a sample and the first bounces, and each pixel's offset in them."""
        from scipy.stats import qmc

        rng = np.random.default_rng([*self._seed, 1 + half])
        held = 1 + self._dimensions * min(self._bounces + 1, _ROULETTE)
        exponent = max(4 * most - 1, (1 << 14) - 1).bit_length()
        points = qmc.Sobol(held, scramble=True, bits=32, rng=rng).random_base2(exponent)
        return points, rng.integers(0, len(points), self._sums.shape[1])

    def extend(self, directions: int, pixels: Int[np.ndarray, " n"] | None = None, heard: Heard = unheard) -> None:
        """Continue pixels (ascending), with equal numbers of paths so far, to `directions` paths in each half; `heard`
        receives the share done.
        """
        pixels = np.flatnonzero(self.covered) if pixels is None else pixels
        if not len(pixels):
            return
        start = int(self.directions[pixels[0]])
        for half, (points, shift) in enumerate(self._pools):
            rng = np.random.default_rng([*self._seed, 3 + half, start])
            numbers = np.arange(start, directions)
            most = _PATHS * min(1.0, _WAVELENGTHS / self._colours.numbers)
            step = max(1, int(most) // len(numbers))
            for begin in range(0, len(pixels), step):
                heard(0.5 * (half + begin / len(pixels)))
                some = pixels[begin : begin + step]
                pixel, which = np.repeat(some, len(numbers)), np.tile(numbers, len(some))
                self._add(self._sums[half], points[which ^ shift[pixel]], pixel, rng)
        self.directions[pixels] = directions

    @property
    def halves(self) -> Float[np.ndarray, "2 H W M 3"]:
        """XYZ of each half."""
        geometry = self._geometry
        lux = self._scene.viewing.reference_illuminance_lux
        scale = np.pi / lux / (geometry.samples * np.maximum(self.directions, 1))
        return (self._sums * (self._hits * scale)[:, None]).reshape(2, geometry.rows, geometry.width, -1, 3)

    def _add(
        self,
        sums: Float[np.ndarray, "P C"],
        points: Float[np.ndarray, "n d"],
        pixel: Int[np.ndarray, " n"],
        rng: np.random.Generator,
    ) -> None:
        """Trace one path for each pixel of a list."""
        geometry = self._geometry
        sample = self._order[self._first[pixel] + (points[:, 0] * self._hits[pixel]).astype(np.int64)]
        assert geometry.frame is not None
        assert geometry.geometric is not None
        met = Met(
            geometry.position[sample],
            geometry.part[sample],
            geometry.geometric[sample],
            geometry.frame[sample],
            geometry.wo[sample],
        )
        uv = None if geometry.uv is None else geometry.uv[sample]
        path, carried = np.arange(len(pixel)), self._colours.begun(len(pixel))
        found = np.zeros((len(pixel), sums.shape[1]))
        size = self._dimensions
        for bounce in range(self._bounces + 1):
            held = points[path, 1 + size * bounce : 1 + size * (bounce + 1)]
            uniform = held if held.shape[1] else rng.random((len(path), size))
            if bounce > 0:
                self._lit(found, path, met, uv, carried, uniform)
            if bounce >= _ROULETTE:
                # Brightness is the largest of X, Y and Z.
                chance = np.clip(self._colours.brightness(carried), _LEAST, 1.0)
                goes_on = np.flatnonzero(uniform[:, 2] < chance)
                carried = carried.chosen(goes_on).times(1.0 / chance[goes_on])
                path, met, uniform = path[goes_on], met.chosen(goes_on), uniform[goes_on]
                uv = None if uv is None else uv[goes_on]
            path, met, uv, carried = self._further(found, path, met, uv, carried, uniform, bounce)
            if not len(path):
                break
        low = pixel[0]
        for channel in range(found.shape[1]):
            total = np.bincount(pixel - low, found[:, channel])
            sums[low : low + len(total), channel] += total

    def _density(self, met: Met, wi: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
        """Return the probability density of continuing in directions, 1/sr."""
        found = np.zeros(len(wi))
        for number, worn in enumerate(self._wearing):
            mine = np.flatnonzero(met.part == number)
            if len(mine):
                found[mine] = worn.sampler.density(met.wo[mine], wi[mine])
        return found

    def _lit(
        self,
        found: Float[np.ndarray, "paths C"],
        path: Int[np.ndarray, " n"],
        met: Met,
        uv: Float[np.ndarray, "n 2"] | None,
        carried: Carried,
        uniform: Float[np.ndarray, "n d"],
    ) -> None:
        """Add direct light at hit points."""
        spread = 0
        for which, light in enumerate(self._scene.lights):
            if isinstance(light, DeltaLight):
                arriving = light.arrivals(met.position)
                towards, strength = arriving.directions, arriving.illuminance_lux[:, None]
                by_light = None
            else:
                assert isinstance(light, SpreadLight)
                towards, by_light = light.drawn(met.position, uniform[:, 3 + 2 * spread : 5 + 2 * spread])
                strength = light.luminance(met.position, towards)
                spread += 1
            wi = np.einsum("nij,nj->ni", met.frame, towards)
            up = (wi[:, 2] > 0.0) & (dot(met.geometric, towards) > 0.0) & strength.any(axis=1)
            if by_light is not None:
                up &= by_light > 0.0
            some = np.flatnonzero(up)
            start = self._tracer.lifted(met.position[some], met.geometric[some])
            to = np.ascontiguousarray(towards[some])
            far = light.arrivals(start).distance if isinstance(light, DeltaLight) else light.distance(start, to)
            some = some[self._tracer.free(start, to, far)]
            if not len(some):
                continue
            here = met.chosen(some)
            weight = wi[some, 2]
            if by_light is not None:
                weight = weight / (by_light[some] + self._density(here, wi[some]))
            sent = self._colours.scattered(carried.chosen(some), here, None if uv is None else uv[some], wi[some])
            found[path[some]] += self._colours.seen(sent, which, strength[some] * weight[:, None])

    def _further(
        self,
        found: Float[np.ndarray, "paths C"],
        path: Int[np.ndarray, " n"],
        met: Met,
        uv: Float[np.ndarray, "n 2"] | None,
        carried: Carried,
        uniform: Float[np.ndarray, "n d"],
        bounce: int,
    ) -> tuple[Int[np.ndarray, " k"], Met, Float[np.ndarray, "k 2"] | None, Carried]:
        """Continue paths to the next surface; add area and environment lights that they hit, except directly from the
        visible surface.
        """
        wi = np.zeros((len(path), 3))
        for number, worn in enumerate(self._wearing):
            mine = np.flatnonzero(met.part == number)
            if len(mine):
                wi[mine] = worn.sampler.drawn(met.wo[mine], np.ascontiguousarray(uniform[mine, :2]))
        towards = np.einsum("nji,nj->ni", met.frame, wi)
        density = self._density(met, wi)
        some = np.flatnonzero((wi[:, 2] > 0.0) & (dot(met.geometric, towards) > 0.0) & (density > 0.0))
        path, met, wi, density = path[some], met.chosen(some), wi[some], density[some]
        uv = None if uv is None else uv[some]
        towards = np.ascontiguousarray(towards[some])
        carried = self._colours.scattered(carried.chosen(some), met, uv, wi).times(wi[:, 2] / density)
        start = self._tracer.lifted(met.position, met.geometric)
        face = self._tracer.first(start, towards)
        hit = np.flatnonzero(face >= 0)
        distance = np.full(len(face), np.inf)
        distance[hit], weights = self._tracer.on_triangle(face[hit], start[hit], towards[hit])
        if bounce > 0:
            for which, light in enumerate(self._scene.lights):
                if not isinstance(light, SpreadLight):
                    continue
                seen = np.flatnonzero(distance >= light.distance(start, towards))
                strength = light.luminance(met.position[seen], towards[seen])
                by_light = light.density(met.position[seen], towards[seen])
                share = density[seen] / (density[seen] + by_light)
                found[path[seen]] += self._colours.seen(carried.chosen(seen), which, strength * share[:, None])
        if bounce == self._bounces:
            hit = hit[:0]
            weights = weights[:0]
        position = start[hit] + distance[hit, None] * towards[hit]
        ahead = self._tracer.seen(face[hit], weights, position, -towards[hit])
        uv = self._tracer.uv_at(face[hit], weights) if uv is not None else None
        return path[hit], ahead, uv, carried.chosen(hit)
