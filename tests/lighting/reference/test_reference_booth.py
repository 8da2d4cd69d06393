"""The reference in a light booth, where light alone draws for even surfaces: unbiased, and honest about its noise."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.environment import latlong
from metamer.lighting.environment.booth import light_booth
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.mesh.shapes import plane, sphere
from metamer.lighting.reference.direction_sampling import is_even
from metamer.lighting.reference.geometry import Tracer, visible_geometry
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.reference.spread import _nothing_hides
from metamer.lighting.scene import Part, Scene, Viewing
from metamer.materials.analytic import AshikhminShirley, CookTorrance, Lambert, OrenNayar
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.core.points import Points
from metamer.spectral.bispectral import Bispectral
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.folding import Folding
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

OBSERVER = observer("1931_2")
RAMP, COAT = (Spectrum.sampled(NM, values) for values in (np.linspace(0.1, 0.7, 81), np.full(81, 0.04)))
LIGHTS = tuple(illuminant(name) for name in ("D65", "A", "FL11"))
SURFACES = {
    "matt": OrenNayar(RAMP, 0.35),
    "ramp": Lambert(RAMP),
    "gloss": AshikhminShirley(RAMP, COAT, 200.0, 200.0),
    "brushed": AshikhminShirley(RAMP, COAT, 10.0, 200.0),
    "metal": CookTorrance(RAMP, np.linspace(0.2, 1.4, 81), np.full(81, 3.0), 0.2, 1.0, "ggx", "smith"),
    "dye": FluorescentLambert(Bispectral(NM, NM, np.diag(np.full(81, 0.2)) + np.tri(81, 81, -1) * 0.006)),
}


def scene_of(material, size=6, floor=False, samples=2):
    parts = [Part("ball", sphere(4), material)]
    if floor:
        parts.append(Part("floor", plane(6, 6).transformed(_down()), "ramp"))
    camera = Camera(
        projection="orthographic", position=(0, 0.8, 4), target=(0, 0, 0), height=2.2, width=size, height_px=size,
        samples=samples,
    )  # fmt: skip
    return Scene(tuple(parts), (light_booth("D65"),), (camera,), OBSERVER, Viewing(reference_illuminance_lux=1000.0))


def _down():
    matrix = np.eye(4)
    matrix[1, 3] = -1.0
    return matrix


def summed(scene, which):
    """XYZ under D65 at some pixels by a sum over all texels of the booth's map, each cut in four."""
    geometry, tracer, light = visible_geometry(scene), Tracer(scene), scene.spread_lights[0]
    height, width = (2 * size for size in light.fields.shape[1:])
    rows, columns = np.divmod(np.arange(height * width), width)
    towards = latlong.directions((rows + 0.5) / height, (columns + 0.5) / width) @ light.world_from_map.T
    weight = light.luminance(towards, towards)[:, 0] * np.repeat(latlong.solid_angles(height, width), width)
    towards, weight = towards[weight > 0], weight[weight > 0]
    folding, total = Folding(scene.observer, light.spectra), np.zeros((len(which), 3))
    for number, pixel in enumerate(which):
        for sample in np.flatnonzero(geometry.pixel == pixel):
            wi = towards @ geometry.frame[sample].T
            up = np.flatnonzero((wi[:, 2] > 0) & (towards @ geometry.geometric[sample] > 0))
            some = np.broadcast_to(geometry.position[sample], (len(up), 3))
            start = tracer.lifted(some, np.broadcast_to(geometry.geometric[sample], (len(up), 3)))
            up = up[tracer.free(start, towards[up], np.full(len(up), np.inf))]
            wo = np.broadcast_to(geometry.wo[sample], (len(up), 3))
            surface = SURFACES[scene.parts[geometry.part[sample]].material]
            total[number] += (wi[up, 2] * weight[up]) @ surface.xyz(Points(wi[up], wo), folding)
    return total * np.pi / scene.viewing.reference_illuminance_lux / geometry.samples


