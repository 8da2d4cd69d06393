"""Columns that instruments and libraries write into a table beside plain readings, and what is no colour at all."""

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.formats.csv import read, recognises
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.registry import format_of, read_spectra

NM = range(360, 741, 20)


def table(header, value=lambda nm: nm / 1000, nm=NM):
    return f"nm,{header}\n" + "".join(f"{at},{','.join([str(value(at))] * (header.count(',') + 1))}\n" for at in nm)


def only(file):
    (entry,) = file.entries
    return entry


@pytest.mark.parametrize(
    ("header", "problem"),
    [
        ("n,k", "refractive index"),
        ("n", "refractive index"),
        ("OD", "absorbance"),
        ("Density", "absorbance"),
        ("Optical density", "absorbance"),
        ("K,S", "absorbance"),
        ("x_bar,y_bar,z_bar", "sensitivity"),
        ("x,y,z", "sensitivity"),
        ("l,m,s", "sensitivity"),
        ("Quantum efficiency", "sensitivity"),
        ("Responsivity (A/W)", "sensitivity"),
        ("CIE 1931 colour matching functions", "sensitivity"),
        ("red,green,blue", "channels of a camera"),
        ("R,G,B", "channels of a camera"),
    ],
)
def test_what_is_no_colour_is_refused_by_name(refused, header, problem):
    assert problem in refused(read, table(header))[0]


def test_words_above_decide_over_headings_that_could_be_either(written):
    file = read(written("Reflectance of paints\n" + table("red,green,blue")))
    assert [entry.spectrum.quantity for entry in file.entries] == ["reflectance"] * 3
    file = read(written("Sensitivity: High\nReflectance\n" + table("Chip 1")))
    assert only(file).spectrum.quantity == "reflectance"
    assert only(read(written(table("N")), ImportOptions("reflectance", "fraction"))).name == "N"  # a grey of a chart


def test_an_observer_without_a_header_is_known_by_the_name_of_its_file(refused):
    rows = "".join(f"{nm},0.1,0.2,0.3\n" for nm in NM)
    assert "sensitivity" in refused(read, rows, "CIE_xyz_1931_2deg.csv")[0]


@pytest.mark.parametrize(
    "header",
    [
        "Power",
        "Relative power",
        "Intensity",
        "Intensity [a.u.]",
        "Relative intensity (%)",
        "Normalized intensity",
        "Energy",
        "Flux",
        "W",
        "Radiometric",
        "lum",
    ],
)
def test_words_for_light_that_is_given_off(written, header):
    entry = only(read(written(table(header, lambda nm: nm / 5))))
    assert entry.spectrum.quantity == "emission" and entry.spectrum.samples[0] == 72.0


def test_a_letter_is_a_name_beside_other_samples(written, refused):
    file = read(written(table("W,R,G,K")), ImportOptions("reflectance", "fraction"))
    assert [entry.spectrum.quantity for entry in file.entries] == ["reflectance"] * 4
    assert refused(read, table("W,R,G,K"))[0] == "paints.csv: column 2, R, G: what was measured?"


@pytest.mark.parametrize(
    "above", ["Instrument,CS-2000\nLv,100.1\n", "[CS-2000]\n", "QUALITY, UNITS, LUM\n0000,0,1.234E+02\n"]
)
def test_spectroradiometers_by_their_keys(written, above):
    rows = "".join(f"0{nm},{nm / 1e6}\n" for nm in NM)
    assert only(read(written(above + rows))).spectrum.quantity == "emission"


@pytest.mark.parametrize("name", ["F11", "HP1", "cool_white", "sun", "Fluorescent"])
def test_a_name_of_lights_and_of_paints_alone_is_refused(refused, written, name):
    assert "what was measured?" in refused(read, table(name, lambda nm: nm / 10), "x.csv")[0]
    assert only(read(written("Reflectance\n" + table(name)))).spectrum.quantity == "reflectance"


@pytest.mark.parametrize("name", ["A", "E", "Value"])
def test_numbers_far_above_a_white_need_a_word(refused, name):
    assert "what was measured?" in refused(read, table(name, lambda nm: nm / 5))[0]


