"""Error of visibility between vertices, on meshes as people have them."""

import numpy as np
import pytest
import visibility_truth as measure
from metamer.lighting.mesh.files import load_mesh
from metamer.lighting.mesh.shapes import plane, speed_shape, sphere
from metamer.lighting.visibility import edge_refinement, refinement


def test_truth_is_drawn_by_area_and_counts_above_both_horizons(scene_of):
    found = measure.truth(scene_of(plane(2.0, 2.0), sphere(2, radius=0.1).placed(translate=(0, 3, 0))), 2000, 16)
    assert (found.faces < 2).mean() == pytest.approx(4.0 / (4.0 + 4.0 * np.pi * 0.01), abs=0.02)
    assert np.allclose(found.weights.sum(axis=1), 1.0) and found.weights.min() >= 0.0
    floor = found.faces < 2
    assert (found.counts[floor] == (found.directions[floor][..., 1] > 0.0)).all()


@pytest.mark.slow
def test_it_measures_what_it_says(scene_of, monkeypatch):
    found = measure.measured(scene_of(speed_shape(3)), points=300)
    assert found.vertices == 642 and 0.0 < found.misclassified < 0.02
    assert found.misclassified < found.misclassified_coarse
    assert found.cpu_seconds_a_thousand > 0.0 and found.illuminance_error < 0.02
    assert measure.measured(scene_of(sphere(2))) is None
    monkeypatch.setattr(edge_refinement, "APART", 9.0)
    uncut = measure.measured(scene_of(speed_shape(3)), points=300)
    assert uncut.misclassified == uncut.misclassified_coarse and uncut.bytes_a_vertex < found.bytes_a_vertex


@pytest.mark.slow
def test_a_floor_of_two_triangles_has_shadows_on_it(scene_of, monkeypatch):
    """Asked at its four corners, it has none."""
    monkeypatch.setattr(refinement, "MOST_VERTICES", 900)
    found = measure.measured(scene_of(sphere(3).placed(translate=(0.0, 1.0, 0.0)), plane(5.0, 5.0)), points=600)
    assert found.misclassified < 0.02 < 0.05 < found.misclassified_coarse


def spot(shared_data):
    file = shared_data / "meshes" / "spot.obj"
    if not file.is_file():
        pytest.skip(f"no {file}")
    return load_mesh(file)


@pytest.mark.slow
def test_spot_between_its_vertices(scene_of, shared_data, monkeypatch):
    monkeypatch.setattr("metamer.lighting.visibility.precompute._TRAINING", 2048)
    found = measure.measured(scene_of(spot(shared_data)), points=600)
    assert found.misclassified < 0.016 and found.illuminance_error < 0.012 and found.bytes_a_vertex < 100.0


@pytest.mark.slow
def test_spot_on_a_floor_and_the_shaderball(scene_of, shared_data, monkeypatch):
    monkeypatch.setattr("metamer.lighting.visibility.precompute._TRAINING", 2048)
    monkeypatch.setattr(refinement, "MOST_VERTICES", 2048)
    cow = spot(shared_data)
    standing = scene_of(cow.placed(translate=(0.0, -cow.bounds[0][1], 0.0)), plane(5.6, 5.6))
    assert measure.measured(standing, points=600).misclassified < 0.02
    ball = load_mesh(shared_data / "meshes" / "shaderball.glb")
    assert measure.measured(scene_of(ball), points=600).misclassified < 0.015
