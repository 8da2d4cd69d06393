"""`assert_colour_close` by itself and as pytest's fixture: what fails leaves evidence."""

import json
import os
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from metamer.calibration.regression.assertions import assert_colour_close
from metamer.runtime.errors import ComparisonError, InputError
from metamer.spectral.formats.exr import read_exr

WHITE = np.array([0.9505, 1.0, 1.089])
GREY = np.full((8, 8, 3), 0.5) * WHITE

TESTS = """
import numpy as np
WHITE = np.array([0.9505, 1.0, 1.089])

def test_close(assert_colour_close):
    assert assert_colour_close((0.5 * WHITE, WHITE), (0.5001 * WHITE, WHITE)).exit_code == 0

def test_far(assert_colour_close):
    assert_colour_close((0.5 * WHITE, WHITE), (0.6 * WHITE, WHITE), [{"statistic": "max", "warn": 1, "fail": 2}])
"""


def test_close_passes_and_gives_the_result():
    found = assert_colour_close((GREY, WHITE), (GREY * 1.0001, WHITE))
    assert found.tier == "pass" and 0 < found.rows[0].layers["picture"].mean < 0.01


def test_far_fails_and_leaves_evidence(tmp_path):
    far = GREY.copy()
    far[3, 2] *= 1.5
    with pytest.raises(AssertionError, match="colours are not close") as failed:
        assert_colour_close((GREY, WHITE), (far, WHITE), evidence=tmp_path / "evidence")
    assert "1 of 1 picture moved: 1 clearly" in str(failed.value)
    delta_e = read_exr(tmp_path / "evidence" / "delta-e94.exr")[1]["deltaE94"]
    assert np.unravel_index(delta_e.argmax(), delta_e.shape) == (3, 2)
    figures = json.loads((tmp_path / "evidence" / "regression.json").read_text(encoding="utf-8"))
    assert figures["results"][0]["layers"]["picture"]["worst_pixel"]["row"] == 3
    assert {path.name for path in (tmp_path / "evidence").iterdir()} == {
        "delta-e94.exr",
        "index.html",
        "reference.exr",
        "regression.json",
        "sample.exr",
    }


def test_far_fails_though_there_is_no_room_for_evidence(tmp_path, room_for):
    with room_for(1000), pytest.raises(AssertionError, match="not close") as failed:
        assert_colour_close((GREY, WHITE), (1.2 * GREY, WHITE), evidence=tmp_path / "evidence")
    assert "Evidence could not be written" in str(failed.value) and "no room" in str(failed.value)
    assert list((tmp_path / "evidence").iterdir()) == []


def test_what_a_renderer_gives_is_taken():
    picture = SimpleNamespace(xyz=GREY.astype(np.float32), white=WHITE, coverage=np.ones((8, 8)))
    other = SimpleNamespace(xyz=GREY.astype(np.float32), white=WHITE, coverage=np.ones((8, 8)))
    assert assert_colour_close(picture, other).identical
    with pytest.raises(ComparisonError, match="same array"):
        assert_colour_close(picture, picture)


def test_a_file_is_held_against_what_is_in_memory(tmp_path):
    from metamer.spectral.formats.xyz_exr import write_xyz_exr
    from metamer.spectral.image import ColourImage

    write_xyz_exr(tmp_path / "reference.exr", ColourImage(GREY, "xyz", WHITE))
    assert assert_colour_close(tmp_path / "reference.exr", (GREY * 1.0001, WHITE)).exit_code == 0


def test_shapes_that_are_no_colours_are_refused():
    with pytest.raises(InputError, match="not colours and their white"):
        assert_colour_close((GREY[..., :2], WHITE), (GREY, WHITE))


@pytest.mark.slow
def test_the_fixture_keeps_evidence_a_folder_a_test(tmp_path):
    (tmp_path / "test_colour.py").write_text(TESTS, encoding="utf-8")
    # Loaded here by its name, wherever Metamer's own entry point is installed or not.
    plugin = ["-p", "no:metamer", "-p", "metamer.calibration.regression.pytest_plugin", "-p", "no:cacheprovider"]
    words = [sys.executable, "-m", "pytest", "-q", *plugin, "--colour-evidence", "kept", "test_colour.py"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, env={**os.environ, "PYTEST_ADDOPTS": ""})
    assert done.returncode == 1 and "1 failed, 1 passed" in done.stdout, done.stdout + done.stderr
    assert "colours are not close" in done.stdout and "assertions.py" not in done.stdout.partition("short test")[0]
    (folder,) = (tmp_path / "kept").iterdir()
    assert folder.name == "test_colour.py-test_far" and (folder / "index.html").is_file()
