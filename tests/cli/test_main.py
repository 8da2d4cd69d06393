"""The words of the command, its exit codes, and that it never answers with a traceback."""

import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
from metamer.cli import parser as known
from metamer.cli.output import end_of_name, shows_bars
from metamer.cli.parser import COMMANDS
from metamer.cli.progress.lines import progress_bar
from metamer.runtime.errors import ComparisonError, InputError, UsageError


def test_version(metamer):
    assert metamer("--version") == (0, f"metamer {version('metamer-colour')}\n", "")


def test_help_names_every_command(metamer):
    code, out, _ = metamer("--help")
    assert code == 0
    assert set(COMMANDS) <= set(out.split())


def commands(parser=None, words=()):
    """The words of every command and what parses them."""
    parser = parser or known.parser()
    for action in parser._subparsers._group_actions if parser._subparsers else ():
        for word, inner in action.choices.items():
            yield (*words, word), inner
            yield from commands(inner, (*words, word))


@pytest.mark.parametrize("words", [words for words, _ in commands()], ids=" ".join)
def test_every_command_says_what_it_does_and_refuses_words_under_its_own_usage(metamer, words):
    code, out, _ = metamer(*words, "--help")
    assert code == 0 and out.startswith(f"usage: metamer {' '.join(words)} ")
    sentence = dict(commands())[words].description
    assert sentence and sentence.endswith("."), words
    code, _, err = metamer(
        *words, "--bogus", *{"render": ["a", "-o", "b"], "fit": ["a"], "catalogue": []}.get(words[0], [])
    )
    assert code == 64 and err.startswith(f"usage: metamer {' '.join(words)}"), err


@pytest.mark.parametrize("word", COMMANDS)
def test_a_command_reads_its_words_without_the_parsers_of_the_others(word):
    asked, whole = (dict(commands(known.parser(words))) for words in ([word, "--help"], []))
    assert asked.keys() == {words for words in whole if words[0] == word}
    assert all(asked[words].format_help() == whole[words].format_help() for words in asked)


@pytest.mark.parametrize("words", [["--version", "review"], ["no-such-command"], ["-h"]])
def test_words_that_begin_with_no_command_are_held_against_all(words):
    assert {word for (word, *_), _ in commands(known.parser(words))} == set(COMMANDS)


def test_help_of_one_benchmark_is_of_that_one(metamer):
    _, out, _ = metamer("bench", "factor", "--help")
    assert "--growth" in out and "shading" not in out
    _, out, _ = metamer("bench", "basis", "--help")
    assert "--growth" not in out and "--json" in out


def test_no_words_show_the_help_and_count_as_wrong_usage(metamer):
    code, out, _ = metamer()
    assert code == 64
    assert "review" in out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["paint"], "paint"),
        (["rendr"], "did you mean render?"),
        (["catalogue", "lst"], "did you mean list?"),
        (["review", "--ilumminants", "D65"], "did you mean --illuminants?"),
        (["names", "illuminant"], "did you mean illuminants?"),
        (["review", "--illuminant-list", "D65"], "--illuminant-list"),
        (["review", "--illuminants", ","], "names nothing"),
        (["review", "--budget", "0"], "a ΔE94 above 0, not 0"),
        (["review", "--budget", "nan"], "a ΔE94 above 0, not nan"),
        (["review", "--budget", "inf"], "a ΔE94 above 0, not inf"),
        (["review", "--budget", "small"], "a ΔE94 above 0, not small"),
        (["review", "--jobs", "0"], "at least 1, not 0"),
        (["review", "--jobs", "-2"], "--jobs"),
        (["review", "--renderer", "mental-ray"], "mental-ray"),
        (["render", "scene.toml"], "-o"),
        (["bench", "everything"], "everything"),
        (["catalogue"], "import"),
    ],
)
def test_wrong_usage(metamer, words, said):
    code, out, err = metamer(*words)
    assert code == 64
    assert said in err and "usage: metamer" in err
    assert out == ""


def test_an_option_that_is_like_none_is_told_no_other(metamer):
    code, _, err = metamer("render", "scene.toml", "-o", "a.png", "--material", "red")
    assert code == 64 and "unrecognized arguments: --material red" in err and "did you mean" not in err


@pytest.mark.parametrize(
    ("reason", "code"),
    [
        (InputError("is empty", file="a.csv"), 4),
        (ComparisonError("two sizes"), 3),
        (UsageError("a or b"), 64),
        (KeyboardInterrupt(), 130),
    ],
)
def test_exit_code_of_each_error(metamer, monkeypatch, reason, code):
    def fail(_args):
        raise reason

    monkeypatch.setattr("metamer.cli.doctor.run", fail)
    found, _, err = metamer("doctor")
    assert found == code
    assert (str(reason) or "interrupted") in err


