"""Wavelengths across a header, with words beside them: the quantity, its unit, and which of several spectra it is."""

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.formats.csv import read
from metamer.spectral.formats.tables.dialect import words_beside
from metamer.spectral.measurement import Measurement

NM = np.arange(400, 701, 20)
RED = np.round(0.062 + 0.57 / (1.0 + np.exp(-(NM - 583.0) / 13.0)), 4)


def sheet(*headings, values=None, first=("Name",), above="", turns=False):
    """A row of each sample: `headings` with their wavelengths, one behind the other or in turns."""
    values = values or {"red": RED, "dark": 0.5 * RED}
    places = [(head, nm) for head in headings for nm in NM]
    if turns:
        places.sort(key=lambda place: place[1])
    head = [*first, *(head.replace("?", str(nm)) for head, nm in places)]
    rows = [head]
    for name, of_name in values.items():
        share = {head: 1.0 - 0.3 * at for at, head in enumerate(headings)}
        numbers = (share[head] * of_name[np.flatnonzero(nm == NM)[0]] for head, nm in places)
        rows.append([name, *first[1:], *(f"{number:.6f}" for number in numbers)])
    return above + "\n".join(",".join(row) for row in rows) + "\n"


def found(path):
    return {e.name: (e.spectrum.quantity, e.spectrum.samples.tolist()) for e in read(path).entries}


@pytest.mark.parametrize(
    ("heading", "quantity", "percent"),
    [
        ("Reflectance ?", "reflectance", False),
        ("refl_?nm", "reflectance", False),
        ("R?", "reflectance", False),
        ("R(?)", "reflectance", False),
        ("R[? nm]", "reflectance", False),
        ("R@? nm", "reflectance", False),
        ("T?", "transmittance", False),
        ("Transmittance ? nm", "transmittance", False),
        ("Radiance_?", "emission", False),
        ("? nm [W/m2/nm]", "emission", False),
        ("%R ?", "reflectance", True),
        ("?nm %R", "reflectance", True),
        ("Reflectance ?nm [%]", "reflectance", True),
        ("Reflectance (%) ?nm", "reflectance", True),
        ("R(? nm) [%]", "reflectance", True),
        ("Remission ? nm [%]", "reflectance", True),
        ("Transmission ?nm (%)", "transmittance", True),
    ],
)
def test_words_beside_wavelengths_say_what_was_measured(written, heading, quantity, percent):
    factor = 100.0 if percent else 1.0
    read_ones = found(written(sheet(heading, values={"red": factor * RED, "dark": 0.5 * factor * RED})))
    assert list(read_ones) == ["red", "dark"]
    assert read_ones["red"][0] == quantity
    np.testing.assert_allclose(read_ones["red"][1], RED, atol=1e-6)


@pytest.mark.parametrize("heading", ["?", "?nm", "? [nm]", "nm?", "Spectral Data ?[nm]", "? (%)"])
def test_wavelengths_alone_do_not_say_what_was_measured(written, heading):
    with pytest.raises(InputError, match="what was measured"):
        read(written(sheet(heading)))


@pytest.mark.parametrize("turns", [False, True], ids=["behind each other", "in turns"])
@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("SCI ?nm", "SCE ?nm"),
        ("? nm SCI", "? nm SCE"),
        ("M0_?nm R", "M1_?nm R"),
        ("Standard ? nm (%R)", "Sample ? nm (%R)"),
        ("R15 ?nm %R", "R45 ?nm %R"),
        ("White ?nm refl", "Black ?nm refl"),
        ("M0 R?nm", "M2 R?nm"),
        ("45as-15 R?nm", "45as15 R?nm"),
    ],
)
def test_each_of_several_spectra_a_row_is_read(written, one, other, turns):
    factor = 100.0 if "%" in one else 1.0
    values = {"red": factor * RED, "dark": 0.5 * factor * RED}
    read_ones = found(written(sheet(one, other, turns=turns, values=values)))
    names = [words_beside(head.replace("?", "400")) for head in (one, other)]
    assert list(read_ones) == [f"{name} {words}" for name in ("red", "dark") for words in names]
    for (_, samples), share in zip(read_ones.values(), (1.0, 0.7, 0.5, 0.35), strict=True):
        np.testing.assert_allclose(samples, share * RED, atol=1e-6)


