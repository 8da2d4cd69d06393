"""An import on a Dask cluster: the same materials, the same bytes, also when a worker dies; what is refused."""

import hashlib
import os
import signal
import socket
import sys
from importlib.util import find_spec

import pytest
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.intake import cluster, import_history
from metamer.materials.intake.importing import ImportInterrupted, import_sources
from metamer.runtime import dask_cluster as spectral_cluster
from metamer.runtime.errors import InputError
from patience import patient

pytestmark = [
    # Imported where it is needed: whoever collects these tests need not wait for it.
    pytest.mark.skipif(find_spec("distributed") is None, reason="Dask is not installed; it is in the extra `cluster`"),
    # Dask closes some of its sockets when Python gets round to it.
    pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"),
]

FAMILY = 'family = "grey"\nkind = "analytic"\n' + "".join(
    f'[[material]]\nname = "n{n}"\nmodel = "lambert"\nreflectance = {{ constant = 0.{n} }}\n' for n in range(1, 7)
)


@pytest.fixture(scope="module")
def workers():
    """Two processes of one thread each; each is started again when it dies, and two that die over one task are many."""
    import dask
    import distributed

    here = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0", "silence_logs": 50}
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 1}),
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, **here) as started,
    ):
        yield started


@pytest.fixture
def source(tmp_path):
    (tmp_path / "grey.toml").write_text(FAMILY)
    return tmp_path / "grey.toml"


def contents(folder):
    """Hashes of what a catalogue holds; not of what it knows of files, which is their times and numbers on the disk."""
    files = [file for file in folder.rglob("*") if file.is_file() and file.name != import_history.FILE]
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


@pytest.mark.stress
def test_a_worker_that_is_killed_in_the_middle_costs_nothing(workers, source, tmp_path):
    struck = []

    def strike(done, total, outcome):
        if not struck:
            struck.append(next(iter(workers.workers.values())).pid)
            os.kill(struck[0], signal.SIGKILL)

    report = import_sources([source], tmp_path / "cat", scheduler=workers.scheduler_address, progress=strike)
    assert struck
    assert {each.id: each.status for each in report.outcomes} == {f"grey/n{n}": "imported" for n in range(1, 7)}
    assert not any(Catalogue.open(tmp_path / "cat").verify().values())
    # The same bytes as at home, in a process of one thread as well.
    import_sources([source], tmp_path / "home", jobs=1, apart=True)
    assert contents(tmp_path / "cat") == contents(tmp_path / "home")
    assert import_sources([source], tmp_path / "cat", scheduler=workers.scheduler_address).count("skipped") == 6


@pytest.mark.stress
def test_a_material_that_kills_every_worker_fails_alone_and_with_a_reason(workers, source, tmp_path, monkeypatch):
    deadly = lambda material, budget, code: os._exit(9)  # noqa: E731  a lambda travels as it is, without this module
    source.write_text(FAMILY[: FAMILY.index("[[material]]", FAMILY.index("[[material]]") + 1)])
    monkeypatch.setattr(cluster, "_checked_fit", deadly)
    (outcome,) = import_sources([source], tmp_path / "cat", scheduler=workers.scheduler_address).outcomes
    assert outcome.status == "failed" and "workers of the cluster died over it" in outcome.reason
    monkeypatch.undo()
    assert import_sources([source], tmp_path / "cat", scheduler=workers.scheduler_address).count("imported") == 1


@pytest.mark.slow
def test_interrupt_keeps_what_is_finished_and_leaves_the_cluster_idle(workers, source, tmp_path):
    def stop(done, total, outcome):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(ImportInterrupted) as caught:
        import_sources([source], tmp_path / "cat", scheduler=workers.scheduler_address, progress=stop)
    assert caught.value.report.remaining == 4
    assert len(Catalogue.open(tmp_path / "cat").ids()) == 2
    from distributed import Client

    with Client(workers.scheduler_address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=patient(240))
        assert not any(client.has_what().values())


def test_a_worker_with_other_code_is_named(workers, source, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "code_hash", lambda model: "of another day")
    with pytest.raises(InputError, match=r"(?s)has not the metamer that is here.*install the same version"):
        import_sources([source], tmp_path / "cat", scheduler=workers.scheduler_address)


def test_no_scheduler_at_the_address(source, tmp_path, monkeypatch):
    monkeypatch.setattr(spectral_cluster, "PATIENCE_S", 1.0)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    with pytest.raises(InputError, match="no scheduler can be reached") as caught:
        import_sources([source], tmp_path / "cat", scheduler=address)
    assert address in str(caught.value) and "dask scheduler" in str(caught.value)


@pytest.mark.slow_cases("tcp://")
@pytest.mark.parametrize("address", ["nonsense://x", "127.0.0.1:notaport", "host", "tcp://"])
def test_addresses_that_are_none(source, tmp_path, address):
    """Dask would look for such a host for a long time."""
    with pytest.raises(InputError, match="not an address"):
        import_sources([source], tmp_path / "cat", scheduler=address)


@pytest.mark.slow
def test_without_dask_the_extra_is_named(source, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"(?s)Dask is not installed.*pip install 'metamer-colour\[cluster\]'"):
        import_sources([source], tmp_path / "cat", scheduler="tcp://127.0.0.1:1")
