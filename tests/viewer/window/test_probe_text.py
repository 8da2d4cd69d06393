"""Probes for others: as text, as tables, and as CxF3 that other programs read."""

import csv

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.formats.registry import read_spectra
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.viewer.window.displayed_value import Displayed
from metamer.viewer.window.probe import ORIGINAL, ProbeReading, ProbeSpectra
from metamer.viewer.window.probe_text import copied, write_colours, write_probes_cxf, write_spectra

NM = np.arange(380.0, 781.0, 10.0)
FACTOR = 0.2 + 0.6 * (NM - 380.0) / 400.0
EYE = observer("1964_10")


def reading(light="D65", factor=FACTOR, lit=1.0):
    xyz = lit * EYE.weights(illuminant(light), NM) @ np.nan_to_num(factor)
    power = lit * np.interp(NM, illuminant(light).wavelengths_nm, illuminant(light).samples) / 100.0
    spectra = ProbeSpectra(NM, power, power * np.nan_to_num(factor), factor, ORIGINAL)
    white = EYE.white(illuminant(light))
    return ProbeReading((3, 7), ("body",), ("paint/red",), 1.0, light, EYE.name, xyz, white, spectra)


NOTHING = ProbeReading((0, 0), (), (), 0.0, "D65", EYE.name, np.zeros(3), EYE.white(illuminant("D65")))
SHOWN = Displayed(np.array([1.2, 0.5, -0.1]), (255, 128, 0), "R above, B below")


def rows_of(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_text_to_paste_has_every_number_by_its_name():
    said = dict(line.split("\t") for line in copied("nose", reading(), SHOWN).splitlines())
    assert said["probe"] == "nose" and said["material"] == "paint/red" and said["displayed"] == "255, 128, 0"
    assert float(said["L*"]) == pytest.approx(reading().lab[0], abs=1e-4)
    assert float(said["h_ab"]) == pytest.approx(reading().lch[2], abs=1e-4)
    assert said["clipped"] == "R above, B below"
    black = dict(line.split("\t") for line in copied("sky", NOTHING).splitlines())
    assert black["x"] == "" and black["part"] == "none" and "displayed" not in black


def test_colours_come_back_from_their_table_exactly(tmp_path):
    write_colours(tmp_path / "p.csv", [("nose, left", reading(), SHOWN), ("sky", NOTHING, None)])
    first, second = rows_of(tmp_path / "p.csv")
    assert first["probe"] == "nose, left" and [first[key] for key in "RGB"] == ["255", "128", "0"]
    assert [float(first[key]) for key in "XYZ"] == reading().xyz.tolist()
    assert second["x"] == "" and second["R"] == "" and float(second["Y"]) == 0.0


def test_spectra_come_back_from_their_table_exactly(tmp_path):
    factor = np.where(NM < 400.0, np.nan, FACTOR)
    write_spectra(tmp_path / "s.csv", [("a", reading(factor=factor), None), ("sky", NOTHING, None)])
    rows = rows_of(tmp_path / "s.csv")
    assert len(rows) == len(NM) and rows[0]["reflectance"] == "" and rows[0]["probe"] == "a"
    assert [float(row["reflectance"]) for row in rows[2:]] == FACTOR[2:].tolist()
    assert [float(row["wavelength_nm"]) for row in rows] == NM.tolist()


def test_cxf_is_read_back_exactly_and_says_the_picture_s_colour_beside(tmp_path):
    write_probes_cxf(tmp_path / "p.cxf", [("nose", reading(), SHOWN), ("sky", NOTHING, None)])
    (entry,) = read_spectra(tmp_path / "p.cxf").entries
    assert entry.name == "nose"
    np.testing.assert_array_equal(entry.spectrum.samples, FACTOR)
    # None is stated: a program would take it for that of the reflectance.
    assert entry.stated == ()
    said = [float(value) for value in entry.details["tag details: XYZ in the picture"].split()]
    np.testing.assert_allclose(said, reading().xyz, rtol=1e-5)


@pytest.mark.parametrize("write", [write_colours, write_spectra, write_probes_cxf])
def test_nothing_probed_is_refused_and_nothing_is_written(tmp_path, write):
    with pytest.raises(InputError, match="nothing to write"):
        write(tmp_path / "p", [])
    if write is not write_colours:
        with pytest.raises(InputError, match=r"no spectra|no reflectance"):
            write(tmp_path / "p", [("sky", NOTHING, None)])
    assert list(tmp_path.iterdir()) == []
