"""Several tables in one text file: each is what its own header and title say."""

import numpy as np
import pytest
from metamer.spectral.formats.csv import read
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.registry import read_spectra

NM = (400, 410, 420, 430, 440)


def down(header, values=(0.1, 0.2, 0.3, 0.4, 0.5), nm=NM, mark=","):
    return header + "".join(f"{at}{mark}{value}\n" for at, value in zip(nm, values, strict=True))


def across(header, name, values=(0.1, 0.2, 0.3, 0.4, 0.5)):
    return f"{header}\n{name},{','.join(map(str, values))}\n"


def silent(path):
    """Read tables that say nothing of what was measured."""
    return read(path, ImportOptions("reflectance", "fraction"))


def said(file):
    """Name, quantity, first wavelength and first value of each spectrum."""
    return [
        (e.name, e.spectrum.quantity, e.spectrum.wavelengths_nm[0], round(float(e.spectrum.samples[0]), 9))
        for e in file.entries
    ]


def test_a_second_header_says_what_the_second_table_is(written):
    file = read(written(down("Wavelength,Reflectance\n") + "\n" + down("Wavelength,Transmittance\n"), "leaf.csv"))
    assert said(file) == [("leaf", "reflectance", 400, 0.1), ("leaf (2)", "transmittance", 400, 0.1)]
    assert not file.notes


def test_a_second_header_has_its_own_unit(written):
    percent = down("nm,R (%)\n", (10, 20, 30, 40, 50))
    file = read(written(percent + "\n" + down("nm,R (0-1)\n"), "grey.csv"))
    assert [values for *_, values in said(file)] == [0.1, 0.1]
    assert [entry.details["units"] for entry in file.entries] == ["%", "0-1"]
    # Without a unit of its own, the values of the second table alone say on which scale they are.
    file = read(written(down("nm,R\n", (10, 20, 30, 40, 50)) + "\n" + down("nm,Refl\n"), "grey.csv"))
    assert [values for *_, values in said(file)] == [0.1, 0.1]


@pytest.mark.parametrize("mark", ["\t", ",", " "])
def test_titles_above_the_tables_are_their_names(written, mark):
    header = f"nm{mark}%R\n"
    first, second = (down(header, (10, 20, 30, 40, n), mark=mark) for n in (50, 60))
    file = read(written(f"Sample A\n{first}\nSample B\n{second}", "two.txt"))
    if mark == " ":
        assert len(file.entries) == 2  # "Sample" and "A" are two cells there
    else:
        assert [entry.name for entry in file.entries] == ["Sample A", "Sample B"]
        assert [entry.spectrum.samples[-1] for entry in file.entries] == [0.5, 0.6]


def test_lines_above_all_tables_are_no_names(written):
    file = read(written("My laboratory\n\n" + "".join(f"Sample {n}\n" + down("nm,%R\n", (9,) * 5) for n in "AB")))
    assert [entry.name for entry in file.entries] == ["Sample A", "Sample B"]
    file = read(written(("Exported by me\n" + down("nm,%R\n", (9,) * 5)) * 2, "two.csv"))
    assert [entry.name for entry in file.entries] == ["two", "two (2)"]
    keys = "Sample,{}\nMode,{}\nnm,Value\n"
    file = read(written(down(keys.format("A", "Reflectance")) + "\n" + down(keys.format("B", "Transmittance"))))
    assert said(file) == [("A", "reflectance", 400, 0.1), ("B", "transmittance", 400, 0.1)]


def test_a_title_alone_keeps_the_columns_of_the_table_before(written, refused):
    file = read(written(down("nm,Reflectance\n") + "\nTransmittance\n" + down(""), "leaf.csv"))
    assert [quantity for _, quantity, *_ in said(file)] == ["reflectance", "transmittance"]
    file = read(written(down("nm,Reflectance\n") + "\nSample B\n" + down(""), "leaf.csv"))
    assert said(file)[1] == ("Sample B", "reflectance", 400, 0.1)
    assert "further down, numbers without a header are read under the one above them in the file" in file.notes
    wider = "".join(f"{nm},0.1,0.2\n" for nm in NM)
    lines = refused(read, down("nm,Reflectance\n") + "\nSample B\n" + wider)
    assert lines[0] == "paints.csv: line 9: another table without a header"
    lines = refused(read, "nm,A,B\n" + wider + "Probe,1,2\n" + wider)
    assert lines[0] == "paints.csv: line 8: another table without a header"


def test_comments_part_tables_too(written):
    file = read(written("# nm R\n" + down("", mark=" ") + "# nm T\n" + down("", mark=" "), "leaf.dat"))
    assert [quantity for _, quantity, *_ in said(file)] == ["reflectance", "transmittance"]


def test_what_the_first_lines_alone_say_holds_on_with_a_note(written):
    file = read(written("Transmittance of filters\n" + down("nm,A\n") + "\n" + down("nm,B\n")))
    assert [quantity for _, quantity, *_ in said(file)] == ["transmittance"] * 2
    assert "the file begins with a line about transmittance; so it is taken to be further down" in file.notes


def test_colours_above_each_table_stay_with_it(written):
    lab = "L*(D65/10°),{}\na*(D65/10°),1\nb*(D65/10°),2\n"
    file = read(written("".join("nm,R\n" + lab.format(lightness) + down("") for lightness in (30, 60))))
    assert [entry.stated[0].values[0] for entry in file.entries] == [30, 60]


