"""Observers, and folding lights with them: absolute values first."""

import numpy as np
import pytest
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.illuminants import illuminant, illuminant_names, light_source_names
from metamer.spectral.observers import OBSERVERS, observer, observer_name
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM

# X and Z of the white, Y = 1, and the tolerance: CIE 15:2004 table T.3.
# The fluorescent rows follow from the chromaticities of table T.8 to four digits, and carry that rounding.
CIE_WHITES = {
    ("1931_2", "D65"): (0.95047, 1.08883, 1e-4),
    ("1931_2", "A"): (1.09850, 0.35585, 1e-4),
    ("1931_2", "C"): (0.98074, 1.18232, 6e-4),
    ("1931_2", "D50"): (0.96422, 0.82521, 1e-4),
    ("1931_2", "D55"): (0.9568, 0.9214, 1e-4),
    ("1931_2", "D75"): (0.9497, 1.2261, 1e-4),
    ("1931_2", "FL2"): (0.99201, 0.67393, 1e-3),
    ("1931_2", "FL7"): (0.95044, 1.08755, 1.5e-3),
    ("1931_2", "FL11"): (1.00962, 0.64350, 1e-3),
    ("1964_10", "D65"): (0.94811, 1.07304, 1e-4),
    ("1964_10", "A"): (1.11144, 0.35200, 1e-4),
    ("1964_10", "D50"): (0.96720, 0.81427, 2e-4),
}


@pytest.mark.parametrize(("key", "light"), list(CIE_WHITES))
def test_whites_against_published_values(key, light):
    x, z, tolerance = CIE_WHITES[key, light]
    np.testing.assert_allclose(observer(key).white(illuminant(light)), [x, 1.0, z], rtol=0, atol=tolerance)


@pytest.mark.parametrize("key", ["1931_2", "1964_10"])
def test_chromaticity_of_every_cie_illuminant_against_the_published_one(colour, key):
    """Within 3e-4: lamps are published to four digits, from sums at 5 nm."""
    published = colour.CCS_ILLUMINANTS[OBSERVERS[key]]
    off = {}
    for name in illuminant_names():
        white = observer(key).white(illuminant(name))
        off[name] = np.abs(white[:2] / white.sum() - published[name]).max()
    worst = max(off, key=off.get)
    assert off[worst] < 3e-4, (worst, off[worst])


@pytest.mark.filterwarnings("ignore::Warning")
@pytest.mark.parametrize("key", list(OBSERVERS))
def test_whites_against_colour_science(colour, key):
    """Its integration stops at the light's last sample on a 1 nm grid, hence not to the last digit."""
    cmfs = colour.MSDS_CMFS[OBSERVERS[key]]
    for name in ("D65", "A", "FL2", "FL11", "HP1", "LED-RGB1"):
        oracle = colour.sd_to_XYZ(colour.SDS_ILLUMINANTS[name], cmfs, method="Integration")
        found = observer(key).white(illuminant(name))
        np.testing.assert_allclose(found, oracle / oracle[1], rtol=0, atol=1e-4, err_msg=name)


@pytest.mark.filterwarnings("ignore::Warning")
@pytest.mark.parametrize("light", ["D65", "A", "FL11", "HP1"])
def test_chart_colours_against_colour_science(colour, chart, light):
    cmfs = colour.MSDS_CMFS[OBSERVERS["1931_2"]]
    lamp = colour.SDS_ILLUMINANTS[light]
    weights = observer("1931_2").weights(illuminant(light), WORKING_WAVELENGTHS_NM)
    for values in chart.reflectances[::5]:
        patch = colour.SpectralDistribution(values, WORKING_WAVELENGTHS_NM)
        oracle = colour.sd_to_XYZ(patch, cmfs, lamp, method="Integration") / 100
        np.testing.assert_allclose(weights @ values, oracle, rtol=0, atol=2e-4)


@pytest.mark.parametrize("key", list(OBSERVERS))
def test_perfect_diffuser_has_y_of_exactly_one_on_any_grid(key):
    for light in ("D65", "FL11", "LPS"):
        for grid in (WORKING_WAVELENGTHS_NM, np.arange(400.0, 701.0, 10.0), np.array([450.0, 520.0, 640.0])):
            assert observer(key).weights(illuminant(light), grid)[1].sum() == pytest.approx(1.0, abs=1e-13)


@pytest.mark.parametrize("key", list(OBSERVERS))
def test_light_of_one_line_has_the_colour_of_that_wavelength(key):
    """A 1 nm line at 546 nm: the white is the observer's own response there, and a surface shows its value there."""
    eye = observer(key)
    line = Spectrum.sampled([545.0, 546.0, 547.0], [0.0, 1.0, 0.0], "emission")
    response = eye.cmfs[eye.wavelengths_nm == 546.0][0]
    np.testing.assert_allclose(eye.white(line), response / response[1], rtol=1e-12)
    ramp = (WORKING_WAVELENGTHS_NM - 380) / 400
    np.testing.assert_allclose(
        eye.weights(line, WORKING_WAVELENGTHS_NM) @ ramp, (546 - 380) / 400 * response / response[1], rtol=1e-12
    )


