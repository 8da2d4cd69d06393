import numpy as np
import pytest
from metamer.lighting.lights import DirectionalLight, PointLight
from metamer.spectral.errors import InputError
from metamer.spectral.illuminants import illuminant
from metamer.spectral.spectrum import Spectrum


def test_a_point_light_falls_with_the_square_of_the_distance():
    light = PointLight((0, 3, 0), illuminant("A"), 900)
    direction, illuminance = light.incident(np.array([[0.0, 0, 0], [0.0, 1.5, 0], [0.0, 3, 10]]))
    np.testing.assert_allclose(illuminance, [100, 400, 9], rtol=1e-15)
    np.testing.assert_allclose(direction, [[0, 1, 0], [0, 1, 0], [0, 0, -1]], atol=1e-15)


def test_a_directional_light_is_the_same_everywhere():
    light = DirectionalLight((0, 3, 4), illuminant("A"), 900)
    direction, illuminance = light.incident(np.zeros((2, 5, 3)))
    assert direction.shape == (2, 5, 3)
    np.testing.assert_allclose(direction[1, 4], [0, 0.6, 0.8])
    assert (illuminance == 900).all()


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
    direction, illuminance = PointLight((1, 2, 3), illuminant("A"), 900).incident(np.array([[1.0, 2, 3], [1.0, 2, 4]]))
    np.testing.assert_array_equal(illuminance, [0, 900])
    np.testing.assert_array_equal(direction, [[0, 0, 0], [0, 0, -1]])
