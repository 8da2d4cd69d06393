"""CGATS files: charts, lamps, displays and readings, and what does not fit what it states."""

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.formats.cgats import illuminant_of, observer_of, read, recognises
from metamer.spectral.formats.cgats_tables import read_tables
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.registry import format_of, read_spectra
from small_files import CHART, LAMP


def samples(file):
    return {entry.name: entry.spectrum.samples.tolist() for entry in file.entries}


def test_a_chart_with_all_that_it_says(written):
    path = written(CHART, "chart.txt")
    assert recognises(path, path.read_bytes())
    file = read(path)
    assert samples(file) == {"A 1": [0.1, 0.2, 0.3], "B 1": [0.2, 0.3, 0.4]}
    first = file.entries[0]
    assert first.spectrum.wavelengths_nm.tolist() == [400, 500, 600] and first.spectrum.quantity == "reflectance"
    assert first.details["condition"] == "M1" and first.details["geometry"] == "45/0"
    assert first.details["SAMPLE_ID"] == "1"
    (lab,) = first.stated
    assert (lab.space, lab.values.tolist(), lab.illuminant, lab.observer) == ("Lab", [50, 1, 2], "D50", "1931_2")
    assert file.details["ORIGINATOR"] == "made for tests"


@pytest.mark.parametrize(
    "name",
    ["SPECTRAL_NM{}", "SPECTRAL_NM_{}", "SPECTRAL_{}", "SPEC_{}", "spec_{}", "nm{}", "NM_{}", "R_{}", "{}NM", "{}_nm",
     "SPECTRAL_DEC{}"],
)  # fmt: skip
def test_every_name_of_a_band(written, name):
    content = CHART
    for nm in (400, 500, 600):
        content = content.replace(f"SPECTRAL_NM{nm}", name.format(nm))
    assert samples(read(written(content)))["A 1"] == [0.1, 0.2, 0.3]


def test_wavelengths_among_the_data(written):
    content = (
        "CGATS.17\nNUMBER_OF_FIELDS 5\nBEGIN_DATA_FORMAT\nSAMPLE_ID SPECTRAL_NM SPECTRAL_PCT SPECTRAL_NM SPECTRAL_PCT\n"
        "END_DATA_FORMAT\nNUMBER_OF_SETS 1\nBEGIN_DATA\nA1 400 12.5 410 50\nEND_DATA\n"
    )
    (entry,) = read(written(content)).entries
    assert entry.name == "A1" and entry.spectrum.samples.tolist() == [0.125, 0.5]
    assert entry.spectrum.wavelengths_nm.tolist() == [400, 410]


def test_tabs_and_names_with_spaces_without_quotes(written):
    head, _, data = CHART.partition("BEGIN_DATA\n")
    data = (
        data.replace('"A 1"', "A 1")
        .replace("1 A 1 ", "1\tA 1\t")
        .replace(" 0.", "\t0.")
        .replace(" 1.0 2.0", "\t1.0\t2.0")
    )
    data = data.replace('2 "B 1" ', '2\t"B 1"\t')
    assert list(samples(read(written(f"{head}BEGIN_DATA\n{data}")))) == ["A 1", "B 1"]


def test_decimal_commas(written):
    head, mark, data = CHART.partition("BEGIN_DATA\n")
    file = read(written(head + mark + data.replace(".", ",")))
    assert samples(file)["B 1"] == [0.2, 0.3, 0.4]
    assert file.entries[0].stated[0].values.tolist() == [50, 1, 2]


def test_a_set_over_two_lines_comments_and_doubled_quotes(written):
    content = CHART.replace('1 "A 1" 50.0', '1 "A ""x"" 1" # first\n50.0')
    assert list(samples(read(written(content)))) == ['A "x" 1', "B 1"]


def test_several_tables_the_second_with_the_format_of_the_first(written):
    more = (
        'ILLUMINATION_NAME "A"\nNUMBER_OF_FIELDS 8\nNUMBER_OF_SETS 1\n'
        'BEGIN_DATA\n3 "C 1" 50 1 2 0.5 0.6 0.7\nEND_DATA\n'
    )
    file = read(written(CHART + more))
    assert samples(file)["C 1"] == [0.5, 0.6, 0.7]
    assert [entry.stated[0].illuminant for entry in file.entries] == ["D50", "D50", "A"]
    assert file.entries[2].details["table"] == "table 2"


