"""Reflectance fields from afar: what coarser texels show, and both renderers draw it."""

from dataclasses import replace

import numpy as np
import pytest
from btf_samples import bumps, sky
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.materials.btf.field_texels import FieldTexels
from metamer.materials.btf.form import FieldForm, palette_of
from metamer.materials.btf.lobe_field import LobeField, lobe_field
from metamer.materials.btf.metric import folding_of
from metamer.materials.btf.polynomials import polynomials
from metamer.materials.core.points import Points
from metamer.materials.svbrdf.texels import levels_of
from metamer.spectral.difference import delta_e_xyz
from metamer.viewer.software.backend import software_session

KINDS = {
    "polynomials": polynomials,
    "shared lobes": lambda images: lobe_field(images, 2),
    "lobes of each coefficient": lambda images: lobe_field(images, 1, shared=False),
}


@pytest.fixture(scope="module")
def images():
    return bumps(9, 14, views=3, lights=5)


@pytest.fixture(scope="module", params=KINDS)
def form(request, images):
    return FieldForm(FieldTexels(KINDS[request.param](images), palette_of(images.basis)))


def off(basis, truth, found):
    folding = folding_of(("D65",))
    to_xyz, white = np.pi * folding.coefficients(basis), folding.weights(basis.wavelengths_nm).sum(axis=0)
    return delta_e_xyz(truth @ to_xyz, found @ to_xyz, white)


def test_every_level_shows_the_mean(images, form):
    """Polynomials' means exactly, but for half precision; lobes' as near as as many lobes get."""
    levels = form.texels.form.levels(True)
    assert [(level.height, level.width) for level in levels] == [(9, 14), (4, 7), (2, 3), (1, 1)]
    lobes = isinstance(levels[0], LobeField)
    for pair in ((0, 0), (5, 3), (15, 40)):
        near = levels[0].reconstruct(*pair)
        means = levels_of(near)
        for mean, level in zip(means[1:], levels[1:], strict=True):
            assert off(images.basis, mean, level.reconstruct(*pair)).mean() < (3.0 if lobes else 0.2)
        # Any single texel is farther off than the mean of all.
        single = off(images.basis, np.broadcast_to(means[-1], near.shape), near).mean()
        assert off(images.basis, means[-1], levels[-1].reconstruct(*pair)).mean() < (0.3 if lobes else 0.05) * single


def test_lobes_of_one_kind_are_the_same_lobe_from_afar(images):
    """Texels that are alike: nothing is lost but what amplitudes are rounded by."""
    same = replace(images, values=np.broadcast_to(images.values[:, :, :1, :1], images.values.shape).copy())
    near, *others = lobe_field(same, 2).levels(True)
    exponents = set(np.unique(near.exponents & 15)) | set(np.unique(near.exponents >> 4))
    for far in others:
        assert set(np.unique(far.exponents & 15)) | set(np.unique(far.exponents >> 4)) <= exponents
        for pair in ((0, 0), (5, 3), (15, 40)):
            expected, found = near.reconstruct(*pair)[:1, :1], far.reconstruct(*pair)
            assert off(images.basis, np.broadcast_to(expected, found.shape), found).max() < 0.5


def looks(count):
    draw = np.random.default_rng(0)
    wi, wo = (np.abs(draw.normal(size=(count, 3))) + np.array([0.0, 0.0, 0.3]) for _ in range(2))
    wi, wo = (one / np.linalg.norm(one, axis=1, keepdims=True) for one in (wi, wo))
    return Points(wi, wo, draw.uniform(-1.0, 2.0, (count, 2)))


def spanning(points, wide):
    footprint = np.tile(np.diag([wide / 14, wide / 9]), (len(points), 1, 1))
    return replace(points, footprint=footprint, spans={})


def test_from_near_nothing_changes_and_nothing_is_worked_out(form, monkeypatch):
    def refused(self):
        raise AssertionError("coarser texels are not needed")

    monkeypatch.setattr(type(form.texels.form), "coarser", refused)
    points = looks(200)
    near, plain = (form.texels.terms(one).value for one in (spanning(points, 0.9), points))
    np.testing.assert_array_equal(near, plain)
    near, plain = (form.environment_form().lobes(one) for one in (spanning(points, 0.9), points))
    np.testing.assert_array_equal(near.matt, plain.matt)
    np.testing.assert_allclose(near.value.sum(axis=1), plain.value.sum(axis=1), rtol=1e-12)


def test_from_farther_than_the_texture_is_wide_there_is_one_colour(form):
    points = looks(50)
    moved = replace(points, uv=points.uv + 0.37)
    first, second = (form.texels.terms(spanning(one, 200.0)).value for one in (points, moved))
    np.testing.assert_allclose(first, second, rtol=1e-9)


@pytest.mark.parametrize("wide", [2.9, 5.0])
def test_nothing_jumps_where_the_texture_meets_itself(form, wide):
    points = looks(100)
    uv = np.rint(points.uv)
    one, other = (form.texels.terms(spanning(replace(points, uv=uv + shift), wide)).value for shift in (-1e-5, 1e-5))
    np.testing.assert_allclose(one, other, atol=2e-3 * np.abs(one).max())


@pytest.mark.slow_cases("polynomials-sky", "shared lobes-sky", "lobes of each coefficient-sky")
@pytest.mark.parametrize("lit", ["sun", "sky"])
def test_gl_and_numpy_agree_from_afar(scenes, drawn_by_both, form, lit):
    plane = shapes.plane(6.0, 6.0)
    plane = replace(plane, uv=6.0 * plane.uv)
    camera = Camera("c", (0.3, 2.0, 5.0), (0.0, 0.0, 0.0), vertical_fov_deg=50.0, width=24, height_px=18, samples=1)
    scene = scenes.scene_of([(plane, "cloth")], [scenes.sun()] if lit == "sun" else [sky(1)], camera)
    both = drawn_by_both(scene, {"cloth": form}, "mipmapped")
    with software_session() as bare:
        plain, _ = bare.render(scene, None, {"cloth": form})
    assert both.coverage.mean() > 0.3 and both.off.max() < 0.1
    assert delta_e_xyz(both.mine, plain.astype(float), scene.adopted_white()).mean() > 0.3, "it is filtered"
