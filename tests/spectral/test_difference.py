"""Colour differences: published pairs, the oracle over a thousand images, and the corners of the formulae."""

from inspect import unwrap

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.difference import delta_e_lab, delta_e_xyz, differences, lab_from_xyz

D65 = np.array([0.95047, 1.0, 1.08883])
METHODS = ("CIE 1976", "CIE 1994", "CIE 2000", "CMC 1:1", "CMC 2:1")
# The 34 pairs of Sharma, Wu and Dalal 2005, table 1: L, a, b of each side, ΔE00.
SHARMA = np.array(
    [
        [50.0000, 2.6772, -79.7751, 50.0000, 0.0000, -82.7485, 2.0425],
        [50.0000, 3.1571, -77.2803, 50.0000, 0.0000, -82.7485, 2.8615],
        [50.0000, 2.8361, -74.0200, 50.0000, 0.0000, -82.7485, 3.4412],
        [50.0000, -1.3802, -84.2814, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, -1.1848, -84.8006, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, -0.9009, -85.5211, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, 0.0000, 0.0000, 50.0000, -1.0000, 2.0000, 2.3669],
        [50.0000, -1.0000, 2.0000, 50.0000, 0.0000, 0.0000, 2.3669],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0009, 7.1792],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0010, 7.1792],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0011, 7.2195],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0012, 7.2195],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0009, -2.4900, 4.8045],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0010, -2.4900, 4.8045],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0011, -2.4900, 4.7461],
        [50.0000, 2.5000, 0.0000, 50.0000, 0.0000, -2.5000, 4.3065],
        [50.0000, 2.5000, 0.0000, 73.0000, 25.0000, -18.0000, 27.1492],
        [50.0000, 2.5000, 0.0000, 61.0000, -5.0000, 29.0000, 22.8977],
        [50.0000, 2.5000, 0.0000, 56.0000, -27.0000, -3.0000, 31.9030],
        [50.0000, 2.5000, 0.0000, 58.0000, 24.0000, 15.0000, 19.4535],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.1736, 0.5854, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.2972, 0.0000, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 1.8634, 0.5757, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.2592, 0.3350, 1.0000],
        [60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644],
        [63.0109, -31.0961, -5.8663, 62.8187, -29.7946, -4.0864, 1.2630],
        [61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731],
        [35.0831, -44.1164, 3.7933, 35.0232, -40.0716, 1.5901, 1.8645],
        [22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373],
        [36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146],
        [90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441],
        [90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381],
        [6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377],
        [2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082],
    ]
)


def _called(method):
    """Name the formula as colour-science does."""
    return {"method": "CMC", "l": float(method[4]), "c": 1.0} if method.startswith("CMC") else {"method": method}


axis = st.floats(-120, 120)
labs = st.tuples(st.floats(0, 100), axis, axis).map(np.array)


def test_sharma_s_34_pairs():
    found = delta_e_lab(SHARMA[:, :3], SHARMA[:, 3:6], "CIE 2000")
    worst = int(np.argmax(np.abs(found - SHARMA[:, 6])))
    assert abs(found[worst] - SHARMA[worst, 6]) < 1e-4, (worst, found[worst], SHARMA[worst, 6])


def test_sharma_s_34_pairs_the_other_way_round():
    np.testing.assert_allclose(delta_e_lab(SHARMA[:, 3:6], SHARMA[:, :3], "CIE 2000"), SHARMA[:, 6], rtol=0, atol=1e-4)


def test_a_thousand_random_images_against_colour_science(colour, rng):
    """8 x 8 images of XYZ from -0.1 to 1.2, a few pixels without a number: as many images, as many differences."""
    reference = rng.uniform(-0.1, 1.2, (1000, 8, 8, 3))
    sample = reference + rng.normal(0, 0.05, reference.shape) * rng.choice([0.0, 0.02, 1.0], (1000, 8, 8, 1))
    holes = rng.uniform(size=(1000, 8, 8)) < 0.01
    sample[holes, 1] = np.nan
    white_xy = colour.XYZ_to_xy(D65)
    for method in METHODS:
        # The oracle's conversion is the subject too: it goes from XYZ to Lab by itself.
        sides = colour.XYZ_to_Lab(reference, white_xy), colour.XYZ_to_Lab(sample, white_xy)
        oracle = colour.delta_E(*sides, **_called(method))
        found = delta_e_xyz(reference, sample, D65, method)
        assert found.shape == (1000, 8, 8)
        np.testing.assert_array_equal(np.isnan(found), holes, err_msg=method)
        np.testing.assert_allclose(found, oracle, rtol=0, atol=1e-4, equal_nan=True, err_msg=method)


