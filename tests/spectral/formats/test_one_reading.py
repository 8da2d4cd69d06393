"""A table is read where one separator and one decimal mark explain all of its rows; else it is asked about."""

from itertools import product

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.formats.colours_only import colour_in, read_colours
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.registry import read_spectra
from metamer.spectral.measurement import Measurement

NM = np.arange(400, 701, 20)
RED = 6.2 + 57.0 / (1.0 + np.exp(-(NM - 583.0) / 13.0))
GREEN = 30.0 + 20.0 * np.sin(NM / 70.0)
PERCENT = ImportOptions("reflectance", "percent")
BETWEEN = ("\t", ";", " ", "   ", " ; ", ",", ", ")


def number(value, decimals, mark):
    return f"{value:.{decimals}f}".replace(".", mark)


def down(columns, heads, between, mark, decimals=(1, 3), trailing=""):
    rows = [
        between.join([number(nm, decimals[0], mark), *(number(column[at], decimals[1], mark) for column in columns)])
        for at, nm in enumerate(NM)
    ]
    return "".join(f"{row}{trailing}\n" for row in ([between.join(heads)] if heads else []) + rows)


def across(columns, between, mark):
    rows = [between.join(["Name", *map(str, NM)])]
    for place, column in enumerate(columns):
        rows.append(between.join([f"s{place}", *(number(value, 2, mark) for value in column)]))
    return "".join(f"{row}\n" for row in rows)


def check(path, columns, decimals):
    entries = read_spectra(path, PERCENT).entries
    assert len(entries) == len(columns)
    for entry, column in zip(entries, columns, strict=True):
        np.testing.assert_allclose(entry.spectrum.wavelengths_nm, NM)
        np.testing.assert_allclose(100.0 * entry.spectrum.samples, np.round(column, decimals), atol=1e-9)


@pytest.mark.parametrize("heads", [(), ("nm", "A", "B"), ("Wavelength (nm)", "R (%)", "G (%)")])
@pytest.mark.parametrize("mark", [",", "."])
@pytest.mark.parametrize("between", BETWEEN[:5])
def test_spaces_tabs_and_semicolons_leave_no_doubt_of_the_decimal_mark(written, between, mark, heads):
    for count, places in product((1, 2), ((0, 1), (1, 2), (0, 3), (2, 4))):
        columns = (RED, GREEN)[:count]
        content = down(columns, heads[: count + 1], between, mark, places, between.strip())
        check(written(content, "red.txt"), columns, places[1])
    check(written(across((RED, GREEN), between, mark), "chart.txt"), (RED, GREEN), 2)


@pytest.mark.parametrize("between", BETWEEN)
def test_quoted_numbers_keep_their_decimal_commas(written, between):
    content = "\n".join(
        between.join(f'"{cell}"' for cell in line.split(";"))
        for line in down((RED, GREEN), ("nm", "A", "B"), ";", ",").splitlines()
    )
    check(written(content, "red.txt"), (RED, GREEN), 3)


@pytest.mark.parametrize("trailing", ["", ","])
@pytest.mark.parametrize("heads", [(), ("nm", "R (%)"), ("Wavelength (nm)", "Reflectance (%)", "G (%)")])
@pytest.mark.parametrize("between", [",", ", "])
def test_commas_between_cells_and_in_numbers_are_never_taken_apart(written, between, heads, trailing):
    for places in ((0, 1), (1, 1), (0, 2), (2, 2), (0, 3)):
        columns = (RED, GREEN)[: max(len(heads) - 1, 1)]
        path = written(down(columns, heads, between, ",", places, trailing))
        try:
            check(path, columns, places[1])
        except InputError as refusal:
            assert refusal.problem in {
                "a row is too long",
                "two ways to read the table",
                "no way to read the table explains this row",
                "wavelengths without values",
            }


