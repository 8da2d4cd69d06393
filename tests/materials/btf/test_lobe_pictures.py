"""Lobe fields in pictures: both renderers draw the same, at what was measured and between."""

from functools import cache

import numpy as np
import pytest
from btf_samples import bumps
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.materials.btf.field_texels import FieldTexels
from metamer.materials.btf.form import FieldForm, palette_of
from metamer.materials.btf.lobe_field import lobe_field
from metamer.materials.core.points import Points
from metamer.runtime.errors import InputError

IMAGES = bumps(height=5, width=6, views=4, lights=4)
KINDS = [(1, True), (2, True), (4, True), (2, False)]


@cache
def formed(lobes, shared):
    """Fitted once for all tests."""
    return FieldForm(FieldTexels(lobe_field(IMAGES, lobes, shared), palette_of(IMAGES.basis)))


@pytest.fixture(scope="module")
def form():
    return formed(2, True)


def middles():
    """uv of every texel's middle, in the order of rows."""
    row, column = np.mgrid[: IMAGES.height, : IMAGES.width]
    return np.stack([(column + 0.5) / IMAGES.width, 1.0 - (row + 0.5) / IMAGES.height], axis=2).reshape(-1, 2)


@pytest.mark.slow_cases("1-True", "4-True", "2-False")
@pytest.mark.parametrize(("lobes", "shared"), KINDS)
def test_at_measured_directions_it_is_the_field(lobes, shared):
    texels, uv = formed(lobes, shared).texels, middles()
    for view, light in ((0, 0), (9, 30), (36, 3)):
        to = (IMAGES.lights.directions[light], IMAGES.views.directions[view])
        wi, wo = (np.broadcast_to(one, (len(uv), 3)) for one in to)
        found = texels.terms(Points(wi, wo, uv)).value
        np.testing.assert_allclose(found, texels.form.reconstruct(view, light).reshape(-1, 3), rtol=1e-4, atol=1e-5)


def test_light_lower_than_any_measured_falls_with_its_cosine(form):
    uv, azimuth = middles(), 0.7
    wo = np.broadcast_to(IMAGES.views.directions[5], (len(uv), 3))

    def lit(theta):
        wi = np.array([np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)])
        return form.texels.terms(Points(np.broadcast_to(wi, wo.shape), wo, uv)).value

    lowest = np.arccos(IMAGES.lights.lowest)
    held, low = lit(lowest), lit(np.radians(89.0))
    np.testing.assert_allclose(low, held * np.cos(np.radians(89.0)) / np.cos(lowest), rtol=1e-6)
    np.testing.assert_allclose(lit(lowest - 1e-6), held, rtol=1e-3, atol=1e-7)


def test_between_views_it_is_linear(form):
    views, uv = IMAGES.views, middles()
    wo = views.directions[[1, 2]].sum(axis=0)
    wo = np.broadcast_to(wo / np.linalg.norm(wo), (len(uv), 3))
    wi = np.broadcast_to(IMAGES.lights.directions[20], wo.shape)
    index, share = views.shares(wo[:1])
    mixed = sum(
        part * form.texels.form.reconstruct(int(number), 20) for number, part in zip(index[0], share[0], strict=True)
    )
    found = form.texels.terms(Points(wi, wo, uv)).value
    np.testing.assert_allclose(found, mixed.reshape(-1, 3), rtol=1e-4, atol=1e-5)


def draped(scenes):
    ball, ground = shapes.sphere(3, uv=True), shapes.plane(6.0, 6.0)
    parts = [(ball.placed(translate=(-0.4, 0.9, 0.0)), "cloth"), (ground, "cloth")]
    camera = Camera("c", (0.5, 3.5, 6.0), (0.0, 0.5, 0.0), vertical_fov_deg=36.0, width=40, height_px=30, samples=1)
    return scenes.scene_of(parts, [scenes.sun(), scenes.lamp()], camera)


@pytest.mark.slow_cases("1-True", "4-True", "2-False")
@pytest.mark.parametrize(("lobes", "shared"), KINDS)
def test_gl_and_numpy_agree_on_every_pixel(scenes, drawn_by_both, lobes, shared):
    both = drawn_by_both(draped(scenes), {"cloth": formed(lobes, shared)})
    assert both.off.max() < 0.1
    assert np.percentile(both.relative, 99.9) < 2e-3
    assert both.mine[both.coverage == 1.0].std() > 0.02, "a texture is to be seen"


def test_what_is_stored_draws_the_same(form):
    again = FieldForm.from_stored(form.stored(), None)
    draw = np.random.default_rng(0)
    wi, wo = np.abs(draw.normal(size=(2, 20, 3)))
    points = Points(
        wi / np.linalg.norm(wi, axis=1, keepdims=True),
        wo / np.linalg.norm(wo, axis=1, keepdims=True),
        draw.uniform(size=(20, 2)),
    )
    np.testing.assert_allclose(again.at(points), form.at(points), rtol=1e-12)


def test_a_palette_that_does_not_fit_is_refused(form):
    basis = IMAGES.basis.truncated(2)
    with pytest.raises(InputError, match="palette that does not fit"):
        FieldTexels(form.texels.form, palette_of(basis))
