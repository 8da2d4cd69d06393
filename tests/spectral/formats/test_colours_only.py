"""Tables of colours without spectra, in other coordinates than L*, a*, b* and X, Y, Z."""

import itertools

import numpy as np
import pytest
from metamer.materials.catalogue.samples import samples_of
from metamer.runtime.errors import InputError
from metamer.spectral.difference import lab_from_xyz
from metamer.spectral.formats.colours_only import colour_in, read_colours
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.registry import read_spectra

LAB = np.array([[50.0, 17.3, 10.0], [31.5, -20.0, 3.5], [80.25, 4.0, -40.0]])
XYZ = np.array([[41.2, 43.0, 30.5], [9.5, 10.0, 4.25], [70.0, 75.0, 80.0]])

ORDERS = list(itertools.permutations(range(3)))
POLAR_HEADS = (("L*", "C*", "h"), ("L", "C", "H"), ("LCH_L", "LCH_C", "LCH_H"), ("L*", "C*ab", "hab (°)"))


def polar():
    return np.c_[LAB[:, 0], np.hypot(LAB[:, 1], LAB[:, 2]), np.degrees(np.arctan2(LAB[:, 2], LAB[:, 1])) % 360.0]


def chromatic():
    total = XYZ.sum(axis=1)
    return np.c_[XYZ[:, 0] / total, XYZ[:, 1] / total, XYZ[:, 1]]


def written(path, heads, values, between=",", mark=".", order=(0, 1, 2)):
    rows = [between.join(["name", *(heads[at] for at in order)])]
    for number, row in enumerate(values):
        rows.append(between.join([f"s{number}", *(f"{row[at]:.9f}".replace(".", mark) for at in order)]))
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize(("between", "mark"), [(",", "."), (";", ","), ("\t", "."), ("\t", ",")])
@pytest.mark.parametrize("heads", POLAR_HEADS)
def test_lightness_chroma_and_hue_are_converted_with_the_formula_said(tmp_path, heads, between, mark, order):
    found = read_colours(written(tmp_path / "x.csv", heads, polar(), between, mark, order))
    assert [one.name for one in found] == ["s0", "s1", "s2"]
    assert [one.stated[0].space for one in found] == ["Lab"] * 3
    np.testing.assert_allclose([one.stated[0].values for one in found], LAB, atol=1e-6)
    assert "C* cos h" in found[0].details["converted"]


@pytest.mark.parametrize("order", ORDERS)
def test_chromaticities_are_converted_with_the_formula_said(tmp_path, order):
    found = read_colours(written(tmp_path / "x.csv", ("x", "y", "Y"), chromatic(), order=order))
    assert {one.stated[0].space for one in found} == {"XYZ"}
    np.testing.assert_allclose([one.stated[0].values for one in found], XYZ, atol=1e-5)
    assert "x Y / y" in found[0].details["converted"]


def test_columns_that_are_there_are_not_worked_out(tmp_path):
    """C* and h beside L*, a*, b* may be rounded."""
    path = tmp_path / "x.csv"
    path.write_text("name,L*,a*,b*,C*,h\none,50,17.3,10,20,30\n")
    (found,) = read_colours(path)
    assert np.array_equal(found.stated[0].values, [50.0, 17.3, 10.0]) and "converted" not in found.details


@pytest.mark.parametrize(
    ("heads", "row", "words"),
    [
        (("L*", "C*", "h"), (50.0, -2.0, 30.0), "chroma below 0"),
        (("x", "y", "Y"), (0.6, 0.0, 30.0), "no chromaticity"),
        (("x", "y", "Y"), (0.6, 0.5, 30.0), "no chromaticity"),
        (("x", "y", "Y"), (31.0, 33.0, 30.0), "no chromaticity"),
        (("x", "y", "Y"), (0.31, 0.33, 0.3), "scale to 1"),
    ],
)
def test_impossible_coordinates_are_refused(tmp_path, heads, row, words):
    with pytest.raises(InputError, match=words):
        read_colours(written(tmp_path / "x.csv", heads, [row]))


def test_the_colour_is_that_of_its_xyz(tmp_path):
    found = read_colours(written(tmp_path / "x.csv", ("x", "y", "Y"), chromatic()))
    white = np.array([95.047, 100.0, 108.883])
    np.testing.assert_allclose(
        lab_from_xyz(np.array([one.stated[0].values for one in found]), white), lab_from_xyz(XYZ, white), atol=1e-5
    )


