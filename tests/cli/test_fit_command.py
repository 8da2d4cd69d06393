"""`metamer fit`: its table, its exit codes."""

import pytest
from metamer.cli.main import main


def test_terms_are_shown_as_they_are_tried(tiny_catalogue, capsys):
    assert main(["fit", "tiny/satin-green", "--catalogue", str(tiny_catalogue), "--budget", "1.5"]) == 0
    out = capsys.readouterr().out
    assert "hd" in out and "io" in out
    assert "Together" in out
    assert "half" in out


def test_a_budget_out_of_reach_is_said_and_warned_of(tiny_catalogue, capsys):
    words = ["fit", "tiny/matt-red", "--catalogue", str(tiny_catalogue), "--budget", "1e-9"]
    assert main(words) == 1
    assert "not met" in capsys.readouterr().out


def test_a_rank_and_a_frame_can_be_given(tiny_catalogue, capsys):
    words = ["fit", "tiny/matt-red", "--catalogue", str(tiny_catalogue), "--rank", "2", "--frame", "io"]
    assert main(words) == 0
    assert "Together 2 terms (2 in io)" in capsys.readouterr().out


def test_wrong_words_are_refused(tiny_catalogue, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["fit", "tiny/matt-red", "--rank", "2", "--budget", "1"])
    assert ended.value.code == 64
    assert main(["fit", "tiny/mat-red", "--catalogue", str(tiny_catalogue)]) == 4
    assert "matt-red" in capsys.readouterr().err
