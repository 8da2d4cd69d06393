"""BTFs in pictures: both renderers draw the same, and what the images show."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from btf_samples import bumps, gathering_error, sky
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.materials.btf import texels
from metamer.materials.btf.form import btf_form
from metamer.materials.btf.light_basis import light_functions
from metamer.materials.btf.local_pca import Size
from metamer.materials.core.fast import MOST_TEXELS


@pytest.fixture(scope="module")
def form():
    return btf_form(bumps(), Size(64, 4, 16, 0.1, 0.2))


def draped(scenes, repeats=2.5):
    ball, ground = shapes.sphere(3, uv=True), shapes.plane(6.0, 6.0)
    ground = replace(ground, uv=repeats * ground.uv)
    parts = [(ball.placed(translate=(-0.4, 0.9, 0.0)), "cloth"), (ground, "cloth")]
    camera = Camera("c", (0.5, 3.5, 6.0), (0.0, 0.5, 0.0), vertical_fov_deg=36.0, width=48, height_px=36, samples=2)
    return scenes.scene_of(parts, [scenes.sun(), scenes.lamp()], camera)


def test_gl_and_numpy_agree_on_every_pixel(scenes, form, drawn_by_both):
    both = drawn_by_both(draped(scenes), {"cloth": form})
    assert both.off.max() < 0.1
    assert np.percentile(both.relative, 99.9) < 1e-3
    assert both.mine[both.coverage == 1.0].std() > 0.02, "a texture is to be seen"


@pytest.mark.slow
def test_gl_and_numpy_agree_under_a_sky(scenes, form, drawn_by_both):
    camera = Camera("c", (0.5, 1.5, 3.0), (0.0, 0.0, 0.0), vertical_fov_deg=44.0, width=20, height_px=20, samples=1)
    scene = scenes.scene_of([(shapes.sphere(3, uv=True), "cloth")], [sky(2)], camera)
    both = drawn_by_both(scene, {"cloth": form})
    assert both.off.max() < 0.1 and both.coverage.max() == 1.0
    assert np.percentile(both.relative, 99.9) < 1e-3


def test_many_samples_of_many_components_are_all_counted(scenes, form, drawn_by_both):
    """A driver in software ends a shader after 65,535 rounds of its loops: pictures were too dark, without a word."""
    camera = Camera("c", (0.5, 1.5, 3.0), (0.0, 0.0, 0.0), vertical_fov_deg=10.0, width=1, height_px=1, samples=16)
    scene = scenes.scene_of([(shapes.sphere(3, uv=True), "cloth")], [sky(2)], camera)
    both = drawn_by_both(scene, {"cloth": form})
    assert both.mine.min() > 1e-3
    np.testing.assert_allclose(both.theirs, both.mine, rtol=1e-3)


def test_what_is_gathered_is_the_sum_over_the_sky(form):
    off = gathering_error(form, 40)
    assert off.mean() < 0.5 and off.max() < 2.5


def test_hats_are_what_lights_stand_for(form):
    functions = light_functions(form.texels.form.lights)
    even = np.concatenate([np.ones(len(functions.axes)), [np.pi, 0, 0, 2 * np.pi / 3, 0, 0, 0, 0, np.pi / 2]])
    np.testing.assert_allclose(functions.hats @ even, form.texels.form.lights.solid_angles, atol=0.02)


def test_long_lists_are_read_where_they_lie():
    rows = np.arange(4 * (MOST_TEXELS + 3)).reshape(-1, 4)
    text = Path(texels.__file__).with_name("listed.glsl").read_text("utf-8")
    mask, shift = (int(found) for found in re.findall(r"number (?:&|>>) (\d+)", text))
    at = np.array([0, MOST_TEXELS - 1, MOST_TEXELS, MOST_TEXELS + 2])
    np.testing.assert_array_equal(texels.folded(rows)[at >> shift, at & mask], rows[at])
    np.testing.assert_array_equal(texels.folded(rows[:9])[0, :9], rows[:9])
