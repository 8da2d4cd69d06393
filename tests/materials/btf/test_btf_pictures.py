"""BTFs in pictures: both renderers draw the same, and what the images show."""

from dataclasses import replace

import numpy as np
import pytest
from btf_samples import bumps
from metamer.lighting import shapes
from metamer.lighting.camera import Camera
from metamer.materials.btf.form import btf_form
from metamer.materials.btf.local_pca import Size
from metamer.spectral.difference import delta_e_xyz
from metamer.viewer.headless import GLRenderer
from metamer.viewer.software import SoftwareRenderer


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
    with GLRenderer(gl) as hardware, SoftwareRenderer() as software:
        (theirs, covered), (mine, coverage) = (one.render(scene, None, surfaces) for one in (hardware, software))
    np.testing.assert_array_equal(covered, coverage)
    off = delta_e_xyz(mine.astype(float), theirs.astype(float), scene.adopted_white())
    assert off.max() < 0.1
    lit = mine[..., 1] > 1e-3
    assert np.percentile(np.abs(theirs[lit] / mine[lit] - 1.0), 99.9) < 1e-3
    assert mine[coverage == 1.0].std() > 0.02, "a texture is to be seen"
