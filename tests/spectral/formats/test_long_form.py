"""Tables in long form: one spectrum a sample, under its name, on its own wavelengths."""

from itertools import permutations
from random import Random

import pytest
from metamer.spectral.formats.csv import read
from metamer.spectral.formats.import_options import ImportOptions

NM = tuple(range(400, 701, 50))
SAMPLES = {"red": 0.1, "dark blue": 0.3, "P-3": 0.5}
ROWS = [(name, nm, low + (nm - 400) / 1000) for name, low in SAMPLES.items() for nm in NM]
BY_WAVELENGTH = sorted(ROWS, key=lambda row: (row[1], list(SAMPLES).index(row[0])))


def table(header, rows=ROWS, mark=",", decimal=".", order=(0, 1, 2), by=1.0):
    """A sample, a wavelength and a value in each row, in some order; `header` is in that order, too."""
    lines = []
    for name, nm, value in rows:
        cells = (name, f"{nm}", f"{by * value:.4f}".replace(".", decimal))
        lines.append(mark.join(cells[at] for at in order))
    return "\n".join([*([header] if header else []), *lines, ""])


def said(file):
    """Name and ends of each spectrum, in alphabetical order."""
    found = [(e.name, len(e.spectrum.samples), *e.spectrum.samples[[0, -1]].round(9)) for e in file.entries]
    return sorted(found)


EXPECTED = sorted((name, len(NM), low, round(low + 0.3, 9)) for name, low in SAMPLES.items())


@pytest.mark.parametrize("order", list(permutations(range(3))))
@pytest.mark.parametrize("rows", ["one below the other", "interleaved", "in any order"])
def test_samples_keep_their_names_in_any_order_of_rows_and_columns(written, order, rows):
    told = {"one below the other": ROWS, "interleaved": BY_WAVELENGTH}.get(rows) or Random(1).sample(ROWS, len(ROWS))
    header = ",".join(("sample", "nm", "R")[at] for at in order)
    assert said(read(written(table(header, told, order=order)))) == EXPECTED


@pytest.mark.parametrize(
    ("text", "name"),
    [
        (table("id;wavelength;Reflectance", mark=";", decimal=","), "a.csv"),
        (table("Probe\tWellenlänge (nm)\tReflexion (%)", mark="\t", decimal=",", by=100.0), "a.txt"),
        (table("Échantillon;longueur d'onde;Réflectance (%)", mark=";", decimal=",", by=100.0), "a.csv"),
        (table("Campione|nm|Riflettanza", mark="|"), "a.txt"),
        (table("variable,wavelength,reflectance"), "a.csv"),
        (table("SAMPLE NAME,Wavelength,R").upper().replace("RED", "red").replace("DARK BLUE", "dark blue"), "a.csv"),
        ("Export of a program\nInstrument;X-1\n\n" + table("Sample;nm;R", mark=";"), "a.csv"),
        (table("sample,nm,R").replace("\ndark", "\n\ndark", 1), "a.csv"),
        (table("sample,nm,R").replace("\ndark", "\nsample,nm,R\ndark", 1), "a.csv"),
        (table("sample,nm,R").replace(",400,", ",400 nm,").replace("50,", "50 nm,").replace("00,", "00 nm,"), "a.csv"),
        (table("sample,nm,R").encode("utf-16"), "a.csv"),
        (table("sample,nm,R").encode("utf-8-sig"), "a.csv"),
        ("# reflectance\n" + table(""), "a.csv"),
    ],
)
def test_separators_languages_and_encodings(written, text, name):
    assert said(read(written(text, name))) == EXPECTED


def test_numbers_name_samples_below_a_heading_that_says_so(written):
    numbered = {name: str(number) for number, name in enumerate(SAMPLES, 1)}
    rows = [(numbered[name], nm, value) for name, nm, value in BY_WAVELENGTH]
    for header in ("id,nm,R", "Sample No.,nm,R", "specimen,nm,R", "Probe Nr.,nm,R"):
        assert [entry[0] for entry in said(read(written(table(header, rows))))] == ["1", "2", "3"]


def test_a_counter_of_rows_and_an_index_name_nothing(written):
    lines = table("sample,nm,R").splitlines()
    text = "\n".join([f",{lines[0]}", *(f"{at},{line}" for at, line in enumerate(lines[1:]))])
    assert said(read(written(text))) == EXPECTED


def test_a_name_stands_in_the_first_of_its_rows(written):
    lines = table("sample,nm,R").splitlines()
    text = "\n".join(line if ",400," in line or "nm" in line else f",{line.partition(',')[2]}" for line in lines)
    assert said(read(written(text))) == EXPECTED