@pytest.mark.slow_cases("metal", "ramp", "gloss", "brushed")
@pytest.mark.parametrize("material", SURFACES)
def test_a_booth_is_the_sum_over_all_its_texels(material):
    scene = scene_of(material)
    pictures = reference_images(scene, None, SURFACES)
    assert not pictures.noise.limited
    which = np.flatnonzero(pictures.coverage.ravel() == 1)[::3]
    off = delta_e_xyz(summed(scene, which), pictures.xyz[0].reshape(-1, 3)[which], scene.adopted_white())
    assert off.mean() < 2.0 * pictures.noise.aimed


def test_a_booth_is_even_and_a_sun_a_dark_side_or_a_coarse_map_is_not():
    even = np.ones((128, 256))
    sun, dark = even.copy(), even.copy()
    sun[30, 40] = 1000.0
    dark[64:] = 1e-3
    assert is_even(light_booth("D65"))
    assert is_even(EnvironmentLight(even[None], LIGHTS[:1]))
    for fields in (sun, dark, even[::8, ::8]):
        assert not is_even(EnvironmentLight(fields[None], LIGHTS[:1]))
    assert not is_even(EnvironmentLight(np.zeros((1, 128, 256)), LIGHTS[:1], None))


def test_with_a_floor_that_hides_some_of_it_it_is_too():
    scene = scene_of("gloss", floor=True)
    pictures = reference_images(scene, None, SURFACES, budget=2.0)
    assert not _nothing_hides(scene, visible_geometry(scene))
    which = np.flatnonzero(pictures.coverage.ravel() == 1)[::5]
    off = delta_e_xyz(summed(scene, which), pictures.xyz[0].reshape(-1, 3)[which], scene.adopted_white())
    assert off.mean() < 2.0 * pictures.noise.aimed


def test_a_ball_alone_needs_no_rays_and_its_picture_is_that_of_rays(monkeypatch):
    scene = scene_of("metal", size=10)
    geometry = visible_geometry(scene)
    assert _nothing_hides(scene, geometry)
    without = reference_images(scene, None, SURFACES, budget=5.0, geometry=geometry)
    monkeypatch.setattr("metamer.lighting.reference.spread._nothing_hides", lambda *_: False)
    traced = reference_images(scene, None, SURFACES, budget=5.0, geometry=geometry)
    np.testing.assert_allclose(without.xyz, traced.xyz, rtol=1e-6, atol=1e-9)


def test_from_inside_a_ball_rays_are_traced():
    camera = Camera(position=(0, 0, 0.2), target=(0, 0, -1), width=6, height_px=6, samples=1)
    scene = replace(scene_of("ramp"), cameras=(camera,))
    assert not _nothing_hides(scene, visible_geometry(scene))
    assert (reference_images(scene, None, SURFACES, most_directions=32).xyz == 0).all()


@pytest.mark.slow_cases("metal-8.0", "gloss-6.0")
@pytest.mark.parametrize(("material", "budget"), [("matt", 4.0), ("gloss", 6.0), ("metal", 8.0)])
def test_the_noise_that_is_stated_in_a_booth_is_the_noise_that_is_there(material, budget):
    scene = scene_of(material, size=36)
    truth = reference_images(scene, None, SURFACES, LIGHTS, budget=budget / 8)
    judged, white = truth.coverage == 1, scene.with_illuminant(LIGHTS[0]).adopted_white()
    found = [reference_images(scene, None, SURFACES, LIGHTS, budget=budget, seed=seed) for seed in range(1, 6)]
    assert all(max(one.noise.mean) <= one.noise.aimed and not one.noise.limited for one in found)
    off = np.concatenate([delta_e_xyz(truth.xyz[0], one.xyz[0], white)[judged] for one in found])
    stated = np.hypot(np.mean([one.noise.mean[0] for one in found]), truth.noise.mean[0])
    assert 0.8 < off.mean() / stated < 1.25
    assert 0.6 < np.percentile(off, 99) / np.mean([one.noise.p99[0] for one in found]) < 1.7


def test_some_squares_of_a_picture_get_more_directions_and_seeds_still_say_all():
    scene = scene_of("gloss", size=48)
    first, again = (reference_images(scene, None, SURFACES, budget=6.0) for _ in range(2))
    np.testing.assert_array_equal(first.xyz, again.xyz)
    assert first.noise == again.noise
    other = reference_images(scene, None, SURFACES, budget=6.0, seed=3)
    assert (other.xyz != first.xyz).any()