def test_line_between_the_observer_s_wavelengths_is_not_lost():
    eye = observer("1931_2")
    line = Spectrum.sampled([546.05, 546.07, 546.09], [0.0, 1.0, 0.0], "emission")
    near = eye.cmfs[eye.wavelengths_nm == 546.0][0]
    np.testing.assert_allclose(eye.white(line), near / near[1], rtol=0.02)


def test_light_s_brightness_does_not_matter():
    d65 = illuminant("D65")
    bright = Spectrum.sampled(d65.wavelengths_nm, 1e6 * d65.samples, "emission")
    np.testing.assert_allclose(observer("1931_2").white(bright), observer("1931_2").white(d65), rtol=1e-12)


def test_light_of_zero_power_is_an_error():
    dark = Spectrum.sampled([380.0, 780.0], [0.0, 0.0], "emission")
    with pytest.raises(InputError, match="the light has zero power") as caught:
        observer("1931_2").white(dark)
    assert "switch the light off" in str(caught.value)


def test_light_that_is_all_infrared_is_an_error():
    with pytest.raises(InputError, match="the light has zero power"):
        observer("1931_2").white(Spectrum.sampled([800.0, 880.0, 910.0, 920.0], [0.0, 0.0, 1.0, 0.0], "emission"))


def test_light_that_is_known_only_where_nobody_sees_is_an_error():
    """Held from there it would pass for equal energy."""
    for wavelengths_nm in ([900.0, 950.0], [300.0, 350.0]):
        with pytest.raises(InputError, match="not known where the observer sees") as caught:
            observer("1931_2").white(Spectrum.sampled(wavelengths_nm, [1.0, 1.0], "emission"))
        assert f"found: {wavelengths_nm[0]:g} to {wavelengths_nm[1]:g} nm" in str(caught.value)


@pytest.mark.parametrize("scale", [1e300, 1e-300])
def test_light_in_units_near_the_ends_of_float64(scale):
    d65 = illuminant("D65")
    light = Spectrum.sampled(d65.wavelengths_nm, scale * d65.samples, "emission")
    np.testing.assert_allclose(observer("1931_2").white(light), observer("1931_2").white(d65), rtol=1e-12)


def test_reflectance_given_as_a_light_is_an_error():
    with pytest.raises(InputError, match="not a light") as caught:
        observer("1931_2").white(Spectrum.sampled([380.0, 780.0], [1.0, 1.0], "reflectance"))
    assert "found: reflectance of shape (2,)" in str(caught.value)


def test_two_lights_given_as_one_are_an_error():
    with pytest.raises(InputError, match="one emission spectrum"):
        observer("1931_2").white(Spectrum.sampled([380.0, 780.0], np.ones((2, 2)), "emission"))


def test_light_of_one_sample_is_an_error():
    """Held beyond its only sample it would pass for equal energy."""
    with pytest.raises(InputError, match="a light of one sample") as caught:
        observer("1931_2").white(Spectrum.sampled([546.0], [1.0], "emission"))
    assert "546 nm alone" in str(caught.value)


@pytest.mark.parametrize(("key", "name"), list(OBSERVERS.items()))
def test_short_and_long_names_are_the_same_observer(colour, key, name):
    assert observer(key).name == name == observer(name.lower()).name
    np.testing.assert_array_equal(observer(key).cmfs, colour.MSDS_CMFS[name].values)


@pytest.mark.parametrize("spelt", ["10", "10°", "1964", "CIE 1964", " cie1964 "])
def test_an_angle_or_a_year_alone_is_a_standard_observer_of_cie_15(spelt):
    """Not the one of CIE 170 (2015_10), to which "10" is spelt nearer."""
    assert observer(spelt) is observer("1964_10") and observer_name(spelt) == "1964_10"


def test_unknown_observer_gives_the_nearest_names():
    with pytest.raises(UnknownNameError, match="nearest: 1931_2"):
        observer("1931-2")


def test_every_light_has_a_white_for_every_observer():
    for name in illuminant_names() + light_source_names():
        for key in OBSERVERS:
            white = observer(key).white(illuminant(name))
            assert np.isfinite(white).all() and (white >= 0).all(), (name, key, white)
            # Low-pressure sodium, two lines at 589 nm, says nothing to the short-wave functions of two observers.
            assert white[2] > 0 or name == "LPS", (name, key, white)
