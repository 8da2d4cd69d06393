"""Windows on a display that nobody sees, each in a process of its own."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from patience import patient

# Run in processes of their own, and import what only windows have.
collect_ignore_glob = ["*checks*.py"]
HARNESS = Path(__file__).resolve().parents[3] / "harness"
# A body of few triangles over a floor, under a far light and a near one of another colour.
SCENE = """
[scene]
name = "Small"

[[part]]
name = "body"
shape = "sphere"
subdivisions = 3
material = "tiny/satin-green"

[[part]]
name = "floor"
shape = "plane"
width = 6
depth = 6
translate = [0, -1, 0]
material = "tiny/rough-blue"

[[light]]
name = "sky"
kind = "directional"
direction_to_light = [-0.5, 0.8, 0.6]
spectrum = "D65"
illuminance_lux = 1000

[[light]]
name = "lamp"
kind = "point"
position = [2.4, 2.0, 1.6]
spectrum = "A"
intensity_cd = 1600

[[camera]]
name = "front"
position = [0, 1.0, 6]
target = [0, 0, 0]
vertical_fov_deg = 28
width = 64
height_px = 48
samples = 1

[[camera]]
name = "above"
position = [0, 5.0, 3]
target = [0, 0, 0]
vertical_fov_deg = 28
width = 64
height_px = 48
samples = 1
"""


@pytest.fixture(scope="session")
def display():
    """The name of a display, or a skip that says what the machine lacks."""
    # In a process of its own: a library of the system may be missing, too.
    found = subprocess.run([sys.executable, "-c", "import glfw, imgui_bundle"], capture_output=True, text=True)
    if found.returncode:
        pytest.skip(f"imgui does not load here (it is in the extra `test`): {found.stderr.strip().splitlines()[-1]}")
    if shutil.which("Xvfb") is None:
        pytest.skip("no Xvfb to open windows on: apt-get install xvfb libgl1 libglx-mesa0")
    told, says = os.pipe()
    # Without -noreset every second window fails: the server starts anew as its last one is closed.
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(says), "-screen", "0", "1600x1000x24", "-noreset", "-nolisten", "tcp"],
        pass_fds=(says,),
        stderr=subprocess.DEVNULL,
    )
    os.close(says)
    with os.fdopen(told) as line:
        number = line.readline().strip()
    if not number:
        server.kill()
        pytest.skip("Xvfb does not start here")
    yield f":{number}"
    server.terminate()
    server.wait(10)


@pytest.fixture(scope="session")
def surroundings(display, tmp_path_factory):
    """The environment of a process that opens windows."""
    state = tmp_path_factory.mktemp("state")
    left = {key: value for key, value in os.environ.items() if key not in ("WAYLAND_DISPLAY", "METAMER_CATALOGUE")}
    return left | {
        "DISPLAY": display,
        "XDG_STATE_HOME": str(state),
        "OPENBLAS_NUM_THREADS": "1",
        "LIBGL_ALWAYS_SOFTWARE": "1",
        "PYTHONPATH": os.pathsep.join([str(HARNESS), os.environ.get("PYTHONPATH", "")]),
    }


@pytest.fixture(scope="session")
def small_scene(tmp_path_factory):
    """The file of a scene that is drawn in no time."""
    path = tmp_path_factory.mktemp("scene") / "small.toml"
    path.write_text(SCENE, encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def in_window(surroundings, tiny_catalogue, tmp_path_factory):
    """Runs a file of checks in a window: (file, words, catalogue, more environment) -> results by check."""

    def run(checks, words, catalogue=tiny_catalogue, **more):
        folder = tmp_path_factory.mktemp("window")
        out = folder / "results.json"
        done = subprocess.run(
            [sys.executable, HARNESS / "window_process.py", checks, catalogue, words, out],
            env=surroundings | more,
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=patient(240),
        )
        said = f"{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
        assert out.is_file(), said
        return json.loads(out.read_text("utf-8")), said

    return run
