"""Fixtures of rooms and bodies for tests of visibility and interreflection; conftests take those that they need."""

import numpy as np
import pytest
from metamer.lighting.lights import DirectionalLight
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import sphere
from metamer.lighting.scene import Part, Scene, bounds_of, framing_camera
from metamer.lighting.visibility import refinement
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum


@pytest.fixture(scope="module", autouse=True)
def few_divisions():
    """Large triangles are divided less finely than they are for pictures: these tests have to be quick."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(refinement, "MOST_VERTICES", 300)
        yield


@pytest.fixture(scope="session")
def scene_of():
    """The scene of these meshes, named 0, 1, ..., under some light."""

    def made(*meshes, material="matt"):
        light = DirectionalLight((0.0, 1.0, 0.0), Spectrum(np.ones(2), np.array([400.0, 700.0]), "emission"))
        parts = tuple(Part(str(number), mesh, material) for number, mesh in enumerate(meshes))
        return Scene(parts, (light,), (framing_camera(*bounds_of(meshes)),), observer("1931_2"))

    return made


def rectangle(*corners):
    """Four corners, counter-clockwise as seen from its front."""
    vertices = np.array(corners, dtype=float)
    normal = np.cross(vertices[1] - vertices[0], vertices[2] - vertices[0])
    return Mesh(vertices, np.tile(normal / np.linalg.norm(normal), (4, 1)), np.array([[0, 1, 2], [0, 2, 3]]))


@pytest.fixture(scope="session")
def squares():
    """Two unit squares, face to face, so far apart."""

    def made(apart=1.0):
        a, b, c, d = (-0.5, 0, 0.5), (0.5, 0, 0.5), (0.5, 0, -0.5), (-0.5, 0, -0.5)
        return rectangle(a, b, c, d), rectangle(*((x, apart, z) for x, _, z in (d, c, b, a)))

    return made


@pytest.fixture(scope="session")
def room():
    """The six sides of a box of 2 x 2 x 2 about the origin, seen from inside, a mesh each."""
    sides = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            normal = np.zeros(3)
            normal[axis] = -sign
            u = np.roll(normal, 1)
            v = np.cross(normal, u)
            sides.append(rectangle(*(-normal + x * u + y * v for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)))))
    return sides


@pytest.fixture(scope="session")
def hollow():
    """A ball seen from inside."""
    body = sphere(3)
    return Mesh(body.vertices, -body.normals, body.faces[:, ::-1])