@pytest.mark.parametrize("angles", [(-15, 15, 25, 45, 75, 110), (15, 45, 110), (25, 45, 75)])
@pytest.mark.parametrize(
    "heading",
    [
        *(
            "{angle}° L*",
            "{angle}°L*",
            "45as{angle} L*",
            "r45as{angle} L*",
            "as{angle} L*",
            "{angle}° L",
            "45as{angle}_L",
        ),
        *("({angle}°) L*", "{angle} deg L*", "{angle}°/L*", "{angle}° CIE L*", "asp {angle} L*", "D65/10° {angle}° L*"),
        *("L* {angle}°", "L*{angle}°", "L* 45as{angle}", "L*(45as{angle})", "L* at {angle}°"),
    ],
)
def test_an_angle_stands_on_either_side_of_the_axis(tmp_path, heading, angles):
    """Readings of one paint at their angles, and not as many paints, nor none."""
    columns = [(angle, axis, at) for angle in angles for at, axis in enumerate("Lab")]
    heads = []
    for angle, axis, _ in columns:
        before, _, behind = heading.rpartition("L")
        heads.append(f"{before}{axis}{behind}".format(angle=angle))
    values = [f"{60 - angle / 4 + 3 * at:.2f}" for angle, _, at in columns]
    path = tmp_path / "x.csv"
    path.write_text(f"Illuminant D65, observer 10°\nName,{','.join(heads)}\nred,{','.join(values)}\n", encoding="utf-8")
    (found,) = samples_of(str(path), lambda: pytest.fail("no catalogue"))
    assert found.name.startswith("red") and found.details["format"] == "CSV"
    assert [one.measurement.geometry.second for one in found.angles] == list(angles)
    for angle, part in zip(angles, found.angles, strict=True):
        (colour,) = part.stated
        assert (colour.illuminant, colour.observer) == ("D65", "1964_10")
        np.testing.assert_allclose(colour.values, 60.0 - angle / 4.0 + 3.0 * np.arange(3), atol=5e-3)


@pytest.mark.parametrize("heading", ["{light} L*", "{light}/10° L*", "L* {light}", "L*({light})", "L* ({light}/10°)"])
def test_each_light_of_a_row_is_read(tmp_path, heading):
    """The colours under A are those under A, wherever the heading says so; a line above says another light."""
    heads = [heading.format(light=light).replace("L*", f"{axis}*") for light in ("D65", "A", "F11") for axis in "Lab"]
    path = tmp_path / "x.csv"
    row = ",".join(str(50 + at) for at in range(9))
    path.write_text(f"Illuminant D65\nObserver 10°\nName,{','.join(heads)}\nred,{row}\n", encoding="utf-8")
    (found,) = read_colours(path)
    assert [(one.illuminant, one.observer, one.values[0]) for one in found.stated] == [
        ("D65", "1964_10", 50.0),
        ("A", "1964_10", 53.0),
        ("FL11", "1964_10", 56.0),
    ]


@pytest.mark.parametrize(
    "heads",
    [
        *("ΔL*,Δa*,Δb*", "Delta L*,Delta a*,Delta b*", "L* diff,a* diff,b* diff", "L* tol.,a* tol.,b* tol."),
        *("L* std dev,a* std dev,b* std dev", "Hunter L,Hunter a,Hunter b", "L (Hunter),a (Hunter),b (Hunter)"),
    ],
)
def test_differences_limits_and_other_spaces_are_no_colours(tmp_path, heads):
    path = tmp_path / "x.csv"
    path.write_text(f"D65/10°\nName,L*,a*,b*,{heads}\nred,50,10,5,1,1,1\n", encoding="utf-8")
    (found,) = read_colours(path)
    assert found.name == "red" and [one.values.tolist() for one in found.stated] == [[50.0, 10.0, 5.0]]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("Hunter Lab, D65/10°\nName,L,a,b\nred,50,10,5\n", "Hunter"),
        ("Scale: Hunter L,a,b\nName,L,a,b\nred,50,10,5\n", "Hunter"),
        ("D65/10°\nName,L*,a*,b*\nred,0.5,0.1,0.05\nblue,0.4,-0.1,-0.3\n", "scale to 1"),
        ("D65/10°\nName,L*,a*,b*\nred,5000,100,50\n", "no lightness"),
        ("D65/10°\nName,L*,a*,b*\nred,-50,10,5\n", "no lightness"),
    ],
)
def test_colours_that_cannot_be_are_asked_about(tmp_path, text, problem):
    path = tmp_path / "x.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=problem) as caught:
        read_colours(path)
    assert caught.value.found and caught.value.expected


def test_blacks_and_instruments_of_one_name_are_read(tmp_path):
    assert colour_in("lab:0.5,0.1,0.1@D65/1964_10").values[0] == 0.5
    path = tmp_path / "x.csv"
    path.write_text("HunterLab UltraScan, D65/10°\nName,L,a,b\nred,50,10,\u20135\n", encoding="utf-8")
    (found,) = read_colours(path)
    assert found.stated[0].values.tolist() == [50.0, 10.0, -5.0]
    path.write_text("D65/10°\nName,L*,a*,b*\nblack,0.5,0.1,0.05\n", encoding="utf-8")
    (found,) = read_colours(path, ImportOptions(scale="percent"))
    assert found.stated[0].values[0] == 0.5


