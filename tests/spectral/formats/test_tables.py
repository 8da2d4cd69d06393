"""Tables of spectra as spreadsheets and instruments write them."""

import numpy as np
import pytest
from metamer.materials.formats.spectra import guessed
from metamer.runtime.errors import InputError
from metamer.spectral.formats.csv import read, recognises
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.registry import format_of, read_spectra
from metamer.spectral.measurement import Measurement

DOWN = "nm,Red,Grey\n400,0.05,0.2\n410,0.06,0.2\n420,0.07,0.2\n"
ACROSS = "name,400,410,420\nRed,0.05,0.06,0.07\nGrey,0.2,0.2,0.2\n"
RED = [0.05, 0.06, 0.07]


def silent(path):
    """Read a table of fractions that says nothing of what was measured."""
    return read(path, ImportOptions("reflectance", "fraction"))


def values(file):
    """Samples by name."""
    return {entry.name: entry.spectrum.samples.tolist() for entry in file.entries}


def only(file):
    (entry,) = file.entries
    return entry


@pytest.mark.parametrize(
    "content",
    [
        DOWN,
        ACROSS,
        DOWN.replace(",", ";"),
        DOWN.replace(",", "\t"),
        DOWN.replace(",", " "),
        DOWN.replace(",", ";").replace(".", ","),
        DOWN.replace(",", "\t").replace(".", ","),
        ACROSS.replace(",", ";").replace(".", ","),
        DOWN.replace("\n", "\r\n"),
        "\ufeff" + DOWN,
        ("\ufeff" + DOWN).encode("utf-16-le"),
        ("\ufeff" + DOWN.replace(",", "\t")).encode("utf-16-be"),
        "# a chart\n! of two\n\n" + DOWN,
        "Paints of May;;\nMeasured by;A. Smith;\n" + DOWN.replace(",", ";"),
        "sep=;\n" + DOWN.replace(",", ";"),
        DOWN.replace("\n", ",,\n"),
        DOWN.replace(",", " , "),
        "\n".join(",".join(f'"{cell}"' for cell in line.split(",")) for line in DOWN.splitlines()),
        "\n".join(",".join(f'"{cell.replace(".", ",")}"' for cell in line.split(",")) for line in DOWN.splitlines()),
        DOWN.replace("nm,", "Wellenlänge [nm],"),
        DOWN.replace("nm,", "wavelength (nm),"),
        "# nm Red Grey\n" + DOWN.partition("\n")[2].replace(",", " "),
        ACROSS.replace("400", "380nm")
        .replace("410", "400 nm")
        .replace("420", "420nm")
        .replace("380nm", "400nm")
        .replace("400 nm", "410 nm"),
        ACROSS.replace("400", "R_400").replace("410", "R_410").replace("420", "R_420"),
        ACROSS.replace("400", "S_400nm").replace("410", "S_410nm").replace("420", "S_420nm"),
        ACROSS.replace("400", "SPECTRAL_NM400").replace("410", "SPECTRAL_NM410").replace("420", "SPECTRAL_NM420"),
        "No,Wavelength,Red,Grey\n1,400,0.05,0.2\n2,410,0.06,0.2\n3,420,0.07,0.2\n",
        "nm,Red,Grey\n420,0.07,0.2\n410,0.06,0.2\n400,0.05,0.2\n",
        "µm,Red,Grey\n0.400,0.05,0.2\n0.410,0.06,0.2\n0.420,0.07,0.2\n",
        "Wavelength (Å),Red,Grey\n4000,0.05,0.2\n4100,0.06,0.2\n4200,0.07,0.2\n",
        "nm;Red [%];Grey [%]\n400;5;20\n410;6;20\n420;7;20\n",
        "Reflectance in %\nnm;Red;Grey\n400;5;20\n410;6;20\n420;7;20\n",
        "nm;Red;Grey\n[nm];[%];[%]\n400;5;20\n410;6;20\n420;7;20\n",
        "nm;Red;Grey\n400;5;20\n410;6;20\n420;7;20\n",
        "nm,Red,Grey\n400,5%,20%\n410,6%,20.0 %\n420,7%,20%\n",
        "name;400;410;420\nRed;5%;6%;7%\nGrey;20%;20%;20%\n",
    ],
)
def test_one_chart_in_many_dialects(written, content):
    path = written(content)
    assert recognises(path, path.read_bytes()[:4096])
    percent = any(mark in content for mark in (";5;", "5%")) if isinstance(content, str) else False
    file = read(path, ImportOptions("reflectance", "percent" if percent else "fraction"))
    assert list(values(file)) == ["Red", "Grey"]
    assert values(file)["Red"] == pytest.approx(RED, rel=1e-12)
    for entry in file.entries:
        assert entry.spectrum.quantity == "reflectance"
        np.testing.assert_allclose(entry.spectrum.wavelengths_nm, [400.0, 410.0, 420.0], rtol=1e-12)


