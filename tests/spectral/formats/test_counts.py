"""Columns that are not what their sheet is of: an instrument's counts are no quantity, and its exports say what is."""

from itertools import permutations

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.registry import read_spectra

NM = np.arange(400, 701, 20)
PERCENT = 6.2 + 57.0 / (1.0 + np.exp(-(NM - 583.0) / 13.0))
DARK, WHITE = 300.0 + 3.0 * np.sin(NM), 3000.0 + NM
SAMPLE = DARK + (WHITE - DARK) * PERCENT / 100.0


def table(heads, *columns, between=",", above=""):
    rows = [between.join(f"{cell:.6g}" for cell in row) for row in zip(NM, *columns, strict=True)]
    return above + "\n".join([*([between.join(heads)] if heads else []), *rows]) + "\n"


def check_percent(entry):
    assert entry.spectrum.quantity == "reflectance"
    np.testing.assert_allclose(entry.spectrum.samples, PERCENT / 100.0, rtol=1e-5)


COLUMNS = {"dark": DARK, "reference": WHITE, "sample": SAMPLE, "white": WHITE, "scope": SAMPLE, "target": SAMPLE}


@pytest.mark.parametrize("made", ["reflectance (%)", "R (%)", "Reflectance [%]"])
@pytest.mark.parametrize("names", [*permutations(("dark", "reference", "sample")), ("dark", "white", "scope"),
                                   ("reference", "sample"), ("sample",), ("dark", "white", "target")])  # fmt: skip
def test_readings_beside_what_was_made_of_them_are_left_out(written, names, made):
    for write in (str, str.title, str.upper, lambda word: f"{word} spectrum", lambda word: f"{word} (counts)"):
        heads = ["nm", *map(write, names), made]
        file = read_spectra(written(table(heads, *(COLUMNS[name] for name in names), PERCENT), "lamp.csv"))
        (entry,) = file.entries
        check_percent(entry)
        assert not file.rejected and all(any(head in note for note in file.notes) for head in heads[1:-1])


@pytest.mark.parametrize("answer", [ImportOptions(), ImportOptions("emission"), ImportOptions("reflectance")])
@pytest.mark.parametrize("names", [("dark", "sample"), ("dark", "reference", "sample"), ("white", "dark", "scope")])
def test_readings_alone_are_refused(written, names, answer):
    path = written(table(["nm", *names], *(COLUMNS[name] for name in names)), "fluorescent lamp.csv")
    with pytest.raises(InputError, match="readings of an instrument, and nothing that was made of them"):
        read_spectra(path, answer)


COUNTED = ["DN", "Norm. DN (Target)", "target DN", "counts", "Counts", "Intensity (counts)", "ADU", "Raw DN", "cts"]
COUNTED += ["Digital Number", "Raw", "raw data", "Raw signal", "Scope", "Scope mode", "scope [counts]", "Raw data #1"]


@pytest.mark.parametrize("head", COUNTED)
@pytest.mark.parametrize("answer", [ImportOptions(), ImportOptions("emission")])
def test_a_column_of_counts_is_no_lamp(written, head, answer):
    with pytest.raises(InputError, match=r"raw counts are neither|nothing that was made of them"):
        read_spectra(written(table(["Wavelength (nm)", head], SAMPLE), "fluorescent lamp.csv"), answer)


LINES = ["Units: DN", "units= counts", "Mode: Scope", "Y axis: Counts", "Scope mode", "Raw counts", "Measurement;raw"]


@pytest.mark.parametrize("line", [*LINES, "Radiometric Calibration: DN"])
def test_a_line_above_says_that_the_numbers_are_counted(written, line):
    with pytest.raises(InputError, match="raw counts are neither"):
        read_spectra(written(table(["nm", "lamp 1"], SAMPLE, between=";", above=f"{line}\n"), "lamp.csv"))


PAINTS = ["white,dark", "reference,sample", "dark,light", "white,black", "raw umber,raw sienna", "target 1,target 2"]


@pytest.mark.parametrize("heads", [*PAINTS, "sample,standard"])
def test_paints_may_be_called_as_readings_are(written, heads):
    content = table(["nm", *heads.split(",")], PERCENT, PERCENT + 5.0, above="Reflectance (%)\n")
    entries = read_spectra(written(content)).entries
    assert entries and all(entry.spectrum.quantity == "reflectance" for entry in entries)


