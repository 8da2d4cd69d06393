"""Material records on disk: round trip, damage, names."""

import re
from dataclasses import replace

import h5py
import numpy as np
import pytest
from metamer.materials.analytic import MODELS
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.core.axes import Axis
from metamer.materials.core.fit_error import FitError
from metamer.materials.factored.pack import FactoredBrdf, FactorPack
from metamer.materials.records.material import MaterialRecord, Provenance
from metamer.materials.records.record import MARKER, read_record, write_record
from metamer.materials.records.record_head import SCHEMA
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.palette import Palette
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM

ERROR = FitError(0.1, 0.2, 0.3, 0.4, "D65", "1931_2", "sphere", 1e-3, -1e-5)


def pack(frame="io", basis=None, seed=1):
    basis = basis or SpectralBasis.sampled()
    names = {"io": ("theta_i", "theta_o", "phi"), "hd": ("theta_h", "theta_d", "phi_d")}[frame]
    sizes, warps = (7, 300, 5), ("sqrt", "linear", "linear")
    draw = np.random.default_rng(seed)
    axes = tuple(Axis(n, size, 1.5, warp) for n, size, warp in zip(names, sizes, warps, strict=True))
    factors = tuple(draw.standard_normal((size, 3)) for size in sizes)
    return FactorPack(frame, axes, factors, Palette.of(draw.standard_normal((3, basis.size)), basis))


def record(material_id="paint/red", **changes):
    model = MODELS[0]
    brdf = model.examples(WORKING_WAVELENGTHS_NM)[0]
    fields = {
        "id": material_id,
        "family": material_id.split("/")[0],
        "model": model.NAME,
        "parameters": {"wavelengths_nm": WORKING_WAVELENGTHS_NM, **brdf.parameters()},
        "provenance": Provenance("a test", "none", "analytic", notes="ΔE, accents: Rakić"),
        "fast": FactoredBrdf((pack("io"), pack("hd", seed=2)), ERROR),
        "source_hash": "abc",
    }
    return MaterialRecord(**(fields | changes))


@pytest.fixture
def folder(tmp_path):
    (tmp_path / MARKER).write_text(f"schema = {SCHEMA}\n")
    return tmp_path


def stored(folder, material_id="paint/red", **changes):
    path = folder / f"{material_id}.h5"
    write_record(record(material_id=material_id, **changes), path)
    return path


def assert_same_pack(found, expected):
    assert (found.frame, found.axes) == (expected.frame, expected.axes)
    for name in ("wavelengths_nm", "analysis", "synthesis"):
        np.testing.assert_array_equal(getattr(found.palette.basis, name), getattr(expected.palette.basis, name))
    for a, b in zip((*found.factors, found.palette.values), (*expected.factors, expected.palette.values), strict=True):
        np.testing.assert_array_equal(a, b)
        assert a.dtype == b.dtype


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.NAME)
def test_every_model_comes_back_exactly(folder, model):
    for index, brdf in enumerate(model.examples(WORKING_WAVELENGTHS_NM)):
        parameters = {"wavelengths_nm": WORKING_WAVELENGTHS_NM, **brdf.parameters()}
        path = stored(folder, f"test/case-{index}", model=model.NAME, parameters=parameters)
        found = read_record(path)
        wi, wo = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]]), np.array([[0.0, 0.28, 0.96], [-0.6, 0.0, 0.8]])
        np.testing.assert_array_equal(found.brdf().eval(wi, wo), brdf.eval(wi, wo))


def test_record_comes_back_whole(folder):
    expected = record()
    stored(folder)
    found = Catalogue.open(folder).load("paint/red")
    for field in ("id", "family", "model", "provenance", "error", "source_hash"):
        assert getattr(found, field) == getattr(expected, field)
    assert found.parameters.keys() == expected.parameters.keys()
    for a, b in zip(found.fast.packs, expected.fast.packs, strict=True):
        assert_same_pack(a, b)


def test_packs_in_another_basis_and_float32_come_back(folder):
    draw = np.random.default_rng(0)
    basis = SpectralBasis("balanced", np.array([400.0, 500.0, 600.0]), *draw.standard_normal((2, 3, 2)))
    small = pack(basis=basis)
    half = FactorPack(small.frame, small.axes, tuple(np.float32(f) for f in small.factors), small.palette)
    found = read_record(stored(folder, fast=FactoredBrdf((half,))))
    assert_same_pack(found.fast.packs[0], half)


def test_file_is_readable_in_five_lines_of_h5py(folder):
    path = stored(folder)
    with h5py.File(path) as file:
        first = file["packs/0"]
        theta_i = first["axes/theta_i/nodes"][:]
        factor = first["axes/theta_i/factor"][:]
        spectra = first["spectral"][:]
    assert factor.shape == (len(theta_i), len(spectra))


def test_no_other_file_stays_beside_a_record(folder):
    path = stored(folder)
    stored(folder)
    assert [entry.name for entry in path.parent.iterdir()] == ["red.h5"]


def test_failed_write_leaves_nothing(folder):
    with pytest.raises(InputError, match="odd"):
        stored(folder, parameters={"odd": np.array(["text"])})
    assert not list((folder / "paint").iterdir())


def test_ids_are_sorted_and_hidden_files_are_not_materials(folder):
    for name in ("paint/red", "metal/gold"):
        stored(folder, name)
    (folder / "paint" / ".half.1234.h5").write_bytes(b"")
    assert Catalogue.open(folder).ids() == ("metal/gold", "paint/red")


