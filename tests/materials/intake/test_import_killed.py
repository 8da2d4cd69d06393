"""SIGKILL to a process of an import at a random moment: the catalogue opens, verifies, and is completed to the byte."""

import importlib
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.intake.importing import import_sources, prepare_folder
from metamer.materials.records.verification import verify_catalogue
from metamer.runtime.files import half_written, written_whole

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="finds processes in /proc")


@pytest.fixture(scope="module")
def importing():
    return importlib.import_module("metamer.benchmarks.importing")


@pytest.fixture(scope="module")
def harness():
    return importlib.import_module("kills")


@pytest.fixture(scope="module")
def source(importing, tmp_path_factory):
    return importing.generated(tmp_path_factory.mktemp("source"), 3, ("matt",))


@pytest.fixture()
def killed_in_made_folder():
    """Kills a process in `made_folder`, before the first call of `os.replace` or after it; gives the file it left."""

    def run(folder: Path, moment: str) -> Path:
        before = set(folder.iterdir())
        code = (
            "import os, signal, sys; from metamer.runtime.files import made_folder; "
            f"os.{moment} = lambda *_, **__: os.kill(os.getpid(), signal.SIGKILL); made_folder(sys.argv[1])"
        )
        ended = subprocess.run([sys.executable, "-c", code, folder], check=False)
        assert ended.returncode == -signal.SIGKILL
        (left,) = set(folder.iterdir()) - before
        return left

    return run


@pytest.mark.stress
def test_kills_at_random_moments_leave_no_trace(harness, source, tmp_path):
    rows = harness.kills(tmp_path, source, 2, 2, seed=11)
    assert len(rows) == 2 and any(row["hit"] != "nothing" for row in rows)


@pytest.mark.stress
def test_what_a_killed_write_left_is_cleared_away(harness, source, tmp_path):
    """The moment between two bytes of a file is short: what it leaves is put there."""
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    import_sources([source], whole, jobs=1)
    shutil.copytree(whole, killed)
    (killed / "matt" / "c001-matt.h5").unlink()
    for name in ("matt/.c001-matt.0123abcd.h5", ".writable", "..writable.89abcdef", ".catalogue.0011ffee.toml"):
        (killed / name).write_bytes(b"half")
    assert len(half_written(killed)) == 4
    assert not any(Catalogue.open(killed).verify().values())
    assert len(Catalogue.open(killed).ids()) == 2
    again = import_sources([source], killed, jobs=1)
    assert (again.count("imported"), again.count("skipped")) == (1, 2)
    assert harness.contents(killed) == harness.contents(whole)


def test_leftovers_of_an_import_that_is_still_at_work_stay(source, tmp_path):
    """Two imports may write to one catalogue: neither takes the other's unfinished files away."""
    folder = tmp_path / "cat"
    folder.mkdir()
    with written_whole(folder / "half.h5") as half:
        half.write_bytes(b"half")
        assert import_sources([source], folder, jobs=1).count("imported") == 3
        assert half_written(folder) == (half,)
    (folder / ".killed.0123abcd.h5").write_bytes(b"half")
    prepare_folder(folder)
    assert not half_written(folder)


@pytest.mark.parametrize("moment", ["replace", "unlink"])
def test_a_process_killed_while_it_tried_a_folder_leaves_nothing_for_long(killed_in_made_folder, tmp_path, moment):
    """`made_folder` writes a file of its own before any material: verify reports it, the next import clears it away."""
    prepare_folder(tmp_path)
    left = killed_in_made_folder(tmp_path, moment)
    assert verify_catalogue(tmp_path, quick=True, jobs=1).strays == (left,)
    prepare_folder(tmp_path)
    assert not left.exists()


def test_an_import_clears_away_only_what_imports_write(tmp_path):
    others = (".review.0123abcd.json", ".notes.toml", ".writable.h5", ".red.0123abcg.h5")
    for name in others:
        (tmp_path / name).write_bytes(b"somebody's")
    prepare_folder(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {*others, "catalogue.toml"}
    assert [path.name for path in verify_catalogue(tmp_path, quick=True, jobs=1).strays] == [others[0]]