JAZ = "Jaz {} File\n++++++++++\nUser: lab\nReference Spectrum Present: Yes\n>>>>>Begin Processed Spectral Data<<<<<\n"
END = ">>>>>End Processed Spectral Data<<<<<\n"


@pytest.mark.parametrize("letters", ["DRSP", "DSP", "SP", "PS", "RSDP"])
def test_a_jaz_file_has_one_column_that_is_no_counts(written, letters):
    columns = {"D": DARK, "R": WHITE, "S": SAMPLE, "P": PERCENT}
    content = table(["W", *letters], *(columns[letter] for letter in letters), between="\t", above=JAZ.format("Data"))
    path = written(content + END, "tile.jaz")
    with pytest.raises(InputError, match="what was measured"):
        read_spectra(path)
    (entry,) = read_spectra(path, ImportOptions("reflectance", "percent")).entries
    check_percent(entry)
    assert entry.name == "tile"
    irradiance = written(path.read_text().replace("Data File", "Absolute Irradiance File"), "sun.JazIrrad")
    assert [entry.spectrum.quantity for entry in read_spectra(irradiance).entries] == ["emission"]


def test_a_jaz_file_without_a_processed_column_is_refused(written):
    content = table(["W", "D", "R", "S"], DARK, WHITE, SAMPLE, between="\t", above=JAZ.format("Data")) + END
    with pytest.raises(InputError, match="raw counts"):
        read_spectra(written(content, "lamp.jaz"), ImportOptions("emission"))


@pytest.mark.parametrize("name", ["lamp.txt", "fluorescent_lamp.txt", "paint tile.txt", "lamp tile.txt"])
@pytest.mark.parametrize("title", ["SpectraSuite Data File", "Data from led lamp_USB_0.txt Node", "Paint chip"])
def test_nothing_in_an_export_that_may_be_of_counts_is_a_hint(written, name, title):
    above = f"{title}\n+++++\nUser: lab\nReference Spectrum Present: No\n" + JAZ.splitlines()[-1] + "\n"
    with pytest.raises(InputError, match="what was measured"):
        read_spectra(written(table([], SAMPLE, between="\t", above=above) + END, name))


SVC = "/*** Spectra Vista SIG Data ***/\nname= P1.sig\ninstrument= HI: 1 (HR-1024i)\n{}time= 1/5/2026\ndata= \n"


@pytest.mark.parametrize(
    ("units", "kinds"),
    [
        ("units= Radiance, Radiance\n", ["emission", "emission", "reflectance"]),
        ("units= Irradiance, Radiance\n", ["emission", "emission", "reflectance"]),
        ("units= Counts, Counts\n", ["reflectance"]),
        ("units= DN, DN\n", ["reflectance"]),
        ("", ["reflectance"]),
    ],
)
def test_a_spectra_vista_file_ends_with_its_reflectance(written, units, kinds):
    content = table([], WHITE, SAMPLE, PERCENT, between="  ", above=SVC.format(units))
    file = read_spectra(written(content, "P1.sig"))
    assert [entry.spectrum.quantity for entry in file.entries] == kinds
    check_percent(file.entries[-1])
    assert file.entries[-1].name == "P1"


@pytest.mark.parametrize("between", ["\t", ","])
@pytest.mark.parametrize(
    ("heads", "kinds"),
    [
        (["Norm. DN (Ref.)", "Norm. DN (Target)", "Reflect. %"], ["reflectance"]),
        (["Rad. (Ref.)", "Rad. (Target)", "Reflect. %"], ["emission", "emission", "reflectance"]),
        (["Rad. (Ref.)", "Rad. (Target)", "Tgt./Ref. %"], ["emission", "emission", "reflectance"]),
        (["Irrad. (Ref.)", "Norm. DN (Target)", "Tgt./Ref. %"], ["emission", "reflectance"]),
    ],
)
def test_a_spectral_evolution_file_says_by_column_what_it_holds(written, heads, kinds, between):
    above = "Comment: \nVersion: 2.3\nMeasurement: REFLECTANCE\nRadiometric Calibration: RADIANCE\nUnits: None\nData:\n"
    file = read_spectra(written(table(["Wvl", *heads], WHITE, SAMPLE, PERCENT, between=between, above=above), "a.sed"))
    assert [entry.spectrum.quantity for entry in file.entries] == kinds and not file.rejected
    check_percent(file.entries[-1])


