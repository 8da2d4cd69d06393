"""Spectral power in two columns, and glazing files."""

import pytest
from metamer.spectral.formats.registry import format_of, read_spectra
from metamer.spectral.formats.spd import read
from small_files import GLAZING


def test_two_columns_are_power(written):
    path = written("# a lamp\n400 1.5\n410 250\n420 3e2\n", "lamp.spd")
    assert format_of(path).NAME == "SPD"
    file = read_spectra(path)
    (entry,) = file.entries
    assert entry.name == "lamp" and entry.spectrum.quantity == "emission"
    assert entry.spectrum.samples.tolist() == [1.5, 250.0, 300.0]
    said = "emission, by the suffix .spd and the file name 'lamp' and values up to 300"
    assert entry.taken == f"{said}, above any percentage"


@pytest.mark.parametrize("values", [(0.3, 0.5, 0.8), (30, 50, 80), (1e-6, 2e-6, 3e-6)])
def test_the_suffix_alone_is_no_word(refused, values):
    """Reflectances, and what glass lets through, are called so as well."""
    said = refused(
        read, "".join(f"{nm} {value}\n" for nm, value in zip((400, 500, 600), values, strict=True)), "dark skin.spd"
    )
    assert said[0] == "dark skin.spd: dark skin: what was measured?" and "the suffix .spd" in said[1]


def test_words_in_the_file_make_it_a_reflectance(written):
    (entry,) = read(written("# reflectance of a paint\n400 0.5\n410 0.6\n", "paint.spd")).entries
    assert entry.spectrum.quantity == "reflectance"


@pytest.mark.parametrize("name", ["metal-Cu-eta.spd", "Au.eta.spd", "Au.k.spd"])
def test_a_refractive_index_by_the_name_that_renderers_give_it(refused, name):
    lines = refused(read, "400 1.5\n410 1.6\n420 1.7\n", name)
    assert "a refractive index is not the spectrum of a colour" in lines[0]


def test_a_glazing_has_three_spectra_in_micrometres(written):
    path = written(GLAZING, "clear.txt")
    assert format_of(path).NAME == "SPD"
    entries = read(path).entries
    assert [entry.name for entry in entries] == ["Clear T", "Clear R front", "Clear R back"]
    assert [entry.spectrum.quantity for entry in entries] == ["transmittance", "reflectance", "reflectance"]
    assert entries[0].spectrum.wavelengths_nm.tolist() == pytest.approx([400, 405, 410])
    assert entries[0].spectrum.samples.tolist() == [0.80, 0.81, 0.82]


def test_a_picture_of_that_name(refused):
    assert "not a text file" in refused(read, b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "lamp.spd")[0]
