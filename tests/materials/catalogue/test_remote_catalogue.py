"""Catalogues behind a URL: what is read of them, how often the store is asked, and what its faults come to."""

import importlib.util
import pickle
import shutil
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import fsspec
import numpy as np
import pytest
from faulty_store import served
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.intake.importing import import_sources
from metamer.materials.records import hdf5_tree, stored_array
from metamer.materials.records.query import Query
from metamer.materials.records.record import write_record
from metamer.materials.records.record_head import HEAD_BYTES
from metamer.materials.records.verification import verify_catalogue
from metamer.runtime import remote
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.runtime.remote import RemotePath, UnlistedError, place

IDS = ("paint/grey", "paint/red", "wall/white")


@pytest.fixture
def folder(tmp_path, write_matt):
    for number, name in enumerate(IDS):
        write_matt(tmp_path / "cat", name, 0.2 + 0.3 * number)
    return tmp_path / "cat"


@pytest.fixture
def in_memory(folder):
    """The catalogue in fsspec's memory."""
    system = fsspec.filesystem("memory")
    system.put(f"{folder}/", "/shelf/cat/", recursive=True)
    yield "memory://shelf/cat"
    system.rm("/shelf", recursive=True)


def zipped(folder, path, below=""):
    with zipfile.ZipFile(path, "w") as packed:
        for file in sorted(folder.rglob("*.*")):
            packed.write(file, f"{below}{file.relative_to(folder).as_posix()}")
    return path


def same(there, here):
    """Two catalogues answer alike: ids, heads and contents."""
    assert there.ids() == here.ids() == IDS and "paint/red" in list(there)
    for query in (Query(), Query(families=("paint",), near=(50.0, 0.0, 0.0), limit=1)):
        both = [[vars(one) | {"path": ""} for one in catalogue.query(query)] for catalogue in (there, here)]
        assert both[0] == both[1]
    for name in IDS:
        assert np.array_equal(there[name].spectrum().samples, here[name].spectrum().samples)
        assert there.state(name) == there.state(name)
    assert set(there.verify().values()) == {None} and there.summary("wall/white").id == "wall/white"


def test_a_catalogue_in_memory_and_one_in_a_zip_file_answer_as_the_folder_does(folder, in_memory, tmp_path):
    here = Catalogue.open(folder)
    same(Catalogue.open(in_memory), here)
    flat, below = zipped(folder, tmp_path / "flat.zip"), zipped(folder, tmp_path / "below.zip", "lib/cat/")
    for url in (f"zip://::{flat}", f"zip::{flat}", f"zip://lib/cat::{below}", f"zip://lib/cat::file://{below}"):
        same(Catalogue.open(url), here)


def test_every_declared_error_is_measured_again(in_memory):
    found = verify_catalogue(Catalogue.open(in_memory).folder)
    assert [one.id for one in found.intact] == list(IDS) and found.strays == ()
    assert all(one.measured is not None for one in found.results)


def test_a_change_is_seen_at_once(folder, in_memory, write_matt, tmp_path):
    catalogue = Catalogue.open(in_memory)
    before, state = catalogue.summary("paint/red").lab, catalogue.state("paint/red")
    changed = write_matt(tmp_path / "other", "paint/red", 0.9)
    system = fsspec.filesystem("memory")
    system.pipe("/shelf/cat/paint/red.h5", changed.read_bytes())
    system.rm("/shelf/cat/paint/grey.h5")
    assert catalogue.ids() == IDS[1:] and catalogue.state("paint/red") != state
    assert {one.id: one.lab for one in catalogue.query()}["paint/red"] != before
    with pytest.raises(UnknownNameError, match="paint/grey"):
        catalogue.load("paint/grey")


def test_a_damaged_record_is_named_by_its_url(in_memory):
    system = fsspec.filesystem("memory")
    data = bytearray(system.cat("/shelf/cat/paint/red.h5"))
    middle = len(data) * 2 // 3
    data[middle : middle + 50] = bytes(50)
    system.pipe("/shelf/cat/paint/red.h5", bytes(data))
    system.pipe("/shelf/cat/wall/white.h5", system.cat("/shelf/cat/wall/white.h5")[:1500])
    system.pipe("/shelf/cat/paint/grey.h5", b"")
    found = Catalogue.open(in_memory).verify()
    assert all(isinstance(found[name], InputError) for name in IDS)
    assert all(f"memory://shelf/cat/{name}.h5" in str(found[name]) for name in IDS)
    unusable = []
    assert [one.id for one in Catalogue.open(in_memory).query(unusable=unusable)] == ["paint/red", "wall/white"]
    assert "memory://shelf/cat/paint/grey.h5" in str(unusable[0])