@pytest.mark.parametrize("ending", ["ref", "ref.sco", "ref.sco.mn", "REF"])
def test_columns_that_viewspec_calls_after_its_files_are_what_their_endings_say(written, ending):
    heads = f"Wavelength\tleaf.00001.asd.{ending}\tsky.00002.asd.rad\tleaf.00001.asd"
    rows = "".join(f"{nm}\t{r / 100:.5f}\t{r / 2000:.6f}\t{r * 300:.1f}\n" for nm, r in zip(NM, PERCENT, strict=True))
    file = read_spectra(written(f"{heads}\n{rows}", "field.txt"))
    assert [(entry.name, entry.spectrum.quantity) for entry in file.entries] == [
        (f"leaf.00001.asd.{ending}", "reflectance"),
        ("sky.00002.asd.rad", "emission"),
    ]
    assert [name for name, _ in file.rejected] == ["leaf.00001.asd"]


@pytest.mark.parametrize("head", ["Intensity", "W", "Power", "Relative intensity"])
def test_large_whole_numbers_are_counted_whatever_is_called_intensity(written, head):
    for factor, counted in ((700.0, True), (0.1, False), (1e-5, False)):
        values = np.round(factor * PERCENT, 0 if counted else 8)
        path = written(table(("nm", head), values), "red.csv")
        if not counted:
            assert read_spectra(path).entries[0].spectrum.quantity == "emission"
            continue
        with pytest.raises(InputError, match="what was measured"):
            read_spectra(path)
        assert read_spectra(path, ImportOptions("emission")).entries[0].spectrum.samples.max() == values.max()


@pytest.mark.parametrize("head", ["Intensity", "intensity (a.u.)", "Rel. intensity", "Power", "Output", "Energy"])
def test_fractions_called_intensity_are_of_a_light_or_of_a_surface(written, head):
    """A light that was normalised reaches 1; one that its file is called after needs no more."""
    values = PERCENT / 100.0
    with pytest.raises(InputError, match="what was measured") as refusal:
        read_spectra(written(table(("nm", head), values), "red.csv"))
    assert head in refusal.value.found
    answered = read_spectra(written(table(("nm", head), values), "red.csv"), ImportOptions("reflectance", "fraction"))
    assert answered.entries[0].spectrum.quantity == "reflectance"
    for name, light in (("lamp.csv", values), ("red.csv", values / values.max()), ("red.csv", PERCENT)):
        (entry,) = read_spectra(written(table(("nm", head), light), name)).entries
        assert entry.spectrum.quantity == "emission"
    (entry,) = read_spectra(written(table(("nm", f"{head} (W/m2/nm)"), values), "red.csv")).entries
    assert entry.spectrum.quantity == "emission"


@pytest.mark.parametrize("head", ["Radiance factor (%)", "Radiance factor"])
def test_percents_that_nothing_sends_back_are_asked_about(written, head):
    for factor, refused in ((600.0, True), (20.0, True), (10.0, False), (1.0, False)):
        path = written(table(("nm", head), factor * PERCENT), "red.csv")
        if refused:
            with pytest.raises(InputError, match="brighter than anything that is lit"):
                read_spectra(path)
        else:
            np.testing.assert_allclose(
                read_spectra(path).entries[0].spectrum.samples, factor * PERCENT / 100.0, rtol=1e-5
            )


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ("Reflectance", "what scale is that"),
        ("Reflectance x1000", "a scale that is neither to 1 nor to 100"),
        ("Transmittance", "what scale is that"),
    ],
)
def test_large_reflectances_without_a_unit_are_no_percents(written, head, words):
    """Tenths of percent, and eight bits, are on no scale that a heading of reflectance says."""
    with pytest.raises(InputError, match=words):
        read_spectra(written(table(("nm", head), 10.0 * PERCENT), "red.csv"))