def test_deleted_samples_of_a_library(written):
    file = read(written(table("reflectance", lambda nm: "-1.23e34" if nm < 400 else 0.5)))
    assert only(file).spectrum.wavelengths_nm[0] == 400 and only(file).details["deleted samples"] == "2 of 20"
    assert "samples that the file flags as deleted (-1.23e34) are left out" in file.notes


def test_a_usgs_library_in_micrometres_with_its_columns_in_words(written):
    lines = "USGS Digital Spectral Library\n     wavelengths    reflectance   standard deviation\nGreen paint GDS333\n"
    rows = "".join(f"      {nm / 1000:.6f}      {nm / 1000:.6f}      0.001230\n" for nm in NM)
    file = read(written(lines + rows, "paint.asc"))
    entry = only(file)
    assert entry.spectrum.wavelengths_nm[[0, -1]].tolist() == pytest.approx([360, 740])
    assert entry.spectrum.samples[0] == 0.36
    assert "wavelengths from 0.36 to 0.74 without a unit are taken as micrometres" in file.notes
    assert "columns beside the measurement are left out: standard deviation" in file.notes


def test_a_stated_unit_is_not_overruled(refused):
    rows = "".join(f"{nm / 1000},0.1\n" for nm in NM)
    assert "look like micrometres" in refused(read, "Wavelength (nm),R\n" + rows)[0]


def test_noise_beyond_the_visible_is_left_out_and_said(written, refused):
    noise = {204: -0.12, 250: 1.37, 1001: -0.05}
    content = "nm,Reflectance\n" + "".join(f"{nm},{noise.get(nm, 0.5)}\n" for nm in (204, 250, *NM, 900, 1001))
    file = read(written(content))
    entry = only(file)
    assert entry.spectrum.quantity == "reflectance"
    assert entry.spectrum.wavelengths_nm.tolist() == [*NM, 900]
    assert entry.details["noise beyond the visible"] == "3 of 24 samples, -0.12 to 1.37"
    assert any("beyond 380 to 780 nm that no reflectance can be" in note for note in file.notes)
    # Never within: there it is a mistake of the whole measurement.
    assert "negative reflectance" in refused(read, content.replace("\n500,0.5", "\n500,-0.05"))[0]
    bright = read(written(content.replace("\n500,0.5", "\n500,1.2").replace("-0.12", "0.1").replace("-0.05", "0.1")))
    assert only(bright).spectrum.quantity == "radiance factor" and only(bright).spectrum.samples.max() == 1.37


def test_noise_beyond_the_visible_does_not_say_percent(written):
    file = read(written("nm,Reflectance\n204,57.3\n" + table("", lambda nm: 0.5).partition("\n")[2]))
    assert set(only(file).spectrum.samples) == {0.5}


def test_what_noise_leaves_is_still_a_spectrum(refused):
    assert "not a spectrum" in refused(read, "nm,Reflectance\n204,-0.12\n500,0.5\n")[0]


def test_clear_glass_reads_a_little_above_one(written, refused):
    file = read(written(table("%T", lambda nm: 100.13 if nm > 700 else 92)))
    assert only(file).spectrum.samples.tolist()[-2:] == [1.0, 1.0]
    assert only(file).details["samples above 1"] == "2 of 20, up to 1.001"
    assert "transmittance a little above 1, within the error of a reading, is taken as 1" in file.notes
    assert "transmittance above 1" in refused(read, table("%T", lambda nm: 101.5 if nm > 700 else 92))[0]


JCAMP = "##TITLE= paint\n##JCAMP-DX= 4.24\n##YFACTOR=0.01\n##XYDATA=(X++(Y..Y))\n" + "".join(
    f"{nm} 10 11 12 13 14\n" for nm in range(400, 700, 50)
)


@pytest.mark.parametrize("name", ["paint.jdx", "paint.csv", "paint.txt", "paint.spd"])
def test_jcamp_is_no_table(written, refused, name):
    path = written(JCAMP, name)
    assert not recognises(path, path.read_bytes()) and format_of(path).NAME == "JCAMP-DX"
    assert "JCAMP-DX is not a table" in refused(read, JCAMP, name)[0]


def test_a_unit_with_brackets_in_it(written):
    header = "Wavelength [nm]\tSpectral Radiance [W/(sr*m^2*nm)]\n"
    entry = only(read(written(header + "".join(f"{nm}\t0.1\n" for nm in NM), "jeti.txt")))
    assert entry.name == "jeti" and entry.details["units"] == "W/(sr*m^2*nm)"


