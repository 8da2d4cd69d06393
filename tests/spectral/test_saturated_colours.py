"""Spectra of colours outside sRGB: the colour comes back, light is not negative, and nothing jumps."""

import numpy as np
import pytest
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.saturated_colours import spectra_of
from metamer.spectral.upsampling import METHODS, upsampling, xyz_from_rgb
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

FOLDED = observer("1931_2").weights(illuminant("D65"), NM)
# Errors of a colour by the printed tables of each method, of its largest channel.
MISSED = {"mallett-yuksel": 1e-3, "jakob-hanika": 1e-3, "smits": 0.12}


def rgb_of(spectra):
    return np.linalg.solve(xyz_from_rgb(), FOLDED @ spectra.T).T


def of_light(count, reach, seed=0):
    """Colours outside sRGB that light has: mixtures of two wavelengths and so much white that `reach` is left."""
    generator = np.random.default_rng(seed)
    pure = FOLDED.T[(NM >= 400) & (NM <= 680)]
    pure = pure / pure.sum(axis=1, keepdims=True)
    share = generator.uniform(size=(count, 1))
    pair = generator.integers(0, len(pure), size=(2, count))
    white = FOLDED.sum(axis=1) / FOLDED.sum()
    xyz = (1.0 - reach) * white + reach * (share * pure[pair[0]] + (1.0 - share) * pure[pair[1]])
    rgb = np.linalg.solve(xyz_from_rgb(), xyz.T).T
    rgb = rgb[(rgb < -1e-6).any(axis=1)]
    return rgb / rgb.max(axis=1, keepdims=True)


@pytest.mark.parametrize("method", METHODS)
def test_colours_inside_srgb_are_the_methods_own(method):
    rgb = np.random.default_rng(1).uniform(size=(7, 11, 3)) * [1.0, 3.0, 0.2]
    np.testing.assert_array_equal(spectra_of(rgb, method), upsampling(method).spectra(rgb))


@pytest.mark.parametrize("method", METHODS)
def test_any_colour_comes_back_under_d65(method):
    rgb = np.array([0.6, 0.3, 0.0]) + np.random.default_rng(2).normal(size=(5000, 3))
    back = rgb_of(spectra_of(rgb, method))
    assert np.max(np.abs(back - rgb) / np.abs(rgb).max(axis=1, keepdims=True)) < MISSED[method]


@pytest.mark.parametrize("method", METHODS)
def test_colours_that_light_has_are_made_of_light(method):
    rgb = of_light(5000, 0.9)
    assert len(rgb) > 500
    spectra = spectra_of(rgb, method)
    # About red, sRGB nearly reaches the locus, and what is left of the way is taken off.
    red = rgb[:, 0] == 1.0
    assert spectra[~red].min() > -0.01
    assert spectra[red].min() > -0.05
    taken_off = np.maximum(rgb, 0.0) @ upsampling().corners + np.minimum(rgb, 0.0) @ upsampling().corners
    assert taken_off.min() < -0.3


def test_a_small_step_is_a_small_change_wherever_it_leads():
    generator = np.random.default_rng(3)
    rgb = np.concatenate([of_light(2000, 0.97), of_light(2000, 0.7), generator.uniform(-1e-6, 1.0, (2000, 3))])
    step = 1e-6 * generator.normal(size=rgb.shape)
    moved = np.abs(spectra_of(rgb + step) - spectra_of(rgb)).max(axis=1)
    assert moved.max() < 300.0 * np.abs(step).max()


def test_twice_the_colour_is_twice_the_spectrum_and_no_light_is_none():
    rgb = of_light(200, 0.9)
    np.testing.assert_allclose(spectra_of(1e9 * rgb), 1e9 * spectra_of(rgb), rtol=1e-9, atol=1e-3)
    np.testing.assert_allclose(spectra_of(1e-9 * rgb), 1e-9 * spectra_of(rgb), rtol=1e-9, atol=1e-21)
    assert not spectra_of(np.zeros((2, 3))).any()


def test_less_than_no_light_keeps_its_numbers():
    rgb = np.array([[-0.2, -0.1, 0.01], [-1.0, 0.5, -0.3], [-1e-300, 0.0, 0.0]])
    np.testing.assert_allclose(rgb_of(spectra_of(rgb)), rgb, atol=2e-4)


def test_what_is_no_colour_or_no_method_is_refused():
    with pytest.raises(InputError, match="not a colour"):
        spectra_of(np.array([0.1, np.nan, -0.2]))
    with pytest.raises(UnknownNameError, match="upsampling"):
        spectra_of(np.ones(3), "bilinear")
