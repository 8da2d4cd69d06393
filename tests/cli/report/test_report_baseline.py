"""`metamer report baseline`, `run` and `accept`: recorded, rendered again, agreed to, and never left half-done."""

import json
import shutil
import signal
import subprocess
import sys

import numpy as np
import pytest
from json_schema import problems, schemas

SUITE = """
[suite]
name = "Reds"
scenes = ["scene.toml"]
materials = ["paint/*"]
illuminants = ["D65", "A"]

[[criteria]]
statistic = "mean"
warn = 0.1
fail = 0.5
"""


@pytest.fixture
def suite(scene_text, write_matt, tmp_path):
    """A suite of two paints under two lights, and what it is told on the command line."""
    text = scene_text.replace("tiny/matt-red", "paint/red").replace("width = 32", "width = 16")
    (tmp_path / "scene.toml").write_text(text.replace("height_px = 32", "height_px = 16"), encoding="utf-8")
    (tmp_path / "suite.toml").write_text(SUITE, encoding="utf-8")
    paint(write_matt, tmp_path, 0.5)
    return [tmp_path / "suite.toml", "--catalogue", tmp_path / "catalogue", "--renderer", "software", "--jobs", 1]


def paint(write_matt, tmp_path, red):
    write_matt(tmp_path / "catalogue", "paint/red", np.linspace(0.1, red, 81))
    write_matt(tmp_path / "catalogue", "paint/blue", np.linspace(red, 0.1, 81) if red == 0.5 else np.full(81, 0.3))


@pytest.fixture
def baseline(metamer, suite, tmp_path):
    code, out, err = metamer("report", "baseline", *suite, "--into", tmp_path / "baseline")
    assert code == 0 and "4 rows of Reds" in out, err
    return tmp_path / "baseline"


