"""Patches on a whole screen, in a process of its own: the codes that come out of the framebuffer, keys, time."""

import json
import subprocess
import sys

import pytest
from patience import patient

pytestmark = pytest.mark.window

# Reads each patch back as it is shown: its middle and a corner; presses a key that a list has for it.
_SHOWING = """
import json, sys
import glfw, moderngl, numpy as np
from metamer.viewer.window.shell.patch_screen import show_patches
codes, keys, options = json.loads(sys.argv[1])
seen = []
def shown(at):
    window, screen = glfw.get_current_context(), moderngl.get_context().screen
    width, height = glfw.get_framebuffer_size(window)
    read = screen.read(viewport=(0, 0, width, height), components=3)
    pixels = np.frombuffer(read, np.uint8).reshape(height, width, 3)
    patch = (pixels == pixels[height // 2, width // 2]).all(axis=2)
    seen.append([at, pixels[height // 2, width // 2].tolist(), pixels[0, 0].tolist(), float(patch.mean())])
    if keys:
        heard = glfw.set_key_callback(window, None)
        glfw.set_key_callback(window, heard)
        heard(window, getattr(glfw, "KEY_" + keys.pop(0)), 0, glfw.PRESS, 0)
count = show_patches(np.array(codes) / 255.0, shown, **options)
print(json.dumps([count, seen]))
"""  # fmt: skip


@pytest.fixture
def showing(surroundings):
    def run(codes, keys=(), **options):
        command = [sys.executable, "-c", _SHOWING, json.dumps([codes, keys, options])]
        done = subprocess.run(command, env=surroundings, capture_output=True, text=True, timeout=patient(60))
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return run


def test_each_code_comes_out_as_it_was_asked_for_and_time_goes_on(showing):
    codes = [[code, 255 - code, (7 * code) % 256] for code in (0, 1, 2, 17, 100, 127, 128, 200, 254, 255)]
    count, seen = showing(codes, seconds=0.01, size=0.25, surround=20 / 255)
    assert count == len(codes) and [at for at, *_ in seen] == list(range(len(codes)))
    assert [middle for _, middle, *_ in seen] == codes
    assert all(corner == [20, 20, 20] and share == pytest.approx(0.25, abs=0.005) for _, _, corner, share in seen)


def test_keys_go_on_and_back_and_end_it(showing):
    count, seen = showing([[9, 9, 9], [8, 8, 8], [7, 7, 7]], keys=["SPACE", "RIGHT", "LEFT", "ESCAPE"])
    assert count == 3 and [at for at, *_ in seen] == [0, 1, 2, 1]
    assert all(share == 1.0 for *_, share in seen)


def test_codes_of_ten_bits_and_another_screen_are_refused(surroundings, tmp_path):
    path = tmp_path / "patches.csv"
    for bits, words, code, says in ((10, (), 4, "more than 8 bits"), (8, ("--screen", "9"), 64, "1 to 1")):
        for more in (("patches", "-n", "9", "--bits", str(bits), "-o", str(path)), ("show", str(path), *words)):
            command = [sys.executable, "-m", "metamer.cli.main", "display", *more]
            done = subprocess.run(command, env=surroundings, capture_output=True, text=True, timeout=patient(60))
        assert done.returncode == code and says in done.stderr


def test_without_a_display_it_says_so(surroundings, tmp_path):
    path = tmp_path / "patches.csv"
    path.write_text("# codes from 0 to 255\npatch,r,g,b\n1,0,0,0\n", encoding="utf-8")
    command = [sys.executable, "-m", "metamer.cli.main", "display", "show", path]
    for display in ("", ":9876"):
        done = subprocess.run(
            command, env=surroundings | {"DISPLAY": display}, capture_output=True, text=True, timeout=patient(60)
        )
        assert done.returncode == 4 and "no window can be opened" in done.stderr and "display measure" in done.stderr
