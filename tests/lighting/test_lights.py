import numpy as np
import pytest
from metamer.lighting.lights import DirectionalLight, PointLight
from metamer.runtime.errors import InputError
from metamer.spectral.illuminants import illuminant
from metamer.spectral.spectrum import Spectrum


def test_a_point_light_falls_with_the_square_of_the_distance():
    light = PointLight((0, 3, 0), illuminant("A"), 900)
    found = light.arrivals(np.array([[0.0, 0, 0], [0.0, 1.5, 0], [0.0, 3, 10]]))
    np.testing.assert_allclose(found.illuminance_lux, [100, 400, 9], rtol=1e-15)
    np.testing.assert_allclose(found.directions, [[0, 1, 0], [0, 1, 0], [0, 0, -1]], atol=1e-15)
    np.testing.assert_allclose(found.distance, [3, 1.5, 10], rtol=1e-15)


def test_a_directional_light_is_the_same_everywhere():
    light = DirectionalLight((0, 3, 4), illuminant("A"), 900)
    found = light.arrivals(np.zeros((2, 5, 3)))
    assert found.directions.shape == (2, 5, 3)
    np.testing.assert_allclose(found.directions[1, 4], [0, 0.6, 0.8])
    assert (found.illuminance_lux == 900).all() and np.isinf(found.distance).all()


def test_another_spectrum_keeps_place_and_strength():
    light = PointLight((1, 2, 3), illuminant("A"), 900, name="lamp").with_spectrum(illuminant("D65"), "D65")
    assert (light.intensity_cd, light.name, light.spectrum_name) == (900, "lamp", "D65")
    assert light.spectrum is illuminant("D65")


@pytest.mark.parametrize("strength", [0, -5.0, float("nan"), float("inf")])
def test_a_light_of_no_power_is_refused(strength):
    with pytest.raises(InputError, match=r"(?s)illuminance_lux: a light of no power.*more than 0 lx"):
        DirectionalLight((0, 0, 1), illuminant("A"), strength)
    with pytest.raises(InputError, match=r"(?s)intensity_cd: a light of no power.*more than 0 cd"):
        PointLight((0, 0, 1), illuminant("A"), strength)


def test_a_direction_of_no_length_is_refused():
    with pytest.raises(InputError, match="direction_to_light: a direction of no length"):
        DirectionalLight((0, 0, 0), illuminant("A"))


def test_a_reflectance_is_no_light():
    with pytest.raises(InputError, match=r"(?s)not the spectrum of a light.*found: reflectance"):
        DirectionalLight((0, 0, 1), Spectrum.sampled([400.0, 700.0], [0.5, 0.5], "reflectance"))


def test_a_point_light_does_nothing_where_it_stands():
    found = PointLight((1, 2, 3), illuminant("A"), 900).arrivals(np.array([[1.0, 2, 3], [1.0, 2, 4]]))
    np.testing.assert_array_equal(found.illuminance_lux, [0, 900])
    np.testing.assert_array_equal(found.directions, [[0, 0, 0], [0, 0, -1]])


@pytest.mark.parametrize("kind", [DirectionalLight, PointLight])
def test_renderers_see_what_arrives(kind):
    """The homogeneous form gives every point the direction and the illuminance of `arrivals`."""
    light = kind((1.0, 2, 3), illuminant("A"), 900)
    points, centre, radius = np.array([[0.0, 0, 0], [0.5, -1, 2], [4.0, 4, 4]]), np.array([0.5, 1.0, -1.0]), 2.5
    vector, lux = light.homogeneous(centre, radius)
    offset = vector[:3] - vector[3] * (points - centre) / radius
    found = light.arrivals(points)
    squared = np.sum(offset**2, axis=1)
    np.testing.assert_allclose(offset / np.sqrt(squared)[:, None], found.directions, atol=1e-14)
    np.testing.assert_allclose(lux / squared, found.illuminance_lux, rtol=1e-13)
