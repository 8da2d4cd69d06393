"""BTFs whose import is disturbed, or is run on another processor: the same material in the end, or a word why not."""

import os
import platform
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from btf_cloths import SAID, cloth, error_of, imported, refused, saved
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.intake.importing import import_sources
from metamer.materials.records.verification import verify_catalogue

# Imports as a program of its own does; ends itself by SIGKILL in the middle of what is named.
_PROGRAM = """
import os, signal, sys
from pathlib import Path
from metamer.materials.intake.importing import import_sources
from metamer.spectral.formats.import_options import ImportOptions

source, catalogue, moment = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
if moment == "fit":
    from metamer.materials.btf import form
    form.btf_form = lambda *_, **__: os.kill(os.getpid(), signal.SIGKILL)
if moment == "write":
    os.replace = lambda *_, **__: os.kill(os.getpid(), signal.SIGKILL)
report = import_sources([source], catalogue, jobs=1, answer=ImportOptions(encoding="srgb", white=(1.0,)))
assert report.count("imported") == 1, report.outcomes
"""


def program(source, catalogue, moment="", **more):
    return subprocess.run(
        [sys.executable, "-c", _PROGRAM, str(source), str(catalogue), moment],
        env=os.environ | more,
        capture_output=True,
        text=True,
        check=False,
    )


def contents(catalogue: Path):
    return {path.relative_to(catalogue): path.read_bytes() for path in sorted(catalogue.rglob("*.h5"))}


@pytest.fixture(scope="module")
def wool(tmp_path_factory):
    """81 images of 8 x 8."""
    return saved(tmp_path_factory.mktemp("sets") / "wool", cloth())


@pytest.fixture(scope="module")
def whole(wool, tmp_path_factory):
    """A catalogue that nobody disturbed."""
    folder = tmp_path_factory.mktemp("whole") / "cat"
    assert program(wool, folder).returncode == 0
    return folder


@pytest.mark.stress
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="SIGKILL")
@pytest.mark.parametrize("moment", ["fit", "write"])
def test_an_import_that_was_killed_goes_on_to_the_same_bytes(wool, whole, tmp_path, moment):
    killed = program(wool, tmp_path / "cat", moment)
    assert killed.returncode == -signal.SIGKILL, killed.stderr
    assert not contents(tmp_path / "cat").keys() & contents(whole).keys()
    assert import_sources([wool], tmp_path / "cat", jobs=1, answer=SAID).count("imported") == 1
    assert contents(tmp_path / "cat") == contents(whole)
    assert not verify_catalogue(tmp_path / "cat", jobs=1).damaged


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="processors of x86")
def test_a_seed_is_the_same_error_on_another_processor(wool, whole, tmp_path):
    run = program(wool, tmp_path / "cat", OPENBLAS_CORETYPE="Prescott")
    assert run.returncode == 0, run.stderr
    here, there = (Catalogue.open(folder) for folder in (whole, tmp_path / "cat"))
    (name,) = there.ids()
    assert error_of(here[name]) == pytest.approx(error_of(there[name]), abs=0.02)


def test_an_image_that_goes_between_plan_and_work_is_named(tmp_path):
    folder = saved(tmp_path / "wool", cloth())
    gone = sorted(folder.iterdir())[30]
    report = import_sources([folder], tmp_path / "cat", jobs=1, answer=SAID, begins=lambda pending, jobs: gone.unlink())
    (one,) = report.outcomes
    assert one.status == "failed" and gone.name in str(one.reason)
    # The import goes on once the image is back.
    saved(folder, cloth())
    assert error_of(imported(folder, tmp_path / "cat")) < 0.8


def test_an_image_that_is_cut_short_between_plan_and_work_is_named(tmp_path):
    folder = saved(tmp_path / "wool", cloth())
    cut = sorted(folder.iterdir())[30]
    report = import_sources(
        [folder],
        tmp_path / "cat",
        jobs=1,
        answer=SAID,
        begins=lambda pending, jobs: cut.write_bytes(cut.read_bytes()[:-30]),
    )
    (one,) = report.outcomes
    assert one.status == "failed" and cut.name in str(one.reason)


def test_images_that_were_all_cut_short_before_are_named(tmp_path):
    folder = saved(tmp_path / "wool", cloth())
    for path in folder.iterdir():
        path.write_bytes(path.read_bytes()[:40])
    reason = str(refused(folder, tmp_path / "cat"))
    assert np.any([path.name in reason for path in folder.iterdir()])
