"""Lobe fields in light from all around: a lobe is a Gaussian and a bent cosine, and both renderers draw that."""

from functools import cache

import numpy as np
import pytest
from btf_samples import bumps, gathering_error, sky
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.materials.btf.field_texels import FieldTexels
from metamer.materials.btf.form import FieldForm, palette_of
from metamer.materials.btf.light_basis import spread
from metamer.materials.btf.lobe_field import lobe_field
from metamer.materials.btf.prefiltered import nearest_angle, prefiltered
from metamer.materials.btf.quantisation import EXPONENTS
from metamer.materials.core.environment_form import bends
from metamer.materials.core.points import Points

IMAGES = bumps(height=5, width=6, views=3)
LOWEST = round(float(np.cos(np.radians(75.0))), 6)


@cache
def formed(lobes, shared=True):
    """Fitted once for all tests."""
    return FieldForm(FieldTexels(lobe_field(IMAGES, lobes, shared), palette_of(IMAGES.basis)))


@pytest.fixture(scope="module")
def form():
    return formed(2)


def gaussian(directions, axis, sharpness):
    norm = sharpness / (2 * np.pi * -np.expm1(-2 * sharpness))
    return norm * np.exp(sharpness * (directions @ axis - 1.0))


@pytest.mark.parametrize("index", [1, 2, 6, 10, 14])
def test_a_lobe_is_a_gaussian_and_a_bent_cosine(index):
    """Over the whole sphere, below the horizon too; about axes of any azimuth."""
    to, table = spread(8000, -1.0), prefiltered(LOWEST)
    level = np.linalg.norm(to[:, :2], axis=1)
    low = to[:, 2] < LOWEST
    lit = np.stack([*(to[:, :2] / level[:, None] * np.sqrt(1 - LOWEST**2)).T, np.full(len(to), LOWEST)], axis=1)
    lit = np.where(low[:, None], lit, to)
    falling = np.where(low, np.maximum(to[:, 2], 0.0) / LOWEST, 1.0)
    for degrees, most in ((0, 0.06), (30, 0.10), (55, 0.15), (80, 0.25)):
        theta, phi = np.radians(degrees), 1.0 + degrees
        axis = np.array([[np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]])
        at = np.array([index]), nearest_angle(axis)
        (about,), (matt,) = table.axes(*at, axis), table.matt(*at, axis)
        truth = np.maximum(lit @ axis[0], 0.0) ** EXPONENTS[index] * falling
        found = table.value[at][0] * gaussian(to, about, table.sharpness[at][0])
        found = found + (bends(to) * np.maximum(to[:, 2:], 0.0)) @ matt
        assert np.sqrt(np.mean((found - truth) ** 2) / np.mean(truth**2)) < most, degrees
        assert found.mean() / truth.mean() == pytest.approx(1.0, abs=0.06), degrees
        np.testing.assert_allclose(np.linalg.norm(about), 1.0, rtol=1e-12)


def test_a_cosine_about_the_normal_is_the_cosine():
    """n = 1: no Gaussian, and next to no polynomial, where light is measured down to the horizon."""
    table = prefiltered(1e-3)
    np.testing.assert_allclose(table.bent[2, 0], [1, 0, 0, 0, 0, 0], atol=0.01)
    np.testing.assert_allclose(table.value[2, 0], 0.0, atol=0.02)


@pytest.mark.parametrize(("lobes", "shared"), [(2, True), (2, False)])
def test_what_is_gathered_is_the_sum_over_the_sky(lobes, shared):
    off = gathering_error(formed(lobes, shared), 6)
    assert off.mean() < 0.5 and off.max() < 1.5


@pytest.mark.slow
@pytest.mark.parametrize(("lobes", "shared"), [(1, True), (2, True), (2, False)])
def test_gl_and_numpy_agree_under_a_sky(scenes, drawn_by_both, lobes, shared):
    camera = Camera("c", (0.5, 1.5, 3.0), (0.0, 0.0, 0.0), vertical_fov_deg=44.0, width=9, height_px=9, samples=1)
    scene = scenes.scene_of([(shapes.sphere(2, uv=True), "cloth")], [sky(2)], camera)
    both = drawn_by_both(scene, {"cloth": formed(lobes, shared)})
    assert both.off.max() < 0.1 and both.coverage.max() == 1.0
    assert np.percentile(both.relative, 99.9) < 2e-3


def test_another_spectrum_costs_no_look_up(form):
    """Gaussians and cosines are of coefficients: spectra stand in the palette alone."""
    points = Points(*(np.array([[0.0, 0.0, 1.0]]),) * 2, np.array([[0.3, 0.4]]))
    other = form.in_basis(IMAGES.basis)
    first, second = (one.environment_form().lobes(points) for one in (form, other))
    np.testing.assert_array_equal(first.value, second.value)
    assert form.environment_form().key == other.environment_form().key