def test_wavenumbers_above_20000_are_an_axis(written):
    rows = "".join(f"{number},0.1\n" for number in range(25000, 13000, -300))
    entry = only(read(written("Wavenumber (cm-1),Reflectance\n" + rows)))
    assert entry.spectrum.wavelengths_nm.size == 40 and entry.spectrum.wavelengths_nm[0] == 400.0


METER = "Title,A,B\nTcp [K],5632,3200\nIlluminance [lx],1230,900\nTristimulus Value X,1100.1,1\n"


@pytest.mark.parametrize(("title", "cell"), [("Title", "Spectral Data {}[nm]"), ("Memo", "{}nm")])
def test_wavelengths_with_their_unit_go_before_numbers_above_them(written, title, cell):
    rows = "".join(f"{cell.format(nm)},{nm / 1e6},{nm / 1e5}\n" for nm in NM)
    file = read_spectra(written(METER.replace("Title", title) + rows, "lights.csv"))
    assert [(entry.name, entry.spectrum.quantity) for entry in file.entries] == [("A", "emission"), ("B", "emission")]
    assert file.entries[1].spectrum.wavelengths_nm.tolist() == list(NM)


ABSOLUTE = ["Whitebase: Abs", "White base;Abs.", "WhiteBase,Abs", "White base\tAbs", "Calibration: Abs", "White: Abs"]
ABSOLUTE += ["Calibration mode: Abs", "White backing: Abs", "Rendering intent: Abs", "White reference: Abs (PTFE)"]


@pytest.mark.parametrize("line", ABSOLUTE)
@pytest.mark.parametrize("says", ["Reflectance", "Reflectance (%)", "Transmittance (%)"])
def test_an_absolute_white_is_no_absorbance(written, line, says):
    rows = "".join(f"{nm},{nm / 20.0 if '%' in says else nm / 2000.0}\n" for nm in range(400, 701, 20))
    for above, head in ((f"{line}\n{says}\n", "nm,red"), (f"{line}\n", f"nm,{says}")):
        (entry,) = read_spectra(written(f"{above}{head}\n{rows}")).entries
        assert entry.spectrum.quantity == says.partition(" ")[0].casefold()
        assert entry.spectrum.samples[-1] == pytest.approx(0.35)


@pytest.mark.parametrize("key", ["Mode", "Scale", "Measurement mode", "Type"])
def test_a_mode_that_may_be_absolute_or_absorbance_is_asked_about(written, key):
    rows = "".join(f"{nm},{nm / 2000.0}\n" for nm in range(400, 701, 20))
    path = written(f"{key}: Abs\nReflectance\nnm,red\n{rows}")
    with pytest.raises(InputError, match="what was measured"):
        read_spectra(path)
    assert len(read_spectra(path, ImportOptions("reflectance", "fraction")).entries) == 1
    assert len(read_spectra(written(f"{key}: Abs\nReflectance (0..1)\nnm,red\n{rows}")).entries) == 1
    with pytest.raises(InputError, match="absorbance is neither"):
        read_spectra(written(f"{key}: Abs\nnm,red\n{rows}"), ImportOptions("reflectance"))


@pytest.mark.parametrize(
    "line",
    ["Abs", "Units: Abs", "Y axis: Abs.", "Quantity;Abs", "Mode: Absorbance", "Baseline: Abs", "Photometric mode: Abs"],
)
def test_the_word_for_absorbance_is_refused_wherever_it_says_what_was_measured(written, line):
    rows = "".join(f"{nm},{nm / 2000.0}\n" for nm in range(400, 701, 20))
    with pytest.raises(InputError, match="absorbance is neither"):
        read_spectra(written(f"{line}\nReflectance probe\nnm,red\n{rows}"))


