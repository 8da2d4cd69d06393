"""Visibility that renderers get: distances, shares and transfer, in the cases that go wrong most easily."""

import numpy as np
import pytest
import visibility_truth as measure
from metamer.benchmarks.papers import harmonics
from metamer.lighting.mesh.files import joined
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import cloth, patches, plane, speed_shape, sphere
from metamer.lighting.vectors import unit
from metamer.lighting.visibility.free_share import free_share
from metamer.lighting.visibility.precompute import computed_visibility
from metamer.runtime.errors import InputError

RANDOM = unit(np.random.default_rng(5).normal(size=(500, 3)))
UP = RANDOM * np.where(RANDOM[:, 1:2] < 0.0, -1.0, 1.0)


def on_a_floor(mesh):
    return mesh.placed(translate=(0.0, -mesh.bounds[0][1], 0.0))


@pytest.fixture(scope="module")
def walled(scene_of, box):
    """A wide wall of height 1 on a floor of two triangles, its face at z = 0."""
    return scene_of(plane(6.0, 6.0), box((4.0, 1.0, 0.1), (0.0, 0.0, -0.05)))


@pytest.fixture(scope="module")
def wall(walled):
    return computed_visibility(walled)


@pytest.fixture(scope="module")
def ball_on_floor(scene_of):
    return scene_of(on_a_floor(sphere(3)), plane(6.0, 6.0))


@pytest.fixture(scope="module")
def ball(ball_on_floor):
    return computed_visibility(ball_on_floor)


@pytest.mark.parametrize("away", [0.4, 0.8, 1.5])
def test_signed_distances_are_those_to_the_edge_of_a_wall(walled, wall, point_on, away):
    """Straight towards the wall the nearest boundary is its upper edge, whatever is beside; and it stops there."""
    point = wall.located(*point_on(walled, 0, (0.0, 0.0, away)))
    elevation = np.deg2rad(np.arange(5.0, 90.0, 5.0))
    towards = np.stack([0.0 * elevation, np.sin(elevation), -np.cos(elevation)], axis=1)[None]
    edge = np.arctan2(1.0, away)
    near = np.abs(elevation - edge) < 0.5
    found = wall.signed_distances(*point, towards)[0]
    assert np.abs(found - (elevation - edge))[near].max() < np.deg2rad(6.0)


def test_distances_grow_straight_away_from_the_edge_of_a_wall(walled, wall, point_on):
    point = wall.located(*point_on(walled, 0, (0.0, 0.0, 0.8)))
    edge = np.arctan2(1.0, 0.8)
    elevation = edge + np.deg2rad(np.array([-20.0, -10.0, 10.0, 20.0]))
    to = np.stack([0.0 * elevation, np.sin(elevation), -np.cos(elevation)], axis=1)[None]
    distances, slopes = wall.boundaries(*point, to)
    assert distances.tolist() == wall.signed_distances(*point, to).tolist()
    up = np.stack([0.0 * elevation, np.cos(elevation), np.sin(elevation)], axis=1)
    assert (slopes[0] * up).sum(axis=1) == pytest.approx(np.ones(4), abs=0.2)
    assert np.abs((slopes * to).sum(axis=2)).max() < 1e-9
    # A little step along it changes the distance by as much.
    then = wall.signed_distances(*point, unit(to + 1e-5 * up))
    assert (then - distances) / 1e-5 == pytest.approx((slopes * up).sum(axis=2), abs=1e-3)


def test_contact_the_foot_of_a_wall_sees_no_light_from_below(walled, wall, point_on):
    point = wall.located(*point_on(walled, 1, (0.3, 0.003, 0.0)))
    ahead = UP[UP[:, 2] > 0.2]
    assert (wall.signed_distances(*point, ahead[None]) > 0.0).mean() > 0.99
    below = ahead * [1.0, -1.0, 1.0]
    hidden = wall.signed_distances(*point, below[below[:, 1] < -0.1][None]) < 0.0
    assert hidden.mean() > 0.99


def test_contact_vertices_of_a_ball_see_what_is_around_them(ball_on_floor, ball):
    lowest = ball_on_floor.parts[0].mesh.vertices[:, 1].argmin()
    point = (np.full((1, 3), lowest), np.full((1, 3), 1 / 3))
    assert (ball.signed_distances(*point, -UP[None]) < 0.0).mean() > 0.97


