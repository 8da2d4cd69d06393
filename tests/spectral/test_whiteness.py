"""Whiteness, tint and yellowness, beside colour-science and printed examples."""

from __future__ import annotations

from inspect import unwrap

import numpy as np
import pytest
from metamer.runtime.errors import ComparisonError, UnknownNameError
from metamer.spectral.formats.registry import StatedColour
from metamer.spectral.illuminants import illuminant
from metamer.spectral.metamerism import Conditions
from metamer.spectral.observers import OBSERVERS, observer
from metamer.spectral.sample import Sample
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.whiteness import whiteness, yellowness

NM = np.arange(380.0, 781.0, 10.0)
WIDE = Conditions("D65", "1964_10")


def stated(xyz, light, eye):
    return Sample("stated", "test", stated=(StatedColour("XYZ", np.array(xyz, dtype=np.float64), light, eye),))


def paper(yellow=0.1):
    """A white that absorbs some blue."""
    return Sample("paper", "test", (Spectrum.sampled(NM, 0.88 - yellow / (1.0 + np.exp((NM - 460.0) / 20.0))),))


def brightened(light, eye):
    """Paper with an optical brightener: bluer than what falls on it."""
    return 0.9 * eye.white(light) * np.array([0.99, 0.98, 1.09])


def test_the_printed_example_of_cie_2004(colour):
    # Example of colour-science's documentation, with its white: 93.85 and -1.305.
    xy, white = np.array([0.3167, 0.3334]), observer("1931_2").white(illuminant("D65"))
    found = whiteness(
        stated([100 * xy[0] / xy[1], 100.0, 100 * (1 - xy.sum()) / xy[1]], "D65", "1931_2"), Conditions("D65", "1931_2")
    )
    off = np.array([0.3139, 0.3311]) - colour.XYZ_to_xy(white)
    assert found.index + 800 * off[0] + 1700 * off[1] == pytest.approx(93.85, abs=1e-2)
    assert found.tint + 1000 * off[0] - 650 * off[1] == pytest.approx(-1.305, abs=1e-3)


def test_the_printed_examples_of_astm_e313():
    # X-Rite's calculations guide, as colour-science's documentation has them.
    old = stated([95.0, 100.0, 105.0], "C", "1931_2")
    assert whiteness(old, Conditions("C", "1931_2"), "ASTM E313-73").index == pytest.approx(55.74, abs=1e-9)
    assert yellowness(stated([95.0, 100.0, 105.0], "D65", "1931_2"), Conditions("D65", "1931_2")) == pytest.approx(
        4.34, abs=1e-9
    )


@pytest.mark.parametrize("eye", ["1931_2", "1964_10"])
@pytest.mark.parametrize("one", [paper(), paper(0.2), Sample("brightened", "test", seen=brightened)])
def test_whiteness_and_tint_are_colour_science_s(colour, eye, one):
    light = illuminant("D65")
    white, xyz = observer(eye).white(light), 100.0 * one.xyz("D65", eye)
    wanted = colour.colorimetry.whiteness_CIE2004(
        colour.XYZ_to_xy(xyz), xyz[1], colour.XYZ_to_xy(white), observer=OBSERVERS[eye]
    )
    found = whiteness(one, Conditions("D65", eye))
    np.testing.assert_allclose([found.index, found.tint], wanted, atol=1e-4)


@pytest.mark.parametrize("eye", ["1931_2", "1964_10"])
@pytest.mark.parametrize("light", ["C", "D65"])
def test_yellowness_is_colour_science_s(colour, light, eye):
    weights = colour.colorimetry.YELLOWNESS_COEFFICIENTS_ASTME313[OBSERVERS[eye]][light]
    for one in (paper(), paper(0.5)):
        wanted = colour.colorimetry.yellowness_ASTME313(100.0 * one.xyz(light, eye), weights)
        assert yellowness(one, Conditions(light, eye)) == pytest.approx(float(wanted), abs=1e-4)


