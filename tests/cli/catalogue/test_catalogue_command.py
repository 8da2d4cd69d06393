"""`metamer catalogue`: what a person reads, and the exit codes."""

import argparse
from dataclasses import replace

import numpy as np
import pytest
from metamer.cli import catalogue as command
from metamer.materials.core.axes import Axis
from metamer.materials.core.fit_error import FitError
from metamer.materials.factored.pack import FactoredBrdf, FactorPack
from metamer.materials.intake import importing
from metamer.materials.intake.importing import ImportInterrupted, ImportReport
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.palette import Palette

FAMILY = """
family = "grey"
kind = "analytic"

[[material]]
name = "light"
model = "lambert"
reflectance = { constant = 0.8 }

[[material]]
name = "dark"
model = "lambert"
reflectance = { constant = 0.1 }
"""


@pytest.fixture
def source(tmp_path):
    (tmp_path / "greys.toml").write_text(FAMILY)
    return tmp_path / "greys.toml"


@pytest.fixture(autouse=True)
def fast_fit(monkeypatch):
    def fit_one(material, budget, say=None):
        axes = tuple(Axis(name, 2, 1.5) for name in ("theta_i", "theta_o", "phi"))
        error = FitError(0.01, 0.02, 0.123, 0.4, "D65", "1931_2", "a protocol", 0.0)
        pack = FactorPack("io", axes, (np.ones((2, 1)),) * 3, Palette.of(np.ones((1, 81))))
        return importing.FitResult(FactoredBrdf((pack,), error), 0.5)

    monkeypatch.setattr(importing, "fit_material", fit_one)
    # Here, too, what stands in for the fit: another process would not know it.
    monkeypatch.setattr(importing, "supervised", lambda work, tasks, *_: ((t.key, work(*t.arguments)) for t in tasks))
    monkeypatch.setenv("COLUMNS", "120")


def metamer(*words):
    parser = argparse.ArgumentParser()
    command.add_parser(parser.add_subparsers())
    args = parser.parse_args(["catalogue", *map(str, words)])
    return args.run(args)


def test_import_prints_plain_lines_and_a_table(source, tmp_path, capsys):
    assert metamer("import", source, "--into", tmp_path / "cat", "--jobs", 1) == 0
    out = capsys.readouterr().out
    assert "[1/2] imported grey/light" in out
    assert "0.123" in out and "ΔE94" in out
    assert "2 imported" in out
    assert "miss the budget" not in out
    assert "\x1b" not in out


def test_second_import_says_that_nothing_changed(source, tmp_path, capsys):
    metamer("import", source, "--into", tmp_path / "cat", "--jobs", 1)
    capsys.readouterr()
    assert metamer("import", source, "--into", tmp_path / "cat", "--jobs", 1) == 0
    assert "2 skipped" in capsys.readouterr().out


def test_failure_is_said_with_its_reason_and_exit_code(source, tmp_path, capsys):
    source.write_text(FAMILY.replace("0.1", "-0.1"))
    assert metamer("import", source, "--into", tmp_path / "cat", "--jobs", 1) == 4
    out = capsys.readouterr().out
    assert "grey/dark failed" in out and "greys.toml" in out and "reflectance" in out
    assert "1 imported, 1 failed" in out


def test_missed_budget_is_said(source, tmp_path, capsys):
    assert metamer("import", source, "--into", tmp_path / "cat", "--jobs", 1, "--budget", 0.1) == 0
    assert "2 of 2 fits miss the budget of ΔE94 0.1" in capsys.readouterr().out


