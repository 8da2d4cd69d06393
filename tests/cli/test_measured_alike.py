"""Readings that were not measured alike: they are compared by no command until somebody asks for it."""

from __future__ import annotations

import json

import numpy as np
import pytest

NM = np.arange(400, 701, 10)
RED = 0.062 + 0.57 / (1.0 + np.exp(-(NM - 583.0) / 13.0))


def cgats(path, tables, factor=1.0):
    """Tables of keywords, each with one reading called red; each reading is a percent brighter than that before."""
    lines = ["CGATS.17"]
    for place, keywords in enumerate(tables):
        lines += [f'{key} "{value}"' for key, value in ({"MEAS_TYPE": "REFLECTIVE"} | keywords).items()]
        lines += [f"NUMBER_OF_FIELDS {NM.size + 1}", "BEGIN_DATA_FORMAT"]
        lines += [" ".join(["SAMPLE_NAME", *(f"SPECTRAL_NM{one}" for one in NM)]), "END_DATA_FORMAT"]
        values = " ".join(f"{value:.5f}" for value in factor * RED * 1.01**place)
        lines += ["NUMBER_OF_SETS 1", "BEGIN_DATA", f"red {values}", "END_DATA"]
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return path


def table(path, header, factor=1.0):
    """A CSV with lines above its table and one reading called red."""
    lines = ["Reflectance, fraction", *header, "nm,red"]
    lines += [f"{nm},{value:.5f}" for nm, value in zip(NM, factor * RED, strict=True)]
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return path


GEOMETRIES = {
    "45:0": "<SingleAngle><SingleAngleConfiguration>Annular</SingleAngleConfiguration>"
    "<IlluminationAngle>45</IlluminationAngle><MeasurementAngle>0</MeasurementAngle></SingleAngle>",
    "SCI": "<SphereGeometry>Specular_Included</SphereGeometry>",
    "SCE": "<SphereGeometry>Specular_Excluded</SphereGeometry>",
}


def cxf(path, geometry="45:0", device="", after="", kind="Reflectance", factor=1.0, name="red"):
    """A CxF3 file of one spectrum; `device` and `after` are elements of its specification."""
    values = " ".join(f"{value:.5f}" for value in factor * RED)
    path.write_text(
        f'<CxF xmlns="http://colorexchangeformat.com/CxF3-core"><Resources><ObjectCollection>'
        f'<Object Id="o" Name="{name}" ObjectType="Standard"><ColorValues>'
        f'<{kind}Spectrum ColorSpecification="s" StartWL="400">{values}</{kind}Spectrum></ColorValues></Object>'
        f'</ObjectCollection><ColorSpecificationCollection><ColorSpecification Id="s"><MeasurementSpec>'
        f"<MeasurementType>Spectrum_{kind}</MeasurementType>"
        f"<GeometryChoice>{GEOMETRIES[geometry]}</GeometryChoice>"
        f'<WavelengthRange StartWL="400" Increment="10"/>{after}<Device>{device}</Device>'
        f"</MeasurementSpec></ColorSpecification></ColorSpecificationCollection></Resources></CxF>",
        encoding="utf-8",
    )
    return path


