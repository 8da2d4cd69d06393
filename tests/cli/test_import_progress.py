"""Progress that an import shows while it works, on a terminal and elsewhere."""

import io
import subprocess
import sys
from contextlib import ExitStack
from types import SimpleNamespace

import pytest
from metamer.cli.progress import imports as import_progress
from metamer.cli.progress import lines as progress
from metamer.cli.progress.imports import BarImport, PlainImport, import_shown
from metamer.cli.progress.lines import Ticker, next_pause
from metamer.materials.intake.import_cost import Jobs
from metamer.materials.intake.import_plan import PlannedFile, PlannedMaterial
from metamer.materials.intake.importing import ImportOutcome
from metamer.materials.intake.progress import Doing
from metamer.runtime import progress as estimate
from patience import patient

PENDING = [PlannedMaterial("measured/gold", "new", model="merl"), PlannedMaterial("paint/red", "new", model="lambert")]


@pytest.fixture
def clock(monkeypatch):
    """Time that stands still until it is moved."""
    now = [100.0]
    for module in (progress, import_progress, estimate):
        monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: now[0]))
    return now


@pytest.fixture
def plain(clock, monkeypatch, capsys):
    monkeypatch.setattr(Ticker, "__enter__", lambda self: self)
    with ExitStack() as stack:
        yield PlainImport(stack, ["scans", "a\x1b[31m.brdf"])


