"""Estimated cost of an image: peak memory and time; images that do not fit are refused.

Bytes are those of simultaneously live arrays, tested against measurements. Seconds are those of one core of a small
machine, to distinguish seconds from hours.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ...lighting.camera import Camera
from ...lighting.reference.reference import BAND_SAMPLES
from ...lighting.scene import Scene
from ...lighting.visibility.precompute import SECONDS_A_VERTEX
from ...lighting.visibility.refinement import refined
from ...runtime.memory import check_room, gigabytes
from ...runtime.worker_pool import usable_cores
from ...spectral.spectrum import WORKING_WAVELENGTHS_NM
from .cache import KEPT_SAMPLES
from .light_cache import visibilities
from .scene_layers import BOUNCES, DRAWING, INTERREFLECTION, VISIBILITY
from .view import TILE_SAMPLES

Kind = Literal["picture", "spectra", "reference", "review"]

# Peak bytes: per triangle for the scene's geometry and for a light's shadows, or for rays; per sample in work and, by
# light, per cached sample; per pixel of XYZ and coverage including encoding or writing.
_TRIANGLE, _TRIANGLE_AND_LIGHT, _TRIANGLE_IN_RAYS = 1100, 400, 700
# Per vertex, for visibility of area and environment lights on the way to the GPU.
_VERTEX_HIDDEN = 700
_SAMPLE, _SAMPLE_KEPT, _SAMPLE_AND_LIGHT_KEPT = 560, 70, 120
_PIXEL = {".png": 84, ".exr": 36}
_PIXEL_AND_WAVELENGTH = 32
_SEEN, _SEEN_AND_LIGHT = 80, 30
# Per area or environment light: prefiltered for fast images, and sampling tables and work space of a reference.
_SPREAD, _SPREAD_TRACED = 75_000_000, 32_000_000
# Per sample of a reference under area and environment lights, and per pixel and spectrum, for two halves and their
# results.
_SAMPLE_SPREAD, _PIXEL_AND_SPECTRUM_SPREAD = 130, 240
# Seconds: per triangle and light, per sample and light when drawn, and in the reference, at every wavelength.
_TRIANGLE_SECONDS, _DRAWN_SECONDS, _REFERENCE_SECONDS = 9e-6, 3e-6, 2.5e-5
# The same for an analytic material in a review, without ray tracing; a scattered measurement takes fifty times as long.
_REVIEWED_SECONDS = 5e-7
# Seconds for an area or environment light: for prefiltering, per drawn sample, and per pixel of a reference of a gloss
# paint in a booth; a third for a diffuse one, three to ten times as much for metals and measurements.
_SPREAD_SECONDS, _SPREAD_DRAWN_SECONDS, _SPREAD_REFERENCE_SECONDS = 1.0, 6e-6, 4e-4

# Path tracing: seconds per pixel and bounce on diffuse surfaces, and bytes of work space.
_BOUNCE_SECONDS, _PATHS_TRACED = 4e-3, 100_000_000

# Assumed number of bounces for "auto".
_AUTO_BOUNCES = 8
# Bytes per site of a fast image with bounces, for rays, hits and work space; seconds per site to trace them, and to
# solve interreflection.
_SITE, _SITE_TRACED_SECONDS, _SITE_SECONDS = 9_000, 1e-4, 7e-4

# Number of wavelengths drawn in the time of one XYZ image.
_COLUMNS = 12

# Typical share of the upper bound of seconds for visibility, since sites are blocked or interpolated.
_AS_A_RULE = 0.25

#: Seconds of rendering above which it is announced.
SAID_FROM_SECONDS = 1.0


@dataclass(frozen=True)
class PictureCost:
    """Peak memory and time of one image, with a description.

    stages : names of its work as in progress, in order, and the seconds of each on all cores.
    """

    what: str
    memory_bytes: int
    seconds: float
    stages: tuple[tuple[str, float], ...] = ()

    @property
    def words(self) -> str:
        """Description of the cost."""
        return f"{self.what}: about {gigabytes(self.memory_bytes)} of memory and {_duration(self.seconds)}"

    def check_room(self, scene: Scene, camera: Camera) -> None:
        """Raise `InputError` if this does not fit into free memory."""
        check_room(
            self.memory_bytes,
            "the picture does not fit into memory",
            self.words,
            "fewer pixels (width, height_px) or samples, or the picture in parts by cameras of their own",
            file=scene.path,
            field=f"camera {camera.name}",
        )


def picture_cost(
    scene: Scene,
    camera: Camera,
    kind: Kind = "picture",
    suffix: str = ".png",
    spectra: int = 1,
    jobs: int = 1,
) -> PictureCost:
    """Estimate the cost of one image of a scene, or of one material of a review under `spectra` illuminants.

    suffix : of the file; a PNG costs more, since it is encoded for a display.
    jobs : processes of a review; each holds the visible geometry and its own images.
    """
    triangles = sum(len(part.mesh.faces) for part in scene.parts)
    # The number of bounces with "auto" is not known beforehand; a reference samples bounces like area lights.
    bounces = _AUTO_BOUNCES if scene.bounces == "auto" else int(scene.bounces)
    lights, spread, pixels = len(scene.delta_lights), len(scene.spread_lights), camera.width * camera.height_px
    samples = pixels * camera.samples**2
    tile = min(samples, TILE_SAMPLES**2)
    # Both kinds of light need about the same memory.
    both = lights + spread
    kept = samples if samples * both <= KEPT_SAMPLES else 0
    drawn = triangles * (_TRIANGLE + _TRIANGLE_AND_LIGHT * both) + tile * _SAMPLE
    drawn += kept * (_SAMPLE_KEPT + _SAMPLE_AND_LIGHT_KEPT * both)
    if spread:
        drawn += _VERTEX_HIDDEN * sum(len(part.mesh.vertices) for part in scene.parts)
    sites = 0
    if bounces and kind != "reference":
        sites = sum(len(part.mesh.vertices) for part in refined(scene)[0].parts)
    drawn += sites * _SITE
    traced = triangles * _TRIANGLE_IN_RAYS
    picture = pixels * _PIXEL.get(suffix.lower(), _PIXEL[".png"])
    drawing = triangles * lights * _TRIANGLE_SECONDS + samples * lights * _DRAWN_SECONDS
    drawing += spread * (_SPREAD_SECONDS + samples * _SPREAD_DRAWN_SECONDS)
    if sites:
        drawing += samples * _SPREAD_DRAWN_SECONDS
    followed = sites * (_SITE_TRACED_SECONDS + _SITE_SECONDS)
    drawn += _SPREAD * spread
    # Directions are shared by all spectra; only sums are separate.
    drawn_directions = pixels * spread * _SPREAD_REFERENCE_SECONDS
    sums = spread * _SPREAD_TRACED
    if bounces:
        drawn_directions += pixels * bounces * _BOUNCE_SECONDS
        sums += _SPREAD_TRACED + _PATHS_TRACED
    if spread or bounces:
        sums += min(samples, BAND_SAMPLES) * _SAMPLE_SPREAD + pixels * spectra * _PIXEL_AND_SPECTRUM_SPREAD
    if kind == "reference":
        found = traced + min(samples, BAND_SAMPLES) * _SAMPLE + 2 * picture + sums
        seconds = samples * lights * _REFERENCE_SECONDS + drawn_directions
    elif kind == "spectra":
        found = drawn + pixels * len(WORKING_WAVELENGTHS_NM) * _PIXEL_AND_WAVELENGTH
        drawing *= len(WORKING_WAVELENGTHS_NM) / _COLUMNS
        seconds = followed + drawing
    elif kind == "review":
        found = drawn + traced + samples * _SAMPLE + 2 * picture * spectra
        found += jobs * (samples * (_SEEN + _SEEN_AND_LIGHT * lights) + 24 * pixels * spectra + sums)
        seconds = followed + drawing + samples * lights * _REVIEWED_SECONDS + drawn_directions
    else:
        found, seconds = drawn + picture, followed + drawing
    of_each = "1 sample" if camera.samples == 1 else f"{camera.samples} x {camera.samples} samples"
    what = (
        f"{camera.width:,} x {camera.height_px:,} pixels of {of_each}, {triangles:,} triangles, "
        f"{both} {'light' if both == 1 else 'lights'}"
    )
    vertices, cores = sum(len(part.mesh.vertices) for part in scene.parts), usable_cores()
    stages = []
    if sites:
        stages += [(INTERREFLECTION, sites * _SITE_TRACED_SECONDS / cores), (BOUNCES, sites * _SITE_SECONDS)]
    stages += visibilities(scene) * [(VISIBILITY, _AS_A_RULE * SECONDS_A_VERTEX * vertices / cores)]
    return PictureCost(what, found, seconds, (*stages, (DRAWING, drawing / cores)))


def _duration(seconds: float) -> str:
    """Format seconds with the precision of the estimate.

    >>> _duration(0.3), _duration(42.0), _duration(400.0), _duration(20000.0)
    ('1 s', '42 s', '7 minutes', '6 hours')
    """
    if seconds < 90.0:
        return f"{max(1.0, seconds):.0f} s"
    return f"{seconds / 60.0:.0f} minutes" if seconds < 5400.0 else f"{seconds / 3600.0:.0f} hours"
