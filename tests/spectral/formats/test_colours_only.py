"""Tables of colours without spectra, in other coordinates than L*, a*, b* and X, Y, Z."""

import itertools

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.difference import lab_from_xyz
from metamer.spectral.formats.colours_only import read_colours

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