def files(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_baseline_is_the_same_bytes_every_time(metamer, suite, baseline, tmp_path):
    assert metamer("report", "baseline", *suite, "--into", tmp_path / "again")[0] == 0
    assert files(baseline) == files(tmp_path / "again")
    assert sorted(path.name for path in tmp_path.iterdir() if path.name.startswith(".")) == []
    said = json.loads((baseline / "baseline.json").read_text(encoding="utf-8"))
    assert problems(said, schemas("regression_json.md")[1]) == []
    assert said["suite"]["name"] == "Reds" and "numpy" in said["environment"] and "created" not in said


def test_an_unchanged_suite_is_identical(metamer, suite, baseline, tmp_path):
    code, out, err = metamer("report", "run", *suite, "--baseline", baseline, "--out", tmp_path / "out")
    assert code == 0 and "Nothing moved: all 4 pictures" in out, out + err


def test_what_moved_is_found_and_accepted_row_by_row(metamer, suite, baseline, write_matt, tmp_path):
    paint(write_matt, tmp_path, 0.52)
    run = ["report", "run", *suite, "--baseline", baseline, "--out", tmp_path / "out"]
    before = files(baseline)
    code, out, _ = metamer(*run)
    assert code == 2 and "4 of 4 pictures moved" in out and files(baseline) == before
    accept = ["report", "accept", baseline, "--from", tmp_path / "out"]
    code, out, err = metamer(*accept, "--row", "paint/blue")
    assert code == 0 and "2 rows accepted" in out, err
    code, out, err = metamer(*run)
    assert "2 of 4 pictures moved" in out, err
    assert metamer(*accept, "--all")[0] == 0
    for words, rows in ((("--all",), "all rows"), (("--row", "paint/blue"), "these rows")):
        code, out, _ = metamer(*accept, *words)
        assert code == 0 and f"0 rows accepted into {baseline}: it holds what {rows} of" in out
    code, out, _ = metamer(*run)
    assert code == 0 and "Nothing moved: all 4 pictures" in out
    assert metamer("report", "compare", baseline, tmp_path / "out")[0] == 0
    # Nothing of what was agreed to before is left.
    assert len(list((baseline / "pixels").iterdir())) <= 8


@pytest.mark.slow
def test_a_material_added_to_a_suite_changes_no_other_row(metamer, scene_text, write_matt, tmp_path):
    """Where all were planned together, one of many colours would take more coefficients, and move the others."""
    nm = np.linspace(380.0, 780.0, 81)
    scene = tmp_path / "scene.toml"
    text = scene_text.replace("tiny/matt-red", "paint/red").replace("width = 32", "width = 8")
    scene.write_text(text.replace("height_px = 32", "height_px = 8"), encoding="utf-8")
    paints = {"red": 610.0, **{f"paint-{at}": 430.0 + 25.0 * at for at in range(9)}}
    for name, middle in paints.items():
        for folder in ("before", "after"):
            write_matt(tmp_path / folder, f"paint/{name}", 0.05 + 0.7 / (1.0 + np.exp(-(nm - middle) / 25.0)))
    write_matt(tmp_path / "after", "paint/stripes", 0.5 + 0.45 * np.sin(np.arange(81) * 0.9))
    for folder in ("before", "after"):
        words = ("--catalogue", tmp_path / folder, "--materials", "paint/*", "--illuminants", "D65,A,FL11")
        more = ("--budget", 2, "--renderer", "software", "--jobs", 1, "--out", tmp_path / f"{folder} drawn")
        metamer("review", scene, *words, *more)
    code, out, err = metamer("report", "compare", tmp_path / "before drawn", tmp_path / "after drawn")
    assert code == 1 and "3 are new; the other 30 did not move" in out, out + err


def test_a_row_is_accepted_from_a_run_that_has_more(metamer, suite, baseline, write_matt, tmp_path):
    write_matt(tmp_path / "catalogue", "paint/green", 0.4)
    run = ["report", "run", *suite, "--baseline", baseline, "--out", tmp_path / "out"]
    code, out, _ = metamer(*run)
    assert code == 1 and "2 are new; the other 4 did not move" in out
    assert metamer("report", "accept", baseline, "--from", tmp_path / "out", "--row", "*red*")[0] == 0
    assert "2 are new" in metamer(*run)[1]
    assert metamer("report", "accept", baseline, "--from", tmp_path / "out", "--row", "paint/green")[0] == 0
    assert metamer(*run)[0] == 0


def test_a_review_is_a_suite(metamer, suite, baseline, tmp_path):
    metamer("report", "run", *suite, "--baseline", baseline, "--out", tmp_path / "out")
    (folder,) = (tmp_path / "out" / "reviews").iterdir()
    assert metamer("report", "baseline", folder, "--into", tmp_path / "of-review")[0] == 0
    shutil.copytree(folder, tmp_path / "copy" / folder.name)
    words = ["--baseline", tmp_path / "of-review", "--out", tmp_path / "out2"]
    code, out, _ = metamer("report", "run", tmp_path / "copy" / folder.name, *words)
    assert code == 0 and "Nothing moved: all 4 pictures" in out


def test_a_suite_that_was_edited_is_said_to_be_another(metamer, suite, baseline, tmp_path):
    suite[0].write_text(SUITE.replace("0.5", "0.6"), encoding="utf-8")
    code, out, _ = metamer("report", "run", *suite, "--baseline", baseline, "--out", tmp_path / "out")
    assert code == 0 and "files of the suite are others" in out


def test_missing_foreign_and_damaged_baselines_are_refused(metamer, suite, baseline, tmp_path):
    code, _, err = metamer("report", "run", *suite, "--baseline", tmp_path / "none", "--out", tmp_path / "out")
    assert code == 4 and "metamer report baseline" in err and not (tmp_path / "out").exists()
    other = tmp_path / "other.toml"
    other.write_text(SUITE.replace("Reds", "Blues"), encoding="utf-8")
    code, _, err = metamer("report", "run", other, *suite[1:], "--baseline", baseline, "--out", tmp_path / "out")
    assert code == 3 and "Reds" in err and "Blues" in err and not (tmp_path / "out").exists()
    code, _, err = metamer("report", "baseline", other, *suite[1:], "--into", baseline)
    assert code == 3 and "Reds" in err
    code, _, err = metamer("report", "run", *suite, "--baseline", baseline, "--out", baseline)
    assert code == 3
    victim = sorted((baseline / "pixels").iterdir())[0]
    victim.write_bytes(victim.read_bytes()[:-1] + b"x")
    code, _, err = metamer("report", "run", *suite, "--baseline", baseline, "--out", tmp_path / "out")
    assert code == 4 and victim.name in err and "SHA-256" in err
    victim.unlink()
    code, _, err = metamer("report", "run", *suite, "--baseline", baseline, "--out", tmp_path / "out")
    assert code == 4 and victim.name in err
    (baseline / "baseline.json").write_text("{}", encoding="utf-8")
    code, _, err = metamer("report", "run", *suite, "--baseline", baseline, "--out", tmp_path / "out")
    assert code == 4 and "damaged" in err


def test_a_damaged_run_is_not_accepted_and_the_baseline_stands(metamer, suite, baseline, write_matt, tmp_path):
    paint(write_matt, tmp_path, 0.52)
    metamer("report", "run", *suite, "--baseline", baseline, "--out", tmp_path / "out")
    before = files(baseline)
    for victim in (tmp_path / "out" / "pixels").iterdir():
        victim.write_bytes(victim.read_bytes()[:200])
    code, _, err = metamer("report", "accept", baseline, "--from", tmp_path / "out", "--all")
    assert code == 4 and "damaged" in err and files(baseline) == before


def test_a_disk_that_is_full_while_rows_are_accepted_leaves_the_old_baseline(
    metamer, suite, baseline, write_matt, tmp_path, room_for
):
    paint(write_matt, tmp_path, 0.52)
    metamer("report", "run", *suite, "--baseline", baseline, "--out", tmp_path / "out")
    before = files(baseline)
    for room in (500, 3000):
        # Not even one picture; all of them, and not what names them.
        with room_for(room):
            code, _, err = metamer("report", "accept", baseline, "--from", tmp_path / "out", "--all")
        now = files(baseline)
        assert code == 4 and "room" in err, err
        assert all(now[name] == held for name, held in before.items())


def test_a_full_disk_leaves_the_old_baseline(metamer, suite, baseline, write_matt, tmp_path, monkeypatch):
    from metamer.calibration.regression import baseline as module
    from metamer.runtime.errors import NoRoomError

    paint(write_matt, tmp_path, 0.52)
    before, real, written = files(baseline), module.write_exr, []

    def full(*args):
        if len(written) == 3:
            raise NoRoomError("no room for the file", file=args[0])
        written.append(real(*args))

    monkeypatch.setattr(module, "write_exr", full)
    code, _, err = metamer("report", "baseline", *suite, "--into", baseline)
    now = files(baseline)
    assert code == 4 and "no room" in err and all(now[name] == held for name, held in before.items())
    monkeypatch.undo()
    assert metamer("report", "baseline", *suite, "--into", baseline)[0] == 0
    assert len(files(baseline)) <= len(before) + 1


#: Accepts a run, and is killed when all pixels are there and the manifest is not.
KILLED = """
import os, signal, sys
from pathlib import Path
from metamer.calibration.regression import accept
accept.put = lambda *words: os.kill(os.getpid(), signal.SIGKILL)
accept.accept(Path(sys.argv[1]), Path(sys.argv[2]), None)
"""


def test_a_killed_accept_leaves_the_old_baseline_and_the_next_one_clears_up(
    metamer, suite, baseline, write_matt, tmp_path
):
    paint(write_matt, tmp_path, 0.52)
    run = ["report", "run", *suite, "--baseline", baseline, "--out", tmp_path / "out"]
    metamer(*run)
    before = files(baseline)
    done = subprocess.run([sys.executable, "-c", KILLED, baseline, tmp_path / "out"], capture_output=True, text=True)
    now = files(baseline)
    assert done.returncode == -signal.SIGKILL, done.stderr
    assert len(now) > len(before) and all(now[name] == held for name, held in before.items())
    assert metamer("report", "accept", baseline, "--from", tmp_path / "out", "--all")[0] == 0
    assert metamer(*run)[0] == 0 and files(baseline).keys() == files_of_run(tmp_path / "out")


def files_of_run(folder):
    """Return the files of a run's folder that a baseline has."""
    return {name for name in files(folder) if not name.startswith("reviews/") and name != "history.json"}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[suite", "TOML"),
        ("[suite]\nname = 'x'", "a suite of no scene"),
        ("[suite]\nscenes = ['none.toml']", "none.toml"),
        ("[suite]\nscenes = 'scene.toml'", "list of names"),
        ("[suite]\nscenes = ['scene.toml']\nilluminants = ['D66']", "nearest"),
        ("[suite]\nscenes = ['scene.toml']\nobservers = ['1965']", "1931_2"),
        ("[suite]\nscenes = ['scene.toml']\nbudget = 0", "above 0"),
        ("[suite]\nscenes = ['scene.toml']\nlights = ['D65']", "illuminants"),
        ("[suites]\nscenes = ['scene.toml']", "suite"),
        (SUITE.replace('"mean"', '"average"'), "unknown statistic"),
    ],
)
def test_a_wrong_suite_is_refused_before_anything_is_made(metamer, suite, tmp_path, text, words):
    suite[0].write_text(text, encoding="utf-8")
    code, _, err = metamer("report", "baseline", *suite, "--into", tmp_path / "baseline")
    assert code == 4 and words in err and not (tmp_path / "baseline").exists(), err