def test_a_table_with_its_own_identifier_takes_nothing_over(written):
    """A display and a chart in one file: neither the norm nor the kind of the first holds for the second."""
    file = read(written(LAMP.replace("SPECT\n", "CCSS\n", 1) + CHART))
    assert [entry.spectrum.quantity for entry in file.entries] == ["emission", "reflectance", "reflectance"]
    assert samples(file)["B 1"] == [0.2, 0.3, 0.4]


def test_a_table_without_one_is_of_the_same_kind(written):
    again = LAMP.partition("NUMBER_OF_FIELDS")[2]
    file = read(written(LAMP.replace("SPECT\n", "CCSS\n", 1) + f"NUMBER_OF_FIELDS{again}"))
    assert [entry.spectrum.quantity for entry in file.entries] == ["emission", "emission"]
    assert file.entries[1].spectrum.samples.tolist() == [0.2, 1.0, 2.0, 0.5]


def test_a_table_without_spectra_is_left_out_and_said(written):
    more = (
        "CAL\nNUMBER_OF_FIELDS 2\nBEGIN_DATA_FORMAT\nRGB_I RGB_R\nEND_DATA_FORMAT\n"
        "NUMBER_OF_SETS 1\nBEGIN_DATA\n0.0 0.0\nEND_DATA\n"
    )
    file = read(written(CHART + more))
    assert len(file.entries) == 2
    assert "a table without spectra is left out: 1 samples with RGB and no spectra" in file.notes


def test_the_norm_divides_and_the_ends_say_where_rounded_bands_are(written):
    """ArgyllCMS names 403.33 nm SPEC_403; its values over SPECTRAL_NORM are the spectrum."""
    file = read(written(LAMP, "lamp.sp"))
    (entry,) = file.entries
    assert entry.name == "lamp" and entry.spectrum.quantity == "emission"
    assert entry.spectrum.samples.tolist() == [0.2, 1.0, 2.0, 0.5]
    np.testing.assert_allclose(entry.spectrum.wavelengths_nm, [400, 403 + 1 / 3, 406 + 2 / 3, 410])
    assert "values are divided by SPECTRAL_NORM, 50" in file.notes


def test_ends_that_contradict_the_names_are_refused(refused):
    said = refused(read, LAMP.replace('"410.0"', '"700.0"'))
    assert (
        "two things of where its bands are" in said[0] and "400 to 700 nm, and fields named for 400 to 410" in said[1]
    )


@pytest.mark.parametrize(
    ("line", "identifier", "quantity"),
    [
        ('MEAS_TYPE "EMISSION"', "SPECT", "emission"),
        ('MEAS_TYPE "AMBIENT_FLASH"', "SPECT", "emission"),
        ('MEAS_TYPE "REFLECTIVE"', "SPECT", "reflectance"),
        ('MEAS_TYPE "TRANSMISSIVE"', "SPECT", "transmittance"),
        ('DEVICE_CLASS "DISPLAY"', "CTI3", "emission"),
        ('DEVICE_CLASS "EMISINPUT"', "CTI3", "emission"),
        ('DEVICE_CLASS "OUTPUT"', "CTI3", "reflectance"),
        ('TECHNOLOGY "CRT"', "CGATS.17", "emission"),
        ("", "CCSS", "emission"),
        ('DESCRIPTOR "Argyll illuminant C"', "SPECT", "emission"),
        ('DESCRIPTOR "booth with a foam reflector, spectral power"', "SPECT", "emission"),
        ('DESCRIPTOR "Diffuse transmission of a filter"', "CGATS.17", "transmittance"),
        ('DESCRIPTOR "chart"\nMEASUREMENT_GEOMETRY "45/0"', "CGATS.17", "reflectance"),
    ],
)
def test_what_was_measured_by_the_words_of_the_file(written, line, identifier, quantity):
    content = LAMP.replace("SPECT\n", f"{identifier}\n", 1).replace('DESCRIPTOR "Spectral power of a lamp"', line)
    content = content.replace("10 50 100 25", "10 20 30 25")
    name = "paints.txt" if quantity == "reflectance" else "measured.txt"
    assert read(written(content, name)).entries[0].spectrum.quantity == quantity


