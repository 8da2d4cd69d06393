"""JCAMP-DX: plain and packed ordinates, units, blocks, and headers that the data contradict."""

from itertools import pairwise

import metamer
import numpy as np
import pytest
from metamer.cli.main import main
from metamer.runtime.errors import InputError
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.jcamp import read
from metamer.spectral.formats.registry import format_of, read_spectra

NM = np.arange(380, 721, 5)
# Per mille: slopes, a plateau, a step down and negative numbers, readings of nothing.
WHOLE = np.concatenate([np.arange(-3, 27), np.full(15, 500), 500 - 11 * np.arange(20), np.array([900, 12, 12, 12])])


def digit(number, letters, zero):
    """A number whose sign and first digit are one letter."""
    text = str(abs(number))
    if number == 0:
        return zero
    return letters[number < 0][int(text[0]) - 1] + text[1:]


def squeezed(number):
    return digit(number, ("ABCDEFGHI", "abcdefghi"), "@")


def difference(number):
    return digit(number, ("JKLMNOPQR", "jklmnopqr"), "%")


def repeated(tokens):
    """Runs of a token as it and a count."""
    out = []
    for token in tokens:
        if out and out[-1][0] == token:
            out[-1][1] += 1
        else:
            out.append([token, 1])
    return "".join(token + ("" if count == 1 else digit(count, ("STUVWXYZs", ""), "")) for token, count in out)


def lines_of(whole, abscissas, form, width=8):
    """Lines of ordinates, packed; behind differences, a line repeats the last ordinate and its abscissa."""
    out = []
    for start in range(0, len(whole), width):
        part, differs = [int(one) for one in whole[start : start + width]], form in ("DIF", "DIFDUP")
        x = f"{abscissas[start - 1 if differs and start else start]:g}"
        if differs:
            base = [int(whole[start - 1])] if start else [part.pop(0)]
            row = [*base, *part]
            tokens = [difference(b - a) for a, b in pairwise(row)]
            text = squeezed(row[0]) + (repeated(tokens) if form == "DIFDUP" else "".join(tokens))
        elif form == "SQZ":
            text = "".join(map(squeezed, part))
        elif form == "SQZDUP":
            text = repeated(list(map(squeezed, part)))
        elif form == "PAC":
            text = "".join(f"{one:+d}" for one in part)
        else:
            text = " " + "  ".join(map(str, part))
        out.append(x + text)
    if form in ("DIF", "DIFDUP"):
        out.append(f"{abscissas[-1]:g}{squeezed(int(whole[-1]))} $$ checkpoint")
    return out


def jdx(whole=WHOLE, x=NM, form="FIX", end="\n", drop=(), lines=None, **header):
    """A file of one block; keywords replace records, and None in their place leaves them out."""
    records = {
        "TITLE": "Ton 3", "JCAMP-DX": "4.24 $$ by a test", "DATA TYPE": "UV/VIS SPECTRUM", "ORIGIN": "a test",
        "XUNITS": "NANOMETERS", "YUNITS": "REFLECTANCE", "XFACTOR": "1", "YFACTOR": "0.001", "FIRSTX": f"{x[0]:g}",
        "LASTX": f"{x[-1]:g}", "NPOINTS": str(len(x)), "FIRSTY": f"{whole[0] / 1000:g}",
    }  # fmt: skip
    records |= {key.replace("_", " "): value for key, value in header.items()}
    head = [f"##{key}= {value}" for key, value in records.items() if value is not None]
    data = lines_of(whole, x, form) if lines is None else lines
    data = [line for number, line in enumerate(data) if number not in drop]
    return end.join([*head, "##XYDATA= (X++(Y..Y))", *data, "##END=", ""])


