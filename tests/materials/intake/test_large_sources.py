"""Sources that are larger than memory: they stay in their files from the plan to the record."""

import os
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.formats import registry
from metamer.materials.intake import import_history
from metamer.materials.intake.import_plan import Settings, planned
from metamer.materials.intake.importing import import_sources
from metamer.materials.intake.inputs import inputs_of
from metamer.materials.intake.sources import read_sources
from metamer.materials.records.models import MEASURED
from metamer.materials.records.record import material_path
from metamer.materials.records.source import MaterialSource
from metamer.materials.records.stored_array import StoredArray
from metamer.materials.records.verification import verify_catalogue
from metamer.runtime.files import half_written
from patience import patient

HERE = Path(__file__).parent
# Texels and pairs of directions: 0.3 MB, and what does not fit beside what Python and its libraries take.
SMALL, LARGE = (8, 4, 300), (48, 64, 1641)
# Bytes of numbers that a process may hold: its libraries take 200 to 250 MB of them, LARGE would take 161 MB more.
LIMIT = 340_000_000


@pytest.fixture
def stacks(monkeypatch, tmp_path):
    """The format, known while a test lasts, and a small stack that has been at rest for an hour."""
    monkeypatch.syspath_prepend(str(HERE))
    monkeypatch.setattr(registry, "FORMATS", registry.FORMATS)
    monkeypatch.setitem(MEASURED, "stack_mean", None)
    monkeypatch.setitem(sys.modules, "metamer.materials.formats.stack", None)
    import stack_format

    stack_format.register()
    (tmp_path / "scans").mkdir()
    at_rest(stack_format.written(tmp_path / "scans" / "wool.npy", SMALL))
    yield stack_format
    registry.formats.cache_clear()


def at_rest(path):
    os.utime(path, (time.time() - 3600,) * 2)
    return path


def under_a_limit(*words):
    """What a Python that may hold `LIMIT` bytes says, and all that it starts."""
    resource = pytest.importorskip("resource")
    if not sys.platform.startswith("linux"):
        pytest.skip("RLIMIT_DATA counts what is mapped on Linux alone")
    code = "import sys; sys.path.insert(0, sys.argv[1]); import stack_format; stack_format.import_one(*sys.argv[2:])"
    return subprocess.run(
        [sys.executable, "-c", code, str(HERE), *map(str, words)],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (LIMIT, LIMIT)),
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=patient(300),
    )


@pytest.mark.slow
def test_an_import_of_more_than_memory_holds(stacks, tmp_path):
    """Plan, fit in a process of its own, record, a second import, `verify` and a look: under a limit that breaks where
    the array is taken into memory anywhere, as the same reader does under another name."""
    stack = stacks.written(tmp_path / "large.npy", LARGE)
    ended = under_a_limit(stack, tmp_path / "cat")
    assert ended.returncode == 0, ended
    assert ended.stdout.splitlines() == ["1 imported", "1 skipped", "intact", str(LARGE)], ended
    assert material_path(tmp_path / "cat", "stacks/large").stat().st_size < 200_000
    copied = under_a_limit(stack, tmp_path / "copies", "copy")
    assert copied.stdout.splitlines() == ended.stdout.splitlines(), copied
    stack.rename(tmp_path / f"{stacks.WHOLE}.npy")
    whole = under_a_limit(tmp_path / f"{stacks.WHOLE}.npy", tmp_path / "other")
    assert "imported" not in whole.stdout and "MemoryError" in whole.stdout + whole.stderr, whole


def test_a_handle_is_hashed_as_the_array_that_it_stands_for(stacks, tmp_path):
    path = tmp_path / "scans" / "wool.npy"
    (source,) = read_sources(path)
    whole = MaterialSource(**vars(source) | {"parameters": {"stack": np.load(path)}})
    sealed, content = source.sealed()
    assert content == source.content_hash == whole.content_hash == sealed.content_hash
    assert (source.size, source.stored, whole.stored) == (16, whole.size - 16, 0)
    assert isinstance(sealed, stacks.StackSource) and sealed.parameters["stack"].digests
    assert whole.sealed()[0] is whole


@pytest.mark.slow
@pytest.mark.parametrize(("copy", "apart"), [(False, True), (True, False)])
def test_it_stays_where_it_is_or_is_copied_when_asked(stacks, tmp_path, copy, apart):
    path, catalogue = tmp_path / "scans" / "wool.npy", tmp_path / "cat"
    said = []
    report = import_sources([path], catalogue, jobs=1, apart=apart, copy=copy)
    assert report.count("imported") == 1, report
    found = Catalogue.open(catalogue)["stacks/wool"]
    stack = found.parameters["stack"]
    assert isinstance(stack, StoredArray) and np.array_equal(stack, np.load(path))
    assert stack.file == (material_path(catalogue, found.id) if copy else path)
    assert not verify_catalogue(catalogue, jobs=1).damaged and found.lab().shape == (3,)
    # Again: from what is known, and from the files.
    for _ in range(2):
        again = import_sources([path], catalogue, jobs=1, copy=copy, doing=lambda name, doing: said.append(doing))
        assert again.count("skipped") == 1 and not said
        # Files that are only just written are not taken for known.
        (catalogue / ".import.known").unlink(missing_ok=True)
    before = material_path(catalogue, found.id).read_bytes()
    import_sources([path], tmp_path / "other", jobs=1, apart=True, copy=copy)
    assert material_path(tmp_path / "other", found.id).read_bytes() == before
    # Asked for otherwise, it is another record.
    assert import_sources([path], catalogue, jobs=1, copy=not copy, dry_run=True).count("new") == 1


