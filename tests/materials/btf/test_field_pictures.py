"""Reflectance fields in pictures: both renderers draw the same, and what a field says."""

import numpy as np
import pytest
from btf_samples import bumps, sky
from metamer.lighting.camera import Camera
from metamer.lighting.environment import latlong
from metamer.lighting.mesh import shapes
from metamer.materials.btf.field_form import FieldForm
from metamer.materials.btf.field_texels import FieldTexels
from metamer.materials.btf.form import palette_of
from metamer.materials.btf.metric import folding_of
from metamer.materials.btf.polynomials import polynomials
from metamer.materials.core.environment_form import bends
from metamer.materials.core.points import Points
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.difference import delta_e_xyz
from metamer.viewer.gl.backend import gl_session
from metamer.viewer.software.backend import software_session

CAMERA = Camera("c", (0.5, 1.5, 3.0), (0.0, 0.0, 0.0), vertical_fov_deg=44.0, width=24, height_px=24, samples=1)


def form_of(images):
    return FieldForm(FieldTexels(polynomials(images), palette_of(images.basis)))


def bands(count):
    spectra = np.exp(-0.5 * ((np.linspace(0.0, 1.0, 81)[:, None] - np.linspace(0.1, 0.9, count)) * 5.0) ** 2)
    return SpectralBasis("bands", np.linspace(380, 780, 81), np.linalg.pinv(spectra).T, spectra)


@pytest.fixture(scope="module", params=["rgb", "six coefficients"])
def form(request):
    return form_of(bumps() if request.param == "rgb" else bumps(7, 5, basis=bands(6)))


def pictures_of(gl, scene, form):
    with gl_session(gl) as hardware, software_session() as software:
        (theirs, covered), (mine, _) = (one.render(scene, None, {"cloth": form}) for one in (hardware, software))
    assert covered.max() == 1.0 and mine[..., 1].std() > 0.01, "a texture is to be seen"
    return mine.astype(float), theirs.astype(float)


def test_gl_and_numpy_agree_on_every_pixel(scenes, form, gl):
    scene = scenes.scene_of([(shapes.sphere(3, uv=True), "cloth")], [scenes.sun(), scenes.lamp()], CAMERA)
    mine, theirs = pictures_of(gl, scene, form)
    assert delta_e_xyz(mine, theirs, scene.adopted_white()).max() < 0.01


@pytest.mark.slow
def test_gl_and_numpy_agree_under_a_sky(scenes, form, gl):
    scene = scenes.scene_of([(shapes.sphere(3, uv=True), "cloth")], [sky(2)], CAMERA)
    mine, theirs = pictures_of(gl, scene, form)
    assert delta_e_xyz(mine, theirs, scene.adopted_white()).max() < 0.01


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
    truth = np.empty((40, form.rank))
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
    assert off.mean() < 0.02 and off.max() < 0.1
