"""Excel workbooks: sheets as the tables that a text of their cells would be, and what such a text would lose."""

import datetime
import zipfile

import metamer
import pytest
from metamer.cli.main import main
from metamer.runtime.errors import InputError
from metamer.spectral.formats.csv import read as read_csv
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.registry import format_of, read_spectra
from metamer.spectral.formats.xlsx import read
from metamer.spectral.measurement import Measurement

openpyxl = pytest.importorskip("openpyxl")

NM = range(400, 701, 20)
RED, BLUE = [5.25 + 0.25 * n for n in range(len(NM))], [60.5 - 1.5 * n for n in range(len(NM))]
DOWN = [["nm", "Red R (%)", "Blue R (%)"], *([nm, r, b] for nm, r, b in zip(NM, RED, BLUE, strict=True))]
ACROSS = [["Sample", *(f"{nm} nm" for nm in NM)], ["Red", *RED], ["Blue", *BLUE]]


@pytest.fixture
def book(tmp_path):
    """Function that writes a workbook: its sheets by name, each a list of rows, or what changes the sheet."""

    def write(change=None, name="paints.xlsx", **sheets):
        made = openpyxl.Workbook()
        made.remove(made.active)
        for title, rows in (sheets or {"Sheet1": DOWN}).items():
            sheet = made.create_sheet(title)
            for row in rows:
                sheet.append(row)
        if change is not None:
            change(made)
        made.save(tmp_path / name)
        return tmp_path / name

    return write


def refusal(path, answer=None):
    with pytest.raises(InputError) as caught:
        read(path, answer or ImportOptions())
    assert caught.value.file == path
    return str(caught.value)


@pytest.mark.parametrize("rows", [DOWN, [["Reflectance (%)"], [], *ACROSS], [["Batch", 7], ["Date", "x"], [], *DOWN]])
def test_a_sheet_is_the_table_of_its_cells(book, written, rows):
    path = book(Paints=rows, name="of any name")
    assert format_of(path).NAME == "Excel workbook"
    file = read_spectra(path)
    text = "\n".join("\t".join(map(str, row)) for row in rows)
    same = read_csv(written(text, "of any name.tsv"))
    for entry, other in zip(file.entries, same.entries, strict=True):
        assert entry.name == other.name and entry.taken == other.taken
        assert entry.spectrum.samples.tolist() == other.spectrum.samples.tolist()
        assert entry.spectrum.wavelengths_nm.tolist() == other.spectrum.wavelengths_nm.tolist() == list(NM)
    assert file.details == same.details and [e.details["sheet"] for e in file.entries] == ["Paints", "Paints"]


def test_several_sheets_by_their_names(book):
    path = book(North=DOWN, Notes=[["made by"], ["nobody"]], South=[["nm", "R (%)"], *([r[0], r[1]] for r in DOWN[1:])])
    file = read(path)
    assert [entry.name for entry in file.entries] == ["North Red R", "North Blue R", "South"]
    assert "sheets without spectra are left out: Notes" in file.notes


@pytest.mark.parametrize("heading", ["Red", "Red R", "Red R (%)"])
def test_percentages_by_their_format(book, heading):
    def formatted(made):
        for (cell,) in made.active["B2:B17"]:
            cell.value, cell.number_format = cell.value / 100.0, "0.0%"

    path = book(formatted, Sheet1=[[row[0], row[1] if n else heading] for n, row in enumerate(DOWN)])
    file = read(path, ImportOptions("reflectance" if heading == "Red" else None))
    assert file.entries[0].spectrum.samples == pytest.approx([one / 100.0 for one in RED], abs=1e-15)
    assert "percent" in file.entries[0].taken
    assert any("formatted as percentages" in note for note in file.notes)