def test_more_cells_than_headings_are_shown(refused):
    said = refused(lambda path: read_spectra(path), "nm,R (%)\n400,0,7,1\n410,0,7,7\n420,0,8,6\n")
    assert said[:3] == [
        "paints.csv: line 2: a row is too long",
        "  found: 4 cells: 400 | 0 | 7 | 1",
        "  expected: 2 cells, as in the header",
    ]
    assert "semicolons or tabs" in said[-1]


DOUBTFUL = {
    "whole numbers, or pairs of them": ("400,7,1\n410,7,8\n420,8,7\n", "400 | 7 | 1, or 400 | 7,1"),
    "four whole numbers": ("400,0,7,1\n410,0,7,8\n420,0,8,7\n", "400 | 0 | 7 | 1, or 400,0 | 7,1"),
    "decimals or thousands": ("nm;W\n400;999\n410;1,001\n420;1,020\n", "410 | 1,001, or 410 | 1001"),
    "thousands by points": ("nm\tW\n400\t980\n410\t1.001\n420\t1.020\n", "410 | 1.001, or 410 | 1001"),
}


#: Headings that leave whole numbers between commas in doubt, with the second way to read them, and such that do not.
_ROWS = "400,7,1\n410,7,8\n420,8,7\n"
_LONG = "400,7,1,8,2\n410,7,8,8,2\n420,8,7,8,3\n"
DOUBTFUL["wavelengths with decimals, or a column"] = (
    "400,5,7,1\n410,5,7,8\n420,6,8,7\n",
    "400 | 5 | 7 | 1, or 400,5 | 7,1",
)
DOUBTFUL |= {
    f"whole numbers below {heads!r}": (f"{heads}\n{rows}", shown)
    for heads, rows, shown in (
        ("nm,A,Remark", _ROWS, "400 | 7 | 1, or 400 | 7,1"),
        ("nm,A,Bemerkung", _ROWS, "400 | 7 | 1, or 400 | 7,1"),
        ("wavelength,power,Comments", _ROWS, "400 | 7 | 1, or 400 | 7,1"),
        ("# nm,A,Remark", _ROWS, "400 | 7 | 1, or 400 | 7,1"),
        ("nm,A,Remark,Flag", _ROWS, "400 | 7 | 1, or 400 | 7,1"),
        ("nm,A,B,Notes,Status", _LONG, "400 | 7 | 1 | 8 | 2, or 400 | 7,1 | 8,2"),
    )
}


@pytest.mark.parametrize(
    ("heads", "rows", "first"),
    [
        ("nm,A,B", _ROWS, [[7.0, 7.0, 8.0], [1.0, 8.0, 7.0]]),
        ("nm,A,Remark", "400,7,ok\n410,7,bad\n420,8,ok\n", [[7.0, 7.0, 8.0]]),
        ("nm,A,Remark", "400,7.5,1\n410,7.0,8\n420,8.5,7\n", [[7.5, 7.0, 8.5]]),
        ("nm,A,Remark", '400,"7",1\n410,"7",8\n420,"8",7\n', [[7.0, 7.0, 8.0]]),
        ("nm,A,B,C,Remark", _LONG, [[7.0, 7.0, 8.0], [1.0, 8.0, 7.0]]),
    ],
)
def test_headings_with_a_cell_each_are_read(written, heads, rows, first):
    entries = read_spectra(written(f"{heads}\n{rows}"), ImportOptions("emission")).entries
    assert [entry.spectrum.samples.tolist() for entry in entries][: len(first)] == first


@pytest.mark.parametrize("kind", DOUBTFUL)
def test_two_ways_to_read_a_table_are_both_shown(written, kind):
    content, shown = DOUBTFUL[kind]
    path = written(content)
    with pytest.raises(InputError, match="two ways to read the table") as caught:
        read_spectra(path, ImportOptions("emission"))
    assert shown in str(caught.value)
    advised = [mark for mark in ("comma", "point") if f"--decimal {mark}" in str(caught.value)]
    for mark in ("comma", "point"):
        answer = ImportOptions("emission", decimal=mark)
        if mark in advised:
            assert read_spectra(path, answer).entries
        else:
            with pytest.raises(InputError, match="does not tell its cells apart"):
                read_spectra(path, answer)
    assert advised
    assert len(advised) == 2 or "thousand" in kind or "or a column" in kind


