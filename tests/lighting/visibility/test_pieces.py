"""Pieces of meshes: what hangs together, what is closed, what is convex."""

import numpy as np
import pytest
from metamer.lighting.mesh.files import joined
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import cloth, plane, speed_shape, sphere
from metamer.lighting.visibility.pieces import pieces


def kinds(mesh):
    found = pieces(mesh)
    return found.solid.tolist(), found.convex.tolist()


@pytest.mark.parametrize("uv", [False, True])
def test_a_sphere_is_a_convex_solid_seam_or_not(uv):
    assert kinds(sphere(3, uv=uv)) == ([True], [True])


def test_a_box_is_convex_though_its_vertices_are_apart_and_its_sides_flat(box):
    assert kinds(box()) == ([True], [True])


def test_a_solid_with_hollows_is_not_convex():
    assert kinds(speed_shape(4)) == ([True], [False])


@pytest.mark.parametrize("sheet", [plane(), cloth(12)], ids=["plane", "cloth"])
def test_a_sheet_is_not_closed(sheet):
    assert kinds(sheet) == ([False], [False])


def test_a_solid_that_is_wound_inwards_is_a_room_seen_from_inside():
    ball = sphere(2)
    assert kinds(Mesh(ball.vertices, -ball.normals, ball.faces[:, ::-1])) == ([False], [False])


def test_a_hole_makes_a_sheet_of_a_solid():
    ball = sphere(2)
    assert kinds(Mesh(ball.vertices, ball.normals, ball.faces[1:])) == ([False], [False])


def test_pieces_of_one_mesh_are_told_apart():
    mesh = joined([sphere(2), plane(4.0, 4.0), sphere(2).placed(translate=(5, 0, 0))], "three")
    found = pieces(mesh)
    assert sorted(found.solid.tolist()) == [False, True, True] and found.convex.sum() == 2
    assert np.bincount(found.of_face).tolist() == [320, 2, 320]


def test_three_triangles_at_an_edge_are_no_solid():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0.5]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3], [0, 1, 4]])
    normals = np.tile([0.0, 0.0, 1.0], (5, 1))
    assert kinds(Mesh(points, normals, faces)) == ([False], [False])
    assert kinds(Mesh(points[:4], normals[:4], faces[:4])) == ([True], [True])