ABOVE = {
    "D65 A": ("D65", "A"),
    "D65/10°, A/10°": ("D65", "A"),
    "Illuminant: D65\nIlluminant: A\nObserver: 10": ("D65", "A"),
    "Primary illuminant,D65\nSecondary illuminant,A\nObserver,10": ("D65", "A"),
    "Illuminant 1: D65\nIlluminant 2: F11\nObserver: 10°": ("D65", "FL11"),
    "Illuminants: D65, A, F11\nObserver: 10°": ("D65", "A", "FL11"),
    "Colours for D50 and D65, 2°": ("D65", "D50"),
    "Lichtart D65, Lichtart A; Beobachter 10°": ("D65", "A"),
    "Light sources: D65 TL84 CWF\nObserver: 10°": ("D65", "TL84", "CWF"),
    "Illuminant: D65\nObserver: 2° 10°": ("1931_2", "1964_10"),
    "Illuminant: D65\nObserver 1: 2°\nObserver 2: 10°": ("1931_2", "1964_10"),
}
ROWS = "Name,L*,a*,b*\nred,50.6,40.9,29.1\ngrey,60.4,0.1,0.4\n"


@pytest.mark.parametrize("above", ABOVE)
@pytest.mark.parametrize("rows", [ROWS, ROWS.replace("L*,a*,b*", "X,Y,Z").replace("0.", "1.")])
def test_two_lights_above_one_set_of_colours_are_asked_about(tmp_path, above, rows):
    path = tmp_path / "x.csv"
    path.write_text(f"{above}\n{rows}", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_colours(path)
    assert ", ".join(ABOVE[above]) in str(caught.value) and "--colours-for" in str(caught.value)
    answered = read_colours(path, ImportOptions(colours_for=("C", "CIE")))
    part = "observer" if "1931_2" in ABOVE[above] else "illuminant"
    assert {getattr(one.stated[0], part) for one in answered} == {"CIE" if part == "observer" else "C"}
    headed = rows.replace("*", "*(A/2)") if "*" in rows else rows
    path.write_text(f"{above}\n{headed}", encoding="utf-8")
    if headed != rows:
        assert {one.stated[0].illuminant for one in read_colours(path)} == {"A"}


@pytest.mark.parametrize(
    "above",
    [
        "Illuminant: D65\nD65/10°",
        "D65/10, D65/10",
        "Illuminant: D65/10°\nInspected in booth: TL84",
        "M1 (D50) measured, Lab for D65/10",
        "Date: 2024-02-10\nIlluminant: D65\nObserver: 10°",
    ],
)
def test_what_is_no_second_light_of_the_colours_asks_nothing(tmp_path, above):
    path = tmp_path / "x.csv"
    path.write_text(f"{above}\n{ROWS}", encoding="utf-8")
    assert {(one.stated[0].illuminant, one.stated[0].observer) for one in read_colours(path)} == {("D65", "1964_10")}


def test_colours_in_two_columns_of_one_field_are_asked_about(tmp_path):
    path = tmp_path / "x.txt"
    fields = "LAB_L LAB_A LAB_B"
    path.write_text(
        f"CGATS.17\nBEGIN_DATA_FORMAT\nSAMPLE_NAME {fields} {fields}\nEND_DATA_FORMAT\n"
        "BEGIN_DATA\nred 50 40 29 51 41 30\nEND_DATA\n"
    )
    with pytest.raises(InputError, match="two columns of one heading"):
        read_colours(path)


@pytest.mark.parametrize(
    "rows",
    [
        ROWS,
        ROWS.replace(",", ";").replace(".", ","),
        "X,Y,Z\n20,18,10\n",
        "Name,L*,C*,h\nred,50,50,30\n",
        f"Illuminant D65/10\n{ROWS}",
        "X,Y,Z\n410,420,400\n420,430,410\n430,440,420\n",
    ],
)
@pytest.mark.parametrize("answer", [ImportOptions(), ImportOptions("reflectance", "percent")])
def test_a_table_of_colours_is_no_spectrum_whatever_the_answer(tmp_path, rows, answer):
    path = tmp_path / "x.csv"
    path.write_text(rows, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_spectra(path, answer)
    assert "colours of CIELAB or XYZ, and no spectra" in str(caught.value) and "metamer match" in str(caught.value)


def test_statistics_of_colours_are_none_and_named(tmp_path):
    path = tmp_path / "lab.csv"
    rows = ["red,50,17,10", "blue,31,-20,3", "Mean,40,-1,6", "Median,40,-1,6", "StdDev,1,1,1", "N,10,10,10"]
    path.write_text("\n".join(["D65/10,,,", "name,L*,a*,b*", *rows]) + "\n", encoding="utf-8")
    found = read_colours(path)
    assert [one.name for one in found] == ["red", "blue", "Mean"]
    assert {one.details["left out"] for one in found} == {"Median, StdDev, N"}
    path.write_text("\n".join(["D65/10,,,", "name,L*,a*,b*", *rows[:3]]) + "\n", encoding="utf-8")
    assert not any("left out" in one.details for one in read_colours(path))