def test_the_decimal_mark_that_a_person_says_settles_it(written):
    whole = read_spectra(written("400,7,1\n410,7,8\n420,8,7\n"), ImportOptions("emission", decimal="point"))
    assert [entry.spectrum.samples.tolist() for entry in whole.entries] == [[7, 7, 8], [1, 8, 7]]
    decimals = written("nm;W\n400;999\n410;1,001\n420;1,020\n")
    (entry,) = read_spectra(decimals, ImportOptions("emission", decimal="comma")).entries
    assert entry.spectrum.samples.tolist() == [999.0, 1.001, 1.02]
    with pytest.raises(InputError, match="--decimal point does not tell its cells apart"):
        read_spectra(decimals, ImportOptions("emission", decimal="point"))


@pytest.mark.parametrize(
    ("heads", "rows", "name", "values"),
    [
        ("nm,A,Remark", _ROWS, "A", [[7.1, 7.8, 8.7]]),
        ("# nm,A,Remark", _ROWS, "A", [[7.1, 7.8, 8.7]]),
        ("nm,A,Remark,Flag", _ROWS, "A", [[7.1, 7.8, 8.7]]),
        ("", _ROWS, "", [[7.1, 7.8, 8.7]]),
        ("", "400,0,7,1\n410,0,7,8\n420,0,8,7\n", "", [[7.1, 7.8, 8.7]]),
        ("nm,A,B,Notes,Status", _LONG, "A", [[7.1, 7.8, 8.7], [8.2, 8.2, 8.3]]),
    ],
)
def test_decimal_commas_between_commas_are_read_where_a_person_says_so(written, heads, rows, name, values):
    entries = read_spectra(written(f"{heads}\n{rows}"), ImportOptions("emission", decimal="comma")).entries
    assert [entry.spectrum.samples.tolist() for entry in entries] == values
    assert entries[0].spectrum.wavelengths_nm.tolist() == [400.0, 410.0, 420.0]
    assert not name or entries[0].name == name


@pytest.mark.parametrize("row", ["430,8", "430,8,7,1", "430,8.5,1"])
def test_a_row_further_down_that_is_of_no_pairs_is_refused(written, row):
    rows = "".join(f"{400 + at},7,{at % 10}\n" for at in range(2100))
    with pytest.raises(InputError):
        read_spectra(
            written(f"nm,A,Remark\n{rows}{row.replace('430', '2600')}\n"), ImportOptions("emission", decimal="comma")
        )


def test_a_decimal_mark_leaves_alone_what_a_table_tells_itself(written):
    check(written(down((RED,), ("nm", "A"), ",", ".")), (RED,), 3)
    path = written(down((RED,), ("nm", "A"), ",", "."))
    (entry,) = read_spectra(path, ImportOptions("reflectance", "percent", decimal="comma")).entries
    np.testing.assert_allclose(100.0 * entry.spectrum.samples, np.round(RED, 3), atol=1e-9)


@pytest.mark.parametrize("row", ["440;7.09,8.10;5", "440,0;7,09", "440;1.234,5;3", "440;7 09;5"])
def test_a_row_in_another_dialect_is_refused_with_all_of_its_table(written, row):
    content = "nm;A;B\n" + "".join(f"{nm};{nm / 10:.1f};20.5\n" for nm in (400, 410, 420, 430))
    with pytest.raises(InputError, match=r"no way to read the table explains this row|a row is cut short"):
        read_spectra(written(content + row + "\n450;45.5;20.5\n"), PERCENT)


def test_a_title_above_numbers_is_no_header_of_fewer_columns(written):
    entries = read_spectra(written("Measured;by A. Smith\n400;5.5;6.5\n410;5.6;6.6\n420;5.7;6.7\n"), PERCENT).entries
    assert [entry.name for entry in entries] == ["column 2", "column 3"]


