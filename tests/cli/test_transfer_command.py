"""`metamer transfer show`: how many bounces a scene needs, and what its parts put on each other."""

import json

import pytest


def test_a_ball_needs_no_bounce(metamer, scene, tiny_catalogue, tmp_path):
    file = tmp_path / "found.json"
    code, said, _ = metamer("transfer", "show", scene, "--catalogue", tiny_catalogue, "--rays", 16, "--json", file)
    assert code == 0
    assert "needs no bounce" in said
    assert "no part changes the colour of another" in said
    found = json.loads(file.read_text(encoding="utf-8"))
    assert found["bounces"] == 0
    assert [one["delta_e94"]["max"] for one in found["pairs"]] == [0.0]


def test_a_floor_below_a_ball(metamer, scene, tiny_catalogue, tmp_path):
    text = scene.read_text(encoding="utf-8")
    material = text.split('material = "')[1].split('"')[0]
    floor = f'[[part]]\nname = "floor"\nshape = "plane"\ntranslate = [0, -1, 0]\nmaterial = "{material}"\n\n'
    scene.write_text(text.replace("[[part]]", floor + "[[part]]", 1), encoding="utf-8")
    file = tmp_path / "found.json"
    code, said, _ = metamer("transfer", "show", scene, "--catalogue", tiny_catalogue, "--rays", 16, "--json", file)
    assert code == 0
    found = json.loads(file.read_text(encoding="utf-8"))
    assert found["bounces"] >= 1
    assert f"needs {found['bounces']} bounce" in said
    on = {(one["on"], one["by"]): one["delta_e94"]["mean"] for one in found["pairs"]}
    ball = next(one["part"] for one in found["parts"] if one["part"] != "floor")
    assert on[ball, "floor"] > 1.0


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["--rays", "0"], 64, "at least 1"),
        (["--illuminant", "D66"], 4, "D66"),
        (["--json", "/nowhere/found.json"], 4, "nowhere"),
    ],
)
def test_what_is_refused(metamer, scene, tiny_catalogue, words, code, said):
    found, _, err = metamer("transfer", "show", scene, "--catalogue", tiny_catalogue, *words)
    assert found == code
    assert said in err