@pytest.mark.parametrize("method", METHODS)
def test_nan_in_either_side_is_nan_out_and_stays_in_its_pixel(method):
    reference, sample = np.full((3, 4, 3), 0.3), np.full((3, 4, 3), 0.4)
    reference[0, 1, 2] = np.nan
    sample[2, 3, 0] = np.nan
    found = delta_e_xyz(reference, sample, D65, method)
    assert np.argwhere(np.isnan(found)).tolist() == [[0, 1], [2, 3]]


@pytest.mark.parametrize("method", METHODS)
def test_infinite_pixels_give_no_number_and_no_warning(method):
    found = delta_e_xyz(np.array([[np.inf] * 3, [-np.inf, 0.5, 0.5], [0.5] * 3]), np.full((3, 3), 0.5), D65, method)
    assert not np.isfinite(found[:2]).any()
    assert found[2] == 0


@pytest.mark.parametrize("method", METHODS)
def test_negative_tristimulus_values_are_not_clipped(method):
    """A colour outside the spectrum locus is a different colour from black."""
    out_of_gamut, black = np.array([-0.02, -0.01, -0.03]), np.zeros(3)
    assert delta_e_xyz(black, out_of_gamut, D65, method) > 1
    assert lab_from_xyz(out_of_gamut, D65)[0] < 0


def test_lab_of_white_and_black():
    np.testing.assert_allclose(lab_from_xyz(D65, D65), [100, 0, 0], atol=1e-13)
    np.testing.assert_allclose(lab_from_xyz(np.zeros(3), D65), [0, 0, 0], atol=1e-13)


def test_lab_of_negatives_follows_the_linear_branch():
    np.testing.assert_allclose(lab_from_xyz(-0.001 * D65, D65)[0], -0.001 * 24389 / 27, rtol=1e-12)


def test_lab_is_continuous_where_its_branches_meet():
    """One value and one slope at Y = (6/29)^3: both sides give L* = 8."""
    edge = (6 / 29) ** 3
    sides = lab_from_xyz(np.outer([edge * (1 - 1e-9), edge * (1 + 1e-9)], np.ones(3)), np.ones(3))
    np.testing.assert_allclose(sides[:, 0], 8.0, atol=1e-6)


def test_lab_against_colour_science(colour, rng):
    xyz = rng.uniform(-0.1, 2.0, (500, 3))
    oracle = colour.XYZ_to_Lab(xyz, colour.XYZ_to_xy(D65))
    np.testing.assert_allclose(lab_from_xyz(xyz, D65), oracle, rtol=0, atol=1e-9)


@pytest.mark.parametrize("method", METHODS)
@given(lab=labs)
def test_identical_colours_differ_by_nothing(method, lab):
    assert delta_e_lab(lab, lab, method) == 0


@pytest.mark.parametrize("method", ["CIE 1976", "CIE 2000"])
@given(first=labs, second=labs)
def test_symmetric_formulae(method, first, second):
    assert delta_e_lab(first, second, method) == pytest.approx(delta_e_lab(second, first, method), rel=1e-9, abs=1e-9)


def test_cie_1994_weighs_by_the_reference():
    """Pinned: from a saturated reference a step in chroma counts for less."""
    saturated, grey = np.array([50.0, 60.0, 0.0]), np.array([50.0, 10.0, 0.0])
    assert delta_e_lab(saturated, grey, "CIE 1994") == pytest.approx(50 / (1 + 0.045 * 60))
    assert delta_e_lab(grey, saturated, "CIE 1994") == pytest.approx(50 / (1 + 0.045 * 10))


def test_cie_1994_of_a_turn_in_hue_alone():
    """Same chroma 50, a quarter turn: ΔH = 50 sqrt(2), weighed by 1 + 0.015 x 50."""
    found = delta_e_lab(np.array([50.0, 50.0, 0.0]), np.array([50.0, 0.0, 50.0]))
    assert found == pytest.approx(50 * np.sqrt(2) / 1.75)