@pytest.mark.parametrize(("between", "mark"), [(";", ","), ("\t", ","), (",", "."), (";", ".")])
def test_colours_in_a_table_keep_their_decimals(written, between, mark):
    cells = [["Name", "L*", "a*", "b*"], *([f"s{at}", f"{50.5 + at}", "40.25", "-3.5"] for at in range(3))]
    content = "\n".join(between.join(row) for row in cells).replace(".", mark)
    first, *others = read_colours(written(content))
    (colour,) = first.stated
    assert colour.values.tolist() == [50.5, 40.25, -3.5] and len(others) == 2


@pytest.mark.parametrize("row", ["red,50,5,40,2,-3,5", "red,50,5,40,-3"])
def test_colours_whose_commas_are_two_things_are_refused(written, row):
    with pytest.raises(InputError, match="a row is too long"):
        read_colours(written(f"Name,L*,a*,b*\n{row}\n"))


APART = {
    "SCI and SCE": (("SCI", "SCE"), "specular component"),
    "angles": (("45as15", "45as110"), "geometry"),
    "geometries": (("45/0", "d/8"), "geometry"),
    "conditions": (("M0", "M1"), "measurement condition"),
}


@pytest.mark.parametrize("kind", APART)
@pytest.mark.parametrize("head", ["{}*({})", "{}* [{}]", "{}* {}", "{}*({}, D65/10°)"])
def test_colours_below_headings_that_differ_are_readings_apart(written, kind, head):
    """The first of them alone was read before, without a word."""
    words, part = APART[kind]
    heads = ",".join(f'"{head.format(axis, word)}"' for word in words for axis in "Lab")
    one, two = read_colours(written(f"Illuminant: D65\nName,{heads}\nred,50,40,30,45,42,33\n"))
    assert [one.stated[0].values.tolist(), two.stated[0].values.tolist()] == [[50, 40, 30], [45, 42, 33]]
    measured = [Measurement.of(None, each.details, each.name) for each in (one, two)]
    assert one.name != two.name and measured[0].differing(measured[1]) == (part,)


def test_colours_for_two_lights_are_of_one_reading(written):
    heads = ",".join(f"{axis}*({light}/10°)" for light in ("D65", "A") for axis in "Lab")
    (one,) = read_colours(written(f"Name,{heads}\nred,50,40,30,55,42,33\n"))
    assert [(each.illuminant, each.observer) for each in one.stated] == [("D65", "1964_10"), ("A", "1964_10")]


@pytest.mark.parametrize("above", ["", ",SCI,,,SCE,,\n"])
def test_headings_of_colours_that_stand_twice_are_asked_about(written, above):
    with pytest.raises(InputError, match="two columns of one heading"):
        read_colours(written(f"{above}Name,L*,a*,b*,L*,a*,b*\nred,50,40,30,45,42,33\n"))


@pytest.mark.parametrize(
    "heads", ["Angle,Name", "Name,Angle", "Illuminant,Observer,Name", "SCI/SCE,Name", "Geometry,Name"]
)
def test_the_name_of_a_row_is_no_condition(written, heads):
    cells = {"Name": "red", "Angle": "15", "Illuminant": "A", "Observer": "2°", "SCI/SCE": "SCE", "Geometry": "45as15"}
    row = ",".join(cells[head] for head in heads.split(","))
    (one,) = read_colours(written(f"Illuminant: D65/10°\n{heads},L*,a*,b*\n{row},50,40,30\n"))
    (colour,) = one.stated
    assert one.name == "red"
    lit = ("A", "1931_2") if "Illuminant" in heads else ("D65", "1964_10")
    assert (colour.illuminant, colour.observer) == lit