M0, M1 = (
    "<DeviceIllumination>M0_Incandescent</DeviceIllumination>",
    "<DeviceIllumination>M1_Daylight</DeviceIllumination>",
)
BLACK = "<Backing>black</Backing>"
PAIRS = {
    "d:8 beside 45:0": (lambda p: cxf(p / "a.cxf"), lambda p: cxf(p / "b.cxf", "SCI", factor=1.02), "geometry"),
    "SCI beside SCE": (lambda p: cxf(p / "a.cxf", "SCE"), lambda p: cxf(p / "b.cxf", "SCI", factor=1.02), "geometry"),
    "M0 beside M1": (
        lambda p: cxf(p / "a.cxf", device=M0),
        lambda p: cxf(p / "b.cxf", device=M1, factor=1.02),
        "condition",
    ),
    "backings": (
        lambda p: cxf(p / "a.cxf", after=BLACK),
        lambda p: cgats(p / "b.txt", [{"SAMPLE_BACKING": "white"}], 1.02),
        "condition",
    ),
    "CxF beside CGATS": (
        lambda p: cxf(p / "a.cxf", "SCI"),
        lambda p: cgats(p / "b.txt", [{"MEASUREMENT_GEOMETRY": "0/45"}], 1.02),
        "geometry",
    ),
    "headers of text": (
        lambda p: table(p / "a.csv", ["Specular component: SCI", "Geometry: d/8"]),
        lambda p: table(p / "b.csv", ["Specular component,SCE", "Geometry,d/8"], 1.02),
        "geometry",
    ),
    "filters": (
        lambda p: cgats(p / "a.txt", [{"MEASUREMENT_SOURCE": "Illumination=D50 WhiteBase=Abs Filter=UVcut"}]),
        lambda p: cgats(p / "b.txt", [{"FILTER": "No"}], 1.02),
        "condition",
    ),
}


@pytest.mark.parametrize("kind", PAIRS)
@pytest.mark.parametrize("command", [("match",), ("report", "compare")])
def test_readings_that_were_not_measured_alike_are_refused(metamer, tmp_path, command, kind):
    make_one, make_other, crossing = PAIRS[kind]
    one, other = make_one(tmp_path), make_other(tmp_path)
    code, _, err = metamer(*command, one, other)
    assert code == 3 and one.name in err and other.name in err and f"--across {crossing}" in err
    page, figures = tmp_path / "p.html", tmp_path / "f.json"
    code, _, _ = metamer(*command, one, other, "--across", crossing, "--html", page, "--json", figures)
    (said,) = json.loads(figures.read_text(encoding="utf-8"))["across"]
    assert code in (0, 1, 2) and one.name in said and other.name in said
    assert "across unlike conditions" in page.read_text(encoding="utf-8")


NAMES = [
    ("red_SCI", "red_SCE", "geometry"),
    ("chart M0", "chart M1", "condition"),
    ("black_backing", "white_backing", "condition"),
    ("red_45-0", "red_d8", "geometry"),
]


@pytest.mark.parametrize("form", ["spectra", "colours"])
@pytest.mark.parametrize(("named", "otherwise", "crossing"), NAMES)
@pytest.mark.parametrize("command", [("match",), ("report", "compare")])
def test_names_of_files_say_how_their_readings_were_measured(
    metamer, tmp_path, command, named, otherwise, crossing, form
):
    one, other = tmp_path / f"{named}.csv", tmp_path / f"{otherwise}.csv"
    for path, factor in ((one, 1.0), (other, 1.02)):
        if form == "spectra":
            table(path, [], factor)
        else:
            path.write_text(f"Illuminant: D65, Observer: 10\nName,L*,a*,b*\nred,{50.0 * factor},40,30\n")
    code, _, err = metamer(*command, one, other)
    assert code == 3 and "the name of the file" in err and f"--across {crossing}" in err
    # A file's own words are before its name.
    said = ["Geometry: 45/0"] if "45" in named else ["Specular component: SCI", "Backing: black", "Condition: M0"]
    stated = table(tmp_path / f"{otherwise} of another day.csv", said, 1.02)
    assert metamer("match", table(one, []), stated)[0] == 0


def test_materials_of_a_catalogue_are_compared_as_their_names_and_files_say(metamer, tmp_path):
    (tmp_path / "in").mkdir()
    for name, factor in (("chart_SCI", 1.0), ("chart_SCE", 1.02)):
        table(tmp_path / "in" / f"{name}.csv", [], factor)
    heads = "nm,red SCI (%R),red SCE (%R)"
    rows = [f"{nm},{100 * value:.4f},{102 * value:.4f}" for nm, value in zip(NM, RED, strict=True)]
    (tmp_path / "in" / "both.csv").write_text("\n".join([heads, *rows, ""]))
    kept = tmp_path / "kept"
    assert metamer("catalogue", "import", "--catalogue", kept, tmp_path / "in")[0] == 0
    for one, other in (("chart-sci/red", "chart-sce/red"), ("both/red-sci", "both/red-sce")):
        code, _, err = metamer("match", one, other, "--catalogue", kept)
        assert code == 3 and "--across geometry" in err, err


