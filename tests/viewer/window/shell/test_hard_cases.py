"""Windows that cannot be opened, that are as small as can be, and how they end: whole processes."""

import json
import os
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from metamer.spectral.formats.spectral_exr import write_spectral_exr
from metamer.spectral.formats.xyz_exr import write_xyz_exr
from metamer.spectral.image import ColourImage
from metamer.spectral.observers import OBSERVERS
from metamer.spectral.spectrum import Spectrum
from metamer.viewer.window.state import SESSION_FILE
from patience import patient

HERE = Path(__file__).resolve().parent
HARNESS = HERE.parents[2] / "harness"


@pytest.fixture
def view(surroundings, tiny_catalogue, tmp_path):
    """Runs `metamer view` in a folder of its own: (words, environment) -> what came of it."""

    def run(*words, without=(), **more):
        env = {key: value for key, value in (surroundings | more).items() if key not in without}
        command = [sys.executable, "-m", "metamer.cli.main", "view", *words, "--catalogue", tiny_catalogue]
        return subprocess.run(command, env=env, cwd=tmp_path, capture_output=True, text=True, timeout=patient(120))

    return run


def test_no_display_is_said_with_what_there_is_without_one(view, small_scene):
    done = view(small_scene, without=("DISPLAY", "WAYLAND_DISPLAY"))
    assert done.returncode == 4 and done.stdout == ""
    assert "DISPLAY" in done.stderr and "metamer render" in done.stderr and "Traceback" not in done.stderr


@pytest.mark.window
def test_a_display_that_does_not_answer_is_said(view, small_scene):
    done = view(small_scene, DISPLAY=":4711")
    assert done.returncode == 4 and "no window can be opened" in done.stderr and "Traceback" not in done.stderr


@pytest.mark.window
def test_a_display_that_there_is_not_is_said_before_a_window_opens(view, small_scene):
    done = view(small_scene, "--display", "sRBG")
    assert done.returncode == 4 and "unknown display" in done.stderr and "sRGB - Display" in done.stderr


@pytest.mark.window
def test_opengl_3_3_is_said_with_what_is_needed(view, small_scene):
    done = view(small_scene, MESA_GL_VERSION_OVERRIDE="3.3", MESA_GLSL_VERSION_OVERRIDE="330")
    assert done.returncode == 4, done.stderr
    assert "no window can be opened" in done.stderr and "4.1" in done.stderr and "Traceback" not in done.stderr


@pytest.mark.window
def test_what_is_not_installed_is_said_with_how_to_install_it(view, small_scene, tmp_path):
    (tmp_path / "imgui_bundle.py").write_text("raise ModuleNotFoundError('no imgui', name='imgui_bundle')")
    done = view(small_scene, PYTHONPATH=str(tmp_path))
    assert done.returncode == 4 and "metamer-colour[window]" in done.stderr and "make view" in done.stderr


@pytest.mark.slow
def test_what_is_not_there_is_said_before_a_window_opens(view):
    for words, named in ((["nowhere.toml"], "nowhere.toml"), (["tiny/coper"], "tiny/copper")):
        done = view(*words)
        assert done.returncode == 4 and named in done.stderr and "Traceback" not in done.stderr


@pytest.fixture
def end(surroundings, tiny_catalogue, small_scene, tmp_path):
    """Opens a window and ends it: how -> what came of it."""

    def run(how):
        command = [sys.executable, HARNESS / "window_endings.py", how, small_scene, tiny_catalogue]
        return subprocess.run(
            command, env=surroundings, cwd=tmp_path, capture_output=True, text=True, timeout=patient(120)
        )

    return run


@pytest.mark.window
def test_ctrl_c_in_the_terminal_ends_it_and_its_reference(end):
    done = end("interrupt")
    assert done.returncode == 130, done.stderr
    assert done.stderr.startswith("metamer: interrupted") and "Traceback" not in done.stderr
    below = Path(f"/proc/{int(done.stdout)}")
    for _ in range(50):
        if not below.exists():
            break
        time.sleep(0.1)
    assert not below.exists()