def test_latin_names(written):
    content = "nm;Grün\n400;0,05\n410;0,06\n420;0,07\n"
    for encoding in ("utf-8", "cp1252", "latin-1"):
        assert list(values(silent(written(content.encode(encoding))))) == ["Grün"]


def test_what_was_taken_is_said_with_its_sign(written):
    (stated,) = read(written("nm,R (%)\n400,50\n410,60\n420,70\n")).entries
    assert stated.taken == "reflectance in percent, by the heading 'R (%)'"
    said = "reflectance in fractions, by --as; fraction by --scale"
    assert {entry.taken for entry in silent(written(DOWN)).entries} == {said}


def test_stated_percent_is_divided_and_said(written):
    file = read(written("nm,Dark (%)\n400,1.5\n410,1.6\n420,1.7\n"), ImportOptions("reflectance"))
    assert only(file).spectrum.samples.tolist() == pytest.approx([0.015, 0.016, 0.017], rel=1e-15)
    assert only(file).details["units"] == "%"
    assert any("states percent" in note for note in file.notes)


DARK = {
    "no paint in percent": ("nm,Reflectance (%)\n400,0.07\n410,0.3\n420,0.63\n", "the numbers say fractions"),
    "no paint at all": ("nm,Reflectance\n400,0.0001\n410,0.0009\n420,0.0024\n", "too dark for a surface"),
    "no radiance factor": ("nm,radiance factor (%)\n400,0.5\n410,0.6\n420,0.7\n", "the numbers say fractions"),
    "a line in percent": ("Reflectance in %\nnm,A,B\n400,0.2,0.3\n410,0.2,0.4\n420,0.3,0.5\n", "say fractions"),
    "a unit below": ("nm;R\n[nm];[%]\n400;0,2\n410;0,3\n420;0,5\n", "the numbers say fractions"),
    "a filter": ("nm,Transmittance (%)\n400,0.1\n410,0.5\n420,0.9\n", "the numbers say fractions"),
    "percent called fractions": ("nm,reflectance (0..1)\n400,5\n410,6\n420,9\n", "looks like percent"),
}


@pytest.mark.parametrize("kind", DARK)
def test_impossible_darkness_and_brightness_are_asked_about(written, kind):
    content, problem = DARK[kind]
    path = written(content)
    with pytest.raises(InputError, match=problem) as caught:
        read(path)
    assert "--scale" in str(caught.value)
    scale = "percent" if kind == "percent called fractions" else "fraction"
    assert {entry.spectrum.samples.max() for entry in read(path, ImportOptions(scale=scale)).entries} <= {
        0.63, 0.0024, 0.7, 0.4, 0.3, 0.5, 0.9, 0.09,
    }  # fmt: skip


def test_dark_percent_is_taken_where_a_person_says_so(written):
    file = read(written("nm,Black (%)\n400,0.5\n410,0.6\n420,0.7\n"), ImportOptions("reflectance", "percent"))
    assert only(file).spectrum.samples.tolist() == pytest.approx([0.005, 0.006, 0.007], rel=1e-15)
    assert any("the import says percent" in note and "none of them exceeds 1" in note for note in file.notes)
    assert "by --scale" in only(file).taken


def test_the_words_of_the_option_are_those_of_an_answer():
    assert ImportOptions("radiance-factor") == ImportOptions("radiance factor")


def test_unstated_percent_is_divided_and_said(written):
    file = read(written("nm,White\n400,90\n410,91\n420,92\n"), ImportOptions("reflectance"))
    assert only(file).spectrum.samples.tolist() == [0.9, 0.91, 0.92]
    assert any("can only be percent" in note for note in file.notes)


def test_percent_of_a_dark_sample_or_radiance_factor_of_a_bright_one(refused):
    lines = refused(read, "nm,R\n400,0.5\n410,4.06\n420,5.07\n")
    assert lines[0] == "paints.csv: values: percent or fractions?"
    assert lines[1] == "  found: 0.5 to 5.07, no unit stated"
    assert 'write "reflectance (%)" or "radiance factor"' in lines[-1]


