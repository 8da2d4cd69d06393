"""Files that are either whole or not there."""

import pytest
from metamer.spectral.errors import InputError
from metamer.spectral.files import existing_file, half_written, read_text, written_whole


def test_what_was_written_takes_the_name(tmp_path):
    with written_whole(tmp_path / "x.csv") as beside:
        beside.write_text("new")
        assert beside.suffix == ".csv" and not (tmp_path / "x.csv").exists()
    assert [entry.name for entry in tmp_path.iterdir()] == ["x.csv"]
    assert (tmp_path / "x.csv").read_text() == "new"


@pytest.mark.parametrize("failure", [RuntimeError, KeyboardInterrupt])
def test_interrupted_writing_leaves_the_old_file_and_nothing_else(tmp_path, failure):
    path = tmp_path / "x.exr"
    path.write_text("old")
    with pytest.raises(failure), written_whole(path) as beside:
        beside.write_text("half")
        raise failure
    assert path.read_text() == "old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["x.exr"]


def test_existing_file_tells_missing_from_folder(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        existing_file(tmp_path / "x")
    with pytest.raises(InputError, match=r"(?s)not a file.*found: a folder.*expected: a file.*name a file in it"):
        existing_file(tmp_path)


def test_text_of_two_encodings(tmp_path):
    for encoding in ("utf-8", "utf-8-sig", "latin-1"):
        (tmp_path / "x.txt").write_bytes("Grün".encode(encoding))
        assert read_text(tmp_path / "x.txt") == "Grün"


def test_binary_is_not_text(tmp_path):
    (tmp_path / "x.txt").write_bytes(b"a\0b")
    with pytest.raises(InputError, match="not a text file"):
        read_text(tmp_path / "x.txt")


def test_a_full_disk_is_said_and_leaves_the_old_file(tmp_path, room_for):
    path = tmp_path / "x.csv"
    path.write_text("old")
    with (
        room_for(1000),
        pytest.raises(InputError, match="no room for the file") as caught,
        written_whole(path) as beside,
    ):
        beside.write_bytes(bytes(5000))
    assert caught.value.file == path and caught.value.hint and "again" in caught.value.hint
    assert path.read_text() == "old" and [entry.name for entry in tmp_path.iterdir()] == ["x.csv"]


def test_other_failures_of_the_system_keep_their_own_words(tmp_path):
    with pytest.raises(PermissionError), written_whole(tmp_path / "x.csv"):
        raise PermissionError(1, "Operation not permitted")


@pytest.mark.parametrize("name", ["x.h5", "x.y.toml", "no-suffix", ".writable"])
def test_what_is_being_written_is_known_by_its_name(tmp_path, name):
    path = tmp_path / "deep" / name
    path.parent.mkdir()
    with written_whole(path) as beside:
        assert half_written(tmp_path) == (beside,)
        assert half_written(tmp_path, (".h5",)) == ((beside,) if name in ("x.h5", ".writable") else ())
    # The trial of `made_folder` has no place of its own to stay in.
    assert half_written(tmp_path) == ((path,) if name == ".writable" else ())


@pytest.mark.parametrize("name", [".x.h5", ".0123abcd.h5", "x.0123abcd.h5", ".x.0123ABCD.h5", ".writable.h5"])
def test_other_hidden_files_are_nobodys_leftovers(tmp_path, name):
    (tmp_path / name).touch()
    assert half_written(tmp_path) == ()
