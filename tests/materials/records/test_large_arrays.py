"""Records with arrays that are not read when the record is: written in blocks, or left where they are."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
from metamer.materials.core import brdf
from metamer.materials.records import hdf5_tree, stored_array
from metamer.materials.records.description import shown_values
from metamer.materials.records.material import MaterialRecord, Provenance
from metamer.materials.records.models import MEASURED, Measured, rebuild
from metamer.materials.records.record import check_large, read_record, stored_arrays, write_record
from metamer.materials.records.record_head import HEAD_BYTES, read_head
from metamer.materials.records.stored_array import StoredArray
from metamer.materials.records.verification import verify_catalogue, verify_material
from metamer.runtime.errors import InputError, NoRoomError
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM
from patience import patient

STACK = np.random.default_rng(0).random((20, 30, 50)).astype(np.float16)


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Make what is large small, so that tests are quick."""
    monkeypatch.setattr(stored_array, "BLOCK_BYTES", 5000)
    monkeypatch.setattr(hdf5_tree, "LARGE_BYTES", 20_000)


@pytest.fixture
def outside(tmp_path):
    """The stack in a file of its own."""
    path = tmp_path / "scans" / "stack.raw"
    path.parent.mkdir()
    path.write_bytes(b"head" + STACK.tobytes())
    return StoredArray(path, 4, STACK.shape, STACK.dtype)


def record(**original):
    parameters = {"wavelengths_nm": NM, "reflectance": np.full(81, 0.5)}
    said = Provenance("a test", "none", "measured")
    return MaterialRecord("cloth/wool", "cloth", "lambert", parameters, said, None, original=original)


def back(one, tmp_path, **how):
    path = tmp_path / "cat" / f"{one.id}.h5"
    write_record(one, path, **how)
    return read_record(path), path


@pytest.mark.parametrize("held", ["in memory", "outside"])
def test_a_large_array_is_written_in_blocks_and_read_when_asked_for(tmp_path, outside, held):
    found, path = back(record(stack=STACK if held == "in memory" else outside, few=np.arange(4)), tmp_path)
    stack = found.original["stack"]
    assert isinstance(stack, StoredArray) and stack.file == path and stored_arrays(found) == (stack,)
    assert np.array_equal(stack, STACK) and np.array_equal(stack.read(slice(3, 5)), STACK[3:5])
    assert stack.read().dtype == STACK.dtype and isinstance(found.original["few"], np.ndarray)
    assert read_head(path)["sizes"]["original"] == STACK.nbytes + 32
    with h5py.File(path) as file:
        assert np.array_equal(file["original/stack/values"][:], STACK)
    check_large(found, path)


def test_wherever_it_comes_from_the_file_is_the_same(tmp_path, outside):
    first, again = set(), set()
    for number, stack in enumerate((STACK, outside, outside.sealed(), STACK)):
        found, path = back(record(stack=stack), tmp_path / str(number))
        first.add(path.read_bytes())
        # And once more, from the record.
        again.add(back(found, tmp_path / f"{number} again")[1].read_bytes())
    assert len(first) == len(again) == 1


def test_what_is_left_where_it_is(tmp_path, outside):
    found, path = back(record(stack=outside), tmp_path, copy=False)
    stack = found.original["stack"]
    assert stack == outside.sealed() and stack.file == outside.file.absolute() and path.stat().st_size < STACK.nbytes
    assert np.array_equal(stack.read(slice(7, 9)), STACK[7:9])
    assert shown_values(found.original)["stack"] == f"float16 20 x 30 x 50, in {outside.file}"
    assert back(record(stack=outside.sealed()), tmp_path / "b", copy=False)[1].read_bytes() == path.read_bytes()


def test_a_bit_in_a_record_is_refused_when_it_is_read(tmp_path):
    _, path = back(record(stack=STACK), tmp_path)
    with h5py.File(path, "r+") as file:
        file["original/stack/values"][11, 0, 0] = 0.25
    found = read_record(path)
    assert np.array_equal(found.original["stack"].read(slice(0, 11)), STACK[:11])
    for read in (found.original["stack"].check, lambda: check_large(found, path)):
        with pytest.raises(InputError, match=r"(?s)wool\.h5: /original/stack.*not what it was.*\[11:12, "):
            read()
    assert "[11:12, " in str(verify_material("cloth/wool", path, quick=True).problem)


def test_packed_numbers_that_are_damaged_are_refused(tmp_path):
    _, path = back(record(stack=STACK), tmp_path)
    with h5py.File(path) as file:
        place = file["original/stack/values"].id.get_chunk_info(3).byte_offset
    data = bytearray(path.read_bytes())
    # Addresses count from behind the head.
    for offset in (0, HEAD_BYTES):
        if place + offset + 300 < len(data):
            data[place + offset + 100 : place + offset + 300] = bytes(200)
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"wool\.h5"):
        read_record(path).original["stack"].check()


@pytest.mark.parametrize("what", ["digests", "blocks", "place"])
def test_what_says_where_blocks_are_is_held_by_the_checksum(tmp_path, outside, what):
    many = np.linspace(0.0, 1.0, 1100)
    _, path = back(record(stack=outside, many=many), tmp_path, copy=what != "place")
    with h5py.File(path, "r+") as file:
        group = file["original/stack"]
        if what == "digests":
            group["digests"][0, 0] ^= 1
        elif what == "blocks":
            del group["values"].attrs["blocks"]
        else:
            group.attrs["place"] = 0
    with pytest.raises(InputError, match=r"wool\.h5"):
        read_record(path)


