"""Triangles cut at the middles of edges: nothing jumps, nothing is lost, and what is whole stays what it was."""

import numpy as np
import pytest
from metamer.lighting.mesh.shapes import sphere
from metamer.lighting.visibility.edge_bisection import Halving


@pytest.fixture(scope="module")
def cut():
    """A ball, a third of whose edges have a middle: places of all vertices, the pairs, and the cuts."""
    ball, rng = sphere(2), np.random.default_rng(4)
    faces = ball.faces
    edges = np.unique(np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1), axis=0)
    pairs = edges[rng.random(len(edges)) < 1.0 / 3.0]
    places = np.concatenate([ball.vertices, ball.vertices[pairs].mean(axis=1)])
    return faces, places, pairs, Halving.none(faces).cut(np.arange(len(ball.vertices)), pairs)


def new_pieces(halving, before):
    return (halving.pieces >= before).any(axis=1)


def area_of(places, triangles):
    a, b, c = np.moveaxis(places[triangles], 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1)


def is_cut(halving, face):
    return halving.next[face] >= 0


def points(count, number=0):
    rng = np.random.default_rng(number)
    return rng.integers(0, 320, count), rng.dirichlet(np.ones(3), count)


def test_pieces_are_the_triangles_cut_up(cut):
    faces, places, _, halving = cut
    whole = area_of(places, faces)
    assert np.allclose(np.bincount(halving.of, area_of(places, halving.pieces), len(faces)), whole)
    assert np.bincount(halving.of).max() == 4 and (np.diff(halving.of) >= 0).all()
    assert (halving.whole == ~is_cut(halving, halving.of)).all() and halving.whole[np.unique(halving.of)].mean() > 0.2
    # Shares say where the corners of pieces are.
    shared = np.einsum("tck,tki->tci", halving.shares, places[faces[halving.of]])
    assert np.abs(shared - places[halving.pieces]).max() < 1e-15
    assert set(np.unique(halving.shares)) == {0.0, 0.5, 1.0}


def test_a_point_stays_where_it_is_on_the_smallest_piece(cut):
    faces, places, _, halving = cut
    face, weights = points(4000)
    corners, found = halving.located(face, weights)
    assert found.min() >= -1e-15 and np.abs(found.sum(axis=1) - 1.0).max() < 1e-12
    before, after = (np.einsum("nk,nki->ni", w, places[c]) for w, c in ((weights, faces[face]), (found, corners)))
    assert np.abs(before - after).max() < 1e-12
    known = {tuple(sorted(one)) for one in halving.pieces.tolist()}
    assert all(tuple(sorted(one)) in known for one in corners.tolist())


def test_what_is_whole_is_not_touched(cut):
    faces, _, _, halving = cut
    face, weights = points(4000)
    corners, found = halving.located(face, weights)
    whole = ~is_cut(halving, face)
    assert 0.2 < whole.mean() < 0.5
    assert (found[whole] == weights[whole]).all() and (corners[whole] == faces[face][whole]).all()


def test_nothing_jumps_over_an_edge_and_middles_have_their_own_values(cut):
    faces, places, pairs, halving = cut
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
            corners, found = halving.located(np.full(len(along), face), weights)
            seen.append((values[corners] * found).sum(axis=1))
        assert np.abs(seen[0] - seen[1]).max() < 1e-12
        if edge in middles:
            assert seen[0][16] == values[middles[edge]]


def test_without_middles_nothing_is_cut():
    faces = sphere(1).faces
    halving = Halving.none(faces).cut(np.arange(42), np.zeros((0, 2), dtype=np.int64))
    assert not len(halving.middle) and halving.whole.all() and not new_pieces(halving, 42).any()
    assert (halving.pieces == faces).all() and (halving.shares == np.eye(3)).all()


def test_both_sides_of_a_seam_are_cut():
    """Two triangles whose shared edge has vertices of its own on each side, of the same sites."""
    faces, sites = np.array([[0, 1, 2], [4, 3, 5]]), np.array([7, 2, 3, 7, 2, 9])
    halving = Halving.none(faces).cut(sites, np.array([[0, 1]]))
    assert halving.middle.tolist() == [6, 6] and halving.of.tolist() == [0, 0, 1, 1] and new_pieces(halving, 6).all()
    assert all(6 in piece for piece in halving.pieces.tolist())


def test_what_is_cut_is_cut_again(cut):
    """Middles of what a first round has made: its cuts stay what they were."""
    faces, places, pairs, first = cut
    half = np.stack([pairs[::2, 0], len(places) - len(pairs) + np.arange(len(pairs))[::2]], axis=1)
    halving = first.cut(np.arange(len(places)), half)
    new = new_pieces(halving, len(places))
    both = np.concatenate([places, places[half].mean(axis=1)])
    assert {*range(len(places), len(both))} == {*halving.pieces[new].ravel().tolist()} - {*range(len(places))}
    count = len(first.middle)
    assert (halving.middle[:count] == first.middle).all() and (halving.opposite[:count] == first.opposite).all()
    # A piece that is left stays; what is cut is cut into as much.
    kept = {tuple(piece) for piece in first.pieces.tolist()}
    assert all(tuple(piece) in kept for piece in halving.pieces[~new].tolist())
    assert np.allclose(np.bincount(halving.of, area_of(both, halving.pieces), len(faces)), area_of(both, faces))
    assert set(np.unique(halving.shares)) == {0.0, 0.25, 0.5, 0.75, 1.0}
    face, weights = points(4000)
    corners, found = halving.located(face, weights)
    before, after = (np.einsum("nk,nki->ni", w, both[c]) for w, c in ((weights, faces[face]), (found, corners)))
    assert np.abs(before - after).max() < 1e-12
    known = {tuple(sorted(one)) for one in halving.pieces.tolist()}
    assert all(tuple(sorted(one)) in known for one in corners.tolist())
