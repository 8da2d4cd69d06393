"""Inputs that a person may name to import, and what archives may not do."""

import os
import stat
import struct
import zipfile

import fsspec
import pytest
from metamer.materials.formats.input_file import InputFile
from metamer.materials.intake import archives
from metamer.materials.intake.inputs import inputs_of
from metamer.materials.records.record import MARKER
from metamer.materials.records.source import Rejected
from metamer.runtime.errors import InputError

SPECTRA = "# reflectance\nwavelength_nm,red\n400,0.1\n500,0.2\n600,0.7\n700,0.8\n"


def found(*words):
    """Names of files with their content, and names of what was rejected with the reason."""
    with inputs_of(words) as files:
        return {file.name: str(file.reason) if isinstance(file, Rejected) else file.path.read_text() for file in files}


@pytest.fixture
def tree(tmp_path):
    for name in ("b.csv", "a/c.csv", "a/deep/d.csv", ".hidden/e.csv", "a/.f.csv", "__MACOSX/g.csv", "a/notes.md"):
        place = tmp_path / "tree" / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(name)
    return tmp_path / "tree"


def zipped(path, members):
    """A zip file of (name or ZipInfo, content) pairs."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members:
            archive.writestr(name, content)
    return path


def test_folder_with_all_below_it_but_what_is_hidden(tree):
    assert list(found(tree).values()) == ["a/c.csv", "a/deep/d.csv", "a/notes.md", "b.csv"]


def test_hidden_file_is_read_when_it_is_named_itself(tree):
    assert list(found(tree / "a/.f.csv").values()) == ["a/.f.csv"]


def test_the_same_file_twice_is_one_file(tree):
    assert len(found(tree / "b.csv", tree / "b.csv", tree)) == 4


@pytest.mark.parametrize(
    ("pattern", "names"),
    [
        ("*.csv", ["b.csv"]),
        ("**/*.csv", ["a/c.csv", "a/deep/d.csv", "b.csv"]),
        ("a/[cd]*", ["a/c.csv", "a/deep/d.csv"]),
    ],
)
def test_patterns(tree, pattern, names):
    """A folder that fits a pattern stands for all that is in it."""
    assert sorted(found(tree / pattern).values()) == names


def test_a_file_with_the_name_of_a_pattern_is_itself(tmp_path):
    (tmp_path / "a[1].csv").write_text("itself")
    assert list(found(tmp_path / "a[1].csv").values()) == ["itself"]


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("gone.csv", "no such file"),
        ("*.cxf", "no file fits the pattern"),
        ("empty", "nothing to import"),
        ("empty", "try: name the folder"),
        ("broken", "a broken link"),
    ],
)
def test_words_that_stand_for_nothing(tmp_path, word, said):
    (tmp_path / "empty").mkdir()
    (tmp_path / "broken").symlink_to(tmp_path / "nowhere")
    with pytest.raises(InputError, match=said):
        found(tmp_path / word)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes on this system")
def test_pipes_and_circles_of_links_are_passed_over(tree):
    os.mkfifo(tree / "pipe")
    (tree / "a" / "round").symlink_to(tree)
    assert len(found(tree)) == 4


def test_catalogues_are_no_sources(tree):
    """One may lie among what it was made from."""
    (tree / "cat" / "paint").mkdir(parents=True)
    (tree / "cat" / MARKER).touch()
    (tree / "cat" / "paint" / "red.h5").touch()
    assert len(found(tree)) == 4
    with pytest.raises(InputError, match="a catalogue, which is what an import makes"):
        found(tree / "cat")


def test_zip_files_are_looked_into(tmp_path):
    archive = zipped(tmp_path / "set.zip", [("a.csv", SPECTRA), ("deep/b.csv", "b"), (".x", "hidden"), ("d/", "")])
    assert found(archive) == {f"{archive}/a.csv": SPECTRA, f"{archive}/deep/b.csv": "b"}
    assert found(tmp_path) == found(archive)
    assert found(str(tmp_path / "*.zip")) == found(archive)


def test_zip_is_known_by_content(tmp_path):
    archive = zipped(tmp_path / "set.dat", [("a.csv", SPECTRA)])
    assert list(found(archive).values()) == [SPECTRA]


@pytest.mark.parametrize("name", ["set", "run 1.2"])
def test_a_zip_file_without_a_kind_in_its_name_is_looked_into_in_a_folder_too(tmp_path, name):
    archive = zipped(tmp_path / name, [("a.csv", SPECTRA)])
    assert found(tmp_path) == found(archive) == {f"{archive}/a.csv": SPECTRA}


@pytest.mark.parametrize(
    ("name", "member"),
    [
        ("a.xlsx", "x"),
        ("a.zip", "[Content_Types].xml"),
        ("a", "mimetype"),
        ("a.dat", "OOISignatures.xml"),
        ("a.sbsar", "x"),
    ],
)
def test_what_a_program_packed_is_one_file(tmp_path, name, member):
    archive = zipped(tmp_path / name, [(member, "<x/>"), ("a.csv", SPECTRA)])
    for place in (archive, tmp_path):
        with inputs_of([place]) as files:
            assert [file.name for file in files] == [str(archive)]
    outer = zipped(tmp_path / "outer.zip", [(name, archive.read_bytes())])
    with inputs_of([outer]) as files:
        assert [file.name for file in files] == [f"{outer}/{name}"]


def test_nothing_that_was_unpacked_stays(tmp_path):
    archive = zipped(tmp_path / "set.zip", [("a.csv", SPECTRA)])
    with inputs_of([archive]) as (file,):
        assert isinstance(file, InputFile) and file.path.exists()
        assert not file.path.is_relative_to(tmp_path)
        assert file.with_given_name(f"{file.path}: bad") == f"{archive}/a.csv: bad"
    assert not file.path.exists()


def link(name):
    info = zipfile.ZipInfo(name)
    info.external_attr = (stat.S_IFLNK | 0o777) << 16
    return info


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("../out.csv", "leaves the archive"),
        ("a/../../out.csv", "leaves the archive"),
        ("/etc/out.csv", "leaves the archive"),
        ("..\\out.csv", "leaves the archive"),
        ("C:\\out.csv", "leaves the archive"),
        ("c:out.csv", "leaves the archive"),
        ("\\\\host\\share\\out.csv", "leaves the archive"),
        (link("link.csv"), "symbolic link"),
        ("x" * 300 + ".csv", "cannot be unpacked"),
    ],
    ids=str,
)
def test_members_cannot_leave_the_archive(tmp_path, name, said):
    archive = zipped(tmp_path / "set.zip", [(name, "/etc/passwd"), ("good.csv", SPECTRA)])
    before = sorted(tmp_path.rglob("*"))
    files = found(archive)
    assert files.pop(f"{archive}/good.csv") == SPECTRA
    (reason,) = files.values()
    assert said in reason
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_duplicate_names_are_refused(tmp_path):
    archive = zipped(tmp_path / "set.zip", [("a.csv", "first"), ("a.csv", "second"), ("A.CSV", "third")])
    with inputs_of([archive]) as (first, *others):
        assert first.path.read_text() == "first"
        assert [("twice" in str(other.reason)) for other in others] == [True, True]


def test_file_where_another_needs_a_folder(tmp_path):
    archive = zipped(tmp_path / "set.zip", [("a", "file"), ("a/b.csv", "below it")])
    files = found(archive)
    assert files[f"{archive}/a"] == "file"
    assert len(files) == 2


def test_archives_in_archives_are_not_followed_and_that_is_said(tmp_path):
    inner = zipped(tmp_path / "inner", [("a.csv", SPECTRA)])
    archive = zipped(tmp_path / "set.zip", [("inner.zip", inner.read_bytes())])
    assert "inside an archive" in found(archive)[f"{archive}/inner.zip"]


def test_encrypted_members_are_named(tmp_path):
    archive = zipped(tmp_path / "set.zip", [("a.csv", SPECTRA)])
    raw = bytearray(archive.read_bytes())
    for signature, offset in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        raw[raw.index(signature) + offset] |= 1
    archive.write_bytes(raw)
    (reason,) = found(archive).values()
    assert "encrypted" in reason and "password" in reason


def test_bombs_are_refused_before_they_are_unpacked(tmp_path):
    archive = zipped(tmp_path / "bomb.zip", [("a.csv", bytes(64 << 20))])
    (reason,) = found(archive).values()
    assert "too much in the zip file" in reason and "times as large" in reason


@pytest.mark.parametrize(("limit", "said"), [("MOST_BYTES", "GiB"), ("MOST_MEMBERS", "2 files")])
def test_other_limits(tmp_path, monkeypatch, limit, said):
    monkeypatch.setattr(archives, limit, 1)
    archive = zipped(tmp_path / "set.zip", [("a.csv", SPECTRA), ("b.csv", SPECTRA)])
    (reason,) = found(archive).values()
    assert "too much" in reason and said in reason


def test_member_that_is_larger_than_it_says(tmp_path):
    archive = zipped(tmp_path / "set.zip", [("a.csv", SPECTRA * 100)])
    raw = archive.read_bytes()
    size = struct.pack("<I", len(SPECTRA) * 100)
    archive.write_bytes(raw.replace(size, struct.pack("<I", 10)))
    (reason,) = found(archive).values()
    assert "cannot be unpacked" in reason or "larger" in reason


def test_damaged_content_and_cut_archives(tmp_path):
    archive = zipped(tmp_path / "set.zip", [("a.csv", SPECTRA * 50)])
    raw = bytearray(archive.read_bytes())
    raw[60] ^= 0xFF
    (tmp_path / "bad.zip").write_bytes(raw)
    (tmp_path / "cut.zip").write_bytes(raw[:-30])
    (reason,) = found(tmp_path / "bad.zip").values()
    assert "cannot be unpacked" in reason
    (reason,) = found(tmp_path / "cut.zip").values()
    assert "not a readable zip file" in reason


# Addresses of fsspec.


@pytest.fixture
def remote():
    """A folder in memory, gone afterwards."""
    system = fsspec.filesystem("memory")
    system.pipe({"/chart/a.csv": SPECTRA.encode(), "/chart/deep/b.csv": b"b", "/chart/.c.csv": b"hidden"})
    yield "memory://chart"
    system.rm("/chart", recursive=True)


def test_remote_folder_file_and_pattern(remote):
    assert list(found(remote).values()) == [SPECTRA, "b"]
    assert found(f"{remote}/a.csv") == {"memory://chart/a.csv": SPECTRA}
    assert list(found(f"{remote}/**/*.csv").values())[-1] == "b"


def test_members_of_a_zip_file_by_address(tmp_path):
    archive = zipped(tmp_path / "set.zip", [("a.csv", SPECTRA), ("deep/b.csv", "b")])
    assert found(f"zip://a.csv::file://{archive}") == {f"zip://a.csv::file://{archive}": SPECTRA}
    assert list(found(f"zip://::file://{archive}").values()) == [SPECTRA, "b"]


def test_remote_zip_file_is_looked_into(tmp_path, remote):
    archive = zipped(tmp_path / "set.zip", [("a.csv", SPECTRA)])
    fsspec.filesystem("memory").pipe("/chart/set.zip", archive.read_bytes())
    assert found(f"{remote}/set.zip") == {"memory://chart/set.zip/a.csv": SPECTRA}


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("memory://gone", "no such file|cannot be reached"),
        ("nonsense://place", "cannot be reached"),
        ("zip://a.csv::file:///gone.zip", "cannot be reached"),
        ("memory://chart/*.cxf", "no such file"),
    ],
)
def test_addresses_that_lead_nowhere(remote, address, said):
    with pytest.raises(InputError, match=said) as caught:
        found(address)
    assert address in str(caught.value)


def test_remote_names_cannot_leave_the_private_folder(tmp_path):
    archive = zipped(tmp_path / "set.zip", [("../out.csv", "out"), ("good.csv", SPECTRA)])
    with pytest.raises(InputError, match="leaves its folder"):
        found(f"zip://::file://{archive}")
    assert not list(tmp_path.parent.glob("out.csv"))