FORMS = ("FIX", "PAC", "SQZ", "SQZDUP", "DIF", "DIFDUP")


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("descending", [False, True])
def test_every_form_of_ordinates(written, form, descending):
    turn = slice(None, None, -1 if descending else 1)
    path = written(jdx(WHOLE[turn], NM[turn], form, end="\r\n"), "of any name")
    assert format_of(path).NAME == "JCAMP-DX"
    file = read_spectra(path)
    (entry,) = file.entries
    assert entry.name == "Ton 3" and entry.spectrum.quantity == "reflectance"
    assert entry.spectrum.wavelengths_nm == pytest.approx(NM)
    assert entry.spectrum.samples == pytest.approx(np.maximum(WHOLE, 0) / 1000.0, abs=1e-12)
    assert entry.taken.startswith("reflectance in fractions, by YUNITS REFLECTANCE")
    assert entry.details["data type"] == "UV/VIS SPECTRUM" and entry.details["origin"] == "a test"


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("dropped", [1, 4])
def test_a_line_that_is_missing(refused, form, dropped):
    said = "\n".join(refused(read, jdx(form=form, drop=(dropped,)), "a.jdx"))
    assert "a.jdx: Ton 3, ##XYDATA, line " in said and "abscissa" in said


@pytest.mark.parametrize("form", FORMS)
def test_ordinates_that_are_missing(refused, form):
    """The last of a line, the first that is behind differences, and the whole last line."""
    lines = lines_of(WHOLE, NM, form)
    head = "".join(refused(read, jdx(lines=lines[:-2]), "a.jdx"))
    assert "not as many points as are stated" in head and "69" in head
    short = [lines[0][: max(3, lines[0].rfind("K" if "DIF" in form else " "))], *lines[1:]]
    if form in ("FIX", "DIF"):
        assert "line" in refused(read, jdx(lines=short), "a.jdx")[0]


def test_the_check_of_differences(refused):
    lines = lines_of(WHOLE, NM, "DIF")
    lines[2] = lines[2].replace("J", "K", 1)
    said = refused(read, jdx(lines=lines), "a.jdx")
    assert "the check of the line before fails" in said[0]
    assert "the last ordinate once more" in "".join(said)


@pytest.mark.parametrize(
    ("records", "field", "found"),
    [
        ({"FIRSTX": "385"}, "XYDATA", "380"),
        ({"LASTX": "800"}, "XYDATA", "abscissa"),
        ({"FIRSTX": "382"}, "FIRSTX", "382"),
        ({"LASTX": "722", "DELTAX": "5"}, "LASTX", "722"),
        ({"LASTX": "718", "DELTAX": "-5"}, "LASTX", "718"),
        ({"XFACTOR": "10"}, "XYDATA", "3800"),
        ({"NPOINTS": "68"}, "XYDATA", "abscissa"),
        ({"NPOINTS": "70"}, "XYDATA", "abscissa"),
        ({"NPOINTS": "1000000000"}, "NPOINTS", "1e+09"),
        ({"NPOINTS": "69.5"}, "NPOINTS", "69.5"),
        ({"YFACTOR": "0.01"}, "FIRSTY", "-0.003"),
        ({"YFACTOR": "0"}, "YFACTOR", "0"),
        ({"FIRSTY": "0.5"}, "FIRSTY", "0.5"),
        ({"MAXY": "0.8"}, "MAXY", "0.8"),
        ({"DELTAX": "10"}, "DELTAX", "10"),
        ({"XUNITS": "SECONDS"}, "XUNITS", "SECONDS"),
        ({"FIRSTX": "4x"}, "FIRSTX", "4x"),
        ({"FIRSTX": "4E999"}, "Ton 3", "4E999"),
        ({"DATA TYPE": "RAMAN SPECTRUM"}, "DATA TYPE", "RAMAN"),
        *(
            ({label: None}, label, "missing")
            for label in ("FIRSTX", "LASTX", "NPOINTS", "XFACTOR", "YFACTOR", "XUNITS")
        ),
    ],
)
def test_headers_that_the_data_contradict(refused, records, field, found):
    said = "\n".join(refused(read, jdx(**records), "a.jdx"))
    assert "a.jdx: Ton 3" in said and field in said and found in said and "expected" in said


def test_an_abscissa_that_is_written_with_few_digits_is_no_contradiction(written):
    """Steps of 1.3 nm with abscissas and DELTAX in whole numbers or one decimal."""
    x = 380.0 + 1.3 * np.arange(NM.size)
    for digits, delta in ((0, "1"), (1, "1.3")):
        lines = lines_of(WHOLE, x.round(digits), "FIX")
        file = read(written(jdx(x=x.round(4), lines=lines, DELTAX=delta), "a.jdx"))
        np.testing.assert_allclose(file.entries[0].spectrum.wavelengths_nm, x, atol=1e-6)