@pytest.mark.parametrize("head", ["Reflectance", "R"])
@pytest.mark.parametrize("largest", [110, 160, 200])
def test_whole_numbers_above_any_percent_are_asked_about(written, head, largest):
    """Codes of a picture, 0 to 255, are no percent; what is read in whole percent stays."""
    scaled = PERCENT * largest / PERCENT.max()
    path = written(table(("nm", head), np.round(scaled)), "red.csv")
    with pytest.raises(InputError, match="what scale is that") as refusal:
        read_spectra(path)
    assert "codes" in refusal.value.found
    np.testing.assert_allclose(
        read_spectra(path, ImportOptions(scale="percent")).entries[0].spectrum.samples, np.round(scaled) / 100.0
    )
    for values in (scaled, np.round(PERCENT)):
        (entry,) = read_spectra(written(table(("nm", head), values), "red.csv")).entries
        np.testing.assert_allclose(entry.spectrum.samples, values / 100.0, rtol=1e-5)


READ_IN_OTHER_LANGUAGES = [
    ("Dunkel", "Weiß", "Probe", "Reflexion (%)"),
    ("Dunkelspektrum", "Weißspektrum", "Probenspektrum", "Reflexionsgrad (%)"),
    ("noir", "référence", "échantillon", "réflectance (%)"),
    ("oscuro", "referencia", "muestra", "reflectancia (%)"),
    ("Dunkelstrom", "Weißreferenz", "Rohdaten", "Remission (%)"),
    ("Dunkelabgleich", "Weißabgleich", "Messsignal", "Reflexionsgrad (%)"),
    ("Bruit de fond", "Référence blanche", "Données brutes", "Réflectance (%)"),
    ("Oscuridad", "Referencia blanca", "Datos brutos", "Reflectancia (%)"),
    ("Fondo", "Riferimento bianco", "Dati grezzi", "Riflettanza (%)"),
    ("Dark ref", "White ref", "Raw", "%R"),
    ("Background", "White standard", "Sample intensity", "Reflectance"),
    ("Dark current", "White", "Intensity", "Reflectance (%)"),
]


@pytest.mark.parametrize("heads", READ_IN_OTHER_LANGUAGES)
def test_readings_are_left_out_in_other_languages(written, heads):
    file = read_spectra(written(table(("nm", *heads), DARK, WHITE, SAMPLE, PERCENT, between=";"), "red.csv"))
    (entry,) = file.entries
    check_percent(entry)
    assert not file.rejected
    with pytest.raises(InputError, match="readings of an instrument"):
        read_spectra(written(table(("nm", *heads[:3]), DARK, WHITE, SAMPLE, between=";"), "lamp.csv"))


@pytest.mark.parametrize("made", ["reflectance (%)", "%T", "Reflexion"])
@pytest.mark.parametrize("names", [("Lampe", "Nullwert", "Messung 1"), ("white lamp", "x", "y"), ("D65", "I0", "Id2")])
def test_what_is_called_anything_beside_a_reflectance_is_no_lamp_for_its_numbers(written, names, made):
    heads = ("nm", *names, made)
    file = read_spectra(written(table(heads, WHITE, DARK, SAMPLE, PERCENT, between=";"), "halogen lamp.csv"))
    assert [entry.spectrum.quantity for entry in file.entries] == ["transmittance" if "T" in made else "reflectance"]
    assert {name for name, _ in file.rejected} <= set(names)


@pytest.mark.parametrize("head", ["Zählrate", "Zählwert", "coups", "cuentas"])
def test_counts_are_counts_in_other_languages(written, head):
    with pytest.raises(InputError, match="raw counts"):
        read_spectra(written(table(("nm", head), SAMPLE), "lamp.csv"))


@pytest.mark.parametrize("head", ["Intensity", "signal", "lamp 1", ""])
@pytest.mark.parametrize("name", ["lamp.csv", "fluorescent lamp.txt", "LED.csv"])
def test_large_whole_numbers_are_no_sign_of_light(written, head, name):
    values = np.round(700.0 * PERCENT)
    path = written(table(("nm", head), values), name)
    with pytest.raises(InputError, match="what was measured"):
        read_spectra(path)
    assert read_spectra(path, ImportOptions("emission")).entries[0].spectrum.samples.max() == values.max()


