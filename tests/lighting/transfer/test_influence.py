"""Light that parts put on each other, and what they receive straight away."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.lights import DirectionalLight, PointLight
from metamer.lighting.mesh.shapes import plane, sphere
from metamer.lighting.transfer.diffuse_albedo import even_albedo
from metamer.lighting.transfer.direct import direct_illuminance
from metamer.lighting.transfer.edge_refinement import placed
from metamer.lighting.transfer.influence import influence
from metamer.lighting.visibility.occluders import Occluders
from metamer.lighting.visibility.refinement import refined
from metamer.lighting.visibility.sites import scaled_triangles
from metamer.materials.analytic import CookTorrance, Lambert
from metamer.spectral.illuminants import illuminant
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM as NM
from metamer.spectral.spectrum import Spectrum

D65 = illuminant("D65")
RED = Lambert(Spectrum.sampled(NM, np.interp(NM, [380, 560, 620, 780], [0.05, 0.08, 0.7, 0.75])))
WHITE = Lambert(Spectrum.sampled(NM, np.full(81, 0.8)))
BLACK = Lambert(Spectrum.sampled(NM, np.zeros(81)))


def worn(scene, *materials, lights=None):
    parts = tuple(replace(part, material=name) for part, name in zip(scene.parts, materials, strict=True))
    return replace(scene, parts=parts, lights=scene.lights if lights is None else lights)


def received(scene, **more):
    hits = placed(scene).traced(16)
    occluders = Occluders(scaled_triangles(refined(scene)[0]).astype(np.float32))
    return hits, direct_illuminance(scene, hits.sites, occluders, **more)


def test_lamps_are_exact_and_throw_shadows(scene_of):
    floor, above = plane(4, 4), plane(1, 1)
    above = replace(above, vertices=above.vertices + np.array([0.0, 0.5, 0.0]))
    lights = (DirectionalLight((0.0, 2.0, 0.0), D65, 700.0), PointLight((1.0, 3.0, 0.0), D65, 900.0))
    scene = replace(scene_of(floor, above), lights=lights)
    hits, (sun, lamp) = received(scene)
    fine = refined(scene)[0].parts[0].mesh.vertices
    front = hits.sites.fronts[: len(fine)]
    below = (np.abs(fine[:, [0, 2]]) < 0.45).all(axis=1)
    assert below.any()
    assert not sun[front][below].any()
    open_ = np.abs(fine[:, [0, 2]]).max(axis=1) > 1.5
    np.testing.assert_allclose(sun[front][open_], 700.0, rtol=1e-4)
    away = fine[open_] - np.array([1.0, 3.0, 0.0])
    expected = 900.0 * 3.0 / np.linalg.norm(away, axis=1) ** 3
    shaded = lamp[front][open_][:, 0] == 0.0
    assert shaded.mean() < 0.2
    np.testing.assert_allclose(lamp[front][open_][~shaded, 0], expected[~shaded], rtol=5e-3)  # the rim starts inwards


def test_even_light_arrives_whole_in_the_open(scene_of, squares):
    lower, _ = squares()
    light = EnvironmentLight(np.ones((1, 2, 4)), (D65,), 1000.0)
    scene = replace(scene_of(lower), lights=(light,))
    hits, (lux,) = received(scene)
    np.testing.assert_allclose(lux[hits.sites.fronts], 1000.0, rtol=0.04)
    assert abs(lux[hits.sites.fronts].mean() - 1000.0) < 3.0


def test_what_is_reflected_of_even_light():
    np.testing.assert_allclose(even_albedo(RED), RED.reflectance.samples, rtol=1e-9)
    black = Spectrum.sampled(NM, np.zeros(81))
    gloss = CookTorrance(black, np.full(81, 1.5), np.zeros(81), 0.3, 1.0, "ggx", "smith")
    # A smooth surface of n = 1.5 reflects 0.092 of even light; what a rough one scatters twice is lost.
    assert 0.05 < even_albedo(gloss).mean() < 0.092


@pytest.mark.slow_cases("0.1", "0.3")
@pytest.mark.parametrize("alpha", [0.05, 0.1, 0.3, 0.6])
def test_what_metals_reflect_of_even_light(alpha):
    """Beside a sum over half vectors, as dense as GGX has facets, for viewers by the Gauss-Legendre rule."""
    black = Spectrum.sampled(NM, np.zeros(81))
    metal = CookTorrance(black, np.full(81, 0.2), np.full(81, 3.0), alpha, 1.0, "ggx", "smith")
    nodes, weights = np.polynomial.legendre.leggauss(16)
    u, phi = np.meshgrid((np.arange(400) + 0.5) / 400, (np.arange(60) + 0.5) * np.pi / 30)
    slope = alpha * np.sqrt(u / (1.0 - u)).ravel()
    cosine = 1.0 / np.sqrt(1.0 + slope**2)
    h = np.stack([slope * cosine * np.cos(phi.ravel()), slope * cosine * np.sin(phi.ravel()), cosine], axis=1)
    density = alpha**2 / (np.pi * cosine**3 * (alpha**2 + slope**2) ** 2)
    seen = []
    for square in 0.5 + 0.5 * nodes:
        wo = np.array([np.sqrt(1.0 - square), 0.0, np.sqrt(square)])
        along = h @ wo
        wi = 2.0 * along[:, None] * h - wo
        some = (along > 0.0) & (wi[:, 2] > 0.0)
        f_r = metal.eval(wi[some], np.broadcast_to(wo, wi[some].shape))[:, 0]
        seen.append((f_r * wi[some, 2] * 4.0 * along[some] / density[some]).sum() / len(h))
    np.testing.assert_allclose(even_albedo(metal).mean(), 0.5 * weights @ seen, rtol=0.01)


def test_a_convex_body_needs_no_bounce(scene_of):
    found = influence(worn(scene_of(sphere(2)), "red"), {"red": RED}, 32)
    assert found.bounces == 0
    assert found.all[0].maximum == 0.0


@pytest.fixture(scope="module")
def facing(scene_of, squares):
    """A square below another, lit from below and from above at a slant."""
    lights = (DirectionalLight((0.9, 0.4, 0.0), D65, 1000.0), DirectionalLight((0.9, -0.4, 0.0), D65, 1000.0))
    return replace(scene_of(*squares(0.5)), lights=lights)


def test_red_is_put_on_white_and_by_the_part_that_is_red(facing):
    found = influence(worn(facing, "red", "white"), {"red": RED, "white": WHITE}, 64)
    assert found.bounces >= 2
    assert found.of[1][0].mean > 2.0
    assert found.of[1][0].mean > 3.0 * found.of[1][1].mean
    assert found.all[1].maximum >= found.all[1].p95 >= found.all[1].mean > 2.0
    assert found.albedo_y[0] < found.albedo_y[1] == pytest.approx(0.8, abs=1e-3)


def test_black_puts_nothing_on_anything(facing):
    found = influence(worn(facing, "black", "white"), {"black": BLACK, "white": WHITE}, 64)
    assert found.of[1][0].maximum == 0.0
    assert found.of[0][1].maximum == 0.0  # and nothing shows on it


@pytest.mark.slow
def test_many_parts(scene_of):
    ball = sphere(1, 0.1)
    meshes = [
        replace(ball, vertices=ball.vertices + np.array([0.25 * (n % 6), 0.1, 0.25 * (n // 6)])) for n in range(30)
    ]
    scene = worn(scene_of(*meshes), *["red", "white"] * 15)
    found = influence(scene, {"red": RED, "white": WHITE}, 16)
    assert len(found.of) == len(found.of[0]) == 30
    assert np.isfinite([one.mean for row in found.of for one in row]).all()
