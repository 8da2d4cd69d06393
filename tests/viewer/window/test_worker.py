"""The reference of the view that is seen, in a process of its own."""

import os
import time
from dataclasses import astuple, replace

import numpy as np
import pytest
from metamer.calibration.report.statistics import delta_e_map, delta_e_statistics
from metamer.lighting.reference.reference import reference_images
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.spectral.illuminants import illuminant
from metamer.viewer.picture import picture
from metamer.viewer.software.backend import software_session
from metamer.viewer.window import worker as worker_module
from metamer.viewer.window.view_error import AskedView, Tracers, ViewError, rounds, view_errors
from metamer.viewer.window.worker import Failed, ReferenceWorker, pack_message, unpack_message
from patience import patient


@pytest.fixture(autouse=True)
def served(monkeypatch):
    """A priority that is hardly lower: on a busy machine the lowest would never be served."""
    monkeypatch.setattr(worker_module, "NICE", 1)


@pytest.fixture(scope="module")
def scene(scenes):
    found = scenes.lamp_scene("tiny/copper", 40, 2)
    return found.with_material("part1", "tiny/satin-green").with_material("part2", "tiny/rough-blue")


@pytest.fixture(scope="module")
def asked(scene, tiny_catalogue):
    drawn = picture(scene, Catalogue.open(tiny_catalogue), None, software_session())
    return AskedView(scene, scene.camera(), str(tiny_catalogue), drawn.xyz, drawn.coverage)


@pytest.fixture(scope="module")
def surfaces(scene, tiny_catalogue):
    catalogue = Catalogue.open(tiny_catalogue)
    return {name: catalogue.surface(name).surface() for name in scene.material_ids}


def heard(worker, seconds=60.0, whole=True):
    """Return what is polled until all rows are done, or the worker fails."""
    found, until = [], time.monotonic() + patient(seconds)
    while time.monotonic() < until:
        one = worker.poll()
        if one is not None:
            found.append(one)
            if isinstance(one, Failed) or one.share == 1.0 or not whole:
                return found
        time.sleep(0.01)
    raise AssertionError(f"nothing came in {seconds} s but {found}")


@pytest.mark.parametrize("height", [1, 2, 7, 8, 9, 16, 33, 100])
def test_each_round_halves_the_distance_between_rows(height):
    found = list(rounds(height))
    assert sorted(row for rows in found for row in rows) == list(range(height))
    done = []
    for number, rows in enumerate(found[:-1]):
        done = sorted([*done, *rows])
        gaps = np.diff([-1, *done, height])
        assert gaps.max() <= 16 >> max(number - 1, 0) or len(done) == 1


def test_the_last_figure_is_that_of_the_whole_reference_and_earlier_ones_are_near(asked, scene, surfaces):
    found = [one for one in view_errors(asked, surfaces) if one is not None]
    reference = reference_images(scene, None, surfaces)
    both = np.minimum(reference.coverage, asked.coverage)
    whole = delta_e_statistics(delta_e_map(reference.xyz[0], asked.xyz.astype(float), scene.adopted_white(), both))
    assert found[-1].share == 1.0
    assert astuple(found[-1].statistics) == pytest.approx(astuple(whole), rel=1e-9)
    np.testing.assert_allclose(found[-1].xyz, reference.xyz[0], rtol=1e-6, atol=1e-7)
    assert [one.share for one in found] == sorted(one.share for one in found) and found[0].share < 0.1
    assert all(one.xyz is None for one in found[:-1])
    assert found[1].statistics.p95 == pytest.approx(whole.p95, rel=0.6)


def test_a_dimmed_picture_is_measured_against_a_dimmed_reference(asked, surfaces):
    dimmed = replace(asked, xyz=np.float32(0.25) * asked.xyz, dimming=0.25)
    last = [one for one in view_errors(dimmed, surfaces) if one is not None][-1]
    assert last.statistics.p95 < 2.0
    wrong = [one for one in view_errors(replace(dimmed, dimming=1.0), surfaces) if one is not None][-1]
    assert wrong.statistics.p95 > 10.0