def _with_its_scale(kind, percents, scale):
    """A file of one red in each format that states its scale, and the name of it."""
    values = percents if scale == "percent" else percents / 100.0
    text = [f"{value:.8g}" for value in values]
    if kind == "heading":
        return table(("nm", "R (%)" if scale == "percent" else "R (0-1)"), values), "red.csv"
    if kind == "line above":
        return table(("nm", "red"), values, above=f"Reflectance {'%' if scale == 'percent' else '(0-1)'}\n"), "red.csv"
    if kind in ("norm", "fields"):
        mark = "NM" if kind == "norm" else "PCT" if scale == "percent" else "DEC"
        fields = " ".join(f"SPECTRAL_{mark}{nm}" for nm in NM)
        norm = f"SPECTRAL_NORM {100 if scale == 'percent' else 1}\n" if kind == "norm" else ""
        form = f"NUMBER_OF_FIELDS {len(NM) + 1}\nBEGIN_DATA_FORMAT\nSAMPLE_ID {fields}\nEND_DATA_FORMAT\n"
        rows = f"NUMBER_OF_SETS 1\nBEGIN_DATA\nred {' '.join(text)}\nEND_DATA\n"
        return f'CGATS.17\nMEASUREMENT_TYPE "Reflectance"\n{norm}{form}{rows}', "red.txt"
    if kind == "spdx":
        points = "".join(
            f'<SpectralData wavelength="{nm}">{value}</SpectralData>' for nm, value in zip(NM, text, strict=True)
        )
        body = f"<SpectralQuantity>reflectance</SpectralQuantity>{points}"
        body = f"<Header/><SpectralDistribution>{body}</SpectralDistribution>"
        return f'<IESTM2714 xmlns="iestm2714" version="1.0">{body}</IESTM2714>', "red.spdx"
    spectrum = f'<ReflectanceSpectrum ColorSpecification="M" StartWL="400">{" ".join(text)}</ReflectanceSpectrum>'
    spec = "<MeasurementType>Spectrum_Reflectance</MeasurementType>"
    spec = f'<MeasurementSpec>{spec}<WavelengthRange StartWL="400" Increment="20"/></MeasurementSpec>'
    spec = f'<ColorSpecificationCollection><ColorSpecification Id="M">{spec}</ColorSpecification>'
    item = f'<Object Name="red" Id="o" ObjectType="Standard"><ColorValues>{spectrum}</ColorValues></Object>'
    body = f"<ObjectCollection>{item}</ObjectCollection>{spec}</ColorSpecificationCollection>"
    return f'<CxF xmlns="http://colorexchangeformat.com/CxF3-core"><Resources>{body}</Resources></CxF>', "red.cxf"


IN_TEXT, BY_FORMAT = ("heading", "line above", "norm", "fields"), ("cxf", "spdx")


@pytest.mark.parametrize("kind", [*IN_TEXT, *BY_FORMAT])
def test_what_no_surface_sends_back_is_asked_about_though_its_scale_is_stated(written, kind):
    """Some thousandths at every wavelength are a radiance, or were divided twice; five times the light is percent."""
    scales = ("fraction",) if kind in BY_FORMAT else ("fraction", "percent")
    for factor, scale in ((0.005, "fraction"), (8.0, "fraction"), *((8.0, scale) for scale in scales[1:])):
        path = written(*_with_its_scale(kind, factor * PERCENT, scale))
        with pytest.raises(InputError, match=r"too dark for a surface|looks like percent|brighter than anything"):
            read_spectra(path)
        answered = ImportOptions(scale="percent" if factor > 1.0 else "fraction", against="overruled")
        (entry,) = read_spectra(path, answered).entries
        right = factor * PERCENT / 100.0 / (100.0 if scale == "fraction" and factor > 1.0 else 1.0)
        np.testing.assert_allclose(entry.spectrum.samples, right, rtol=1e-5)
        assert "by --scale" in entry.taken
    for scale in scales:
        (entry,) = read_spectra(written(*_with_its_scale(kind, PERCENT, scale))).entries
        check_percent(entry)