def test_several_spectra_a_row_measure_what_their_own_words_say(written):
    read_ones = found(written(sheet("R?", "T?")))
    assert [(name, quantity) for name, (quantity, _) in read_ones.items()] == [
        ("red R", "reflectance"), ("red T", "transmittance"), ("dark R", "reflectance"), ("dark T", "transmittance"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("headings", "part"),
    [(("SCI ?nm", "SCE ?nm"), "specular component"), (("M0 R ?nm", "M1 R ?nm"), "measurement condition")],
)
def test_a_condition_beside_wavelengths_goes_with_the_reading(written, headings, part):
    one, other = (Measurement.of("reflectance", e.details, e.name) for e in read(written(sheet(*headings))).entries[:2])
    assert any(part in unlike for unlike in one.differing(other)), list(one.differing(other))


def test_what_stands_above_tells_spectra_apart(written):
    above = ",".join(["", "before", *[""] * (len(NM) - 1), "after"]) + "\n"
    read_ones = found(written(sheet("R? nm", "R?  nm", above=above)))
    assert list(read_ones) == ["red before R", "red after R", "dark before R", "dark after R"]


@pytest.mark.parametrize("headings", [("?nm", "?nm"), ("R?", "R? nm"), ("?", "?")])
def test_spectra_that_nothing_tells_apart_are_asked_about(written, headings):
    with pytest.raises(InputError, match="2 spectra in a row, and no words that tell them apart"):
        read(written(sheet(*headings, above="reflectance\n")))


def test_a_few_readings_beside_a_spectrum_are_none(written):
    text = sheet("R? nm").splitlines()
    text = [text[0] + ",Density 450nm,Density 530nm,Density 620nm", *(row + ",1.2,1.1,0.9" for row in text[1:])]
    read_ones = found(written("\n".join(text) + "\n"))
    assert list(read_ones) == ["red", "dark"]
    np.testing.assert_allclose(read_ones["dark"][1], 0.5 * RED, atol=1e-6)


@pytest.mark.parametrize("cells", [len(NM), 0], ids=["empty cells", "no cells"])
def test_a_spectrum_that_is_missing_in_a_row_is_left_out_of_it(written, cells):
    rows = [row.split(",") for row in sheet("SCI ?nm", "SCE ?nm").splitlines()]
    rows[1][1 + len(NM) :] = [""] * cells
    assert list(found(written("\n".join(map(",".join, rows)) + "\n"))) == ["red SCI", "dark SCI", "dark SCE"]


def test_wavelengths_across_that_are_in_no_spectrum_are_refused(written):
    shuffled = [*NM[::2], *NM[1::2]]
    extra = [f"Coated {nm}nm" for pair in zip(shuffled[::-1], shuffled, strict=True) for nm in pair]
    text = sheet("Bare ?nm").splitlines()
    text = [",".join([text[0], *extra]), *(",".join([row, *["0.5"] * len(extra)]) for row in text[1:])]
    with pytest.raises(InputError, match="another order") as refused:
        read(written("\n".join(text) + "\n"))
    assert "Coated" in refused.value.found


@pytest.mark.parametrize("heading", ["Angle", "Reading", "Geometry", "Channel", "Mode"])
def test_rows_below_a_name_are_further_readings_of_it(written, heading):
    cells = {"Angle": "{}", "Reading": "{}", "Geometry": "45as{}", "Channel": "{}°", "Mode": "SCI"}[heading]
    rows = [",".join(["Name", heading, *(f"R {nm}nm" for nm in NM)])]
    for name in ("red", "dark"):
        for at, angle in enumerate((15, 45, 110)):
            rows.append(",".join(["" if at else name, cells.format(angle), *(f"{value:.4f}" for value in RED)]))
    file = read(written("\n".join(rows) + "\n"))
    assert [entry.details[heading] for entry in file.entries] == [cells.format(at) for at in (15, 45, 110)] * 2
    assert [entry.details.get("name", entry.name).split(" (")[0] for entry in file.entries] == ["red"] * 3 + [
        "dark"
    ] * 3
    assert any("4 rows without a name" in note for note in file.notes)


@pytest.mark.parametrize(("heading", "one", "other"), [("Code", "B1", "B2"), ("Type", "Standard", "Batch")])
def test_a_row_without_a_name_that_has_another_word_is_called_so(written, heading, one, other):
    rows = [",".join(["Name", heading, *(f"R {nm}nm" for nm in NM)])]
    rows += [",".join([name, code, *(f"{value:.4f}" for value in RED)]) for name, code in (("red", one), ("", other))]
    assert [entry.name for entry in read(written("\n".join(rows) + "\n")).entries] == ["red", other]


def test_a_row_that_ends_within_a_spectrum_is_refused(written):
    rows = [row.split(",") for row in sheet("SCI ?nm", "SCE ?nm").splitlines()]
    del rows[1][-3:]
    with pytest.raises(InputError, match="cut short"):
        read(written("\n".join(map(",".join, rows)) + "\n"))


SCATTER = [
    "Std Dev", "Standard deviation", "SD", "Variance", "Uncertainty (k=2)", "σ", "CV", "Difference", "ΔR", "red ± 2σ",
    "Standardabweichung", "Écart-type", "Desv. est.", "Deviazione standard", "weights",
]  # fmt: skip


def test_differences_of_colour_beside_a_row_say_nothing_of_it(written):
    """Db* is the difference in b*, and no decibel."""
    heads = ",".join(["Name", "DL*", "Da*", "Db*", *(f"R{nm}" for nm in NM)])
    (entry,) = read(written("\n".join([heads, ",".join(["red", "0.1", "0.2", "0.3", *map(str, RED)])]))).entries
    np.testing.assert_allclose(entry.spectrum.samples, RED)


@pytest.mark.parametrize("name", SCATTER)
def test_rows_of_scatter_are_no_samples(written, name):
    rows = {"red": RED, "dark": 0.5 * RED, "Mean": 0.75 * RED, name: 0.01 * RED}
    file = read(written(sheet("R? [0..1]", values=rows)))
    assert [entry.name for entry in file.entries] == ["red", "dark", "Mean"]
    assert any(name in note for note in file.notes)


@pytest.mark.parametrize("name", ["Std", "STD", "blue std", "Paper unc", "std white", "Standard", "Mean", "red 2"])
def test_standards_and_means_are_samples(written, name):
    file = read(written(sheet("R? [0..1]", values={name: RED, "dark": 0.5 * RED})))
    assert [entry.name for entry in file.entries] == [name, "dark"]
    file = read(written(sheet("R? [0..1]", values={name: RED})))
    assert [entry.name for entry in file.entries] == [name]