def test_open_sheet_each_side_has_its_own_visibility(scene_of):
    """A sheet over a floor: from above all is free, from below the floor is near."""
    scene = scene_of(plane(2.0, 2.0).placed(translate=(0.0, 0.2, 0.0)), plane(4.0, 4.0))
    found = computed_visibility(scene)
    corners, weights = np.array([[0, 1, 2]]), np.array([[0.2, 0.5, 0.3]])
    assert (found.signed_distances(corners, weights, UP[None]) > 0.5).all()
    behind = found.signed_distances(corners, weights, -UP[None], np.array([True]))
    slope = np.hypot(UP[:, 0], UP[:, 2]) / UP[:, 1]
    assert (behind[0][slope < 2.0] < 0.0).all()
    up, down = (
        harmonics.matt_transfer(found, corners, weights, np.array([[0.0, sign, 0.0]]), np.array([sign < 0.0]))
        for sign in (1.0, -1.0)
    )
    sky = np.eye(harmonics.COUNT)[0]
    assert 0.0 <= (down @ sky)[0] < 0.2 * (up @ sky)[0]


def test_the_inside_of_a_solid_is_dark(ball_on_floor, ball):
    corners, weights = ball_on_floor.parts[0].mesh.faces[:5], np.full((5, 3), 1 / 3)
    inside = np.ones(5, dtype=bool)
    to = np.broadcast_to(RANDOM, (5, 500, 3))
    assert (ball.signed_distances(corners, weights, to, inside) == -0.5 * np.pi).all()
    assert np.abs(harmonics.matt_transfer(ball, corners, weights, RANDOM[:5], inside)).max() < 1e-12


def test_self_intersections_stay_finite_and_nearly_right(scene_of):
    """A ball sunk into a floor: vertices of each lie on the dark side of the other."""
    scene = scene_of(sphere(3).placed(translate=(0.0, 0.4, 0.0)), plane(6.0, 6.0))
    found = computed_visibility(scene)
    truth = measure.truth(scene, 800, 48)
    asked = found.located(truth.faces, truth.weights)
    assert np.isfinite(found.signed_distances(*asked, truth.directions)).all()
    # Points under the floor or in the ball are seen from nowhere.
    vertices = np.concatenate([part.mesh.vertices[part.mesh.faces] for part in scene.parts])[truth.faces]
    place = np.einsum("nk,nki->ni", truth.weights, vertices)
    seen = (place[:, 1] > -1e-9) & (np.linalg.norm(place - [0.0, 0.4, 0.0], axis=1) > 0.98)
    wrong = (found.signed_distances(*asked, truth.directions) > 0.0) != truth.free
    assert wrong[seen][truth.counts[seen]].mean() < 0.02


def test_a_vertex_nobody_uses_is_refused_by_number(scene_of):
    shape = speed_shape(2)
    mesh = Mesh(np.vstack([shape.vertices, [[9.0, 9, 9]]]), np.vstack([shape.normals, [[0, 1.0, 0]]]), shape.faces)
    found = computed_visibility(scene_of(mesh))
    with pytest.raises(InputError, match="no triangle uses"):
        found.signed_distances(np.array([[0, 1, len(shape.vertices)]]), np.full((1, 3), 1 / 3), UP[None])


def test_duplicate_vertices_of_a_uv_seam_have_one_visibility(scene_of):
    shape = speed_shape(3, uv=True)
    found = computed_visibility(scene_of(shape))
    _, number = np.unique(shape.vertices.round(12), axis=0, return_inverse=True)
    first = {int(n): k for k, n in reversed(list(enumerate(number.ravel())))}
    assert len(first) < len(shape.vertices)
    assert all(found.fronts[k] == found.fronts[first[int(n)]] for k, n in enumerate(number.ravel()))


def test_slivers_change_nothing_and_break_nothing(scene_of):
    """Triangles as thin as a mesh may have them, beside a box of ordinary ones."""
    floor = plane(4.0, 4.0)
    thin = Mesh(
        np.array([[0.5, 0.0, 0.5], [1.5, 0.0, 0.5], [1.0, 1e-9, 0.5]]),
        np.tile([0.0, 0.0, 1.0], (3, 1)),
        np.array([[0, 1, 2]]),
    )
    found = computed_visibility(scene_of(on_a_floor(sphere(2)), joined([floor, thin], "floor")))
    assert np.isfinite(found.axes).all() and np.isfinite(found.steps).all()
    truth = measure.truth(scene_of(on_a_floor(sphere(2)), joined([floor, thin], "floor")), 400, 32)
    assert measure.misclassified(found, truth) < 0.02