def test_glob_finds_ids_and_an_empty_match_names_the_nearest(folder):
    for name in ("chart/red-gloss", "chart/red-matte", "chart/blue-gloss"):
        stored(folder, name)
    catalogue = Catalogue.open(folder)
    assert catalogue.match("chart/*-gloss") == ("chart/blue-gloss", "chart/red-gloss")
    with pytest.raises(UnknownNameError, match=re.escape("nearest: ")):
        catalogue.match("chart/*-glos")


def test_an_id_is_found_without_the_names_of_all_files(folder, monkeypatch):
    for name in ("chart/red-gloss", "chart/blue-gloss"):
        stored(folder, name)
    catalogue, listed = Catalogue.open(folder), []
    monkeypatch.setattr("metamer.materials.catalogue.catalogue.material_files", lambda *given: listed.append(given))
    assert catalogue.match("chart/red-gloss") == ("chart/red-gloss",) and not listed


@pytest.mark.parametrize(
    "name", ["chart/green", "", "/chart/red-gloss", "chart/../chart/red-gloss", "./chart/red-gloss"]
)
def test_an_id_that_is_not_there_matches_nothing(folder, name):
    stored(folder, "chart/red")
    with pytest.raises(UnknownNameError):
        Catalogue.open(folder).match(name)


def test_unknown_id_gives_the_nearest(folder):
    for name in ("chart/red-gloss", "chart/blue-gloss"):
        stored(folder, name)
    with pytest.raises(UnknownNameError, match="nearest: chart/red-gloss"):
        Catalogue.open(folder).load("chart/red-glos")


def test_a_material_takes_the_place_of_another_where_that_is_asked(folder):
    stored(folder)
    other = record(parameters={"exponent": 3.0})
    with pytest.raises(InputError, match=r"(?s)a material of this id.*replace=True"):
        Catalogue(folder).add(other)
    before = Catalogue(folder).state(other.id)
    Catalogue(folder).add(other, replace=True)
    assert Catalogue(folder).load(other.id).parameters["exponent"] == 3.0
    assert list(Catalogue(folder)) == [other.id] and Catalogue(folder).state(other.id) != before
    with pytest.raises(InputError, match="such as script/orange"):
        Catalogue(folder).add(record("orange"))


def test_missing_folder_says_how_to_make_it(tmp_path):
    with pytest.raises(InputError, match=r"(?s)no such catalogue.*metamer catalogue import"):
        Catalogue.open(tmp_path / "none")


def test_folder_without_marker_is_not_a_catalogue(tmp_path):
    with pytest.raises(InputError, match="not a catalogue"):
        Catalogue.open(tmp_path)


def test_truncated_file_is_named(folder):
    path = stored(folder)
    data = path.read_bytes()
    for keep in (0, 7, 100, len(data) // 2, len(data) - 1):
        path.write_bytes(data[:keep])
        with pytest.raises(InputError, match=r"red\.h5"):
            Catalogue.open(folder).load("paint/red")


def test_file_that_is_not_hdf5_is_named(folder):
    path = stored(folder)
    path.write_text("not a material\n" * 100)
    with pytest.raises(InputError, match=r"(?s)red.h5: not a readable material file.*HDF5"):
        Catalogue.open(folder).load("paint/red")


def test_changed_number_is_noticed(folder):
    path = stored(folder)
    with h5py.File(path, "r+") as file:
        file["packs/1/spectral"][0, 0] += 1e-9
    with pytest.raises(InputError, match=r"(?s)red.h5: checksum: content has changed"):
        Catalogue.open(folder).load("paint/red")


def test_flipped_byte_never_passes_unnoticed(folder):
    path = stored(folder)
    data, whole = path.read_bytes(), read_record(path)
    for at in np.random.default_rng(3).integers(len(data), size=60):
        broken = bytearray(data)
        broken[at] ^= 0x10
        path.write_bytes(bytes(broken))
        try:
            found = read_record(path)
        except InputError as reason:
            assert "red.h5" in str(reason)
        else:  # a byte that carries no content: padding of the container
            assert found.provenance == whole.provenance, f"byte {at}"
            for a, b in zip(found.fast.packs, whole.fast.packs, strict=True):
                assert_same_pack(a, b)


def test_other_hdf5_and_other_schema_are_refused(folder):
    path = stored(folder)
    with h5py.File(path, "r+") as file:
        file.attrs["schema"] = 99
    with pytest.raises(InputError, match=r"(?s)schema: written by another version.*99"):
        read_record(path)
    with h5py.File(path, "w") as file:
        file["values"] = [1, 2]
    with pytest.raises(InputError, match="not a material file"):
        read_record(path)


def test_renamed_file_is_not_the_material_it_says(folder):
    stored(folder).rename(folder / "paint" / "blue.h5")
    with pytest.raises(InputError, match=r"(?s)another material.*paint/red"):
        Catalogue.open(folder).load("paint/blue")


def test_verify_lists_the_damaged(folder):
    stored(folder, "paint/red")
    stored(folder, "paint/blue").write_bytes(b"")
    found = Catalogue.open(folder).verify()
    assert found["paint/red"] is None
    assert "blue.h5" in str(found["paint/blue"])


@pytest.mark.parametrize("field", ["source", "licence"])
def test_provenance_without_origin_is_refused(field):
    with pytest.raises(InputError, match=field):
        Provenance(**({"source": "a", "licence": "b", "kind": "measured"} | {field: " "}))


def test_provenance_kinds():
    for kind in ("measured", "analytic", "uplifted(smits)"):
        Provenance("a", "b", kind)
    with pytest.raises(InputError, match="guessed"):
        Provenance("a", "b", "guessed")


def test_unknown_model_gives_the_nearest():
    with pytest.raises(UnknownNameError, match="oren_nayar"):
        replace(record(), model="oren_nayer").brdf()
