"""Stated tristimulus values against the spectra beside them."""

from pathlib import Path

import numpy as np
import pytest
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.difference import lab_from_xyz
from metamer.spectral.formats.registry import SpectralEntry, StatedColour, read_spectra
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.stated_colours import compared, implied_white

GRID = np.arange(380.0, 781.0, 10.0)
GREEN = 0.1 + 0.5 * np.exp(-(((GRID - 530) / 60) ** 2))


def stated_under(light, angle, space="XYZ", named=True, values=GREEN):
    """Return what a careful instrument states of `values` under a light."""
    seen, power = observer(angle), illuminant(light)
    xyz = seen.weights(power, GRID) @ values
    held = 100 * xyz if space == "XYZ" else lab_from_xyz(xyz, seen.white(power))
    return StatedColour(space, held, light if named else None, angle if named else None)


def entry(*stated, values=GREEN, quantity="reflectance"):
    return SpectralEntry("green", Spectrum.sampled(GRID, values, quantity), stated)


@pytest.mark.parametrize("light", ["D50", "D65", "A", "FL11"])
@pytest.mark.parametrize("angle", ["1931_2", "1964_10"])
@pytest.mark.parametrize("space", ["XYZ", "Lab"])
def test_what_is_stated_for_a_light_is_found_again(light, angle, space):
    (found,) = compared(entry(stated_under(light, angle, space)))
    assert found.delta_e94 < 1e-10
    assert (found.illuminant, found.observer, found.assumed) == (light, angle, ())
    np.testing.assert_allclose(found.recomputed, found.stated.values)


def test_colour_science_states_the_same(colour):
    sd = colour.SpectralDistribution(dict(zip(GRID, GREEN, strict=True)))
    with colour.utilities.suppress_warnings(colour_runtime_warnings=True):
        xyz = colour.sd_to_XYZ(sd, illuminant=colour.SDS_ILLUMINANTS["D65"], method="Integration")
    (found,) = compared(entry(StatedColour("XYZ", np.asarray(xyz), "D65", "1931_2")))
    assert found.delta_e94 < 0.05


def test_the_stated_colour_is_the_reference():
    """CIE 1994 weighs by the chroma of the reference."""
    stated = stated_under("D65", "1931_2", "Lab")
    paler = StatedColour("Lab", stated.values * np.array([1.0, 0.5, 0.5]), "D65", "1931_2")
    (found,) = compared(entry(paler))
    chroma, whole = np.hypot(*paler.values[1:]), np.hypot(*stated.values[1:])
    assert found.delta_e94 == pytest.approx((whole - chroma) / (1 + 0.045 * chroma))


def test_silence_is_d50_and_2_degrees_and_is_said():
    (found,) = compared(entry(stated_under("D50", "1931_2", named=False)))
    assert found.delta_e94 < 1e-10
    assert found.assumed == (
        "illuminant D50, for the file names none",
        "observer 1931_2, for the file names none",
    )


@pytest.mark.parametrize("light", ["D50", "D65", "A", "C", "FL2", "FL11"])
@pytest.mark.parametrize("angle", ["1931_2", "1964_10"])
def test_xyz_and_lab_together_tell_the_white(light, angle):
    both = [stated_under(light, angle, space, named=False) for space in ("XYZ", "Lab")]
    rounded = [StatedColour(colour.space, np.round(colour.values, 2)) for colour in both]
    assert implied_white(tuple(rounded)) == (light, angle)
    for found in compared(entry(*rounded)):
        assert (found.illuminant, found.observer) == (light, angle) and found.delta_e94 < 0.02
        assert found.assumed == (f"the file's XYZ and Lab belong to {light} and {angle}",)


def test_a_white_that_is_nobody_s_or_too_dark_to_tell():
    xyz, lab = (stated_under("D65", "1931_2", space, named=False) for space in ("XYZ", "Lab"))
    assert implied_white((xyz,)) is None
    assert implied_white((StatedColour("XYZ", xyz.values * np.array([1.0, 1.0, 1.1])), lab)) is None
    dark = [stated_under("D65", "1931_2", space, False, 0.01 * GREEN) for space in ("XYZ", "Lab")]
    assert implied_white(tuple(dark)) is None


def test_a_light_is_compared_at_the_stated_luminance():
    power = illuminant("FL4").resampled(GRID).samples
    xyz = observer("1931_2").sensitivity(GRID) @ power
    lux = StatedColour("XYZ", 683.002 * xyz / 1000.0, None, "1931_2")
    (found,) = compared(entry(lux, values=power, quantity="emission"))
    assert found.delta_e94 < 1e-10 and found.illuminant is None
    assert found.lumens_ratio == pytest.approx(1e-3)
    bluer = StatedColour("XYZ", lux.values * np.array([1.0, 1.0, 1.1]), None, "1931_2")
    assert compared(entry(bluer, values=power, quantity="emission"))[0].delta_e94 > 3.0


def test_a_light_of_no_luminance():
    dark = StatedColour("XYZ", np.zeros(3))
    with pytest.raises(InputError, match="a light without luminance"):
        compared(entry(dark, quantity="emission"))


def test_an_unknown_light_is_named():
    with pytest.raises(UnknownNameError, match="unknown illuminant"):
        compared(entry(StatedColour("XYZ", np.ones(3), "shop window", "1931_2")))


def test_a_real_meter_agrees_with_itself(shared_data):
    """UPRtek states XYZ in lux of a spectrum in mW/m2/nm: the ratio says so, and the colour is the same."""
    (light,) = read_spectra(shared_data / "spectra" / "text" / "uprtek.xls.txt").entries
    (found,) = compared(light)
    assert found.delta_e94 < 0.001
    assert found.lumens_ratio == pytest.approx(1e-3, rel=1e-5)
    assert found.assumed == ("observer 1931_2, for the file names none",)


def test_a_real_meter_that_states_its_observer(colour):
    """Sekonic: XYZ in lux of a spectrum in W/m2/nm, and the coarser list of the same spectrum left out."""
    path = Path(colour.__file__).parent / "io" / "tests" / "resources" / "RANDOM_001_02._3262K.csv"
    if not path.is_file():
        pytest.skip("this colour-science comes without its test files")
    file = read_spectra(path)
    (light,) = file.entries
    assert file.format == "instrument text" and light.spectrum.wavelengths_nm.size == 401
    (found,) = compared(light)
    assert found.observer == "1931_2" and found.assumed == ()
    assert found.delta_e94 < 0.1 and found.lumens_ratio == pytest.approx(1.0, rel=1e-3)
