"""Files of spectra in scripts."""

import numpy as np
import pytest
from metamer import read_spectra
from metamer.runtime.errors import InputError

NM = np.arange(400.0, 701.0, 20.0)


def written(path, *columns, names):
    np.savetxt(path, np.column_stack([NM, *columns]), "%.6g", ",", header="nm," + ",".join(names), comments="")
    return path


def test_spectra_by_name_in_their_order(tmp_path):
    first, second = np.linspace(20.0, 60.0, NM.size), np.linspace(80.0, 10.0, NM.size)
    path = written(tmp_path / "two.csv", first, second, names=["warm", "cool"])
    with pytest.raises(InputError, match="--as"):
        read_spectra(path)
    found = read_spectra(path, as_="reflectance", scale="percent")
    assert list(found) == ["warm", "cool"]
    assert found["cool"].quantity == "reflectance" and np.allclose(found["cool"].samples, second / 100.0)
    assert found["warm"].lab().shape == (3,)


def test_lamps_are_spectra_too(tmp_path):
    path = written(tmp_path / "lamp.csv", np.linspace(1.0, 9.0, NM.size), names=["lamp"])
    (lamp,) = read_spectra(path, as_="emission").values()
    assert lamp.quantity == "emission" and lamp.samples[-1] == 9.0


def test_what_is_no_file_of_spectra_is_refused(tmp_path):
    (tmp_path / "x.csv").write_text("hello\n")
    with pytest.raises(InputError, match=r"x\.csv"):
        read_spectra(tmp_path / "x.csv")
    with pytest.raises(InputError):
        read_spectra(tmp_path / "none.csv")
