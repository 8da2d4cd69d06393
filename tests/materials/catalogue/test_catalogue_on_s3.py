"""A catalogue in an S3 store: a real server on loopback, asked through one that counts its requests and fails."""

import os
import socket
import subprocess
import sys
import time

import numpy as np
import pytest
from faulty_store import served
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.records.query import Query
from metamer.materials.records.record_head import HEAD_BYTES
from metamer.runtime import remote
from metamer.runtime.errors import InputError, UnknownNameError
from patience import patient

pytest.importorskip("moto", reason="moto, an S3 server, is not installed: make test installs it")
s3fs = pytest.importorskip("s3fs", reason="s3fs is in the extra `remote`")

pytestmark = pytest.mark.slow
IDS = ("paint/grey", "paint/red", "wall/white")
# Seconds that a server may need to begin, on a machine that does other things.
BEGINS_S = 60
KEYS = {"AWS_ACCESS_KEY_ID": "any", "AWS_SECRET_ACCESS_KEY": "any", "AWS_DEFAULT_REGION": "us-east-1"}


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    """Address of an S3 server, which ends with the tests."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    words = tmp_path_factory.mktemp("s3") / "words.txt"
    command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
    with words.open("w") as said:
        process = subprocess.Popen(command, stdout=said, stderr=said, env=os.environ | KEYS)
    try:
        until = time.monotonic() + patient(BEGINS_S)
        while True:
            try:
                socket.create_connection(("127.0.0.1", port), timeout=1).close()
                break
            except OSError:
                assert process.poll() is None, words.read_text()
                assert time.monotonic() < until, f"no S3 server after {BEGINS_S} s: {words.read_text()}"
                time.sleep(0.05)
        yield f"127.0.0.1:{port}"
    finally:
        process.kill()
        process.wait(timeout=patient(30))


@pytest.fixture
def store(server, monkeypatch, tmp_path):
    """Proxy between Metamer and the server, which can be told to fail."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    with served(upstream=server) as store:
        for name, value in (KEYS | {"AWS_ENDPOINT_URL": f"http://{store.address}", "AWS_MAX_ATTEMPTS": "1"}).items():
            monkeypatch.setenv(name, value)
        s3fs.S3FileSystem.clear_instance_cache()
        remote._systems.clear()
        yield store
        s3fs.S3FileSystem.clear_instance_cache()
        remote._systems.clear()


@pytest.fixture
def folder(tmp_path, write_matt):
    for number, name in enumerate(IDS):
        write_matt(tmp_path / "cat", name, 0.2 + 0.3 * number)
    return tmp_path / "cat"


@pytest.fixture
def behind(store, server):
    """The server itself, to write to."""
    return s3fs.S3FileSystem(endpoint_url=f"http://{server}", skip_instance_cache=True)


@pytest.fixture
def catalogue(store, folder, behind):
    """The catalogue there; what was asked until it is open does not count."""
    if not behind.exists("shelf"):
        behind.mkdir("shelf")
    behind.put(f"{folder}/", "shelf/lib/cat/", recursive=True)
    opened = Catalogue.open("s3://shelf/lib/cat")
    assert [one[:2] for one in store.asked] == [("GET", "/shelf/lib/cat/catalogue.toml")]
    store.asked.clear()
    return opened


def test_heads_are_one_list_and_one_range_each(catalogue, store, folder):
    heads, here = catalogue.query(), Catalogue.open(folder).query()
    assert [vars(one) | {"path": ""} for one in heads] == [vars(one) | {"path": ""} for one in here]
    assert heads[0].path == "s3://shelf/lib/cat/paint/grey.h5"
    listed, *ranges = store.asked
    assert "list-type=2" in listed[1] and "prefix=lib%2Fcat" in listed[1]
    sizes = {f"/shelf/lib/cat/{name}.h5": (folder / f"{name}.h5").stat().st_size for name in IDS}
    assert sorted(ranges) == sorted(("GET", path, min(HEAD_BYTES, size)) for path, size in sizes.items())
    store.asked.clear()
    assert catalogue.query() == heads and len(store.asked) == 1


def test_a_record_is_asked_for_its_size_and_then_read_at_once(catalogue, store, folder):
    found = catalogue.load("paint/red")
    assert np.array_equal(found.spectrum().samples, Catalogue.open(folder)["paint/red"].spectrum().samples)
    size = (folder / "paint/red.h5").stat().st_size
    asked = [(method, path.partition("?")[0], read) for method, path, read in store.asked]
    assert asked == [("HEAD", "/shelf/lib/cat/paint/red.h5", 0), ("GET", "/shelf/lib/cat/paint/red.h5", size)]


def test_it_verifies_and_a_change_there_is_seen(catalogue, behind, write_matt, tmp_path):
    assert set(catalogue.verify().values()) == {None}
    before, state = catalogue.summary("paint/red").lab, catalogue.state("paint/red")
    changed = write_matt(tmp_path / "other", "paint/red", 0.9)
    behind.put(str(changed), "shelf/lib/cat/paint/red.h5")
    assert catalogue.summary("paint/red").lab != before and catalogue.query(Query(ids=("paint/red",)))[0].lab != before
    assert catalogue.state("paint/red") != state
    with pytest.raises(UnknownNameError, match="paint/blue"):
        catalogue.load("paint/blue")


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("cut", "cannot be reached or read"),
        # S3 gives a checksum with the answer.
        ("short", "checksum"),
        ("slow", "nothing in 0.5 s"),
        ("403", "access is denied"),
        ("404", "the file is gone"),
        ("500", "cannot be reached or read"),
        ("larger", "the answer is cut short"),
    ],
)
def test_a_fault_of_the_store_is_a_refusal_that_names_the_file(catalogue, store, monkeypatch, fault, words):
    monkeypatch.setattr(remote, "ANSWER_S", 0.5 if fault == "slow" else 30.0)
    store.fault = fault
    with pytest.raises(InputError, match=words) as refused:
        catalogue.load("paint/red")
    assert "s3://shelf/lib/cat/paint/red.h5" in str(refused.value) and "expected: " in str(refused.value)
    unusable = []
    if fault not in ("slow", "cut"):
        catalogue.query(unusable=unusable)
        assert len(unusable) == (0 if fault == "larger" else 3)
    store.fault = ""
    store.go_on.set()
    assert catalogue.load("paint/red").id == "paint/red"


def test_a_bucket_that_is_not_there_or_a_server_that_is_not_is_a_refusal(store, server, monkeypatch):
    with pytest.raises(InputError, match="not a catalogue"):
        Catalogue.open("s3://nowhere/cat")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://127.0.0.1:{free.getsockname()[1]}")
        s3fs.S3FileSystem.clear_instance_cache()
        remote._systems.clear()
        with pytest.raises(InputError, match="cannot be reached or read"):
            Catalogue.open("s3://shelf/lib/cat")
