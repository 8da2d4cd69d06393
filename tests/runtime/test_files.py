"""Files that are either whole or not there."""

import errno
import os
import threading
from pathlib import Path

import pytest
from metamer.runtime.errors import InputError, NoRoomError, UsageError
from metamer.runtime.files import (
    check_outputs,
    check_writable,
    existing_file,
    half_written,
    of_the_system,
    read_text,
    written_whole,
)


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


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no named pipes")
def test_a_pipe_is_sent_the_whole_file_and_stays_a_pipe(tmp_path):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    heard = []
    listener = threading.Thread(target=lambda: heard.append(path.read_bytes()), daemon=True)
    listener.start()
    check_writable(path)
    with written_whole(path) as beside:
        beside.write_bytes(b"all of it" * 9999)
    listener.join(20)
    assert heard == [b"all of it" * 9999]
    assert path.is_fifo() and [entry.name for entry in tmp_path.iterdir()] == ["pipe"]


def test_a_device_takes_what_it_is_sent_and_stays_a_device():
    before = Path(os.devnull).stat()
    check_writable(os.devnull)
    with written_whole(os.devnull) as beside:
        beside.write_text("gone")
    after = Path(os.devnull).stat()
    assert (before.st_mode, before.st_rdev, before.st_ino) == (after.st_mode, after.st_rdev, after.st_ino)
    assert half_written(Path(os.devnull).parent) == ()


@pytest.mark.skipif(not Path("/dev/full").is_char_device(), reason="the system has no device that is always full")
def test_a_device_without_room_is_named():
    with (
        pytest.raises(NoRoomError, match=r"(?s)/dev/full: cannot be written to.*found: No space"),
        written_whole("/dev/full") as beside,
    ):
        beside.write_text("too much")


@pytest.mark.parametrize("there", [True, False], ids=["to a file", "to nothing yet"])
def test_a_link_stays_a_link_and_what_it_leads_to_is_written(there, tmp_path):
    (tmp_path / "far").mkdir()
    target, link = tmp_path / "far" / "x.csv", tmp_path / "link.csv"
    if there:
        target.write_text("old")
    link.symlink_to(Path("far") / "x.csv")
    check_writable(link)
    with written_whole(link) as beside:
        beside.write_text("new")
        assert beside.suffix == ".csv" and beside.parent == target.parent
    assert link.is_symlink() and target.read_text() == "new" and not target.is_symlink()
    with pytest.raises(RuntimeError), written_whole(link) as beside:
        raise RuntimeError
    assert sorted(entry.name for entry in target.parent.iterdir()) == ["x.csv"]


def test_a_link_into_a_folder_that_is_not_there_is_refused_by_the_folder(tmp_path):
    (tmp_path / "link.csv").symlink_to(tmp_path / "far" / "x.csv")
    with pytest.raises(InputError, match="far: no such folder"), written_whole(tmp_path / "link.csv"):
        pass


def refusing(monkeypatch, reason):
    """Stands in for a system that refuses to read, which it never refuses root."""

    def refuse(path, *_, **__):
        raise OSError(reason, os.strerror(reason), str(path))

    monkeypatch.setattr(Path, "read_bytes", refuse)


@pytest.mark.parametrize(
    "reason, hint", [(errno.EACCES, "who may read"), (errno.EIO, "the disk"), (errno.EMFILE, "ulimit")]
)
def test_a_text_that_may_not_be_read_is_named_with_what_to_do(tmp_path, monkeypatch, reason, hint):
    path = tmp_path / "secret.toml"
    path.write_text("a = 1")
    refusing(monkeypatch, reason)
    with pytest.raises(InputError) as caught:
        read_text(path, "a TOML file")
    assert caught.value.file == path and caught.value.expected == "a TOML file" and hint in str(caught.value)
    assert caught.value.found == os.strerror(reason) and "Errno" not in str(caught.value)


def test_a_name_that_is_too_long_is_said(tmp_path):
    with pytest.raises(InputError, match=r"(?s)cannot be read or written.*try: give it a shorter name"):
        existing_file(tmp_path / ("x" * 5000))


@pytest.mark.parametrize(
    "reason, kind, words",
    [
        (OSError(errno.EACCES, "Permission denied", "a.txt"), InputError, "a.txt: cannot be read or written"),
        (OSError(errno.ENOSPC, "No space left on device", "a.txt"), NoRoomError, "make room"),
        (OSError(errno.EACCES, "Permission denied", "a.txt", None, "b.txt"), InputError, "Permission denied; to b.txt"),
        (OSError(errno.ENOSPC, "No space left on device"), NoRoomError, "standard output: cannot be"),
        (OSError("told by a library"), InputError, "told by a library"),
    ],
)
def test_a_failure_of_the_system_names_its_file_and_what_to_do(reason, kind, words):
    said = of_the_system(reason, "standard output")
    assert type(said) is kind and words in str(said) and "Errno" not in str(said)


def test_links_that_lead_to_themselves_are_refused_and_stay(tmp_path):
    one, other = tmp_path / "one.html", tmp_path / "other.html"
    one.symlink_to(other)
    other.symlink_to(one)
    for refuse in (check_writable, lambda path: written_whole(path).__enter__()):
        with pytest.raises(InputError, match=r"one\.html: a link that leads to itself"):
            refuse(one)
    assert one.is_symlink() and other.is_symlink()


@pytest.mark.parametrize("named", ["plain", "by a link", "by another way", "one reading", "in its folder"])
def test_what_a_command_reads_it_does_not_write_over(tmp_path, named):
    read = tmp_path / "lots" / "lot.csv"
    read.parent.mkdir()
    read.write_text("1")
    outputs, inputs = [read], [read]
    if named == "by a link":
        outputs = [tmp_path / "link.csv"]
        outputs[0].symlink_to(read)
    elif named == "by another way":
        outputs = [tmp_path / "lots" / ".." / "lots" / "lot.csv"]
    elif named == "one reading":
        inputs = [f"{read}#red"]
    elif named == "in its folder":
        inputs = ["paint/red", read.parent]
    with pytest.raises(UsageError, match="would write over it"):
        check_outputs(outputs, inputs)
    check_outputs([tmp_path / "lots" / "page.html"], inputs)
    assert read.read_text() == "1"


def test_two_outputs_have_a_file_each_and_may_share_a_device(tmp_path):
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "page")
    check_outputs([tmp_path / "page", tmp_path / "table"])
    check_outputs([os.devnull, os.devnull])
    for twice in (["page", "page"], ["page", "./page"], ["page", "link"]):
        with pytest.raises(UsageError, match="one file for two outputs"):
            check_outputs([tmp_path / name for name in twice])
