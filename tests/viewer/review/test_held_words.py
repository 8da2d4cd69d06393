"""A review says how much of a BTF is seen, or lit, from where nobody measured."""

import json

import numpy as np
import pytest
from btf_cloths import NINE, cloth, imported, saved
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.lighting.reference.geometry import visible_geometry
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.viewer.review.review import review
from metamer.viewer.review.words import held_words
from metamer.viewer.software.backend import software_session


@pytest.fixture(scope="module")
def wool(tmp_path_factory):
    """A catalogue of a cloth measured up to 60 degrees."""
    folder = tmp_path_factory.mktemp("held")
    saved(folder / "wool", cloth())
    imported(folder / "wool", folder / "catalogue")
    return Catalogue.open(folder / "catalogue")


def scene_of(scenes, part, light):
    camera = Camera("c", (0.0, 0.0, 6.0), (0.0, 0.0, 0.0), vertical_fov_deg=24.0, width=32, height_px=32, samples=1)
    return scenes.scene_of([(part, "btf/wool")], [light], camera)


def words_of(scene, catalogue):
    geometry = visible_geometry(scene, scene.cameras[0])
    return geometry, held_words(scene, geometry, "btf/wool", catalogue["btf/wool"].fast)


@pytest.mark.slow
def test_points_beyond_what_was_measured_are_counted_and_stand_in_the_report(scenes, wool, tmp_path):
    scene = scene_of(scenes, shapes.sphere(4, uv=True), scenes.sun((0.3, 0.2, 1.0)))
    geometry, words = words_of(scene, wool)
    seen = np.mean(geometry.wo[:, 2] < 0.5)
    lit = np.mean(geometry.lit[0].wi[:, 2] < 0.5)
    assert 0.05 < seen < 0.5 and 0.05 < lit < 0.5
    assert words == tuple(
        f"{share:.1%} of its points are {how} from beyond 60° off the normal, where values are held."
        for share, how in ((seen, "seen"), (lit, "lit"))
    )
    review(scene, wool, tmp_path, renderer=software_session(), version="test", illuminants=("D65",), budget=100.0)
    (row,) = json.loads((tmp_path / "review.json").read_text(encoding="utf-8"))["results"]
    assert [note for note in row["notes"] if "off the normal" in note] == list(words)


def test_what_is_seen_and_lit_from_where_it_was_measured_has_no_note(scenes, wool):
    facing = shapes.plane(0.5, 0.5).placed(rotate_deg=(90.0, 0.0, 0.0))
    geometry, words = words_of(scene_of(scenes, facing, scenes.sun((0.0, 0.0, 1.0))), wool)
    assert len(geometry.wo) and words == ()


def test_directions_on_the_outermost_ring_were_measured(scenes, wool):
    """Light from 60 degrees, whatever its cosine is rounded to."""
    facing = shapes.plane(0.5, 0.5).placed(rotate_deg=(90.0, 0.0, 0.0))
    light = scenes.sun((np.sqrt(3.0), 0.0, 1.0))
    geometry, words = words_of(scene_of(scenes, facing, light), wool)
    assert len(geometry.lit[0].wi) and words == ()
    assert wool["btf/wool"].fast.measured_to == (NINE[-1][0],) * 2
