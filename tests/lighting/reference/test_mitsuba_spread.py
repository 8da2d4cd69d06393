"""Mitsuba 3 under lights that spread: it must agree with the reference within the noise of both, at every wavelength.

Films, XYZ and noise are those of `mitsuba_scenes`. A light that is even over all directions is Mitsuba's `constant`
emitter, which takes any spectrum. Its `envmap` knows RGB only: equal RGB are its D65 times a number, so that the map is
of one spectrum, which our side gets from Mitsuba. Its columns lie as ours do; its first and last rows lie at the poles
themselves, so that it gets 2 H + 1 rows of ours, between whose middles both are linear: the two are the same function
of direction. Only direct light is traced, both by the light and by the surface.
"""

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.mesh.shapes import plane, speed_shape, sphere
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.scene import Part, Scene
from metamer.materials.analytic import CookTorrance, Lambert
from metamer.materials.svbrdf.texture import SpectralTexture
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM as NM
from metamer.spectral.spectrum import Spectrum
from mitsuba_scenes import FINE_NM, Emitter, assert_within_noise, pictures_of, spectrum

pytestmark = pytest.mark.mitsuba

PIXELS, COUNT = 32, 144
RED, BLUE = np.interp(NM, [380, 560, 620, 780], [0.05, 0.08, 0.6, 0.7]), np.interp(NM, [380, 480, 560], [0.5, 0.6, 0.1])
GOLD_N, GOLD_K = (
    np.interp(NM, [400, 500, 600, 800], [1.46, 1.0, 0.25, 0.16]),
    np.interp(NM, [400, 500, 800], [2, 1.8, 5]),
)
BLACK = Spectrum.sampled(NM, np.zeros(81))


def constant(mi, power):
    """Our light and Mitsuba's, even over all directions."""
    light = EnvironmentLight(np.ones((1, 2, 4)), (Spectrum(power, FINE_NM, "emission"),), 1000.0)
    return light, Emitter({"type": "constant", "radiance": spectrum(power, FINE_NM)}, power, light.fields[0, 0, 0])


def mapped(mi, field):
    """The same of a map."""
    height = len(field)
    d65 = mi.load_dict({"type": "d65"})
    power = []
    for nm in FINE_NM:
        at = mi.SurfaceInteraction3f()
        at.wavelengths = [nm] * 4
        power.append(d65.eval(at)[0])
    rows = np.clip(np.arange(2 * height + 1) / 2 - 0.5, 0, height - 1)
    above = np.minimum(rows.astype(int), height - 2)
    finer = field[above] + (rows - above)[:, None] * (field[above + 1] - field[above])
    rgb = mi.Bitmap(np.repeat(finer[..., None], 3, axis=2).astype(np.float32))
    light = EnvironmentLight(field[None], (Spectrum(np.array(power), FINE_NM, "emission"),), 1000.0)
    return light, Emitter({"type": "envmap", "bitmap": rgb}, np.array(power), light.fields[0, 0, 0] / field[0, 0])


def assert_agrees(mi, folder, record, parts, light, surfaces, bsdfs):
    ours_light, emitter = light
    camera = Camera(
        position=(0.6, 1.6, 4.5), target=(0, 0.3, 0), vertical_fov_deg=36, width=PIXELS, height_px=PIXELS, samples=6
    )
    scene = Scene(parts, (ours_light,), (camera,), observer("1931_2"))
    pictures = reference_images(scene, None, surfaces, budget=1.5)
    integrator = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 1, "hide_emitters": True}
    theirs = pictures_of(mi, scene, emitter, integrator, bsdfs, folder, COUNT)
    assert_within_noise(pictures, theirs, record)


def floor():
    matrix = np.eye(4)
    matrix[1, 3] = -1.0
    return plane(8, 8).transformed(matrix)


def test_a_gold_body_on_a_painted_floor_under_even_light_of_fl11(mi, tmp_path, record_property):
    power = np.interp(FINE_NM, illuminant("FL11").wavelengths_nm, illuminant("FL11").samples, left=0, right=0)
    surfaces = {
        "gold": CookTorrance(BLACK, GOLD_N, GOLD_K, 0.3, 1.0, "ggx", "smith"),
        "red": Lambert(Spectrum.sampled(NM, RED)),
    }
    gold = {"type": "roughconductor", "distribution": "ggx", "alpha": 0.3}
    bsdfs = {"gold": gold | {"eta": spectrum(GOLD_N), "k": spectrum(GOLD_K)}, "red": {"type": "diffuse"}}
    bsdfs["red"]["reflectance"] = spectrum(RED)
    parts = (Part("body", speed_shape(5, uv=True), "gold"), Part("floor", plane(8, 8), "red"))
    assert_agrees(mi, tmp_path, record_property, parts, constant(mi, power), surfaces, bsdfs)


def clouds():
    field = 0.2 + np.random.default_rng(3).random((6, 12)) ** 2
    field[1, 4] = 40.0
    return field


def test_a_glossy_ball_under_clouds_and_a_sun(mi, tmp_path, record_property):
    surfaces = {
        "gold": CookTorrance(BLACK, GOLD_N, GOLD_K, 0.15, 1.0, "ggx", "smith"),
        "blue": Lambert(Spectrum.sampled(NM, BLUE)),
    }
    gold = {"type": "roughconductor", "distribution": "ggx", "alpha": 0.15}
    bsdfs = {"gold": gold | {"eta": spectrum(GOLD_N), "k": spectrum(GOLD_K)}, "blue": {"type": "diffuse"}}
    bsdfs["blue"]["reflectance"] = spectrum(BLUE)
    parts = (Part("ball", sphere(5, uv=True), "gold"), Part("floor", floor(), "blue"))
    assert_agrees(mi, tmp_path, record_property, parts, mapped(mi, clouds()), surfaces, bsdfs)


def test_a_map_of_two_paints_on_a_ball_with_texture_coordinates(mi, tmp_path, record_property):
    share = np.random.default_rng(4).random((8, 16)).astype(np.float32)
    texture = SpectralTexture(NM, (1.0 - share[..., None]) * RED + share[..., None] * BLUE)
    paint = {
        "type": "blendbsdf",
        # Its rows count from below.
        "weight": {
            "type": "bitmap",
            "bitmap": mi.Bitmap(np.ascontiguousarray(share[::-1, :, None])),
            "raw": True,
            "filter_type": "bilinear",
        },
        "first": {"type": "diffuse", "reflectance": spectrum(RED)},
        "second": {"type": "diffuse", "reflectance": spectrum(BLUE)},
    }
    parts = (Part("ball", sphere(5, uv=True), "map"), Part("floor", floor(), "blue"))
    surfaces = {"map": texture, "blue": Lambert(Spectrum.sampled(NM, BLUE))}
    bsdfs = {"map": paint, "blue": {"type": "diffuse", "reflectance": spectrum(BLUE)}}
    assert_agrees(mi, tmp_path, record_property, parts, mapped(mi, clouds()), surfaces, bsdfs)