@pytest.mark.parametrize("content", ["nm,A\n400,50\n410,4000\n420,700\n", "nm,A\n400,0\n410,0.0004\n420,0.0007\n"])
def test_values_too_large_or_small_for_a_paint_need_a_word(refused, written, content):
    assert refused(read, content)[0] == "paints.csv: A: what was measured?"
    (entry,) = read(written(content.replace("A", "W/m2/nm"))).entries
    assert entry.spectrum.quantity == "emission"


def test_spaces_in_the_header_of_a_table_that_spaces_part(written):
    (entry,) = silent(written("Wavelength (nm) Deep Red\n400 0.05\n410 0.06\n420 0.07\n", "red.txt")).entries
    assert entry.name == "Deep Red"
    (entry,) = read(written("Wavelength (nm) Reflectance (%)\n400 5\n410 6\n420 7\n", "red.txt")).entries
    assert entry.name == "red" and entry.spectrum.samples.tolist() == RED


def test_a_radiance_factor_by_its_word(written):
    entry = only(read(written("nm,radiance factor at 15°\n400,0.5\n410,4.06\n420,5.07\n")))
    assert entry.spectrum.quantity == "radiance factor"
    assert entry.spectrum.samples.tolist() == [0.5, 4.06, 5.07]


def test_reflectance_above_one_is_held_as_a_radiance_factor(written):
    file = silent(written(DOWN.replace("0.06", "1.06")))
    assert [entry.spectrum.quantity for entry in file.entries] == ["radiance factor", "reflectance"]
    assert "reflectance above 1 is held as a radiance factor (Red)" in file.notes


@pytest.mark.parametrize(
    ("header", "quantity"),
    [
        ("Spectral irradiance (W/m2/nm)", "emission"),
        ("mW/(m²·sr·nm)", "emission"),
        ("%T", "transmittance"),
        ("Transmittance", "transmittance"),
        ("R%", "reflectance"),
        ("Remission", "reflectance"),
        ("Reflexionsgrad", "reflectance"),
    ],
)
def test_what_was_measured_from_the_header(written, header, quantity):
    percent = "%" in header
    content = f"nm,{header}\n400,{50 if percent else 0.5}\n410,0.6\n420,0.7\n"
    entry = only(read(written(content)))
    assert entry.spectrum.quantity == quantity
    assert entry.spectrum.samples[0] == 0.5


def test_names_of_lights_are_no_lights_yet(refused):
    """ "A", "F2" and "light skin" are places and paints on charts as well as illuminants."""
    said = refused(read, "nm,A,F2,light skin\n400,0.1,0.2,0.3\n410,0.1,0.2,0.3\n420,0.1,0.2,0.3\n", "x.csv")
    assert said[0] == "x.csv: A, F2, light skin: what was measured?"


@pytest.mark.parametrize("header", ["Abs.", "Absorbance", "log(1/R)", "F(R)"])
def test_absorbance_is_refused_by_name(refused, header):
    lines = refused(read, f"nm,{header}\n400,0.5\n410,0.6\n420,0.7\n")
    assert "absorbance is neither reflectance nor transmittance" in lines[0]
    assert "export %R or %T" in lines[-1]


def test_wavenumbers_are_converted_and_said(written):
    file = silent(written("Wavenumber (cm-1),A\n4000,0.1\n3990,0.06\n3980,0.07\n"))
    assert only(file).spectrum.wavelengths_nm.tolist() == [1e7 / 4000, 1e7 / 3990, 1e7 / 3980]
    assert "the axis is in cm-1 and converted: nm = 10000000 / cm-1" in file.notes


def test_micrometres_without_a_unit_are_refused(refused):
    assert "wavelengths look like micrometres" in refused(read, "w,R\n0.4,0.05\n0.41,0.06\n0.42,0.07\n")[0]


def test_lab_and_xyz_beside_the_spectra(written):
    content = (
        "Illuminant: D50\nObserver: 10\nName,XYZ_X,XYZ_Y,XYZ_Z,L*(2°/D65),a*(2°/D65),b*(2°/D65),400,410,420\n"
        "Red,20,30,40,50,60,-10,0.05,0.06,0.07\n"
    )
    entry = only(silent(written(content)))
    assert entry.spectrum.quantity == "reflectance"
    xyz, lab = entry.stated
    assert (xyz.space, xyz.values.tolist(), xyz.illuminant, xyz.observer) == ("XYZ", [20, 30, 40], "D50", "1964_10")
    assert (lab.space, lab.values.tolist(), lab.illuminant, lab.observer) == ("Lab", [50, 60, -10], "D65", "1931_2")