@pytest.mark.parametrize("format_of_cells", ['0.0"%"', "0.0\\%", "[Red]0.0%"])
def test_a_sign_of_percent_that_is_a_letter_multiplies_nothing(book, format_of_cells):
    letter = "Red" not in format_of_cells

    def formatted(made):
        for (cell,) in made.active["B2:B17"]:
            cell.value, cell.number_format = cell.value / (1.0 if letter else 100.0), format_of_cells

    file = read(book(formatted, Sheet1=[[row[0], row[1] if n else "Red R"] for n, row in enumerate(DOWN)]))
    assert file.entries[0].spectrum.samples == pytest.approx([one / 100.0 for one in RED], abs=1e-15)
    assert any("formatted as percentages" in note for note in file.notes) != letter


@pytest.mark.parametrize("decimal", [".", ","])
def test_numbers_that_are_text(book, decimal):
    rows = [DOWN[0], *([row[0], *(f"{one:.2f}".replace(".", decimal) for one in row[1:])] for row in DOWN[1:])]
    assert read(book(Sheet1=rows)).entries[0].spectrum.samples == pytest.approx([one / 100.0 for one in RED])


def test_numbers_among_text_with_decimal_commas_are_refused(book):
    rows = [list(row) for row in DOWN]
    rows[4][1] = "6,25"
    assert "6,25" in refusal(book(Sheet1=rows))


def test_a_number_that_a_spreadsheet_made_a_date(book):
    rows = [list(row) for row in DOWN]
    rows[3][1] = datetime.date(2024, 5, 6)
    file = read(book(Sheet1=rows))
    assert [entry.name for entry in file.entries] == ["Blue R"]
    assert "line 4: not a number" in str(file.rejected[0][1]) and "2024-05-06" in str(file.rejected[0][1])


@pytest.mark.parametrize("rows", [DOWN, [["a", "b"], [1, 2]]])
def test_formulas_without_a_value(book, rows):
    said = refusal(book(lambda made: made.active.__setitem__("B3", "=A3/100"), Sheet1=rows))
    assert "'Sheet1', cell B3: formulas without a value" in said and "save it again" in said


def test_hidden_sheets_with_spectra_are_asked_about(book):
    def hide(made):
        made["Old"].sheet_state = made["Words"].sheet_state = "hidden"

    file = read(book(hide, New=DOWN, Old=DOWN, Words=[["no spectra"]]))
    assert [name for name, _ in file.rejected] == ["Old"] and len(file.entries) == 2
    assert "sheet 'Old': spectra in a hidden sheet" in str(file.rejected[0][1])
    assert "sheets without spectra are left out: Words" in file.notes


@pytest.mark.parametrize(
    ("kind", "key", "found"), [("row_dimensions", 5, "row 5"), ("column_dimensions", "C", "column 3")]
)
def test_hidden_rows_and_columns_are_asked_about(book, kind, key, found):
    def hide(made):
        getattr(made.active, kind)[key].hidden = True

    said = refusal(book(hide))
    assert "hidden rows or columns" in said and found in said


def test_hidden_columns_without_anything_are_nothing(book):
    def hide(made):
        made.active.column_dimensions["H"].hidden = True

    assert len(read(book(hide)).entries) == 2


def test_headings_merged_over_some_columns_are_asked_about(book):
    rows = [["nm", "Red", None, "Blue", None], [None, "SCI", "SCE", "SCI", "SCE"]]
    rows += [[row[0], row[1], row[1] - 4, row[2], row[2] - 4] for row in DOWN[1:]]

    def merge(made):
        for region in ("A1:A2", "B1:C1", "D1:E1"):
            made.active.merge_cells(region)

    said = refusal(book(merge, Sheet1=rows))
    assert "cells B1:C1: a heading that is merged over some of the columns" in said and "Red" in said


def test_a_title_and_a_heading_that_are_merged(book):
    rows = [["nm", "Reflectance (%)", None], [None, "Red", "Blue"], *DOWN[1:]]

    def merge(made):
        for region in ("A1:A2", "B1:C1"):
            made.active.merge_cells(region)

    file = read(book(merge, Sheet1=rows))
    assert [entry.name for entry in file.entries] == ["Red", "Blue"]
    assert file.entries[0].spectrum.samples == pytest.approx([one / 100.0 for one in RED])


