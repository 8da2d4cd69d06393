"""Meshes as they come: whatever their geometry, light between them is finite, ends, and comes from what is there."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.mesh.files import cleaned_mesh
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import plane, sphere
from metamer.lighting.transfer.bounces import interreflected
from metamer.lighting.transfer.edge_refinement import placed
from metamer.lighting.transfer.operator import irradiance_operator
from metamer.lighting.transfer.ray_cache import build_rays, kept_hits
from metamer.lighting.transfer.regions import Regions
from metamer.lighting.visibility.blocked_probes import beside_shut, edges
from metamer.runtime.errors import InputError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer

BASIS, SEEN, D65 = SpectralBasis.sampled(np.arange(400.0, 701.0, 100.0)), observer("1931_2"), illuminant("D65")
WHITE = 0.8


def lit(scene, rays=32):
    """Every site receives 1000 lux and all are white: the hits, and what each sends out in the end, in lux."""
    hits = placed(scene).traced(rays)
    operator = irradiance_operator(hits)
    rows = np.asarray(operator.sum(axis=1)).ravel()
    assert rows.min() >= 0.0
    assert rows.max() <= 1.0 + 1e-6
    count = len(hits.sites)
    regions = Regions(np.zeros(count, np.int64), np.full((1, 4), WHITE), BASIS)
    lux, fold = np.full((count, 1), 1000.0), BASIS.fold(D65, SEEN)
    found = interreflected(operator, regions, lux, [fold], SEEN.white(D65), 1000.0)
    assert np.isfinite(found.all).all()
    # Each vertex sends at least its direct reflection, and at most that of a closed box.
    assert found.all.min() >= 1000.0 * WHITE - 1e-6
    assert found.all.max() <= 1000.0 * WHITE / (1.0 - WHITE) + 1e-6
    assert (hits.areas >= 0.0).all()
    return hits, found.all[:, 0, 1]


def fronts(scene, hits, part=0):
    """The sites on the fronts of the vertices of a part, large triangles divided."""
    fine = placed(scene).scene
    before = sum(len(each.mesh.vertices) for each in fine.parts[:part])
    return fine.parts[part].mesh.vertices, hits.sites.fronts[before : before + len(fine.parts[part].mesh.vertices)]


def flat(vertices, faces, up=(0.0, 1.0, 0.0)):
    return Mesh(np.array(vertices, dtype=float), np.tile(up, (len(vertices), 1)), np.array(faces))


TRIANGLE = flat([[0, 0, 0], [0, 0, 1], [1, 0, 0]], [[0, 1, 2]])


def test_one_vertex_alone_is_no_mesh():
    with pytest.raises(InputError, match="empty"):
        flat([[0, 0, 0]], np.zeros((0, 3), int))


def test_one_triangle_alone(scene_of):
    hits, sent = lit(scene_of(TRIANGLE))
    # No ray of it meets anything, on either side.
    assert (hits.triangle == -1).all()
    np.testing.assert_allclose(sent, 1000.0 * WHITE)


def test_a_tiny_triangle_above_a_floor(scene_of):
    """A hundred-thousandth of the floor: it sees the floor, and the floor loses nothing by it."""
    speck = flat([[0.1, 0.3, 0.1], [0.1, 0.3, 0.1001], [0.1001, 0.3, 0.1]], [[0, 1, 2]])
    scene = scene_of(plane(4, 4), speck)
    hits, sent = lit(scene)
    assert sent[hits.sites.backs[-3:]].min() > 1100.0
    np.testing.assert_allclose(sent[fronts(scene, hits)[1]], 1000.0 * WHITE, rtol=1e-3)


def test_degenerate_faces_are_refused_and_cleaned_meshes_are_as_without_them(scene_of):
    floor, ball = plane(4, 4), sphere(2, 0.4).placed(translate=(0.0, 0.5, 0.0))
    worse = np.concatenate([ball.faces, [[0, 0, 1], [3, 3, 3]]])
    with pytest.raises(InputError, match="without area"):
        replace(ball, faces=worse)
    clean = cleaned_mesh(ball.vertices, worse, ball.normals)
    plain, found = (lit(scene_of(floor, one))[1] for one in (ball, clean))
    np.testing.assert_allclose(np.sort(found), np.sort(plain), rtol=1e-9)


def test_doubled_faces_count_once(scene_of):
    """The lower square of two receives as much of an upper one whose triangles are there twice."""
    lower, upper = plane(1, 1), plane(1, 1).placed(translate=(0.0, 0.5, 0.0))
    twice = replace(upper, faces=np.concatenate([upper.faces, upper.faces]))
    plain, found = (lit(scene_of(lower, one), 128)[1] for one in (upper, twice))
    assert abs(found.mean() - plain.mean()) < 0.02 * plain.mean()


def test_back_faces_of_a_solid_are_dark(scene_of):
    """A ball turned inside out is a room: its sites inside see each other, and nothing outside sees light from it."""
    ball = sphere(3)
    scene = scene_of(replace(ball, normals=-ball.normals, faces=ball.faces[:, ::-1]))
    hits, sent = lit(scene, 128)
    inside = fronts(scene, hits)[1]
    np.testing.assert_allclose(sent[inside], 1000.0 * WHITE / (1.0 - WHITE), rtol=0.01)
    outside = np.setdiff1d(np.arange(len(sent)), inside)
    np.testing.assert_allclose(sent[outside], 1000.0 * WHITE)


def test_a_sheet_is_seen_from_both_sides(scene_of):
    """Between two floors, one of which lies face down, as much comes back to it from above as from below."""
    low, high = (plane(4, 4).placed(translate=(0.0, y, 0.0)) for y in (-0.5, 0.5))
    scene = scene_of(plane(1, 1), low, flat(high.vertices, high.faces[:, ::-1], (0.0, -1.0, 0.0)))
    hits, sent = lit(scene, 128)
    vertices, above = fronts(scene, hits)
    below = hits.sites.backs[: len(vertices)]
    assert (below >= 0).all()
    np.testing.assert_allclose(sent[above], sent[below], rtol=0.03)
    assert sent[above].min() > 2000.0


def test_vertices_inside_a_solid_receive_nothing(scene_of):
    """A ball sunk into another: what lies in it sees its inside, which is dark."""
    scene = scene_of(sphere(3), sphere(3, 0.5).placed(translate=(0.9, 0.0, 0.0)))
    hits, sent = lit(scene)
    vertices, small = fronts(scene, hits, 1)
    # The large one's triangles lie a little within its vertices.
    within = np.linalg.norm(vertices, axis=1) < 0.97
    assert within.sum() > 50
    np.testing.assert_allclose(sent[small[within]], 1000.0 * WHITE)
    assert sent[small[~within]].max() > 1000.0 * WHITE + 50.0


def test_parts_that_touch_light_each_other_and_not_through_each_other(scene_of):
    """Two boxes with a face in common, above a floor: the sites on that face see nothing."""
    box = _box()
    scene = scene_of(box, box.placed(translate=(1.0, 0.0, 0.0)), plane(6, 6).placed(translate=(0.5, -0.6, 0.0)))
    hits, sent = lit(scene)
    normals = np.concatenate([part.mesh.normals for part in placed(scene).scene.parts[:1]])
    vertices, left = fronts(scene, hits)
    common = (vertices[:, 0] > 0.499) & (normals[:, 0] > 0.9) & (np.abs(vertices[:, 1:]) < 0.4).all(axis=1)
    assert common.sum() > 10
    np.testing.assert_allclose(sent[left[common]], 1000.0 * WHITE)
    foot = (vertices[:, 1] < -0.4) & (normals[:, 0] < -0.9)
    assert sent[left[foot]].min() > 1000.0 * WHITE + 100.0


@pytest.mark.parametrize("above", [0.0, 0.001])
def test_what_lies_below_another_part_darkens_nothing_beside_it(scene_of, above):
    """A box that stands on a floor: where rays end beside it, the floor's sites below the box do not count."""
    floor = plane(3, 3).placed(translate=(0.0, -0.5 - above, 0.0))
    hits = placed(scene_of(floor, _box())).traced(64)
    low, high = hits.sites.starts[hits.part_of_site == 0].min(axis=0), hits.sites.starts.max(axis=0)
    radius = 1.5 / high[0]
    below = (np.abs(hits.sites.starts[:, [0, 2]]) * radius < 0.45).all(axis=1) & (hits.part_of_site == 0)
    upper = below & (hits.sites.normals[:, 1] > 0.0) & (hits.sites.starts[:, 1] >= low[1])
    assert upper.sum() > 5 and hits.shut[upper].all()
    beside = (hits.part_of_site == 0) & (np.abs(hits.sites.starts) * radius > 0.6).any(axis=1)
    assert not hits.shut[beside].any()
    operator = irradiance_operator(hits)
    sides = (hits.part_of_site == 1) & (np.abs(hits.sites.normals[:, 1]) < 0.1)
    whole, seen = (operator @ np.where(hidden, 0.0, 1.0) for hidden in (np.zeros(len(hits.shut), bool), hits.shut))
    assert whole[sides].max() > 0.3
    np.testing.assert_allclose(seen[sides], whole[sides], atol=0.02)
    # Pictures mix what arrives at corners: those below that others are beside have means of the others.
    at = np.where(hits.shut, 0.0, 1.0).astype(np.float32)[:, None, None] * np.ones((1, 21, 2), np.float32)
    found = beside_shut(at, hits.shut, edges(np.concatenate([hits.corners, hits.backs])))
    np.testing.assert_array_equal(found[~hits.shut], at[~hits.shut])
    changed = found[:, 0, 0] != at[:, 0, 0]
    assert changed.sum() > 4 and (found[changed] == 1.0).all()