def test_a_spectrum_of_which_nothing_is_said(written, refused):
    content = LAMP.replace("Spectral power of a lamp", "Argyll Spectral power/reflectance information")
    (entry,) = read(written(content, "a.sp")).entries
    assert entry.taken == "emission, by SPECT without a MEAS_TYPE and values above SPECTRAL_NORM"
    said = refused(read, content.replace("10 50 100 25", "10 20 50 25"), "a.sp")
    assert said[:2] == ["a.sp: what was measured?", "  found: emission, hints SPECT without a MEAS_TYPE"]
    (answered,) = read(written(content.replace("10 50 100 25", "10 20 50 25")), ImportOptions("reflectance")).entries
    assert answered.spectrum.samples.tolist() == [0.2, 0.4, 1.0, 0.5]


def test_readings_of_argyll_without_a_norm_are_percent(written):
    content = LAMP.replace("SPECT\n", "CTI3\n", 1).replace('SPECTRAL_NORM "50.0"\n', 'DEVICE_CLASS "OUTPUT"\n')
    file = read(written(content))
    assert file.entries[0].spectrum.samples.tolist() == [0.1, 0.5, 1.0, 0.25]
    assert any("percent" in note for note in file.notes)


@pytest.mark.parametrize(
    ("lines", "illuminant", "observer"),
    [
        ('WEIGHTING_FUNCTION "ILLUMINANT, D65"', "D65", None),
        ('MEASUREMENT_SOURCE "Illumination=D65\tObserverAngle=10°\tWhiteBase=Abs"', "D65", "1964_10"),
        ('MEASUREMENT_SOURCE "D65"', None, None),
        ('ILLUMINATION_NAME "A"\nOBSERVER_ANGLE "10"', "A", "1964_10"),
        ("", None, None),
    ],
)
def test_what_lab_was_computed_for(written, lines, illuminant, observer):
    """A bare MEASUREMENT_SOURCE is the lamp in the instrument, not the illuminant of the computation."""
    start, _, rest = CHART.partition('ILLUMINATION_NAME "D50"')
    content = start + lines + rest.partition('Filter=no"')[2]
    (lab,) = read(written(content)).entries[0].stated
    assert (lab.illuminant, lab.observer) == (illuminant, observer)


# Refusals


@pytest.mark.parametrize(
    ("old", "new", "field", "found", "expected"),
    [
        ("NUMBER_OF_FIELDS 8", "NUMBER_OF_FIELDS 9", "NUMBER_OF_FIELDS", "8 fields in the format", "9, as stated"),
        ("NUMBER_OF_SETS 2", "NUMBER_OF_SETS 3", "NUMBER_OF_SETS", "2 sets in the data", "3, as stated"),
        ("0.10 0.20 0.30\n", "0.10 0.20\n", "line 14", "7 values", "8 values, one a field"),
        ("NUMBER_OF_SETS 2", "NUMBER_OF_SETS two", "NUMBER_OF_SETS, line 12", "two", "a whole number"),
        ("END_DATA\n", "", "END_DATA", "1 sets, then the end of the file", "2 sets and END_DATA"),
    ],
)  # fmt: skip
def test_counts_that_do_not_fit_name_both(refused, old, new, field, found, expected):
    content = CHART.replace(old, new)
    if not new:
        content = content.replace('2 "B 1" 60.0 1.0 2.0 0.20 0.30 0.40\n', "")
    lines = refused(read, content)
    assert lines[0].startswith(f"paints.csv: {field}: ")
    assert lines[1:3] == [f"  found: {found}", f"  expected: {expected}"]


def test_counts_that_are_not_stated_are_said(written):
    file = read(written(CHART.replace("NUMBER_OF_SETS 2\n", "").replace("NUMBER_OF_FIELDS 8\n", "")))
    assert len(file.entries) == 2
    assert {"the file does not state NUMBER_OF_SETS", "the file does not state NUMBER_OF_FIELDS"} <= set(file.notes)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("END_DATA_FORMAT\n", "", "a data format without its end"),
        ("BEGIN_DATA\n", "", "no data in this CGATS file"),
        ("BEGIN_DATA_FORMAT\n", "", "data without a format"),
        ("SPECTRAL_NM500", "SPECTRAL_NM400", "a wavelength stands twice"),
    ],
)
def test_broken_files(refused, old, new, problem):
    assert problem in refused(read, CHART.replace(old, new, 1))[0]