@pytest.mark.parametrize("place", ["above", "below"])
def test_lab_in_rows_above_or_below_the_spectra(written, place):
    lab = "L*(D65/10°),50.5,30\na*(D65/10°),60,1\nb*(D65/10°),-10,-40\n"
    rows = "400,0.05,0.2\n410,0.06,0.2\n420,0.07,0.2\n"
    file = silent(written("nm,Red,Blue\n" + (lab + rows if place == "above" else rows + lab)))
    assert values(file)["Red"] == RED
    for entry, expected in zip(file.entries, ([50.5, 60, -10], [30, 1, -40]), strict=True):
        (found,) = entry.stated
        assert (found.space, found.values.tolist()) == ("Lab", expected)
        assert (found.illuminant, found.observer) == ("D65", "1964_10")
    assert not any("not read" in note for note in file.notes)


def test_other_cells_stay_in_the_details(written):
    entry = silent(
        written("Name,Batch,Gloss,400,410,420\nRed,7b,high,0.05,0.06,0.07\nBlue,8,low,0.1,0.1,0.1\n")
    ).entries[0]
    assert entry.name == "Red" and dict(entry.details) == {"Batch": "7b", "Gloss": "high"}


@pytest.mark.parametrize(("above", "light"), [("D65/10, A/10", None), ("Illuminant: D65", "D65")])
def test_two_lights_above_a_table_are_left_open_beside_its_spectra(written, above, light):
    file = read(written(f"Reflectance\n{above}\nname;L*;a*;b*;400;500;600\nred;40;50;30;0.1;0.2;0.4\n"))
    assert only(file).stated[0].illuminant == light
    assert any("leaves open which of D65, A" in note for note in file.notes) == (light is None)


def test_the_illuminant_in_a_column(written):
    content = "Name,Illum/Obs,L*,a*,b*,400,410,420\nRed,D65/10,50,1,2,0.1,0.1,0.1\nBlue,A/2,50,1,2,0.1,0.1,0.1\n"
    found = [entry.stated[0] for entry in silent(written(content)).entries]
    assert [(lab.illuminant, lab.observer) for lab in found] == [("D65", "1964_10"), ("A", "1931_2")]


def test_geometries_of_an_effect_paint_in_percent(written):
    content = "Name;Geometry;400nm;410nm;420nm\nSilver;45as15;312,5;311,1;310,9\nSilver;45as110;20,5;21,1;20,9\n"
    near, far = read(written(content)).entries
    assert near.spectrum.quantity == "radiance factor" and near.spectrum.samples[0] == 3.125
    assert far.spectrum.quantity == "reflectance" and far.details["Geometry"] == "45as110"


def test_an_identifier_is_only_a_name_where_there_is_no_better(written):
    assert list(values(silent(written("ID,Name,400,410,420\n7,Red,0.1,0.1,0.1\n8,Blue,0.1,0.1,0.1\n")))) == [
        "Red",
        "Blue",
    ]
    assert list(values(silent(written("ID,Lot,400,410,420\n7,x,0.1,0.1,0.1\n8,x,0.1,0.1,0.1\n")))) == ["7", "8"]


def test_names_that_are_numbers_like_wavelengths(written):
    file = silent(written("nm,1000,1001,1002\n400,0.1,0.2,0.3\n410,0.2,0.3,0.3\n420,0.3,0.4,0.3\n"))
    assert list(values(file)) == ["1000", "1001", "1002"]
    many = "nm," + ",".join(f"s{number}" for number in range(300)) + "\n"
    many += "".join(f"{nm}," + ",".join(["0.5"] * 300) + "\n" for nm in (400, 410, 420))
    assert len(silent(written(many)).entries) == 300


def test_empty_cells_are_left_out_and_said(written):
    file = silent(written("nm,A,B\n400,0.1,\n410,n/a,0.5\n420,0.3,0.6\n430,0.4,0.7\n"))
    first, second = file.entries
    assert first.spectrum.wavelengths_nm.tolist() == [400, 420, 430]
    assert second.spectrum.wavelengths_nm.tolist() == [410, 420, 430]
    assert first.details["missing samples"] == "1 of 4"
    assert "samples without a value are left out (all 2 spectra)" in file.notes


def test_a_word_among_the_numbers_rejects_that_spectrum_alone(written):
    file = silent(written("nm,A,B\n400,0.1,0.2\n410,oops,0.5\n420,0.3,0.6\n"))
    assert list(values(file)) == ["B"]
    ((name, reason),) = file.rejected
    assert name == "A" and "line 3: not a number" in str(reason) and "'oops'" in str(reason)


