"""`metamer fit`: its table, its bar, its JSON, its exit codes."""

import json
import subprocess
import sys
from typing import ClassVar

import pytest
from metamer.cli import fit as command
from metamer.cli.main import main
from metamer.cli.progress import fit as fit_progress
from metamer.materials.fitting import fit as engine
from patience import patient


def test_trials_are_shown_and_the_choice_is_explained(tiny_catalogue, tmp_path, capsys):
    out = tmp_path / "fit.json"
    words = ["fit", "tiny/satin-green", "--catalogue", str(tiny_catalogue), "--budget", "1.5", "--json", str(out)]
    assert main(words) == 0
    text = capsys.readouterr().out
    assert "lobe 1 io" in text and "lobe 2 hd" in text
    assert "Together" in text
    assert "Storage: half" in text
    assert "Stopped: budget met." in text
    found = json.loads(out.read_text(encoding="utf-8"))
    assert found["met"] is True
    assert found["rank"] == sum(pack["rank"] for pack in found["packs"])
    assert found["trials"][0]["error"]["p99"] > 0
    assert {pack["precision"] for pack in found["packs"]} == {"half"}


@pytest.mark.slow
def test_a_budget_out_of_reach_is_said_and_warned_of(tiny_catalogue, capsys, monkeypatch):
    monkeypatch.setattr(engine, "RANKS", (1, 2))
    words = ["fit", "tiny/matt-red", "--catalogue", str(tiny_catalogue), "--budget", "1e-9"]
    assert main(words) == 1
    out = capsys.readouterr().out
    assert "not met, as exit code 1 says: none left to try" in out


def test_a_rank_and_a_frame_can_be_given(tiny_catalogue, capsys):
    words = ["fit", "tiny/matt-red", "--catalogue", str(tiny_catalogue), "--rank", "2", "--frame", "io"]
    assert main(words) == 0
    assert "Together 2 terms (2 in io)" in capsys.readouterr().out


@pytest.mark.parametrize("method", ["weighted", "incremental", "refitted"])
def test_the_paper_s_methods_and_smoothing_are_options(tiny_catalogue, capsys, method):
    words = ["fit", "tiny/matt-red", "--catalogue", str(tiny_catalogue), "--rank", "4", "--method", method, "--smooth"]
    assert main(words) == 0
    assert "Together 4 terms" in capsys.readouterr().out


@pytest.mark.parametrize("rank", ["0", "257", "٣"])
def test_a_rank_that_is_none(tiny_catalogue, capsys, rank):
    with pytest.raises(SystemExit) as ended:
        main(["fit", "tiny/matt-red", "--catalogue", str(tiny_catalogue), "--rank", rank])
    assert ended.value.code == 64 and "--rank" in capsys.readouterr().err


def test_a_place_that_takes_no_file_is_refused_before_the_fit(tiny_catalogue, capsys, tmp_path):
    words = ["fit", "tiny/matt-red", "--catalogue", str(tiny_catalogue), "--json", str(tmp_path)]
    assert main(words) == 4
    said = capsys.readouterr()
    assert "a folder" in said.err and not said.out


def test_a_file_is_to_be_imported_first(tiny_catalogue, capsys, tmp_path):
    path = tmp_path / "paint.brdf"
    path.write_text("1\n")
    assert main(["fit", str(path), "--catalogue", str(tiny_catalogue)]) == 4
    assert f"metamer catalogue import {path}" in capsys.readouterr().err


def test_the_options_are_those_of_the_fit():
    assert command.METHODS == engine.METHODS


def test_interrupting_says_what_was_found_so_far(tiny_catalogue):
    words = ["fit", "tiny/matt-red", "--catalogue", str(tiny_catalogue), "--budget", "1e-9"]
    listen = "import os, signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler)"
    code = f"""{listen}
from metamer.cli import fit as command
from metamer.cli.main import main
told = command._line
command._line = lambda trial: os.kill(os.getpid(), signal.SIGINT) if trial.rank > 1 else told(trial)
sys.exit(main())
"""
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, timeout=patient(120))
    assert done.returncode == 130, done.stderr
    begin = "metamer: interrupted; nothing half-written is left behind. Best so far: 1 term in io, mean"
    assert done.stderr.splitlines()[-1].startswith(begin)


@pytest.mark.slow
def test_a_terminal_gets_a_bar(tiny_catalogue, capsys, monkeypatch):
    from rich import progress

    class Terminal(progress.Progress):
        """Progress as on a terminal; what it was told last is kept."""

        said: ClassVar[list[dict]] = []

        def update(self, task_id, **words):
            Terminal.said.append(words)
            super().update(task_id, **words)

    monkeypatch.setattr(fit_progress, "shows_bars", lambda stream: True)
    monkeypatch.setattr(progress, "Progress", Terminal)
    assert main(["fit", "tiny/satin-green", "--catalogue", str(tiny_catalogue), "--budget", "1.5"]) == 0
    shares = [words["completed"] for words in Terminal.said]
    assert shares[0] == 0.0 < shares[-1] == max(shares) < 1.0 and len(set(shares)) > 3
    assert "best so far" in Terminal.said[-1]["description"]


def test_what_it_is_at_is_said_at_once_and_then(tiny_catalogue, capsys, monkeypatch):
    """Before the material is loaded; on standard error, so that standard output holds the trials alone."""
    lines = []

    class Watched(fit_progress.FitProgress):
        def at(self, phase, share):
            super().at(phase, share)
            lines.append(self.line())

    monkeypatch.setattr(command, "FitProgress", Watched)
    assert main(["fit", "tiny/satin-green", "--catalogue", str(tiny_catalogue), "--budget", "1.5"]) == 0
    said = capsys.readouterr()
    first, second = said.err.splitlines()[:2]
    assert first == "loading tiny/satin-green"
    assert second == "fitting tiny/satin-green"
    assert "so far" not in said.out and said.out.startswith("tiny/satin-green: ashikhmin_shirley")
    # Nothing is known yet of the time that is left; in the end it is.
    assert lines[0] == "tabulating, 1 s so far"
    assert "best so far" in lines[-1] and lines[-1].endswith(" left")


def test_nothing_heavy_is_loaded_before_the_first_word():
    script = (
        "import sys\n"
        "from contextlib import ExitStack\n"
        "from metamer.cli.progress.fit import FitProgress\n"
        "with ExitStack() as stack:\n"
        "    print(FitProgress(stack, 'a/b').line(), *{'numpy', 'scipy', 'colour', 'rich'} & set(sys.modules))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=patient(120))
    assert (done.stdout, done.stderr) == ("still loading a/b\n", "loading a/b\n")


def test_wrong_words_are_refused(tiny_catalogue, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["fit", "tiny/matt-red", "--rank", "2", "--budget", "1"])
    assert ended.value.code == 64
    assert main(["fit", "tiny/mat-red", "--catalogue", str(tiny_catalogue)]) == 4
    assert "matt-red" in capsys.readouterr().err