@pytest.mark.parametrize(
    ("heading", "axis"),
    [
        ("Wavelength (nm)", np.linspace(380.0, 2600.0, 7000)),
        ("Wavelength (nm)", np.linspace(2600.0, 380.0, 7000)),
        ("Wavelength (µm)", np.linspace(0.38, 14.0, 15_000)),
        ("Wavenumber (cm-1)", np.linspace(400.0, 26_500.0, 7000)),
        ("Frequency (THz)", np.linspace(12.0, 790.0, 7000)),
    ],
)
def test_spectra_far_into_the_infrared_keep_what_makes_a_colour(written, heading, axis):
    """A note says what is left out; no sample that is kept is another."""
    per_unit = {"m-1": (1e7, True), "THz": (299792.458, True), "µm": (1e3, False), "nm": (1.0, False)}
    scale, inverse = next(value for unit, value in per_unit.items() if unit in heading)
    nm = scale / axis if inverse else scale * axis
    values = 0.3 + 0.2 * np.sin(nm / 60.0)
    rows = "".join(f"{at:.9f},{value:.9f}\n" for at, value in zip(axis, values, strict=True))
    file = read_spectra(written(f"{heading},Reflectance\n{rows}", "ir.csv"))
    entry = only(file)
    grid = entry.spectrum.wavelengths_nm
    assert grid[0] <= 381.0 and 1090.0 < grid[-1] <= 1100.0 and grid.size <= 5000
    np.testing.assert_allclose(entry.spectrum.samples, 0.3 + 0.2 * np.sin(grid / 60.0), atol=1e-6)
    assert any("beyond 300 to 1100 nm" in note for note in file.notes)
    assert f"of {axis.size}" in entry.details["samples beyond the visible"]


SCALES = (
    *("(‰)", "(permille)", "x1000", "× 10000", "(1e-4)", "(x 10^-3)", "[10⁻³]", "*10000", "(ppm)", "scaled by 10000"),
    *(
        "/ 10",
        "/1000",
        "(0-255)",
        "(0 to 1000)",
        "8 bit",
        "(x10)",
        "·10⁻³",
        "x 0.1",
        "10E-3",
        "1e-3",
        "(0.1)",
        "(0-10)",
    ),
    *("(10%)", "(0.1 %)", "% (x0.1)", "(%) x10", "in tenths", "thousandths", "(1/1000)", "scale factor 0.1"),
)


@pytest.mark.parametrize("quantity", ["Reflectance", "Transmittance", "Radiance factor"])
@pytest.mark.parametrize("scale", SCALES)
def test_a_scale_that_is_neither_to_1_nor_to_100_is_refused_whatever_the_numbers_are(refused, quantity, scale):
    """Codes of a picture pass for percent, and tenths for a dark paint."""
    for largest in (0.06, 0.6, 60.0):
        lines = refused(read, table(f"{quantity} {scale}", lambda nm, top=largest: f"{top * nm / 740:.6g}"))
        assert "neither to 1 nor to 100" in lines[0], lines


@pytest.mark.parametrize("scale", [*SCALES, "y factor: 10", "values are given in thousandths"])
def test_a_line_above_or_a_name_may_say_such_a_scale(written, refused, scale):
    for largest in (0.6, 60.0):
        spectra = table("Red,Blue", lambda nm, top=largest: f"{top * nm / 740:.6g}")
        assert "neither to 1 nor to 100" in refused(read, f"Reflectance {scale}\n{spectra}")[0]
    if scale not in ("(‰)", "(permille)", "(ppm)", "(0-255)", "(0 to 1000)", "8 bit", "(0-10)", "(10%)", "(0.1 %)"):
        spectra = table(f"Red {scale},Blue", lambda nm: f"{60 * nm / 740:.6g}")
        assert only(read(written(f"Reflectance (%)\n{spectra}"))).name == "Blue"


@pytest.mark.parametrize("scale", ["x10^-2", "(10⁻²)", "(1/100)", "in hundredths", "(x 0.01)", "·10²", "*1e2"])
def test_hundredths_are_percent_however_small_the_numbers_are(written, refused, scale):
    for largest in (60.0, 3.0):
        file = read(written(table(f"Reflectance {scale}", lambda nm, top=largest: f"{top * nm / 740:.6g}")))
        assert only(file).spectrum.samples[-1] == pytest.approx(largest / 100.0)
    assert "the file states percent" in refused(read, table(f"Reflectance {scale}", lambda nm: nm / 1000))[0]