def test_a_word_among_the_wavelengths_is_an_error(refused):
    lines = refused(read, "nm,A\n400,0.1\n410,0.2\nx,0.3\n430,0.4\n")
    assert lines[:2] == ["paints.csv: line 4: not a number", "  found: 'x'"]


def test_readings_of_nothing_a_little_below_zero(written, refused):
    file = silent(written("nm,A\n400,-0.004\n410,0.06\n420,0.07\n"))
    assert only(file).spectrum.samples.tolist() == [0.0, 0.06, 0.07]
    assert only(file).details["negative samples"] == "1 of 3, down to -0.004"
    assert "values a little below zero, readings of nothing, are taken as zero" in file.notes
    assert "negative reflectance" in refused(silent, "nm,A\n400,-0.04\n410,0.06\n420,0.07\n")[0]
    dark = "nm,mW/nm\n400,-4\n410,60\n420,100\n"
    assert only(read(written(dark))).spectrum.samples.tolist() == [0.0, 60.0, 100.0]
    assert "negative emission" in refused(read, dark.replace("-4", "-6"))[0]


def test_truncated_rows_are_refused(refused):
    lines = refused(read, "nm,A,B\n400,0.1,0.2\n410,0.2,0.5\n420,0.3\n")
    assert lines == [
        "paints.csv: line 4: a row is cut short",
        "  found: 2 cells",
        "  expected: 3 cells, as in the header",
        "  try: the file may be truncated; export it again",
    ]
    assert "cut short" in refused(read, ACROSS[:-5])[0]
    assert "too long" in refused(read, ACROSS.replace("0.07\n", "0.07,0.08\n"))[0]


@pytest.mark.parametrize("header", ["Sample name 400 410 420\nRed 0.1 0.2 0.3\n", "400 410 420\n0.1 0.2\n0.3 0.4\n"])
def test_a_spaced_header_of_wavelengths_that_is_longer_than_its_rows_is_refused(refused, header):
    assert "a row is cut short" in refused(silent, header)[0]


def test_mixed_order_of_wavelengths_is_refused(refused):
    assert "wavelengths do not ascend" in refused(silent, DOWN.replace("410", "500"))[0]


def test_a_descending_axis_is_turned_round_and_said(written):
    file = read(written("nm,R\n420,0.07\n410,0.06\n400,0.05\n"))
    assert only(file).spectrum.samples.tolist() == RED
    assert any("descend" in note for note in file.notes)


def test_pairs_of_columns_as_cary_writes_them(written):
    content = (
        "White tile,,Blue paint,\nWavelength (nm),%R,Wavelength (nm),%R\n700,90.5,720,45.5\n699,90.6,719,45.4\n"
        "698,90.7,,\n\nCary 5000\nScan rate (nm/min),600\n"
    )
    file = read(written(content))
    assert list(values(file)) == ["White tile", "Blue paint"]
    assert file.entries[1].spectrum.wavelengths_nm.tolist() == [719, 720]
    assert values(file)["White tile"] == pytest.approx([0.907, 0.906, 0.905])
    assert "2 lines below the table are not read" in file.notes


def test_shimadzu_quotes_and_descends(written):
    entry = only(
        read(written('"RawData - 1"\n"Wavelength nm.","R%"\n700.0,45.1\n699.0,45.2\n698.0,45.3\n', "scan.txt"))
    )
    assert entry.name == "scan" and entry.spectrum.samples.tolist() == pytest.approx([0.453, 0.452, 0.451])


def test_perkin_elmer_lines_above_the_data(written):
    content = "PE UV       SUBTECH     SPECTRUM    ASCII\n-1\nsample.sp\n#HDR\nnm\n%R\n#DATA\n" + "".join(
        f"{nm:.6f}\t{50 + nm / 100:.6f}\n" for nm in range(700, 690, -1)
    )
    entry = only(read(written(content, "sample.asc")))
    assert entry.spectrum.quantity == "reflectance"
    assert entry.spectrum.samples[0] == pytest.approx(0.5691)


