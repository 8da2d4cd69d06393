"""The harness that kills `metamer report` while it writes, at work: one kill. More: baseline_kills.py."""

import importlib
import sys

import pytest
from metamer.runtime.errors import InputError

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="finds processes in /proc")


@pytest.fixture(scope="module")
def harness():
    return importlib.import_module("baseline_kills")


@pytest.fixture(scope="module")
def place(harness, tmp_path_factory):
    return harness.Place(tmp_path_factory.mktemp("kills"))


@pytest.mark.stress
def test_a_kill_leaves_a_whole_baseline_and_the_next_run_ends_in_the_same_bytes(harness, place):
    expected, seconds = harness.undisturbed(place, "baseline")
    found = harness.killed(place, "baseline", 0.7 * seconds, expected)
    assert not found["wrong"] and found["left"] in ("old", "new")


@pytest.mark.slow
def test_a_baseline_that_is_damaged_is_seen(harness, place, monkeypatch):
    place.restore(with_run=True)
    place.done(place.words("accept"))
    expected = place.state()
    code = f"import pathlib; next(pathlib.Path({str(place.baseline)!r}, 'pixels').iterdir()).write_bytes(b'half')"
    monkeypatch.setattr(harness.Place, "words", lambda *_: [sys.executable, "-c", code])
    with pytest.raises(InputError, match="damaged"):
        harness.killed(place, "accept", 2.0, expected)
