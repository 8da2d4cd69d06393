"""DIN 6175-2 as public paint software has it: worked by hand, symmetric, and only where there is an angle."""

import numpy as np
import pytest
from metamer.calibration.match.tolerance import Tolerance
from metamer.runtime.errors import ComparisonError, UnknownNameError
from metamer.spectral.difference import xyz_from_lab
from metamer.spectral.formula import DIN_6175_2, delta_e_din_6175_2, formula

WHITE = np.array([0.95, 1.0, 1.08])


def spreadsheet(one, two, gamma):
    """The formula cell by cell."""
    l1, a1, b1 = one
    l2, a2, b2 = two
    c1, c2 = (a1**2 + b1**2) ** 0.5, (a2**2 + b2**2) ** 0.5
    l, c = (l1 * l2) ** 0.5, (c1 * c2) ** 0.5
    sl = 0.15 * l**0.5 + 31.5 / gamma
    sc = max(0.7, 0.48 * c**0.5 - 0.35 * l**0.5 + 42 / gamma)
    sh = max(0.7, 0.14 * c**0.5 - 0.20 * l**0.5 + 21 / gamma + 0.7)
    c0 = 10 + 8 / (1 + np.exp(27 - l))
    s = 1 / (1 + np.exp(c - c0))
    dl, da, db, dc = l2 - l1, a2 - a1, b2 - b1, c2 - c1
    dh2 = da**2 + db**2 - dc**2
    ab = ((dl / sl) ** 2 + (da / 0.7) ** 2 + (db / 0.7) ** 2) ** 0.5
    return s * ab + (1 - s) * ((dl / sl) ** 2 + (dc / sc) ** 2 + dh2 / sh**2) ** 0.5


PAIRS = [
    ((90.0, -2.0, 12.0), (91.5, -2.4, 13.0)),
    ((45.0, 30.0, -40.0), (44.0, 31.0, -38.5)),
    ((12.0, 3.0, -6.0), (12.4, 3.3, -6.1)),
    ((26.0, 10.0, 12.0), (26.5, 9.0, 12.6)),
    ((130.0, 1.0, 1.0), (128.0, 1.2, 0.7)),
]


@pytest.mark.parametrize("gamma", [15.0, 25.0, 45.0, 75.0, 110.0])
@pytest.mark.parametrize("pair", PAIRS)
def test_it_is_what_a_spreadsheet_gives(pair, gamma):
    one, two = map(np.array, pair)
    assert delta_e_din_6175_2(one, two, gamma) == pytest.approx(spreadsheet(*pair, gamma), abs=1e-9)
    assert delta_e_din_6175_2(two, one, gamma) == pytest.approx(delta_e_din_6175_2(one, two, gamma), rel=1e-9)
    assert delta_e_din_6175_2(one, two, -gamma) == delta_e_din_6175_2(one, two, gamma)


def test_many_pairs_are_told_at_once_and_equal_ones_are_alike():
    one, two = (np.array([pair[side] for pair in PAIRS]) for side in (0, 1))
    assert delta_e_din_6175_2(one, two, 45.0).shape == (5,)
    assert (delta_e_din_6175_2(one, one, 45.0) == 0.0).all()


@pytest.mark.parametrize(
    "pair",
    [((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), ((-0.1, 0.0, 0.0), (0.2, 0.1, 0.0)), ((300.0, 900.0, 0.0), (1.0, 0.0, 0.0))],
)
def test_black_and_dazzling_colours_have_a_difference(pair):
    assert np.isfinite(delta_e_din_6175_2(*map(np.array, pair), 15.0))


def test_nearer_to_the_mirror_more_lightness_is_accepted():
    one, two = np.array([60.0, 0.0, 0.0]), np.array([62.0, 0.0, 0.0])
    found = [delta_e_din_6175_2(one, two, angle) for angle in (15.0, 25.0, 45.0, 75.0, 110.0)]
    assert found == sorted(found)


@pytest.mark.parametrize("text", ["DIN 6175-2", "din6175", "DIN 6175 - 2", DIN_6175_2])
def test_it_goes_by_its_name_and_asks_for_an_angle(text):
    one, two = (xyz_from_lab(np.array(side), WHITE) for side in PAIRS[0])
    told = formula(text)
    with pytest.raises(ComparisonError, match="several angles"):
        told(one, two, WHITE)
    with pytest.raises(ComparisonError, match="several angles"):
        told.at("")(one, two, WHITE)
    assert told.at("45as15")(one, two, WHITE) == pytest.approx(spreadsheet(*PAIRS[0], 15.0), abs=1e-6)
    assert told.at("45as-15").aspecular == -15.0
    with pytest.raises(ComparisonError, match="mirror"):
        told.at("45as0")(one, two, WHITE)


def test_a_tolerance_may_be_of_it():
    tolerance = Tolerance.of("DIN 6175-2 1.4")
    assert tolerance.limit == 1.4 and tolerance.formula.name == DIN_6175_2
    assert tolerance.at("45as25").formula.aspecular == 25.0


def test_other_formulas_know_no_angle():
    assert formula("CIE 2000").at("45as15") == formula("CIE 2000")
    with pytest.raises(UnknownNameError, match="DIN 6175-2"):
        formula("AUDI2000")
