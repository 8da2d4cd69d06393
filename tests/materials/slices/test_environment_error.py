"""The protocol of environment forms: what its sky sends, against sums over many directions."""

import numpy as np
import pytest
from metamer.materials.analytic.cook_torrance import CookTorrance
from metamer.materials.analytic.lambert import Lambert
from metamer.materials.core.protocol import LIGHTS
from metamer.materials.core.spherical_gaussian import sphere_integral
from metamer.materials.slices import error, sky
from metamer.materials.slices.fit import view_slices
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum

NM = np.linspace(400.0, 700.0, 7)
AXES = np.array([[0.0, 1.0, 0.0], [0.6, 0.0, 0.8], [0.4, -0.5, 0.768], [0.5, 0.75, 0.433]])
AXES /= np.linalg.norm(AXES, axis=1, keepdims=True)


@pytest.fixture(scope="module")
def sphere():
    """Directions (N,3) all around, and their solid angle."""
    nodes, weights = np.polynomial.legendre.leggauss(240)
    turn = 2.0 * np.pi * (np.arange(480) + 0.5) / 480
    y, angle = (grid.ravel() for grid in np.meshgrid(nodes, turn, indexing="ij"))
    flat = np.sqrt(1.0 - y * y)
    directions = np.stack([flat * np.sin(angle), y, flat * np.cos(angle)], axis=1)
    return directions, np.repeat(weights * 2.0 * np.pi / 480, 480)


@pytest.fixture(scope="module")
def luminance(sphere):
    return sky.without_sun(sphere[0]) + sky.sun().value(sphere[0])


@pytest.mark.parametrize("sharpness", [0.5, 3.0, 30.0, 400.0, 2000.0])
def test_gaussians_see_the_mean_luminance_under_them(sphere, luminance, sharpness):
    directions, angles = sphere
    for axis in AXES:
        lobe = np.exp(sharpness * (directions @ axis - 1.0)) / sphere_integral(np.array(sharpness))
        found = sky.under_lobes(axis[None], np.array([sharpness]))[0]
        assert found == pytest.approx((lobe * luminance) @ angles, rel=1e-3)


def test_matt_surfaces_see_the_illuminance_on_them(sphere, luminance):
    directions, angles = sphere
    for axis in AXES:
        truth = (np.maximum(directions @ axis, 0.0) * luminance) @ angles
        assert sky.on_normals(axis[None])[0] == pytest.approx(truth, rel=1e-3)


def test_the_sun_lights_as_much_as_the_sky():
    sun = sky.sun()
    assert float(sun.integral[0]) == pytest.approx(np.pi)


def test_the_reference_of_a_white_diffuser_is_the_illuminance_on_it():
    """All quadratures together: horizon, panel, and the sun, which rises and sets on the sphere."""
    xyz = error.references(Lambert(Spectrum.sampled(NM, np.ones(7))))
    _, frames = error._points(True)
    relative = sky.on_normals(frames[:, 2]) / sky.on_normals(np.array([[0.0, 1.0, 0.0]]))
    for light, found in zip(LIGHTS, xyz, strict=True):
        white = observer("1931_2").white(illuminant(light))
        np.testing.assert_allclose(found, relative[:, None] * white, rtol=0.004)


@pytest.mark.parametrize("alpha", [0.02, 0.15, 0.6])
def test_the_reference_does_not_hang_on_its_grids(alpha, monkeypatch):
    """Twice as many directions each way, and twice as many about the sun, change it by less than forms are off."""
    black, ramp = Spectrum.sampled(NM, np.zeros(7)), np.linspace(2.0, 3.0, 7)
    surface = CookTorrance(black, np.full(7, 0.2), ramp, alpha, 1.0, "ggx", "smith")
    monkeypatch.setattr(error, "_ISOTROPIC", (6, 12))
    error._points.cache_clear()
    error._lit_slices.cache_clear()
    found = error.references(surface)
    monkeypatch.setattr(error, "_GRIDS", error.Grids(error._GRIDS.fade, 64, (60, 120)))
    monkeypatch.setattr(error, "_SUN_GRID", (12, 24))
    error._rays.cache_clear()
    finer = error.references(surface)
    between = error.error_between(finer, found, True)
    for cached in (error._points, error._rays, error._lit_slices):
        cached.cache_clear()
    assert between.mean < 0.05 and between.p99 < 0.25


def test_the_light_on_a_sphere_is_worked_out_once_for_all_surfaces(monkeypatch):
    """What a second surface is held against is the same to the bit, and costs no look at the sky."""
    grey, ramp = (Lambert(Spectrum.sampled(NM, values)) for values in (np.full(7, 0.3), np.linspace(0.1, 0.7, 7)))
    error._lit_slices.cache_clear()
    alone = error.references(ramp)
    error._lit_slices.cache_clear()
    error.references(grey)
    monkeypatch.setattr(error.sky, "without_sun", None)
    np.testing.assert_array_equal(error.references(ramp), alone)


def test_the_error_names_every_light_and_the_worst():
    black, ramp = Spectrum.sampled(NM, np.zeros(7)), np.linspace(2.0, 3.0, 7)
    surface = CookTorrance(black, np.full(7, 0.2), ramp, 0.3, 1.0, "ggx", "smith")
    found = error.measured_form(view_slices(surface, 4), surface).error
    assert found is not None and [one.light for one in found.lights] == list(LIGHTS)
    assert found.p99 == max(one.p99 for one in found.lights)
    assert found.mean <= found.p95 <= found.p99 <= found.maximum
    assert found.protocol == error.text_of(True)
