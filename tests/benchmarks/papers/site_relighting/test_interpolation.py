"""Light that leaves surfaces between sites."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.benchmarks.papers.site_relighting.interpolation import SurfacePoints, exits_between
from metamer.benchmarks.papers.site_relighting.relighting import Relighting
from metamer.benchmarks.papers.transfer_tensors.families import cook_torrance
from metamer.benchmarks.papers.transfer_tensors.parametric import Tuned
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import sphere
from metamer.lighting.transfer.precomputation import Precomputation
from metamer.lighting.vectors import unit
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

FAMILY = cook_torrance()
NONE = np.zeros(len(NM))
RED = np.interp(NM, [380, 560, 620, 780], [0.04, 0.08, 0.75, 0.8])
GOLD = np.interp(NM, [380, 480, 560, 780], [0.35, 0.4, 0.85, 0.95])
EYE = np.array([0.2, 0.4, 3.0])


def worn(scene, *surfaces):
    parts = tuple(replace(part, material=part.name) for part in scene.parts)
    return replace(scene, parts=parts), dict(zip((part.name for part in parts), surfaces, strict=True))


@pytest.fixture(scope="module")
def shown(scene_of, hollow):
    """A golden ball of few triangles inside a large red one, which sends out light that changes from pole to pole."""

    def made(fineness, rays):
        ball, around = sphere(fineness), Mesh(3.0 * hollow.vertices, hollow.normals, hollow.faces)
        gold, red = Tuned(NM, NONE, GOLD, FAMILY, (0.9, 0.25)), Tuned(NM, RED, NONE, FAMILY, (0.04, 0.3))
        scene, surfaces = worn(scene_of(ball, around), gold, red)
        state = Relighting.of(scene, surfaces, Precomputation.of(scene, rays, 9.0), bounces=1)
        height = state.prepared.hits.sites.starts[:, 1]
        lux = np.where(state.prepared.hits.part_of_site == 1, 1000.0 * (1.0 + np.sin(9.0 * height)), 0.0)
        got = replace(state.received, lux=lux.astype(np.float32)[:, None], free=())
        return replace(state, _received=got)

    return made


def at(state, sites, shares, normals, planes=None):
    """Points of the first part, with level frames of these normals, on triangles of these or other ones."""
    hits = state.prepared.hits
    centre, radius = state.prepared.centre_and_radius
    places = np.einsum("nc,nci->ni", shares, hits.sites.starts[sites]) * radius + centre
    along = unit(np.cross([0.3, 1.0, 0.2], normals))
    frame = np.stack([along, np.cross(normals, along), normals], axis=1)
    wo = np.einsum("nij,nj->ni", frame, unit(EYE - places))
    seen = wo[:, 2] > 0.2
    planes = normals if planes is None else planes
    part = np.zeros(seen.sum(), dtype=np.int64)
    return SurfacePoints(part, sites[seen], shares[seen], frame[seen], wo[seen], planes[seen]), seen


def test_at_sites_it_is_what_sites_send(shown):
    state = shown(2, 256)
    sites = np.flatnonzero(state.prepared.hits.part_of_site == 0)
    three = np.stack([sites, np.roll(sites, 1), np.roll(sites, 2)], axis=1)
    shares = np.tile([1.0, 0.0, 0.0], (len(sites), 1))
    points, seen = at(state, three, shares, state.prepared.hits.sites.normals[sites])
    assert seen.sum() > 10
    np.testing.assert_allclose(exits_between(state, points), state.exits(EYE)[sites[seen]], rtol=1e-4, atol=1e-6)


@pytest.mark.slow
def test_between_sites_a_highlight_has_the_normal_of_its_point(shown):
    """In the middles of triangles of a coarse ball: nearer to what a fine ball's sites send than means of corners."""
    coarse, fine = shown(1, 512), shown(4, 512)
    sites = coarse.prepared.hits.corners[coarse.prepared.hits.part == 0]
    shares = np.full((len(sites), 3), 1.0 / 3.0)
    normals = unit(coarse.prepared.hits.sites.normals[sites].mean(axis=1))
    points, seen = at(coarse, sites, shares, normals)
    found = exits_between(coarse, points)[:, 1]
    mean = coarse.exits(EYE)[sites[seen]].mean(axis=1)[:, 1]
    ours = np.flatnonzero(fine.prepared.hits.part_of_site == 0)
    near = ours[np.argmax(normals[seen] @ fine.prepared.hits.sites.normals[ours].T, axis=1)]
    want = fine.exits(EYE)[near][:, 1]
    off, off_mean = (np.abs(one - want).mean() / want.mean() for one in (found, mean))
    assert off < 0.12, off_mean
    assert off < 0.5 * off_mean


@pytest.mark.slow
def test_nothing_comes_from_below_the_triangle_that_is_seen(shown):
    """A normal that leans out of its triangle: what a highlight would show of the other side is left out."""
    state = shown(2, 1024)
    sites = state.prepared.hits.corners[state.prepared.hits.part == 0]
    shares, normals = np.full((len(sites), 3), 1.0 / 3.0), unit(state.prepared.hits.sites.normals[sites].mean(axis=1))
    points, seen = at(state, sites, shares, normals)
    whole = exits_between(state, points)
    # A plane along the mirrored view cuts the highlight in half; one that the viewer is below leaves nothing of it.
    to = np.einsum("nij,ni->nj", points.frame, points.wo * (-1.0, -1.0, 1.0))
    across = unit(normals[seen] - np.einsum("ni,ni->n", normals[seen], to)[:, None] * to)
    half = exits_between(state, replace(points, plane=across))
    none = exits_between(state, replace(points, plane=-normals[seen]))
    slanting = points.wo[:, 2] < 0.8
    assert slanting.sum() > 5
    ratio = half[slanting, 1] / whole[slanting, 1]
    assert 0.35 < np.median(ratio) < 0.75
    assert (half[:, 1] <= whole[:, 1] + 1e-6).all()
    assert np.abs(none).max() < 1e-3 * whole.max()