def test_nothing_is_written_behind_a_url(in_memory, folder, tmp_path):
    catalogue = Catalogue.open(in_memory)
    before = dict(fsspec.filesystem("memory").find("/shelf", detail=True))
    material = Catalogue.open(folder).load("paint/red")
    for write in (
        lambda: catalogue.add(material),
        lambda: write_record(material, catalogue.folder / "paint/new.h5"),
        lambda: Catalogue.open("memory://shelf/new", create=True),
        lambda: import_sources([tmp_path / "nothing"], in_memory),
        lambda: catalogue.path("paint/red").unlink(),
        lambda: (catalogue.folder / "catalogue.toml").write_text("schema = 2"),
        lambda: shutil.copy(folder / "paint/red.h5", catalogue.folder),
    ):
        with pytest.raises(InputError, match="memory://shelf") as refused:
            write()
        assert "copy it with the store's own tool" in str(refused.value)
    with pytest.raises(ValueError, match="null"):
        Path(catalogue.folder).mkdir()
    assert dict(fsspec.filesystem("memory").find("/shelf", detail=True)) == before


def test_a_url_is_told_from_a_path():
    for url in ("s3://bucket/paints", "memory://shelf", "zip::s3://bucket/cat.zip", "zip://::cat.zip", "sftp://host/x"):
        assert isinstance(place(url), RemotePath) and str(place(url)).endswith(url.rpartition("::")[2])
    for path in ("cat", "C:/cat", "C:\\cat", "./s3", Path("a/b"), "a:b"):
        assert place(path) == Path(path) and not isinstance(place(path), RemotePath)
    root = place("zip://lib::s3://bucket/cat.zip")
    file = root / "paint/red.h5"
    assert str(file) == "zip://lib/paint/red.h5::s3://bucket/cat.zip" and file.name == "red.h5" and file.suffix == ".h5"
    assert pickle.loads(pickle.dumps(file)) == file and file.parent == root / "paint" and hash(file.parent.parent)
    assert file != root / "paint/grey.h5" and file != Path("red.h5") and Path("red.h5") != file
    for secret in ("ftp://me:word@host/x", "https://host/x?key=word"):
        with pytest.raises(InputError, match="credentials") as refused:
            place(secret)
        assert "word" not in str(refused.value).replace("a password", "")


def test_what_is_missing_is_said(tmp_path):
    with pytest.raises(InputError, match="not a catalogue"):
        Catalogue.open("memory://nowhere")
    with pytest.raises(InputError, match="cannot be reached or read"):
        Catalogue.open("nosuch://host/cat")
    with pytest.raises(InputError, match="does not say how large"):
        place("memory://nowhere")._size_in({"type": "file"})


@pytest.mark.skipif(importlib.util.find_spec("gcsfs") is not None, reason="gcsfs is installed, which is to be missing")
def test_a_package_that_is_missing_is_named_with_the_extra():
    with pytest.raises(InputError, match=r"(?s)gcs://bucket/cat/catalogue.toml.*gcsfs.*metamer-colour\[remote\]"):
        Catalogue.open("gcs://bucket/cat")