def test_bands_other_than_stated(refused):
    lines = refused(read, LAMP.replace('SPECTRAL_BANDS "4"', 'SPECTRAL_BANDS "5"'))
    assert lines[1:3] == ["  found: 4 spectral fields", "  expected: 5, as stated"]


@pytest.mark.parametrize("norm", ["0", "-1", "x"])
def test_norms_that_divide_nothing(refused, norm):
    assert "SPECTRAL_NORM" in refused(read, LAMP.replace('"50.0"', f'"{norm}"'))[0]


def test_a_word_among_the_values_rejects_its_sample(written):
    file = read(written(CHART.replace("0.10 0.20", "0.10 oops")))
    assert list(samples(file)) == ["B 1"]
    assert file.rejected[0][0] == "A 1" and "not a number" in str(file.rejected[0][1])


def test_colour_matching_functions_are_no_light(refused):
    assert "no spectra in this file" in refused(read, LAMP.replace("SPECT\n", "CMF\n", 1))[0]


# Real files.


@pytest.mark.parametrize(
    ("name", "held"),
    [("ColorChecker.cie", "24 samples with LAB"), ("ColorCheckerPassport.cie", "50 samples with LAB, XYZ")],
)
def test_real_charts_without_spectra_say_what_they_have(shared_data, name, held):
    with pytest.raises(InputError, match="no spectra in this file") as caught:
        read_spectra(shared_data / "spectra" / "cgats" / name)
    assert caught.value.found == f"{held} and no spectra"
    assert "spectral fields" in caught.value.expected


@pytest.mark.parametrize(
    ("name", "count", "first", "last", "highest"),
    [
        ("3dap5k.sp", 80, 355, 750, 3944.484778 / 3945),
        ("CIE_C.sp", 93, 320, 780, 1.2409),
        ("D50_0.0.sp", 107, 300, 830, 1.03),
        ("F1.sp", 81, 380, 780, 43.67 / 30),
        ("F5.sp", 81, 380, 780, 40.76 / 30),
    ],
)
def test_real_lamps(shared_data, name, count, first, last, highest):
    path = shared_data / "spectra" / "cgats" / name
    assert format_of(path).NAME == "CGATS"
    (entry,) = read_spectra(path).entries
    assert entry.spectrum.quantity == "emission"
    grid = entry.spectrum.wavelengths_nm
    assert (grid.size, grid[0], grid[-1]) == (count, first, last)
    assert entry.spectrum.samples.max() == pytest.approx(highest, rel=1e-12)


def test_a_real_lamp_is_the_illuminant_that_it_is_called(shared_data, colour):
    (entry,) = read_spectra(shared_data / "spectra" / "cgats" / "F1.sp").entries
    table = colour.SDS_ILLUMINANTS["FL1"]
    np.testing.assert_allclose(30 * entry.spectrum.resampled(table.wavelengths).samples, table.values, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "sets", "bands"),
    [
        ("CRT.ccss", 14, 118),
        ("MacBookProRetina2016.ccss", 4, 481),
        ("RGBLEDFamily_07Feb11.ccss", 8, 401),
        ("WLEDFamily_07Feb11.ccss", 12, 401),
        ("WRGB_OLED_LG.ccss", 4, 481),
    ],
)
def test_real_displays(shared_data, name, sets, bands):
    file = read_spectra(shared_data / "spectra" / "displays" / name)
    assert len(file.entries) == sets and not file.rejected
    assert {entry.spectrum.quantity for entry in file.entries} == {"emission"}
    assert {entry.spectrum.wavelengths_nm.size for entry in file.entries} == {bands}


def test_real_readings_of_nothing_below_zero_are_said(shared_data):
    file = read_spectra(shared_data / "spectra" / "displays" / "CRT.ccss")
    assert any("taken as zero (all 14 spectra)" in note for note in file.notes)
    assert file.entries[0].details["negative samples"] == "9 of 118, down to -0.0273"
    np.testing.assert_allclose(np.diff(file.entries[0].spectrum.wavelengths_nm), 390 / 117)


