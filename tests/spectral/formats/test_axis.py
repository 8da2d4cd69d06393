"""Axes of frequencies and energies become wavelengths by a formula that is said, or are refused by their name."""

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.formats.csv import read as read_csv
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.registry import read_spectra
from metamer.spectral.formats.tables.axis import axis_unit
from metamer.spectral.spectrum import Spectrum

NM = np.arange(400.0, 701.0, 10.0)
RED = 0.062 + 0.57 / (1.0 + np.exp(-(NM - 583.0) / 13.0))
C, H, E = 299792458.0, 6.62607015e-34, 1.602176634e-19
M = NM * 1e-9
#: Values of the axis by how its unit is written.
UNITS = {
    "THz": C / M / 1e12, "PHz": C / M / 1e15, "GHz": C / M / 1e9, "Hz": C / M, "10^12 Hz": C / M / 1e12,
    "1e14 Hz": C / M / 1e14, "eV": H * C / M / E, "meV": 1e3 * H * C / M / E, "cm-1": 0.01 / M, "cm^-1": 0.01 / M,
    "1/cm": 0.01 / M, "rad/s": 2 * np.pi * C / M, "rad/fs": 2e-15 * np.pi * C / M, "rad s-1": 2 * np.pi * C / M,
    "10^15 rad/s": 2e-15 * np.pi * C / M, "µm": NM / 1e3, "um": NM / 1e3, "micrometres": NM / 1e3, "microns": NM / 1e3,
    "angstrom": NM * 10, "Å": NM * 10, "nm": NM, "nanometers": NM,
}  # fmt: skip
LENGTHS = ("µm", "um", "micrometres", "microns", "angstrom", "Å", "nm", "nanometers")


def named(unit):
    if unit in LENGTHS:
        return "Wavelength"
    return "wavenumber" if "cm" in unit else "photon energy" if "eV" in unit else "angular frequency" if "rad" in unit \
        else "frequency"  # fmt: skip


def table(axis, *heads, values=RED, between=",", above="", name="reflectance"):
    rows = [f"{at:.9g}{between}{value:.6g}" for at, value in zip(axis, values, strict=True)]
    return above + "\n".join([*([between.join([*heads, name])] if heads else []), *rows]) + "\n"


def check(path, answer=ImportOptions("reflectance", "fraction"), note=None):  # noqa: B008
    file = read_spectra(path, answer)
    (entry,) = file.entries
    np.testing.assert_allclose(entry.spectrum.wavelengths_nm, NM, rtol=1e-7)
    np.testing.assert_allclose(entry.spectrum.samples, RED, rtol=1e-5)
    if note:
        assert any(f"converted: nm = {note}" in said for said in file.notes)


@pytest.mark.parametrize("unit", UNITS)
def test_an_axis_says_its_unit_in_many_ways(written, unit):
    word = named(unit)
    for head in (f"{word} ({unit})", f"{word} [{unit}]", f"{word} {unit}", f"{word}, {unit}".replace(",", ";"), unit,
                 f"{word.upper()} ({unit})", f"{word.title()} / {unit}".replace("1/", "")):  # fmt: skip
        if unit in ("1/cm", "µm", "Å") and " / " in head:
            continue
        check(written(table(UNITS[unit], head)))
        check(written(table(UNITS[unit], head, between="\t")))


@pytest.mark.parametrize("unit", ["THz", "PHz", "eV", "cm-1", "rad/fs", "µm", "angstrom", "nm"])
def test_lower_and_upper_case_units_in_headings_lines_and_rows_of_units(written, unit):
    word, axis = named(unit), UNITS[unit]
    for write in (str, str.lower, str.upper):
        check(written(table(axis, f"{word} ({write(unit)})")))
        check(written(table(axis, above=f"# {word} in {write(unit)}, reflectance\n")))
        check(written(table(axis, above=f"# x axis: {write(unit)}\n")))
        check(written(table(axis, word, above=f"x unit: {write(unit)}\n", between=";")))
        check(written(table(axis, word, between="\t").replace("\n", f"\n{write(unit)}\t[-]\n", 1)))


@pytest.mark.parametrize(
    ("unit", "formula"),
    [("THz", "299792.458 / THz"), ("eV", "1239.841984 / eV"), ("cm-1", "10000000 / cm-1"), ("PHz", "299.792458 / PHz")],
)
def test_the_formula_is_said(written, unit, formula):
    check(written(table(UNITS[unit], f"x ({unit})")), note=formula)
    backwards = dict(zip(UNITS[unit][::-1], RED[::-1], strict=True))
    check(written(table(list(backwards), f"x ({unit})", values=list(backwards.values()))), note=formula)


