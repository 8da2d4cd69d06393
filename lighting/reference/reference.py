"""The slow truth: every sample point, every wavelength, float64, the original surfaces.

A light from one direction is one sum at each sample point. Of lights that spread, directions are drawn
(`spread`), until the noise that this leaves is small beside what a picture is judged by.
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

# Sample points per band: bounds memory to some 200 MB however large the picture.
BAND_SAMPLES = 400_000
# Samples per evaluation of a surface: 81 wavelengths of them, in float64, stay in cache. Of more wavelengths, fewer.
BLOCK = 4096


@dataclass(frozen=True, eq=False)
class ReferencePictures:
    """`xyz` (M, H, W, 3) float64, one picture for each light spectrum asked for; `coverage` (H, W).

    noise : what is left to chance; None where no light spreads, and nothing is.
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
    """XYZ (H, W, 3) and coverage (H, W) of one picture; see `reference_images`."""
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
    """Return the same view under several light spectra; surfaces are evaluated once for all of them.

    XYZ = mean over a pixel's samples of: sum over lights of visibility E / E_ref pi f_r(wi, wo) cos(theta_i), folded
    with light spectrum and observer, so that a perfect diffuser that receives E_ref has Y = 1. A sample that meets
    nothing adds 0 to XYZ and to coverage: XYZ is premultiplied by coverage. Of a light that spreads, E / E_ref stands
    for the integral of luminance over directions / E_ref: pi / E_ref times that of f_r cos(theta_i) V L is added.

    Parameters
    ----------
    camera : None takes the scene's first.
    surfaces : by material id, for every id in the scene.
    illuminants : None keeps the lights' own spectra; a spectrum replaces that of every light.
    geometry : what `visible_geometry(scene, camera)` gave, to be used again for other materials; with uv where one of
        them needs them (`Scene.needs_uv`). Without it the picture is traced in bands of rows of at most about
        `band_samples` sample points; so it is where materials have holes that the geometry does not.
    tracer : of the same meshes and holes, where somebody has one; only with `geometry`.
    budget : ΔE94 that the picture is to be judged by: lights that spread may leave noise of `NOISE_SHARE` of it, as
        the mean of the pixels of each band.
    most_directions : drawn for a pixel of each kind and half at the most; `ReferencePictures.noise` says when reached.
    seed : of what is drawn; equal seeds and equal bands give equal pictures.
    bounces : surfaces that light may come by beside the one that is seen; 0 is direct light alone. What comes so is
        drawn (`bounces`), and has a noise as lights have that spread.
    progress : called with (rows done, rows in all, what is done) as bands are traced; directions that are drawn count
        as rows, which may be fewer again where more turn out to be needed.

    Raises
    ------
    UnknownNameError : a material of the scene is not in `surfaces`.
    InputError : a budget or a number of directions that is not above 0; a geometry of a scene without lights that
        spread, where this one has some.
    """
    for field, value in (("budget", budget), ("most_directions", most_directions)):
        if not value > 0:
            raise InputError("nothing that could be kept to", field=field, found=value, expected="more than 0")
    camera = scene.camera() if camera is None else camera
    scene.check_surfaces(surfaces)
    scene = scene.cut(surfaces)
    if geometry is not None and bounces and geometry.frame is None:
        # It has no frames, which bounces need.
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
    """Say a share of a band of a picture as rows of it that are done."""
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
        # Half of them has to be a whole number.
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
        """`xyz` of other lights with that of those that spread, for the rows of a picture from `start`."""
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
        """Noise of all that was added; None where nothing was."""
        return noise_stated(self._found, self._aimed) if self._found else None


def _shade(
    scene: Scene,
    geometry: VisibleGeometry,
    surfaces: Mapping[str, Surface],
    foldings: Sequence[Folding],
    count: int,
    block: int,
) -> Float[np.ndarray, "M H W 3"]:
    """XYZ of one geometry under `count` spectra in place of each light's, box-filtered to pixels."""
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
    """Some of the samples that a light reaches."""
    sample = lit.sample[rows]
    uv, footprint = (None if one is None else one[sample] for one in (geometry.uv, geometry.footprint))
    return Points(lit.wi[rows], geometry.wo[sample], uv, footprint)