def test_each_sample_has_its_own_wavelengths(written):
    rows = [row for row in ROWS if row[0] != "red" or row[1] > 450] + [("red", 725, 0.4)]
    assert ("red", 6, 0.2, 0.4) in said(read(written(table("sample,nm,R", rows))))
    # Two samples whose wavelengths alternate are no single spectrum.
    rows = sorted((nm + 5 * (name == "red"), name, value) for name, nm, value in ROWS if name != "P-3")
    text = "nm,sample,R\n" + "".join(f"{nm},{name},{value:.4f}\n" for nm, name, value in rows)
    assert said(read(written(text))) == EXPECTED[1:]


def test_two_values_at_one_wavelength_are_asked_about(refused, written):
    again = [(name, nm, value + 0.01) for name, nm, value in ROWS[:2]]
    lines = refused(read, table("sample,nm,R", ROWS + again))
    assert lines[0] == "paints.csv: lines 2 and 23: several values at one wavelength of one sample"
    assert lines[1] == "  found: red at 400: 0.1000 and 0.1100" and "reading" in lines[-1]
    file = read(written(table("sample,nm,R", ROWS + ROWS[:2])))
    assert said(file) == EXPECTED and "2 rows that repeat another one are left out" in file.notes


@pytest.mark.parametrize("column", ["reading", "scan no.", "Messung", "geometry", "Angle"])
def test_repeated_readings_are_spectra_of_one_name(written, column):
    words = ("SCI", "SCE") if column == "geometry" else ("1", "2")
    text = f"sample,{column},nm,R\n"
    for shift, word in enumerate(words):
        text += "".join(f"{name},{word},{nm},{value + 0.01 * shift:.4f}\n" for name, nm, value in ROWS)
    file = read(written(text))
    assert [entry.name for entry in file.entries] == [*SAMPLES] * 2
    assert [entry.details[column] for entry in file.entries] == [words[0]] * 3 + [words[1]] * 3


@pytest.mark.parametrize("column", ["angle", "Winkel", "reading"])
def test_readings_of_one_sample_need_no_name(written, column):
    text = f"{column},nm,R\n" + "".join(f"{word},{nm},{0.1 + word / 1000}\n" for word in (15, 45, 110) for nm in NM)
    file = read(written(text, "silver.csv"))
    assert [entry.name for entry in file.entries] == ["silver"] * 3
    assert [entry.details[column] for entry in file.entries] == ["15", "45", "110"]


def test_lots_of_one_name_are_two_samples(written):
    text = "sample,lot,nm,R\n"
    for lot in ("L1", "L2"):
        text += "".join(f"{name},{lot},{nm},{value:.4f}\n" for name, nm, value in ROWS if name != "P-3")
    assert [entry.name for entry in read(written(text)).entries] == ["red L1", "dark blue L1", "red L2", "dark blue L2"]


def test_further_columns_are_values_quantities_units_and_remarks(written):
    text = "sample,nm,SCI,SCE\n" + "".join(f"{n},{nm},{value + 0.04:.4f},{value:.4f}\n" for n, nm, value in ROWS)
    file = read(written(text))
    assert [entry.name for entry in file.entries][:2] == ["red SCI", "red SCE"]
    assert file.entries[0].spectrum.samples[0] == pytest.approx(0.14)
    text = "sample,quantity,nm,value,unit,remark\n"
    for word, by in (("Reflectance", 100.0), ("Transmittance", 50.0)):
        text += "".join(f"{n},{word},{nm},{by * value:.4f},%,{'new' * (nm > 400)}\n" for n, nm, value in ROWS)
    file = read(written(text))
    assert [(e.spectrum.quantity, round(e.spectrum.samples[0], 6)) for e in file.entries][::3] == [
        ("reflectance", 0.1),
        ("transmittance", 0.05),
    ]
    assert "remark" not in file.entries[0].details and file.entries[0].details["units"] == "%"


def test_other_tables_with_words_or_numbers_beside_are_read_as_before(written):
    bands = "nm,R,band\n" + "".join(f"{nm},0.{nm},{'violet' if nm < 500 else 'red'}\n" for nm in NM)
    assert [(e.name, len(e.spectrum.samples)) for e in read(written(bands, "a.csv")).entries] == [("R", len(NM))]
    wide = "nm,Sample,White\n" + "".join(f"{nm},{7 + nm // 100},100\n" for nm in NM)
    file = read(written(wide), ImportOptions("reflectance", "percent"))
    assert [entry.name for entry in file.entries] == ["Sample", "White"]


def test_words_between_rows_are_refused(refused):
    lines = refused(read, table("sample,nm,R").replace("\ndark", "\nblue,n/a,0.3\ndark", 1))
    assert lines[0] == "paints.csv: line 9: no wavelength"
    lines = refused(read, table("sample,nm,R").replace("red,450,0.1500", "red,450"))
    assert lines[0] == "paints.csv: line 3: a row is cut short"
