"""Tangents by MikkTSpace's convention, against cases worked by hand."""

import numpy as np
import pytest
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import cloth, patches, plane, sphere
from metamer.lighting.mesh.tangents import seen_handedness
from metamer.lighting.vectors import stated_tangents

UP = np.array([0.0, 0.0, 1.0])


def flat(vertices, faces, uv):
    """A mesh in z = 0 whose normals are +z."""
    points = np.c_[np.asarray(vertices, float), np.zeros(len(vertices))]
    return Mesh(points, np.tile(UP, (len(points), 1)), np.array(faces), np.asarray(uv, float))


def corner_tangents(mesh):
    return mesh.tangents.directions[mesh.tangents.faces]


def test_a_square_whose_u_is_x_has_tangent_x_and_bitangent_y():
    square = [[0, 0], [1, 0], [1, 1], [0, 1]]
    mesh = flat(square, [[0, 1, 2], [0, 2, 3]], square)
    np.testing.assert_allclose(corner_tangents(mesh), np.broadcast_to([1.0, 0, 0], (2, 3, 3)), atol=1e-15)
    assert mesh.tangents.handedness.tolist() == [1, 1]
    assert len(mesh.tangents.directions) == 4


def test_uv_may_be_turned_stretched_and_moved():
    """u along (1, 1), whatever its scale and wherever it begins."""
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    uv = np.stack([3 * (square @ [1, 1]) + 7, 0.2 * (square @ [-1, 1]) - 2], axis=1)
    mesh = flat(square, [[0, 1, 2], [0, 2, 3]], uv)
    np.testing.assert_allclose(corner_tangents(mesh)[..., :2], 0.5**0.5, atol=1e-15)
    assert mesh.tangents.handedness.tolist() == [1, 1]


def test_mirrored_uv_keeps_the_tangent_along_u_and_turns_the_handedness():
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    mirrored_u = flat(square, [[0, 1, 2], [0, 2, 3]], square * [-1, 1])
    mirrored_v = flat(square, [[0, 1, 2], [0, 2, 3]], square * [1, -1])
    for mesh, along in ((mirrored_u, -1.0), (mirrored_v, 1.0)):
        np.testing.assert_allclose(corner_tangents(mesh)[..., 0], along)
        assert mesh.tangents.handedness.tolist() == [-1, -1]
        bitangent = -np.cross(UP, [along, 0, 0])
        # u mirrored: v still grows along y; v mirrored: along -y.
        assert bitangent[1] == (1.0 if mesh is mirrored_u else -1.0)


def test_a_vertex_between_mirrored_and_unmirrored_triangles_has_a_tangent_for_each():
    """Two squares side by side, the right one's texture the mirror image of the left one's; they share an edge's
    vertices, and their uv.
    """
    vertices = [[-1, 0], [0, 0], [0, 1], [-1, 1], [1, 0], [1, 1]]
    uv = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0], [0, 1]]
    mesh = flat(vertices, [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]], uv)
    found = mesh.tangents
    assert found.handedness.tolist() == [1, 1, -1, -1]
    np.testing.assert_allclose(corner_tangents(mesh)[:2, :, 0], 1.0)
    np.testing.assert_allclose(corner_tangents(mesh)[2:, :, 0], -1.0)
    # Two vertices have two tangents each.
    assert len(found.directions) == 8 and not set(found.faces[:2].flat) & set(found.faces[2:].flat)


