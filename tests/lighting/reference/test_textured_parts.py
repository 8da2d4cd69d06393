"""Parts of scene files with textures: who has coordinates, and how textures are turned and repeated."""

import numpy as np
import pytest
from metamer.lighting.scene_file.files import load_scene
from metamer.runtime.errors import InputError

BARE = '[[part]]\nshape = "sphere"\nsubdivisions = 2\nmaterial = "paint/red"\n'
LIGHT_AND_CAMERA = """
[[light]]
kind = "directional"
direction_to_light = [0, 1, 1]
illuminance_lux = 1000
spectrum = "D65"
[[camera]]
position = [0, 0, 4]
target = [0, 0, 0]
vertical_fov_deg = 36
"""


@pytest.fixture
def scene(tmp_path):
    def load(text):
        (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
        return load_scene(tmp_path / "scene.toml")

    return load


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("uv_scale = 3", [[0, 0], [3, 0], [0, 3], [3, 3]]),
        ("uv_scale = [2, -0.5]", [[0, 0], [2, 0], [0, -0.5], [2, -0.5]]),
        # Turned anticlockwise: what was on the right is on top, so that the top shows what was on the right.
        ("uv_rotate_deg = 90", [[0, 0], [0, -1], [1, 0], [1, -1]]),
        ("uv_rotate_deg = 90\nuv_scale = [2, 1]", [[0, 0], [0, -1], [2, 0], [2, -1]]),
    ],
)
def test_textures_are_turned_then_repeated(scene, words, expected):
    text = BARE.replace('"sphere"\nsubdivisions = 2', f'"plane"\nwidth = 1\ndepth = 1\n{words}') + LIGHT_AND_CAMERA
    mesh = scene(text).parts[0].mesh
    plain = scene(text.replace(words, "")).parts[0].mesh
    order = np.lexsort((plain.uv[:, 0], plain.uv[:, 1]))
    np.testing.assert_allclose(mesh.uv[order], expected, atol=1e-12)
    if "rotate" in words:
        # The grain turns with the texture.
        assert abs(mesh.tangents.directions @ plain.tangents.directions[0]).max() < 1e-9


def test_a_shape_has_texture_coordinates_unless_told_otherwise(scene):
    assert scene(BARE + LIGHT_AND_CAMERA).parts[0].mesh.uv is not None
    bare = BARE + "uv = false\n"
    assert scene(bare + LIGHT_AND_CAMERA).parts[0].mesh.uv is None
    with pytest.raises(InputError, match=r"(?s)part 1.*uv_scale.*no texture coordinates"):
        scene(bare + "uv_scale = 2\n" + LIGHT_AND_CAMERA)
    for wrong in ("0", "[1, 2, 3]", "[1, 0]", '"2"'):
        with pytest.raises(InputError, match="none of them 0"):
            scene(BARE + f"uv_scale = {wrong}\n" + LIGHT_AND_CAMERA)
