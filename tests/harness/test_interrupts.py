"""The harness of interrupts at work: one of each signal, and that it finds what it looks for."""

import importlib
import sys

import pytest

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="finds processes in /proc")
ENDS = ("right", "early", "late")


@pytest.fixture(scope="module")
def interrupts():
    interrupts = importlib.import_module("interrupts")
    interrupts.not_deaf()
    return interrupts


@pytest.fixture(scope="module")
def place(interrupts, tmp_path_factory):
    return interrupts.Workplace(tmp_path_factory.mktemp("interrupts"))


@pytest.mark.stress
@pytest.mark.parametrize(
    ("name", "kind"), [("fit", "SIGTERM"), ("review", "SIGTERM"), ("import", "SIGINT"), ("build", "SIGINT")]
)
def test_a_signal_ends_a_command_as_it_should(interrupts, place, name, kind, monkeypatch):
    # Shared memory is the whole machine's: other tests, beside this one, have theirs.
    monkeypatch.setattr(interrupts, "_shared_memory", set)
    found = interrupts.hit(place, name, kind, 0.6)
    assert found.verdict in ENDS, found


@pytest.mark.slow
def test_what_is_wrong_is_seen(interrupts, place, monkeypatch):
    """A command that knows nothing of signals, leaves a temporary file, and says a traceback."""
    code = "import pathlib, os; pathlib.Path(os.environ['TMPDIR'], 'left').mkdir(); print(1, flush=True); import time; "
    code += "time.sleep(20)"
    monkeypatch.setattr(interrupts.Workplace, "words", lambda *_: [sys.executable, "-c", code])
    monkeypatch.setattr(interrupts, "_listens", lambda _: True)
    for kind in ("SIGINT", "SIGTERM"):
        assert interrupts.hit(place, "fit", kind, 0.5).verdict not in ENDS


@pytest.mark.stress
def test_a_command_that_is_deaf_is_not_taken_for_one_that_was_done(interrupts, place, monkeypatch):
    code = "import signal, time; signal.signal(signal.SIGINT, signal.SIG_IGN); time.sleep(2)"
    monkeypatch.setattr(interrupts.Workplace, "words", lambda *_: [sys.executable, "-c", code])
    assert interrupts.hit(place, "fit", "SIGINT", 0.5).verdict.startswith("unheard")
