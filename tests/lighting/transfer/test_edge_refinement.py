"""Sites in the middle of edges: where light between parts is not linear, and what that leaves between sites."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.mesh.shapes import plane, sphere
from metamer.lighting.transfer.edge_refinement import between_sites, placed
from metamer.lighting.visibility.pieces import pieces
from metamer.lighting.visibility.refinement import refined
from small_rooms import rectangle


def block(low, high):
    """A box whose sides have vertices of their own."""
    import trimesh

    box = trimesh.creation.box(bounds=[low, high])
    corners = box.vertices[box.faces].reshape(-1, 3)
    mesh = rectangle((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))
    return replace(
        mesh, vertices=corners, normals=np.repeat(box.face_normals, 3, axis=0), faces=np.arange(36).reshape(12, 3)
    )


@pytest.fixture(scope="module")
def standing(scene_of):
    """A block that stands on a floor with a texture."""
    return scene_of(plane(2.0, 2.0), block((-0.3, 0.0, -0.2), (0.2, 0.6, 0.3)))


@pytest.fixture(scope="module")
def found(standing):
    return placed(standing, most=0.1)


def test_middles_stand_where_parts_meet(found, standing):
    fine = refined(standing)[0]
    floor = found.scene.parts[0].mesh.vertices[len(fine.parts[0].mesh.vertices) :]
    before, after = (len(placed(standing, most=most).sites) for most in (0.0, 0.1))
    # Twins on the other side of a crease come on top.
    assert found.added > 0 and before < after <= 1.12 * before
    # As far from the block as a triangle's edge.
    off = np.maximum(np.array([-0.3, -0.2]) - floor[:, [0, 2]], floor[:, [0, 2]] - np.array([0.2, 0.3])).max(axis=1)
    assert len(floor) and off.max() < 0.5 and np.abs(off).mean() < 0.2


def test_what_is_cut_is_the_same_surface(found, standing):
    for whole, cut in zip(standing.parts, found.scene.parts, strict=True):
        one, other = whole.mesh, cut.mesh
        area = [np.linalg.norm(np.cross(a[:, 1] - a[:, 0], a[:, 2] - a[:, 0]), axis=1).sum() for a in
                (one.vertices[one.faces], other.vertices[other.faces])]  # fmt: skip
        assert area[1] == pytest.approx(area[0], rel=1e-12)
    # Creases are cut on both sides: a solid stays one.
    assert pieces(found.scene.parts[1].mesh).solid.all()


def test_textures_stay_where_they_are(found):
    mesh = found.scene.parts[0].mesh
    assert mesh.uv is not None
    np.testing.assert_allclose(mesh.uv[:, 0], mesh.vertices[:, 0] / 2.0 + 0.5, atol=1e-9)


def test_points_find_the_sites_about_them(found, standing):
    rng = np.random.default_rng(2)
    triangles = np.concatenate([part.mesh.vertices[part.mesh.faces] for part in standing.parts])
    face, shares = rng.integers(0, len(triangles), 3000), rng.dirichlet(np.ones(3), 3000)
    vertices, weights = found.refinement.located(face, shares)
    places = np.concatenate([part.mesh.vertices for part in found.scene.parts])[found.order]
    there = np.einsum("nc,nci->ni", weights, places[vertices])
    np.testing.assert_allclose(there, np.einsum("nc,nci->ni", shares, triangles[face]), atol=1e-12)
    assert weights.min() > -1e-12
    # Points on cut edges are found between the new vertices.
    assert (vertices >= len(places) - found.added).any()


def test_between_sites_less_is_missing(standing):
    missed = []
    for most in (0.0, 1.0):
        bodies = placed(standing, most=most)
        hits = bodies.traced(64)
        part = hits.part_of_site
        # The block alone sends light: what of it arrives changes fast beside it.
        found = between_sites(bodies.scene, hits, (part == 1).astype(float)[:, None])
        missed.append(float(np.abs(found.traced - found.mixed).mean()))
        assert found.traced.max() > 0.3
    assert missed[1] < 0.9 * missed[0]


def test_a_body_in_the_open_has_no_more_sites(scene_of):
    scene = scene_of(sphere(3))
    assert not placed(scene).added
    assert len(placed(scene).sites) == len(scene.parts[0].mesh.vertices)