@pytest.mark.parametrize("units", ["ABSORBANCE", "Kubelka-Munk", "log(1/R)", "OPTICAL DENSITY", "K/S"])
@pytest.mark.parametrize("answer", [ImportOptions(), ImportOptions("reflectance", "fraction", against="overruled")])
def test_functions_of_a_reflectance_are_never_one(written, units, answer):
    with pytest.raises(InputError, match="YUNITS: not a reflectance"):
        read(written(jdx(YUNITS=units)), answer)


@pytest.mark.parametrize("units", ["ARBITRARY UNITS", "", "COUNTS"])
def test_arbitrary_units_are_asked_about(written, refused, units):
    text = jdx(YUNITS=units)
    lines = refused(read, text, "a.jdx")
    assert "what was measured?" in lines[0] and "--as" in lines[-1]
    (entry,) = read(written(text), ImportOptions("transmittance", "fraction")).entries
    assert entry.spectrum.quantity == "transmittance" and entry.taken.endswith("by --as; fraction by --scale")


@pytest.mark.parametrize(
    ("units", "quantity"),
    [("%R", "reflectance"), ("% TRANSMITTANCE", "transmittance"), ("%T", "transmittance"),
     ("PERCENT REFLECTANCE", "reflectance")],
)  # fmt: skip
def test_percent_by_the_units(written, units, quantity):
    (entry,) = read(written(jdx(YUNITS=units, YFACTOR="0.1", FIRSTY="-0.3"))).entries
    assert entry.spectrum.quantity == quantity
    assert entry.spectrum.samples == pytest.approx(np.maximum(WHOLE, 0) / 1000.0)


def test_percent_that_is_called_a_fraction_is_asked_about(written, refused):
    text = jdx(YUNITS="TRANSMITTANCE", YFACTOR="0.1", FIRSTY="-0.3")
    assert "transmittance looks like percent" in refused(read, text, "a.jdx")[0]
    (entry,) = read(written(text), ImportOptions(scale="percent")).entries
    assert entry.spectrum.samples.max() == pytest.approx(0.9)


@pytest.mark.parametrize(
    ("units", "per_unit", "x"),
    [("MICROMETERS", 1e3, np.array([0.4, 0.5, 0.6])), ("ANGSTROMS", 0.1, np.array([4000, 5000, 6000])),
     ("1/CM", None, np.array([15000, 20000, 25000])), ("cm-1", None, np.array([25000, 20000, 15000]))],
)  # fmt: skip
def test_other_axes_are_converted_with_a_word(written, units, per_unit, x):
    file = read(written(jdx(np.array([300, 400, 500]), x, XUNITS=units)))
    nm = 1e7 / x if per_unit is None else x * per_unit
    assert file.entries[0].spectrum.wavelengths_nm == pytest.approx(np.sort(nm))
    assert file.entries[0].spectrum.samples == pytest.approx(np.array([0.3, 0.4, 0.5])[np.argsort(nm)])
    assert any(note.startswith("the axis is in") for note in file.notes)


def test_power_over_wavenumbers_is_refused(refused):
    text = jdx(np.array([300, 400, 500]), np.array([15000, 20000, 25000]), XUNITS="1/CM", YUNITS="IRRADIANCE")
    assert "spectral power over a frequency" in refused(read, text, "a.jdx")[0]


POINTS = """##TITLE= Glass
##XUNITS= NM
##YUNITS= TRANSMITTANCE
##NPOINTS= 4
##FIRSTX= {first}
##LASTX= 700
##XYPOINTS= (XY..XY)
{data}
##END=
"""


@pytest.mark.parametrize(
    "data",
    [
        "400, 0.5\n500, 0.6\n650, 0.7\n700, 0.8",
        "400,0.5; 500,0.6; 650,0.7; 700,0.8",
        "400 0.5 500 0.6\n650 0.7 700 0.8",
    ],
)
def test_points_that_state_their_abscissas(written, data):
    (entry,) = read(written(POINTS.format(first=400, data=data))).entries
    assert entry.spectrum.wavelengths_nm.tolist() == [400, 500, 650, 700]
    assert entry.spectrum.samples.tolist() == [0.5, 0.6, 0.7, 0.8]