def test_cie_1994_never_takes_the_root_of_a_rounding_error(rng):
    """Scaled chroma: ΔH is zero and rounds below it."""
    base = rng.uniform(-80, 80, (10_000, 3))
    found = delta_e_lab(base, base * np.array([1.0, 1.1, 1.1]))
    assert np.isfinite(found).all()


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ((50, 1e-3, -1e-6), (50, 1e-3, 1e-6)),  # either side of 0 degrees
        ((50, -1e-3, -1e-6), (50, -1e-3, 1e-6)),  # either side of 180
        ((50, 2.5, -0.001), (50, 2.5, 0.001)),
        ((50, -2.5, -0.001), (50, -2.5, 0.001)),
        ((50, 0, 0), (50, 0, 1e-3)),  # one side has no hue
        ((50, 0, 0), (50, 0, 0)),
        ((50, -0.0, 0.0), (50, 0.0, -0.0)),
        ((50, 1e-9, 0), (50, -1e-9, 0)),  # opposite hues of almost nothing
        ((50, 30, 0), (50, -30, 0)),  # exactly opposite
        ((50, -30, 1e-12), (50, 30, 0)),
    ],
)
def test_cie_2000_where_the_hue_wraps(colour, first, second):
    """A hair across the wrap is a hair of a difference, and the oracle agrees."""
    first, second = np.array(first, float), np.array(second, float)
    found = delta_e_lab(first, second, "CIE 2000")
    assert found == pytest.approx(float(colour.delta_E(first, second, method="CIE 2000")), abs=1e-6)
    assert found <= 2 * delta_e_lab(first, second, "CIE 1976") + 1e-12


def test_cie_2000_is_small_around_the_whole_wheel():
    """One step of a degree in hue never jumps: no wrap is missed between 0 and 360."""
    hue = np.radians(np.arange(0, 361.0))
    wheel = np.stack([np.full_like(hue, 50), 40 * np.cos(hue), 40 * np.sin(hue)], axis=-1)
    found = delta_e_lab(wheel[:-1], wheel[1:], "CIE 2000")
    assert found.min() > 0.2 and found.max() < 0.8, (found.min(), found.max())


@pytest.mark.parametrize("white", [[0.95, 1.0, 0.0], [0.95, -1.0, 1.0], [np.nan, 1.0, 1.0], [np.inf, 1.0, 1.0]])
def test_impossible_white_is_an_error(white):
    with pytest.raises(InputError, match="a white needs positive tristimulus values"):
        lab_from_xyz(np.ones(3), np.array(white))


def test_unknown_formula_names_the_known_ones():
    # Behind the check of annotations, which only tests have.
    with pytest.raises(UnknownNameError, match="CIE 1976, CIE 1994, CIE 2000"):
        unwrap(delta_e_lab)(np.zeros(3), np.zeros(3), "CIE94")


@given(first=labs, second=labs)
def test_lightness_chroma_and_hue_add_up(first, second):
    found = differences(first, second)
    total = found.lightness**2 + found.chroma**2 + found.hue**2
    assert total == pytest.approx(float(delta_e_lab(first, second, "CIE 1976")) ** 2, rel=1e-9, abs=1e-7)
    assert total == pytest.approx(float(found.lightness**2 + found.a**2 + found.b**2), rel=1e-9, abs=1e-7)


@given(first=labs, second=labs)
def test_the_other_way_round_all_signs_turn(first, second):
    there, back = differences(first, second), differences(second, first)
    for name in ("lightness", "a", "b", "chroma"):
        assert getattr(there, name) == -getattr(back, name)
    # Between exactly opposite hues both ways are half a turn.
    assert abs(there.hue) == pytest.approx(abs(back.hue))


@pytest.mark.parametrize(
    ("first", "second", "sign"),
    [
        ((50, 20, -0.1), (50, 20, 0.1), 1),  # over 0 degrees
        ((50, -20, 0.1), (50, -20, -0.1), 1),  # over 180
        ((50, 20, 0.1), (50, 20, -0.1), -1),
        ((50, 20, 0), (50, 40, 0), 0),
        ((50, 0, 0), (50, 10, 10), 0),  # one side has no hue
    ],
)
def test_hue_has_a_sign(first, second, sign):
    found = float(differences(np.array(first, float), np.array(second, float)).hue)
    assert np.sign(found) == sign and abs(found) < 0.21


def test_differences_of_images_keep_their_shape(rng):
    first, second = rng.uniform(0, 60, (2, 4, 5, 3))
    found = differences(first, second)
    assert found.hue.shape == found.lightness.shape == (4, 5)
    assert float(differences(first[2, 3], second[2, 3]).hue) == pytest.approx(found.hue[2, 3])


def test_dark_standards_have_the_lightness_of_cmc_s_floor():
    """Below L* 16 a step of lightness counts 1 / 0.511, at l = 2 half of it."""
    dark, darker = np.array([10.0, 0.0, 0.0]), np.array([9.0, 0.0, 0.0])
    assert delta_e_lab(dark, darker, "CMC 1:1") == pytest.approx(1.0 / 0.511)
    assert delta_e_lab(dark, darker, "CMC 2:1") == pytest.approx(0.5 / 0.511)
