"""A review says when its pictures show nothing, and refuses a view without what it is to judge."""

import json
from dataclasses import replace

import pytest
from metamer.lighting.scene import Review
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.runtime.errors import InputError
from metamer.viewer.review.review import review
from metamer.viewer.software.backend import software_session


@pytest.fixture(scope="module")
def catalogue(tiny_catalogue):
    return Catalogue.open(tiny_catalogue)


def run(scene, catalogue, out, **options):
    found = review(scene, catalogue, out, renderer=software_session(), version="test", **options)
    return found, json.loads((out / "review.json").read_text(encoding="utf-8"))


def test_pictures_of_nothing_are_refused_before_the_work_and_never_pass(scenes, catalogue, tmp_path):
    """A lamp inside the ball: everything is black, and both sides agree."""
    scene = replace(scenes.sphere_scene("tiny/copper", size=24, samples=1), lights=(scenes.lamp((0.0, 0.0, 0.3)),))
    heard = []
    with pytest.raises(InputError, match='the picture of camera "ortho" is black'):
        run(scene, catalogue, tmp_path / "out", warn=heard.append)
    (inside,) = heard
    assert all(word in inside for word in ('light "light"', 'inside part "part0"', 'camera "ortho"'))
    assert not (tmp_path / "out" / "review.json").exists()


def test_what_stands_wrong_is_said_at_once_and_in_the_report(scenes, catalogue, tmp_path):
    """One lamp of two inside the ball: the other lights the picture."""
    scene = scenes.sphere_scene("tiny/copper", size=24, samples=1)
    scene = replace(scene, lights=(*scene.lights, scenes.lamp((0.0, 0.0, 0.3))))
    heard = []
    found, document = run(scene, catalogue, tmp_path, warn=heard.append)
    assert heard == list(found.warnings) == document["warnings"]
    assert len(heard) == 1 and "stands inside part" in heard[0]
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert page.count("<li>Warning: ") == 1 and "stands inside part" in page


def test_pictures_that_are_clipped_as_a_whole_are_said(scenes, catalogue, tmp_path):
    scene = scenes.sphere_scene("tiny/matt-red", size=24, samples=1)
    scene = replace(
        scene, lights=(scenes.sun((0, 0, 1)),), viewing=replace(scene.viewing, reference_illuminance_lux=1e-3)
    )
    _, document = run(scene, catalogue, tmp_path, illuminants=("D65", "A"))
    assert len(document["warnings"]) == 2
    for line, name in zip(document["warnings"], ("D65", "A"), strict=True):
        assert f"the picture of tiny/matt-red under {name} is clipped as a whole" in line
        assert "raise viewing.reference_illuminance_lux, now 0.001" in line


def test_a_camera_that_misses_what_is_judged_is_refused_before_any_work(scenes, catalogue, tmp_path, monkeypatch):
    monkeypatch.setattr("metamer.viewer.review.review.reference_pictures", lambda *_: pytest.fail("worked for nothing"))
    scene = scenes.lamp_scene("tiny/copper", size=24, samples=1)
    parts = tuple(replace(part, material="tiny/copper") for part in scene.parts)
    scene = replace(scene, parts=parts, review=Review("part0"))
    away = replace(scene.camera(), target=(0.5, 1.0, 9.0))
    with pytest.raises(InputError, match=r'camera near: camera "near" sees nothing: it looks 1\d\d degrees past'):
        run(replace(scene, cameras=(away,)), catalogue, tmp_path)
    low = replace(scene.camera(), position=(0.0, -0.88, 3.4), target=(0.0, -2.0, 3.3))
    with pytest.raises(InputError, match='does not see part "part0", which is reviewed'):
        run(replace(scene, cameras=(low,)), catalogue, tmp_path)