def test_a_shared_vertex_weighs_its_triangles_by_their_angle_and_not_their_area():
    """At the origin: 90 degrees of a large triangle with u along x, 45 of a small one with u along (1, 1)."""
    vertices = [[0, 0], [9, 0], [0, 9], [-0.1, 0.1]]
    # In the small one v = 9 along the shared side (0, 9), so (0, 0.2) has the v of its corner (-0.1, 0.1), whose u is
    # -0.1: towards (0.1, 0.1) u grows and v stays.
    mesh = flat(vertices, [[0, 1, 2], [0, 2, 3]], [[0, 0], [9, 0], [0, 9], [-0.1, 0.2]])
    assert mesh.tangents.handedness.tolist() == [1, 1]
    expected = 90 * np.array([1.0, 0, 0]) + 45 * np.array([0.5**0.5, 0.5**0.5, 0])
    np.testing.assert_allclose(corner_tangents(mesh)[:, 0], [expected / np.linalg.norm(expected)] * 2, atol=1e-12)
    np.testing.assert_allclose(corner_tangents(mesh)[0, 1], [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(corner_tangents(mesh)[1, 2], [0.5**0.5, 0.5**0.5, 0], atol=1e-12)


def test_angles_are_those_in_the_plane_of_the_vertex_normal():
    """A vertex on the ridge of a roof, its normal up: each triangle counts with its angle seen from above."""
    vertices = np.array([[0.0, 0, 1], [1, 0, 0.2], [0, 1, 1], [-1, 1, -3]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    uv = np.array([[0.0, 0], [1, 0.5], [0, 1], [-1, 1.7]])
    mesh = Mesh(vertices, np.tile(UP, (4, 1)), faces, uv)
    expected = np.zeros(3)
    for face, degrees in zip(faces, (90.0, 45.0), strict=True):
        # The direction in which u grows fastest while v stays, solved from the two edges.
        edges, changes = vertices[face[1:]] - vertices[face[0]], uv[face[1:]] - uv[face[0]]
        along = np.linalg.solve(changes.T, [1.0, 0.0]) @ edges
        along[2] = 0.0
        expected += degrees * along / np.linalg.norm(along)
    np.testing.assert_allclose(corner_tangents(mesh)[0, 0], expected / np.linalg.norm(expected), atol=1e-12)


def test_vertices_that_are_alike_count_as_one_however_they_are_numbered():
    shared = cloth(12)
    corners = shared.faces.reshape(-1)
    loose = Mesh(shared.vertices[corners], shared.normals[corners], np.arange(len(corners)).reshape(-1, 3),
                 shared.uv[corners])  # fmt: skip
    np.testing.assert_allclose(corner_tangents(loose), corner_tangents(shared), atol=1e-13)


def test_islands_of_one_mesh_do_not_mix():
    """A floor and a wall that share an edge in space: the texture of the wall runs down along it."""
    floor = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    wall = [[0, 1, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1]]
    uv = [[0, 0], [0.4, 0], [0.4, 0.4], [0, 0.4], [0.6, 1], [0.6, 0.6], [1, 0.6], [1, 1]]
    vertices = np.array(floor + wall, float)
    normals = np.repeat([[0.0, 0, 1], [0, -1, 0]], 4, axis=0)
    mesh = Mesh(vertices, normals, np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]), np.array(uv))
    np.testing.assert_allclose(corner_tangents(mesh)[:2], np.broadcast_to([1.0, 0, 0], (2, 3, 3)), atol=1e-15)
    np.testing.assert_allclose(corner_tangents(mesh)[2:], np.broadcast_to([0.0, 0, 1], (2, 3, 3)), atol=1e-15)
    assert (mesh.tangents.handedness == 1).all()


def test_a_triangle_without_area_in_uv_follows_its_neighbours():
    vertices = [[0, 0], [1, 0], [1, 1], [0, 1], [2, 0.5]]
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [1, 0.5]], float)
    # The last triangle, right of the edge from (1, 0) to (1, 1), has its three corners at u = 1.
    faces = [[0, 1, 2], [0, 2, 3], [1, 4, 2]]
    for mesh, hand in ((flat(vertices, faces, uv), 1.0), (flat(vertices, faces, uv * [1, -1]), -1.0)):
        assert (mesh.tangents.handedness == hand).all()
        np.testing.assert_allclose(corner_tangents(mesh)[:2, :, 0], 1.0)
        np.testing.assert_allclose(corner_tangents(mesh)[2, [0, 2], 0], 1.0)
    # The corner that nothing else uses has the stated tangent, as has a mesh whose uv is one point.
    np.testing.assert_allclose(corner_tangents(mesh)[2, 1], stated_tangents(UP))
    pinned = flat(vertices, faces, np.full((5, 2), 0.25))
    np.testing.assert_allclose(corner_tangents(pinned), np.broadcast_to(stated_tangents(UP), (3, 3, 3)))
    assert (pinned.tangents.handedness == 1).all()