def test_a_real_chart_of_a_spectrolino(shared_data):
    path = shared_data / "spectra" / "text" / "X-Rite_Digital_Colour_Checker.txt"
    assert format_of(path).NAME == "CGATS"
    file = read_spectra(path)
    assert [entry.name for entry in file.entries] == [f"X{number}" for number in range(1, 11)]
    assert file.entries[6].spectrum.samples[0] == 0.9009
    assert file.details["ILLUMINATION_NAME"] == "D65" and file.entries[0].details["instrument"] == "Spectrolino"


def marked(mark, norm, values):
    fields = " ".join(f"SPECTRAL_{mark}{nm}" for nm in (400, 500, 600))
    return (
        f'CGATS.17\nMEAS_TYPE "REFLECTIVE"\n{norm}NUMBER_OF_FIELDS 4\nBEGIN_DATA_FORMAT\nSAMPLE_ID {fields}\n'
        f"END_DATA_FORMAT\nNUMBER_OF_SETS 1\nBEGIN_DATA\nA {values}\nEND_DATA\n"
    )


@pytest.mark.parametrize(
    ("mark", "norm", "values"),
    [
        ("PCT", 'SPECTRAL_NORM "100.0"\n', "10 20 30"),
        ("DEC", 'SPECTRAL_NORM "1.0"\n', "0.1 0.2 0.3"),
        ("PCT", "", "10 20 30"),
        ("DEC", "", "0.1 0.2 0.3"),
        ("NM", 'SPECTRAL_NORM "100.0"\n', "10 20 30"),
    ],
)
def test_the_norm_and_the_names_of_fields_say_the_same(written, mark, norm, values):
    (entry,) = read(written(marked(mark, norm, values), "a.txt")).entries
    np.testing.assert_allclose(entry.spectrum.samples, [0.1, 0.2, 0.3], rtol=1e-15)
    assert entry.spectrum.quantity == "reflectance"


@pytest.mark.parametrize(("mark", "norm"), [("PCT", "1.0"), ("DEC", "100.0"), ("PCT", "255")])
def test_a_norm_that_contradicts_the_names_of_fields_is_refused(refused, mark, norm):
    lines = refused(read, marked(mark, f'SPECTRAL_NORM "{norm}"\n', "10 20 30"))
    assert "SPECTRAL_NORM: two units in one table" in lines[0] and f"SPECTRAL_{mark}" in lines[1]


def test_percent_with_a_norm_of_one_is_no_radiance_factor(refused):
    """Thirty times the perfect diffuser is no reading of a surface."""
    lines = refused(read, marked("NM", 'SPECTRAL_NORM "1.0"\n', "10 20 30"))
    assert "reflectance looks like percent" in lines[0] and "30" in lines[1]


@pytest.mark.parametrize("keyword", ["WEIGHTING_FUNCTION", "COMPUTATIONAL_PARAMETER"])
@pytest.mark.parametrize("turn", [1, -1])
def test_a_keyword_given_twice_says_illuminant_and_observer(written, keyword, turn):
    lines = [f'{keyword} "ILLUMINANT, D50"', f'{keyword} "OBSERVER, 2 degree"'][::turn]
    table = "BEGIN_DATA_FORMAT\nSAMPLE_ID LAB_L LAB_A LAB_B\nEND_DATA_FORMAT\nBEGIN_DATA\n1 50 4 3\nEND_DATA\n"
    again = f'{keyword} "ILLUMINANT, D65"\n{keyword} "OBSERVER, 10 degree"\n'
    first, second = read_tables(written("CGATS.17\n" + "\n".join(lines) + "\n" + table + again + table, "lab.txt"))
    assert (illuminant_of(first), observer_of(first)) == ("D50", "1931_2")
    assert (illuminant_of(second), observer_of(second)) == ("D65", "1964_10")


ONE_SPECTRUM = (
    "BEGIN_DATA_FORMAT\nSAMPLE_ID SPEC_400 SPEC_500 SPEC_600 SPEC_700\nEND_DATA_FORMAT\n"
    "BEGIN_DATA\n1 0.1 0.2 0.3 0.4\nEND_DATA\n"
)


