"""Sites below and inside of other parts, and what is seen beside them."""

import numpy as np
import pytest
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import sphere
from metamer.lighting.vectors import unit
from metamer.lighting.visibility import adaptive_sampling, precompute, refinement
from metamer.lighting.visibility.blocked_probes import beside_shut, edges, shut_sites
from metamer.lighting.visibility.occluders import Occluders
from metamer.lighting.visibility.precompute import computed_visibility
from metamer.lighting.visibility.sites import faces_of, pieces_of, scaled_triangles, sites_at


def floor_of(size, divisions):
    """A square floor in so many squares each way."""
    at = np.linspace(-0.5 * size, 0.5 * size, divisions + 1)
    x, z = (axis.ravel() for axis in np.meshgrid(at, at))
    first = (np.arange(divisions)[:, None] * (divisions + 1) + np.arange(divisions)).ravel()
    a, b, c, d = first, first + divisions + 1, first + divisions + 2, first + 1
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Mesh(np.stack([x, 0.0 * x, z], axis=1), np.tile([0.0, 1.0, 0.0], (len(x), 1)), faces)


def shut_of(scene):
    """Sites of a scene and which are shut."""
    corners = faces_of(scene, pieces_of(scene)).corners(scene)
    occluders = Occluders(scaled_triangles(scene).astype(np.float32))
    where = sites_at(corners, occluders)
    return where, shut_sites(where, occluders, corners.face_normals, corners.solid)


@pytest.mark.parametrize("above", [0.0, 0.002])
def test_a_floor_is_shut_below_a_box_and_nowhere_else(scene_of, box, above):
    floor = floor_of(4.0, 16)
    where, shut = shut_of(scene_of(floor, box(bottom=(0.0, above, 0.0))))
    x, _, z = floor.vertices.T
    below, fronts = (np.abs(x) < 0.45) & (np.abs(z) < 0.45), where.fronts[: len(x)]
    beside = (np.abs(x) > 0.55) | (np.abs(z) > 0.55)
    assert below.sum() > 8 and shut[fronts[below]].all() and not shut[fronts[beside]].any()
    # Below, the floor is free, and so is all of the box but what stands on the floor.
    assert not shut[where.backs[: len(x)]].any()
    sides = where.normals[where.fronts[len(x) :], 1] > -0.5
    assert sides.sum() == 20 and not shut[where.fronts[len(x) :]][sides].any()


def test_what_is_inside_of_a_solid_is_shut_and_what_is_in_a_room_is_not(scene_of, box):
    small, large = sphere(1, radius=0.2), box((2.0, 2.0, 2.0), (0.0, -1.0, 0.0))
    where, shut = shut_of(scene_of(small, large))
    inner = where.fronts[: len(small.vertices)]
    assert shut[inner].all() and not shut[where.fronts[len(small.vertices) :]].any()
    room = Mesh(large.vertices, -large.normals, large.faces[:, ::-1])
    assert not shut_of(scene_of(small, room))[1].any()


def test_a_corner_of_three_walls_is_open(scene_of):
    floor = floor_of(1.0, 4)
    walls = [
        Mesh(floor.vertices[:, order] - offset, np.abs(floor.normals[:, order]), floor.faces)
        for order, offset in (([1, 2, 0], (0.5, -0.5, 0.0)), ([2, 0, 1], (0.0, -0.5, 0.5)))
    ]
    assert not shut_of(scene_of(floor, *walls))[1].any()


def test_shut_sites_take_what_open_neighbours_have():
    corners = np.array([[0, 1, 2], [2, 1, 3], [3, 4, 5], [6, 6, 6], [-1, 5, 0]])
    shut = np.array([False, True, False, True, True, True, True])
    values = np.arange(14.0).reshape(7, 2).astype(np.float16)
    found = beside_shut(values, shut, edges(corners))
    # 1 has 0 and 2 beside it, 3 has 2, 5 has 0; 4 and 6 have none that is open.
    wanted = values.copy()
    wanted[1], wanted[3], wanted[5] = (values[0] + values[2]) / 2, values[2], values[0]
    np.testing.assert_array_equal(found, wanted)
    assert found.dtype == values.dtype
    np.testing.assert_array_equal(beside_shut(values, np.zeros(7, bool), edges(corners)), values)
    np.testing.assert_array_equal(beside_shut(values, np.ones(7, bool), edges(corners)), values)


def _free(found, scene, point_on, place, to):
    faces, weights = point_on(scene, 0, place)
    vertices, shares = found.located(faces, weights)
    return found.signed_distances(vertices, shares, to)[0]


@pytest.mark.slow_cases("50")
@pytest.mark.parametrize("whole", [adaptive_sampling.WHOLE, 50])
def test_a_floor_beside_a_box_sees_what_it_would(scene_of, box, point_on, monkeypatch, whole):
    """Directions away from the box are free up to it; without, light from there is half lost along it."""
    monkeypatch.setattr(refinement, "MOST_VERTICES", 10)
    monkeypatch.setattr(precompute, "_TRAINING", 200)
    monkeypatch.setattr(adaptive_sampling, "WHOLE", whole)
    scene = scene_of(floor_of(4.0, 16), box())
    away = unit(np.array([[[1.0, 0.3, 0.0], [0.7, 0.7, 0.3], [0.5, 1.0, -0.5]]]))
    place = (0.53, 0.0, 0.05)
    assert (_free(computed_visibility(scene), scene, point_on, place, away) > 0.0).all()
    monkeypatch.setattr(precompute, "beside_shut", lambda codes, *_: codes)
    assert (_free(computed_visibility(scene), scene, point_on, place, away) < 0.0).any()


def test_where_all_sites_are_shut_each_sees_what_it_does(scene_of, box):
    """Two boxes, one within the other: the inner one's neighbours are shut as well."""
    scene = scene_of(box((0.5, 0.5, 0.5), (0.0, 0.25, 0.0)), box())
    assert computed_visibility(scene) is not None
