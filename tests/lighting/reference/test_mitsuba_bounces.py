"""Mitsuba 3's path tracer must agree with the reference within the noise of both, however often light is passed on.

Films, XYZ and noise are those of `mitsuba_scenes`. Mitsuba counts edges of a path: depth 2 is direct light, 3 is one
surface in between. Its diffuse surfaces have one side; those of our scenes are seen from that side only.
"""

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.lights import PointLight
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import sphere
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.scene import Part, Scene
from metamer.materials.analytic import CookTorrance, Lambert
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM as NM
from metamer.spectral.spectrum import Spectrum
from mitsuba_scenes import ALLOWANCE, FINE_NM, Emitter, assert_within_noise, finely, pictures_of, spectrum

pytestmark = pytest.mark.mitsuba

PIXELS, COUNT = 24, 256
RED = np.interp(NM, [380, 560, 620, 780], [0.05, 0.08, 0.7, 0.75])
BLUE = np.interp(NM, [380, 480, 560], [0.6, 0.65, 0.1])
GREY = np.full(81, 0.6)
GOLD_N = np.interp(NM, [400, 500, 600, 800], [1.46, 1.0, 0.25, 0.16])
GOLD_K = np.interp(NM, [400, 500, 800], [2.0, 1.8, 5.0])
BLACK = Spectrum.sampled(NM, np.zeros(81))
LAMP = (0.2, 1.6, 0.3)


def rectangle(*corners):
    """Four corners, counter-clockwise as seen from its front."""
    vertices = np.array(corners, dtype=float)
    normal = np.cross(vertices[1] - vertices[0], vertices[2] - vertices[0])
    return Mesh(vertices, np.tile(normal / np.linalg.norm(normal), (4, 1)), np.array([[0, 1, 2], [0, 2, 3]]))


def room():
    """Five sides of a box, open towards +z."""
    a, b, c, d = (-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)
    e, f, g, h = (-1, 2, 1), (1, 2, 1), (1, 2, -1), (-1, 2, -1)
    sides = {"floor": (a, b, c, d), "ceiling": (h, g, f, e), "back": (d, c, g, h), "left": (a, d, h, e)}
    return {name: rectangle(*corners) for name, corners in (sides | {"right": (c, b, f, g)}).items()}


@pytest.mark.parametrize(("depth", "ball"), [(2, "blue"), (3, "blue"), (6, "blue"), (4, "gold")])
def test_light_passed_on(mi, tmp_path, record_property, depth, ball):
    surfaces = {"red": RED, "grey": GREY, "blue": BLUE}
    bsdfs = {name: {"type": "diffuse", "reflectance": spectrum(values)} for name, values in surfaces.items()}
    bsdfs["gold"] = {"type": "roughconductor", "distribution": "ggx", "alpha": 0.4, "eta": spectrum(GOLD_N)}
    bsdfs["gold"] |= {"k": spectrum(GOLD_K)}
    ours = {name: Lambert(Spectrum.sampled(NM, values)) for name, values in surfaces.items()}
    ours["gold"] = CookTorrance(BLACK, GOLD_N, GOLD_K, 0.4, 1.0, "ggx", "smith")
    wearing = {"left": "red", "right": "blue"}
    parts = [Part(name, mesh, wearing.get(name, "grey")) for name, mesh in room().items()]
    body = sphere(4, 0.45)
    parts.append(Part("ball", Mesh(body.vertices + np.array([0.1, 0.5, 0.0]), body.normals, body.faces), ball))
    camera = Camera(
        position=(0, 1, 3.2), target=(0, 0.95, 0), vertical_fov_deg=42, width=PIXELS, height_px=PIXELS, samples=4
    )
    light = PointLight(LAMP, illuminant("FL11"), 1500.0)
    scene = Scene(tuple(parts), (light,), (camera,), observer("1931_2"))
    pictures = reference_images(scene, None, ours, budget=5.0, bounces=depth - 2, most_directions=1024)
    emitter = Emitter({"type": "point", "position": list(LAMP), "intensity": spectrum(finely(light), FINE_NM)},
                      finely(light), light.intensity_cd)  # fmt: skip
    integrator = {"type": "path", "max_depth": depth, "rr_depth": 100}
    theirs = pictures_of(mi, scene, emitter, integrator, bsdfs, tmp_path, COUNT)
    assert_within_noise(pictures, theirs, record_property, 2.0 * ALLOWANCE)
