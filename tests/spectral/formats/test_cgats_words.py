"""CGATS files: what was measured by words anywhere in the file, held against stated colours; names of bands."""

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.formats.cgats import read
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.registry import format_of

BANDS = tuple(range(400, 701, 20))


def chart(*lines, identifier="CGATS.17", values=0.4, colour="XYZ", stated=(38, 40, 33), band="SPECTRAL_NM{}"):
    """A file of two samples, the second half as bright as the first, with their colour."""
    fields = ["SAMPLE_ID", *(f"{colour}_{axis}" for axis in ("XYZ" if colour == "XYZ" else "LAB"))]
    rows = []
    for number, part in ((1, 1.0), (2, 0.5)):
        colours = (
            [f"{part * value:g}" for value in stated]
            if colour == "XYZ"
            else [f"{stated[0] * (1, 0.728)[number - 1]}", *map(str, stated[1:])]
        )
        rows.append(" ".join([str(number), *colours, *[f"{part * values:g}"] * len(BANDS)]))
    head = [identifier, *lines, "BEGIN_DATA_FORMAT", " ".join([*fields, *(band.format(nm) for nm in BANDS)])]
    return "\n".join([*head, "END_DATA_FORMAT", "BEGIN_DATA", *rows, "END_DATA", ""])


def quantity(file):
    (found,) = {entry.spectrum.quantity for entry in file.entries}
    return found


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ('MEASUREMENT_SOURCE "Emission"', "emission"),
        ('MEASUREMENT_MODE "Emissive"', "emission"),
        ('MEASUREMENT_TYPE "SPOT"\nMODE "EMISSION"', "emission"),
        ('UNITS "mW/m2/nm"', "emission"),
        ('PRINT_CONDITIONS "film, transmission"', "transmittance"),
        ('MODE "Reflection"\nINSTRUMENTATION "head for emission"', "reflectance"),
        ('INSTRUMENT_MODEL "with emission head"\nDESCRIPTOR "Reflectance of inks"', "reflectance"),
        ('ORIGINATOR "Emission Lab"\nMODE "Reflection"', "reflectance"),
        ('SAMPLE_BACKING "non-reflective black"\nMODE "Transmissive"', "transmittance"),
    ],
)
def test_what_was_measured_by_words_in_any_keyword(written, line, expected):
    file = read(written(chart(line), "a.txt"))
    assert not any("does not say" in note for note in file.notes)
    assert quantity(file) == expected


@pytest.mark.parametrize("line", ['DESCRIPTOR "Monitor measurement"', 'FILE_DESCRIPTOR "Display White"'])
def test_a_light_that_is_only_named_is_said_and_held_against_the_colours(written, line):
    shines = read(written(chart(line, values=0.004, stated=(95, 100, 80)), "a.txt"))
    assert quantity(shines) == "emission"
    assert shines.entries[0].taken.startswith("emission, by ") and "no surface" in shines.entries[0].taken
    printed = read(written(chart(line), "b.txt"))
    assert quantity(printed) == "reflectance"
    assert printed.entries[0].taken.endswith(
        "a colour beside, which is that of a surface and 2 colours of that kind; fraction by values from 0.2 to 0.4"
    )


@pytest.mark.parametrize(("identifier", "expected"), [("IT8.7/1", "transmittance"), ("IT8.7/2-1993", "reflectance")])
def test_the_identifier_of_a_target_says_what_it_is(written, identifier, expected):
    file = read(written(chart('DESCRIPTOR "Ektachrome"', identifier=identifier), "a.it8"))
    assert quantity(file) == expected and not any("does not say" in note for note in file.notes)


@pytest.mark.parametrize(
    ("identifier", "lines"),
    [
        ("IT8.7/1", ('DESCRIPTOR "reflection target"',)),
        ("CGATS.17", ('MODE "Emission"', 'MEASUREMENT_GEOMETRY "45/0 reflectance"')),
    ],
)
def test_words_that_contradict_each_other_are_refused(refused, identifier, lines):
    said = refused(read, chart(*lines, identifier=identifier), "a.txt")
    assert "two things of what was measured" in said[0] and "MEAS_TYPE" in said[-1]


