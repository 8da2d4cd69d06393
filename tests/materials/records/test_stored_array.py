"""Arrays that stay in their files: what a block is, and what is refused."""

import hashlib
import pickle
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from metamer.materials.records import stored_array
from metamer.materials.records.stored_array import StoredArray, blocks_of, chunks_of
from metamer.runtime.errors import InputError


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch):
    monkeypatch.setattr(stored_array, "BLOCK_BYTES", 200)


@pytest.fixture(params=["raw", "hdf5"])
def kept(request, tmp_path):
    """An array of several blocks in a file, and the array."""
    values = np.random.default_rng(0).normal(size=(6, 5, 7)).astype(">f4")
    path = tmp_path / f"stack.{request.param}"
    if request.param == "raw":
        path.write_bytes(b"head" + values.tobytes() + b"tail")
        return StoredArray(path, 4, values.shape, values.dtype), values
    with h5py.File(path, "w") as file:
        file["a/b"] = values
    return StoredArray(path, "a/b", values.shape, values.dtype), values


@pytest.mark.parametrize("shape", [(7,), (1000,), (6, 5, 7), (2, 3, 100), (1, 1, 1), (0, 3), (40, 0), (3, 1, 60, 2)])
def test_blocks_are_the_array_in_order(shape):
    values = np.arange(np.prod(shape), dtype=np.int32).reshape(shape)
    blocks = [block for _, block in chunks_of(values)]
    assert b"".join(block.tobytes() for block in blocks) == values.tobytes()
    assert all(0 < block.nbytes <= 200 for block in blocks)


def test_a_block_of_one_number_where_a_number_is_larger(monkeypatch):
    monkeypatch.setattr(stored_array, "BLOCK_BYTES", 1)
    assert len(blocks_of((2, 3), np.dtype("f8"))) == 6


def test_it_is_read_whole_in_rows_and_in_blocks(kept):
    stored, values = kept
    assert np.array_equal(stored, values) and stored.read().dtype == values.dtype
    for rows in (slice(2, 5), slice(0, 1), slice(5, None), slice(3, 3), slice(4, 99)):
        assert np.array_equal(stored.read(rows), values[rows])
    found = np.empty_like(values)
    for where, block in stored.chunks():
        found[where] = block
    assert np.array_equal(found, values)
    assert (stored.nbytes, stored.ndim, len(stored)) == (values.nbytes, 3, 6)


def test_sealed_it_is_the_bytes_of_the_array(kept):
    stored, values = kept
    digest = hashlib.sha256()
    sealed = stored.sealed(digest.update)
    assert digest.hexdigest() == hashlib.sha256(values.tobytes()).hexdigest()
    assert sealed.digests == stored_array.digests_of(values) and sealed.file_size == stored.file.stat().st_size
    assert sealed.sealed() == sealed


def test_it_goes_to_another_process_as_a_few_bytes(kept):
    sealed = kept[0].sealed()
    assert len(pickle.dumps(sealed)) < 2000 and pickle.loads(pickle.dumps(sealed)) == sealed


@pytest.mark.parametrize("kind", ["raw", "hdf5"])
def test_rows_of_one_block_are_read_from_their_file_once(kind, tmp_path):
    """As files of a BTF are asked for, one after the other; what is returned is nobody else's, and the file is still
    looked at.
    """
    values, path, heard = np.arange(1000, dtype=np.uint8), tmp_path / "files", []
    if kind == "raw":
        path.write_bytes(values.tobytes())
    else:
        with h5py.File(path, "w") as file:
            file["a"] = values
    sealed = StoredArray(path, 0 if kind == "raw" else "a", values.shape, values.dtype).sealed()
    stored = replace(sealed, heard=heard.append)
    for first in range(0, 195, 13):
        found = stored.read(slice(first, first + 13))
        assert np.array_equal(found, values[first : first + 13])
        found[:] = 0
    assert heard == [200]
    assert np.array_equal(stored.read(slice(190, 210)), values[190:210])
    assert np.array_equal(stored.read(slice(399, 401)), values[399:401])
    # A whole block is nothing to come back to.
    stored.read(slice(600, 800))
    assert len(heard) == 6 and len(pickle.dumps(stored.sealed())) < 2000
    stored.read(slice(410, 420))
    with path.open("ab") as file:
        file.write(b"more")
    with pytest.raises(InputError, match="not what it was"):
        stored.read(slice(410, 420))
    path.unlink()
    with pytest.raises(InputError, match="no such file"):
        stored.read(slice(410, 420))


def test_bytes_are_heard_of(kept):
    heard = []
    replace(kept[0], heard=heard.append).read()
    assert sum(heard) == kept[1].nbytes and len(heard) > 3


def changed_byte(path: Path, values: np.ndarray) -> None:
    data = bytearray(path.read_bytes())
    place = bytes(data).index(values[3].tobytes())
    data[place] ^= 1
    path.write_bytes(data)


def test_one_bit_is_refused_when_its_block_is_read(kept):
    stored, values = kept
    sealed = stored.sealed()
    changed_byte(stored.file, values)
    assert np.array_equal(sealed.read(slice(0, 2)), values[:2])
    for read in (
        sealed.read,
        sealed.check,
        sealed.sealed,
        lambda: sealed.read(slice(3, 4)),
        lambda: np.asarray(sealed),
    ):
        with pytest.raises(InputError, match=r"(?s)stack.*not what it was.*\[3:4, .*--again"):
            read()


def test_a_file_that_is_gone_or_has_grown_is_refused(kept):
    stored, _ = kept
    sealed = stored.sealed()
    with stored.file.open("ab") as file:
        file.write(b"more")
    with pytest.raises(InputError, match=r"(?s)stack.*not what it was.*bytes"):
        sealed.check_is_there()
    stored.file.unlink()
    for one in (stored, sealed):
        with pytest.raises(InputError, match=r"(?s)stack.*no such file"):
            one.read()


def test_a_file_that_is_too_short_is_refused(tmp_path):
    (tmp_path / "short").write_bytes(bytes(100))
    with pytest.raises(InputError, match=r"(?s)short: byte 0.*shorter.*100 bytes.*240 bytes: 6 x 5 of float64"):
        StoredArray(tmp_path / "short", 0, (6, 5), np.dtype("f8")).read()


def test_a_data_set_that_is_none_or_another_is_refused(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["a"] = np.arange(3)
    for place, shape in (("b", (3,)), ("a", (4,)), ("/", (3,))):
        with pytest.raises(InputError, match=r"(?s)a\.h5: .*(cannot be read|not what it was)"):
            StoredArray(tmp_path / "a.h5", place, shape, np.dtype(int)).read()


@pytest.mark.parametrize(("shape", "dtype", "digests"), [((), "f4", b""), ((3,), "O", b""), ((3,), "f4", b"x" * 31)])
def test_what_is_no_such_array_is_refused(tmp_path, shape, dtype, digests):
    with pytest.raises(InputError, match="can be stored"):
        StoredArray(tmp_path / "a", 0, shape, np.dtype(dtype), digests)
