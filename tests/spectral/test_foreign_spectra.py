"""Spectra of other libraries and of plain Python are taken as they are, and nothing else is taken for one."""

from types import SimpleNamespace

import metamer
import numpy as np
import pytest
from metamer.spectral.colour_library import colour_science
from metamer.spectral.foreign_spectra import foreign_curves
from metamer.spectral.spectrum import Spectrum

colour = colour_science()
NM = np.arange(400.0, 701.0, 20.0)
GREEN, RED = np.linspace(0.2, 0.3, NM.size), np.linspace(0.1, 0.6, NM.size)
NAMED = colour.SpectralDistribution(dict(zip(NM, GREEN, strict=True)), name="green")
TWO = colour.MultiSpectralDistributions(
    dict(zip(NM, np.column_stack([GREEN, RED]), strict=True)), labels=["green", "red"]
)


@pytest.mark.parametrize(
    "value",
    [
        NAMED,
        (NM, GREEN),
        (NM[::-1], GREEN[::-1]),
        (list(NM), list(GREEN)),
        dict(zip(NM, GREEN, strict=True)),
        dict(zip(map(str, NM[::-1]), GREEN[::-1], strict=True)),
        SimpleNamespace(index=list(NM), to_numpy=lambda: GREEN, name="green"),
        Spectrum.sampled(NM, GREEN),
    ],
    ids=["colour", "arrays", "descending", "lists", "dict", "dict-of-words", "series", "own"],
)
def test_one_spectrum_is_the_same_whoever_holds_it(value):
    found = Spectrum.of(value)
    np.testing.assert_array_equal(found.wavelengths_nm, NM)
    np.testing.assert_array_equal(found.samples, GREEN)
    assert found.quantity == "reflectance" and Spectrum.of((NM, GREEN), "emission").quantity == "emission"


@pytest.mark.parametrize(
    "value",
    [TWO, SimpleNamespace(index=list(NM), columns=["green", "red"], to_numpy=lambda: np.column_stack([GREEN, RED]))],
    ids=["colour", "frame"],
)
def test_several_spectra_keep_their_names(value):
    names, nm, values = zip(*foreign_curves(value), strict=True)
    assert names == ("green", "red")
    np.testing.assert_array_equal(values, [GREEN, RED])
    assert all((one == NM).all() for one in nm)
    with pytest.raises(metamer.MetamerError, match="2 spectra"):
        Spectrum.of(value)


@pytest.mark.parametrize(
    "value",
    [3, "0.2", None, [NM, GREEN], (NM, GREEN[1:]), (NAMED, NAMED), ("a.csv", "b.csv"), (NM,), {}, {"a": "b"}],
    ids=repr,
)
def test_nothing_else_is_a_spectrum(value):
    assert foreign_curves(value) is None
    with pytest.raises(metamer.MetamerError, match=r"no spectrum(.|\n)*\(wavelengths_nm, values\)"):
        Spectrum.of(value)


def test_percents_and_repeated_wavelengths_are_refused():
    with pytest.raises(metamer.MetamerError, match="percent"):
        Spectrum.of((NM, 100.0 * GREEN))
    with pytest.raises(metamer.MetamerError):
        Spectrum.of(([400.0, 400.0], [0.1, 0.2]))


def test_samples_of_a_script_are_matched_by_their_names():
    darker = Spectrum.sampled(NM, 0.9 * GREEN)
    grey = colour.SpectralDistribution(dict(zip(NM, 0.0 * NM + 0.25, strict=True)), name="grey")
    found = metamer.match(grey, [(NM, 1.1 * GREEN), TWO, darker], "dE00 3")
    assert found.standard.name == "grey"
    assert [one.sample.name for one in found.samples] == ["sample 1", "green", "red", "sample 3"]
    alone = metamer.match(grey, darker).samples
    assert [one.sample.name for one in alone] == ["sample 1"]
    np.testing.assert_array_equal(alone[0].differences[0].sample_lab, found.samples[3].differences[0].sample_lab)
    with pytest.raises(metamer.MetamerError, match="'green', 'red'"):
        metamer.match(TWO, darker)
    with pytest.raises(metamer.MetamerError, match="sample 2"):
        metamer.match(grey, [darker, 3])


def test_a_standard_is_taken_out_of_the_table_that_holds_it():
    frame = pytest.importorskip("pandas").DataFrame({"master": GREEN, "lot": 0.9 * GREEN}, index=NM)
    found = metamer.match(frame["master"], frame)
    assert [one.sample.name for one in found.samples] == ["lot"]
    assert "The table of samples holds the standard, master, too: it is not among the samples." in found.notes
    # Numbers under another name, and one sample alone, are a mistake.
    for samples in (frame.rename(columns={"master": "copy"}), frame["master"]):
        with pytest.raises(metamer.MetamerError, match="to the last digit"):
            metamer.match(frame["master"], samples)


@pytest.mark.parametrize("spelt", ["CIE 2000", "cie2000", "ciede2000", "dE00", "ΔE 2000", "delta e 2000"])
def test_a_formula_is_spelt_as_people_do(spelt):
    lab = np.array([50.0, 20.0, 10.0]), np.array([53.0, 20.0, 12.0])
    assert metamer.delta_e(*lab, spelt) == pytest.approx(float(colour.delta_E(*lab, method="CIE 2000")), abs=1e-9)
    assert metamer.delta_e(*lab, "CMC(2:1)") == pytest.approx(
        float(colour.delta_E(*lab, method="CMC", l=2, c=1)), abs=1e-9
    )
    with pytest.raises(metamer.MetamerError, match="match"):
        metamer.delta_e(*lab, "CAM16-UCS")
