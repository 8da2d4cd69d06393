"""SIGKILL to a process of an import at a random moment: the catalogue opens, verifies, and is completed to the byte."""

import importlib.util
import sys
from pathlib import Path

import pytest
from metamer.materials.catalogue import Catalogue, import_sources
from metamer.materials.intake.import_folder import unfinished

FILE = Path(__file__).resolve().parents[2] / "benchmarks" / "importing.py"
pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="finds processes in /proc")


@pytest.fixture(scope="module")
def importing():
    spec = importlib.util.spec_from_file_location("importing_benchmark", FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def source(importing, tmp_path_factory):
    return importing.generated(tmp_path_factory.mktemp("source"), 5, ("matt",))


def test_kills_at_random_moments_leave_no_trace(importing, source, tmp_path):
    rows = importing.kills(tmp_path, source, 2, 2, seed=11)
    assert len(rows) == 2 and any(row["hit"] != "nothing" for row in rows)


def test_what_a_killed_write_left_is_cleared_away(importing, source, tmp_path):
    """The moment between two bytes of a file is short: what it leaves is put there."""
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    for catalogue in (whole, killed):
        importing.timed(importing.command(source, catalogue, 2))
    (killed / "matt" / "c003-matt.h5").unlink()
    for name in ("matt/.c003-matt.0123abcd.h5", ".writable", ".writable.89abcdef", ".catalogue.0011ffee.toml"):
        (killed / name).write_bytes(b"half")
    assert len(unfinished(killed)) == 4
    assert not any(Catalogue.open(killed).verify().values())
    assert len(Catalogue.open(killed).ids()) == 4
    said = importing.timed(importing.command(source, killed, 2))["said"]
    assert "1 imported, 4 skipped" in said
    assert importing.contents(killed) == importing.contents(whole)


def test_leftovers_of_an_import_that_is_still_at_work_stay(source, tmp_path):
    """Two imports may write to one catalogue: neither takes the other's unfinished files away."""
    from metamer.materials.intake.import_folder import writing_to

    folder = tmp_path / "cat"
    with writing_to(folder):
        (folder / ".half.0123abcd.h5").write_bytes(b"half")
        assert import_sources([source], folder, jobs=2).count("imported") == 5
        assert unfinished(folder)
    with writing_to(folder):
        assert not unfinished(folder)