def test_the_first_line_comes_before_anything_heavy_is_loaded():
    """And says what is looked at."""
    script = (
        "import sys\n"
        "from contextlib import ExitStack\n"
        "from metamer.cli.progress.imports import import_shown\n"
        "with ExitStack() as stack:\n"
        "    import_shown(stack, ['scans'])\n"
        "    print(*{'numpy', 'scipy', 'colour', 'h5py', 'metamer.materials.intake.importing'} & set(sys.modules))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=patient(120))
    assert done.stderr == "looking at scans\n" and done.stdout.strip() == ""


def test_lines_say_what_is_looked_at_and_how_long(plain, clock):
    clock[0] += 3.0
    assert plain.line() == "looking at scans, a\\x1b[31m.brdf: 3 s so far"
    plain.looked_at(19, 200, PlannedFile("x.csv", ""))
    # Too little is done to tell.
    assert plain.line() == "looked at 19 of 200 files"


def test_a_slow_first_file_says_little_of_the_others(plain, clock):
    for done in range(1, 51):
        clock[0] += 20.0 if done == 1 else 0.1
        plain.looked_at(done, 200, PlannedFile("x.csv", ""))
    assert plain.line() == "looked at 50 of 200 files, about 15 s left"


def test_fits_are_expected_of_files_that_are_not_looked_at_yet(plain, clock):
    for done in range(1, 11):
        clock[0] += 0.2
        new = (PlannedMaterial(f"paint/{done}", "new", model="coated_diffuse"),)
        plain.looked_at(done, 40, PlannedFile(f"{done}.toml", "family", new))
    # 30 files to look at; of their fits, which take longest, nothing is known.
    assert plain.line() == "looked at 10 of 40 files"
    for done in range(11, 41):
        clock[0] += 0.2
        plain.looked_at(done, 40, PlannedFile(f"{done}.csv", ""))
    assert plain.line() == "looked at 40 of 40 files, about 20 s left"


def test_a_large_file_is_one_line_and_then_how_far_it_is(plain, clock, capsys):
    for phase in ("reading 6.9 GB, about 7 s", "hashing, 0.5 GB of 6.9 GB", "hashing, 1 GB of 6.9 GB"):
        plain.doing("big.npy", Doing(phase))
    assert capsys.readouterr().err.splitlines()[1:] == ["reading 6.9 GB, about 7 s: big.npy"]
    clock[0] += 3.0
    assert plain.line().endswith("3 s so far; hashing, 1 GB of 6.9 GB: big.npy")
    plain.looked_at(1, 2, PlannedFile("big.npy", ""))
    assert plain.line() == "looked at 1 of 2 files, about 3 s left"


def test_lines_say_what_each_process_is_at(plain, clock, capsys):
    plain.begins(PENDING, Jobs(2))
    # Nothing is known yet of how long that takes here.
    assert capsys.readouterr().err.endswith("fitting 2 materials in 2 processes\n")
    assert plain.line() == ""
    plain.doing("measured/gold", Doing("reading"))
    plain.doing("paint/red", Doing("tabulating"))
    assert capsys.readouterr().err == "fitting measured/gold\n"
    clock[0] += 20.0
    plain.doing("measured/gold", Doing("12 terms in hd, p99 0.83", 0.5))
    plain.progress(1, 2, ImportOutcome("paint/red", "imported", seconds=1.0))
    assert plain.line() == (
        "1 of 2 materials done, about 20 s left; at measured/gold (12 terms in hd, p99 0.83, 20 s so far)"
    )
    said = capsys.readouterr()
    assert said.out == "[1/2] imported paint/red\n"


def test_a_file_that_takes_long_to_read_is_told_of_at_once(plain, capsys):
    plain.doing("scans/big\x1b.csv", Doing("reading 0.2 GB, about 3 min"))
    assert "reading 0.2 GB, about 3 min: scans/big\\x1b.csv\n" in capsys.readouterr().err


def test_fewer_processes_than_cores_are_explained(plain, capsys):
    plain.begins(PENDING, Jobs(1, "1 at a time instead of 8: a fit takes up to 2 GB, and 3 GB are free"))
    assert "1 at a time instead of 8" in capsys.readouterr().err


def test_what_is_there_already_gets_no_line(plain, capsys):
    plain.progress(1, 2, ImportOutcome("paint/red", "skipped"))
    assert capsys.readouterr().out == ""


def test_a_terminal_shows_bars_with_phases_and_the_time_left(monkeypatch):
    from rich.console import Console

    screen = io.StringIO()
    monkeypatch.setattr(
        "rich.console.Console", lambda file: Console(file=screen, force_terminal=True, width=120, color_system=None)
    )
    with ExitStack() as stack:
        bars = BarImport(stack, ["scans"])
        bars.looked_at(1, 2, PlannedFile("deep/chart.csv", ""))
        bars._bars.refresh()
        bars.begins(PENDING, Jobs(2))
        bars.doing("measured/gold", Doing("12 terms in hd, p99 0.83", 0.4))
        bars.doing("paint/red", Doing("tabulating"))
        bars._bars.refresh()
        bars.progress(1, 2, ImportOutcome("paint/red", "imported", seconds=1.0))
        bars._bars.refresh()
    shown = screen.getvalue()
    for words in ("looking at chart.csv", "1/2", "measured/gold: 12 terms in hd, p99 0.83", "left", "tabulating"):
        assert words in shown, words


@pytest.mark.parametrize("terminal", [True, False])
def test_bars_are_for_terminals(monkeypatch, terminal):
    monkeypatch.setattr(import_progress, "shows_bars", lambda stream: terminal and stream is sys.stderr)
    with ExitStack() as stack:
        assert isinstance(import_shown(stack, ["scans"]), BarImport if terminal else PlainImport)


def test_lines_come_at_once_then_ever_fewer():
    pauses, elapsed = [], 0.0
    while elapsed < 3600.0:
        pauses.append(next_pause(elapsed))
        elapsed += pauses[-1]
    assert pauses[0] == 1.0 and pauses[-1] == 60.0 and sorted(pauses) == pauses and len(pauses) < 75


def test_a_ticker_says_its_line_and_no_more_once_it_is_left(monkeypatch, capsys):
    waits = iter([False, False, True])
    with Ticker(lambda: "still at it") as ticker:
        ticker._ended.set()
        ticker._thread.join()
        monkeypatch.setattr(ticker, "_ended", SimpleNamespace(wait=lambda pause: next(waits), set=lambda: None))
        ticker._last -= 100.0
        ticker._run()
    # The second time, the first had only just been said.
    assert capsys.readouterr().err == "still at it\n"
