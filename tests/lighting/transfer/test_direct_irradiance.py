"""Direct irradiance that lights give sites: by kept rays, by drawn directions, from one direction."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.environment.softbox import SoftboxLight
from metamer.lighting.lights import DirectionalLight, PointLight
from metamer.lighting.transfer.direct import direct_illuminance
from metamer.lighting.transfer.direct_irradiance import received
from metamer.lighting.transfer.precomputation import Precomputation
from metamer.spectral.illuminants import illuminant

D65, A = illuminant("D65"), illuminant("A")


@pytest.fixture(scope="module")
def corner(scene_of, room):
    """The floor and the back of a room, the floor glossy."""
    scene = scene_of(room[2], room[4])
    prepared = Precomputation.of(scene, 256, 0.4)
    return scene, prepared, prepared.glossy_rays(np.array([True, False]))


def of(corner, *lights):
    scene, prepared, rays = corner
    found = received(prepared, rays, tuple(light.for_observer(scene.observer) for light in lights))
    exact = direct_illuminance(replace(scene, lights=lights), prepared.hits.sites, prepared.occluders, 1024)
    return found, np.concatenate(exact, axis=1), rays


def test_an_even_sky_is_what_is_free_of_it(corner):
    sky = EnvironmentLight(np.ones((1, 16, 32)), (D65,), 1000.0)
    found, _, _ = of(corner, sky)
    free = 1.0 - np.asarray(corner[1].operator.sum(axis=1))
    # The other side of a sheet is no part of a hemisphere that is dark.
    np.testing.assert_allclose(found.lux[:, 0], 1000.0 * free, rtol=2e-3, atol=0.5)


def test_a_sky_of_two_spectra(corner):
    fields = np.random.default_rng(0).uniform(0.0, 1.0, (2, 16, 32))
    fields[1, :, :16] *= 5.0
    found, exact, _ = of(corner, EnvironmentLight(fields, (D65, A), 1000.0))
    assert np.abs(found.lux - exact).max() < 0.12 * exact.max()
    np.testing.assert_allclose(found.lux.mean(axis=0), exact.mean(axis=0), rtol=0.01)


def test_glossy_sites_know_from_where(corner):
    """All that comes in, cell by cell, is the illuminance; and it comes from where the light is."""
    prepared = corner[1]
    sky = EnvironmentLight(np.random.default_rng(1).uniform(0.5, 1.0, (1, 16, 32)), (D65,), 1000.0)
    box = SoftboxLight((0.0, 0.9, 0.5), (0.0, -1.0, 0.5), 0.3, 0.3, D65)
    found, _, rays = of(corner, sky, box)
    np.testing.assert_allclose(found.incoming.sum(axis=2).T, found.lux[rays.sites], rtol=1e-4, atol=1e-3)
    centre, radius = prepared.centre_and_radius
    top = [n for n, site in enumerate(rays.sites) if prepared.hits.sites.normals[site, 1] > 0.0]
    for number in top[::9]:
        site = rays.sites[number]
        to = (np.array([0.0, 0.9, 0.5]) - centre) / radius - prepared.hits.sites.starts[site]
        to = prepared.frames[site] @ (to / np.linalg.norm(to))
        mean = found.incoming[1, number] @ rays.cells.directions()
        assert mean @ to > 0.97 * np.linalg.norm(mean) > 0.0


def test_what_comes_from_one_direction_is_exact(corner):
    lights = DirectionalLight((0.3, 0.5, 0.8), D65), PointLight((0.0, 0.5, 0.5), A, 700.0)
    found, exact, _ = of(corner, *lights)
    np.testing.assert_allclose(found.lux, exact, rtol=1e-5)
    assert [number for number, _, _ in found.free] == [0, 1]
    for number, _, free in found.free:
        assert not found.lux[~free, number].any()


def test_a_near_light_is_drawn(corner):
    found, exact, _ = of(corner, SoftboxLight((0.0, 0.9, 0.5), (0.0, -1.0, 0.5), 0.3, 0.3, D65))
    np.testing.assert_allclose(found.lux, exact, rtol=0.05, atol=5.0)
    assert not found.free
