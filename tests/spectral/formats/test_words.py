"""Meaning of words: quantity, unit, illuminant, observer, condition."""

import time

import pytest
from metamer.spectral.formats.shared.colour_words import (
    colour_axis,
    condition_in,
    illuminant_in,
    observer_in,
    stated_colours,
)
from metamer.spectral.formats.shared.words import (
    names_derived,
    names_light,
    other_scale_in,
    quantity_in,
    quantity_in_lines,
    unit_in,
)
from metamer.spectral.illuminants import illuminant


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("Spectral reflectance factor", "reflectance"),
        ("%R", "reflectance"),
        ("R%", "reflectance"),
        ("R (%)", "reflectance"),
        ("R (0-1)", "reflectance"),
        ("T [0..1]", "transmittance"),
        ("Trans", "transmittance"),
        ("illuminated spot R 0.1 mm", None),
        ("Remission", "reflectance"),
        ("Reflexionsgrad", "reflectance"),
        ("R", "reflectance"),
        ("Transmission [%]", "transmittance"),
        ("T%", "transmittance"),
        ("radiance factor 45as15", "radiance factor"),
        ("Radiance (W/sr/m2/nm)", "emission"),
        ("mW·m⁻²·nm⁻¹", "emission"),
        ("uW/cm^2/nm", "emission"),
        ("counts", None),
        ("Radiant Orchid", None),
        ("Absorbance", "absorbance"),
        ("Abs.", "absorbance"),
        ("K/S", "absorbance"),
        ("refractive index", "index"),
        ("a foam reflector", None),
        ("Illuminant: D65", None),
        ("xenon flash lamp, display: on", None),
        ("reflection or transmission", None),
        ("Luminance (cd/m2)", "emission"),
        ("Illuminance [lx]", "emission"),
        ("Red", None),
        ("sample 12", None),
        ("Emission intensity a.u.", "emission"),
        ("Reflectance a.u.", "absorbance"),
        ("R(8°)", "reflectance"),
        ("T (60°)", "transmittance"),
    ],
)
def test_quantities(words, told):
    assert quantity_in(words) == told


def test_remission_is_no_emission():
    """The word for the one ends with the word for the other."""
    assert quantity_in_lines("Modus=Remission") == ("reflectance", "Modus=Remission")


@pytest.mark.parametrize("words", ["Reflectance*100", "100*R", "100 x Reflectance", "R ×100"])
def test_a_hundred_times_a_fraction_is_percent(words):
    assert unit_in(words) == "percent" and other_scale_in(words) is None


@pytest.mark.parametrize("words", ["1000*R", "10 x R", "Reflectance/10", "R/100", "1000 × transmittance"])
def test_other_factors_are_another_scale(words):
    assert other_scale_in(words) and unit_in(words) is None


@pytest.mark.parametrize(
    ("words", "unit"),
    [
        ("%", "percent"),
        ("SPECTRAL_PCT", "percent"),
        ("0..1", "fraction"),
        ("0-1", "fraction"),
        ("Reflectance (0..100)", "percent"),
        ("Reflexion [0-100]", "percent"),
        ("R x100", "percent"),
        ("Scale: 0 to 100", "percent"),
        ("0-100", "percent"),
        ("Dye x100", None),
        ("gradient 0-100", None),
        ("T 0-100 nm", None),
        ("[-]", "fraction"),
        ("W", None),
    ],
)
def test_units(words, unit):
    assert unit_in(words) == unit


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("D50", "D50"),
        ("Illumination=D65\tObserverAngle=10°", "D65"),
        ("ILLUMINANT, D50", "D50"),
        ("CIE Illuminant A", "A"),
        ("A", "A"),
        ("F11", "FL11"),
        ("FL2", "FL2"),
        ("L*(10°/D65)", "D65"),
        ("D50_2", "D50"),
        ("A/10", "A"),
        ("TL84", "TL84"),
        ("Illuminant: TL 83", "TL83"),
        ("L*(10°/CWF)", "CWF"),
        ("U30/10", "U30"),
        ("a paint", None),
        ("panel U30", None),
        ("Another", None),
        ("", None),
    ],
)
def test_illuminants(words, name):
    assert illuminant_in(words) == name
    if name is not None:
        illuminant(name)


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("2", "1931_2"),
        ("10", "1964_10"),
        ("2°", "1931_2"),
        ("10 degree", "1964_10"),
        ("10_Degree", "1964_10"),
        ("ObserverAngle=10", "1964_10"),
        ("Observer: 2", "1931_2"),
        ("OBSERVER, 2 degree", "1931_2"),
        ("CIE 1931", "1931_2"),
        ("D65/10", "1964_10"),
        ("Viewing Angle [°]: 2", "1931_2"),
        ("0.2 degree", None),
        ("12 deg", None),
        ("Red", None),
    ],
)
def test_observers(words, name):
    assert observer_in(words) == name


