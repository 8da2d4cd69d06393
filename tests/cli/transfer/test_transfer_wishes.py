"""`metamer transfer relight` by wishes and parameters: "like this, but", values, and steps along a slider."""

import json

import numpy as np
import pytest
from metamer.lighting.transfer import ray_cache
from PIL import Image


def pictures(folder, count):
    return [np.asarray(Image.open(folder / f"step-{k:03d}.png").convert("L")).astype(float) for k in range(count)]


def test_a_part_gets_the_neighbour_nearest_to_the_wish(relight):
    code, said, err, found = relight("--like", "floor=darker:20")
    assert code == 0, err
    assert "floor: like room/white, but darker 20: room/grey" in said and "darker +22" in said
    floor, ball = found["parts"]
    assert (floor["after"], ball["after"]) == ("room/grey", "room/white")
    assert found["changes"] == [next(line for line in said.splitlines() if line.startswith("floor: like"))]


def test_glossier_finds_the_satin(relight):
    code, _, err, found = relight("--like", "floor=glossier:1,darker:8", "--material", "ball=room/dark")
    assert code == 0, err
    assert [part["after"] for part in found["parts"]] == ["room/satin", "room/dark"]


@pytest.mark.slow
def test_a_parameter_by_value_after_another_material(relight):
    """The material of --material is what --set changes."""
    words = ["--material", "floor=room/satin", "--set", "floor.exponent_u=200", "--set", "floor.exponent_v=200"]
    code, said, err, found = relight(*words)
    assert code == 0, err
    floor = found["parts"][0]
    assert floor["after"] == "room/satin with exponent_u 200, exponent_v 200"
    assert "fitted anew (ΔE94 p99 " in said


def test_steps_along_a_slider_trace_once(relight, monkeypatch, tmp_path):
    traced, calls = ray_cache._traced, []
    monkeypatch.setattr(ray_cache, "_traced", lambda *given: calls.append(given) or traced(*given))
    words = ["--set", "floor.reflectance_scale=1..0.25", "--steps", 4, "--kept", tmp_path / "rays"]
    code, said, err, found = relight(*words)
    assert code == 0, err
    assert len(calls) == 1
    assert found["parts"][0]["after"] == "room/white with reflectance_scale 0.25"
    assert found["steps"] == [f"room/white with reflectance_scale {value:g}" for value in (1, 0.75, 0.5, 0.25)]
    means = [one[-4:].mean() for one in pictures(tmp_path / "relit", 4)]
    assert np.all(np.diff(means) < -10.0)
    before, after = (np.asarray(Image.open(tmp_path / "relit" / f"{name}.png")) for name in ("before", "after"))
    first, last = (np.asarray(Image.open(tmp_path / "relit" / f"step-{k:03d}.png")) for k in (0, 3))
    assert np.abs(before.astype(int) - first).max() <= 1 and np.array_equal(after, last)
    row = np.asarray(Image.open(tmp_path / "relit" / "steps.png"))
    assert row.shape == (32 + 15, 4 * 36 - 4, 3)
    assert np.array_equal(row[:32, 108:140], last[..., :3])
    assert "steps.png" in said


def test_steps_through_neighbours_begin_with_the_nearest(relight, tmp_path):
    code, _, err, found = relight("--like", "floor=darker:40", "--steps", 2)
    assert code == 0, err
    assert found["steps"] == ["room/dark", "room/grey"]
    assert found["parts"][0]["after"] == found["steps"][0]
    assert len(list((tmp_path / "relit").glob("step-*.png"))) == 2


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["--like", "floor"], 64, "PART=WORD:N"),
        (["--like", "floor=warmer"], 64, "WORD:N"),
        (["--like", "floor=warmer:much"], 64, "a number"),
        (["--like", "floor=hotter:1"], 64, "warmer"),
        (["--like", "floor=warmer:1,cooler:1"], 4, "warmer and cooler"),
        (["--like", "ground=darker:20"], 4, "floor"),
        (["--like", "floor=lighter:3"], 4, "no other material is nearer"),
        (["--like", "floor=darker:1", "--like", "floor=darker:2"], 64, "two wishes"),
        (["--like", "floor=darker:9", "--set", "floor.reflectance_scale=0.5"], 64, "leave one out"),
        (["--set", "floor"], 64, "PART.NAME=X"),
        (["--set", "floor.sigma=x"], 64, "FROM..TO"),
        (["--set", "floor.sigma=0..1..2", "--steps", "3"], 64, "one range"),
        (["--set", "floor.sigma=0.3"], 4, "reflectance_scale"),
        (["--set", "floor.reflectance_scale=2"], 4, "<= 1.25"),
        (["--set", "floor.reflectance_scale=0..2", "--steps", "3"], 4, "<= 1.25"),
        (["--set", "ground.reflectance_scale=0.5"], 4, "floor"),
        (["--set", "floor.reflectance_scale=0.1..1"], 64, "--steps"),
        (["--set", "floor.reflectance_scale=0.1", "--set", "floor.reflectance_scale=0.2"], 64, "two values"),
        (["--set", "floor.reflectance_scale=0.1", "--steps", "3"], 64, "--steps needs"),
        (["--set", "floor.reflectance_scale=0.1..1", "--steps", "1"], 64, "from 2 on"),
    ],
)
def test_what_is_refused(relight, words, code, said, tmp_path):
    found, _, err, _ = relight(*words)
    assert found == code
    assert said in err
    assert not (tmp_path / "relit").exists()


def test_figures_hold_no_steps_where_there_are_none(relight, tmp_path):
    code, _, _, found = relight("--set", "floor.reflectance_scale=0.5")
    assert code == 0 and found["steps"] == [] and len(found["changes"]) == 1
    assert json.loads((tmp_path / "found.json").read_text(encoding="utf-8")) == found
    assert not list((tmp_path / "relit").glob("step*"))
