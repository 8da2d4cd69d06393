"""Material files: the measurement beside the fit, half precision, spectra without a surface, the head."""

import importlib
import json
import time
from dataclasses import replace
from typing import get_args

import h5py
import numpy as np
import pytest
from metamer.materials.core.axes import Axis
from metamer.materials.core.fit_error import FitError
from metamer.materials.factored.pack import FactoredBrdf, FactorPack
from metamer.materials.fitting.fit import Trial
from metamer.materials.fitting.half_precision import rounded_to_half
from metamer.materials.records import hdf5_file, record_head
from metamer.materials.records.material import MaterialRecord, Provenance
from metamer.materials.records.models import MEASURED, SPECTRA
from metamer.materials.records.record import read_record, write_record
from metamer.materials.records.record_head import HEAD_BYTES, read_head
from metamer.materials.records.trial_table import trial_table, trials_from
from metamer.runtime.errors import InputError
from metamer.spectral.palette import Palette
from metamer.spectral.spectrum import Quantity
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

ERROR = FitError(0.1, 0.2, 0.3, 0.4, "D65", "1931_2", "sphere", 1e-3, -1e-5)
FROM = Provenance("a test", "none", "analytic")
# Numbers enough that a record's names and places are HDF5's own; a record without them is text in one data set.
MANY = {"noise": np.random.default_rng(5).normal(size=1100)}


def matt(reflectance=0.5, precision="single", rank=1):
    axes = tuple(Axis(name, 5, 1.5) for name in ("theta_h", "theta_d", "phi_d"))
    factors = (np.full((5, rank), 1 / np.pi / rank), np.ones((5, rank)), np.ones((5, rank)))
    pack = FactorPack("hd", axes, factors, Palette.of(np.full((rank, 81), reflectance)))
    return rounded_to_half(pack) if precision == "half" else pack


def surface(**changes):
    parameters = {"wavelengths_nm": NM, "reflectance": np.full(81, 0.5)}
    record = MaterialRecord("paint/grey", "paint", "lambert", parameters, FROM, FactoredBrdf((matt(),), ERROR), "abc")
    return replace(record, **changes)


def spectrum_only(model, values=None, **original):
    nm = np.array([380.0, 401.5, 560.0, 730.0])
    kept = {"wavelengths_nm": nm, "values": np.array([0.1, 0.2, 0.9, 0.4]) if values is None else values}
    return MaterialRecord("lamp/one", "lamp", model, {}, FROM, None, original=kept | original)


def packed(path):
    with h5py.File(path) as file:
        return list(file) == ["packed"]


def back(record, tmp_path):
    path = tmp_path / f"{record.id}.h5"
    write_record(record, path)
    return read_record(path, check_colour=True), path


@pytest.mark.parametrize("more", [{}, MANY], ids=["few numbers", "many numbers"])
def test_original_comes_back_bit_by_bit(tmp_path, more):
    draw = np.random.default_rng(0)
    original = more | {
        "maps/base colour": draw.integers(256, size=(7, 13, 3), dtype=np.uint8),
        "details.Gerät/µm %2F": "Grün ✓\n\ttwo lines",
        "long": "é" * 200_000,
        "empty text": "",
        "nothing": np.empty((0, 3)),
        "valid": np.array([True, False]),
        "counts": np.arange(6, dtype=np.int16).reshape(1, 2, 3),
        "halves": draw.standard_normal((4, 100)).astype(np.float16),
        "singles": draw.standard_normal(9).astype(">f4"),
        "odd": np.array([np.nan, -np.inf, -0.0, 5e-324, 1e308, 0.1 + 0.2]),
        "large counts": np.array([0, 2**64 - 1], dtype=np.uint64),
        "values": draw.standard_normal(31),
        ".": 4,
        "flag": True,
        "number": 0.1,
    }
    record, path = back(surface(original=original), tmp_path)
    found = record.original
    assert found.keys() == original.keys() and packed(path) == (not more)
    for name, value in original.items():
        if isinstance(value, np.ndarray):
            assert found[name].dtype == value.dtype and found[name].shape == value.shape
            assert found[name].tobytes() == value.tobytes()
        else:
            assert found[name] == value and type(found[name]) is type(value)