@pytest.mark.parametrize(
    "heading",
    [
        *(
            "1-R",
            "100 - R (%)",
            "1 - reflectance",
            "1/R",
            "dR/dλ",
            "delta reflectance",
            "T (dB)",
            "Transmission [dB]",
        ),
        *(
            "log10 reflectance",
            "ln(R)",
            "1st derivative of reflectance",
            "Ableitung der Reflexion",
            "Reflectance difference",
        ),
        *("Reflectance (1/sr)", "BRDF reflectance [sr^-1]", "Reflectance, continuum removed"),
    ],
)
def test_functions_of_a_reflectance_are_no_reflectances(heading):
    assert names_derived(heading, [heading])


@pytest.mark.parametrize(
    "heading",
    [
        *("R", "Reflectance (%)", "Normalized reflectance", "Diffuse reflectance", "sample 1-R", "10-R", "Tgt./Ref. %"),
        *("Radiance (W/m2/sr/nm)", "reflected radiance W m-2 sr-1 nm-1", "derivative", "difference", "R-1"),
    ],
)
def test_other_headings_are_no_functions(heading):
    assert not names_derived(heading, [heading])
    assert not names_derived("1-R", ["1-R", "2-R"])


@pytest.mark.parametrize(
    ("words", "name"), [("MeasurementCondition=M1 Filter=no", "M1"), ("M2", "M2"), ("M10", None), ("PM1", None)]
)
def test_conditions(words, name):
    assert condition_in(words) == name


@pytest.mark.parametrize(
    ("header", "axis"),
    [
        ("XYZ_X", ("XYZ", 0)),
        ("X", ("XYZ", 0)),
        ("x", None),
        ("Tristimulus Value Z", ("XYZ", 2)),
        ("LAB_B", ("Lab", 2)),
        ("L*", ("Lab", 0)),
        ("L*(10°/D65)", ("Lab", 0)),
        ("CIE a*", ("Lab", 1)),
        ("Label", None),
        ("Yellow", None),
        ("RGB_B", None),
        ("", None),
    ],
)
def test_columns_of_colours(header, axis):
    assert colour_axis(header) == axis


def test_a_colour_needs_all_three():
    cells = {"X": 1.0, "Y": 2.0, "L*": 50.0, "a*": 1.0, "b*": float("nan")}
    assert stated_colours(cells) == ()
    (xyz,) = stated_colours({**cells, "Z": 3.0}, "D65", "1964_10")
    assert xyz.values.tolist() == [1.0, 2.0, 3.0] and (xyz.illuminant, xyz.observer) == ("D65", "1964_10")


def test_two_lights_beside_one_spectrum():
    cells = {f"{axis}*({light})": float(value) for light in ("D65", "A") for value, axis in enumerate("Lab")}
    assert [colour.illuminant for colour in stated_colours(cells)] == ["D65", "A"]


@pytest.mark.parametrize("name", ["D65", "LED 4000 K", "tungsten lamp", "Illuminant A", "FL2", "day_D50"])
def test_names_of_lights(name):
    assert names_light(name)


@pytest.mark.parametrize(
    "name", ["A", "F2", "B1", "light skin", "daylight fluorescent orange", "Red", "called", "FL2a"]
)
def test_names_of_paints(name):
    assert not names_light(name)


@pytest.mark.slow_cases("-illumination ")
@pytest.mark.parametrize(("before", "repeated"), [("mW", " "), ("log (", " "), ("", "A"), ("", "illumination ")])
def test_long_words_take_no_longer_a_letter_than_short_ones(before, repeated):
    """Spaces in a header must not be tried in every combination: the time grows as their number, not as its square."""

    def seconds(count):
        words, taken = before + count * repeated, []
        for _ in range(5):
            start = time.process_time()
            for _ in range(32_000 // count):
                (
                    quantity_in(words),
                    names_derived(words),
                    unit_in(words),
                    illuminant_in(words),
                    observer_in(words),
                    condition_in(words),
                )
                colour_axis(words)
            taken.append(time.process_time() - start)
        return min(taken)

    # As many letters in all either way: a quadratic pattern takes 32 times as long in the long words.
    assert seconds(16_000) < 8.0 * seconds(500)
