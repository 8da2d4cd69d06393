"""Tables as they are written, read back bit for bit."""

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.formats.csv import read_csv_spectra
from metamer.spectral.formats.csv_writer import write_csv
from metamer.spectral.formats.registry import SpectralEntry, read_spectra
from metamer.spectral.spectrum import Spectrum

GRID = np.array([380.5, 400.0, 404.6565, 700.0])


def entry(name, quantity="reflectance", grid=GRID, top=1.0, **details):
    values = np.random.default_rng(len(name)).uniform(0, top, len(grid))
    return SpectralEntry(name, Spectrum.sampled(grid, values, quantity), (), details)


@pytest.mark.parametrize(
    "quantity, top", [("reflectance", 1), ("transmittance", 1), ("radiance factor", 1.8), ("emission", 1e-4)]
)
def test_round_trip(tmp_path, quantity, top):
    written = [entry("chip/one", quantity, top=top), entry('a, "b"', quantity, top=top)]
    write_csv(tmp_path / "x.csv", written, ["made by a test"])
    assert (tmp_path / "x.csv").read_text().startswith("# made by a test\n# " + quantity)
    found = read_spectra(tmp_path / "x.csv").entries
    assert [one.spectrum.quantity for one in found] == [quantity, quantity]
    strict = read_csv_spectra(tmp_path / "x.csv", quantity)
    for one, other in zip(found, written, strict=True):
        np.testing.assert_array_equal(one.spectrum.wavelengths_nm, GRID)
        np.testing.assert_array_equal(one.spectrum.samples, other.spectrum.samples)
        np.testing.assert_array_equal(strict[other.name].samples, other.spectrum.samples)


@pytest.mark.parametrize("other", [entry("b", "transmittance"), entry("b", grid=GRID + 1)])
def test_what_does_not_fit_one_table(tmp_path, other):
    with pytest.raises(InputError, match="in one table") as caught:
        write_csv(tmp_path / "x.csv", [entry("a"), other])
    assert "folder" in str(caught.value) and not list(tmp_path.iterdir())


def test_nothing_is_no_table(tmp_path):
    with pytest.raises(InputError, match="nothing to write"):
        write_csv(tmp_path / "x.csv", [])