@pytest.mark.parametrize("kind", [*IN_TEXT, *BY_FORMAT])
def test_a_dark_paint_in_percents_is_no_fluorescent_one(written, kind):
    """From 0.9 to 2.7 at every wavelength: some of it may be above 1 where a paint glows, and not all of it."""
    path = written(*_with_its_scale(kind, 80.0 + 3.0 * PERCENT, "fraction"))
    with pytest.raises(InputError, match="looks like percent"):
        read_spectra(path)
    glowing = np.where(NM < 560, 5.0, 180.0)
    (entry,) = read_spectra(written(*_with_its_scale(kind, glowing, "fraction"))).entries
    np.testing.assert_allclose(entry.spectrum.samples, glowing / 100.0)


@pytest.mark.parametrize("head", ["Reflectance", "R"])
def test_a_dark_paint_without_a_unit_is_asked_about(written, head):
    with pytest.raises(InputError, match="percent or fractions"):
        read_spectra(written(table(("nm", head), 0.8 + 0.017 * PERCENT), "red.csv"))


UNITS = ["W/m2/Hz", "W m-2 Hz-1", "W/(sr m2 THz)", "W/m^2/eV", "mW/cm2/cm-1"]


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("way", ["unit alone", "words and unit", "line above"])
def test_power_per_frequency_is_refused_over_wavelengths_too(written, unit, way):
    heads = {"unit alone": ("nm", unit), "words and unit": ("nm", f"Irradiance ({unit})"), "line above": ("nm", "lamp")}
    above = f"Irradiance [{unit}]\n" if way == "line above" else ""
    with pytest.raises(InputError, match="over a frequency or an energy"):
        read_spectra(written(table(heads[way], PERCENT, above=above), "lamp.csv"))


@pytest.mark.parametrize("head", ["Irradiance (W/m2/nm) 50 Hz", "Irradiance at 60 Hz (W/m2/nm)", "W/m2/nm", "mW/nm"])
def test_power_per_nanometre_of_a_lamp_that_flickers_is_read(written, head):
    (entry,) = read_spectra(written(table(("nm", head), PERCENT), "lamp.csv")).entries
    assert entry.spectrum.quantity == "emission"


@pytest.mark.parametrize("kind", [*IN_TEXT, *BY_FORMAT])
def test_what_is_too_dark_as_fractions_is_no_percents_whatever_a_folders_answer_says(written, kind):
    path = written(*_with_its_scale(kind, 0.005 * PERCENT, "fraction"))
    for against in ("kept", "refused", "overruled"):
        with pytest.raises(InputError, match="too dark for a surface"):
            read_spectra(path, ImportOptions(scale="percent", against=against))


@pytest.mark.parametrize("name", ["silver 45as15", "silver as15"])
@pytest.mark.parametrize("norm", [100, 1])
def test_readings_towards_the_mirror_of_a_chart_may_be_far_above_white(written, name, norm):
    content, _ = _with_its_scale("norm", 8.0 * PERCENT, "percent" if norm == 100 else "fraction")
    file = read_spectra(written(content.replace("\nred ", f'\n"{name}" '), "silver.txt"))
    np.testing.assert_allclose(file.entries[0].spectrum.samples, 0.08 * PERCENT, rtol=1e-6)


@pytest.mark.parametrize("name", ["Baseline 100%R", "Baseline 0%R", "Baseline"])
def test_the_baseline_of_a_spectrophotometer_is_no_sample(written, name):
    rows = [[f"{nm:.3f}", "98.2", f"{nm:.3f}", f"{nm / 10:.3f}"] for nm in range(700, 399, -20)]
    lines = [[name, "", "Red", ""], ["Wavelength (nm)", "%R", "Wavelength (nm)", "%R"], *rows]
    file = read_spectra(written("\n".join(map(",".join, lines)) + "\n"))
    (entry,) = file.entries
    assert entry.name == "Red" and entry.spectrum.samples[0] == 0.4
    assert any(f"left out: {name}" in note for note in file.notes)


JASCO = "TITLE\tred\nDATA TYPE\tULTRAVIOLET SPECTRUM\nXUNITS\tNANOMETERS\nYUNITS\t{}\n{}\t{}\nFIRSTX\t400\nXYDATA\n"


