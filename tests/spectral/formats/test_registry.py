"""The list of readers: which takes a file, and that none of them is surprised by what is in it."""

import pickle
import random

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from metamer.runtime.errors import InputError
from metamer.spectral.formats import cgats, csv, cxf, iestm27, instrument_text, spd
from metamer.spectral.formats.import_options import AgainstAnswerError, ImportOptions
from metamer.spectral.formats.registry import (
    FORMATS,
    HEAD,
    SpectralFile,
    format_of,
    read_filling_gaps,
    read_spectra,
    readers,
)
from metamer.spectral.spectrum import check_values
from small_files import SMALL, mutated

TEXT = (csv, cgats, instrument_text, spd, cxf, iestm27)
# One file, written again for each example, is what the property is about.
KEPT = settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def test_every_reader_has_what_the_list_asks_for():
    assert len(readers()) == len(FORMATS)
    for reader in readers():
        assert isinstance(reader.NAME, str) and reader.__doc__
        assert all(suffix.startswith(".") for suffix in reader.SUFFIXES)
        assert callable(reader.recognises) and callable(reader.read)


def test_every_small_file_finds_its_reader(written):
    expected = {
        ".csv": "table (CSV, TSV)", ".tsv": "table (CSV, TSV)", ".sp": "CGATS", ".ccss": "CGATS", ".spd": "SPD",
        ".usr": "SPD", ".spdx": "IES TM-27", ".cxf": "CxF3", "meter.txt": "instrument text", "chart.txt": "CGATS",
    }  # fmt: skip
    for name, content in SMALL.items():
        path = written(content, name)
        assert getattr(format_of(path), "NAME", None) == (expected.get(path.suffix) or expected[name]), name
        kinds = {entry.spectrum.quantity for entry in read_spectra(path).entries}
        lights = {".sp", ".ccss", ".spd", ".spdx"}
        assert ("emission" in kinds) == (path.suffix in lights or name == "meter.txt"), name


def test_the_name_matters_less_than_the_content(written):
    assert format_of(written(SMALL["chart.txt"], "chart.csv")).NAME == "CGATS"
    assert format_of(written(SMALL["meter.txt"], "meter.spd")).NAME == "instrument text"
    assert format_of(written(SMALL["down.csv"], "down")).NAME == "table (CSV, TSV)"


@pytest.mark.parametrize(
    "content", [b"", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", b"<html></html>", b'{"a": 1}', b"\xff\xd8\xff"]
)
def test_what_nobody_reads_says_what_could_be(refused, content):
    lines = refused(read_spectra, content, "thing.bin")
    assert lines[0].startswith("thing.bin: ")
    assert "CxF3" in "".join(lines) or "not" in lines[0]


def test_a_file_that_is_not_there(tmp_path):
    for function in (format_of, read_spectra):
        with pytest.raises(InputError, match="no such file"):
            function(tmp_path / "nowhere.csv")
        with pytest.raises(InputError, match="not a file"):
            function(tmp_path)


def holds(file):
    """A file that was read keeps what its types promise."""
    assert isinstance(file, SpectralFile) and file.entries
    for entry in file.entries:
        grid = entry.spectrum.wavelengths_nm
        check_values(entry.spectrum.samples, grid, entry.spectrum.quantity)
        assert (np.diff(grid) > 0).all() and grid.size >= 2
        assert all(isinstance(words, str) for pair in entry.details.items() for words in pair)
        assert all(np.isfinite(colour.values).all() for colour in entry.stated)
    assert all(isinstance(reason, InputError) for _, reason in file.rejected)


@settings(KEPT, max_examples=400)
@given(seed=st.integers(0, 2**32 - 1))
def test_damaged_files_are_read_or_refused(written, seed):
    """Nothing but an `InputError` comes out of any text reader, whatever was done to a file, and whoever wrote it."""
    rng = random.Random(seed)
    name = rng.choice(list(SMALL))
    path = written(mutated(SMALL[name], rng), name)
    reader = rng.choice(TEXT)
    reader.recognises(path, path.read_bytes()[:HEAD])
    try:
        holds(reader.read(path))
    except InputError as refusal:
        assert str(path) in str(refusal)
    try:
        holds(read_spectra(path))
    except InputError as refusal:
        assert str(path) in str(refusal)


@settings(KEPT, max_examples=100)
@given(content=st.binary(max_size=400) | st.text(max_size=400).map(str.encode))
def test_arbitrary_bytes_are_read_or_refused(written, content):
    path = written(content, "thing.csv")
    for reader in TEXT:
        reader.recognises(path, content)
        try:
            holds(reader.read(path))
        except InputError as refusal:
            assert str(path) in str(refusal)


_CELLS = st.sampled_from(
    ["400", "410", "420", "0,5", "0.5", "50", "-1", "", "nan", "nm", "R_400", "%", "x", '"a b"', "1e9"]
)


@settings(KEPT, max_examples=100)
@given(
    rows=st.lists(st.lists(_CELLS, min_size=1, max_size=5), min_size=1, max_size=8),
    mark=st.sampled_from([",", ";", "\t", " "]),
)
def test_tables_of_likely_cells_are_read_or_refused(written, rows, mark):
    path = written("\n".join(mark.join(row) for row in rows), "thing.csv")
    try:
        holds(read_spectra(path))
    except InputError as refusal:
        assert str(path) in str(refusal)


CURVE = "\n".join(f"{nm},{0.2 + 0.001 * (nm - 400):.4f},{0.3 + 0.0005 * (nm - 400):.4f}" for nm in range(400, 701, 10))


@pytest.mark.parametrize("columns", [1, 2])
@pytest.mark.parametrize(
    ("heading", "answer", "part"),
    [
        ("Transmittance, fraction", ImportOptions(quantity="reflectance", scale="fraction"), "quantity"),
        ("Reflectance, fraction", ImportOptions(quantity="reflectance", scale="percent"), "scale"),
        ("Reflectance, fraction", ImportOptions(quantity="emission"), "quantity"),
    ],
)
def test_a_contradiction_is_told_by_its_kind_and_not_by_its_words(
    tmp_path, monkeypatch, columns, heading, answer, part
):
    """Of one spectrum and of several, in another process, and where the words of the message are others."""
    rows = [",".join(row.split(",")[: columns + 1]) for row in CURVE.splitlines()]
    path = tmp_path / "chart.csv"
    path.write_text("\n".join([heading, "nm,one,two"[: 2 + 4 * columns], *rows, ""]))
    with pytest.raises(AgainstAnswerError) as refusal:
        read_spectra(path, answer)
    for each in (refusal.value, refusal.value.at(hint="another"), pickle.loads(pickle.dumps(refusal.value))):
        assert isinstance(each, AgainstAnswerError) and each.part == part
    monkeypatch.setattr(
        AgainstAnswerError, "__init__", lambda self, problem, **said: InputError.__init__(self, "so", **said)
    )
    file, words = read_filling_gaps(path, answer)
    assert len(file.entries) == columns and "chart.csv says itself" in words
    assert [entry.spectrum.quantity for entry in file.entries] == [heading.split(",")[0].lower()] * columns
