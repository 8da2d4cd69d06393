"""A catalogue on an SSH server: a real one on loopback, known by its key."""

import numpy as np
import pytest
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.records.query import Query
from metamer.runtime import remote
from metamer.runtime.errors import InputError, UnknownNameError

paramiko = pytest.importorskip("paramiko", reason="paramiko is in the extra `remote`")

from ssh_store import served_by_ssh  # noqa: E402

IDS = ("paint/grey", "paint/red")


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A home with a key of its own, and without any server that it knows."""
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.delenv("SSH_AUTH_SOCK", raising=False)
    (tmp_path / "home" / ".ssh").mkdir(parents=True)
    return tmp_path / "home" / ".ssh"


@pytest.fixture
def store(tmp_path, home, write_matt):
    for number, name in enumerate(IDS):
        write_matt(tmp_path / "srv" / "cat", name, 0.2 + 0.3 * number)
    mine, host = paramiko.ECDSAKey.generate(), paramiko.ECDSAKey.generate()
    mine.write_private_key_file(str(home / "id_ecdsa"))
    with served_by_ssh(tmp_path / "srv", host, mine) as store:
        store.line = f"[127.0.0.1]:{store.port} {host.get_name()} {host.get_base64()}\n"
        store.url = f"sftp://someone@127.0.0.1:{store.port}/cat"
        yield store
        for system, _ in remote._systems.values():
            if "sftp" in system.protocol:
                system.client.close()
        remote._systems.clear()


def test_it_answers_as_the_folder_does(store, home, tmp_path):
    (home / "known_hosts").write_text(store.line)
    there, here = Catalogue.open(store.url), Catalogue.open(tmp_path / "srv" / "cat")
    assert there.ids() == here.ids() == IDS and set(there.verify().values()) == {None}
    for query in (Query(), Query(near=(50.0, 0.0, 0.0), limit=1)):
        both = [[vars(one) | {"path": ""} for one in catalogue.query(query)] for catalogue in (there, here)]
        assert both[0] == both[1]
    assert np.array_equal(there["paint/red"].spectrum().samples, here["paint/red"].spectrum().samples)
    with pytest.raises(UnknownNameError, match="paint/blue"):
        there.load("paint/blue")


def test_a_server_that_nobody_knows_or_another_in_its_place_is_refused(store, home):
    other = paramiko.ECDSAKey.generate()
    for line in ("", f"[127.0.0.1]:{store.port} {other.get_name()} {other.get_base64()}\n"):
        (home / "known_hosts").write_text(line)
        with pytest.raises(InputError, match=r"access is denied\n.*not in ~/\.ssh/known_hosts"):
            Catalogue.open(store.url)
        assert store.asked == []


def test_a_key_that_the_server_does_not_take_is_refused(store, home):
    (home / "known_hosts").write_text(store.line)
    paramiko.ECDSAKey.generate().write_private_key_file(str(home / "id_ecdsa"))
    with pytest.raises(InputError, match="Authentication"):
        Catalogue.open(store.url)
