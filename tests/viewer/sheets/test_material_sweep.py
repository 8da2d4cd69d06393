"""Pictures along a slider: each as it would be drawn alone, over rays that are traced once, in both renderers."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.lighting.transfer import ray_cache
from metamer.lighting.visibility import refinement
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.search.edited_material import VariedCatalogue, varied, varied_along
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.viewer.gl.backend import gl_session
from metamer.viewer.picture import picture
from metamer.viewer.sheets.material_sweep import along, row_of
from metamer.viewer.software.backend import software_session


@pytest.fixture(params=["numpy", "GL"])
def renderer(request, tmp_path):
    with gl_session(request.getfixturevalue("gl")) if request.param == "GL" else software_session() as made:
        made.configure(rays_folder=tmp_path / "rays")
        yield made


@pytest.fixture
def catalogue(tmp_path, write_matt):
    write_matt(tmp_path / "cat", "paint/white", 0.8)
    write_matt(tmp_path / "cat", "paint/red", np.linspace(0.05, 0.7, 81))
    return Catalogue.open(tmp_path / "cat")


@pytest.fixture
def room(scenes, monkeypatch):
    """A white ball on a red floor; names of parts are those that `scene_of` gives."""
    monkeypatch.setattr(refinement, "MOST_VERTICES", 200)
    floor = shapes.plane(3.0, 3.0).placed(translate=(0.0, -1.01, 0.0))
    camera = Camera("c", (0.0, 2.0, 4.0), width=24, height_px=24, samples=1)
    parts = [(floor, "paint/red"), (shapes.sphere(2), "paint/white")]
    return replace(scenes.scene_of(parts, [scenes.sun((0.3, 0.9, 0.5))], camera), bounces=1)


@pytest.mark.slow_cases("GL", "numpy")
def test_each_picture_is_that_of_its_material_alone(room, catalogue, renderer, monkeypatch):
    traced, calls = ray_cache._traced, []
    monkeypatch.setattr(ray_cache, "_traced", lambda *given: calls.append(given) or traced(*given))
    floor = room.parts[0].name
    steps = varied_along(catalogue["paint/red"], {"reflectance_scale": (1.0, 0.5)}, 3)
    drawn = {made.id: found for made, found in along(room, floor, steps, catalogue, renderer)}
    assert len(calls) == 1
    middle = varied(catalogue["paint/red"], {"reflectance_scale": 0.75})
    assert list(drawn)[1] == middle.id
    alone = picture(room.with_material(floor, middle.id), VariedCatalogue.of(catalogue, [middle]), None, renderer)
    assert np.array_equal(drawn[middle.id].xyz, alone.xyz)
    before = picture(room, catalogue, None, renderer)
    np.testing.assert_allclose(drawn["paint/red with reflectance_scale 1"].xyz, before.xyz, atol=1e-3)


@pytest.mark.slow_cases("GL")
def test_what_lies_beside_the_part_changes_with_it(room, catalogue, renderer):
    """The ball stays white: it loses the light that a red floor has thrown upon it."""
    floor = room.parts[0].name
    steps = varied_along(catalogue["paint/red"], {"reflectance_scale": (1.0, 0.0)}, 2)
    first, last = (found for _, found in along(room, floor, steps, catalogue, renderer))
    ball = (first.coverage == 1.0) & (last.xyz[..., 1] > 0.02)
    lost = (first.xyz - last.xyz)[ball]
    assert ball.sum() > 20 and lost.min() > -1e-4
    # The lost light is as red as the floor: more X than Z, beside the white.
    shares = lost.sum(axis=0) / first.white
    assert shares[0] > 1.5 * shares[2] > 0.0


def test_an_unknown_part_is_refused(room, catalogue):
    with software_session() as renderer, pytest.raises(UnknownNameError, match="roof"):
        next(along(room, "roof", [catalogue["paint/white"]], catalogue, renderer))


@pytest.mark.parametrize(
    ("ranges", "count", "said"),
    [
        ({"reflectance_scale": (1.0, 0.5)}, 1, "no steps"),
        ({}, 3, "nothing is changed"),
        ({"reflectance_scale": (1.0, 1.5)}, 3, "out of its domain"),
    ],
)
def test_all_steps_are_checked_before_the_first_is_fitted(catalogue, ranges, count, said):
    with pytest.raises(InputError, match=said):
        varied_along(catalogue["paint/white"], ranges, count)


def test_a_row_has_each_picture_and_its_caption():
    pictures = [np.full((10, 60, 3), value, np.uint8) for value in (0, 90, 250)]
    row = row_of(pictures, ["roughness 0.1", "roughness 0.2", "a caption that is far too long for its picture"])
    assert row.shape == (25, 3 * 64 - 4, 3)
    for number, shown in enumerate(pictures):
        assert np.array_equal(row[:10, 64 * number : 64 * number + 60], shown)
        assert row[10:, 64 * number : 64 * number + 60].min() < 120
    with pytest.raises(InputError, match="no pictures"):
        row_of([], [])
