"""Tables of spectra: both layouts, and every way they come broken."""

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.formats.csv import read_csv_spectra

DOWN = "nm,Red,Grey\n400,0.05,0.2\n410,0.06,0.2\n420,0.07,0.2\n"
ACROSS = "name,400,410,420\nRed,0.05,0.06,0.07\nGrey,0.2,0.2,0.2\n"
# The first bytes of any PNG.
PNG = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x10\0\0\0\x10\x08\x02\0\0\0"


@pytest.fixture
def table(tmp_path):
    def write(content, name="paints.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def refusal(path, quantity="reflectance"):
    """The lines of the error that reading `path` ends in, without the folder."""
    with pytest.raises(InputError) as caught:
        read_csv_spectra(path, quantity)
    return str(caught.value).replace(f"{path.parent}/", "").splitlines()


@pytest.mark.parametrize("content", [DOWN, ACROSS], ids=["down", "across"])
@pytest.mark.parametrize("mark", [",", ";", "\t"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_both_layouts_and_all_separators(table, content, mark, end):
    found = read_csv_spectra(table(content.replace(",", mark).replace("\n", end)))
    assert list(found) == ["Red", "Grey"]
    assert found["Red"].wavelengths_nm.tolist() == [400.0, 410.0, 420.0]
    assert found["Red"].samples.tolist() == [0.05, 0.06, 0.07]
    assert found["Red"].quantity == "reflectance"


def test_comments_blank_lines_spaces_and_a_byte_order_mark(table):
    found = read_csv_spectra(table("\ufeff# a chart\n\n" + DOWN.replace(",", " , ") + "\n# end\n"))
    assert found["Grey"].samples.tolist() == [0.2, 0.2, 0.2]


def test_quoted_names_with_a_comma(table):
    found = read_csv_spectra(table(DOWN.replace("Red", '"Red, matte"')))
    assert list(found) == ["Red, matte", "Grey"]


def test_unicode_and_latin_names(table):
    assert list(read_csv_spectra(table(DOWN.replace("Red", "Grün")))) == ["Grün", "Grey"]
    assert list(read_csv_spectra(table(DOWN.replace("Red", "Grün").encode("latin-1"), "old.csv"))) == ["Grün", "Grey"]


def test_numbers_as_names_in_both_layouts(table):
    down = "nm,1,2,3\n400,0.1,0.2,0.3\n410,0.1,0.2,0.3\n"
    across = "nm,400,410\n1,0.1,0.1\n2,0.2,0.2\n3,0.3,0.3\n"
    for content in (down, across):
        found = read_csv_spectra(table(content))
        assert list(found) == ["1", "2", "3"]
        assert found["3"].samples.tolist() == [0.3, 0.3]


def test_a_table_without_a_header_keeps_its_first_row(table):
    found = read_csv_spectra(table("400,0.05\n410,0.06\n420,0.07\n"))
    assert list(found) == ["paints"]
    assert found["paints"].wavelengths_nm.tolist() == [400.0, 410.0, 420.0]
    assert found["paints"].samples.tolist() == [0.05, 0.06, 0.07]
    found = read_csv_spectra(table("400;0.05;0.5\n410;0.06;0.6\n"))
    assert {name: spectrum.samples.tolist() for name, spectrum in found.items()} == {
        "column 2": [0.05, 0.06],
        "column 3": [0.5, 0.6],
    }


def test_an_empty_last_column_is_left_out(table):
    found = read_csv_spectra(table("nm,Red,\n400,0.05,\n410,0.06,\n"))
    assert {name: spectrum.samples.tolist() for name, spectrum in found.items()} == {"Red": [0.05, 0.06]}


def test_emission_may_exceed_one(table):
    assert read_csv_spectra(table(DOWN.replace("0.05", "500")), "emission")["Red"].samples[0] == 500


# Bad files.


def test_missing_file(tmp_path):
    assert refusal(tmp_path / "nowhere.csv") == [
        "nowhere.csv: no such file",
        "  try: check the path; relative paths start at the current folder",
    ]


def test_folder_in_place_of_a_file(tmp_path):
    (tmp_path / "chart.csv").mkdir()
    assert refusal(tmp_path / "chart.csv")[:2] == ["chart.csv: not a file", "  found: a folder"]


@pytest.mark.parametrize("content", ["", "\n \n"])
def test_empty_file(table, content):
    assert refusal(table(content))[0] == "paints.csv: the file is empty"


@pytest.mark.parametrize("content", ["# only words\n", "nm,Red\n", "hello\nworld\n"])
def test_file_without_a_table(table, content):
    assert refusal(table(content))[0] == "paints.csv: not a table of spectra"


def test_picture_in_place_of_a_table(table):
    lines = refusal(table(PNG))
    assert lines[0] == "paints.csv: not a text file"
    assert "PNG" in lines[1] and "expected: text with numbers in columns" in lines[2]


def test_truncated_row(table):
    assert refusal(table(DOWN[:-6])) == [
        "paints.csv: line 4: a row is cut short",
        "  found: 2 cells",
        "  expected: 3 cells, as in the header",
        "  try: the file may be truncated; export it again",
    ]


def test_row_that_is_too_long(table):
    assert refusal(table(DOWN.replace("0.06,0.2", "0.06,0.2,0.9")))[0] == "paints.csv: line 3: a row is too long"


def test_table_of_something_else(table):
    lines = refusal(table("name,price,stock\nRed,high,many\nGrey,low,few\n"))
    assert lines[:3] == [
        "paints.csv: first column: no wavelengths in this table",
        "  found: Red, Grey",
        "  expected: wavelengths in nm down the first column or across the header",
    ]


def test_word_among_the_numbers(table):
    assert refusal(table(DOWN.replace("0.06", "n/a"))) == [
        "paints.csv: line 3: not a number",
        "  found: 'n/a'",
        "  expected: a number with a point as decimal mark",
    ]


def test_decimal_commas_are_not_guessed_at(table):
    lines = refusal(table(DOWN.replace(",", ";").replace(".", ",")))
    assert lines[1:] == ["  found: '0,05'", "  expected: a number with a point as decimal mark"]


@pytest.mark.parametrize("layout", ["down", "across"])
def test_wavelengths_in_micrometres(table, layout):
    content = DOWN if layout == "down" else ACROSS
    for nm in (400, 410, 420):
        content = content.replace(str(nm), str(nm / 1000))
    lines = refusal(table(content))
    assert "wavelengths look like micrometres" in lines[0]
    assert lines[1:] == [
        "  found: 0.4 to 0.42",
        "  expected: nanometres, such as 380 to 780",
        "  try: multiply them by 1000",
    ]


@pytest.mark.parametrize("content", [DOWN, ACROSS], ids=["down", "across"])
def test_descending_wavelengths(table, content):
    swapped = content.replace("400", "x").replace("420", "400").replace("x", "420")
    lines = refusal(table(swapped))
    assert lines[0].endswith(": wavelengths do not ascend")
    assert lines[1] == "  found: 420 nm followed by 410 nm"


@pytest.mark.parametrize("content", [DOWN, ACROSS], ids=["down", "across"])
def test_duplicated_wavelength(table, content):
    lines = refusal(table(content.replace("420", "410")))
    assert lines[0].endswith(": a wavelength stands twice")
    assert lines[1] == "  found: 410 nm"


def test_nan(table):
    assert refusal(table(DOWN.replace("0.06", "nan"))) == [
        "paints.csv: Red: reflectance is not a number",
        "  found: nan at 410 nm",
        "  expected: finite values",
        "  try: remove the sample or measure it again",
    ]


def test_infinity(table):
    assert refusal(table(DOWN.replace("0.06", "inf")), "emission")[0] == "paints.csv: Red: emission is not a number"


def test_negative_reflectance(table):
    assert refusal(table(DOWN.replace("0.06", "-0.06"))) == [
        "paints.csv: Red: negative reflectance",
        "  found: -0.06 at 410 nm",
        "  expected: >= 0",
        "  try: subtract the dark reading properly, or remove the sample",
    ]


def test_reflectance_in_percent(table):
    percent = "nm,Red\n400,5.2\n410,36\n420,71.5\n"
    assert refusal(table(percent)) == [
        "paints.csv: Red: reflectance looks like percent",
        "  found: 71.5 at 420 nm",
        "  expected: fractions from 0 to 1",
        "  try: divide by 100",
    ]


def test_reflectance_just_above_one(table):
    assert refusal(table(DOWN.replace("0.06", "1.04")))[:2] == [
        "paints.csv: Red: reflectance above 1",
        "  found: 1.04 at 410 nm",
    ]


@pytest.mark.parametrize("content", [DOWN, ACROSS], ids=["down", "across"])
def test_two_spectra_of_one_name(table, content):
    assert refusal(table(content.replace("Grey", "Red"))) == [
        "paints.csv: Red: two spectra share a name",
        "  expected: each name once",
    ]


# Real files.


@pytest.mark.parametrize("name", ["colorchecker_n_ohta.csv", "colorchecker_n_ohta_transposed.csv"])
def test_real_charts_load_both_ways_round(shared_data, name):
    found = read_csv_spectra(shared_data / "spectra" / "text" / name)
    assert list(found) == [str(number) for number in range(1, 25)]
    assert found["1"].wavelengths_nm[[0, -1]].tolist() == [380.0, 780.0]
    assert found["1"].samples[0] == 0.048


def test_the_two_ways_round_are_the_same_numbers(shared_data):
    folder = shared_data / "spectra" / "text"
    down = read_csv_spectra(folder / "colorchecker_n_ohta.csv")
    across = read_csv_spectra(folder / "colorchecker_n_ohta_transposed.csv")
    for name, spectrum in down.items():
        np.testing.assert_array_equal(across[name].samples, spectrum.samples)


@pytest.mark.parametrize("name", ["X-Rite_Digital_Colour_Checker.txt", "uprtek.xls.txt"])
def test_instrument_reports_are_told_from_tables(shared_data, name):
    lines = refusal(shared_data / "spectra" / "text" / name)
    assert "no wavelengths in this table" in lines[0]
    assert "save the spectra as a plain table" in lines[-1]
