"""Large triangles cut at their longest edges: where there are few vertices, and only there."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import plane, speed_shape, sphere
from metamer.lighting.visibility import refinement
from metamer.lighting.visibility.pieces import pieces
from metamer.lighting.visibility.refinement import Vertices, refined


@pytest.fixture(autouse=True)
def many(monkeypatch):
    monkeypatch.setattr(refinement, "MOST_VERTICES", 6000)


def box(*size):
    """Twelve triangles, each side's normals its own, with texture coordinates that are linear in place."""
    import trimesh

    made = trimesh.creation.box(size)
    corners, normals = made.vertices[made.faces].reshape(-1, 3), np.repeat(made.face_normals, 3, axis=0)
    mesh = Mesh(corners, normals, np.arange(len(corners)).reshape(-1, 3))
    return replace(mesh, uv=linear(corners))


def linear(places):
    return places @ np.array([[0.3, -1.0], [2.0, 0.7], [-0.4, 0.1]]) + np.array([5.0, -3.0])


def edges(mesh):
    corners = mesh.vertices[mesh.faces]
    return np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=-1)


def radius(scene):
    low, high = scene.bounds
    return 0.5 * float(np.linalg.norm(high - low))


def test_thin_sides_take_few_vertices_and_large_ones_many(scene_of):
    scene = scene_of(box(1.5, 0.06, 2.4))
    fine, _, _ = refined(scene, 0.1)
    mesh = fine.parts[0].mesh
    assert edges(mesh).max() <= 0.1 * radius(scene) * (1 + 1e-6)
    flat = np.abs(mesh.normals[:, 1]) > 0.5
    # Four thin sides, which would have twice as many as the two large ones were all triangles divided alike.
    assert flat.sum() > 2 * (~flat).sum()
    # Nothing is cut in vain: what is half as long is a side of what was cut.
    assert np.median(edges(mesh).max(axis=1)) > 0.5 * 0.1 * radius(scene)


def test_a_body_stays_closed_and_its_texture_coordinates_stay_linear(scene_of):
    mesh = box(1.5, 0.06, 2.4)
    scene = scene_of(mesh, speed_shape(2))
    fine, halving, number = refined(scene, 0.08)
    for part in fine.parts:
        assert pieces(part.mesh).solid.all()
        corners = part.mesh.vertices[part.mesh.faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert np.linalg.norm(normals, axis=1).min() > 0.0
    found = fine.parts[0].mesh
    np.testing.assert_allclose(found.uv, linear(found.vertices), atol=1e-12)
    # Each vertex of the cuts is where its number says.
    total = sum(len(part.mesh.vertices) for part in scene.parts)
    pairs = Vertices.of(fine).at(number)
    np.testing.assert_array_equal(pairs.places[:total], Vertices.of(scene).places)
    a, b, c = np.moveaxis(pairs.places[halving.pieces], 1, 0)
    shared = np.einsum("tck,tki->tci", halving.shares, Vertices.of(scene).places[halving.corners[halving.of]])
    np.testing.assert_allclose(np.stack([a, b, c], axis=1), shared, atol=1e-14)


def test_of_a_fine_mesh_only_the_large_triangles_are_cut(scene_of):
    ball, floor = sphere(5, 0.3), plane(4.0, 4.0)
    both = Mesh(
        np.concatenate([ball.vertices, floor.vertices - np.array([0.0, 0.5, 0.0])]),
        np.concatenate([ball.normals, floor.normals]),
        np.concatenate([ball.faces, floor.faces + len(ball.vertices)]),
    )
    fine, halving, _ = refined(scene_of(both))
    cut = np.unique(halving.of[~halving.whole])
    assert cut.tolist() == [len(ball.faces), len(ball.faces) + 1]
    # It has more than it may as it is: its largest triangles get a quarter.
    assert 500 < len(fine.parts[0].mesh.vertices) - len(both.vertices) <= 1500


@pytest.mark.parametrize("most", [10, 100, 1000])
def test_there_are_no_more_vertices_than_there_may_be(scene_of, monkeypatch, most):
    monkeypatch.setattr(refinement, "MOST_VERTICES", most)
    fine, halving, _ = refined(scene_of(plane(2.0, 2.0), box(1.0, 1.0, 1.0)), 0.001)
    for part, before in zip(fine.parts, (4, 36), strict=True):
        count = len(part.mesh.vertices)
        assert count <= most or count == before or (before > most and count <= before + most // 4)
        assert count > 0.4 * most
    assert len(halving.pieces) == sum(len(part.mesh.faces) for part in fine.parts)


def test_rounding_does_not_decide_what_is_cut(scene_of):
    """The same scene elsewhere, turned and larger is cut alike."""
    scene = scene_of(box(1.5, 0.06, 2.4), plane(3.0, 2.0).placed(translate=(0.0, -1.0, 0.0)), speed_shape(2))
    moved = replace(
        scene,
        parts=tuple(
            replace(part, mesh=part.mesh.placed(rotate_deg=(0.0, 90.0, 0.0), scale=3.7, translate=(11.3, -2.1, 0.7)))
            for part in scene.parts
        ),
    )
    one, other = (refined(each, 0.07)[1] for each in (scene, moved))
    np.testing.assert_array_equal(one.pieces, other.pieces)


def test_edges_that_are_short_enough_are_left(scene_of):
    scene = scene_of(sphere(5))
    fine, halving, number = refined(scene, 0.5)
    assert halving.whole.all() and fine.parts[0].mesh is scene.parts[0].mesh
    np.testing.assert_array_equal(number, np.arange(len(scene.parts[0].mesh.vertices)))