@pytest.mark.parametrize(
    ("first", "data", "said"),
    [
        (410, "400, 0.5\n500, 0.6\n650, 0.7\n700, 0.8", "FIRSTX"),
        (400, "400, 0.5\n500, 0.6\n650, 0.7", "NPOINTS"),
        (400, "400, 0.5\n500, 0.6\n650, 0.7\n700", "not pairs"),
        (400, "400, 0.5\n500, abc\n650, 0.7\n700, 0.8", "abc"),
    ],
)
def test_points_that_are_wrong(refused, first, data, said):
    assert said in "\n".join(refused(read, POINTS.format(first=first, data=data), "a.dx"))


def test_decimal_commas(written):
    text = jdx(XFACTOR="1,0", YFACTOR="0,001", FIRSTX="380,0", LASTX="720,0", FIRSTY="-0,003")
    assert read(written(text)).entries[0].spectrum.samples.max() == pytest.approx(0.9)


def test_rounded_abscissas_and_headers_are_no_contradiction(written):
    """Abscissas without their decimals, a step and a factor of few digits."""
    x = 380.0 + 0.7 * np.arange(WHOLE.size)
    for cut in (np.round, np.floor):
        lines = [f"{cut(x[start]):.0f} " + " ".join(map(str, WHOLE[start : start + 7])) for start in range(0, 69, 7)]
        text = jdx(x=x, lines=lines, FIRSTX="380.0", LASTX="427.6", DELTAX="0.70", FIRSTY="-0.00300", MAXY="0.9")
        assert read(written(text)).entries[0].spectrum.wavelengths_nm == pytest.approx(x)


def test_a_gap_is_left_out(written):
    lines = lines_of(WHOLE, NM, "FIX")
    lines[3] = lines[3].replace(" 21 ", " ? ")
    (entry,) = read(written(jdx(lines=lines))).entries
    assert entry.spectrum.samples.size == NM.size - 1 and entry.details["missing samples"] == "1 of 69"


def test_blocks_of_a_link(written):
    peaks = "##TITLE= peaks\n##NPOINTS= 1\n##PEAK TABLE= (XY..XY)\n400, 1\n##END=\n"
    formula = "##TITLE= formula\n##DATA TYPE= MOLFORM\n##END=\n"
    text = "##TITLE= all\n##DATATYPE= Link\n##BLOCKS= 5\n" + jdx(TITLE="One") + formula + peaks
    text += jdx(TITLE="Two", YUNITS="ABSORBANCE") + jdx(TITLE="Three", form="DIFDUP") + "##END=\n"
    file = read(written(text))
    assert [entry.name for entry in file.entries] == ["One", "Three"]
    assert [name for name, _ in file.rejected] == ["peaks", "Two"]
    assert "1 blocks without a spectrum are left out" in file.notes


@pytest.mark.parametrize(
    "data",
    [
        "400S",
        "400A00J.5",
        "400A00 x",
        "400A0099999999999999999",
        "400 1.2.3",
        "400",
        "A00",
        "400A0TZ999999",
        "400 1.5J",
    ],
)
def test_what_is_no_ordinate(refused, data):
    assert "##XYDATA, line" in refused(read, jdx(lines=[data]), "a.jdx")[0] or data == "400A0TZ999999"


@pytest.mark.parametrize("form", ["(X++(R..R))", "(T2+(Y..Y))", ""])
def test_other_forms_of_data(refused, form):
    assert "not a form of spectra" in refused(read, jdx().replace("(X++(Y..Y))", form), "a.jdx")[0]


def test_commands_and_scripts_take_it(written, tmp_path, capsys):
    path = written(
        "##TITLE= all\n##DATA TYPE= LINK\n" + jdx(TITLE="A") + jdx(WHOLE // 2 * 2, TITLE="B", FIRSTY=None) + "##END=",
        "t.jdx",
    )
    with pytest.warns(UserWarning, match="below zero"):
        assert list(metamer.read_spectra(path)) == ["A", "B"]
    assert main(["catalogue", "import", str(path), "--catalogue", str(tmp_path / "c"), "--dry-run"]) == 0
    assert "2 to import" in capsys.readouterr().out
    assert main(["match", f"{path}#A", f"{path}#B"]) in (0, 1) and "B" in capsys.readouterr().out