def test_avantes_keeps_what_was_made_of_the_counts(written):
    content = (
        "Integration time: 10 ms\nWave   ;Sample   ;Dark     ;Reference;Transmittance\n"
        "[nm]   ;[counts] ;[counts] ;[counts] ;[%]\n\n"
        "400,0;  100,1;  10,0; 200,0; 45,5\n401,0;  100,1;  10,0; 200,0; 45,7\n402,0;  100,1;  10,0; 200,0; 45,8\n"
    )
    file = read(written(content))
    assert values(file) == {"Transmittance": pytest.approx([0.455, 0.457, 0.458])}
    assert "columns beside the measurement are left out: Sample, Dark, Reference" in file.notes


def test_equal_names_stay_apart_and_are_said(written):
    file = silent(written("nm,A,A\n400,0.1,0.2\n410,0.2,0.3\n420,0.3,0.4\n"))
    assert [entry.name for entry in file.entries] == ["A", "A"]
    assert any("share a name" in note for note in file.notes)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"", "the file is empty"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "not a text file"),
        (b"name,price,stock\nRed,high,many\n", "no table of wavelengths and values"),
        (b"# only words\n", "no table of wavelengths and values"),
        (b"nm,A\n400,0.5\n", "not a spectrum"),
        (b"1\n" * 1_000_001, "too many lines"),
        (b"1," * 3_000_000, "a line is too long"),
        (b"nm,R\n" + b"".join(b"%.2f,0.5\n" % (400 + n / 100) for n in range(6000)), "sampled too finely"),
    ],
)
def test_what_is_no_table(refused, content, problem):
    assert problem in refused(silent, content)[0]


def test_spectra_on_one_grid_share_its_wavelengths(written):
    """A chart of thousands must not hold its wavelengths thousands of times."""
    first, second = silent(written(DOWN)).entries
    assert first.spectrum.wavelengths_nm is second.spectrum.wavelengths_nm


def test_fractions_that_can_only_be_percent_are_refused(refused):
    lines = refused(read, "nm,grey: reflectance (0..1)\n400,30\n500,31\n600,45\n")
    assert "reflectance looks like percent" in lines[0] and "45" in lines[1]


@pytest.mark.parametrize("name", ["colorchecker_n_ohta.csv", "colorchecker_n_ohta_transposed.csv"])
def test_real_charts_both_ways_round(shared_data, name):
    path = shared_data / "spectra" / "text" / name
    assert format_of(path).NAME == "table (CSV, TSV)"
    file = read_spectra(path)
    assert list(values(file)) == [str(number) for number in range(1, 25)] and not file.rejected
    assert file.entries[0].spectrum.wavelengths_nm[[0, -1]].tolist() == [380.0, 780.0]
    assert values(file)["1"][0] == 0.048


@pytest.mark.parametrize(
    "name", ["dark-skin", "grey/dark", "dark", "std white", "reference red", "paint/abs-red", "error"]
)
def test_names_of_samples_are_not_taken_for_an_instrument_s_own_columns(written, name):
    file = silent(written(f"nm,{name},light\n400,0.1,0.5\n410,0.2,0.6\n420,0.3,0.7\n"))
    if name == "error":
        assert [entry.name for entry in file.entries] == ["light"] and "left out: error" in " ".join(file.notes)
    else:
        assert [entry.name for entry in file.entries] == [name, "light"] and not file.rejected


@pytest.mark.parametrize("head", ["Reflectance (%)", "Reflectance (0..1)"])
@pytest.mark.parametrize(
    "beside",
    [
        *("note", "flag", "Status", "Quality", "valid", "σ", "Unc. (k=2)", "±", "red ±", "CV", "SNR", "95% CI", "s.e."),
        *("weight", "gain", "Offset", "u(R)", "U (k=2)", "u_R", "thickness (mm)", "averages", "saturated"),
        *("Temperature", "T (°C)", "Temp.", "time", "Time (s)", "exposure time (ms)", "No.", "Difference", "Δ", "ΔR"),
    ],
)  # fmt: skip
def test_numbers_about_rows_are_no_samples(written, head, beside):
    """Between others that are, and not where nothing else is there."""
    percent = 100.0 if "%" in head else 1.0
    rows = [f"{nm},{percent * (0.1 + nm / 1900):.5g},{percent * 0.01},{percent * 0.4}" for nm in range(400, 701, 20)]
    file = read(written("\n".join([head, f"nm,red,{beside},blue", *rows, ""])))
    assert [entry.name for entry in file.entries] == ["red", "blue"] and not file.rejected
    assert any(f"beside the measurement are left out: {beside}" in note for note in file.notes)
    alone = read(
        written("\n".join([head, f"nm,{beside}", *(row.rpartition(",")[0].rpartition(",")[0] for row in rows), ""]))
    )
    assert len(alone.entries) == 1