@pytest.mark.parametrize("key", ["Y2UNITS", "YUNITS2", "Y2 UNITS"])
@pytest.mark.parametrize(
    ("first", "second"), [("REFLECTANCE", "HT [V]"), ("%R", "HT"), ("Reflectance (%)", "TRANSMITTANCE (%)")]
)
def test_each_channel_of_a_text_of_jascos_is_what_its_unit_says(written, key, first, second):
    other = PERCENT / 2.0 if "TRANS" in second else 250.0 + PERCENT / 30.0
    path = written(table([], PERCENT, other, between="\t", above=JASCO.format(first, key, second)), "red.txt")
    file = read_spectra(path)
    check_percent(file.entries[0])
    assert file.entries[0].name == "red"
    assert [entry.spectrum.quantity for entry in file.entries[1:]] == ["transmittance"] * ("TRANS" in second)
    assert ("TRANS" in second) or any("raw counts are left out: red channel 2" in note for note in file.notes)


@pytest.mark.parametrize("heads", ["Reference,Sample,Ratio", "Standard,Trial,Ratio", "White,Red,Quotient"])
def test_a_ratio_beside_a_standard_is_no_reflectance(written, heads):
    file = read_spectra(
        written(table(["nm", *heads.split(",")], PERCENT, PERCENT, PERCENT / 60.0, above="Reflectance\n"))
    )
    assert heads.rpartition(",")[2] not in [entry.name for entry in file.entries]
    assert any(heads.rpartition(",")[2] in note for note in file.notes)


@pytest.mark.parametrize("heads", ["Reference,Sample,Ratio (%)", "Sample,Reference,Ratio [%]"])
def test_a_ratio_in_percent_is_what_was_made_of_the_readings_beside(written, heads):
    (entry,) = read_spectra(
        written(table(["nm", *heads.split(",")], SAMPLE, WHITE, PERCENT, above="Reflectance\n"))
    ).entries
    check_percent(entry)


@pytest.mark.parametrize(
    "heads", ["WX,WY,WZ", "W10 x,W10 y,W10 z", "Wx (D65/10),Wy (D65/10),Wz (D65/10)", "W_X,W_Y,W_Z"]
)
def test_weights_of_tristimulus_values_are_no_reflectances(written, heads):
    names = heads.split(",")
    across = [",".join(["Name", *map(str, NM)]), *(",".join([name, *map(str, PERCENT)]) for name in names)]
    for content in (table(["nm", *names], *([PERCENT] * 3)), "\n".join(across)):
        with pytest.raises(InputError, match="a sensitivity is not the spectrum of a colour"):
            read_spectra(written(f"Reflectance\n{content}"))
    file = read_spectra(written("Reflectance (%)\n" + table(["nm", "red", *names], *([PERCENT] * 4))))
    assert [entry.name for entry in file.entries] == ["red"] and len(file.rejected) == 3
    two = read_spectra(written("Reflectance (%)\n" + table(["nm", *names[:2]], PERCENT, PERCENT)))
    assert [entry.name for entry in two.entries] == names[:2]


OTHERS = [
    "Haze (%)",
    "Opacity",
    "Contrast ratio",
    "Absorptance (%)",
    "Diffuse absorption",
    "Emissivity",
    "Bandwidth (nm)",
]
OTHERS += ["Correction factor", "Calibration", "Exposure (ms)", "Cumulative", "Photopic", "Turbidity (NTU)"]


@pytest.mark.parametrize("head", OTHERS)
@pytest.mark.parametrize("title", ["Reflectance (%)", "Transmittance (%)"])
def test_other_quantities_below_the_words_of_a_measurement_are_no_samples(written, head, title):
    file = read_spectra(written(table(["nm", "red", head], PERCENT, PERCENT, above=f"{title}\n")))
    assert [entry.name for entry in file.entries] == ["red"]
    (rejected,) = file.rejected
    assert "another quantity than the spectrum of a colour" in str(rejected[1])