@pytest.mark.parametrize("command", [("match",), ("report", "compare")])
def test_film_is_never_compared_with_paint(metamer, tmp_path, command):
    one, other = cxf(tmp_path / "a.cxf"), cxf(tmp_path / "b.cxf", kind="Transmittance")
    code, _, err = metamer(*command, one, other, "--across", "geometry,condition")
    assert code == 3 and "Spectrum_Transmittance" in err and "MeasurementType" in err


@pytest.mark.parametrize("command", [("match",), ("report", "compare")])
def test_a_side_that_does_not_say_how_it_was_measured_is_noted(metamer, tmp_path, command):
    one, other = cxf(tmp_path / "a.cxf", "SCI", device=M1), table(tmp_path / "b.csv", [], 1.02)
    code, out, _ = metamer(*command, one, other)
    assert code in (0, 2) and "b.csv does not state" in out and "M1" in out and "Specular_Included" in out


def test_readings_of_one_name_under_two_conditions_are_two_samples(metamer, tmp_path):
    both = cgats(tmp_path / "both.txt", [{"FILTER": "M0"}, {"FILTER": "M1"}])
    master = cgats(tmp_path / "master.txt", [{"FILTER": "M1"}], 1.02)
    code, out, _ = metamer("match", master, f"{both}#red, M1", "--json", "-")
    assert code == 0 and json.loads(out)["samples"][0]["readings"] == 1
    code, _, err = metamer("match", master, both)
    assert code == 3 and "red, M0" in err
    assert metamer("match", master, f"{both}#red, M1", "--repeated", both)[0] == 3


def test_light_and_observer_of_two_lines_of_a_weighting_function_are_both_known(metamer, tmp_path):
    head = [
        'CGATS.17\nWEIGHTING_FUNCTION "{}"\nWEIGHTING_FUNCTION "{}"\nBEGIN_DATA_FORMAT',
        "SAMPLE_NAME LAB_L LAB_A LAB_B",
    ]
    text = "\n".join([*head, "END_DATA_FORMAT", "BEGIN_DATA", "red {} 40.2 30.3", "END_DATA", ""])
    one, other = tmp_path / "one.txt", tmp_path / "other.txt"
    one.write_text(text.format("ILLUMINANT, D50", "OBSERVER, 2 degree", 50.1), encoding="utf-8")
    other.write_text(text.format("OBSERVER, 2 degree", "ILLUMINANT, D50", 50.6), encoding="utf-8")
    code, out, _ = metamer("match", one, other, "--json", "-")
    (told,) = json.loads(out)["samples"][0]["differences"]
    assert code == 0 and (told["illuminant"], told["observer"]) == ("D50", "1931_2")


def percent(path, heading, factor=1.0, first=400, last=700):
    """A CSV of one reading on the scale that its heading has, or on none."""
    nm = np.arange(first, last + 1, 10)
    values = factor * np.interp(nm, NM, RED)
    path.write_text("\n".join([heading, "nm,red", *(f"{a},{b:.5f}" for a, b in zip(nm, values, strict=True)), ""]))
    return path


@pytest.mark.parametrize("command", [("match",), ("report", "compare")])
@pytest.mark.parametrize(
    ("open_one", "factor", "said"),
    [("Reflectance", 100.0, ("--scale", "percent")), ("", 1.0, ("--as", "radiance-factor", "--scale", "fraction"))],
)
def test_an_answer_fills_gaps_and_leaves_what_files_state(metamer, tmp_path, command, open_one, factor, said):
    """One unlabelled file beside one that says its scale, and one that says transmittance or reflectance itself."""
    for side in ("a", "b"):
        (tmp_path / side).mkdir()
        off = 1.0 if side == "a" else 1.01
        percent(tmp_path / side / "open.csv", open_one, factor * off)
        heading = "Reflectance 0..1" if factor > 1.0 else "Reflectance %"
        percent(tmp_path / side / "other.csv", heading, 102.0 * off / factor)
    master = tmp_path / "a" / "open.csv" if command == ("match",) else tmp_path / "a"
    lots = tmp_path / "b"
    code, out, err = metamer(*command, master, lots, *said)
    assert code in (0, 1, 2), err
    assert "other.csv says itself" in out or command != ("match",)


