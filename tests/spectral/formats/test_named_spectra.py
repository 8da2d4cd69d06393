"""Files of spectra in scripts."""

import numpy as np
import pytest
from metamer import read_spectra
from metamer.runtime.errors import InputError
from metamer.spectral.formats.named_spectra import in_python

NM = np.arange(400.0, 701.0, 20.0)


def written(path, *columns, names):
    np.savetxt(path, np.column_stack([NM, *columns]), "%.6g", ",", header="nm," + ",".join(names), comments="")
    return path


def test_spectra_by_name_in_their_order(tmp_path):
    first, second = np.linspace(20.0, 60.0, NM.size), np.linspace(80.0, 10.0, NM.size)
    path = written(tmp_path / "two.csv", first, second, names=["warm", "cool"])
    with pytest.raises(InputError, match='try: say it: as_="reflectance", "transmittance"'):
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


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("say it: --scale percent or --scale fraction", 'say it: scale="percent" or scale="fraction"'),
        ("and --scale percent or fraction where", 'and scale="percent" or "fraction" where'),
        ("leave --as and --scale out: --as radiance-factor", 'leave as_= and scale= out: as_="radiance factor"'),
        ("import this file without --as; where", "read this file without as_=; where"),
        ("--decimal comma does not tell", 'decimal="comma" does not tell'),
        ("--as-if and --scales", "--as-if and --scales"),
    ],
)
def test_options_of_the_command_are_named_as_arguments(said, meant):
    assert in_python(said) == meant


# Values that cannot be used.
BAD = {"negative": np.linspace(-5.0, 60.0, NM.size), "dark": np.linspace(-9.0, 50.0, NM.size)}


def partly(path, *bad):
    good = {"warm": np.linspace(20.0, 60.0, NM.size), "cool": np.linspace(80.0, 10.0, NM.size)}
    columns = good | {name: BAD[name] for name in bad}
    return written(path, *columns.values(), names=list(columns))


@pytest.mark.parametrize("bad", [["negative"], ["negative", "dark"]])
def test_spectra_that_cannot_be_used_are_an_error_unless_they_may_be_left_out(tmp_path, bad):
    path = partly(tmp_path / "some.csv", *bad)
    with pytest.raises(InputError) as refused:
        read_spectra(path, as_="reflectance", scale="percent")
    said = str(refused.value)
    assert all(name in said for name in ("some.csv", *bad)) and "--" not in said
    assert f"{len(bad)} of {2 + len(bad)} spectra" in said and "skip=True" in said
    with pytest.warns(UserWarning, match="is left out") as warned:
        found = read_spectra(path, as_="reflectance", scale="percent", skip=True)
    assert list(found) == ["warm", "cool"] and sum("left out" in str(one.message) for one in warned) == len(bad)