@pytest.mark.parametrize("kind", ["K/S", "log(1/R)", "absorbance", "F(R)"])
def test_rows_named_as_functions_of_a_reflectance_are_none(written, kind):
    names = ["red", f"red {kind}", "ABS red", "red ABS"]
    rows = [",".join(["Name", *map(str, NM)]), *(",".join([name, *map("{:.3f}".format, PERCENT)]) for name in names)]
    file = read_spectra(written("\n".join(["Reflectance (%)", *rows])))
    assert [entry.name for entry in file.entries] == ["red", "ABS red", "red ABS"]
    assert [name for name, _ in file.rejected] == [names[1]]


WEIGHED = ["Illuminance (lx/nm)", "Luminous flux (lm/nm)", "Luminance [cd m-2 nm-1]", "Photopic irradiance (W/m2)"]
WEIGHED += [
    "Erythemal irradiance (W/m2/nm)",
    "Effective radiance",
    "Weighted irradiance",
    "Cumulative irradiance (W/m2)",
]
WEIGHED += ["Integrated radiance", "Irradiance ratio", "Radiance temperature (K)", "Irradiance correction factor"]


@pytest.mark.parametrize("head", WEIGHED)
def test_powers_that_are_weighted_or_summed_up_are_no_spectra_of_a_light(written, head):
    with pytest.raises(InputError, match="a function of a power is none"):
        read_spectra(written(table(["nm", head], PERCENT), "lamp.csv"))


@pytest.mark.parametrize(
    "head", ["Irradiance (W/m2/nm)", "Unweighted irradiance", "Integrating sphere flux (W/nm)", "Luminance"]
)
def test_powers_that_are_not_are_read(written, head):
    (entry,) = read_spectra(written(table(["nm", head], PERCENT), "lamp.csv")).entries
    assert entry.spectrum.quantity == "emission"


def perkin_elmer(unit, factor="1.000000", offset="0.000000"):
    head = [
        "PE UV       SUBTECH     SPECTRUM    ASCII       PEDS        4.00",
        "         -1",
        "red.sp",
        "#HDR",
        "-1",
        "lab",
    ]
    return "\n".join([*head, "#GR", "nm", unit, factor, offset, "700.000000", "-20.000000", "16", "#DATA", ""])


def test_a_text_of_perkinelmers_is_what_its_unit_says(written):
    path = written(table([], PERCENT, between="\t", above=perkin_elmer("%R")), "red.asc")
    check_percent(read_spectra(path).entries[0])
    answer = ImportOptions("reflectance", "percent")
    for above, problem in ((perkin_elmer("A"), "absorbance is neither"), (perkin_elmer("%R", "0.100000"), "factor"),
                           (perkin_elmer("%R", offset="2.000000"), "a factor or an offset")):  # fmt: skip
        with pytest.raises(InputError, match=problem):
            read_spectra(written(table([], PERCENT, between="\t", above=above), "red.asc"), answer)


@pytest.mark.parametrize("between", [",", ";"])
@pytest.mark.parametrize("last", ["", " "])
def test_rows_with_a_cell_too_few_before_their_values_are_asked_about(written, between, last):
    heads = between.join(["Name", "Lot", *map(str, NM)])
    rows = [between.join([name, *map("{:.2f}".format, PERCENT), last]) for name in ("red", "blue")]
    with pytest.raises(InputError, match="cells that may stand one wavelength too far left"):
        read_spectra(written("\n".join(["Reflectance (%)", heads, *rows])))
    whole = [between.join([name, "7.1", *map("{:.2f}".format, PERCENT)]) for name in ("red", "blue")]
    assert len(read_spectra(written("\n".join(["Reflectance (%)", heads, *whole]))).entries) == 2


@pytest.mark.parametrize(("first", "last"), [(3, 0), (0, 2), (2, 4)])
def test_zeros_at_an_end_to_which_readings_do_not_fall_are_said(written, first, last):
    padded = 30.0 + PERCENT / 20.0
    padded[:first] = padded[len(padded) - last :] = 0.0
    file = read_spectra(written(table(["nm", "Reflectance (%)"], padded)))
    assert any("zeros at an end, to which readings do not fall" in note for note in file.notes)
    fallen = np.round(90.0 / (1.0 + np.exp(-(NM - 550.0) / 8.0)), 2)
    assert not any("zeros" in note for note in read_spectra(written(table(["nm", "%T"], fallen))).notes)
