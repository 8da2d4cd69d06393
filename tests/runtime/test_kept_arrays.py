"""Small results that are kept from run to run: read back as they were made, made again where they are not whole."""

import os

import numpy as np
import pytest
from metamer.runtime.kept_arrays import kept

MADE = {"values": np.linspace(0.0, 1.0, 7), "names": np.array(["a", "b"])}


def never():
    raise AssertionError("made again")


def same(found):
    assert [*found] == [*MADE]
    for name, values in MADE.items():
        np.testing.assert_array_equal(found[name], values)
    return True


def test_what_is_kept_is_not_made_again(tmp_path):
    file = tmp_path / "new" / "one.npz"
    assert same(kept(file, lambda: MADE)) and same(kept(file, never))


@pytest.mark.parametrize("at", [0, 0.3, 0.5, 0.9])
def test_a_damaged_file_is_made_again(tmp_path, at):
    file = tmp_path / "one.npz"
    kept(file, lambda: MADE)
    whole = file.read_bytes()
    place = int(at * len(whole))
    for damaged in (whole[:place], whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :]):
        file.write_bytes(damaged)
        assert same(kept(file, lambda: MADE))
        # A bit of the archive's list of files may say nothing.
        assert file.read_bytes() == whole or (damaged[:place] == whole[:place] and at > 0.5 and same(kept(file, never)))


def test_nothing_is_kept_where_nothing_can_be_written(tmp_path):
    (tmp_path / "folder").write_text("no folder")
    assert same(kept(tmp_path / "folder" / "one.npz", lambda: MADE))


def test_the_oldest_of_many_go(tmp_path):
    for number in range(203):
        file = tmp_path / f"{number}.npz"
        kept(file, lambda: MADE)
        os.utime(file, (number, number))
    kept(tmp_path / "last.npz", lambda: MADE)
    left = {file.stem for file in tmp_path.iterdir()}
    assert len(left) == 200 and not {"0", "1", "2", "3"} & left and {"4", "202", "last"} <= left