@pytest.mark.parametrize("name", ["Dye 1e-3 M", "5 x 10 cm", "Grey 10%", "Lot 4/10", "x100", "Cr 100 ppm", "N 9.5/10"])
def test_numbers_in_names_are_no_scale(written, name):
    text = f"Reflectance (%)\n{table(f'{name},Blue', lambda nm: f'{60 * nm / 740:.6g}')}"
    assert [entry.name for entry in read(written(text)).entries] == [name, "Blue"]


@pytest.mark.parametrize(
    "heading",
    [
        "R 45/0 (%)",
        "R D65/10 (%)",
        "Reflectance x100",
        "Reflectance*100",
        "Reflectance 10 nm (%)",
        "R 10x10 (%)",
        "Reflectance 0-100 (%)",
        "10R 5/10 (%)",
        "Reflectance 0-10° (%)",
        "R/10° (%)",
    ],
)
def test_other_numbers_in_headings_are_no_scale(written, heading):
    entry = only(read(written(table(heading, lambda nm: f"{60 * nm / 740:.6g}")), ImportOptions("reflectance")))
    assert 0.59 < entry.spectrum.samples[-1] <= 0.6


FUNCTIONS = [
    "sqrt(R)", "√R", "Transmission loss (%)", "Reflection losses", "R squared", "Reflectance change (%)", "exp(-R)",
    "Transmittance gain", "Reflectance slope", "Weighted reflectance (D65)", "Cumulative reflectance", "R noise",
]  # fmt: skip


@pytest.mark.parametrize("heading", FUNCTIONS)
def test_further_functions_are_no_reflectances(refused, heading):
    assert "a function of" in refused(read, table(heading))[0]


POWERS = [
    "Irradiance (dB)", "log10 irradiance", "ln(radiance)", "Spectral power (dBm/nm)", "Power (dBm)", "Intensity (dB)",
    "Irradiance derivative", "d irradiance/d lambda", "Radiance difference", "delta radiance", "ΔIrradiance",
    "sqrt(irradiance)",
]  # fmt: skip


@pytest.mark.parametrize("heading", POWERS)
def test_functions_of_a_power_are_none(refused, heading):
    assert "a function of a power is none" in refused(read, table(heading), "lamp.csv")[0]


@pytest.mark.parametrize(
    "heading", ["Irradiance (W/m2/nm)", "Radiance W sr-1 m-2 nm-1", "Power dB65", "Intensity", "LED B"]
)
def test_other_headings_are_powers(written, heading):
    assert only(read(written(table(heading), "lamp.csv"), ImportOptions("emission"))).spectrum.quantity == "emission"


@pytest.mark.parametrize("between", ["L*", "Gloss", "Gloss 20,Gloss 60"])
@pytest.mark.parametrize("last", [440, 540, 640])
def test_wavelengths_across_a_header_that_words_part_are_not_left_out(refused, between, last):
    """Nothing else would be read of the shorter part."""
    heads = [str(nm) for nm in NM]
    at = heads.index(str(last)) + 1
    words = between.split(",")
    cells = [*heads[:at], *words, *heads[at:]], ["0.5"] * at + ["50"] * len(words) + ["0.6"] * (len(heads) - at)
    text = "\n".join([f"Name,{','.join(cells[0])}", f"red,{','.join(cells[1])}", ""])
    assert "header: " in refused(read, "Reflectance\n" + text)[0]


@pytest.mark.parametrize("corner", ["", "x", "Ex\\Em"])
def test_wavelengths_both_ways_are_asked_about(refused, written, corner):
    heads = ",".join(str(nm) for nm in NM)
    rows = "".join(f"{first},{','.join(f'0.{nm}' for nm in NM)}\n" for first in (410, 420, 430))
    answer = ImportOptions("reflectance", "fraction")
    lines = refused(lambda path: read(path, answer), f"{corner},{heads}\n{rows}")
    assert "wavelengths down the first column, or across the header?" in lines[0]
    for word, count in (("nm", len(NM)), ("Sample", 3)):
        assert len(read(written(f"{word},{heads}\n{rows}"), answer).entries) == count


@pytest.mark.parametrize("axis", ["Temperature (K)", "Depth (nm)", "Thickness [nm]", "Distance (nm)", "Angle (deg)"])
def test_what_is_no_wavelength_is_none_whatever_its_numbers_are(refused, axis):
    """400 to 700 nm of depth, or kelvins, look like light."""
    assert "not of wavelengths" in refused(read, table("Reflectance").replace("nm", axis, 1))[0]


