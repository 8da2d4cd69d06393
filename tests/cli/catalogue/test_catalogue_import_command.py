"""`metamer catalogue import`: the plan, the report, progress on a terminal, and words that do not fit."""

import inspect
import json

import numpy as np
import pytest
from metamer.cli.catalogue import import_ as catalogue_import
from metamer.cli.parser import parser
from metamer.materials.core.axes import Axis
from metamer.materials.core.fit_error import FitError
from metamer.materials.factored.pack import FactoredBrdf, FactorPack
from metamer.materials.intake import importing
from metamer.materials.intake.importing import DEFAULT_BUDGET
from metamer.spectral.palette import Palette
from metamer.spectral.upsampling import DEFAULT_METHOD

SPECTRA = "# reflectance\nwavelength_nm,red,blue\n400,0.1,0.6\n500,0.2,0.4\n600,0.7,0.1\n700,0.8,0.1\n"


@pytest.fixture
def source(tmp_path):
    folder = tmp_path / "scans"
    folder.mkdir()
    (folder / "chart.csv").write_text(SPECTRA)
    (folder / "bad.bsdf").write_bytes(b"tensor_file\0\1\0")
    (folder / "README").write_text("what is in here\n")
    return folder


@pytest.fixture(autouse=True)
def fast_fit(monkeypatch):
    def fit_material(material, budget, say=None):
        axes = tuple(Axis(name, 2, 1.5) for name in ("theta_i", "theta_o", "phi"))
        error = FitError(
            0.01, 0.02, 0.123, 0.4, "D65", "1931_2", "a protocol", 0.0, where="light there; view here", budget=budget
        )
        pack = FactorPack("io", axes, (np.ones((2, 1)),) * 3, Palette.of(np.ones((1, 81))))
        return importing.FitResult(FactoredBrdf((pack,), error), 0.5)

    monkeypatch.setattr(importing, "fit_material", fit_material)
    # Here, too, what stands in for the fit: another process would not know it.
    monkeypatch.setattr(importing, "supervised", lambda work, tasks, *_: ((t.key, work(*t.arguments)) for t in tasks))


@pytest.mark.parametrize(("budget", "said"), [("0.03", True), ("0.5", False)])
def test_the_report_says_where_a_maximum_of_ten_budgets_is(metamer, source, tmp_path, budget, said):
    _, out, _ = metamer("catalogue", "import", source, "--into", tmp_path / "cat", "--jobs", 1, "--budget", budget)
    assert ("chart/red: up to ΔE94 0.4 under D65: light there; view here" in out) == said


def test_plan_is_a_table_of_files(metamer, source, tmp_path):
    code, said, _ = metamer("catalogue", "import", source, "--into", tmp_path / "cat", "--dry-run")
    assert code == 4
    rows = {line.split()[0]: line.split()[1:] for line in said.splitlines() if line.strip()}
    assert rows["chart.csv"][:5] == ["table", "(CSV,", "TSV)", "2", "2"]
    assert "reflectance in fractions, by the line 'reflectance'" in said
    assert rows["bad.bsdf"][-2:] == ["1", "1"]
    assert "README" not in said and "1 file not recognised" in said
    assert f"failed: {source}/bad.bsdf" in said and "2 to import, 1 failed" in said
    assert not (tmp_path / "cat").exists()


def test_verbose_names_everything(metamer, source, tmp_path):
    _, said, _ = metamer("catalogue", "import", source, "--into", tmp_path / "cat", "--dry-run", "--verbose")
    assert "new chart/red" in said and f"not recognised: {source}/README" in said


def test_report_as_json(metamer, source, tmp_path):
    file = tmp_path / "report.json"
    code, said, _ = metamer(
        *("catalogue", "import", source, "--into", tmp_path / "cat", "--jobs", 1, "--json", file, "--family", "mine")
    )
    assert code == 4 and "2 imported, 1 failed; 1 file not recognised" in said
    say = json.loads(file.read_text())
    assert say["counts"] == {"imported": 2, "skipped": 0, "failed": 1, "new": 0, "remaining": 0}
    assert say["stopped"] == ""
    assert say["not_recognised"] == [f"{source}/README"]
    red = next(row for row in say["materials"] if row["id"] == "mine/red")
    assert red["status"] == "imported" and red["error"]["p99"] == 0.123 and red["seconds"] == 0.5
    assert red["file"] == f"{source}/chart.csv" and red["format"] == "table (CSV, TSV)"
    assert {row["name"]: row["materials"] for row in say["files"]}[f"{source}/chart.csv"] == ["mine/red", "mine/blue"]


def test_the_report_has_a_row_a_file_and_verbose_one_a_material(metamer, source, tmp_path):
    command = ("catalogue", "import", source, "--into", tmp_path / "cat", "--jobs", 1)
    _, said, _ = metamer(*command)
    rows = {line.split()[0]: line.split()[1:] for line in said.splitlines() if line.strip()}
    assert rows["chart.csv"] == ["table", "(CSV,", "TSV)", "2", "0.123", "1.0"]
    assert rows["bad.bsdf"][-1] == "1" and "chart/red" not in rows
    _, said, _ = metamer(*command, "--verbose", "--budget", 0.4)
    rows = {line.split()[0]: line.split()[1:] for line in said.splitlines() if line.strip()}
    assert rows["chart/red"] == ["imported", "0.010", "0.123", "0.5"]