def _box():
    """A cube of side 1, its sides apart."""
    square = plane(1, 1).placed(translate=(0.0, 0.5, 0.0))
    turned = [square.vertices]
    for axis, angle in ((0, 90), (0, 180), (0, 270), (2, 90), (2, 270)):
        cos, sin = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
        a, b = [k for k in range(3) if k != axis]
        turn = np.eye(3)
        turn[[a, a, b, b], [a, b, a, b]] = cos, -sin, sin, cos
        turned.append((square.vertices @ turn.T).round(6))
    normals = np.repeat([vertices.mean(axis=0) / 0.5 for vertices in turned], 4, axis=0)
    faces = np.concatenate([square.faces + 4 * k for k in range(6)])
    return Mesh(np.concatenate(turned), normals, faces)


@pytest.mark.slow
def test_three_hundred_parts(scene_of, tmp_path):
    ball = sphere(1, 0.4)
    places = [(n % 20, 0.4, n // 20) for n in range(300)]
    scene = scene_of(*(ball.placed(translate=place) for place in places))
    hits, sent = lit(scene, 16)
    assert hits.part_of_site.max() == 299
    # Each ball has sites of its own: its vertices, and some between them.
    count = np.bincount(hits.part_of_site)
    assert count.min() == len(ball.vertices) and count.max() < 1.3 * len(ball.vertices)
    # In the middle of the field a ball sees more of others than at its corner.
    of_part = np.bincount(hits.part_of_site, sent) / len(ball.vertices)
    assert of_part[20 * 7 + 10] > of_part[0] > 1000.0 * WHITE
    build_rays(scene, tmp_path, 16)
    assert np.array_equal(kept_hits(scene, tmp_path, 16).triangle, hits.triangle)


def test_vertices_that_no_triangle_uses_change_nothing(scene_of):
    floor, ball = plane(4, 4), sphere(2, 0.4).placed(translate=(0.0, 0.5, 0.0))
    more = Mesh(
        np.concatenate([[[0.0, 9.0, 0.0]], ball.vertices, [[0.2, 0.2, 0.2]]]),
        np.concatenate([[[0.0, 1.0, 0.0]], ball.normals, [[0.0, 1.0, 0.0]]]),
        ball.faces + 1,
    )
    (plain, sent), (found, other) = (lit(scene_of(floor, one)) for one in (ball, more))
    assert len(found.sites) == len(plain.sites)
    assert (found.sites.fronts == -1).sum() == 2
    np.testing.assert_allclose(other, sent, rtol=1e-9)