@pytest.mark.parametrize(
    ("value", "said"),
    [(np.array(["a"]), "U1 values"), ([[1], [1, 2]], "ragged"), ("a\0b", "NUL"), ("\ud800", "half a char"), (None, "")],
)
def test_what_cannot_be_stored_is_named(tmp_path, value, said):
    with pytest.raises(InputError, match=f"(?s)odd: cannot be stored.*{said}"):
        back(surface(original={"odd": value}), tmp_path)
    assert not list((tmp_path / "paint").iterdir())


def test_trials_come_back(tmp_path):
    trials = tuple(Trial(0, "hd", rank, 0.1 * rank, ERROR, 1.5 / rank, rank < 3) for rank in (1, 2, 3))
    assert back(surface(trials=trials), tmp_path)[0].trials == trials
    found, path = back(surface(trials=trials, original=MANY), tmp_path)
    assert found.trials == trials
    with h5py.File(path) as file:
        np.testing.assert_array_equal(file["trials"]["rank"], [1, 2, 3])


def test_trials_survive_fields_that_come_and_go():
    table = trial_table((Trial(0, "hd", 4, 0.5, ERROR, 1.0, True),))
    wider = np.empty(1, dtype=[*table.dtype.descr, ("joules", float)])
    for name in table.dtype.names:
        wider[name] = table[name]
    wider["joules"] = 3.0
    assert trials_from(wider) == (Trial(0, "hd", 4, 0.5, ERROR, 1.0, True),)
    assert trial_table(()).shape == (0,)


@pytest.mark.parametrize("original", [{}, MANY], ids=["few numbers", "many numbers"])
def test_half_precision_is_stored_as_such_and_comes_back_exactly(tmp_path, original):
    pack = matt(1 / 3, "half", rank=3)
    found, path = back(surface(fast=FactoredBrdf((pack, matt())), original=original), tmp_path)
    assert [one.precision for one in found.fast.packs] == ["half", "single"]
    for a, b in zip(
        (*found.fast.packs[0].factors, found.fast.packs[0].spectra),
        (*pack.factors, pack.spectra),
        strict=True,
    ):
        assert a.dtype == np.float64
        np.testing.assert_array_equal(a, b)
    if original:
        with h5py.File(path) as file:
            assert file["packs/0/axes/theta_h/factor"].dtype == np.float16
            assert file["packs/1/axes/theta_h/factor"].dtype == np.float64


def test_half_that_is_not_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"(?s)do not fit into 16 bits.*rounded_to_half"):
        back(surface(fast=FactoredBrdf((replace(matt(), precision="half"),))), tmp_path)


@pytest.mark.parametrize(
    ("model", "words", "step"),
    [
        ("emission", "lamp/one: an emission spectrum, not a surface", "use it as a light"),
        ("transmittance", "lamp/one: a transmittance spectrum, not a surface", "measure what the sample reflects"),
        ("radiance_factor", "lamp/one: a radiance factor in one geometry", "several geometries"),
    ],
)
def test_spectrum_without_a_surface(tmp_path, model, words, step):
    found, _ = back(spectrum_only(model), tmp_path)
    assert not found.is_surface and found.summands == () and found.error is None
    spectrum = found.measured_spectrum()
    assert spectrum.quantity == model.replace("_", " ") == found.quantity
    np.testing.assert_array_equal(spectrum.wavelengths_nm, [380.0, 401.5, 560.0, 730.0])
    with pytest.raises(InputError, match=f"(?s){words}.*{step}"):
        found.brdf()


def test_one_spectrum_or_none():
    """Of a measurement in many directions, or of another quantity, there is no one spectrum to speak of."""
    nm = np.array([400.0, 500.0])
    kept = {"wavelengths_nm": nm, "values": np.array([0.1, 0.2])}
    assert surface(original=kept).measured_spectrum().quantity == "reflectance"
    assert surface(original=kept | {"quantity": "transmittance"}).measured_spectrum().quantity == "transmittance"
    assert surface(original=kept | {"quantity": "index"}).measured_spectrum() is None
    assert surface(original=kept | {"values": np.ones((5, 2))}).measured_spectrum() is None
    assert surface().measured_spectrum() is None