SCATTER = [
    "Std Dev", "Standard deviation", "stdev", "Variance", "Uncertainty", "σ", "CV (%)", "RSD", "Standardabweichung",
    "Unsicherheit", "Varianz", "Écart-type", "Incertitude", "Desviación estándar", "Desv. est.", "Incertidumbre",
    "Deviazione standard", "Incertezza", "Derivative", "2nd derivative", "Ableitung", "red residuals",
]  # fmt: skip


@pytest.mark.parametrize("head", SCATTER)
def test_scatter_and_derivatives_below_the_words_of_reflectances_are_none(written, head):
    file = read(written("Reflectance (%)\n" + table(f"red,{head}", lambda nm: nm / 10), "reds.csv"))
    assert [entry.name for entry in file.entries] == ["red"]
    assert any(head in note for note in file.notes)


PARTED = {"tabs": "\t", "semicolons": ";", "commas": ",", "blanks": "   "}
UNITS_BELOW = [("nm", "%R"), ("nm", "% R"), ("nm", "R[%]"), ("nm", "Refl."), ("nm", "Reflectance"), ("nm", "Remission")]


@pytest.mark.parametrize("label", ["Wavelength", "Wellenlänge", "Spectrum", "Sample", "X"])
@pytest.mark.parametrize("below", UNITS_BELOW)
@pytest.mark.parametrize("parted", PARTED)
def test_names_above_a_row_of_units_stay_with_their_columns(written, parted, below, label):
    between, (axis, unit) = PARTED[parted], below
    if between == "   " and " " in unit:
        unit = unit.replace(" ", "")
    names = ("lacquer red", "lacquer green")
    lines = [(label, *names), (axis, unit, unit), *((nm, nm / 10, nm / 20) for nm in NM)]
    file = read(written("\n".join(between.join(map(str, line)) for line in lines) + "\n", "paints.txt"))
    assert [(entry.name, entry.spectrum.samples[0]) for entry in file.entries] == [(names[0], 0.36), (names[1], 0.18)]


@pytest.mark.parametrize("unit", ["%R", "Refl.", "Reflectance (%)"])
def test_the_name_above_a_row_of_units_is_that_of_the_only_column(written, unit):
    rows = "".join(f"{nm}\t{nm / 10}\n" for nm in NM)
    assert only(read(written(f"Wavelength\tlacquer red\nnm\t{unit}\n{rows}", "paints.txt"))).name == "lacquer red"
    assert only(read(written(f"Wavelength\tReflectance\nnm\t{unit}\n{rows}", "paints.txt"))).name == "paints"


def test_words_that_blanks_part_are_no_names_of_as_many_columns(written):
    """Which of them are one name nothing tells."""
    rows = "".join(f"{nm} {nm / 10} {nm / 20}\n" for nm in NM)
    file = read(written(f"Wavelength lacquer red lacquer green\nnm %R %R\n{rows}", "paints.txt"))
    assert not {"lacquer", "red"} & {entry.name for entry in file.entries}


@pytest.mark.parametrize("cells", [4, 5, 7])
def test_a_first_row_with_more_cells_than_the_headings_below_names_is_refused(refused, cells):
    rows = "".join("\t".join(map(str, [nm, *[nm / 10] * (cells - 1 if nm == NM[0] else 2)])) + "\n" for nm in NM)
    lines = refused(read, f"Wavelength\tlacquer red\tlacquer green\nnm\t%R\t%R\n{rows}")
    assert "a row is too long" in lines[0] or "a row is cut short" in lines[0]


@pytest.mark.parametrize("facts", [["Gloss,85,20"], ["Thickness (mm),1.0,2.5", "Gloss,85,20"], ["Mean,35.1,22.2"]])
@pytest.mark.parametrize("label", ["Wavelength (nm)", "Sample name"])
def test_names_stay_above_rows_of_facts(written, label, facts):
    rows = "".join(f"{nm},{nm / 10},{nm / 20}\n" for nm in NM)
    text = "\n".join(["Reflectance (%)", f"{label},red,green", *facts]) + f"\n{rows}"
    assert [entry.name for entry in read(written(text)).entries] == ["red", "green"]