@pytest.mark.parametrize("place", ["Data measured with spectrometer name: 12U1{}\r\n", "{}Integration time: 9\r\n"])
@pytest.mark.parametrize("count", [1, 50])
def test_fields_filled_up_with_nul_are_text(written, place, count):
    above = "12U1-\r\n" + place.format("\0" * count) + "Wave   ;Transmittance\r\n[nm]   ;[% transmittance]\r\n"
    rows = "".join(f"{nm}.00;{nm / 10:.4f}\r\n" for nm in range(400, 701, 5))
    path = written(above + rows, "glass.ttt")
    entry = only(read_spectra(path))
    assert entry.spectrum.quantity == "transmittance" and entry.spectrum.samples[0] == pytest.approx(0.4)


@pytest.mark.parametrize("count", [1, 40, 3000])
def test_nul_parts_what_stands_before_and_behind_it(written, count):
    rows = [f"{nm}.00;{nm / 10:.4f}\r\n" for nm in range(400, 701, 5)]
    above = f"12U1{chr(0) * count}12U1\r\nWave   ;Transmittance\r\n[nm]   ;[% transmittance]\r\n"
    entry = only(read_spectra(written(above + "".join(rows) + "\0" * count, "glass.ttt")))
    assert entry.spectrum.samples[-1] == pytest.approx(0.7)
    for torn in ("5\x0050.00;55.0000", "550.00;55\x000000", "550.00;5\x005.0000"):
        damaged = [torn + "\r\n" if row.startswith("550") else row for row in rows]
        with pytest.raises(InputError):
            read_spectra(written(above + "".join(damaged), "glass.ttt"))


@pytest.mark.parametrize("between", [",", ";", "\t", " "])
@pytest.mark.parametrize("mark", [".", ","])
@pytest.mark.parametrize("cut", [1, 3, 5])
def test_a_last_number_that_is_cut_short_is_refused(written, between, mark, cut):
    if between == mark:
        return
    rows = [between.join([f"{nm}", f"{nm / 10:.4f}"]) for nm in range(400, 701, 10)]
    text = "\n".join([between.join(["nm", "transmittance%"]), *rows]).replace(".", mark)
    assert only(read(written(text))).spectrum.samples[-1] == pytest.approx(0.7)
    with pytest.raises(InputError, match="cut short"):
        read(written(text[:-cut]))
    # Numbers as short as they can be, and a whole last line, tell nothing.
    assert len(read(written(text[:-cut] + "\n")).entries) == 1


def test_half_a_text_of_nul_is_none(refused):
    assert "not a text file" in refused(read, (DOWN * 9).encode("utf-16-le"))[0]


@pytest.mark.parametrize("columns", [700, 9000])
@pytest.mark.parametrize("suffix", ["dat", "txt", "asc"])
def test_rows_of_any_length_are_recognised_without_being_named(written, columns, suffix):
    rows = [f"{nm}" + ",0.25" * columns for nm in range(400, 701, 50)]
    path = written("\n".join(rows) + "\n", f"wide.{suffix}")
    assert format_of(path).NAME == "table (CSV, TSV)" and not guessed(path)


@pytest.mark.parametrize("name", ["macular_density.csv", "lensDensity.csv", "den_filter.txt", "absorbances.csv"])
def test_densities_by_their_name_are_no_reflectances(written, name):
    with pytest.raises(InputError, match="absorbance is neither"):
        read(written("400,0.1\n410,1.2\n420,2.3\n", name), ImportOptions("reflectance", "fraction"))


@pytest.mark.parametrize("missing", ["", "n/a", "NaN", "-", "#N/A"])
@pytest.mark.parametrize("count", [1, 2, 5])
def test_first_rows_without_a_value_are_rows(written, missing, count):
    """They are no header, and the heading above them is that of the column."""
    rows = "".join(f"{400 + 10 * at},{missing if at < count else 10 + at}\n" for at in range(12))
    (entry,) = read(written("Title\nnm,R (%)\n" + rows, "red.csv")).entries
    assert entry.name == "red" and entry.details["units"] == "%"
    assert entry.spectrum.wavelengths_nm[0] == 400 + 10 * count and len(entry.spectrum.samples) == 12 - count
    assert entry.details["missing samples"] == f"{count} of 12"


