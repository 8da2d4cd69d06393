"""Materials as a workbook and as Parquet: the same cells, and what the records say."""

import numpy as np
import openpyxl
import pandas
import pytest
from metamer.materials.analytic import Lambert
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.catalogue.material import Material
from metamer.materials.export.files import export
from metamer.materials.export.table import HEADINGS
from metamer.materials.records.material import MaterialRecord, Provenance
from metamer.runtime.errors import InputError
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

SAID = Provenance("a chart", "CC0 1.0", "measured", "45:0")
NM = np.arange(420.0, 681.0, 10.0)
RED = np.linspace(0.05, 0.8, NM.size)


def matt():
    brdf = Lambert(Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.full(WORKING_WAVELENGTHS_NM.size, 0.3)))
    parameters = {**brdf.parameters(), "wavelengths_nm": WORKING_WAVELENGTHS_NM}
    original = {"wavelengths_nm": NM, "values": RED, "quantity": "reflectance"}
    return MaterialRecord("paint/=red", "paint", "lambert", parameters, SAID, None, original=original)


def lamp():
    original = {"wavelengths_nm": NM, "values": 9.0 * RED, "quantity": "emission"}
    return MaterialRecord("lamp/warm", "lamp", "emission", {}, SAID, None, original=original)


def read(path):
    if path.suffix == ".parquet":
        frame = pandas.read_parquet(path)
        rows = [[None if pandas.isna(cell) else cell for cell in row] for row in frame.to_numpy(dtype=object)]
        return list(frame.columns), rows
    heads, *rows = openpyxl.load_workbook(path).active.iter_rows(values_only=True)
    return list(heads), [list(row) for row in rows]


@pytest.mark.parametrize("kind", ["xlsx", "parquet"])
def test_each_material_is_a_line(kind, tmp_path):
    (done,) = export([matt(), lamp()], kind, tmp_path / f"all.{kind}")
    heads, rows = read(done.path)
    assert heads == list(HEADINGS) and [row[0] for row in rows] == ["paint/=red", "lamp/warm"]
    red, warm = (dict(zip(heads, row, strict=True)) for row in rows)
    assert red["standing"] == "measured" and red["geometry"] == "45:0" and red["licence"] == "CC0 1.0"
    expected = Spectrum.sampled(NM, RED).lab("A")
    assert [red["L* A"], red["a* A"], red["b* A"]] == pytest.approx(expected.tolist(), abs=1e-9)
    assert red["410 nm"] is None and red["420 nm"] == pytest.approx(0.05) and red["690 nm"] is None
    assert warm["L* D65"] is None and warm["680 nm"] == pytest.approx(7.2) and warm["fit ΔE94 p99"] is None


def test_colours_are_those_of_the_material(tmp_path, tiny_catalogue):
    catalogue = Catalogue.open(tiny_catalogue)
    (done,) = export([catalogue.load(name) for name in catalogue], "parquet", tmp_path / "tiny.parquet")
    heads, rows = read(done.path)
    for row in rows:
        cells = dict(zip(heads, row, strict=True))
        material = catalogue[cells["id"]]
        assert isinstance(material, Material)
        found = [cells[f"{axis} FL11"] for axis in ("L*", "a*", "b*")]
        assert found == pytest.approx(material.lab("FL11").tolist(), abs=2e-3), cells["id"]
        assert cells["fit ΔE94 p99"] == pytest.approx(material.error.p99)


def test_a_library_that_is_missing_is_named(tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"Parquet needs pyarrow(?s:.*)\[parquet\]"):
        export([matt()], "parquet", tmp_path / "x.parquet")
    assert not list(tmp_path.iterdir())
