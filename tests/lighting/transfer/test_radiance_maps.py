"""Radiance that sites see of other surfaces, by direction: maps beside many rays, where polynomials are far off."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.lighting.transfer import radiance_maps
from metamer.lighting.transfer.edge_refinement import placed
from metamer.lighting.transfer.hits import ray_directions
from metamer.lighting.transfer.indirect import RADIANCE, arriving, radiance_under_lobes
from metamer.lighting.transfer.radiance_maps import BLUNT, LEVELS, TEXELS, RadianceMaps, hemisphere_places
from metamer.lighting.transfer.ray_light import RayLight


@pytest.fixture(scope="module")
def hits(scenes):
    """A floor below a wall and a ball that hangs in the air."""
    wall = shapes.plane(2.0, 2.0).placed(rotate_deg=(90.0, 0.0, 0.0), translate=(0.0, 1.0, -1.0))
    ball = shapes.sphere(2, 0.3).placed(translate=(0.3, 0.7, 0.2))
    scene = scenes.scene_of(
        [(shapes.plane(2.0, 2.0), "floor"), (wall, "wall"), (ball, "ball")], [scenes.sun()], Camera("c", (1, 1, 3))
    )
    return placed(scene, 0.25).traced(1024)


def floor(hits):
    return np.flatnonzero((hits.part_of_site == 0) & (hits.sites.normals[:, 1] > 0.5) & ~hits.shut)


def mapped(hits, radiosity, sites):
    return RadianceMaps.of(hits, RayLight(radiosity), sites, arriving(hits, RayLight(radiosity))[:, RADIANCE])


def looked_up(maps, hits, radiosity, sites, to, sharpness):
    """At sites themselves, and what polynomials tell there."""
    at = arriving(hits, RayLight(radiosity))[sites][:, RADIANCE].astype(np.float64)
    blunt = radiance_under_lobes(at, to, sharpness)
    shares = np.tile([1.0, 0.0, 0.0], (len(sites), 1))
    near = np.stack([sites, sites, sites], axis=1)
    return maps.under_lobes(blunt, near, shares, to, sharpness, slice(None)), blunt


def by_rays(hits, radiosity, sites, to, sharpness):
    """The mean over all kept rays under a Gaussian, each by its solid angle."""
    rays = ray_directions(hits.sites.normals[sites], sites, hits.rays)
    number, share = hits.about(hits.triangle[sites], hits.place[sites])
    sent = np.einsum("nrc,nrcf->nrf", share, radiosity[number]) / np.pi
    cosine = np.einsum("nri,ni->nr", rays, hits.sites.normals[sites])
    under = np.exp(sharpness[..., None] * (np.einsum("nqi,nri->nqr", to, rays) - 1.0)) / cosine[:, None]
    return (under @ sent) / under.sum(axis=2, keepdims=True)


def lobes_about(count, sharpness, tilt_deg=55.0):
    """A lobe at each site, about directions that rise above the floor."""
    turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    tilt = np.radians(tilt_deg)
    to = np.stack([np.sin(tilt) * np.cos(turn), np.full(count, np.cos(tilt)), np.sin(tilt) * np.sin(turn)], axis=1)
    return to[:, None], np.full((count, 1), sharpness)


@pytest.mark.slow_cases("16.0", "32.0")
@pytest.mark.parametrize("sharpness", [8.0, 16.0, 32.0, 60.0])
def test_highlights_are_those_of_the_rays(hits, sharpness):
    sites = floor(hits)
    radiosity = np.where(hits.part_of_site == 1, 3.0, np.where(hits.part_of_site == 2, 9.0, 0.5))[:, None]
    to, lobes = lobes_about(len(sites), sharpness)
    found, blunt = looked_up(mapped(hits, radiosity, sites), hits, radiosity, sites, to, lobes)
    want = by_rays(hits, radiosity, sites, to, lobes)
    off, polynomials = (np.sqrt(np.mean((one - want) ** 2)) for one in (found, blunt))
    assert off < 0.12 * want.std() + 0.02
    assert off < 0.35 * polynomials


def test_even_light_is_even(hits):
    """All surfaces and the sky alike: whatever a lobe looks at."""
    sites, box = floor(hits), np.ones((len(hits.sites), 2)) * [np.pi, 2.0 * np.pi]
    closed = replace(hits, triangle=np.where(hits.triangle < 0, 0, hits.triangle))
    to, lobes = lobes_about(len(sites), 40.0)
    found, _ = looked_up(mapped(closed, box, sites), closed, box, sites, to, lobes)
    np.testing.assert_allclose(found, np.broadcast_to([1.0, 2.0], found.shape), rtol=2e-3)


def test_blunt_lobes_are_the_polynomials(hits):
    sites = floor(hits)
    radiosity = np.where(hits.part_of_site == 1, 3.0, 0.0)[:, None]
    to, lobes = lobes_about(len(sites), BLUNT)
    found, blunt = looked_up(mapped(hits, radiosity, sites), hits, radiosity, sites, to, lobes)
    np.testing.assert_array_equal(found, blunt)


@pytest.mark.slow
def test_levels_join(hits):
    """A lobe that sharpens by a hair changes by a hair, at each level and at the end of them."""
    sites = floor(hits)
    radiosity = np.where(hits.part_of_site == 1, 3.0, 0.5)[:, None]
    maps = mapped(hits, radiosity, sites)
    for sharpness in (BLUNT, *(one for one, _ in LEVELS)):
        to, below = lobes_about(len(sites), sharpness * (1.0 - 1e-6))
        before, after = (looked_up(maps, hits, radiosity, sites, to, below * one)[0] for one in (1.0, 1.0 + 2e-6))
        np.testing.assert_allclose(before, after, atol=1e-4)
    to, sharp = lobes_about(len(sites), 1e6)
    last, end = (looked_up(maps, hits, radiosity, sites, to, one)[0] for one in (sharp, 0.0 * sharp + LEVELS[-1][0]))
    np.testing.assert_array_equal(last, end)


def test_lobes_below_the_horizon_see_what_is_at_the_horizon(hits):
    sites = floor(hits)
    radiosity = np.where(hits.part_of_site == 1, 3.0, 0.5)[:, None]
    to, lobes = lobes_about(len(sites), 30.0, tilt_deg=95.0)
    level = lobes_about(len(sites), 30.0, tilt_deg=90.0)[0]
    maps = mapped(hits, radiosity, sites)
    normals = hits.sites.normals[sites]
    np.testing.assert_allclose(
        hemisphere_places(to[:, 0], normals), hemisphere_places(level[:, 0], normals), atol=1e-12
    )
    found = looked_up(maps, hits, radiosity, sites, to, lobes)[0]
    assert np.isfinite(found).all() and found.max() <= 3.1 / np.pi and found.min() >= -0.05
    straight_down = hemisphere_places(-normals, normals)
    assert np.isfinite(straight_down).all()


@pytest.mark.slow_cases("1e-06", "10000000.0")
@pytest.mark.parametrize("scale", [1e-6, 1e7])
def test_very_dark_and_very_bright_light_keep_their_precision(hits, scale):
    sites = floor(hits)
    radiosity = np.where(hits.part_of_site == 1, 3.0, 0.5)[:, None]
    to, lobes = lobes_about(len(sites), 30.0)
    plain, scaled = (
        looked_up(mapped(hits, radiosity * one, sites), hits, radiosity * one, sites, to, lobes)[0] / one
        for one in (1.0, scale)
    )
    np.testing.assert_allclose(scaled, plain, rtol=3e-3, atol=1e-3)


def test_no_light_at_all_is_dark(hits):
    sites, none = floor(hits), np.zeros((len(hits.sites), 1))
    to, lobes = lobes_about(len(sites), 30.0)
    assert (looked_up(mapped(hits, none, sites), hits, none, sites, to, lobes)[0] == 0.0).all()


def test_sites_that_are_shut_have_the_map_of_a_neighbour(hits, monkeypatch):
    sites = floor(hits)
    shut = np.zeros(len(hits.sites), bool)
    shut[sites[len(sites) // 2]] = True
    covered = replace(hits)
    covered.__dict__["shut"] = shut
    maps = mapped(covered, np.ones((len(hits.sites), 1)), sites)
    assert len(maps.values) == len(sites) - 1
    number = maps.number[sites[len(sites) // 2]]
    assert number >= 0 and (maps.number == number).sum() == 2
    assert maps.values.shape[1] == TEXELS == sum(side**2 for _, side in radiance_maps.LEVELS)