@pytest.mark.parametrize("unit", ["THz", "eV", "cm-1", "rad/fs", "PHz"])
def test_spectral_power_over_frequency_is_refused(written, unit):
    head = f"{named(unit)} ({unit})"
    for name, answer in (
        ("irradiance (W/m2/nm)", ImportOptions()),
        ("A", ImportOptions("emission")),
        ("spectral power", ImportOptions()),
    ):
        with pytest.raises(InputError, match="spectral power over a frequency or an energy"):
            read_spectra(written(table(UNITS[unit], head, name=name)), answer)
    check(written(table(UNITS[unit], head, values=100 * RED, name="reflectance (%)")), ImportOptions())


@pytest.mark.parametrize("word", ["frequency", "Energy", "photon energy", "angular frequency", "ω", "Frequenz"])
@pytest.mark.parametrize("unit", ["THz", "eV", "cm-1"])
def test_a_frequency_without_its_unit_is_asked_for_it(written, word, unit):
    with pytest.raises(InputError, match="an axis of frequencies or energies without a unit"):
        read_spectra(written(table(UNITS[unit], word)))


def test_across_a_header_too(written):
    for above, head in (("", "Frequency (THz)"), ("# frequency in THz\n", "Name")):
        content = above + ",".join([head, *(f"{at:.9g}" for at in UNITS["THz"])])
        check(written(content + "\nred," + ",".join(f"{value:.6g}" for value in RED) + "\n"))


def across(head, axis, unit="", decimals=4):
    """Two samples, a row each, below an axis with its unit in its heading or behind each number."""
    header = ";".join([head, *(f"{at:.{decimals}f}{unit}" for at in axis)])
    rows = (";".join([name, *(f"{value:.6g}" for value in row)]) for name, row in (("red", RED), ("blue", 0.8 - RED)))
    return "\n".join([header, *rows, ""])


@pytest.mark.parametrize("unit", ["THz", "eV", "cm-1", "µm", "angstrom", "nm"])
def test_across_a_header_no_unit_makes_samples_of_values(written, unit):
    """Numbers of energies and micrometres are small, and those of wavenumbers large: all of them are the axis."""
    file = read_spectra(
        written(across(f"{named(unit)} ({unit})", UNITS[unit])), ImportOptions("reflectance", "fraction")
    )
    assert [entry.name for entry in file.entries] == ["red", "blue"]
    np.testing.assert_allclose(file.entries[0].spectrum.wavelengths_nm, NM, rtol=1e-4)
    np.testing.assert_allclose(file.entries[0].spectrum.samples, RED, rtol=1e-5)


@pytest.mark.parametrize("unit", [" nm", " µm", " Å"])
def test_across_a_header_each_length_may_have_its_unit(written, unit):
    file = read_spectra(written(across("name", UNITS[unit.strip()], unit)), ImportOptions("reflectance", "fraction"))
    np.testing.assert_allclose(file.entries[1].spectrum.wavelengths_nm, NM, rtol=1e-7)


@pytest.mark.parametrize("unit", ["THz", "eV", "cm-1"])
def test_across_a_header_without_a_word_reciprocals_are_asked_about(refused, unit):
    lines = refused(
        lambda path: read_spectra(path, ImportOptions("reflectance", "fraction")), across("name", UNITS[unit])
    )
    # Small numbers above values that only rise may be anything.
    assert lines[0] == f"paints.csv: header: wavelengths, or {unit}?" or (unit == "eV" and "no table" in lines[0])


def test_a_row_further_down_is_no_header_of_those_above(refused):
    rows = "400,]09\n500,0 6,88nm\t0.3500\n520,0 6,75\n560,0 14,50\n"
    assert refused(read_csv, rows, "red.txt")[0] == "red.txt: line 3: a row is cut short"


def test_numbers_of_samples_across_a_header_are_no_wavelengths(written):
    for word, unit in (("Wavelength", "nm"), ("Photon energy (eV)", "eV"), ("Frequency (THz)", "THz")):
        rows = "".join(f"{at:.6g}," + ",".join(["0.3"] * 6) + "\n" for at in UNITS[unit])
        file = read_spectra(written(f"{word},1,2,3,4,5,6\n{rows}"), ImportOptions("reflectance", "fraction"))
        assert [entry.name for entry in file.entries] == ["1", "2", "3", "4", "5", "6"]


@pytest.mark.parametrize("head", ["ν/THz", "f / THz", "E/eV", "Energie/eV", "hν/eV", "λ/nm", "Wellenlänge/nm"])
def test_a_quantity_over_its_unit_is_a_heading(written, head):
    check(written(table(UNITS[head.rpartition("/")[2].strip()], head)))