def test_a_view_of_nothing_has_no_figure(asked, surfaces):
    away = replace(asked.camera, target=np.add(asked.camera.position, (0.0, 5.0, 0.1)), near=None, far=None)
    nothing = replace(asked, camera=away, xyz=0 * asked.xyz, coverage=0 * asked.coverage)
    last = [one for one in view_errors(nothing, surfaces) if one is not None][-1]
    assert last.statistics is None and last.words(last.at) == "nothing lit"


def test_meshes_go_through_the_pipe_once(asked):
    ours, theirs = [], []
    first = pack_message((1, asked), ours)
    ticket, there = unpack_message(first, theirs)
    lit = replace(asked, scene=asked.scene.with_illuminant(illuminant("A"), "A"))
    second = pack_message((2, lit), ours)
    _, again = unpack_message(second, theirs)
    assert ticket == 1 and len(second) < 0.5 * len(first)
    assert [one.mesh for one in again.scene.parts] == [one.mesh for one in there.scene.parts]
    part = asked.scene.parts[0]
    moved = replace(asked.scene, parts=(replace(part, mesh=part.mesh.placed(translate=(0.0, 1.0, 0.0))),))
    _, other = unpack_message(pack_message((3, replace(asked, scene=moved)), ours), theirs)
    assert len(ours) == len(theirs) == 1 and other.scene.parts[0].mesh is theirs[0]
    assert unpack_message(pack_message((4, None), ours), theirs) == (4, None)


def test_rays_are_kept_while_meshes_are_the_same(scene):
    tracers = Tracers()
    one = tracers.of(scene)
    assert tracers.of(scene.with_illuminant(illuminant("A"), "A")) is one
    moved = scene.parts[0].mesh.placed(translate=(0.0, 1.0, 0.0))
    assert tracers.of(replace(scene, parts=(replace(scene.parts[0], mesh=moved), *scene.parts[1:]))) is not one


@pytest.mark.slow
def test_a_process_tells_first_a_coarse_figure_then_the_same_as_here(asked, surfaces):
    here = [one for one in view_errors(asked, surfaces) if one is not None][-1]
    with ReferenceWorker() as worker:
        worker.ask(asked)
        found = heard(worker)
        assert isinstance(found[-1], ViewError)
        assert astuple(found[-1].statistics) == pytest.approx(astuple(here.statistics), rel=1e-9)
        lowest = min(os.getpriority(os.PRIO_PROCESS, 0) + 1, 19)
        assert os.getpriority(os.PRIO_PROCESS, worker._process.pid) == lowest
        words = found[-1].words(found[-1].at + 300.0)
        assert words.startswith("ΔE94 p95") and words.endswith("5 min ago")
        pid = worker._process.pid
    assert not _runs(pid)


@pytest.mark.slow
def test_the_newest_view_wins_and_a_cancelled_one_says_nothing(asked):
    with ReferenceWorker() as worker:
        tall = replace(
            asked,
            camera=replace(asked.camera, width=400, height_px=400),
            xyz=np.zeros((400, 400, 3), np.float32),
            coverage=np.zeros((400, 400), np.float32),
        )
        worker.ask(tall)
        heard(worker, whole=False)
        worker.ask(asked)
        found = heard(worker)
        assert all(one.xyz is None or one.xyz.shape == asked.xyz.shape for one in found)
        worker.ask(tall)
        worker.cancel()
        time.sleep(0.3)
        assert worker.poll() is None


@pytest.mark.slow
def test_a_process_that_is_killed_costs_one_view(asked):
    with ReferenceWorker() as worker:
        worker.ask(asked)
        heard(worker, whole=False)
        worker._process.kill()
        worker.cancel()
        (failed,) = [one for one in heard(worker) if isinstance(one, Failed)]
        assert "signal 9" in failed.words
        worker.ask(asked)
        assert heard(worker)[-1].share == 1.0


def test_a_material_that_is_gone_is_told_and_the_next_view_is_measured(asked):
    with ReferenceWorker() as worker:
        worker.ask(replace(asked, scene=asked.scene.with_material("part0", "tiny/none")))
        (failed,) = heard(worker)
        assert "unknown material" in failed.words
        worker.ask(asked)
        assert heard(worker)[-1].share == 1.0


def _runs(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True