def test_a_full_disk_is_the_last_thing_said(metamer, source, tmp_path, room_for):
    with room_for(2_000):
        code, said, _ = metamer("catalogue", "import", source / "chart.csv", "--into", tmp_path / "cat", "--jobs", 1)
    assert code == 4 and "no room for the file" in said and "stopped with 2 to go" in said.splitlines()[-1]


def test_addresses_reach_the_import_as_they_are(metamer, tmp_path):
    """A path would make one slash of two."""
    import fsspec

    system = fsspec.filesystem("memory")
    system.pipe("/here/chart.csv", SPECTRA.encode())
    try:
        code, said, _ = metamer(
            *("catalogue", "import", "memory://here/chart.csv", "--into", tmp_path / "cat", "--jobs", 1)
        )
        assert code == 0 and "2 imported" in said
    finally:
        system.rm("/here", recursive=True)


def test_quoted_pattern(metamer, source, tmp_path):
    code, said, _ = metamer("catalogue", "import", f"{source}/*.csv", "--into", tmp_path / "cat", "--jobs", 1)
    assert code == 0 and "2 imported" in said


@pytest.mark.parametrize(
    "words",
    [("--family", "Not A Name"), ("--jobs", "0"), ("--budget", "-1"), ("--budget", "nan"), ("--scheduler",)],
    ids=" ".join,
)
def test_words_that_do_not_fit(metamer, source, tmp_path, words):
    code, _, said = metamer("catalogue", "import", source, "--into", tmp_path / "cat", *words)
    assert code == 64 and words[0] in said


@pytest.mark.parametrize("option", ["--uplift", "--scheduler"])
def test_values_that_do_not_fit(metamer, source, tmp_path, option):
    code, _, said = metamer("catalogue", "import", source, "--into", tmp_path / "cat", option, "nonsense:")
    assert code == 64 and "nonsense:" in said and "Traceback" not in said


def test_defaults_in_the_help_are_those_of_the_importer():
    """Repeated so that `--help` need not wait for the fit."""
    args = parser().parse_args(["catalogue", "import"])
    assert (args.budget, args.uplift) == (DEFAULT_BUDGET, DEFAULT_METHOD)
    words = inspect.getsource(catalogue_import.add_parser)
    assert f"(default: {DEFAULT_BUDGET:g})" in words and f"{DEFAULT_METHOD} (default)" in words


def test_again_mends_what_is_damaged(metamer, source, tmp_path):
    """A file whose end is missing is no material, though its head says so; `--again` asks nothing."""
    command = ("catalogue", "import", source / "chart.csv", "--into", tmp_path / "cat", "--jobs", 1)
    metamer(*command)
    path = tmp_path / "cat" / "chart" / "red.h5"
    whole = path.read_bytes()
    path.write_bytes(whole[:-100])
    code, said, _ = metamer("catalogue", "verify", tmp_path / "cat", "--quick")
    assert code == 4 and "--again" in said
    assert "1 imported, 1 skipped" in metamer(*command)[1]
    assert path.read_bytes() == whole
    assert "2 imported" in metamer(*command, "--again")[1]
    assert path.read_bytes() == whole


def test_a_catalogue_of_another_schema_is_left_alone(metamer, source, tmp_path):
    marker = tmp_path / "cat" / "catalogue.toml"
    marker.parent.mkdir()
    for content, found in (("schema = 99", "99"), ("schema", "catalogue.toml")):
        marker.write_text(content)
        for words in (("list", tmp_path / "cat"), ("import", source / "chart.csv", "--into", tmp_path / "cat")):
            code, _, said = metamer("catalogue", *words)
            assert code == 4 and found in said and "--catalogue" in said
        assert marker.read_text() == content


def test_names_do_not_steer_the_terminal(metamer, source, tmp_path):
    (source / "a\x1b[31m\nb.bsdf").write_bytes(b"tensor_file\0\1\0")
    _, said, _ = metamer("catalogue", "import", source, "--into", tmp_path / "cat", "--dry-run", "--verbose")
    assert "\x1b" not in said and "a\\x1b[31m\\nb.bsdf" in said


def test_one_answer_settles_all_files_and_what_is_refused_alike_is_said_together(metamer, tmp_path):
    (tmp_path / "in").mkdir()
    for number in range(4):
        (tmp_path / "in" / f"s{number}.csv").write_text("nm,sample\n380,0.3\n500,0.5\n780,0.8\n")
    words = ("catalogue", "import", tmp_path / "in", "--into", tmp_path / "cat", "--dry-run")
    code, said, _ = metamer(*words)
    assert code == 4 and said.count("what was measured?") == 1 and said.count("try: ") == 1
    assert all(f"s{number}.csv: sample: no word" in said for number in range(4))
    code, said, _ = metamer(*words, "--as", "reflectance", "--scale", "fraction")
    assert code == 0 and "reflectance in fractions, by --as" in said and "4 to import" in said
    assert metamer(*words, "--as", "emission", "--scale", "percent")[0] == 64
