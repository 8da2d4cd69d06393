"""Formulas by name, against colour-science."""

from __future__ import annotations

import numpy as np
import pytest
from metamer.calibration.match.tolerance import Tolerance
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.colour_library import colour_science
from metamer.spectral.difference import xyz_from_lab
from metamer.spectral.formula import ADAPTING_LUMINANCE, BACKGROUND, NAMES, delta_e, formula

WHITE = np.array([0.9481, 1.0, 1.0732])


@pytest.fixture(scope="module")
def pairs():
    """XYZ of 500 pairs, some near each other, one at grey and one the same twice."""
    rng = np.random.default_rng(3)
    lab = np.stack([rng.uniform(5, 98, 500), *rng.uniform(-40, 40, (2, 500))], axis=-1)
    lab[0, 1:] = 0.0
    beside = lab + rng.normal(size=lab.shape) * rng.choice([0.1, 3.0], (500, 1))
    beside[1] = lab[1]
    return xyz_from_lab(lab, WHITE), xyz_from_lab(beside, WHITE), lab, beside


@pytest.mark.parametrize("name", NAMES[:3])
def test_cielab_formulas_are_colour_sciences(pairs, name):
    first, second, lab, beside = pairs
    wanted = colour_science().delta_E(lab, beside, method=name)
    np.testing.assert_allclose(formula(name)(first, second, WHITE), wanted, atol=1e-9)


@pytest.mark.parametrize("weights", [(1.0, 1.0), (2.0, 1.0), (1.4, 0.8)])
def test_cmc_of_any_weights(pairs, weights):
    first, second, lab, beside = pairs
    wanted = colour_science().difference.delta_E_CMC(lab, beside, l=weights[0], c=weights[1])
    found = formula(f"CMC {weights[0]}:{weights[1]}")(first, second, WHITE)
    np.testing.assert_allclose(found, wanted, atol=1e-4)


def test_cam16_ucs_is_colour_sciences_distance(pairs):
    first, second, *_ = pairs
    colour = colour_science()
    with colour.domain_range_scale("reference"):
        one, other = (
            colour.models.JMh_CAM16_to_CAM16UCS(np.stack([s.J, s.M, s.h], axis=-1))
            for s in (
                colour.XYZ_to_CAM16(100 * xyz, 100 * WHITE, ADAPTING_LUMINANCE, BACKGROUND) for xyz in (first, second)
            )
        )
        wanted = colour.delta_E(one, other, method="CAM16-UCS")
    found = formula("CAM16-UCS")(first, second, WHITE)
    np.testing.assert_allclose(found, wanted, atol=1e-4)
    assert found[1] == 0.0


def test_cam16_of_a_published_colour():
    """C. Li et al. 2017 by colour-science's own documentation of CAM16: J 41.731 of this stimulus, L_A 318.31."""
    colour = colour_science()
    seen = colour.XYZ_to_CAM16(np.array([19.01, 20.0, 21.78]), np.array([95.05, 100.0, 108.88]), 318.31, 20.0)
    assert pytest.approx(41.7312, abs=1e-4) == seen.J


def test_images_are_done_in_blocks(pairs):
    first, second, *_ = pairs
    many = np.tile(first, (300, 1)).reshape(300, 500, 3), np.tile(second, (300, 1)).reshape(300, 500, 3)
    found = formula("CAM16-UCS")(*many, WHITE)
    assert found.shape == (300, 500)
    np.testing.assert_allclose(found[-1], formula("CAM16-UCS")(first, second, WHITE), atol=1e-12)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("CIE 1994", "CIE 1994"),
        ("94", "CIE 1994"),
        ("ΔE94", "CIE 1994"),
        ("delta-E 2000", "CIE 2000"),
        ("dE00", "CIE 2000"),
        ("CIEDE2000", "CIE 2000"),
        ("dE*ab", "CIE 1976"),
        ("CMC(2:1)", "CMC 2:1"),
        ("cmc 1.30:1", "CMC 1.3:1"),
        ("cam16 ucs", "CAM16-UCS"),
    ],
)
def test_names_as_people_write_them(text, name):
    assert formula(text).name == name
    assert formula(formula(text).name) == formula(text)


def test_other_names_are_refused():
    with pytest.raises(UnknownNameError, match="CIE 2000"):
        formula("CIE 2001")


def test_what_is_no_text_is_no_formula(as_users_call):
    for text in (None, 0.8, ["CIE 2000"]):
        with pytest.raises(InputError, match="no name of a formula"):
            formula(text)


@pytest.mark.parametrize(
    "weights",
    [
        "",
        "0:1",
        "two:one",
        "2",
        "-1:1",
        "1:-1",
        "(-2:1)",
        "(2:-1)",
        "- 1:1",
        "-0.5:1",
        "−1:1",
        "+-2:1",
        "2:_-1",
        "2:1 1.0",
        "2 1:1",
        "1 2:1",
        "2:1:1",
        "2:1 (1)",
    ],
)
@pytest.mark.parametrize("name", ["CMC ", "CMC", "cmc_"])
def test_weights_of_cmc_are_two_numbers_above_0(name, weights):
    with pytest.raises(InputError, match="l:c"):
        formula(name + weights)


@pytest.mark.parametrize("written", ["CMC 2:1", "CMC2:1", "(CMC 2:1)", "cmc ( 2 : 1 )", "CMC_2.0:1.0"])
def test_weights_of_cmc_may_be_parted_and_bracketed(written):
    assert formula(written).name == "CMC 2:1"


LABS = np.tile([50.0, 20.0, 10.0], (4, 1))


@pytest.mark.parametrize("method", ["CIE 1976", "CIE 2000", "CMC 2:1"])
@pytest.mark.parametrize(
    ("first", "second", "said"),
    [
        (LABS[:, :2], LABS, "reference_lab: not CIELAB"),
        (LABS, LABS.T, "sample_lab: not CIELAB"),
        (LABS, 3.0, "sample_lab: not CIELAB"),
        (None, LABS, "reference_lab: not CIELAB"),
        ("50, 20, 10", LABS, "reference_lab: not CIELAB"),
        ([[50.0, 20.0, 10.0], [50.0, 20.0]], LABS, "reference_lab: not CIELAB"),
        (LABS, LABS[:3], "do not fit each other"),
    ],
)
def test_sides_that_are_no_colours_or_do_not_fit_are_refused(as_users_call, method, first, second, said):
    with pytest.raises(InputError, match=said):
        delta_e(first, second, method)


@pytest.mark.parametrize("method", ["CIE 1976", "CIE 2000", "CMC 2:1"])
def test_one_standard_is_held_beside_many(method):
    one_by_one = [float(delta_e(LABS[0], each, method)) for each in LABS]
    np.testing.assert_allclose(delta_e(LABS[0], LABS, method), one_by_one, rtol=1e-12)


@pytest.mark.parametrize(
    "text", ["CIE 2000", "dE 94", "CMC 2:1", "cmc 2: 1", "ciede2000", " CIE 1976 ", "DIN 6175-2", "94"]
)
def test_a_tolerance_without_its_limit_is_asked_for_it(text):
    with pytest.raises(InputError, match=r"without its limit(.|\n)*1\.0"):
        Tolerance.of(text)


@pytest.mark.parametrize(
    "text", [0.8, None, ("CIE 2000", 0.8), "0.8", "CIE 2000 -1", "CIE 2000 0", "CMC -2:1 1.0", "CMC 2:-1 1"]
)
def test_what_is_no_tolerance_is_refused(as_users_call, text):
    with pytest.raises(InputError):
        Tolerance.of(text)