def test_a_mesh_without_uv_has_the_stated_tangents_and_is_unmirrored():
    ball = sphere(3)
    np.testing.assert_array_equal(ball.tangents.faces, ball.faces)
    np.testing.assert_allclose(ball.tangents.directions, stated_tangents(ball.normals), atol=1e-14)
    assert ball.uv is None and (ball.tangents.handedness == 1).all()


@pytest.mark.parametrize("mesh", [cloth(20), plane(), patches(1, tilt_deg=8)[0]], ids=lambda mesh: mesh.name)
def test_generated_shapes_show_a_picture_the_right_way_round(mesh):
    assert (mesh.tangents.handedness == 1).all()


def test_a_mirrored_part_is_mirrored_in_uv_too():
    mirrored = cloth(8).transformed(np.diag([-1.0, 1, 1, 1]))
    assert (mirrored.tangents.handedness == -1).all()


def test_seen_from_behind_the_bitangent_stays_along_v():
    hand, side = np.array([1.0, 1, -1, -1]), np.array([1.0, -1, 1, -1])
    assert seen_handedness(hand, np.ones(4, bool), side).tolist() == [1, -1, -1, 1]
    assert seen_handedness(hand, np.zeros(4, bool), side).tolist() == [1, 1, 1, 1]


def test_fans_that_meet_in_a_vertex_alone_keep_their_own_tangents():
    """An hourglass: u along x above the vertex and along y below it, v so that both are unmirrored."""
    vertices = [[0, 0], [1, 1], [-1, 1], [-1, -1], [1, -1]]
    # Above u = x, v = y; below u = y, v = -x.
    mesh = flat(vertices, [[0, 1, 2], [0, 3, 4]], [[0, 0], [1, 1], [-1, 1], [-1, 1], [-1, -1]])
    assert mesh.tangents.handedness.tolist() == [1, 1]
    np.testing.assert_allclose(corner_tangents(mesh)[0], np.tile([1.0, 0, 0], (3, 1)), atol=1e-15)
    np.testing.assert_allclose(corner_tangents(mesh)[1], np.tile([0.0, 1, 0], (3, 1)), atol=1e-15)


def test_tangents_are_those_of_mikktspace_c():
    """Figures that it gave for two vertices of a draped cloth whose texture folds over: (triangle, corner), tangent and
    sign. The second has four tangents, two of them of unmirrored triangles that meet in no edge at it.
    """
    drape = cloth(4)
    u, v = drape.uv.T
    folded = Mesh(
        drape.vertices, drape.normals, drape.faces, np.stack([np.sin(7 * u + 2 * v), np.cos(5 * v)], 1).round(3)
    )
    expected = {
        (2, 1): (0.99993, -0.00893, -0.00746, 1),
        (5, 2): (-0.95817, -0.21970, -0.18339, 1),
        (6, 0): (0.92956, -0.28302, -0.23625, -1),
        (17, 2): (-0.92956, -0.28302, -0.23625, -1),
        (18, 1): (0.99993, -0.00893, -0.00746, 1),
        (21, 0): (-0.95817, -0.21970, -0.18339, 1),
        (3, 1): (-0.60356, 0.77267, -0.19671, -1),
        (6, 2): (0.58845, -0.79867, 0.12591, -1),
        (7, 0): (0.58845, -0.79867, 0.12591, -1),
        (18, 2): (0.60058, -0.77870, 0.18144, 1),
        (19, 1): (0.57118, -0.81869, 0.05908, 1),
        (22, 0): (0.58845, -0.79867, 0.12591, -1),
    }
    assert folded.faces[6].tolist()[::2] == [7, 8]
    for (triangle, corner), (*tangent, sign) in expected.items():
        np.testing.assert_allclose(corner_tangents(folded)[triangle, corner], tangent, atol=1e-5)
        assert folded.tangents.handedness[triangle] == sign
