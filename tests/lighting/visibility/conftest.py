"""Scenes of a few meshes, which the tests of visibility share."""

import numpy as np
import pytest
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.visibility import precompute, refinement
from small_rooms import scene_of

__all__ = ["scene_of"]


@pytest.fixture(scope="module", autouse=True)
def few_divisions():
    """Large triangles are divided less finely than they are for pictures, and axes found from fewer sites: these tests
    have to be quick.
    """
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(refinement, "MOST_VERTICES", 300)
        patched.setattr(precompute, "_TRAINING", 400)
        yield


@pytest.fixture(scope="session")
def box():
    """A box with flat sides, its vertices apart at the edges: (size of three, middle of the bottom) -> mesh."""

    def made(size=(1.0, 1.0, 1.0), bottom=(0.0, 0.0, 0.0)):
        vertices, normals, faces = [], [], []
        for axis in range(3):
            for sign in (-1.0, 1.0):
                normal = np.zeros(3)
                normal[axis] = sign
                u = np.roll(normal, 1) * sign
                corners = [normal + a * u + b * np.cross(normal, u) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
                first = len(vertices)
                vertices += corners
                normals += [normal] * 4
                faces += [[first, first + 1, first + 2], [first, first + 2, first + 3]]
        points = 0.5 * np.array(vertices) * size + bottom + np.array([0.0, 0.5 * size[1], 0.0])
        return Mesh(points, np.array(normals), np.array(faces))

    return made


@pytest.fixture(scope="session")
def point_on():
    """The triangle of a part nearest below or above a place, and the weights there: (scene, part, place)."""

    def on(scene, part, place):
        mesh = scene.parts[part].mesh
        a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
        ab, ac, ap = b - a, c - a, np.asarray(place) - a
        normal = np.cross(ab, ac)
        area = (normal**2).sum(axis=1)
        v = (np.cross(ap, ac) * normal).sum(axis=1) / area
        w = (np.cross(ab, ap) * normal).sum(axis=1) / area
        weights = np.stack([1.0 - v - w, v, w], axis=1)
        off = np.abs((ap * normal).sum(axis=1)) / np.sqrt(area)
        inside = (weights > -1e-9).all(axis=1)
        face = int(np.where(inside, off, np.inf).argmin())
        first = sum(len(each.mesh.faces) for each in scene.parts[:part])
        return np.array([first + face]), weights[face][None]

    return on
