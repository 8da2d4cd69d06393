"""Rays traced on a Dask cluster: the same bytes, also by workers that die, join late or have other code."""

import hashlib
import os
import signal
from importlib.util import find_spec

import pytest
from metamer.lighting.mesh.shapes import plane, sphere
from metamer.lighting.transfer import hits
from metamer.lighting.transfer.ray_cache import build_rays
from metamer.runtime.errors import InputError

pytestmark = [
    # Imported where it is needed: whoever collects these tests need not wait for it.
    pytest.mark.skipif(find_spec("distributed") is None, reason="Dask is not installed; it is in the extra `cluster`"),
    # Dask closes some of its sockets when Python gets round to it.
    pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"),
]
RAYS = 16


@pytest.fixture(scope="module")
def workers():
    """Two processes of one thread each; each is started again when it dies."""
    import distributed

    here = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0", "silence_logs": 50}
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, **here) as started:
        yield started


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch):
    monkeypatch.setattr(hits, "_AT_ONCE", 32 * RAYS)


@pytest.fixture(scope="module")
def scene(scene_of):
    return scene_of(sphere(3, 0.4).placed(translate=(0.0, 0.5, 0.0)), plane(4, 4))


def contents(folder):
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in folder.iterdir()}


@pytest.mark.slow
def test_the_bytes_are_those_of_home_also_when_a_worker_is_killed(workers, scene, tmp_path):
    struck = []

    def strike(done, total, what):
        if not struck:
            struck.append(next(iter(workers.workers.values())).pid)
            os.kill(struck[0], signal.SIGKILL)

    build_rays(scene, tmp_path / "home", RAYS)
    build_rays(scene, tmp_path / "away", RAYS, progress=strike, scheduler=workers.scheduler_address)
    assert struck
    assert contents(tmp_path / "away") == contents(tmp_path / "home")


def test_without_an_address_nothing_is_sent(scene, tmp_path):
    with pytest.raises(InputError, match="not an address"):
        build_rays(scene, tmp_path, RAYS, scheduler="nowhere")
    assert list(tmp_path.iterdir()) == []
