"""Reflectance fields in pictures: both renderers draw the same, and what a field says."""

import numpy as np
import pytest
from btf_samples import bumps, gathering_error, sky
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.materials.btf.field_texels import FieldTexels
from metamer.materials.btf.form import FieldForm, palette_of
from metamer.materials.btf.polynomials import polynomials
from metamer.spectral.basis import SpectralBasis

CAMERA = Camera("c", (0.5, 1.5, 3.0), (0.0, 0.0, 0.0), vertical_fov_deg=44.0, width=24, height_px=24, samples=1)


def form_of(images):
    return FieldForm(FieldTexels(polynomials(images), palette_of(images.basis)))


def bands(count):
    spectra = np.exp(-0.5 * ((np.linspace(0.0, 1.0, 81)[:, None] - np.linspace(0.1, 0.9, count)) * 5.0) ** 2)
    return SpectralBasis("bands", np.linspace(380, 780, 81), np.linalg.pinv(spectra).T, spectra)


@pytest.fixture(scope="module", params=["rgb", "six coefficients"])
def form(request):
    return form_of(bumps() if request.param == "rgb" else bumps(7, 5, basis=bands(6)))


def check_agreement(drawn_by_both, scene, form):
    both = drawn_by_both(scene, {"cloth": form})
    assert both.coverage.max() == 1.0 and both.mine[..., 1].std() > 0.01, "a texture is to be seen"
    assert both.off.max() < 0.01


def test_gl_and_numpy_agree_on_every_pixel(scenes, form, drawn_by_both):
    lights = [scenes.sun(), scenes.lamp()]
    check_agreement(drawn_by_both, scenes.scene_of([(shapes.sphere(3, uv=True), "cloth")], lights, CAMERA), form)


@pytest.mark.slow
def test_gl_and_numpy_agree_under_a_sky(scenes, form, drawn_by_both):
    check_agreement(drawn_by_both, scenes.scene_of([(shapes.sphere(3, uv=True), "cloth")], [sky(2)], CAMERA), form)


def test_what_is_gathered_is_the_sum_over_the_sky(form):
    off = gathering_error(form, 40)
    assert off.mean() < 0.02 and off.max() < 0.1
