"""The index of triangles in numpy, beside Embree's and beside what geometry says."""

import sys

import numpy as np
import pytest
from metamer.lighting.mesh.ray_index import NumpyIndex, ray_index
from metamer.lighting.mesh.shapes import cloth, plane, sphere
from metamer.lighting.reference.geometry import visible_geometry
from metamer.lighting.vectors import unit

LENGTH = 1.2


@pytest.fixture(scope="module")
def case():
    """Triangles of a ball over a cloth, rays from around them, and what the index in numpy says."""
    parts = (sphere(3), cloth(16))
    triangles = np.concatenate([mesh.vertices[mesh.faces] for mesh in parts]).astype(np.float32)
    rng = np.random.default_rng(0)
    starts = (1.6 * unit(rng.normal(size=(20000, 3)))).astype(np.float32)
    to = unit(0.5 * rng.normal(size=(20000, 3)) - starts).astype(np.float32)
    return triangles, starts, to, NumpyIndex(triangles).run(starts, to, output=True)


def test_rays_meet_what_embree_says(case):
    pytest.importorskip("embreex")
    triangles, starts, to, found = case
    embree = ray_index(triangles)
    theirs = embree.run(starts, to, query="INTERSECT", output=True)
    assert 0.2 < np.mean(found["primID"] >= 0) < 0.95
    alike = (found["primID"] == theirs["primID"]) & (found["primID"] >= 0)
    # On an edge that two triangles share, either may be named.
    assert np.mean(found["primID"] != theirs["primID"]) < 1e-3
    for name, close in (("tfar", 1e-4), ("u", 2e-3), ("v", 2e-3)):
        np.testing.assert_allclose(found[name][alike], theirs[name][alike], atol=close)
    dists = np.full(len(starts), LENGTH, np.float32)
    ours = NumpyIndex(triangles).run(starts, to, dists=dists, query="OCCLUDED") >= 0
    assert np.mean(ours != (embree.run(starts, to, dists=dists, query="OCCLUDED") >= 0)) < 1e-3


def test_any_triangle_is_met_where_a_first_one_is(case):
    triangles, starts, to, found = case
    index = NumpyIndex(triangles)
    np.testing.assert_array_equal(index.run(starts, to, query="OCCLUDED") >= 0, found["primID"] >= 0)
    dists = np.full(len(starts), LENGTH)
    within = (found["primID"] >= 0) & (found["tfar"] < LENGTH)
    np.testing.assert_array_equal(index.run(starts, to, dists=dists, query="OCCLUDED") >= 0, within)
    np.testing.assert_array_equal(index.run(starts, to, dists=dists) >= 0, within)


def test_barycentric_coordinates_are_of_the_place_that_is_met(case):
    triangles, starts, to, found = case
    met = found["primID"] >= 0
    a, b, c = np.moveaxis(triangles[found["primID"][met]].astype(np.float64), 1, 0)
    u, v, far = (found[name][met, None] for name in ("u", "v", "tfar"))
    np.testing.assert_allclose(starts[met] + far * to[met], a + u * (b - a) + v * (c - a), atol=1e-6)


def test_no_ray_passes_between_triangles():
    """Vertices and edges of a closed ball, from within: each is met."""
    ball = sphere(2)
    corners = ball.vertices[ball.faces]
    to = unit(np.concatenate([ball.vertices, 0.5 * (corners[:, 0] + corners[:, 1])]))
    assert (NumpyIndex(corners).run(np.zeros_like(to), to) >= 0).all()


def test_along_axes_and_without_triangles():
    flat = plane(2.0, 2.0)
    index = NumpyIndex(flat.vertices[flat.faces])
    down = np.array([[0.0, -1.0, 0.0]])
    starts = np.array([[0.3, 1.0, 0.2], [3.0, 1.0, 0.2]])
    assert (index.run(starts, np.repeat(down, 2, axis=0)) >= 0).tolist() == [True, False]
    assert (index.run(starts, -np.repeat(down, 2, axis=0)) < 0).all()
    assert (NumpyIndex(np.zeros((0, 3, 3))).run(starts, np.repeat(down, 2, axis=0)) < 0).all()
    assert NumpyIndex(flat.vertices[flat.faces]).run(np.zeros((0, 3)), np.zeros((0, 3))).shape == (0,)


def test_a_scene_is_seen_alike_without_embree(scenes, monkeypatch):
    pytest.importorskip("embreex")
    scene = scenes.sphere_scene(size=24, samples=2)
    with_embree = visible_geometry(scene)
    monkeypatch.setitem(sys.modules, "embreex", None)
    monkeypatch.setitem(sys.modules, "embreex.rtcore_scene", None)
    without = visible_geometry(scene)
    np.testing.assert_array_equal(with_embree.pixel, without.pixel)
    np.testing.assert_allclose(with_embree.wo, without.wo, atol=1e-6)
