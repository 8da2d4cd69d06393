"""The worked example of docs/adding_a_format.md: its reader, put into a copy of the package, imports its file."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from metamer.materials.formats import registry
from patience import patient

ROOT = Path(__file__).resolve().parents[3]
PACKAGES = ("runtime", "spectral", "materials", "cli", "catalogs")
SCRIPT = """
import sys
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.intake.importing import import_sources
from metamer.spectral.formats import registry as reading
assert reading.__file__.startswith(sys.argv[1]), reading.__file__
report = import_sources([sys.argv[2]], sys.argv[3], jobs=1)
for outcome in report.outcomes:
    print(outcome.status, outcome.id, outcome.format, outcome.reason.replace("\\n", " "), sep="|")
record = Catalogue.open(sys.argv[3]).load("chart/rosso-corsa")
values = [round(value, 9) for value in record.original["values"].tolist()]
print(record.original["name"], values, record.original["details.units"], sep="|")
print(record.provenance.notes)
"""


@pytest.fixture(scope="module")
def example():
    text = (ROOT / "docs" / "adding_a_format.md").read_text(encoding="utf-8")
    return {kind: re.search(rf"```{kind}\n(.*?)```", text, re.DOTALL)[1] for kind in ("python", "text")}


@pytest.fixture(scope="module")
def copy(example, tmp_path_factory):
    """A folder to put on the path, whose metamer knows the new format: one file, one row."""
    folder = tmp_path_factory.mktemp("copy")
    for package in PACKAGES:
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / package, folder / "metamer" / package, ignore=ignored)
    formats = folder / "metamer" / "spectral" / "formats"
    (formats / "swatch.py").write_text(example["python"], encoding="utf-8")
    listed = (formats / "registry.py").read_text(encoding="utf-8")
    assert listed.count('    "csv",\n') == 1
    longer = listed.replace('    "csv",\n', '    "swatch",\n    "csv",\n')
    (formats / "registry.py").write_text(longer, encoding="utf-8")
    return folder


def imported(copy, file, catalogue):
    words = [sys.executable, "-c", SCRIPT, str(copy), str(file), str(catalogue)]
    done = subprocess.run(
        words, capture_output=True, text=True, env={"PYTHONPATH": str(copy), "PATH": ""}, timeout=patient(300)
    )
    assert done.returncode == 0, done.stderr
    return [line.split("|") for line in done.stdout.splitlines()]


@pytest.mark.slow
def test_one_file_and_one_row_make_a_format(copy, example, tmp_path):
    (tmp_path / "chart.any").write_text(example["text"] + "Verde = 1 2\nBlu = 1 2 x 4\n", encoding="utf-8")
    *outcomes, kept, notes = imported(copy, tmp_path / "chart.any", tmp_path / "cat")
    found = {row[1]: row for row in outcomes}
    assert found["chart/rosso-corsa"][:3] == ["imported", "chart/rosso-corsa", "swatches"]
    assert found["chart/grigio"][0] == "imported"
    assert found["chart/Verde"][0] == "failed" and "expected: 4 values" in found["chart/Verde"][3]
    assert found["chart/Blu"][0] == "failed" and "line 6: not a number" in found["chart/Blu"][3]
    assert kept == ["Rosso corsa", "[0.041, 0.039, 0.51, 0.635]", "%"]
    assert "percent, divided by 100" in notes[0] and "taken to be perfectly diffuse" in notes[0]


def test_without_the_row_the_file_is_not_known(example, tmp_path):
    (tmp_path / "chart.any").write_text(example["text"], encoding="utf-8")
    assert registry.format_for(tmp_path / "chart.any") is None


def test_the_document_tells_the_truth_about_the_list():
    text = (ROOT / "docs" / "adding_a_format.md").read_text(encoding="utf-8")
    for word in ("recognises(path, head)", "read_sources(path: Path, uplift: str)", "companions(path)", "label(path)"):
        assert word in text
