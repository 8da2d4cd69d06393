"""Reference renderer: every sample point, every wavelength, float64, the original surfaces.

Delta lights are summed exactly at each sample point. Area and environment lights are integrated by Monte Carlo
(`spread`), until the noise is small against the error budget.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float, Int

from ...materials.core.points import Points
from ...materials.core.scattering import Scattering
from ...materials.core.surface import Surface
from ...runtime.errors import InputError
from ...spectral.folding import Folding
from ...spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from ..camera import Camera
from ..scene import Scene
from .bounces import BounceSum
from .geometry import LitSamples, Tracer, VisibleGeometry, visible_geometry
from .noise import (
    MOST_DIRECTIONS,
    NOISE_SHARE,
    GatheredHalves,
    ReferenceNoiseEstimate,
    Together,
    draw_until_quiet,
    noise_stated,
)
from .spread import SpreadSum

# Sample points per band, which bounds memory to some 200 MB for any image size.
BAND_SAMPLES = 400_000
# Samples per evaluation of a surface, sized for the processor's cache at 81 wavelengths in float64. Fewer for more
# wavelengths.
BLOCK = 4096


@dataclass(frozen=True, eq=False)
class ReferencePictures:
    """Images `xyz` (M, H, W, 3) float64, one for each illuminant; `coverage` (H, W).

    noise : estimate of sampling noise; None without Monte Carlo sampling.
    """

    xyz: Float[np.ndarray, "M H W 3"]
    coverage: Float[np.ndarray, "H W"]
    noise: ReferenceNoiseEstimate | None = None


def reference_image(
    scene: Scene,
    camera: Camera | None,
    surfaces: Mapping[str, Surface],
    illuminant: Spectrum | None = None,
) -> tuple[Float[np.ndarray, "H W 3"], Float[np.ndarray, "H W"]]:
    """Render XYZ (H, W, 3) and coverage (H, W) of one image; see `reference_images`."""
    pictures = reference_images(scene, camera, surfaces, (illuminant,))
    return pictures.xyz[0], pictures.coverage


def reference_images(
    scene: Scene,
    camera: Camera | None,
    surfaces: Mapping[str, Surface],
    illuminants: Sequence[Spectrum | None] = (None,),
    *,
    geometry: VisibleGeometry | None = None,
    tracer: Tracer | None = None,
    band_samples: int = BAND_SAMPLES,
    block: int = BLOCK,
    budget: float = 1.0,
    most_directions: int = MOST_DIRECTIONS,
    seed: int = 0,
    bounces: int = 0,
    progress: Callable[[int, int, str], None] | None = None,
) -> ReferencePictures:
    """Render a view under several light spectra; surfaces are evaluated once for all of them.

    XYZ = mean over a pixel's samples of: sum over lights of visibility E / E_ref pi f_r(wi, wo) cos(theta_i), folded
    with light spectrum and observer, so that a perfect diffuser under E_ref has Y = 1. A sample without a surface adds
    0 to XYZ and to coverage: XYZ is premultiplied by coverage. For area and environment lights pi / E_ref times the
    integral of f_r cos(theta_i) V L is added instead.

    Parameters
    ----------
    camera : None takes the scene's first.
    surfaces : by material id, for every id in the scene.
    illuminants : one per image; a spectrum replaces that of every light, None keeps the lights' own.
    geometry : result of `visible_geometry(scene, camera)`, for reuse with other materials; with uv if one of them needs
        it (`Scene.needs_uv`). Without it, or if materials have other holes, the image is traced in bands of rows of at
        most about `band_samples` sample points.
    tracer : of the same meshes and holes, if available; only with `geometry`.
    budget : error budget, ΔE94; sampling noise may be `NOISE_SHARE` of it, as the mean over pixels of each band.
    most_directions : limit per pixel, of each kind and half; `ReferencePictures.noise` tells if it was reached.
    seed : of random numbers; equal seeds and equal bands give equal images.
    bounces : largest number of surfaces on a light path besides the visible one; 0 is direct light alone. Indirect
        light is path traced (`bounces`), and is noisy as well.
    progress : called with (rows done, number of rows, description); sampling counts as a share of rows, which may
        decrease if more samples turn out to be needed.

    Raises
    ------
    UnknownNameError : a material of the scene is not in `surfaces`.
    InputError : a budget or number of directions that is not positive; a geometry without frames for a scene with area
        or environment lights.
    """
    for field, value in (("budget", budget), ("most_directions", most_directions)):
        if not value > 0:
            raise InputError("nothing that could be kept to", field=field, found=value, expected="more than 0")
    camera = scene.camera() if camera is None else camera
    scene.check_surfaces(surfaces)
    scene = scene.cut(surfaces)
    if geometry is not None and bounces and geometry.frame is None:
        # It lacks the frames needed for bounces.
        geometry = None
    if geometry is not None and geometry.cutouts != (scene.cutouts if any(scene.cutouts) else ()):
        # It was computed for other holes.
        geometry = None
    foldings = [
        Folding(scene.observer, [light.spectrum if other is None else other for other in illuminants])
        for light in scene.delta_lights
    ]
    spread = _Spread(scene, surfaces, illuminants, NOISE_SHARE * budget, most_directions, seed, bounces)
    say = progress or (lambda *_: None)
    if geometry is not None:
        xyz = _shade(scene, geometry, surfaces, foldings, len(illuminants), block)
        if spread.wanted:
            rays = partial(Tracer, scene) if tracer is None else lambda: tracer
            xyz = spread.added(xyz, geometry, rays, 0, partial(_say_rows, say, slice(0, geometry.rows), geometry.rows))
        return ReferencePictures(xyz, geometry.coverage, spread.noise)
    say(0, camera.height_px, f"sorting {sum(len(part.mesh.faces) for part in scene.parts):,} triangles for rays")
    tracer = Tracer(scene)
    step = max(1, band_samples // (camera.width * camera.samples**2))
    xyz, coverage = [], []
    for start in range(0, camera.height_px, step):
        rows = slice(start, min(start + step, camera.height_px))
        band = visible_geometry(scene, camera, rows, tracer, scene.needs_uv(surfaces), bounces > 0)
        shaded = _shade(scene, band, surfaces, foldings, len(illuminants), block)
        if spread.wanted:
            said = partial(_say_rows, say, rows, camera.height_px)
            shaded = spread.added(shaded, band, lambda: tracer, start, said)
        xyz.append(shaded)
        coverage.append(band.coverage)
        say(min(start + step, camera.height_px), camera.height_px, "tracing")
    return ReferencePictures(np.concatenate(xyz, axis=1), np.concatenate(coverage), spread.noise)


def _say_rows(say: Callable[[int, int, str], None], band: slice, total: int, share: float, words: str) -> None:
    """Report the share of a band as rows done."""
    say(band.start + int(share * (band.stop - band.start)), total, words)


class _Spread:
    """Contribution of area lights and bounces to each band of a picture, and the noise of all bands together."""

    def __init__(
        self,
        scene: Scene,
        surfaces: Mapping[str, Surface],
        illuminants: Sequence[Spectrum | None],
        aimed: float,
        most: int,
        seed: int,
        bounces: int,
    ) -> None:
        self._scene, self._illuminants, self._bounces = scene, illuminants, bounces
        # Must be even, for two halves.
        self._aimed, self._most, self._seed = aimed, max(2, most - most % 2), seed
        self._found: list[GatheredHalves] = []
        self.wanted = bool(scene.spread_lights) or bounces > 0
        if self.wanted:
            self._surfaces = {name: Scattering(surfaces[name]) for name in scene.material_ids}
            self._whites = scene.adopted_whites(illuminants)

    def added(
        self,
        xyz: Float[np.ndarray, "M H W 3"],
        geometry: VisibleGeometry,
        tracer: Callable[[], Tracer],
        start: int,
        say: Callable[[float, str], None],
    ) -> Float[np.ndarray, "M H W 3"]:
        """Add area and environment lights and bounces to `xyz` of delta lights, for the rows of an image from
        `start`.
        """
        of_scene, seed = (self._scene, geometry, self._surfaces, self._illuminants), (self._seed, start)
        found = []
        if self._scene.spread_lights:
            found.append(SpreadSum(*of_scene, tracer, seed, self._most))
        if self._bounces:
            found.append(BounceSum(*of_scene, tracer(), seed, self._most, self._bounces))
        sums = Together(found)
        self._found.append(draw_until_quiet(sums, xyz, geometry.coverage, self._whites, self._aimed, self._most, say))
        return self._found[-1].xyz

    @property
    def noise(self) -> ReferenceNoiseEstimate | None:
        """Noise of all bands; None without sampling."""
        return noise_stated(self._found, self._aimed) if self._found else None


def _shade(
    scene: Scene,
    geometry: VisibleGeometry,
    surfaces: Mapping[str, Surface],
    foldings: Sequence[Folding],
    count: int,
    block: int,
) -> Float[np.ndarray, "M H W 3"]:
    """Render delta lights under `count` spectra: XYZ, box-filtered to pixels."""
    total = np.zeros((geometry.rows * geometry.width, 3 * count))
    for folding, lit in zip(foldings, geometry.lit, strict=True):
        part_of = geometry.part[lit.sample]
        for index, part in enumerate(scene.parts):
            mine = np.flatnonzero(part_of == index)
            surface = surfaces[part.material]
            values = np.empty((len(mine), 3 * count))
            usual = WORKING_WAVELENGTHS_NM.size
            step = max(block * usual // max(surface.wavelengths_nm.size, usual), 1)
            for start in range(0, len(mine), step):
                rows = mine[start : start + step]
                values[start : start + step] = surface.xyz(lit_points(geometry, lit, rows), folding)
            scale = np.pi * lit.wi[mine, 2] * lit.illuminance_lux[mine] / scene.viewing.reference_illuminance_lux
            values *= scale[:, None]
            pixel = geometry.pixel[lit.sample[mine]]
            for channel in range(values.shape[1]):
                total[:, channel] += np.bincount(pixel, values[:, channel], minlength=len(total))
    total /= geometry.samples
    return total.reshape(geometry.rows, geometry.width, count, 3).transpose(2, 0, 1, 3)


def lit_points(geometry: VisibleGeometry, lit: LitSamples, rows: Int[np.ndarray, " K"]) -> Points:
    """Return the points of some samples lit by a light."""
    sample = lit.sample[rows]
    uv, footprint = (None if one is None else one[sample] for one in (geometry.uv, geometry.footprint))
    return Points(lit.wi[rows], geometry.wo[sample], uv, footprint)