def test_wavelengths_beside_frequencies_go_before_them(written):
    for heads in (("frequency (THz)", "wavelength (nm)"), ("wavelength (nm)", "frequency (THz)")):
        columns = {"frequency (THz)": UNITS["THz"], "wavelength (nm)": NM}
        rows = zip(*(columns[head] for head in heads), RED, strict=True)
        content = ",".join([*heads, "reflectance"]) + "\n" + "".join(f"{a:.9g},{b:.9g},{r:.6g}\n" for a, b, r in rows)
        check(written(content))


LINES = ["Chopper frequency: 120 Hz", "Lamp energy: 3 eV", "Excitation energy 3.1 eV", "Integration frequency 2 kHz"]


@pytest.mark.parametrize("line", LINES)
@pytest.mark.parametrize("heads", [(), ("nm",), ("Wavelength",), ("Wavelength [nm]",)])
def test_other_frequencies_of_an_instrument_are_not_those_of_light(written, line, heads):
    check(written(table(NM, *heads, above=f"{line}\n", between="\t")))


@pytest.mark.parametrize("words", ["W/m2/Hz", "per eV", "power W m-2 eV-1", "sample", "Ghz", "revenue", "nu 3"])
def test_units_of_values_are_no_units_of_an_axis(words):
    unit = axis_unit(words)
    assert unit is None or (words in ("per eV", "Ghz") and unit.reciprocal)


def test_a_spectrum_is_the_same_over_any_axis(written):
    """The spectrum of a frequency axis has the colour of its twin over wavelengths."""
    (entry,) = read_spectra(written(table(UNITS["eV"], "Energy (eV)"))).entries
    twin = Spectrum.sampled(NM, RED, "reflectance")
    np.testing.assert_allclose(entry.spectrum.resampled(NM).samples, twin.samples, rtol=1e-5)


@pytest.mark.parametrize(
    ("unit", "axis"),
    [
        *((unit, 1e3 / NM) for unit in ("um-1", "µm^-1", "μm⁻¹", "1/um", "um^(-1)", "um**-1")),
        *((unit, 1.0 / NM) for unit in ("1/nm", "nm-1", "nm^-1")),
        ("1/mm", 1e6 / NM), ("m-1", 1e9 / NM), ("kK", 1e4 / NM),
    ],
)  # fmt: skip
@pytest.mark.parametrize("head", ["Wavenumber ({})", "k [{}]", "{}"])
def test_waves_in_any_length_are_no_lengths(written, unit, axis, head):
    check(written(table(axis, head.format(unit))))


@pytest.mark.parametrize("values", ["Irradiance (W m-2 nm-1)", "Radiance [W/(m^2 sr nm)]", "Power W/um"])
def test_powers_over_wavelengths_are_no_waves_in_a_length(written, values):
    for above in ("", f"x axis: nm, y axis: {values}\n"):
        path = written(table(NM, "Wavelength" if not above else "x", above=above, name=values))
        np.testing.assert_allclose(read_spectra(path).entries[0].spectrum.wavelengths_nm, NM)


NO_AXES = [
    "Pixel", "pixel no.", "Channel", "Kanal", "Index", "Time (ms)", "px", "Frame #", "Band", "Band no.", "Data point",
    "Messpunkt", "Canal", "Element", "Photodiode", "Row", "Bin number", "X (pixel)", "CCD pixel", "Wavelength index",
    "wave_index", "λ step", "FWHM (nm)", "Bandwidth (nm)", "Slit width [nm]", "Diameter (nm)", "Raman shift", "T (K)",
    "t (s)", "m/z", "2 theta (°)",
]  # fmt: skip


@pytest.mark.parametrize("heading", NO_AXES)
def test_places_on_a_sensor_and_times_are_no_wavelengths(written, heading):
    """Numbers of pixels may lie between 380 and 780, too."""
    with pytest.raises(InputError, match="not of wavelengths"):
        read_spectra(written(table(NM, heading)), ImportOptions("reflectance", "fraction"))
    rows = [f"{place},{nm:.0f},{value:.6g}" for place, (nm, value) in enumerate(zip(NM, RED, strict=True))]
    check(written("\n".join([f"{heading},Wavelength (nm),reflectance", *rows, ""])))


@pytest.mark.parametrize("heading", ["Band (nm)", "band_nm", "X", "Sample", "Nr", "Wave no.", "T", "Line", "Step (nm)"])
def test_other_words_above_wavelengths_are_no_hindrance(written, heading):
    check(written(table(NM, heading)))