@pytest.mark.parametrize("shift", [0, 5])
@pytest.mark.parametrize("heads", ["", "nm,red,again,green\n"])
def test_wavelengths_that_stand_again_are_no_spectrum(written, refused, heads, shift):
    """Nothing says which values other wavelengths are of."""
    text = heads + "".join(f"{nm},{nm / 10},{nm + shift},{nm / 20}\n" for nm in NM)
    answer = ImportOptions("reflectance", "percent")
    if shift:
        lines = refused(lambda path: read(path, answer), text)
        assert "a spectrum, or the wavelengths of another table?" in lines[0]
        return
    entries = read(written(text), answer).entries
    assert [entry.spectrum.samples[0] for entry in entries] == [0.36, 0.18]


@pytest.mark.parametrize("name", ["lamp.csv", "red.csv"])
def test_numbers_in_equal_steps_before_wavelengths_are_no_wavelengths_without_a_word(refused, name):
    text = "".join(f"{300 + at},{nm},{nm / 10}\n" for at, nm in enumerate(NM))
    lines = refused(lambda path: read(path, ImportOptions("reflectance", "percent")), text, name)
    assert lines[0].endswith("column 2: a spectrum, or the wavelengths of another table?")


@pytest.mark.parametrize("scale", ["0..100", "0-100", "0 to 100", "x100", "× 100"])
def test_a_scale_to_a_hundred_is_percent_however_small_the_numbers_are(written, refused, scale):
    text = f"nm,Reflectance ({scale})\n" + "".join(f"{nm},{2 + nm / 1000}\n" for nm in NM)
    assert only(read(written(text))).spectrum.samples[0] == pytest.approx(0.0236)
    text = f"nm,Reflectance ({scale})\n" + "".join(f"{nm},{nm / 1000}\n" for nm in NM)
    assert "the file states percent, and the numbers say fractions" in refused(read, text)[0]


@pytest.mark.parametrize("line", ["Values are given in % of the light", "Data in percent", "values as %"])
def test_a_line_about_values_says_their_scale(written, refused, line):
    assert "the file states percent" in refused(read, f"{line}\n" + table("Reflectance", lambda nm: nm / 1000))[0]
    file = read(written(f"{line}\n" + table("Reflectance", lambda nm: 2 + nm / 1000)))
    assert only(file).spectrum.samples[0] == pytest.approx(0.0236)


def test_percent_signs_behind_some_numbers_and_fractions_beside_them_are_asked_about(written, refused):
    rows = "".join(f"{nm},{nm / 1000}\n" if nm < 500 else f"{nm},{nm / 10}%\n" for nm in NM)
    assert "percent beside fractions?" in refused(read, f"nm,Reflectance\n{rows}")[0]
    rows = "".join(f"{nm},{nm / 10}%\n" if nm < 500 else f"{nm},{nm / 10}\n" for nm in NM)
    assert only(read(written(f"nm,Reflectance\n{rows}"))).spectrum.samples[0] == pytest.approx(0.36)


@pytest.mark.parametrize(
    "heads", ["L*,a*,b*,Reflectance (%)", "CIELAB L,CIELAB a,CIELAB b,%R", "Reflectance (%),L*,a*,b*"]
)
def test_colours_in_columns_beside_a_spectrum_are_none(written, heads):
    first = heads.split(",")[0].startswith("R")
    rows = [f"{nm},{nm / 10},54.8,46.7,31.4" if first else f"{nm},54.8,46.7,31.4,{nm / 10}" for nm in NM]
    file = read(written("\n".join([f"nm,{heads}", *rows]) + "\n"))
    assert only(file).spectrum.samples[0] == pytest.approx(0.36) and not file.rejected
    assert any("left out" in note for note in file.notes)


def test_a_sample_beside_its_difference_from_a_standard_is_no_raw_reading(written):
    rows = "".join(f"{nm},{nm / 10},{nm / 10 + 1},1\n" for nm in NM)
    file = read(written(f"Reflectance (%)\nnm,Standard,Sample,Delta R\n{rows}"))
    assert [entry.name for entry in file.entries] == ["Standard", "Sample"]


def test_the_sum_of_reflectance_and_transmittance_is_neither(refused):
    assert "is neither" in refused(read, table("R+T"))[0]
