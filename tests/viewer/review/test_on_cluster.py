"""A review on a Dask cluster: the same as at home, also when a worker is killed, when it is broken off, and resumed."""

import os
import signal
from dataclasses import replace
from importlib.util import find_spec

import metamer
import pytest
from metamer.lighting.scene import Review
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.runtime.errors import InputError
from metamer.viewer.review import cluster
from metamer.viewer.review.cases import prepare_review
from metamer.viewer.review.review import review
from metamer.viewer.review.row_key import case_key
from metamer.viewer.software.backend import software_session
from patience import patient
from review_folder import pictures_of, results_of

pytestmark = [
    # Imported where it is needed: whoever collects these tests need not wait for it.
    pytest.mark.skipif(find_spec("distributed") is None, reason="Dask is not installed; it is in the extra `cluster`"),
    # Dask closes some of its sockets when Python gets round to it.
    pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.fixture(scope="module")
def workers():
    """Two processes of one thread each; each is started again when it dies."""
    import distributed

    here = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0", "silence_logs": 50}
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, **here) as started:
        yield started


@pytest.fixture(scope="module")
def catalogue(tiny_catalogue):
    return Catalogue.open(tiny_catalogue)


@pytest.fixture(scope="module")
def sphere(scenes):
    return replace(scenes.sphere_scene("tiny/matt-red", size=12, samples=1), review=Review("part0", ("*",), ("D65",)))


def reviewed(scene, catalogue, out, **options):
    with software_session() as renderer:
        return review(scene, catalogue, out, renderer=renderer, version="test", **options)


@pytest.mark.slow
def test_rows_are_those_of_home_also_when_a_worker_is_killed(workers, sphere, catalogue, tmp_path):
    struck = []

    def strike(done, total, material):
        if not struck:
            struck.append(next(iter(workers.workers.values())).pid)
            os.kill(struck[0], signal.SIGKILL)

    away = {"scheduler": workers.scheduler_address, "progress": strike}
    found = reviewed(sphere, catalogue, tmp_path / "away", **away)
    home = reviewed(sphere, catalogue, tmp_path / "home")
    assert struck and len(found.rows) == len(home.rows) == 4
    assert pictures_of(tmp_path / "away") == pictures_of(tmp_path / "home")
    assert results_of(tmp_path / "away") == results_of(tmp_path / "home")
    assert {one.name for one in (tmp_path / "away" / "rows").iterdir()} == {
        one.name for one in (tmp_path / "home" / "rows").iterdir()
    }


def test_a_script_hands_the_scheduler_on(sphere, catalogue, tmp_path):
    with pytest.raises(InputError, match=r"(?s)not an address.*nowhere"):
        metamer.review(sphere, catalogue, tmp_path / "out", renderer="software", scheduler="nowhere")


@pytest.mark.slow
def test_what_is_broken_off_keeps_its_rows_and_goes_on_anywhere(workers, sphere, catalogue, tmp_path):
    seen = []

    def stop(done, total, material):
        seen.append(material)
        if done == 2:
            raise KeyboardInterrupt

    away = {"scheduler": workers.scheduler_address}
    with pytest.raises(KeyboardInterrupt):
        reviewed(sphere, catalogue, tmp_path / "out", progress=stop, **away)
    assert len(list((tmp_path / "out" / "unfinished").iterdir())) == 2
    from distributed import Client

    with Client(workers.scheduler_address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=patient(240))
        assert not any(client.has_what().values())
    found = reviewed(sphere, catalogue, tmp_path / "out", progress=lambda done, total, material: seen.append(material))
    assert found.resumed == 2 and len(seen) == len(set(seen)) == 4
    again = reviewed(sphere, catalogue, tmp_path / "out", progress=lambda *_: pytest.fail("drawn again"), **away)
    assert again.resumed == 4


@pytest.fixture
def on_a_worker(sphere, catalogue, monkeypatch):
    """Gives what a worker is sent of the first case, and lets this thread be that worker."""
    with software_session() as renderer:
        setting, cases = prepare_review(
            sphere, catalogue, renderer, illuminants=None, materials=None, views=(sphere.camera(), None), budget=1.0,
            version="test", warn=lambda line: None,
        )  # fmt: skip
        sent = {}

        def numbered(work, tasks, scheduler, code, start):
            sent["start"], sent["tasks"] = start, list(tasks)
            yield from ()

        monkeypatch.setattr(cluster, "numbered_on_cluster", numbered)
        monkeypatch.setattr(cluster, "_held", cluster._Held())
        orders = ((0, cases[0], case_key(setting, catalogue, cases[0], True), True) for _ in range(1))
        list(cluster.drawn_on_cluster(setting, catalogue, orders, "nowhere"))
    yield sent["start"], sent["tasks"][0]
    if cluster._held.renderer is not None:
        cluster._held.renderer.close()


def test_a_worker_gives_rows_and_files_and_leaves_nothing(on_a_worker):
    (begin, given), task = on_a_worker
    begin(*given)
    drawn, files = cluster._drawn_there(*task)
    (row,) = drawn.rows
    assert row.material == task[2][0] and drawn.checks
    assert all(name.startswith("pictures/") and content for name, content in files.items()) and len(files) > 3


def test_a_worker_that_would_draw_something_else_is_refused(on_a_worker, monkeypatch):
    """Another display, library or catalogue does the same: the key is made of them."""
    (begin, given), task = on_a_worker
    begin(*given)
    monkeypatch.setattr("metamer.viewer.review.row_key._code_hash", lambda: "another")
    with pytest.raises(InputError, match=r"(?s)would draw something else.*--renderer software"):
        cluster._drawn_there(*task)


def test_a_worker_without_the_catalogue_is_refused(on_a_worker, tmp_path):
    (begin, given), _ = on_a_worker
    with pytest.raises(InputError, match=r"(?s)does not find the catalogue.*file system"):
        begin(tmp_path / "none", *given[1:])


def test_an_address_that_is_none_is_refused_and_nothing_is_left(sphere, catalogue, tmp_path):
    with pytest.raises(InputError, match="not an address"):
        reviewed(sphere, catalogue, tmp_path / "out", scheduler="nowhere")
    assert not (tmp_path / "out").exists()