def test_a_file_that_is_not_what_it_was_is_refused_by_name(tmp_path, outside):
    found, path = back(record(stack=outside), tmp_path, copy=False)
    data = bytearray(outside.file.read_bytes())
    data[5] ^= 1
    outside.file.write_bytes(data)
    check_large(found, path)
    with pytest.raises(InputError, match=r"(?s)stack\.raw: byte 4.*not what it was"):
        found.original["stack"].read(slice(0, 1))
    (one,) = verify_catalogue(tmp_path / "cat", jobs=1).damaged
    assert "stack.raw" in str(one.problem) and "cloth/wool" in str(one.problem)
    outside.file.write_bytes(data + b"x")
    with pytest.raises(InputError, match=r"(?s)stack\.raw: byte 4.*not what it was.*bytes"):
        check_large(found, path)


@pytest.mark.slow_cases("2")
@pytest.mark.parametrize("jobs", [1, 2])
def test_a_catalogue_without_the_files_that_it_names_is_whole(tmp_path, outside, jobs, monkeypatch):
    """Pictures need the packs alone: `verify` says what is not here, and refuses nothing."""
    # Other processes know no smaller ones.
    monkeypatch.setattr(stored_array, "BLOCK_BYTES", 4 << 20)
    for number in range(17):
        back(replace(record(stack=outside), id=f"cloth/n{number}"), tmp_path, copy=False)
    said = []
    found = verify_catalogue(tmp_path / "cat", jobs=jobs, progress=lambda done, total, what: said.append(what))
    assert not found.damaged and not any(one.note for one in found.results) and "cloth/n3, 6e-05 GB read" in said
    outside.file.unlink()
    found = verify_catalogue(tmp_path / "cat", jobs=jobs)
    assert not found.damaged and all(str(outside.file) in one.note for one in found.results)
    some = read_record(tmp_path / "cat/cloth/n3.h5")
    with pytest.raises(InputError, match=r"(?s)stack\.raw.*no such file"):
        some.original["stack"].read()
    with pytest.raises(InputError, match=r"(?s)stack\.raw.*no such file"):
        check_large(some, tmp_path / "cat/cloth/n3.h5")


def test_a_file_that_changes_while_it_is_copied_leaves_nothing(tmp_path, outside):
    sealed = outside.sealed()
    outside.file.write_bytes(b"head" + STACK[::-1].tobytes())
    with pytest.raises(InputError, match=r"stack\.raw"):
        back(record(stack=sealed), tmp_path)
    assert not list((tmp_path / "cat/cloth").iterdir())


def test_a_disk_without_room_leaves_the_material_that_was_there(tmp_path, room_for):
    _, path = back(record(stack=STACK), tmp_path)
    before = path.read_bytes()
    for room in (HEAD_BYTES // 2, HEAD_BYTES + 100, 10_000, 30_000, len(before) - 1):
        with room_for(room), pytest.raises(NoRoomError, match="no room for the file"):
            write_record(record(stack=STACK, more=STACK[::-1]), path)
        assert path.read_bytes() == before and [entry.name for entry in path.parent.iterdir()] == [path.name]
    read_record(path).original["stack"].check()


@pytest.mark.slow
def test_a_disk_without_room_does_not_end_the_process():
    """HDF5 gives up a whole process over a file that it cannot close, some of it only when Python ends."""
    code = """
import resource, sys, tempfile
from pathlib import Path
from types import SimpleNamespace
import numpy as np
sys.path[:0] = sys.argv[1:]
import test_large_arrays as tests
from metamer.runtime.errors import NoRoomError
stack = np.random.default_rng(0).random((2, 1000, 1000))
resource.setrlimit(resource.RLIMIT_FSIZE, (9_000_000, resource.RLIM_INFINITY))
with tempfile.TemporaryDirectory() as folder:
    try:
        tests.write_record(tests.record(stack=stack), Path(folder) / "a.h5")
    except NoRoomError as reason:
        print("refused:", reason)
    print([entry.name for entry in Path(folder).iterdir()])
"""
    pytest.importorskip("resource")
    here = Path(__file__).parent
    command = [sys.executable, "-c", code, str(here), str(here.parents[1] / "harness")]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=patient(120))
    assert ended.returncode == 0 and not ended.stderr, ended
    assert "no room for the file" in ended.stdout and ended.stdout.endswith("[]\n")


def test_a_model_is_given_whole_arrays_unless_it_reads_files_itself(tmp_path, monkeypatch):
    monkeypatch.setattr(hdf5_tree, "LARGE_BYTES", 100)
    found, _ = back(record(), tmp_path)
    assert isinstance(found.parameters["reflectance"], StoredArray)
    up = np.array([0.0, 0.0, 1.0])
    assert np.array_equal(found.brdf().eval(up, up), record().brdf().eval(up, up))
    monkeypatch.setitem(MEASURED, "as they are", Measured("core.brdf", "As", reads_files=True))
    given = []
    as_it_is = SimpleNamespace(from_parameters=lambda parameters: given.append(parameters) or record().brdf())
    monkeypatch.setattr(brdf, "As", as_it_is, raising=False)
    rebuild("as they are", found.parameters)
    assert given == [found.parameters]