def test_spectrum_without_samples_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"(?s)original: a spectrum without samples.*values"):
        back(replace(spectrum_only("emission"), original={"name": "x"}), tmp_path)


def test_head_is_json_in_the_first_bytes(tmp_path):
    _, path = back(surface(fast=FactoredBrdf((matt(0.25),), ERROR), original=MANY), tmp_path)
    head = json.loads(path.read_bytes().partition(b"\n")[0])
    assert head["id"] == "paint/grey" and head["terms"] == [[1, "hd"]] and head["quantity"] == "reflectance"
    assert head["error"]["p99"] == 0.3 and head["error"]["light"] == "D65"
    with h5py.File(path) as file:
        assert file.attrs["checksum"] == head["checksum"]


def test_head_s_colour_is_that_of_45_0(tmp_path):
    """A matt grey of radiance factor 0.25: the white's chromaticity, and L* = 116 0.25^(1/3) - 16 = 57.0754."""
    colour = read_head(back(surface(fast=FactoredBrdf((matt(0.25),), ERROR)), tmp_path)[1])["colour"]
    np.testing.assert_allclose(colour["XYZ"], 0.25 * np.array([0.95043, 1.0, 1.08880]), atol=2e-4)
    np.testing.assert_allclose(colour["Lab"], [57.0754, 0.0, 0.0], atol=1e-3)
    assert (colour["illuminant"], colour["observer"], colour["geometry"]) == ("D65", "1931_2", "45a:0")


def test_head_s_colour_of_spectra(tmp_path):
    flat = spectrum_only("radiance_factor", np.full(4, 0.25))
    assert read_head(back(flat, tmp_path)[1])["colour"]["Lab"][0] == pytest.approx(57.0754, abs=1e-3)
    light = read_head(back(spectrum_only("emission"), tmp_path)[1])["colour"]
    assert light["XYZ"][1] == 1.0 and "Lab" not in light
    assert read_head(back(spectrum_only("emission", np.zeros(4)), tmp_path)[1])["colour"] is None


@pytest.mark.parametrize(
    ("name", "value"),
    [("model", "ggx"), ("licence", "free"), ("checksum", "0"), ("error", None), ("sizes", {}), ("extra", 1)],
)
def test_head_that_lies_is_damage(tmp_path, name, value):
    _, path = back(surface(), tmp_path)
    rewrite(path, {**read_head(path), name: value})
    with pytest.raises(InputError, match=f"(?s){name}: the head of the file says otherwise"):
        read_record(path)


def test_head_that_lies_about_the_colour_is_found_when_asked(tmp_path):
    _, path = back(surface(), tmp_path)
    head = read_head(path)
    head["colour"]["Lab"][1] += 0.01
    rewrite(path, head)
    read_record(path)
    with pytest.raises(InputError, match=r"(?s)colour: the head.*Lab"):
        read_record(path, check_colour=True)


def test_a_disk_without_room_leaves_the_material_that_was_there(tmp_path, room_for):
    _, path = back(surface(), tmp_path)
    before = path.read_bytes()
    large = surface(original={"values": np.random.default_rng(0).normal(size=40_000)})
    with room_for(100_000), pytest.raises(InputError, match="no room for the file"):
        write_record(large, path)
    assert path.read_bytes() == before and [entry.name for entry in path.parent.iterdir()] == [path.name]


def test_the_file_is_the_head_and_then_plain_hdf5(tmp_path):
    written, path = back(surface(original=MANY), tmp_path)
    (tmp_path / "bare.h5").write_bytes(path.read_bytes()[head_size(path) :])
    for name in (path, tmp_path / "bare.h5"):
        with h5py.File(name) as file:
            assert file.attrs["id"] == written.id
            assert np.array_equal(file["parameters/reflectance"][:], written.parameters["reflectance"])


@pytest.mark.parametrize("original", [{}, MANY], ids=["few numbers", "many numbers"])
def test_equal_records_are_equal_bytes_a_second_later(tmp_path, original):
    _, path = back(surface(original=original), tmp_path)
    before, written = path.read_bytes(), time.time()
    time.sleep(max(0.0, int(written) + 1.01 - time.time()))
    write_record(surface(original=original), path)
    assert path.read_bytes() == before