@pytest.mark.parametrize(
    ("reason", "words"),
    [
        (OSError(28, "No space left on device", "a.exr"), ("a.exr: cannot be", "No space left on device", "make room")),
        (
            OSError(13, "Permission denied", "secret.toml"),
            ("secret.toml: cannot be", "Permission denied", "who may read"),
        ),
        (
            OSError(28, "No space left on device"),
            ("standard output: cannot be", "No space left on device", "make room"),
        ),
    ],
)
def test_a_failure_of_the_system_names_its_file_and_what_to_do(metamer, monkeypatch, reason, words):
    def fail(_args):
        raise reason

    monkeypatch.setattr("metamer.cli.doctor.run", fail)
    code, _, err = metamer("doctor")
    assert code == 4 and all(word in err for word in words) and "Errno" not in err


def test_a_long_name_leaves_room_for_count_and_time():
    assert end_of_name("paint/red", 9) == "paint/red"
    assert end_of_name("paint/red-gloss", 9) == "…ed-gloss"
    assert end_of_name("paint/red", 1) == end_of_name("paint/red", 0) == ""


@pytest.mark.parametrize(
    ("terminal", "no_color", "bars"), [(True, None, True), (True, "", True), (True, "1", False), (False, None, False)]
)
def test_bars_move_on_a_terminal_unless_plain_lines_are_asked_for(monkeypatch, terminal, no_color, bars):
    monkeypatch.delenv("NO_COLOR", raising=False)
    if no_color is not None:
        monkeypatch.setenv("NO_COLOR", no_color)
    with Path(os.devnull).open("w") as stream:
        monkeypatch.setattr(stream, "isatty", lambda: terminal)
        assert shows_bars(stream) == bars


def test_progress_follows_the_same_rule(monkeypatch, capsys):
    monkeypatch.setattr("metamer.cli.progress.lines.shows_bars", lambda stream: stream is sys.stderr)
    with progress_bar("Looking") as told:
        told(1, 2, "paint/red")
    assert "Looking: 1/2" not in capsys.readouterr().err
    monkeypatch.setattr("metamer.cli.progress.lines.shows_bars", lambda stream: False)
    with progress_bar("Looking") as told:
        told(1, 2, "paint/red")
    assert capsys.readouterr().err == "Looking: 1/2 paint/red\n"


@pytest.mark.parametrize("bars", [False, True])
def test_work_that_should_be_quick_says_how_far_it_is_once_it_is_late(monkeypatch, capsys, bars):
    now = [100.0]
    monkeypatch.setattr("metamer.cli.progress.lines.time.monotonic", lambda: now[0])
    monkeypatch.setattr("metamer.cli.progress.lines.shows_bars", lambda stream: bars)
    with progress_bar("Rendering", after=2.0) as told:
        told(1, 10, "visibility")
    assert capsys.readouterr().err == ""
    with progress_bar("Rendering", after=2.0) as told:
        told(1, 10, "visibility")
        now[0] += 4.0
        told(2, 10, "visibility")
    said = capsys.readouterr().err
    assert "2/10" in said and (bars or said == "Rendering: 2/10 visibility, about 32 s left\n")


def test_another_work_has_another_time_left(monkeypatch, capsys):
    now = [100.0]
    monkeypatch.setattr("metamer.cli.progress.lines.time.monotonic", lambda: now[0])
    monkeypatch.setattr("metamer.cli.progress.lines.shows_bars", lambda stream: False)
    with progress_bar("Rendering") as told:
        told(1000, 1000, "visibility")
        now[0] += 600.0
        told(0, 4, "drawing")
        now[0] += 10.0
        told(2, 4, "drawing")
    lines = capsys.readouterr().err.splitlines()
    assert lines[1:] == ["Rendering: 0/4 drawing", "Rendering: 2/4 drawing, about 10 s left"]


def test_closed_streams_are_no_traceback(tmp_path):
    for closed in (">&-", "2>&-", ">&- 2>&-", "<&-"):
        command = f'"{sys.executable}" -m metamer.cli.main catalogue list nowhere {closed}'
        done = subprocess.run(["sh", "-c", command], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 4 and "Traceback" not in done.stderr, closed


def test_terminal_without_greek_gets_a_question_mark():
    ascii_only = {**os.environ, "PYTHONIOENCODING": "ascii", "COLUMNS": "120"}
    done = subprocess.run(
        [sys.executable, "-m", "metamer.cli.main", "review", "--help"], env=ascii_only, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "--budget ?E94" in done.stdout


def test_reader_that_leaves_is_forgiven():
    command = [sys.executable, "-m", "metamer.cli.main", "doctor", "--brief"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stdout.close()
    err = process.stderr.read()
    process.stderr.close()
    assert (process.wait(), err) == (0, b"")