def test_the_whiteness_of_1973_is_colour_science_s(colour):
    wanted = colour.colorimetry.whiteness_ASTME313(100.0 * paper().xyz("C", "1931_2"))
    found = whiteness(paper(), Conditions("C", "1931_2"), "ASTM E313-73")
    assert found.index == pytest.approx(float(wanted), abs=1e-4) and found.tint is None


@pytest.mark.parametrize("eye", ["1931_2", "1964_10"])
@pytest.mark.parametrize("light", ["C", "D50", "D65"])
def test_the_tables_of_astm_e313_are_of_this_perfect_diffuser(light, eye):
    diffuser = Sample("diffuser", "test", (Spectrum.sampled(NM, np.ones(NM.size)),))
    found = whiteness(diffuser, Conditions(light, eye), "ASTM E313")
    # Half of the fourth digit of x and y, and C of 10 degrees, which other tables differ in by one.
    assert found.index == pytest.approx(100.0, abs=0.3) and found.tint == pytest.approx(0.0, abs=0.15)
    if light != "D50":
        assert yellowness(diffuser, Conditions(light, eye)) == pytest.approx(0.0, abs=0.05)
    if light == "D65":
        assert whiteness(diffuser, Conditions(light, eye)).index == pytest.approx(100.0, abs=1e-9)


def test_a_brightener_whitens_and_yellowing_shows():
    white = Sample("brightened", "test", seen=brightened)
    assert whiteness(white).index > 100.0 > whiteness(paper()).index > whiteness(paper(0.2)).index
    assert yellowness(white) < 0.0 < yellowness(paper()) < yellowness(paper(0.2))


def test_other_names_of_the_same_conditions_serve():
    same = Conditions("d65", "CIE 1964 10 Degree Standard Observer")
    assert whiteness(paper(), same) == whiteness(paper(), WIDE)


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (lambda: whiteness(paper(), Conditions("A", "1964_10")), "not defined for A, 1964_10; it is for D65, 1931_2"),
        (lambda: whiteness(paper(), Conditions("D65", "2015_10")), "not defined for D65, 2015_10"),
        (lambda: whiteness(paper(), WIDE, "ASTM E313-73"), "it is for C, 1931_2"),
        (lambda: whiteness(paper(), Conditions("FL2", "1931_2"), "ASTM E313"), "C, 1931_2; D50, 1931_2"),
        (lambda: yellowness(paper(), Conditions("D50", "1931_2")), "yellowness ASTM E313 is not defined for D50"),
        (lambda: whiteness(stated([90, 95, 100], "D65", "1931_2")), "stated for D65 and 1931_2"),
    ],
)
def test_what_an_index_is_not_for_is_refused(found, words):
    with pytest.raises(ComparisonError, match=words):
        found()


@pytest.mark.parametrize(
    ("share", "method", "words"),
    [
        ((0.5, 0.5, 0.5), "CIE 2004", "5 Y - 280 = -30.0, and it would be 50.0"),
        ((0.95, 0.95, 0.55), "CIE 2004", "above 40 and below"),
        ((0.95, 0.95, 1.35), "CIE 2004", "below 5 Y - 280 = 195.0"),
        ((0.84, 0.9, 0.86), "CIE 2004", "a tint above -4 and below 2"),
        ((0.96, 0.9, 0.97), "CIE 2004", "a tint above -4 and below 2"),
        ((0.6, 0.6, 0.6), "ASTM E313", "Y above 65, and its is 60.0"),
        ((0.0, 0.0, 0.0), "CIE 2004", "black under D65, 1964_10"),
        ((0.0, 0.0, 0.0), "ASTM E313", "black under D65, 1964_10"),
    ],
)
def test_what_is_no_white_is_refused_with_the_limit(share, method, words):
    one = Sample("other", "test", seen=lambda light, eye: np.array(share) * eye.white(light))
    with pytest.raises(ComparisonError, match=words):
        whiteness(one, WIDE, method)


def test_an_unknown_method_is_refused():
    # Behind the check of annotations, which only tests have.
    with pytest.raises(UnknownNameError, match="CIE 2004, ASTM E313"):
        unwrap(whiteness)(paper(), WIDE, "Berger")