@pytest.fixture
def read_anew(monkeypatch, tmp_path):
    """Names of files whose heads the store was asked for; the cache is the test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    asked, beginnings = [], RemotePath.beginnings

    def counted(folder, files, count):
        asked.extend(file.name for file in files)
        return beginnings(folder, files, count)

    monkeypatch.setattr(RemotePath, "beginnings", counted)
    return asked


def test_heads_are_kept_and_believed_while_the_store_lists_the_same_file(folder, tmp_path, read_anew, write_matt):
    changed = write_matt(tmp_path / "other", "paint/red", 0.9)
    for file in (folder / "paint/red.h5", changed):
        # HDF5 does not mind, and both are of one size.
        file.write_bytes(file.read_bytes().ljust(4000, b"\0"))
    path = zipped(folder, tmp_path / "cat.zip")
    before = Catalogue.open(f"zip://::{path}").query()
    assert len(read_anew) == 3
    read_anew.clear()
    assert Catalogue.open(f"zip://::{path}").query() == before and read_anew == []
    (folder / "paint/red.h5").write_bytes(changed.read_bytes())
    (folder / "wall/white.h5").unlink()
    zipped(folder, path)
    after = Catalogue.open(f"zip://::{path}").query()
    assert read_anew == ["paint/red.h5"] and [one.id for one in after] == ["paint/grey", "paint/red"]
    assert after[0] == before[0] and after[1].lab == Catalogue.open(folder).summary("paint/red").lab != before[1].lab
    assert list(Catalogue.open(f"zip://::{path}").query()) == list(after) and len(read_anew) == 1


def test_surfaces_of_a_pattern_are_told_by_heads_that_are_read_at_once(folder, tmp_path, read_anew, monkeypatch):
    path = zipped(folder, tmp_path / "cat.zip")
    catalogue = Catalogue.open(f"zip://::{path}")
    monkeypatch.setattr(RemotePath, "first_bytes", lambda *_: pytest.fail("read one by one"))
    assert catalogue.match_surfaces("paint/*") == ("paint/grey", "paint/red")
    assert read_anew == ["paint/grey.h5", "paint/red.h5"]
    assert len(catalogue.query()) == 3 and read_anew[2:] == ["wall/white.h5"]
    assert [one.id for one in catalogue.summaries(IDS)] == list(IDS) and len(read_anew) == 3


@pytest.mark.parametrize("damage", [lambda data: data[:-9], lambda data: data.replace(b"0", b"1"), lambda data: b""])
def test_a_cache_of_heads_that_is_damaged_is_read_anew(folder, tmp_path, read_anew, damage):
    path = zipped(folder, tmp_path / "cat.zip")
    before = Catalogue.open(f"zip://::{path}").query()
    (kept,) = (tmp_path / "cache" / "metamer" / "remote-heads").iterdir()
    kept.write_bytes(damage(kept.read_bytes()))
    assert Catalogue.open(f"zip://::{path}").query() == before and len(read_anew) == 6


def test_a_head_that_is_useless_or_of_a_file_without_an_old_time_is_never_kept(in_memory, read_anew, monkeypatch):
    fsspec.filesystem("memory").pipe("/shelf/cat/paint/odd.h5", b"no head" + bytes(5000))
    catalogue = Catalogue.open(in_memory)
    for _ in range(2):
        assert len(catalogue.query(unusable=[])) == 3 and len(read_anew) == 4
        read_anew.clear()
    monkeypatch.setattr(remote, "_SETTLED_S", -1.0)
    for asked in (4, 1):
        assert len(catalogue.query(unusable=[])) == 3 and len(read_anew) == asked
        read_anew.clear()


# Over HTTP.


@pytest.fixture
def store(folder):
    pytest.importorskip("aiohttp", reason="aiohttp, which fsspec asks web servers by, is in the extra `remote`")
    with served(folder) as store:
        yield store


def opened(store):
    catalogue = Catalogue.open(f"http://{store.address}")
    store.asked.clear()
    return catalogue


def test_a_head_is_one_range_and_a_small_record_another(store, folder):
    catalogue = opened(store)
    size = (folder / "paint/red.h5").stat().st_size
    assert (catalogue.folder / "paint/red.h5").first_bytes(HEAD_BYTES)[:1] == b"{"
    assert store.asked == [("GET", "/paint/red.h5", min(HEAD_BYTES, size))]
    store.asked.clear()
    catalogue.load("paint/red")
    assert store.asked == [("HEAD", "/paint/red.h5", 0), ("GET", "/paint/red.h5", size)]


def test_a_web_server_lists_nothing_and_gives_what_is_named(store, folder):
    catalogue = opened(store)
    same_spectrum = catalogue["paint/red"].spectrum().samples
    assert np.array_equal(same_spectrum, Catalogue.open(folder)["paint/red"].spectrum().samples)
    with pytest.raises(UnlistedError, match=r"zip://::https://HOST/FILE\.zip"):
        catalogue.query()
    with pytest.raises(InputError, match="no such material") as refused:
        catalogue.load("paint/blue")
    assert f"http://{store.address}/paint/blue.h5" in str(refused.value)


def test_a_zip_file_on_a_web_server_is_a_whole_catalogue(store, folder):
    zipped(folder, folder / "cat.zip")
    same(Catalogue.open(f"zip://::http://{store.address}/cat.zip"), Catalogue.open(folder))


@pytest.mark.parametrize("fault", ["cut", "short", "slow", "403", "404", "500"])
def test_a_fault_of_the_store_behind_a_zip_file_is_a_refusal_too(store, folder, monkeypatch, fault):
    monkeypatch.setattr(remote, "ANSWER_S", 0.5 if fault == "slow" else 20.0)
    zipped(folder, folder / "cat.zip")
    store.fault = fault
    with pytest.raises(InputError) as refused:
        Catalogue.open(f"zip://::http://{store.address}/cat.zip").query()
    assert f"catalogue.toml::http://{store.address}/cat.zip" in str(refused.value)
    store.fault = ""
    store.go_on.set()
    assert len(Catalogue.open(f"zip://::http://{store.address}/cat.zip").query()) == 3


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("cut", "cannot be reached or read"),
        ("short", "the answer is cut short"),
        ("slow", "nothing in 0.5 s"),
        ("whole", "the store gives whole files"),
        ("403", "access is denied"),
        ("404", "the file is gone"),
        ("500", "cannot be reached or read"),
        ("larger", "the answer is cut short"),
    ],
)
def test_a_fault_of_the_store_is_a_refusal_that_names_the_file(store, monkeypatch, fault, words):
    catalogue = opened(store)
    monkeypatch.setattr(remote, "ANSWER_S", 0.5 if fault == "slow" else 20.0)
    if fault == "whole":
        monkeypatch.setattr(remote, "BLOCK_BYTES", 1024)
    store.fault = fault
    with pytest.raises(InputError, match=words) as refused:
        catalogue.load("paint/red")
    text = str(refused.value)
    assert f"http://{store.address}/paint/red.h5" in text and "expected: " in text and "try: " in text
    store.fault = ""
    store.go_on.set()
    assert catalogue.load("paint/red").id == "paint/red"


def test_large_arrays_are_read_block_by_block_and_held_to_their_digests(store, folder, monkeypatch):
    monkeypatch.setattr(stored_array, "BLOCK_BYTES", 64 << 10)
    monkeypatch.setattr(hdf5_tree, "LARGE_BYTES", 1 << 18)
    monkeypatch.setattr(remote, "BLOCK_BYTES", 1 << 14)
    here = Catalogue.open(folder)
    stack = np.random.default_rng(0).random((64, 1 << 13)).astype(np.float32)
    record = here.load("paint/red")
    here.add(type(record)(**{**vars(record), "id": "paint/cloth", "original": {"stack": stack}}))
    size = (folder / "paint/cloth.h5").stat().st_size
    catalogue = opened(store)
    found = catalogue.load("paint/cloth").original["stack"]
    read = sum(one[2] for one in store.asked)
    assert read < size // 4, (read, size)
    store.asked.clear()
    assert np.array_equal(found.read(slice(40, 42)), stack[40:42])
    assert sum(one[2] for one in store.asked) < size // 4 and len(store.asked) < 20
    assert np.array_equal(np.asarray(found), stack)
    # Numbers of one block are not what they were.
    data = bytearray((folder / "paint/cloth.h5").read_bytes())
    data[size // 2 : size // 2 + 64] = bytes(64)
    (folder / "paint/cloth.h5").write_bytes(data)
    with pytest.raises(InputError, match=r"paint/cloth\.h5"):
        np.asarray(catalogue.load("paint/cloth").original["stack"])
    store.fault = "short"
    with pytest.raises(InputError, match="the answer is cut short"):
        found.read(slice(0, 2))


def test_several_threads_read_one_file_and_what_is_kept_of_it_goes_with_a_change(store, folder, monkeypatch):
    monkeypatch.setattr(remote, "BLOCK_BYTES", 1 << 10)
    data = np.random.default_rng(1).integers(0, 256, 1 << 15, np.uint8).tobytes()
    (folder / "paint/numbers.h5").write_bytes(data)
    path = opened(store).folder / "paint/numbers.h5"

    def read(first):
        with path.open("rb") as file:
            parts = []
            for at in range(first, len(data), 700):
                file.seek(at)
                parts.append(file.read(300))
        return parts == [data[at : at + 300] for at in range(first, len(data), 700)]

    with ThreadPoolExecutor(4) as threads:
        assert all(threads.map(read, range(8)))
    assert 32 <= sum(one[0] == "GET" for one in store.asked) < 300
    data = data[:20_000][::-1]
    (folder / "paint/numbers.h5").write_bytes(data)
    assert read(0)