def test_a_cell_far_away_costs_nothing(book):
    assert len(read(book(lambda made: made.active.cell(90_000, 3).__setattr__("number_format", "0.0"))).entries) == 2


def altered(path, part, change):
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    parts[part] = change(parts[part])
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return path


SHEET = "xl/worksheets/sheet1.xml"
ENDLESS = b'</sheetData><mergeCells count="1"><mergeCell ref="A20:XFD1048576"/></mergeCells>'
FAR = b'<row r="2000000"><c r="A2000000"><v>1</v></c></row></sheetData>'


@pytest.mark.parametrize(
    ("part", "change", "said"),
    [
        (SHEET, lambda text: text[:500], "a damaged workbook"),
        (SHEET, lambda text: text.replace(b"</sheetData>", ENDLESS), "regions without end"),
        (SHEET, lambda text: text + b" " * (65 << 20), "too large for a workbook"),
        (SHEET, lambda text: text.replace(b"</sheetData>", FAR), "too large"),
        ("xl/workbook.xml", lambda text: b"<x/>", ""),
        ("xl/workbook.xml", lambda text: b'<!DOCTYPE a [<!ENTITY b "c">]>' + text, "a damaged workbook"),
    ],
)  # fmt: skip
def test_damaged_and_endless_workbooks(book, part, change, said):
    assert said in refusal(altered(book(), part, change))


@pytest.mark.parametrize("content", [b"PK\3\4", b"PK\3\4" + bytes(500)])
def test_what_is_no_workbook(written, content):
    path = written(content, "a.xlsx")
    assert format_of(path).NAME == "Excel workbook"
    assert "not a workbook, or a damaged one" in refusal(path)


def test_no_sheet_with_spectra(book):
    assert "no table of wavelengths and values" in refusal(book(A=[["only words"]], B=[[]]))


def test_without_openpyxl(book, monkeypatch):
    path = book()
    monkeypatch.setitem(__import__("sys").modules, "openpyxl", None)
    said = refusal(path)
    assert "metamer-colour[xlsx]" in said and "CSV" in said


def test_commands_and_scripts_take_it(book, tmp_path, capsys):
    path = book()
    book(name="stock.xlsx", Stock=[["part", "number"], ["screw", 12], ["nut", 7]])
    with pytest.warns(UserWarning, match="percent"):
        assert list(metamer.read_spectra(path)) == ["Red R", "Blue R"]
    assert main(["catalogue", "import", str(tmp_path), "--catalogue", str(tmp_path / "c"), "--dry-run"]) == 0
    assert "2 to import" in capsys.readouterr().out
    assert main(["match", f"{path}#Red R", f"{path}#Blue R"]) in (0, 1)


@pytest.mark.parametrize("title", ["Transmittance", "Transmission (%)", "Reflectance", "Sheet1"])
def test_the_title_of_a_sheet_says_what_the_table_leaves_open(book, title):
    rows = [["nm", "Red (%)", "Blue (%)"], *DOWN[1:]]
    if title == "Sheet1":
        assert "what was measured" in refusal(book(**{title: rows}))
        return
    quantity = "reflectance" if title == "Reflectance" else "transmittance"
    assert [entry.spectrum.quantity for entry in read(book(**{title: rows})).entries] == [quantity] * 2
    headed = [["nm", "Reflectance Red (%)", "Reflectance Blue (%)"], *DOWN[1:]]
    assert {entry.spectrum.quantity for entry in read(book(**{title: headed})).entries} == {"reflectance"}


@pytest.mark.parametrize(("title", "part"), [("SCI", "specular component"), ("M1", "measurement condition")])
def test_conditions_in_the_title_of_a_sheet_go_with_its_readings(book, title, part):
    (stated, *_), (silent, *_) = (read(book(**{name: DOWN})).entries for name in (title, "Paints"))
    assert part in Measurement.of("reflectance", stated.details, stated.name).parts
    assert part not in Measurement.of("reflectance", silent.details, silent.name).parts
