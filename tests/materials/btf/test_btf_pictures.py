"""BTFs in pictures: both renderers draw the same, and what the images show."""

from dataclasses import replace

import numpy as np
import pytest
from btf_samples import bumps, sky
from metamer.lighting.camera import Camera
from metamer.lighting.environment import latlong
from metamer.lighting.mesh import shapes
from metamer.materials.btf.form import btf_form
from metamer.materials.btf.light_basis import light_functions
from metamer.materials.btf.local_pca import Size
from metamer.materials.btf.metric import folding_of
from metamer.materials.core.environment_form import bends
from metamer.materials.core.points import Points
from metamer.spectral.difference import delta_e_xyz
from metamer.viewer.gl.backend import gl_session
from metamer.viewer.software.backend import software_session


@pytest.fixture(scope="module")
def form():
    return btf_form(bumps(), Size(64, 4, 16, 0.1, 0.2))


def draped(scenes, repeats=2.5):
    ball, ground = shapes.sphere(3, uv=True), shapes.plane(6.0, 6.0)
    ground = replace(ground, uv=repeats * ground.uv)
    parts = [(ball.placed(translate=(-0.4, 0.9, 0.0)), "cloth"), (ground, "cloth")]
    camera = Camera("c", (0.5, 3.5, 6.0), (0.0, 0.5, 0.0), vertical_fov_deg=36.0, width=48, height_px=36, samples=2)
    return scenes.scene_of(parts, [scenes.sun(), scenes.lamp()], camera)


def test_gl_and_numpy_agree_on_every_pixel(scenes, form, gl):
    scene, surfaces = draped(scenes), {"cloth": form}
    with gl_session(gl) as hardware, software_session() as software:
        (theirs, covered), (mine, coverage) = (one.render(scene, None, surfaces) for one in (hardware, software))
    np.testing.assert_array_equal(covered, coverage)
    off = delta_e_xyz(mine.astype(float), theirs.astype(float), scene.adopted_white())
    assert off.max() < 0.1
    lit = mine[..., 1] > 1e-3
    assert np.percentile(np.abs(theirs[lit] / mine[lit] - 1.0), 99.9) < 1e-3
    assert mine[coverage == 1.0].std() > 0.02, "a texture is to be seen"


@pytest.mark.slow
def test_gl_and_numpy_agree_under_a_sky(scenes, form, gl):
    camera = Camera("c", (0.5, 1.5, 3.0), (0.0, 0.0, 0.0), vertical_fov_deg=44.0, width=20, height_px=20, samples=1)
    scene = scenes.scene_of([(shapes.sphere(3, uv=True), "cloth")], [sky(2)], camera)
    with gl_session(gl) as hardware, software_session() as software:
        (theirs, covered), (mine, _) = (one.render(scene, None, {"cloth": form}) for one in (hardware, software))
    off = delta_e_xyz(mine.astype(float), theirs.astype(float), scene.adopted_white())
    assert off.max() < 0.1 and covered.max() == 1.0
    lit = mine[..., 1] > 1e-3
    assert np.percentile(np.abs(theirs[lit] / mine[lit] - 1.0), 99.9) < 1e-3


def test_many_samples_of_many_components_are_all_counted(scenes, form, gl):
    """A driver in software ends a shader after 65,535 rounds of its loops: pictures were too dark, without a word."""
    camera = Camera("c", (0.5, 1.5, 3.0), (0.0, 0.0, 0.0), vertical_fov_deg=10.0, width=1, height_px=1, samples=16)
    scene = scenes.scene_of([(shapes.sphere(3, uv=True), "cloth")], [sky(2)], camera)
    with gl_session(gl) as hardware, software_session() as software:
        (theirs, _), (mine, _) = (one.render(scene, None, {"cloth": form}) for one in (hardware, software))
    assert mine.min() > 1e-3
    np.testing.assert_allclose(theirs, mine, rtol=1e-3)


def test_what_is_gathered_is_the_sum_over_the_sky(form):
    """Beside f_r cos times light, summed up over every texel of the sky."""
    light, draw = sky(1), np.random.default_rng(1)
    wo = np.abs(draw.normal(size=(40, 3))) + np.array([0.0, 0.0, 0.4])
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    uv = draw.uniform(size=(40, 2))
    height, width = light.fields.shape[1:]
    to, angles = latlong.texel_directions(height, width).reshape(-1, 3), latlong.solid_angles(height, width)
    # The sky's y is the surface's normal.
    local = np.stack([to[:, 0], -to[:, 2], to[:, 1]], axis=1)
    luminance = light.fields[0].ravel() * np.repeat(angles, width)
    truth = np.empty((40, 3))
    for number in range(40):
        points = Points(local, np.broadcast_to(wo[number], local.shape), np.broadcast_to(uv[number], (len(local), 2)))
        truth[number] = luminance @ form.texels.terms(points).value
    lobes = form.environment_form().lobes(Points(wo, wo, uv))
    sharp = lobes.sharpness[0, 0]
    gaussians = np.exp(sharp * (local @ lobes.directions[0].T - 1.0)) * sharp / (2 * np.pi * -np.expm1(-2 * sharp))
    moments = bends(local) * np.maximum(local[:, 2:], 0.0)
    found = np.einsum("q,nqj->nj", luminance @ gaussians, lobes.value)
    found += np.einsum("b,nbj->nj", luminance @ moments / np.pi, lobes.matt)
    basis = form.texels.form.basis
    to_xyz = folding_of(("D65",)).coefficients(basis) / truth.mean() * 0.2
    off = delta_e_xyz(truth @ to_xyz, found @ to_xyz, folding_of(("D65",)).weights(basis.wavelengths_nm).sum(axis=0))
    assert off.mean() < 0.5 and off.max() < 2.5


def test_hats_are_what_lights_stand_for(form):
    functions = light_functions(form.texels.form.lights)
    even = np.concatenate([np.ones(len(functions.axes)), [np.pi, 0, 0, 2 * np.pi / 3, 0, 0, 0, 0, np.pi / 2]])
    np.testing.assert_allclose(functions.hats @ even, form.texels.form.lights.solid_angles, atol=0.02)