@pytest.mark.slow
def test_closed_in_mid_build_it_ends_well_and_keeps_its_session(end, surroundings, small_scene):
    kept = Path(surroundings["XDG_STATE_HOME"]) / "metamer" / "last-session.toml"
    kept.unlink(missing_ok=True)
    done = end("close")
    assert (done.returncode, done.stderr) == (0, "")
    assert SESSION_FILE.read(kept).subject.path == str(small_scene)


@pytest.mark.window
def test_a_minimised_window_waits_and_comes_back(end):
    done = end("minimise")
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.window
def test_there_is_nothing_to_go_on_with_before_a_window_was_closed(view, surroundings):
    kept = Path(surroundings["XDG_STATE_HOME"]) / "metamer" / "last-session.toml"
    kept.unlink(missing_ok=True)
    done = view("--last")
    assert done.returncode == 4 and "last-session.toml" in done.stderr
    done = view("--last", "tiny/copper")
    assert done.returncode == 64


@pytest.mark.window
def test_windows_of_one_pixel_and_of_twice_the_text(in_window, small_scene):
    results, said = in_window(HERE / "sizes_checks.py", str(small_scene))
    assert results and not any(results.values()), f"{json.dumps(results, indent=1)}\n{said}"


@pytest.mark.window
def test_a_spectral_image_is_looked_at_as_scenes_are(in_window, tmp_path):
    nm = np.arange(400.0, 701.0, 20.0)
    values = 0.05 + 0.9 * np.random.default_rng(2).random((48, 64, len(nm)))
    write_spectral_exr(tmp_path / "image.exr", Spectrum.sampled(nm, values, "reflectance"))
    results, said = in_window(HERE / "image_checks.py", str(tmp_path / "image.exr"))
    assert results and not any(results.values()), f"{json.dumps(results, indent=1)}\n{said}"


@pytest.mark.window
def test_two_pictures_of_a_review_are_looked_at(in_window, tmp_path):
    xyz = np.random.default_rng(2).uniform(0.1, 0.6, (48, 64, 3)).astype(np.float32)
    said = {"illuminant": "A", "observer": OBSERVERS["1964_10"]}
    files = [tmp_path / "a.reference.exr", tmp_path / "a.exr"]
    for file, factor in zip(files, (1.0, 1.1), strict=True):
        write_xyz_exr(file, ColourImage(factor * xyz, "xyz", np.array([1.1, 1.0, 0.35])), np.ones((48, 64)), said)
    results, said = in_window(HERE / "xyz_checks.py", " ".join(map(str, files)))
    assert results and not any(results.values()), f"{json.dumps(results, indent=1)}\n{said}"


@pytest.mark.window
def test_three_hundred_materials(in_window, small_scene, many):
    results, said = in_window(HERE / "many_checks.py", str(small_scene), many)
    assert results and not any(results.values()), f"{json.dumps(results, indent=1)}\n{said}"


@pytest.fixture
def many(tiny_catalogue, tmp_path, monkeypatch):
    """Folder of a catalogue of 304 materials: one of the small catalogue under many names."""
    from metamer.materials.records.record import MARKER, SUFFIX, read_record, write_record

    # Waiting for the disk is most of what writing hundreds of files takes.
    monkeypatch.setattr(os, "fsync", lambda _: None)
    folder = tmp_path / "many"
    shutil.copytree(tiny_catalogue, folder)
    record = read_record(tiny_catalogue / "tiny" / f"matt-red{SUFFIX}")
    (folder / "many").mkdir()
    for number in range(300):
        name = f"many/red-{number:03d}"
        write_record(replace(record, id=name, family="many"), folder / f"{name}{SUFFIX}")
    assert (folder / MARKER).is_file()
    return folder
