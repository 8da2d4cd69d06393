"""Damaged files of every format, a few of each: refused by an InputError, or read. More: fuzz.py."""

import importlib
import random
import signal
import sys
import time

import pytest
from metamer.materials.formats import registry as material_formats
from metamer.spectral.formats import registry as spectral_formats

pytestmark = pytest.mark.stress

# Files of each; these readers take a second for one that is still good, or start a process for each.
FEW = {"mat": 2, "cornell": 8, "merl": 12}
READERS = (*spectral_formats.FORMATS, *(name for name in material_formats.FORMATS if name != "spectra"))


@pytest.fixture(scope="module")
def fuzz():
    pytest.importorskip("resource", reason="limits of memory and time are those of Unix")
    return importlib.import_module("fuzz")


@pytest.fixture(scope="module")
def files(fuzz):
    return fuzz.seeds()


def test_every_reader_has_files_to_damage(fuzz, files):
    assert set(fuzz.readers()) == set(READERS) == set(files)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("reader", READERS)
def test_damaged_files_are_refused_or_read(fuzz, files, tmp_path, reader, capfd):
    outcomes = []
    for number in range(FEW.get(reader, 60)):
        name, content = fuzz.made(reader, 3, number, files[reader])
        (tmp_path / name).write_bytes(content)
        outcomes.append(fuzz.read(reader, tmp_path / name))
        (tmp_path / name).unlink()
    assert outcomes[0] == ("refused" if reader == "unreadable" else "read")
    assert set(outcomes) <= set(fuzz.GOOD)


def test_the_same_number_is_the_same_file(fuzz, files):
    assert fuzz.made("csv", 1, 5, files["csv"]) == fuzz.made("csv", 1, 5, files["csv"])
    assert len({fuzz.made("csv", 1, number, files["csv"]) for number in range(50)}) > 45


def test_damage_never_breaks_down_itself(fuzz):
    rng = random.Random(1)
    for content in (b"", b"\0", b"a,b\n1,2\n" * 40):
        for _ in range(300):
            assert isinstance(fuzz.damaged(content, [b"", b"other"], rng), bytes)


def test_failures_of_a_reader_are_found(fuzz, tmp_path, monkeypatch):
    """An exception of another kind is told with its place, and its file is kept; a process that dies is, too."""
    told = [
        (0, "read", "", 0.0),
        (1, "KeyError", 'File "x.py", line 3\n    KeyError: 1', 0.1),
        (2, "crash", "-11", 0.0),
    ]
    monkeypatch.setattr(fuzz, "fuzzed", lambda *_: iter(told))
    row = fuzz.report("csv", 1, 3, {"a.csv": b"1"}, tmp_path / "kept")
    assert row["outcomes"] == {"read": 1, "KeyError": 1, "crash": 1}
    assert [failure["number"] for failure in row["failures"].values()] == [1, 2]
    assert len(list((tmp_path / "kept").iterdir())) == 2


@pytest.mark.parametrize(("works", "outcome"), [(True, "too long"), (False, "read")])
def test_the_limit_is_of_the_processor_and_not_of_the_clock(fuzz, tmp_path, monkeypatch, works, outcome):
    """A busy machine makes no file too long: what waits is not stopped, and what works is."""

    def read(*_):
        begin = time.monotonic()
        while time.monotonic() - begin < (30.0 if works else 0.2):
            time.sleep(0.0 if works else 0.05)
        return "read"

    monkeypatch.setattr(fuzz, "read", read)
    monkeypatch.setattr(fuzz, "SECONDS_A_FILE", 0.05)
    before = signal.signal(signal.SIGPROF, fuzz.too_long)
    try:
        assert fuzz._one("csv", tmp_path, "a.csv", b"1")[0] == outcome
    finally:
        signal.signal(signal.SIGPROF, before)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of memory are those of Linux")
def test_a_reader_in_a_process_of_its_own(fuzz, files):
    row = fuzz.report("spd", 1, 20, files["spd"])
    assert sum(row["outcomes"].values()) == 20 and not row["failures"]
