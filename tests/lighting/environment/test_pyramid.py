"""An environment under spherical Gaussians and under the clamped cosine, against sums over all directions."""

import numpy as np
import pytest
from metamer.lighting.environment import latlong, octahedral
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.environment.prefiltering import Irradiance
from metamer.lighting.environment.pyramid import Pyramid
from metamer.runtime.errors import InputError
from metamer.spectral.spectrum import Spectrum

WAVELENGTHS = np.arange(380.0, 781.0, 5.0)
WHITE = Spectrum(np.ones(len(WAVELENGTHS)), WAVELENGTHS, "emission")
SHAPE = (64, 128)


def _environment(fields, **more):
    return EnvironmentLight(fields, (WHITE,) * len(fields), **more)


@pytest.fixture(scope="module")
def sky():
    """Two fields, one rough, one smooth with a sun ten thousand times as bright; turned."""
    rough = np.random.default_rng(1).random(SHAPE) ** 4
    smooth = 1.0 + latlong.texel_directions(*SHAPE)[..., 1]
    smooth[14, 30] = 1e4
    return _environment(np.stack([rough, smooth]), rotation_deg=70.0)


@pytest.fixture(scope="module")
def pyramid(sky):
    return Pyramid.of(sky)


def _directions(number):
    to = np.random.default_rng(2).normal(size=(number, 3))
    return to / np.linalg.norm(to, axis=1, keepdims=True)


def _everywhere(environment, factor=8):
    """Directions of the world, their solid angles, and luminances: a map's own meaning, `factor` times as fine."""
    height, width = (factor * side for side in environment.fields.shape[1:])
    to = latlong.texel_directions(height, width).reshape(-1, 3) @ environment.world_from_map.T
    return to, np.repeat(latlong.solid_angles(height, width), width), environment.luminance(to, to)


def _summed(environment, to, kernel):
    """(n, K) means under a kernel of the cosine, by sums."""
    around, weights, luminance = _everywhere(environment)
    each = [kernel(one @ around.T) * weights for one in to]
    return np.stack([one @ luminance / one.sum() for one in each])


@pytest.mark.parametrize("sharpness", [0.0, 1e-6, 0.5, 8.0, 64.0, 512.0, 4096.0])
def test_a_level_is_the_mean_under_its_gaussian(sky, pyramid, sharpness):
    to = _directions(12)
    expected = _summed(sky, to, lambda cosine: np.exp(sharpness * (cosine - 1.0)))
    # Linear between texels a third of a standard deviation apart: 3 % of what varies.
    np.testing.assert_allclose(pyramid(to, np.full(12, sharpness))[:, 0], expected[:, 0], rtol=0.04)


@pytest.mark.parametrize("sharpness", [0.1, 0.7, 2.9, 11.0, 180.0])
def test_between_levels_it_is_near_the_mean_under_the_gaussian_asked_for(sky, pyramid, sharpness):
    to = _directions(12)
    expected = _summed(sky, to, lambda cosine: np.exp(sharpness * (cosine - 1.0)))
    np.testing.assert_allclose(pyramid(to, np.full(12, sharpness))[:, 0], expected[:, 0], rtol=0.04)


def test_a_sun_spreads_as_its_gaussian_and_the_sky_beside_it_stays_as_dark(sky, pyramid):
    sun = latlong.texel_directions(*SHAPE)[14, 30] @ sky.world_from_map.T
    away = np.array([-sun, [sun[2], 0.0, -sun[0]]]) / np.array([[1.0], [np.hypot(sun[0], sun[2])]])
    sharpness = 512.0
    expected = _summed(sky, np.vstack([sun, away]), lambda cosine: np.exp(sharpness * (cosine - 1.0)))[:, 1]
    found = pyramid(np.vstack([sun, away]), np.full(3, sharpness))[:, 1]
    assert found == pytest.approx(expected, rel=0.03)


def test_a_uniform_environment_is_itself_under_every_gaussian_and_from_everywhere():
    uniform = _environment(np.ones((1, 10, 20)), illuminance_lux=np.pi)
    to, sharpness = _directions(200), 10.0 ** np.linspace(-6.0, 8.0, 200)
    np.testing.assert_allclose(Pyramid.of(uniform)(to, sharpness), 1.0, rtol=1e-6)
    np.testing.assert_allclose(Irradiance.of(uniform)(to), np.pi, rtol=1e-9)


def test_beyond_the_finest_level_it_tends_to_the_map_itself(sky, pyramid):
    to = _directions(50)
    luminance = sky.luminance(to, to)
    np.testing.assert_allclose(pyramid(to, np.full(50, np.inf)), luminance, rtol=1e-12)
    np.testing.assert_allclose(pyramid(to, np.full(50, 1e12)), luminance, rtol=1e-4)


def test_one_call_takes_each_direction_at_its_own_sharpness(pyramid):
    to, sharpness = _directions(9), np.array([0.0, 0.2, 0.5, 1.0, 77.0, 4096.0, 5000.0, 1e7, np.inf])
    each = [pyramid(to[i : i + 1], sharpness[i : i + 1])[0] for i in range(9)]
    np.testing.assert_allclose(pyramid(to, sharpness), each, rtol=1e-12)


def test_the_edges_of_an_octahedral_map_hold_together(pyramid):
    """Across the horizon's fold, where the square's edges meet, nothing jumps."""
    down = np.array([[1e-9, -1.0, 1e-9], [-1e-9, -1.0, 1e-9], [1e-9, -1.0, -1e-9], [-1e-9, -1.0, -1e-9]])
    found = pyramid(down, np.full(4, 16.0))
    np.testing.assert_allclose(found, np.broadcast_to(found[0], found.shape), rtol=1e-6)
    # The square's edge is where x = 0 or z = 0 below the horizon.
    beside = np.array([[1e-9, -0.6, 0.8], [-1e-9, -0.6, 0.8]])
    found = pyramid(beside, np.full(2, 64.0))
    np.testing.assert_allclose(found[0], found[1], rtol=1e-6)


def test_octahedral_places_and_directions_are_each_others_inverse():
    to = np.concatenate([_directions(500), np.eye(3), -np.eye(3)])
    np.testing.assert_allclose(octahedral.unfolded(*octahedral.places(to)), to, atol=1e-12)


def test_irradiance_is_the_sum_under_the_clamped_cosine(sky):
    normals = _directions(60)
    around, weights, luminance = _everywhere(sky, factor=4)
    expected = (np.maximum(normals @ around.T, 0.0) * weights) @ luminance
    found = Irradiance.of(sky)(normals)
    # Whole texels of the map are smoothed over a little; a sun's own are the most of what it gives.
    assert (np.abs(found - expected) <= 0.004 * expected.max(axis=0)).all()
    np.testing.assert_allclose(found[:, 0], expected[:, 0], rtol=1e-3)


@pytest.mark.parametrize("sharpness", [-1.0, np.nan])
def test_a_sharpness_that_is_none_is_refused(pyramid, sharpness):
    with pytest.raises(InputError, match="not a sharpness"):
        pyramid(_directions(1), np.array([sharpness]))
