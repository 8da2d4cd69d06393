"""Convex bodies are told from all else, whatever their seams; only they may go without rays."""

import numpy as np
import pytest
from metamer.lighting.mesh.convexity import is_convex
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import cloth, plane, speed_shape, sphere


def flat_shaded(corners, faces):
    """A mesh whose triangles share no vertices, each with its own normal."""
    vertices = np.asarray(corners, dtype=float)[np.asarray(faces)].reshape(-1, 3)
    a, b, c = vertices[::3], vertices[1::3], vertices[2::3]
    normals = np.cross(b - a, c - a)
    normals = np.repeat(normals / np.linalg.norm(normals, axis=1, keepdims=True), 3, axis=0)
    return Mesh(vertices, normals, np.arange(len(vertices)).reshape(-1, 3), name="flat")


def cube():
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return flat_shaded(corners, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def joined(*meshes):
    offset = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = np.concatenate([mesh.faces + start for mesh, start in zip(meshes, offset, strict=False)])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate([mesh.normals for mesh in meshes]), faces
    )


def dented(by):
    ball = sphere(2)
    vertices = ball.vertices.copy()
    top = ball.vertices[:, 1] > 0.999
    vertices[top] *= 1.0 - by
    return Mesh(vertices, ball.normals, ball.faces)


@pytest.mark.parametrize("make", [lambda: sphere(3), lambda: sphere(6, 0.2), cube, lambda: sphere(3, uv=False)])
def test_convex_bodies_are_convex_with_seams_and_flat_sides_too(make):
    assert is_convex(make())


@pytest.mark.parametrize(
    "make",
    [
        lambda: plane(2, 2),
        lambda: cloth(),
        lambda: speed_shape(3),
        lambda: joined(sphere(2), sphere(2, 0.3)),
        lambda: joined(sphere(2), plane(4, 4)),
        lambda: dented(0.1),
        lambda: flat_shaded(*_torus()),
        lambda: flat_shaded(*_star()),
    ],
)
def test_what_is_open_hollow_dented_in_pieces_or_winds_through_itself_is_not(make):
    assert not is_convex(make())


def _torus():
    u, v = np.meshgrid(np.arange(12), np.arange(8), indexing="ij")
    around, across = u * 2 * np.pi / 12, v * 2 * np.pi / 8
    corners = np.stack(
        [(2 + np.cos(across)) * np.cos(around), np.sin(across), (2 + np.cos(across)) * np.sin(around)], axis=-1
    ).reshape(-1, 3)
    name = lambda i, j: (i % 12) * 8 + j % 8  # noqa: E731
    quads = [(name(i, j), name(i, j + 1), name(i + 1, j + 1), name(i + 1, j)) for i in range(12) for j in range(8)]
    return corners, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]


def _star():
    """A double pyramid over a pentagram: every edge is closed and of the base bent outwards, and it winds twice."""
    ring = [[np.cos(4 * np.pi * k / 5), 0.0, np.sin(4 * np.pi * k / 5)] for k in range(5)]
    corners = [*ring, [0, 1, 0], [0, -1, 0]]
    up = [(5, (k + 1) % 5, k) for k in range(5)]
    return corners, [*up, *((6, k, (k + 1) % 5) for k in range(5))]