@pytest.mark.parametrize("bad", ["***", "OVER", "<0.01", "(0.001)", "#DIV/0!", "1.#INF", "0.07*"])
def test_a_first_value_that_is_no_number_is_refused_as_any_other(refused, bad):
    rows = "".join(f"{nm},{bad if nm == 400 else 20}\n" for nm in range(400, 500, 10))
    assert refused(read, "nm,R (%)\n" + rows)[1] == f"  found: {bad!r}"


def test_a_minus_may_be_the_sign_of_typesetters(written):
    rows = "400,\u22120.1\n" + "".join(f"{nm},20\n" for nm in range(410, 500, 10))
    assert read(written("nm,R (%)\n" + rows)).entries[0].spectrum.samples[0] == 0.0


def test_values_before_their_wavelengths_are_read_where_a_heading_says_so(written):
    rows = "".join(f"{at},{nm},{at + 1}\n" for at, nm in enumerate(range(400, 500, 10), 10))
    file = read(written("red R (%),nm,blue R (%)\n" + rows))
    assert [(entry.name, entry.spectrum.samples[0]) for entry in file.entries] == [("red R", 0.1), ("blue R", 0.11)]
    rows = "".join(f"{at},{nm},{at + 1}\n" for at, nm in enumerate(range(400, 500, 10)))
    assert [entry.name for entry in read(written("pixel,nm,R (%)\n" + rows, "red.csv")).entries] == ["R"]


ABOVE = {
    "Sample,red,red,blue,blue\nMode,SCI,SCE,SCI,SCE\nnm,%R,%R,%R,%R": ("red SCI", "red SCE", "blue SCI", "blue SCE"),
    "nm,red,red,blue,blue\n,SCI,SCE,SCI,SCE": ("red SCI", "red SCE", "blue SCI", "blue SCE"),
    ",SCI,SCE,SCI,SCE\nnm,red (%R),red (%R),blue (%R),blue (%R)": ("SCI red", "SCE red", "SCI blue", "SCE blue"),
    ",SCI,,SCE,\nnm,red (%R),blue (%R),red (%R),blue (%R)": ("SCI red", "SCI blue", "SCE red", "SCE blue"),
    ",red,,blue,\nnm,R SCI (%),R SCE (%),R SCI (%),R SCE (%)": ("red R SCI", "red R SCE", "blue R SCI", "blue R SCE"),
    "Mode,SCI,SCE,SCI,SCE\nnm,a (%R),b (%R),c (%R),d (%R)": ("a", "b", "c", "d"),
}


@pytest.mark.parametrize("head", ABOVE)
def test_rows_above_a_header_are_about_the_columns_below(written, head):
    rows = "".join(f"{nm},{10 + nm / 100},20.0,30.0,40.0\n" for nm in range(400, 701, 20))
    entries = read(written(f"{head}\n{rows}"), ImportOptions("reflectance", "percent")).entries
    assert tuple(entry.name for entry in entries) == ABOVE[head]
    assert [entry.spectrum.samples[0] for entry in entries] == [0.14, 0.2, 0.3, 0.4]
    told = [Measurement.of("reflectance", entry.details, entry.name) for entry in entries]
    unlike = (1, 2) if ",SCI,," in head else (0, 1)
    assert "specular component" in told[unlike[0]].differing(told[unlike[1]])


def test_colours_of_each_spectrum_below_its_name_are_no_wavelengths(written):
    head = "nm,a,b,c\nL*,49.6,44.1,40.5\na*,46.0,31.0,20.0\nb*,31.0,20.0,12.0\n"
    rows = "".join(f"{nm},0.{nm},0.2,0.3\n" for nm in range(400, 701, 20))
    entries = read(written(head + rows), ImportOptions("reflectance", "fraction")).entries
    assert [entry.name for entry in entries] == ["a", "b", "c"]
    assert entries[0].spectrum.wavelengths_nm[0] == 400.0 and entries[0].stated[0].values.tolist() == [49.6, 46.0, 31.0]


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_more_headings_than_columns_are_refused(written, separator):
    lines = [["nm", "Blue", "matt", "Red", "matt"], *([str(nm), "0.2", "0.4"] for nm in range(400, 701, 20))]
    with pytest.raises(InputError, match="more headings than columns") as refused:
        silent(written("\n".join(map(separator.join, lines)) + "\n"))
    assert "5 headings above rows of 3 cells" in refused.value.found


def test_a_heading_with_the_separator_above_one_column_is_of_it(written):
    lines = [["nm", "Reflectance", "fraction"], *([str(nm), "0.2"] for nm in range(400, 701, 20))]
    assert set(only(read(written("\n".join(map(",".join, lines)) + "\n"))).spectrum.samples) == {0.2}