def test_out_of_an_archive_it_is_copied(stacks, tmp_path):
    path = tmp_path / "scans" / "wool.npy"
    with zipfile.ZipFile(tmp_path / "all.zip", "w") as archive:
        archive.write(path, "wool.npy")
    import_sources([tmp_path / "all.zip"], tmp_path / "cat", jobs=1)
    stack = Catalogue.open(tmp_path / "cat")["stacks/wool"].parameters["stack"]
    assert stack.file.suffix == ".h5" and np.array_equal(stack, np.load(path))


@pytest.mark.parametrize("apart", [False, True])
def test_a_file_that_changes_between_plan_and_work_is_refused_by_name(stacks, tmp_path, apart):
    path = tmp_path / "scans" / "wool.npy"

    def changes(pending, jobs):
        data = bytearray(path.read_bytes())
        data[-1] ^= 1
        path.write_bytes(data)

    (one,) = import_sources([path], tmp_path / "cat", jobs=1, apart=apart, begins=changes).outcomes
    assert one.status == "failed" and "wool.npy" in one.reason and "not what it was" in one.reason
    assert not Catalogue.open(tmp_path / "cat").ids() and not half_written(tmp_path / "cat")


def test_a_smaller_material_that_is_read_again_and_is_another_is_refused(stacks, tmp_path):
    """As tables of a few MB are, which are not kept from plan to work."""
    path = stacks.written(tmp_path / f"{stacks.WHOLE}.npy", SMALL)

    def changes(pending, jobs):
        stacks.written(path, SMALL, seed=1)

    (one,) = import_sources([path], tmp_path / "cat", jobs=1, begins=changes).outcomes
    assert one.status == "failed" and "has changed since the import began" in one.reason


def test_damage_in_a_copy_is_noticed_by_the_next_import(stacks, tmp_path):
    path, catalogue = tmp_path / "scans" / "wool.npy", tmp_path / "cat"
    import_sources([path], catalogue, jobs=1, copy=True)
    stored = material_path(catalogue, "stacks/wool")
    import h5py

    with h5py.File(stored, "r+") as file:
        file["parameters/stack/values"][3, 1, 5, 2] = 0.125
    (bad,) = verify_catalogue(catalogue, quick=True, jobs=1).damaged
    assert "wool.h5" in str(bad.problem)
    assert import_sources([path], catalogue, jobs=1, copy=True).count("imported") == 1
    assert not verify_catalogue(catalogue, jobs=1).damaged


def test_a_file_that_has_moved_is_imported_from_where_it_is(stacks, tmp_path, monkeypatch):
    path, catalogue = tmp_path / "scans" / "wool.npy", tmp_path / "cat"
    # Known files count at once, as they do two seconds later.
    monkeypatch.setattr(import_history, "_TICK_NS", -1_000_000_000)
    import_sources([path], catalogue, jobs=1)
    assert import_sources([path], catalogue, jobs=1).count("skipped") == 1
    elsewhere = at_rest(path.rename(tmp_path / "wool.npy"))
    assert import_sources([elsewhere], catalogue, jobs=1).count("imported") == 1
    assert Catalogue.open(catalogue)["stacks/wool"].parameters["stack"].file == elsewhere


def test_a_file_that_cannot_be_read_to_its_end_costs_that_material_alone(stacks, tmp_path):
    path = stacks.written(tmp_path / "scans" / "cut.npy", SMALL)
    os.truncate(path, path.stat().st_size - 100)
    with inputs_of([tmp_path / "scans"]) as files:
        found = planned(files, tmp_path / "cat", Settings(0.5, "mallett-yuksel"))
    assert [(file.materials[0].id, file.materials[0].status) for file in found] == [
        ("stacks/cut", "failed"),
        ("stacks/wool", "new"),
    ]
    assert "cut.npy" in found[0].materials[0].reason and "shorter than its array" in found[0].materials[0].reason


@pytest.mark.slow
@pytest.mark.parametrize("signal_name", ["SIGKILL", "SIGINT"])
def test_who_is_ended_while_it_copies_leaves_no_half(stacks, tmp_path, signal_name):
    """Both in a script of one's own: the command's Ctrl-C takes the same way as SIGTERM, without an exception."""
    path = stacks.written(tmp_path / "large.npy", (8, 64, 1641))
    # In the background of a shell, SIGINT is ignored from the start.
    code = (
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
        "sys.path.insert(0, sys.argv[1]); import stack_format; stack_format.import_one(*sys.argv[2:])"
    )
    folder = tmp_path / "cat" / "stacks"
    running = subprocess.Popen(
        [sys.executable, "-c", code, str(HERE), str(path), str(tmp_path / "cat"), "copy"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    ends = time.monotonic() + patient(120)
    while not any(stray.stat().st_size > 1_000_000 for stray in folder.glob(".large.*.h5")):
        assert running.poll() is None and time.monotonic() < ends, running.communicate()
        time.sleep(0.02)
    # Python forgets an exception in a weak reference's callback: then one presses Ctrl-C again.
    while running.poll() is None:
        running.send_signal(getattr(signal, signal_name))
        time.sleep(0.3)
    _, said = running.communicate(timeout=patient(60))
    assert running.returncode and not material_path(tmp_path / "cat", "stacks/large").exists(), said
    assert len(half_written(tmp_path / "cat")) == (signal_name == "SIGKILL"), said
    assert signal_name == "SIGKILL" or "ImportInterrupted" in said
    assert import_sources([path], tmp_path / "cat", jobs=1, copy=True).count("imported") == 1
    assert not half_written(tmp_path / "cat") and not verify_catalogue(tmp_path / "cat", jobs=1).damaged
