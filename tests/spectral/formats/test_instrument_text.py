"""Reports of light meters and spectrometers."""

import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.instrument_text import read, recognises
from metamer.spectral.formats.registry import format_of, read_spectra
from small_files import METER

SEKONIC = (
    "Date Saved,15/03/2021\nTitle,stage left\n\nMeasuring Mode,Ambient\nViewing Angle [°],10\nTcp [K],3262\n"
    "Tristimulus Value X,32.1\nTristimulus Value Y,30.5\nTristimulus Value Z,15.2\nCRI R1,87\nCRI R2,94\nTLMF,---\n\n"
    + "".join(f"Spectral Data {nm}[nm],{nm / 1e6:.8f}\n" for nm in range(380, 401, 5))
    + "\n"
    + "".join(f"Spectral Data {nm}[nm],{nm / 1e6:.8f}\n" for nm in range(380, 401))
    + "\n\nTM-30 Color Vector Graphic,x,y\nbin1,0.1,0.2\nbin2,0.3,0.4\n"
)
OCEAN = (
    "Data from tile.txt Node\n\nDate: Sun Jun 13\nSpectrometer: FLMS15016\nXAxis mode: Wavelengths\n"
    "Number of Pixels in Spectrum: 3\n>>>>>Begin Spectral Data<<<<<\n339,123\t100,0\n339,5\t101,5\n340,1\t102,5\n"
)


def only(file):
    (entry,) = file.entries
    return entry


def test_a_meter_that_writes_keys_and_wavelengths_with_their_unit(written):
    path = written(METER, "ESPD.xls")
    assert recognises(path, path.read_bytes()) and format_of(path).NAME == "instrument text"
    entry = only(read(path))
    assert entry.name == "ESPD" and entry.spectrum.quantity == "emission"
    assert entry.spectrum.wavelengths_nm.tolist() == list(range(380, 400))
    assert entry.spectrum.samples[0] == 0.1
    assert entry.details["CCT"] == "5000" and entry.details["R1"] == "99"
    (xyz,) = entry.stated
    assert (xyz.space, xyz.values.tolist(), xyz.illuminant) == ("XYZ", [96.42, 100.0, 82.49], None)


def test_a_meter_that_lists_the_spectrum_at_two_steps(written):
    file = read_spectra(written(SEKONIC, "stage.csv"))
    entry = only(file)
    assert file.format == "instrument text" and entry.spectrum.wavelengths_nm.size == 21
    assert entry.stated[0].observer == "1964_10"
    assert any("at 2 steps; the finest, of 21 samples" in note for note in file.notes)
    assert "3 lines below the table are not read" in file.notes


def test_a_spectrometer_with_a_marker_and_decimal_commas(written):
    with pytest.raises(InputError, match="what was measured") as caught:
        read_spectra(written(OCEAN, "tile.txt"))
    assert "--as reflectance" in str(caught.value)
    entry = only(read_spectra(written(OCEAN, "tile.txt"), ImportOptions("emission")))
    assert entry.spectrum.wavelengths_nm.tolist() == [339.123, 339.5, 340.1]
    assert entry.spectrum.quantity == "emission"
    assert entry.details["Spectrometer"] == "FLMS15016"


def test_its_own_words_make_it_a_reflectance(written):
    entry = only(read_spectra(written(OCEAN.replace("Date: Sun", "Reflectance in %\nDate: Sun"), "tile.txt")))
    assert entry.spectrum.quantity == "radiance factor"
    assert entry.spectrum.samples.tolist() == [1.0, 1.015, 1.025]


def test_keys_without_a_spectrum(refused):
    assert "no table of wavelengths" in refused(read, "Model Name\tCV600\nLUX\t100.0\nCCT\t5000\nMemo\n")[0]


def test_a_real_meter(shared_data):
    path = shared_data / "spectra" / "text" / "uprtek.xls.txt"
    assert format_of(path).NAME == "instrument text"
    entry = only(read_spectra(path))
    assert entry.spectrum.quantity == "emission"
    assert entry.spectrum.wavelengths_nm[[0, -1]].tolist() == [380.0, 780.0] and entry.spectrum.samples[0] == 0.030267
    assert entry.details["CCT"] == "5198.000000" and entry.details["LUX"] == "695.154907"
    assert entry.stated[0].values.tolist() == pytest.approx([682.470886, 695.154907, 631.635071])