def test_grazing_and_vertical_directions_are_answered(ball_on_floor, ball, point_on):
    point = ball.located(*point_on(ball_on_floor, 1, (2.5, 0.0, 1.0)))
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    for height in (0.0, 1e-12, 1e-4, 0.02):
        round_ = np.stack([np.cos(angle), np.full(181, height), np.sin(angle)], axis=1)[None]
        found = ball.signed_distances(*point, round_)
        assert np.isfinite(found).all() and np.abs(found).max() <= np.pi / 2
        away = (round_[0] @ unit(np.array([2.5, 0.0, 1.0]))) > -0.5
        assert (found[0][away] > 0.0).all()
    axes = np.concatenate([np.eye(3), -np.eye(3)])[None] * 1e3
    assert np.isfinite(ball.signed_distances(*point, axes)).all()


def test_nothing_jumps_from_triangle_to_triangle(ball_on_floor, ball):
    """Points on both sides of shared edges, next to each other, on the ball and on the divided floor."""
    for part, floor in ((0, False), (1, True)):
        mesh = ball_on_floor.parts[part].mesh
        first = len(ball_on_floor.parts[0].mesh.faces) if floor else 0
        edges = {}
        for face, corners in enumerate(mesh.faces.tolist()):
            for k in range(3):
                edges.setdefault(frozenset((corners[k], corners[k - 1])), []).append((face, corners))
        pairs = [both for both in edges.values() if len(both) == 2][:40]
        share = 0.2347
        found = []
        for side in (0, 1):
            asked = []
            for both in pairs:
                one, other = sorted(set(both[0][1]) & set(both[1][1]))
                weights = [{one: share, other: 1.0 - share}.get(corner, 0.0) for corner in both[side][1]]
                asked.append((first + both[side][0], weights))
            faces, weights = np.array([a for a, _ in asked]), np.array([b for _, b in asked])
            to = np.broadcast_to(RANDOM, (len(pairs), *RANDOM.shape))
            found.append(ball.signed_distances(*ball.located(faces, weights), to))
        assert np.abs(found[0] - found[1]).max() < 1e-9


def test_asking_along_a_way_over_the_floor_is_continuous(ball_on_floor, ball, point_on):
    to = UP[:40]
    way = [point_on(ball_on_floor, 1, (x, 0.0, 0.313 * x)) for x in np.linspace(0.9, 2.6, 400)]
    faces, weights = np.concatenate([a for a, _ in way]), np.concatenate([b for _, b in way])
    found = np.tanh(
        ball.signed_distances(*ball.located(faces, weights), np.broadcast_to(to, (400, *to.shape))) / (np.pi / 4)
    )
    assert np.abs(np.diff(found, axis=0)).max() < 0.08


@pytest.mark.parametrize("shape", [sphere(4), sphere(3, uv=True)], ids=["sphere", "with uv"])
def test_a_convex_part_alone_needs_no_visibility_and_no_ray(scene_of, monkeypatch, shape):
    monkeypatch.setattr("metamer.lighting.visibility.precompute.Occluders", lambda *_: pytest.fail("rays"))
    assert computed_visibility(scene_of(shape)) is None


def test_flat_sheets_side_by_side_hide_nothing(scene_of):
    assert computed_visibility(scene_of(*patches(3))) is None


def test_what_is_hidden_at_one_place_only_is_not_taken_for_nothing(scene_of):
    assert computed_visibility(scene_of(plane(4.0, 4.0), sphere(1, radius=0.02).placed(translate=(1.0, 0.3, 1.0))))


def test_shares_are_those_of_the_signed_distances(ball_on_floor, ball, point_on):
    point = ball.located(*point_on(ball_on_floor, 1, (1.3, 0.0, 0.2)))
    angles = ball.signed_distances(*point, UP[None, :6])
    shares = free_share(angles, np.array([1.0, 3.0, 10.0, 30.0, 100.0, 1e4]))
    assert ((shares > 0.5) == (angles > 0.0)).all() and shares.min() >= 0.0 and shares.max() <= 1.0


def test_a_sheet_of_cloth_is_right_up_to_its_horizon(scene_of):
    scene = scene_of(cloth(20))
    found = computed_visibility(scene)
    assert measure.misclassified(found, measure.truth(scene, 500, 64)) < 0.02
