"""Spectra in scripts: taken from other libraries, mixed, seen under a light, drawn, and given back."""

import sys
import warnings

import colour
import numpy as np
import pandas
import pytest
from metamer import Spectrum, illuminant, match, observer
from metamer.runtime.errors import InputError
from metamer.spectral.illuminants import as_light

NM = np.arange(380.0, 781.0, 10.0)
RED = 0.1 + 0.6 / (1.0 + np.exp(-(NM - 600.0) / 15.0))


@pytest.mark.parametrize(
    "value",
    [
        colour.SpectralDistribution(RED, NM),
        (NM, RED),
        dict(zip(NM, RED, strict=True)),
        pandas.Series(RED, index=NM),
        pandas.DataFrame({"red": RED}, index=NM),
        colour.MultiSpectralDistributions(RED, NM, labels=["red"]),
    ],
    ids=lambda value: type(value).__name__,
)
def test_a_spectrum_is_made_of_whatever_holds_one(value):
    for made in (Spectrum(value), Spectrum.of(value)):
        assert np.array_equal(made.wavelengths_nm, NM) and np.allclose(made.samples, RED, rtol=0, atol=1e-15)
        assert made.quantity == "reflectance"


def test_several_spectra_are_not_one():
    with pytest.raises(InputError, match="no spectrum"):
        Spectrum(pandas.DataFrame({"red": RED, "blue": RED[::-1]}, index=NM))
    with pytest.raises(InputError, match="no spectrum"):
        Spectrum("red")


def test_colours_are_those_of_colour_science():
    light, eye = colour.SDS_ILLUMINANTS["A"], colour.MSDS_CMFS["CIE 1964 10 Degree Standard Observer"]
    shape = colour.SpectralShape(360, 830, 1)
    fine = colour.SpectralDistribution(RED, NM).align(shape)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of shapes that are aligned
        theirs = colour.sd_to_XYZ(fine, eye.copy().align(shape), light.copy().align(shape)) / 100.0
    red = Spectrum((NM, RED))
    assert red.xyz("A", "1964_10") == pytest.approx(theirs, abs=2e-4)
    assert np.array_equal(red.xyz(light, observer("1964_10")), red.xyz("A", "1964_10"))
    assert np.array_equal(red.xyz(), red.xyz("D65", "1931_2"))
    assert Spectrum((NM, np.full(NM.size, 0.5))).lab("FL11") == pytest.approx([76.0693, 0.0, 0.0], abs=1e-3)


def test_many_spectra_have_many_colours():
    both = Spectrum.sampled(NM, np.stack([RED, 0.5 * RED]))
    assert both.xyz().shape == both.lab().shape == (2, 3)
    assert np.allclose(both.xyz()[1], Spectrum((NM, 0.5 * RED)).xyz())
    assert both.to_colour().values.shape == (NM.size, 2)


def test_a_light_has_its_own_xyz_and_no_other():
    flat = Spectrum.sampled(np.arange(360.0, 831.0), np.ones(471), "emission")
    assert flat.xyz()[1] == pytest.approx(683.002 * observer("1931_2").cmfs[:, 1].sum(), rel=1e-6)
    for wrong in (lambda: flat.xyz("D65"), flat.lab):
        with pytest.raises(InputError, match="a light has no"):
            wrong()


def test_an_observer_is_a_name_or_an_angle_and_no_table(as_users_call):
    red = Spectrum((NM, RED))
    assert np.array_equal(red.lab("A", 10), red.lab("A", "1964_10"))
    with pytest.raises(InputError, match=r"(?s)not the name of an observer.*array.*1931_2"):
        red.lab("A", np.ones((31, 3)))


def test_too_little_of_the_visible_has_no_colour():
    with pytest.raises(InputError, match="too little of the visible"):
        Spectrum({500.0: 0.2, 600.0: 0.3}).xyz()


def test_shares_of_spectra_are_mixed():
    red, grey = Spectrum((NM, RED)), Spectrum((NM, np.full(NM.size, 0.4)))
    mixed = 0.25 * red + grey * np.float64(0.75)
    assert np.allclose(mixed.samples, 0.25 * RED + 0.3) and mixed.quantity == "reflectance"
    assert np.allclose((red / 2 - 0.1 * grey).samples, 0.5 * RED - 0.04)
    lit = illuminant("D65").resampled(NM) * red
    assert lit.quantity == "emission" and np.allclose(lit.samples, illuminant("D65").resampled(NM).samples * RED)
    assert (red * grey).quantity == "reflectance"


@pytest.mark.parametrize(
    ("mix", "words"),
    [
        (lambda red: red + red + red, "above 1"),
        (lambda red: 0.1 * red - red, "negative"),
        (lambda red: red + illuminant("D65").resampled(NM), "quantities do not mix"),
        (lambda red: red + illuminant("D65"), "other wavelengths"),
        (lambda red: illuminant("D65") * illuminant("D65"), "two lights"),
        (lambda red: red / 0, "divided by 0"),
    ],
)
def test_what_cannot_be_mixed_is_refused(mix, words):
    with pytest.raises(InputError, match=words):
        mix(Spectrum((NM, RED)))