def test_records_of_earlier_versions_are_read(tmp_path, monkeypatch):
    """Those had a head of 4096 bytes, and plain HDF5 whatever their size; content and checksum are the same."""
    now, path = back(surface(), tmp_path)
    size, checksum = path.stat().st_size, read_head(path)["checksum"]
    monkeypatch.setattr(hdf5_file, "_SMALL_BYTES", -1)
    monkeypatch.setattr(record_head, "_LEAST_BYTES", HEAD_BYTES)
    then, path = back(surface(), tmp_path)
    assert path.stat().st_size > 4 * size and head_size(path) == HEAD_BYTES and not packed(path)
    assert read_head(path)["checksum"] == checksum
    assert (then.id, then.provenance, then.error) == (now.id, now.provenance, now.error)
    np.testing.assert_array_equal(then.parameters["reflectance"], now.parameters["reflectance"])


@pytest.mark.parametrize(
    "text", [b"", b"[]", b"{", b"7", b'{"children": 3}', b'{"attributes": {}}', b"[" * 9000, b"\xff"]
)
def test_text_that_is_no_record_s_is_damage(tmp_path, text):
    _, path = back(surface(), tmp_path)
    block = path.read_bytes()[: head_size(path)]
    with h5py.File(path, "w", userblock_size=1024) as file:
        file["packed"] = np.frombuffer(text, np.uint8)
    path.write_bytes(block + path.read_bytes()[1024:])
    with pytest.raises(InputError, match=r"grey\.h5"):
        read_record(path)


def test_head_that_is_gone_is_damage(tmp_path):
    _, path = back(surface(), tmp_path)
    for block in (b"", b"[1]", b"{}", b"\xff\xfe"):
        path.write_bytes(block.ljust(1023) + b"\n" + path.read_bytes()[1024:])
        for read in (read_head, read_record):
            with pytest.raises(InputError, match=r"grey\.h5"):
                read(path)


def test_older_schema_says_import_again(tmp_path):
    path = tmp_path / "old.h5"
    with h5py.File(path, "w") as file:
        file.attrs.update(format="metamer-material", schema=1)
    with pytest.raises(InputError, match=r"(?s)schema: written by another version.*import the material again"):
        read_record(path)
    with pytest.raises(InputError, match=r"(?s)HDF5 without a head.*import the material again"):
        read_head(path)


def test_head_too_long_is_refused(tmp_path):
    with pytest.raises(InputError, match="says of itself is too long"):
        write_record(surface(family="x" * HEAD_BYTES), tmp_path / "a.h5")
    shortened = read_head(back(surface(provenance=replace(FROM, licence="ü" * 5000)), tmp_path)[1])["licence"]
    assert shortened == "ü" * 299 + "…"


def head_size(path):
    return path.read_bytes().index(b"\n") + 1


def rewrite(path, head):
    text, size = json.dumps(head, separators=(",", ":")).encode(), head_size(path)
    assert len(text) < size
    path.write_bytes(text.ljust(size - 1) + path.read_bytes()[size - 1 :])


def test_every_row_of_the_models_is_a_class_that_rebuilds_itself():
    for name, row in MEASURED.items():
        model = getattr(importlib.import_module(f"metamer.materials.{row.module}"), row.name)
        assert name == model.NAME and callable(model.from_parameters)
    assert not MEASURED.keys() & SPECTRA.keys()
    assert {name.replace("_", " ") for name in SPECTRA} | {"reflectance"} == set(get_args(Quantity))


def test_a_fast_form_of_another_version_is_said_to_be_one(tmp_path, monkeypatch):
    """The checksum holds, and what is in the form is not what this version asks for."""
    path = tmp_path / "grey.h5"
    with monkeypatch.context() as other:
        other.setattr(FactoredBrdf, "stored", lambda self: {"terms": {"of": "another version"}})
        write_record(surface(), path)
    with pytest.raises(InputError, match="a fast form of another version") as said:
        read_record(path)
    assert said.value.file == path and "import the material again" in str(said.value)