@pytest.mark.parametrize("said", ["Absorbance", "DENSITY", "Raw counts"])
def test_a_type_of_measurement_that_is_no_colour_is_refused_whatever_anybody_answers(written, said):
    path = written(chart(f'MEASUREMENT_TYPE "{said}"'), "a.txt")
    with pytest.raises(InputError, match="not the spectrum of a colour"):
        read(path, ImportOptions("reflectance", "fraction"))


def test_absorbance_is_refused_by_name(refused):
    assert "absorbance is not the spectrum" in refused(read, chart('DESCRIPTOR "Absorbance of dyes"'), "a.txt")[0]


@pytest.mark.parametrize(
    ("colour", "values", "stated"),
    [("XYZ", 0.004, (95, 100, 80)), ("XYZ", 0.9, (1, 1.5, 1)), ("Lab", 0.004, (90, 0, 0))],
)
def test_what_nothing_says_is_refused_where_the_stated_colour_is_another(refused, colour, values, stated):
    said = refused(read, chart(colour=colour, values=values, stated=stated), "a.txt")
    assert said[0] == "a.txt: what was measured?" and "--as reflectance" in said[-1]


@pytest.mark.parametrize(
    ("colour", "values", "stated"), [("XYZ", 0.4, (38, 40, 33)), ("XYZ", 0.02, (1, 2, 1)), ("Lab", 0.2, (50, 0, 0))]
)
def test_what_nothing_says_is_a_reflectance_where_the_stated_colour_agrees(written, colour, values, stated):
    file = read(written(chart(colour=colour, values=values, stated=stated), "a.txt"))
    assert quantity(file) == "reflectance" and "2 colours of that kind" in file.entries[0].taken


def test_a_stated_quantity_stands_whatever_the_scale_of_the_colours(written):
    """XYZ of 0..1 beside a chart that says what it is."""
    assert quantity(read(written(chart('MEAS_TYPE "REFLECTIVE"', stated=(0.38, 0.4, 0.33)), "a.txt"))) == "reflectance"


@pytest.mark.parametrize("device", ["OUTPUT", "INPUT"])
def test_dark_readings_of_argyll_are_percent_too(written, device):
    content = chart(f'DEVICE_CLASS "{device}"', identifier="CTI3", values=1.2, stated=(1, 1.2, 1))
    file = read(written(content, "dark.ti3"))
    assert file.entries[0].spectrum.samples.max() == pytest.approx(0.012)
    assert any("are percent" in note for note in file.notes)


def test_fractions_in_the_layout_of_argyll_are_refused_by_their_colours(written):
    content = chart('DEVICE_CLASS "OUTPUT"', identifier="CTI3", values=0.4, stated=(38, 40, 33))
    with pytest.raises(InputError, match="the file states percent, and the numbers say fractions"):
        read(written(content, "a.ti3"))
    with pytest.raises(InputError, match="not those of the colours") as caught:
        read(written(content, "a.ti3"), ImportOptions(scale="percent"))
    assert "SPECTRAL_NORM" in (caught.value.hint or "")


@pytest.mark.parametrize("band", ["{}", "S_{}", "SP_{}", "REFL_{}", "λ{}", "SPECTRAL_NM {}", "{} nm"])
def test_names_of_bands_that_can_be_nothing_else(written, band):
    (first, _) = read(written(chart(band=band), "a.txt")).entries
    np.testing.assert_array_equal(first.spectrum.wavelengths_nm, BANDS)
    assert first.spectrum.samples[0] == 0.4 and first.spectrum.quantity == "reflectance"


def test_percent_in_the_names_of_bands(written):
    file = read(written(chart(band="%R{}", values=40), "a.txt"))
    assert file.entries[0].spectrum.samples[0] == 0.4 and not any("does not say" in note for note in file.notes)
    through = read(written(chart(band="%T{}", values=40), "b.txt"))
    assert quantity(through) == "transmittance"


@pytest.mark.parametrize("content", [chart(band="D_{}"), chart(band="S_{}").replace("S_500", "S_5001")])
def test_names_that_may_be_something_else_are_no_bands(refused, content):
    assert "no spectra in this file" in refused(read, content, "a.txt")[0]


def test_lines_that_end_as_on_old_macintoshes(written):
    path = written(chart(identifier='ORIGINATOR "x"').replace("\n", "\r"), "a.txt")
    assert format_of(path).NAME == "CGATS" and len(read(path).entries) == 2
