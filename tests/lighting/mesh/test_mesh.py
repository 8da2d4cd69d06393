import numpy as np
import pytest
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import cloth, sphere
from metamer.runtime.errors import InputError, UnknownNameError

SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
UP = np.tile([0.0, 0.0, 1.0], (4, 1))
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def test_a_mesh_without_triangles_is_refused():
    with pytest.raises(InputError, match="the mesh is empty"):
        Mesh(SQUARE, UP, np.zeros((0, 3), dtype=int))


def test_an_index_out_of_range_is_refused_with_the_range():
    with pytest.raises(InputError, match=r"(?s)not there.*found: 7.*0 to 3"):
        Mesh(SQUARE, UP, np.array([[0, 1, 7]]))


def test_a_vertex_that_is_not_finite_is_refused_by_number():
    vertices = SQUARE.copy()
    vertices[2, 1] = np.nan
    with pytest.raises(InputError, match=r"(?s)vertex 2: 1 vertices are not finite.*nan"):
        Mesh(vertices, UP, FACES)


def test_normals_of_another_length_are_refused():
    with pytest.raises(InputError, match="not unit vectors"):
        Mesh(SQUARE, 2 * UP, FACES)


def test_a_triangle_without_area_is_refused_by_number():
    with pytest.raises(InputError, match=r"(?s)1 triangles without area.*number 1"):
        Mesh(SQUARE, UP, np.array([[0, 1, 2], [0, 2, 2]]))


def test_a_sliver_far_below_a_pixel_still_has_area():
    vertices = np.array([[0.0, 0, 0], [1e3, 0, 0], [0, 1e-4, 0]])
    assert Mesh(vertices, UP[:3], np.array([[0, 1, 2]])).face_normals.tolist() == [[0, 0, 1]]


def test_a_transform_keeps_normals_normal():
    matrix = np.array([[2.0, 0.3, 0, 5], [0, 0.5, 0.2, 1], [0.1, 0, 1.5, -2], [0, 0, 0, 1]])
    moved = sphere(3).transformed(matrix)
    outward = moved.vertices - matrix[:3, 3]
    assert (np.einsum("ij,ij->i", moved.normals, outward) > 0).all()
    # On an ellipsoid |M^-1 p| = 1 the gradient is (M M^T)^-1 p.
    gradient = outward @ np.linalg.inv(matrix[:3, :3] @ matrix[:3, :3].T).T
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    np.testing.assert_allclose(moved.normals, gradient, atol=1e-12)


def test_a_mirror_turns_the_winding_and_keeps_normals_outside():
    mirrored = sphere(2).transformed(np.diag([-1.0, 1, 1, 1]))
    centres = mirrored.vertices[mirrored.faces].mean(axis=1)
    assert (np.einsum("ij,ij->i", mirrored.face_normals, centres) > 0).all()
    assert (np.einsum("ij,ij->i", mirrored.normals, mirrored.vertices) > 0.99).all()


def test_a_transform_that_flattens_is_refused():
    with pytest.raises(InputError, match="flattens the mesh"):
        sphere(1).transformed(np.diag([1.0, 0, 1, 1]))


def test_tangents_follow_u():
    drape = cloth(80)
    normals, tangents = drape.normals[drape.faces], drape.tangents.directions[drape.tangents.faces]
    # u runs along x, v against z: the tangent has no z and is square to the normal, up to the size of a triangle.
    expected = np.stack([normals[..., 1], -normals[..., 0], 0 * normals[..., 0]], axis=-1)
    expected /= np.linalg.norm(expected, axis=-1, keepdims=True)
    assert np.einsum("fki,fki->fk", tangents, expected).min() > 0.995
    np.testing.assert_allclose(np.einsum("fki,fki->fk", tangents, normals), 0, atol=1e-14)


def test_tangents_without_uv_are_horizontal():
    ball = sphere(3)
    np.testing.assert_allclose(ball.tangents.directions[:, 1], 0, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(ball.tangents.directions, axis=1), 1, atol=1e-14)


def test_one_part_of_several_by_name():
    names = Mesh(SQUARE, UP, FACES, part_names=("left", "right"), face_part=np.array([0, 1]))
    right = names.part("right")
    assert right.faces.shape == (1, 3)
    assert sorted(map(tuple, right.vertices.tolist())) == [(0, 0, 0), (0, 1, 0), (1, 1, 0)]
    with pytest.raises(UnknownNameError, match="nearest: right"):
        names.part("rihgt")
