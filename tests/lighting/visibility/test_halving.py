"""Triangles cut at the middles of edges: nothing jumps, nothing is lost, and what is whole stays what it was."""

import numpy as np
import pytest
from metamer.lighting.shapes import sphere
from metamer.lighting.visibility.halving import halved


@pytest.fixture(scope="module")
def cut():
    """A ball, a third of whose edges have a middle: places of all vertices, the cuts, and their pieces."""
    ball, rng = sphere(2), np.random.default_rng(4)
    faces = ball.faces
    edges = np.unique(np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1), axis=0)
    pairs = edges[rng.random(len(edges)) < 1.0 / 3.0]
    places = np.concatenate([ball.vertices, ball.vertices[pairs].mean(axis=1)])
    return faces, places, pairs, *halved(faces, np.arange(len(ball.vertices)), pairs)


def points(count, number=0):
    rng = np.random.default_rng(number)
    return rng.integers(0, 320, count), rng.dirichlet(np.ones(3), count)


def test_pieces_are_the_triangles_cut_up(cut):
    faces, places, _, halving, pieces, of = cut
    a, b, c = np.moveaxis(places[pieces], 1, 0)
    area = np.bincount(of, np.linalg.norm(np.cross(b - a, c - a), axis=1), len(faces))
    a, b, c = np.moveaxis(places[faces], 1, 0)
    whole = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    assert np.allclose(area[halving.roots >= 0], whole[halving.roots >= 0]) and not area[halving.roots < 0].any()
    assert 3 <= np.bincount(of).max() <= 4


def test_a_point_stays_where_it_is_on_the_smallest_piece(cut):
    faces, places, _, halving, pieces, _ = cut
    face, weights = points(4000)
    corners, found = halving.located(face, faces[face], weights.copy())
    assert found.min() >= -1e-15 and np.abs(found.sum(axis=1) - 1.0).max() < 1e-12
    before, after = (np.einsum("nk,nki->ni", w, places[c]) for w, c in ((weights, faces[face]), (found, corners)))
    assert np.abs(before - after).max() < 1e-12
    known = {tuple(sorted(one)) for one in pieces.tolist()}
    assert all(tuple(sorted(one)) in known for one in corners[halving.roots[face] >= 0].tolist())


def test_what_is_whole_is_not_touched(cut):
    faces, _, _, halving, _, _ = cut
    face, weights = points(4000)
    corners, found = halving.located(face, faces[face], weights.copy())
    whole = halving.roots[face] < 0
    assert 0.2 < whole.mean() < 0.5
    assert (found[whole] == weights[whole]).all() and (corners[whole] == faces[face][whole]).all()


def test_nothing_jumps_over_an_edge_and_middles_have_their_own_values(cut):
    faces, places, pairs, halving, _, _ = cut
    values = np.random.default_rng(1).normal(size=len(places))
    edges = {}
    for face, corners in enumerate(faces.tolist()):
        for c in range(3):
            edges.setdefault(frozenset((corners[c - 1], corners[c - 2])), []).append(face)
    along = np.linspace(0.0, 1.0, 33)
    middles = {frozenset(pair): len(places) - len(pairs) + n for n, pair in enumerate(pairs.tolist())}
    for edge, sides in edges.items():
        one, other = edge
        seen = []
        for face in sides:
            weights = (faces[face] == one) * along[:, None] + (faces[face] == other) * (1.0 - along)[:, None]
            where = np.full(len(along), face)
            corners, found = halving.located(where, faces[where], weights)
            seen.append((values[corners] * found).sum(axis=1))
        assert np.abs(seen[0] - seen[1]).max() < 1e-12
        if edge in middles:
            assert seen[0][16] == values[middles[edge]]


def test_without_middles_nothing_is_cut():
    faces = sphere(1).faces
    halving, pieces, of = halved(faces, np.arange(42), np.zeros((0, 2), dtype=np.int64))
    assert (halving.roots == -1).all() and not len(halving.middle) and not len(pieces) and not len(of)


def test_both_sides_of_a_seam_are_cut():
    """Two triangles whose shared edge has vertices of its own on each side, of the same sites."""
    faces, sites = np.array([[0, 1, 2], [4, 3, 5]]), np.array([7, 2, 3, 7, 2, 9])
    halving, pieces, of = halved(faces, sites, np.array([[0, 1]]))
    assert halving.middle.tolist() == [6, 6] and of.tolist() == [0, 1, 0, 1]
    assert all(6 in piece for piece in pieces.tolist())