@pytest.mark.parametrize("other", ["red", None, [1.0, 2.0], np.array([1.0, 2.0]), True])
def test_spectra_are_no_arrays(other):
    with pytest.raises(TypeError):
        other * Spectrum((NM, RED))


def test_it_goes_back_to_colour_science_as_it_came():
    there = Spectrum((NM, RED)).to_colour()
    assert np.array_equal(there.wavelengths, NM) and np.array_equal(there.values, RED)
    with pytest.raises(InputError, match="too many axes"):
        Spectrum.sampled(NM, np.zeros((2, 2, NM.size))).to_colour()


def test_a_light_is_a_name_or_whatever_holds_one():
    assert as_light("A") is illuminant("A")
    lamp = as_light({400.0: 1.0, 700.0: 2.0})
    assert lamp.quantity == "emission" and np.array_equal(observer("1931_2").white(lamp), observer("1931_2").white(
        {400.0: 1.0, 700.0: 2.0}
    ))  # fmt: skip
    assert observer("1931_2").white("A") == pytest.approx([1.0985, 1.0, 0.3559], abs=1e-4)


def test_a_notebook_shows_curve_and_colour():
    shown = Spectrum((NM, RED))._repr_html_()
    assert shown.count("<polyline") == 1 and "background:rgb(" in shown and "380 to 780 nm" in shown
    assert "background" not in illuminant("A")._repr_html_()
    assert "as near as sRGB comes" in Spectrum((NM, np.where(NM > 600.0, 0.9, 0.0)))._repr_html_()


def test_a_plot_has_the_curve():
    from matplotlib.figure import Figure

    axes = Spectrum((NM, RED)).plot(Figure().subplots(), color="r")
    assert np.array_equal(axes.lines[0].get_xydata(), np.stack([NM, RED], axis=1))
    assert axes.get_ylabel() == "reflectance" and axes.get_ylim() == (0.0, 1.0)


@pytest.mark.parametrize(("library", "extra"), [("matplotlib", "plot"), ("pandas", "pandas")])
def test_a_library_that_is_missing_is_named(library, extra, monkeypatch):
    from metamer.runtime.notebook import data_frame, new_axes

    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(InputError, match=rf"{library} is not installed(?s:.*)metamer-colour\[{extra}\]"):
        new_axes() if library == "matplotlib" else data_frame(["a"], [[1]])


LOTS = np.array([RED, RED[::-1]])


@pytest.mark.parametrize(
    ("table", "hint"),
    [
        (pandas.DataFrame(LOTS, columns=[f"{nm:g} nm" for nm in NM]), r"df\.T"),
        (pandas.DataFrame(LOTS, columns=[f"{nm:g}nm" for nm in NM], index=["lot 1", "lot 2"]), r"df\.T"),
        (pandas.DataFrame(LOTS, columns=NM, index=["lot 1", "lot 2"]), r"df\.T"),
        (pandas.DataFrame(LOTS, columns=NM), r"df\.T"),
        (pandas.DataFrame({"lot": ["a", "b"]} | dict(zip(NM, LOTS.T, strict=True))), r"df\.set_index\('lot'\)\.T"),
        (pandas.Series(RED), r"df\.set_index\(the column of wavelengths\)"),
        (pandas.DataFrame({"red": RED, "blue": RED}), r"df\.set_index\(the column of wavelengths\)"),
        (pandas.DataFrame({"nm": NM, "red": RED}), r"df\.set_index\('nm'\)"),
        (pandas.DataFrame({"red": RED, "Wavelength (nm)": NM}), r"df\.set_index\('Wavelength \(nm\)'\)"),
        (pandas.DataFrame({"wavelength_nm": NM, "red": RED}), r"df\.set_index\('wavelength_nm'\)"),
    ],
)
def test_a_table_with_its_wavelengths_elsewhere_is_told_to_turn(table, hint):
    for take in (Spectrum, lambda value: match((NM, RED), value)):
        with pytest.raises(InputError, match=hint):
            take(table)


@pytest.mark.parametrize("label", ["{:g} nm", "{:g}nm", "{:.1f}", "{:g} NM"])
def test_a_turned_table_has_its_unit_in_the_index(label):
    table = pandas.DataFrame(RED[None], columns=[label.format(nm) for nm in NM], index=["red"]).T
    assert np.array_equal(Spectrum(table).wavelengths_nm, NM) and np.allclose(Spectrum(table).samples, RED)


def test_a_table_over_wavelengths_may_have_numbers_for_names():
    table = pandas.DataFrame({500: RED, 600: RED, "nm": RED}, index=NM)
    assert len(match((NM, 0.9 * RED), table).samples) == 3