HEAD_A, HEAD_B = "Name,400 nm,410 nm,420 nm,430 nm,440 nm", "Name,405 nm,415 nm,425 nm,435 nm,445 nm"


@pytest.mark.parametrize("unit", [" nm", ""])
@pytest.mark.parametrize("title", ["", "Irradiance (W/m2/nm)\n"])
def test_a_second_header_of_wavelengths(written, unit, title):
    content = title + across(HEAD_A, "A") + "\n" + across(HEAD_B, "B")
    file = (read if title else silent)(written(content.replace(" nm", unit)))
    quantity = "emission" if title else "reflectance"
    assert said(file) == [("A", quantity, 400, 0.1), ("B", quantity, 405, 0.1)]
    assert not any("below the header" in note for note in file.notes)


def test_a_second_header_of_fewer_wavelengths(written):
    file = silent(written(across(HEAD_A, "A") + across("Name,405nm,415nm,425nm", "B", (0.1, 0.2, 0.3))))
    assert [entry.spectrum.wavelengths_nm.size for entry in file.entries] == [5, 3]


def test_titles_above_tables_across(written):
    head = HEAD_A.replace(" nm", "")
    first, second = ("Name" + head[4:].replace(",", f",{letter}") for letter in "RT")
    file = read(written("Reflectance\n" + across(first, "A") + "\nTransmittance\n" + across(second, "B")))
    assert [quantity for _, quantity, *_ in said(file)] == ["reflectance", "transmittance"]


def test_a_header_that_is_repeated_goes_on(written):
    file = silent(written(across(HEAD_A, "A") + across(HEAD_A, "A")))
    assert [entry.name for entry in file.entries] == ["A", "A"]


def test_a_row_that_could_be_a_spectrum_or_wavelengths_is_refused(refused):
    rows = "Irradiance (W/m2/nm)\n" + across(HEAD_A, "A") + "B,405,415,425,435,445\n"
    lines = refused(read, rows)
    assert lines[0] == "paints.csv: line 4: a spectrum, or the wavelengths of another table?"


def test_an_ascending_spectrum_is_no_header(written):
    file = read(written("Irradiance\n" + across(HEAD_A, "lamp", (400, 411, 420, 437, 501))))
    assert said(file) == [("lamp", "emission", 400, 400.0)]


def test_wavelengths_across_below_wavelengths_down(written):
    file = read_spectra(written(down("nm,R\n") + "\nTransmittance\n" + across(HEAD_B, "B"), "both.csv"))
    assert said(file) == [("both", "reflectance", 400, 0.1), ("B", "transmittance", 405, 0.1)]


def test_each_of_many_tables_is_read_by_its_own_header(written):
    file = silent(written("".join(down(f"nm,T{number}\n") for number in range(300))))
    assert [entry.name for entry in file.entries] == [f"T{number}" for number in range(300)]


def test_wavelengths_that_start_again_are_another_spectrum(written):
    content = "380\t0.1\n384\t0.2\n388\t0.2\n\n380\t0.2\n384\t0.4\n388\t0.4\n"
    found = {entry.name: entry.spectrum.samples.tolist() for entry in silent(written(content, "two.txt")).entries}
    assert found == {"two": [0.1, 0.2, 0.2], "two (2)": [0.2, 0.4, 0.4]}


KEYS = (
    *("Sample: {}", "Sample Name: {}", "Sample Name:\t{}", "Sample name = {}", "Sample,{}", "Sample Name;{}"),
    *("SAMPLE\t{}", "Probe: {}", "Name: {}", "# Sample: {}", "Sample ID: {}", "Sample : {}", "Measurement: {}"),
    *('"Sample Name:","{}"', "Sample: {}\nOperator: me\nDate: 3.4.2024", "Title: {}"),
)
HEADERS = (
    ("", " "),
    ("nm R\n", " "),
    ("nm\tR%\n", "\t"),
    ("Wavelength,Reflectance (%)\n", ","),
    (">>>>>Begin Spectral Data<<<<<\n", " "),
)


@pytest.mark.parametrize(("header", "between"), HEADERS)
@pytest.mark.parametrize("key", KEYS)
def test_blocks_are_called_as_the_line_above_them_says(written, key, header, between):
    """Three decimals in all of them part no thousands, whatever number a sample is called by."""
    blocks = [
        key.format(name)
        + "\n"
        + header
        + "".join(f"{nm}{between}{7.0 * share + nm / 1e4:.3f}\n" for nm in range(400, 701, 20))
        for name, share in (("Rosso", 4.0), ("Bruno 3", 1.0), ("17", 0.5))
    ]
    file = read_spectra(written("Instrument: X\nUnits: Reflectance %\n" + "\n".join(blocks), "m.txt"))
    names = [entry.name for entry in file.entries]
    assert [word in name for word, name in zip(("Rosso", "Bruno 3", "17"), names, strict=True)] == [True] * 3, names
    np.testing.assert_allclose(
        [entry.spectrum.samples[0] for entry in file.entries], [0.2804, 0.0704, 0.0354], atol=1e-4
    )


def test_a_sample_that_was_read_twice_keeps_its_name(written):
    block = "Sample: Rosso\nnm\tR%\n400\t7.0\n410\t8.5\n"
    file = read_spectra(written(block * 2 + block.replace("Rosso", "Blu"), "m.txt"))
    assert [entry.name for entry in file.entries] == ["Rosso", "Rosso (2)", "Blu"]
