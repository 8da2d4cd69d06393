"""What the tests of the command share: a tiny scene, and the command itself."""

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
