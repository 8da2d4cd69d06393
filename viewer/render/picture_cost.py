"""Cost of a picture before it is drawn: memory at the peak, and time; what cannot fit is refused in numbers.

The bytes are those of the arrays that are there at once, and tests hold them to what is measured. The seconds are
those of one core of a small machine, to tell seconds from hours.
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

# Bytes at the peak: a triangle for the scene's geometry and for a light's shadows, or for rays; a sample point that is
# worked on and, by light, one that is kept; a pixel of XYZ and coverage with what encodes or writes it.
_TRIANGLE, _TRIANGLE_AND_LIGHT, _TRIANGLE_IN_RAYS = 1100, 400, 700
# A vertex, where something may hide a light that spreads: its visibility on its way to the GPU.
_VERTEX_HIDDEN = 700
_SAMPLE, _SAMPLE_KEPT, _SAMPLE_AND_LIGHT_KEPT = 560, 70, 120
_PIXEL = {".png": 84, ".exr": 36}
_PIXEL_AND_WAVELENGTH = 32
_SEEN, _SEEN_AND_LIGHT = 80, 30
# A light that spreads: what is gathered of it by pictures, and what a reference draws from and works on.
_SPREAD, _SPREAD_TRACED = 75_000_000, 32_000_000
# Samples of a reference under lights that spread, and pixels by spectrum, in two halves and what is made of them.
_SAMPLE_SPREAD, _PIXEL_AND_SPECTRUM_SPREAD = 130, 240
# Seconds: a triangle and light, a sample and light drawn, and one of the reference, at every wavelength.
_TRIANGLE_SECONDS, _DRAWN_SECONDS, _REFERENCE_SECONDS = 9e-6, 3e-6, 2.5e-5
# The same of a review, which traces no rays, for a formula; a scattered measurement takes fifty times as long.
_REVIEWED_SECONDS = 5e-7
# Seconds for an area or environment light: to gather it, for a sample drawn, and for a pixel of a reference of a gloss
# paint in a booth; a third for a matt one, three to ten times as much for metals and measurements.
_SPREAD_SECONDS, _SPREAD_DRAWN_SECONDS, _SPREAD_REFERENCE_SECONDS = 1.0, 6e-6, 4e-4

# Paths: seconds for a pixel and bounce of matt surfaces, and bytes of work space.
_BOUNCE_SECONDS, _PATHS_TRACED = 4e-3, 100_000_000

# Number of bounces that "auto" counts as here.
_AUTO_BOUNCES = 8
# Bytes of a site in a fast picture with bounces, for its rays with what is worked on and where they end; seconds to
# trace these, and to follow light along them.
_SITE, _SITE_TRACED_SECONDS, _SITE_SECONDS = 9_000, 1e-4, 7e-4

# Wavelengths that are drawn in the time of a picture in XYZ.
_COLUMNS = 12

# Share of the most seconds that visibility takes as a rule: sites are shut, or foretold from those beside them.
_AS_A_RULE = 0.25

#: Pictures that take less time than this are made without a word.
SAID_FROM_SECONDS = 1.0


@dataclass(frozen=True)
class PictureCost:
    """Memory at the peak and time of one picture, and what they are of, in words.

    stages : the names of its work as progress has it, in their order, and the seconds that each takes on all cores.
    """

    what: str
    memory_bytes: int
    seconds: float
    stages: tuple[tuple[str, float], ...] = ()

    @property
    def words(self) -> str:
        """Cost in words."""
        return f"{self.what}: about {gigabytes(self.memory_bytes)} of memory and {_duration(self.seconds)}"

    def check_room(self, scene: Scene, camera: Camera) -> None:
        """Raise `InputError` where this does not fit into the memory that there is."""
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
    """Return the cost of one picture of a scene, or of one material of a review under `spectra` illuminants.

    suffix : of the file: a PNG is encoded for a display first, which takes more.
    jobs : processes of a review; each holds what the camera sees, and its own pictures.
    """
    triangles = sum(len(part.mesh.faces) for part in scene.parts)
    # The number of bounces with "auto" is known after the work; a reference draws bounces as it does area light.
    bounces = _AUTO_BOUNCES if scene.bounces == "auto" else int(scene.bounces)
    lights, spread, pixels = len(scene.delta_lights), len(scene.spread_lights), camera.width * camera.height_px
    samples = pixels * camera.samples**2
    tile = min(samples, TILE_SAMPLES**2)
    # Lights of both kinds keep about the same.
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
    # Directions are the same for all lights' spectra; only their sums are not.
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
    """Seconds for a person, no finer than they are known.

    >>> _duration(0.3), _duration(42.0), _duration(400.0), _duration(20000.0)
    ('1 s', '42 s', '7 minutes', '6 hours')
    """
    if seconds < 90.0:
        return f"{max(1.0, seconds):.0f} s"
    return f"{seconds / 60.0:.0f} minutes" if seconds < 5400.0 else f"{seconds / 3600.0:.0f} hours"
