"""Rays and the irradiance operator against closed forms."""

import numpy as np
import pytest
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import plane, sphere
from metamer.lighting.transfer.edge_refinement import placed
from metamer.lighting.transfer.hits import ray_directions
from metamer.lighting.transfer.operator import irradiance_operator


def sums(operator):
    return np.asarray(operator.sum(axis=1)).ravel()


def test_rays_are_as_dense_as_the_cosine():
    normals = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.6, 0.0, 0.8], [0.0, -1.0, 0.0]])
    to = ray_directions(normals, np.arange(4), 1024)
    np.testing.assert_allclose(np.linalg.norm(to, axis=2), 1.0, atol=1e-12)
    cosine = np.einsum("nri,ni->nr", to, normals)
    assert (cosine >= 0.0).all()
    # The mean of cos(theta)^n by a density of cos / pi is 2 / (n + 2).
    for power in (1, 2, 4):
        np.testing.assert_allclose((cosine**power).mean(axis=1), 2.0 / (power + 2.0), atol=2e-3)
    np.testing.assert_allclose(to.mean(axis=1), normals * (2.0 / 3.0), atol=3e-3)


def test_inside_a_ball_every_site_receives_the_mean(scene_of, hollow):
    scene = scene_of(hollow)
    hits = placed(scene).traced(256)
    inside = hits.sites.fronts[: len(hollow.vertices)]
    operator = irradiance_operator(hits)
    np.testing.assert_allclose(sums(operator)[inside], 1.0, atol=1e-6)
    # Between any two points of a ball the form factor is the same: a share of its surface sends that share.
    height = np.zeros(len(hits.sites))
    fine = placed(scene).scene.parts[0].mesh
    height[hits.sites.fronts] = fine.vertices[:, 1]
    received = (operator @ height)[inside]
    assert np.sqrt(np.mean(received**2)) < 0.01
    assert abs((operator @ (height > 0.8).astype(np.float32))[inside].mean() - 0.1) < 0.01
    # Outside of a ball nothing is seen of it.
    assert sums(operator)[hits.sites.backs[: len(hollow.vertices)]].max() == 0.0


@pytest.mark.slow
def test_two_squares_face_to_face(scene_of, squares):
    lower, upper = squares()
    scene = scene_of(lower, upper)
    hits = placed(scene).traced(4096)
    fine = placed(scene).scene.parts[0].mesh
    received = sums(irradiance_operator(hits))[hits.sites.fronts[: len(fine.vertices)]]
    # By the trapezoidal rule over the square; the form factor is 0.19982 (Howell's catalogue, C-11).
    edge = np.isclose(np.abs(fine.vertices[:, [0, 2]]), 0.5).sum(axis=1)
    mean = np.average(received, weights=0.5**edge)
    assert abs(mean - 0.19982) < 1e-3
    middle = received[np.linalg.norm(fine.vertices[:, [0, 2]], axis=1).argmin()]
    assert abs(middle - 0.2395) < 2e-3  # Howell's B-4, four times a quarter


def test_a_convex_solid_receives_nothing_of_itself(scene_of):
    assert irradiance_operator(placed(scene_of(sphere(3))).traced()).nnz == 0


def test_one_triangle(scene_of):
    triangle = Mesh(np.eye(3), np.tile(np.ones(3) / np.sqrt(3.0), (3, 1)), np.array([[0, 1, 2]]))
    assert irradiance_operator(placed(scene_of(triangle)).traced()).nnz == 0


def test_a_sheet_sends_from_the_side_that_is_seen(scene_of):
    up, down = plane(1, 1), plane(1, 1)
    above = Mesh(down.vertices + np.array([0.0, 0.4, 0.0]), down.normals, down.faces)
    scene = scene_of(up, above)
    hits = placed(scene).traced(64)
    operator = irradiance_operator(hits)
    number = len(placed(scene).scene.parts[0].mesh.vertices)
    only_back = np.zeros(len(hits.sites), dtype=np.float32)
    only_back[hits.sites.backs[number:]] = 1.0
    assert (operator @ only_back)[hits.sites.fronts[:number]].min() > 0.1
    assert (operator @ only_back)[hits.sites.fronts[number:]].max() == 0.0
    only_back[:] = 0.0
    only_back[hits.sites.fronts[number:]] = 1.0
    assert (operator @ only_back)[hits.sites.fronts[:number]].max() == 0.0


def test_the_inside_of_a_solid_is_dark(scene_of):
    """A vertex of a floor that ends within a ball sees its inside, which sends nothing."""
    ball = sphere(3)
    sunk = Mesh(ball.vertices, ball.normals, ball.faces)
    scene = scene_of(plane(4, 4), sunk)
    hits = placed(scene).traced(64)
    fine = placed(scene).scene.parts[0].mesh
    within = np.linalg.norm(fine.vertices, axis=1) < 0.9
    assert within.any()
    assert sums(irradiance_operator(hits))[hits.sites.fronts[: len(fine.vertices)][within]].max() == 0.0


@pytest.mark.parametrize("kind", ["doubled", "thin"])
def test_doubled_and_thin_faces_change_little(scene_of, squares, kind):
    lower, upper = squares()
    beside = upper.vertices[:1] + np.array([0.0, 1e-7, 0.0])
    vertices, normals = np.concatenate([upper.vertices, beside]), np.concatenate([upper.normals, upper.normals[:1]])
    faces = upper.faces if kind == "doubled" else np.array([[0, 4, 1]])
    worse = Mesh(vertices, normals, np.concatenate([upper.faces, faces]))
    plain, found = (sums(irradiance_operator(placed(scene_of(lower, one)).traced(64))) for one in (upper, worse))
    assert np.isfinite(found).all()
    # Either of two equal triangles may be the one that a ray meets.
    assert abs(found.max() - plain.max()) < 0.03
    assert found.max() <= 1.0 + 1e-6


def test_parts_that_touch(scene_of, squares):
    """A box on a floor: the floor's vertices at its foot see what lies beside them."""
    lower, _ = squares()
    wall = Mesh(
        np.array([[-0.5, 0, -0.5], [0.5, 0, -0.5], [0.5, 1, -0.5], [-0.5, 1, -0.5]]),
        np.tile([0.0, 0.0, 1.0], (4, 1)),
        np.array([[0, 1, 2], [0, 2, 3]]),
    )
    scene = scene_of(lower, wall)
    hits = placed(scene).traced(256)
    fine = placed(scene).scene.parts[0].mesh
    received = sums(irradiance_operator(hits))[hits.sites.fronts[: len(fine.vertices)]]
    foot = np.flatnonzero(np.isclose(fine.vertices[:, 2], -0.5) & (np.abs(fine.vertices[:, 0]) < 0.1))
    # In the corner, half of the hemisphere is the wall.
    np.testing.assert_allclose(received[foot], 0.5, atol=0.02)