@pytest.mark.parametrize("heading", ["x", "X", "a", "column 1", ""])
@pytest.mark.parametrize(("unit", "nm"), [("THz", 299792.458), ("eV", 1239.841984), ("cm-1", 1e7)])
@pytest.mark.parametrize("step", [5, 10, 20])
def test_an_axis_without_a_word_that_is_even_as_its_reciprocal_is_asked_about(written, heading, unit, nm, step):
    digits = {"THz": 2, "eV": 4, "cm-1": 1}[unit]
    rows = [f"{nm / at:.{digits}f},{at / 10:.1f}" for at in range(380, 731, step)]
    for order in (rows, rows[::-1]):
        with pytest.raises(InputError, match=f"wavelengths, or {unit}"):
            read_spectra(written("\n".join([f"{heading},Reflectance (%)", *order, ""])))


@pytest.mark.parametrize("curved", [0.0, 0.02, 0.2])
def test_an_uneven_axis_of_a_spectrometer_is_of_wavelengths(written, curved):
    rows = [f"{380 + 2 * at - curved * 0.01 * at**2:.2f},{20 + at / 10:.1f}" for at in range(150)]
    (entry,) = read_spectra(written("\n".join(["x,Reflectance (%)", *rows, ""]))).entries
    assert entry.spectrum.wavelengths_nm[0] == 380.0


@pytest.mark.parametrize("head", ["wavelength", "A", ""])
@pytest.mark.parametrize("turned", [1, -1])
def test_an_axis_without_a_unit_that_is_of_light_as_angstroms_is_asked_about(written, head, turned):
    path = written(table((10.0 * NM)[::turned], *([head] if head else []), values=RED[::turned]))
    with pytest.raises(InputError, match="in nm, or in Å"):
        read_spectra(path, ImportOptions("reflectance", "fraction"))
    # An axis that reaches into light as nm is in nm.
    wide = np.linspace(350.0, 11000.0, len(NM))
    assert read_csv(written(table(wide, "wavelength"))).entries[0].spectrum.wavelengths_nm[-1] == 11000.0


POWERS = {
    "Wavelength x10 (nm)": 10, "nm/10": 10, "Wavelength*10 [nm]": 10, "λ (×10 nm)": 0.1, "λ/(10 nm)": 0.1,
    "Wavelength (10 nm)": 0.1, "Wavelength [0.1 nm]": 10, "λ (nm·10)": 10, "10*nm": 10, "λ·10⁻² / nm": 0.01,
    "Wavelength x1000 (µm)": 1, "Wavelength (1/10 nm)": 10, "tenths of nm": 10, "Wavelength (nm) divided by 100": 0.01,
    "Wavelength (nm), scale factor 10": 10, "wave (nm x 1e-2)": 100, "Wellenlänge ÷ 10 (nm)": 0.1, "波長 (×0.1 nm)": 10,
}  # fmt: skip


@pytest.mark.parametrize("heading", POWERS)
def test_a_power_of_ten_in_the_heading_of_an_axis_is_undone_where_that_makes_light_of_it(written, heading):
    axis = NM * POWERS[heading]
    between = ";" if "," in heading else ","
    cells = (
        (f"name{between}{heading}", *(f"{at:.9g}" for at in axis)),
        ("reflectance", "", *(f"{at:.6g}" for at in RED)),
    )
    across = "\n".join(map(between.join, cells)) if 100.0 <= min(axis) <= 5000.0 else ""
    for content in filter(None, (table(axis, heading, between=between), across)):
        path = written(content)
        check(path)
        notes = read_spectra(path, ImportOptions("reflectance", "fraction")).notes
        assert any("the axis is" in note and f"power of ten in '{heading}'" in note for note in notes)


@pytest.mark.parametrize("heading", POWERS)
def test_a_power_of_ten_that_the_values_of_an_axis_do_not_bear_out_is_asked_about(written, heading):
    between = ";" if "," in heading else ","
    axis = NM / 1e3 if "µm" in heading else NM
    with pytest.raises(InputError, match="a power of ten at the axis that its values do not bear out"):
        read_spectra(written(table(axis[::2], heading, values=RED[::2], between=between)))


@pytest.mark.parametrize("heading", ["Wavelength (10 nm)", "nm (10 nm step)", "λ [nm] D65/10", "Wavelength (nm) 1e0"])
def test_steps_and_observers_in_the_heading_of_an_axis_are_no_powers_of_ten(written, heading):
    check(written(table(NM, heading)))


@pytest.mark.parametrize(
    ("heading", "axis"),
    [("Wavelength (10^-9 m)", NM), ("λ (x10⁻⁹ m)", NM), ("Wavelength (1e-10 m)", NM * 10), ("λ / 10^-7 cm", NM),
     ("Wavelength (mm)", NM / 1e6), ("Wavelength [pm]", NM * 1e3), ("10^-6 m", NM / 1e3)],
)  # fmt: skip
def test_metres_by_powers_of_ten_are_a_unit(written, heading, axis):
    check(written(table(axis, heading)))
