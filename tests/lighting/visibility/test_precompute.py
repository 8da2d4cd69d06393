"""The work itself: tiles, processes, progress, and what it costs."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from threading import Thread

import numpy as np
import pytest
from metamer.lighting.mesh.shapes import plane, speed_shape, sphere
from metamer.lighting.visibility import adaptive_sampling, precompute
from metamer.lighting.visibility.precompute import VisibilityCost, computed_visibility, visibility_cost
from metamer.runtime import memory
from metamer.runtime.errors import InputError


@pytest.fixture(scope="module")
def scene(scene_of):
    return scene_of(speed_shape(3), sphere(2, radius=0.3).placed(translate=(0.0, 1.2, 0.0)))


@pytest.fixture(scope="module")
def alone(scene):
    return computed_visibility(scene)


SAME = """
import sys
sys.path.insert(0, {folder!r})
from small_rooms import scene_of
from metamer.lighting.mesh.shapes import cloth, speed_shape
from metamer.lighting.visibility import adaptive_sampling, precompute, refinement
from metamer.runtime.fingerprint import fingerprint

precompute._TRAINING, precompute._TILE, precompute._A_PROCESS, refinement.MOST_VERTICES = 150, 40, 40, 100
adaptive_sampling.WHOLE = {whole}
scene = scene_of.__wrapped__()(speed_shape(2), cloth(8).placed(translate=(0.0, -1.0, 0.0)))
for jobs in (1, 2):
    found = precompute.computed_visibility(scene, jobs)
    print(fingerprint(found.mean, found.axes, found.whole, found.halves, found.steps, found.facing, found.middles))
"""


@pytest.mark.slow
@pytest.mark.parametrize("whole", [adaptive_sampling.WHOLE, 50])
def test_several_processes_give_the_same_bytes(tmp_path, whole):
    """Each works with one thread of BLAS; so does the command."""
    script = tmp_path / "same.py"
    script.write_text(SAME.format(folder=str(Path(__file__).parents[2] / "harness"), whole=whole), encoding="utf-8")
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, str(script)], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    prints = done.stdout.split()
    assert len(prints) == 2 and len(set(prints)) == 1


@pytest.mark.slow
def test_another_scene_may_be_worked_on_meanwhile(scene, alone, scene_of):
    """By another thread, at whatever place of the work it comes."""
    other, begun = scene_of(speed_shape(1), plane(4.0, 4.0)), []

    def meanwhile(*_):
        if not begun:
            begun.append(Thread(target=computed_visibility, args=(other,)))
            begun[0].start()
            begun[0].join()

    found = computed_visibility(scene, progress=meanwhile)
    assert begun and np.array_equal(found.whole, alone.whole) and np.array_equal(found.halves, alone.halves)
    np.testing.assert_array_equal(found.axes, alone.axes)


def test_progress_grows_to_the_whole(scene):
    heard = []
    computed_visibility(scene, progress=lambda done, total, what: heard.append((done, total, what)))
    done = [one[0] for one in heard]
    assert done == sorted(set(done)) and len(done) > 4
    assert done[-1] == heard[0][1] and {what for *_, what in heard} == {"visibility"}


def test_progress_never_goes_back_where_more_are_traced_than_was_expected(scene, monkeypatch):
    """How many sites are foretold is known afterwards."""
    monkeypatch.setattr("metamer.lighting.visibility.adaptive_sampling.WHOLE", 8)
    monkeypatch.setattr(precompute, "_TRAINING", 150)
    heard = []
    computed_visibility(scene, progress=lambda done, total, what: heard.append((done, total)))
    done, (whole,) = [one for one, _ in heard], {total for _, total in heard}
    assert done == sorted(done) and len(set(done)) > 4 and done[-1] == whole


@pytest.mark.slow
def test_axes_from_few_sites_serve_all(scene, alone, monkeypatch):
    """As in a mesh of two million triangles, where two thousand sites speak for a million."""
    monkeypatch.setattr(precompute, "_TRAINING", 150)
    few = computed_visibility(scene)
    assert len(few.whole) == len(alone.whole) > 5 * 150
    corners = scene.parts[0].mesh.faces[::40]
    weights = np.full((len(corners), 3), 1 / 3)
    to = scene.parts[0].mesh.face_normals[::40][:, None] + 0.3 * np.eye(3)[None]
    one, other = (each.signed_distances(corners, weights, to) for each in (alone, few))
    assert (np.sign(one) != np.sign(other)).mean() < 0.05


def test_no_tile_holds_more_rays_than_memory_is_reckoned_for(scene, monkeypatch):
    """What is traced together does not grow with the mesh."""
    most = []
    traced = precompute.traced
    monkeypatch.setattr(precompute, "traced", lambda s, n, o: most.append(len(s)) or traced(s, n, o))
    found = computed_visibility(scene)
    assert max(most) <= precompute._TILE and sum(most) == 642 + 162 + len(found.middles) == len(found.whole)


def test_cost_is_known_before_the_work(scene):
    cost = visibility_cost(scene, jobs=2)
    assert cost.vertices == 642 + 162 and cost.triangles == 1280 + 320
    assert "1,600 triangles" in cost.words and cost.memory_bytes > 3 * precompute.BYTES_A_PROCESS


def test_two_million_triangles_fit_a_small_machine():
    cost = VisibilityCost(1_000_000, 2_000_000)
    assert cost.memory_bytes < 5e9 and cost.cpu_seconds < 3600.0


def test_there_are_as_many_processes_as_work_and_memory_allow(monkeypatch):
    large, small = VisibilityCost(1_000_000, 2_000_000), VisibilityCost(5_000, 9_000)
    monkeypatch.setattr(precompute, "available_bytes", lambda: None)
    assert large.with_jobs(8).jobs == 8 and small.with_jobs(8).jobs == 1
    room = replace(large, jobs=3).memory_bytes
    monkeypatch.setattr(precompute, "available_bytes", lambda: room + 1)
    assert large.with_jobs(8).jobs == 3
    monkeypatch.setattr(precompute, "available_bytes", lambda: 1)
    assert large.with_jobs(8).jobs == 1


def test_what_does_not_fit_is_refused_in_numbers(scene, monkeypatch):
    monkeypatch.setattr(memory, "available_bytes", lambda: 1_000_000)
    monkeypatch.setattr(precompute, "Occluders", lambda *_: pytest.fail("work before the refusal"))
    with pytest.raises(InputError, match="does not fit into memory"):
        computed_visibility(scene)


def test_simple_scenes_have_few_terms(scene_of):
    simple = computed_visibility(scene_of(plane(2.0, 2.0), plane(2.0, 2.0).placed(translate=(0.0, 1.0, 0.0))))
    assert simple.axes.shape[1] % 4 == 0 and simple.axes.shape[1] < 64


def test_a_vertex_costs_less_than_a_hundred_bytes(alone):
    assert alone.bytes_a_vertex <= 100.0