@pytest.mark.parametrize("form", ["table", "cgats", "words"])
def test_xyz_of_a_scale_to_1_are_no_blacks(written, form):
    table = "Illuminant: D65/10\nName,X,Y,Z\nred,{},{},{}\nwhite,{},{},{}\n"
    cgats = "CGATS.17\nNUMBER_OF_FIELDS 4\nBEGIN_DATA_FORMAT\nSAMPLE_ID XYZ_X XYZ_Y XYZ_Z\nEND_DATA_FORMAT\n"
    cgats += "NUMBER_OF_SETS 2\nBEGIN_DATA\n1 {} {} {}\n2 {} {} {}\nEND_DATA\n"
    for scale in (1.0, 100.0):
        numbers = [scale * value for value in (0.301, 0.282, 0.203, 0.94, 1.0, 1.07)]
        text = {"table": table, "cgats": cgats, "words": "xyz:{},{},{}@D65/1964_10"}[form].format(*numbers)
        path = None if form == "words" else written(text, "red.csv" if form == "table" else "red.txt")
        if scale == 1.0:
            with pytest.raises(InputError, match="scale to 1"):
                colour_in(text) if path is None else read_colours(path)
            continue
        found = colour_in(text) if path is None else read_colours(path)[0].stated[0]
        assert found.values.tolist() == pytest.approx(numbers[:3])
    if form == "table":
        black = written("Illuminant: D65/10\nName,X,Y,Z\nblack,0.31,0.33,0.35\n")
        assert read_colours(black, ImportOptions(scale="percent"))[0].stated[0].values.tolist() == [0.31, 0.33, 0.35]


@pytest.mark.parametrize("places", [(0, 2), (1, 1), (1, 2), (2, 3)])
@pytest.mark.parametrize("heads", [(), ("nm", "A"), ("Wavelength (nm)", "R (%)")])
@pytest.mark.parametrize("between", ["|", " | ", "~", "&", "^", "/", "\\", "_", "=", ":", ",,", "->", "*", "@"])
def test_signs_that_part_cells_beside_decimal_commas_are_read_or_refused(written, between, heads, places):
    """Never as the decimals behind the comma: "400,0/7,09" has no reading in which 09 is a value."""
    path = written(down((RED,), heads, between, ",", places))
    try:
        check(path, (RED,), places[1])
    except InputError:
        assert between.strip() != "|"


@pytest.mark.parametrize("mark", [",", "."])
@pytest.mark.parametrize("ends", [("", ""), ("| ", " |")])
def test_bars_part_cells_as_in_markdown(written, mark, ends):
    rows = down((RED, GREEN), ("nm", "A", "B"), " | ", mark).splitlines()
    rows.insert(1, "--- | --- | ---")
    check(written("".join(f"{ends[0]}{row}{ends[1]}\n" for row in rows), "red.txt"), (RED, GREEN), 3)


def test_dates_times_and_empty_columns_beside_numbers_are_no_torn_cells(written):
    rows = [f"{nm},12:30,2024-05-01,,{value:.3f}" for nm, value in zip(NM, RED, strict=True)]
    check(written("\n".join(["nm,time,date,,A", *rows, ""])), (RED,), 3)


@pytest.mark.parametrize("between", [";", "\t", "  ", ","])
@pytest.mark.parametrize("heading", [",", ";", "\t", "  "])
def test_headings_parted_by_another_sign_are_those_of_the_columns(written, between, heading):
    heads = heading.join(["nm", "Red R%", "Green T%", "Blue R%"])
    rows = down((RED, GREEN, RED), [], between, ".")
    entries = read_spectra(written(f"{heads}\n{rows}")).entries
    assert [entry.name for entry in entries] == ["Red R%", "Green T%", "Blue R%"]
    assert [entry.spectrum.quantity for entry in entries] == ["reflectance", "transmittance", "reflectance"]


@pytest.mark.parametrize("heads", ["nm,Red R%,Blue R%", "nm,%R,%T", "nm,Reflectance,Transmittance,Remark"])
def test_headings_of_measurements_that_no_row_has_are_asked_about(written, heads):
    with pytest.raises(InputError, match="more headings than columns"):
        read_spectra(written(f"{heads}\n{down((RED,), [], ',', '.')}"))
