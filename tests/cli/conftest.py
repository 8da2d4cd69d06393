"""Fixtures that the tests of the command share: a tiny scene, and the command itself."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from metamer.cli.main import main

SCENE = """
[scene]
name = "Tiny"

[[part]]
name = "ball"
shape = "sphere"
subdivisions = 3
material = "tiny/matt-red"

[[light]]
direction_to_light = [-0.45, 0.46, 0.766]
spectrum = "D65"

[[camera]]
name = "front"
projection = "orthographic"
position = [0, 0, 4]
target = [0, 0, 0]
height = 2.2
width = 32
height_px = 32
samples = 2
"""
SWEEP = """
[review]
on = "ball"
illuminants = ["D65", "A"]
"""

ROOM = """family = "room"
kind = "analytic"
[[material]]
name = "white"
model = "lambert"
reflectance = { constant = 0.8 }
[[material]]
name = "dark"
model = "lambert"
reflectance = { constant = 0.1 }
[[material]]
name = "grey"
model = "lambert"
reflectance = { constant = 0.4 }
[[material]]
name = "satin"
model = "ashikhmin_shirley"
diffuse = { constant = 0.6 }
specular = { constant = 0.04 }
exponent_u = 40.0
exponent_v = 40.0
"""
FLOOR = '[[part]]\nname = "floor"\nshape = "plane"\nscale = 4\ntranslate = [0, -1.2, 0]\nmaterial = "room/white"\n\n'


@pytest.fixture
def scene(tmp_path) -> Path:
    """A scene whose review sweeps the tiny catalogue."""
    path = tmp_path / "scene.toml"
    path.write_text(SCENE + SWEEP, encoding="utf-8")
    return path


@pytest.fixture
def scene_text() -> str:
    """A scene without [review]."""
    return SCENE


@pytest.fixture
def metamer(capfd, monkeypatch):
    """The command in this process: words in, (exit code, stdout, stderr) out. No input may end in a traceback."""
    monkeypatch.delenv("OCIO", raising=False)
    monkeypatch.setenv("COLUMNS", "120")

    def run(*words):
        capfd.readouterr()
        try:
            code = main([str(word) for word in words])
        except SystemExit as end:
            code = end.code
        out, err = capfd.readouterr()
        assert "Traceback" not in out + err
        return code, out, err

    return run


@pytest.fixture
def started(tmp_path):
    """Starts the command in a process of its own, which hears Ctrl-C even under a runner that ignores it."""
    processes = []

    def start(*words, **variables):
        # A shell's background job hands an ignored SIGINT down to all of its children.
        listen = (
            "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
            "from metamer.cli.main import main; sys.exit(main())"
        )
        process = subprocess.Popen(
            [sys.executable, "-c", listen, *map(str, words)],
            cwd=tmp_path,
            env={**os.environ, **variables},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
        )
        processes.append(process)
        return process

    yield start
    for process in processes:
        if process.poll() is None:
            process.send_signal(signal.SIGKILL)
        process.wait()
        for pipe in (process.stdout, process.stderr):
            pipe.close()


@pytest.fixture(scope="session")
def room_catalogue(tmp_path_factory):
    """Matt white, grey and dark, and a satin between white and grey."""
    from metamer.materials.intake.importing import import_sources

    folder = tmp_path_factory.mktemp("room")
    (folder / "room.toml").write_text(ROOM, encoding="utf-8")
    import_sources([folder / "room.toml"], folder / "catalogue", jobs=1)
    return folder / "catalogue"


@pytest.fixture
def room(scene_text, tmp_path, monkeypatch):
    """A ball on a floor, from slightly above."""
    from metamer.lighting.visibility import refinement

    monkeypatch.setattr(refinement, "MOST_VERTICES", 200)
    text = scene_text.replace("tiny/matt-red", "room/white").replace("[[part]]", FLOOR + "[[part]]", 1)
    text = text.replace("subdivisions = 3", "subdivisions = 2").replace("position = [0, 0, 4]", "position = [0, 2, 4]")
    file = tmp_path / "room.toml"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.fixture
def relight(metamer, room, room_catalogue, tmp_path):
    """The command on the room: (code, stdout, stderr, figures or None)."""

    def run(*words):
        figures, shared = tmp_path / "found.json", ["--catalogue", room_catalogue, "--renderer", "software"]
        figures.unlink(missing_ok=True)
        words = [*words, *shared, "--out", tmp_path / "relit", "--json", figures, "--processes", 1]
        code, said, err = metamer("transfer", "relight", room, *words)
        return code, said, err, json.loads(figures.read_text(encoding="utf-8")) if figures.exists() else None

    return run