def test_fits_that_miss_their_budget_are_named_with_what_one_more_step_would_have_paid(
    source, tmp_path, capsys, monkeypatch
):
    known = importing.fit_material

    def fit_one(material, budget, say=None):
        found = known(material, budget)
        score = 0.9 if material.id == "grey/dark" else 0.2
        aims = {"budget": budget, "score": score, "more_terms": 8, "more_score": 0.7 * score}
        return replace(found, fast=replace(found.fast, error=replace(found.fast.error, **aims)))

    monkeypatch.setattr(importing, "fit_material", fit_one)
    assert metamer("import", source, "--into", tmp_path / "cat", "--jobs", 1, "--budget", 0.25) == 0
    out = capsys.readouterr().out
    assert "1 of 2 fits miss the budget of ΔE94 0.25" in out
    words = "misses the budget of ΔE94 0.25 by 0.65; 8 more terms would have led to about 0.63"
    assert [line for line in out.splitlines() if "its fit" in line] == [f"grey/dark: its fit {words}"]


def test_dry_run_says_what_it_would_do(source, tmp_path, capsys):
    assert metamer("import", source, "--into", tmp_path / "cat", "--dry-run") == 0
    assert "2 to import" in capsys.readouterr().out
    assert not (tmp_path / "cat").exists()


def test_an_interrupt_says_what_is_there(source, tmp_path, monkeypatch):
    def stopped(*args, **options):
        raise ImportInterrupted(ImportReport(tmp_path / "cat", (), 2))

    monkeypatch.setattr(importing, "import_sources", stopped)
    with pytest.raises(KeyboardInterrupt, match="stopped with 2 to go, and the same command goes on from here"):
        metamer("import", source, "--into", tmp_path / "cat")


def test_missing_source_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        metamer("import", tmp_path / "gone", "--into", tmp_path / "cat")


def test_list_show_and_verify(source, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("METAMER_CATALOGUE", str(tmp_path / "cat"))
    metamer("import", source, "--jobs", 1)
    capsys.readouterr()
    assert metamer("list") == 0
    out = capsys.readouterr().out
    assert "grey/dark" in out and "lambert" in out and "2 materials" in out
    assert metamer("show", "grey/dark") == 0
    out = capsys.readouterr().out
    assert "made up for this catalogue" in out and "a protocol" in out and "p99 0.123" in out
    assert metamer("verify", tmp_path / "cat") == 0
    assert "2 materials intact, 0 damaged" in capsys.readouterr().out


def test_list_is_whole_in_a_narrow_terminal(source, tmp_path, capsys, monkeypatch):
    """No figure is cut; light and observer are said with it."""
    metamer("import", source, "--into", tmp_path / "cat", "--jobs", 1)
    monkeypatch.setenv("COLUMNS", "30")
    capsys.readouterr()
    assert metamer("list", tmp_path / "cat") == 0
    out = capsys.readouterr().out
    assert "0.123" in out and "…" not in out, out
    assert "under the light that shows it most, observer" in out


def test_damaged_file_is_listed_and_verified_as_such(source, tmp_path, capsys):
    metamer("import", source, "--into", tmp_path / "cat", "--jobs", 1)
    (tmp_path / "cat" / "grey" / "dark.h5").write_bytes(b"\x89HDF")
    capsys.readouterr()
    assert metamer("verify", tmp_path / "cat") == 4
    assert "dark.h5" in capsys.readouterr().out
    assert metamer("list", tmp_path / "cat") == 4
    out = capsys.readouterr().out
    assert "dark.h5" in out and "grey/light" in out


def test_unknown_id_gives_the_nearest(source, tmp_path):
    metamer("import", source, "--into", tmp_path / "cat", "--jobs", 1)
    with pytest.raises(UnknownNameError, match="nearest: grey/light"):
        metamer("show", "grey/lihgt", tmp_path / "cat")


def test_no_catalogue_says_how_to_make_one(tmp_path, monkeypatch):
    monkeypatch.setenv("METAMER_CATALOGUE", str(tmp_path / "none"))
    with pytest.raises(InputError, match=r"(?s)no such catalogue.*metamer catalogue import"):
        metamer("list")


def test_jobs_below_one_are_refused(source, capsys):
    with pytest.raises(SystemExit):
        metamer("import", source, "--jobs", 0)
    assert "at least 1" in capsys.readouterr().err