@pytest.mark.parametrize(
    ("keyword", "first", "second"),
    [
        ("MEASUREMENT_TYPE", '"REFLECTIVE"', '"EMISSION"'),
        ("SPECTRAL_NORM", '"100"', '"1"'),
        ("SPECTRAL_START_NM", '"380"', '"400"'),
        ("MEASUREMENT_GEOMETRY", '"45/0"', '"d/8"'),
        ("FILTER", '"M0"', '"M1"'),
        ("SAMPLE_BACKING", '"black"', '"white"'),
        ("ILLUMINANT", '"D50"', '"D65"'),
        ("NUMBER_OF_SETS", "1", "2"),
    ],
)
def test_a_keyword_that_says_two_things_is_refused(written, refused, keyword, first, second):
    lines = refused(read, f"CGATS.17\n{keyword} {first}\n{keyword} {second}\n{ONE_SPECTRUM}")
    assert f"{keyword}, line 3: a keyword says two things" in lines[0]
    assert f"{first} and {second}".replace('"', "") in lines[1]
    # Said again, or of another table, it is no contradiction.
    with_type = "" if keyword == "MEASUREMENT_TYPE" else 'MEASUREMENT_TYPE "REFLECTIVE"\n'
    again = f"CGATS.17\n{with_type}ORIGINATOR a\nORIGINATOR b\n{keyword} {first}\n{keyword} {first}\n{ONE_SPECTRUM}"
    (table,) = read_tables(written(again))
    assert table.keywords.get(keyword, first.strip('"')) == first.strip('"') and table.keywords["ORIGINATOR"] == "a; b"
    if keyword != "NUMBER_OF_SETS":
        _, other = read_tables(written(f"{again}ORIGINATOR c\n{keyword} {second}\n{ONE_SPECTRUM}"))
        assert other.keywords[keyword] == second.strip('"') and other.keywords["ORIGINATOR"] == "c"


@pytest.mark.parametrize(
    "lines",
    [
        ['WEIGHTING_FUNCTION "ILLUMINANT, D50"', 'WEIGHTING_FUNCTION "ILLUMINANT, A"'],
        ['WEIGHTING_FUNCTION "ILLUMINANT, D50; ILLUMINANT, A"'],
        ['ILLUMINANT "D50"', 'WEIGHTING_FUNCTION "ILLUMINANT, A"'],
        ['COMPUTATIONAL_PARAMETER "D50 A"'],
    ],
)
def test_two_lights_of_one_table_are_left_open_beside_spectra(written, lines):
    colour = ONE_SPECTRUM.replace("SAMPLE_ID", "SAMPLE_ID LAB_L LAB_A LAB_B").replace("1 0.1", "1 50 4 3 0.1")
    said = 'MEASUREMENT_TYPE "REFLECTIVE"\nOBSERVER "2"\n'
    file = read(written("CGATS.17\n" + "\n".join(lines) + "\n" + said + colour))
    (stated,) = file.entries[0].stated
    assert stated.illuminant is None and stated.observer == "1931_2"
    assert "the file leaves open which of D50, A the colours beside the spectra are for" in file.notes


@pytest.mark.parametrize(("further", "left_out"), [("T_{}", True), ("REFL{}", True), ("D{}_FILTER", False)])
def test_a_second_spectrum_of_each_sample_is_not_left_out_without_a_word(written, further, left_out):
    nm = range(400, 500, 10)
    fields = " ".join([*(f"R_{at}" for at in nm), *(further.format(at) for at in nm)])
    row = " ".join([*(f"0.{at}" for at in nm), *["0.25"] * len(nm)])
    file = read(written(
        f"CGATS.17\nNUMBER_OF_FIELDS 21\nBEGIN_DATA_FORMAT\nSAMPLE_ID {fields}\nEND_DATA_FORMAT\n"
        f"NUMBER_OF_SETS 1\nBEGIN_DATA\n1 {row}\nEND_DATA\n"
    ), ImportOptions("reflectance", "fraction"))  # fmt: skip
    (entry,) = file.entries
    assert entry.spectrum.samples.tolist() == [at / 1000 for at in nm]
    said = f"fields {further.format(400)} to {further.format(490)} are another spectrum of each sample, and left out"
    assert (said in file.notes) == left_out and (further.format(400) in entry.details) != left_out