@pytest.mark.parametrize("quantity", ["radiance-factor", "radiance factor", "radiance_factor"])
def test_an_answer_is_written_as_messages_write_it(metamer, tmp_path, quantity):
    one, other = percent(tmp_path / "a.csv", ""), percent(tmp_path / "b.csv", "", 1.02)
    assert metamer("match", one, other, "--as", quantity, "--scale", "fraction")[0] == 0
    code, _, err = metamer("match", one, other)
    assert code == 4 and "radiance-factor" in err
    code, _, err = metamer("match", one, other, "--as", "emission")
    assert code == 4 and "a light source is not a sample" in err


@pytest.mark.parametrize(
    ("first", "last", "fits"), [(380, 680, True), (410, 690, True), (430, 650, True), (400, 620, False)]
)
def test_what_imports_is_matched(metamer, tmp_path, first, last, fits):
    one = percent(tmp_path / "a.csv", "Reflectance 0..1", 1.0, first, last)
    other = percent(tmp_path / "b.csv", "Reflectance 0..1", 1.02, first, last)
    code, _, err = metamer("match", one, other)
    imported = metamer("catalogue", "import", one, "--into", tmp_path / "cat", "--dry-run")[0]
    assert (code == 0) == (imported == 0) == fits and ("too little of the visible light" in err) != fits


def test_a_name_on_booths_says_what_it_stands_for(metamer, tmp_path):
    one, other = cxf(tmp_path / "a.cxf"), cxf(tmp_path / "b.cxf", factor=1.02)
    _, out, _ = metamer("match", one, other, "--illuminants", "TL84,FL11,CWF,horizon", "--json", "-")
    said = json.loads(out)
    first, second = said["samples"][0]["differences"][:2]
    assert first["delta_e"] == second["delta_e"] and first["illuminant"] == "TL84"
    assert "(TL84 is CIE FL11; CWF is CIE FL2; horizon is a Planckian radiator of 2300 K)" in said["notes"][0]


def sheet(path, **columns):
    rows = zip(range(400, 701, 20), *columns.values(), strict=True)
    path.write_text(
        f"Reflectance (%)\nnm,{','.join(columns)}\n" + "".join(f"{','.join(map(str, row))}\n" for row in rows)
    )
    return path


def test_what_a_file_holds_and_is_not_compared_is_said(metamer, tmp_path):
    red, blue = [20.5 + 2 * at for at in range(16)], [50.5 - 2 * at for at in range(16)]
    one = sheet(tmp_path / "one.csv", red=red)
    other = sheet(tmp_path / "other.csv", lot=blue, D65=[80 + at for at in range(16)])
    code, out, _ = metamer("match", one, other)
    assert code == 0
    assert "D65 of other.csv is left out: a sample, or a light?" in out
    code, _, said = metamer("match", one, f"{other}#D65")
    assert code == 4 and "D65: a sample, or a light?" in said


def test_a_standard_of_several_samples_asks_for_one_by_its_quoted_name(metamer, tmp_path):
    one = sheet(tmp_path / "one.csv", **{"red M0": [20.5] * 16, "red M1": [30.5] * 16})
    code, _, said = metamer("match", one, one)
    assert code == 64 and f"as in '{one}#red M0', of 'red M0', 'red M1'" in said


def test_differences_that_show_as_none_have_no_direction(metamer, tmp_path):
    red = [20 + 2 * at for at in range(16)]
    one = sheet(tmp_path / "one.csv", red=red)
    other = sheet(tmp_path / "other.csv", lot=[value + 1e-4 * (at % 3) for at, value in enumerate(red)])
    _, out, _ = metamer("match", one, other)
    assert out.count("alike") >= 3 and "redder" not in out and "lighter" not in out
