"""Spherical harmonics: orthonormal, and the clamped cosine, Gaussians and environments in them."""

import numpy as np
import pytest
from metamer.benchmarks.papers.harmonics import (
    BANDS,
    COUNT,
    clamped_cosine,
    cosine_factors,
    gaussian_factors,
    harmonics,
    project_light,
)
from metamer.lighting.environment import latlong
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.environment.prefiltering import Irradiance
from metamer.lighting.vectors import unit
from metamer.spectral.spectrum import Spectrum
from scipy.special import sph_harm_y

WAVELENGTHS = np.arange(380.0, 781.0, 5.0)
WHITE = Spectrum(np.ones(len(WAVELENGTHS)), WAVELENGTHS, "emission")
HEIGHT, WIDTH = 64, 128
TO = latlong.texel_directions(HEIGHT, WIDTH).reshape(-1, 3)
SOLID = np.repeat(latlong.solid_angles(HEIGHT, WIDTH), WIDTH)

NODES, SHARES = np.polynomial.legendre.leggauss(24)
ROUND = np.arange(48) * 2.0 * np.pi / 48
SPHERE = np.stack(
    [
        np.outer(np.sqrt(1.0 - NODES**2), np.cos(ROUND)),
        np.outer(np.sqrt(1.0 - NODES**2), np.sin(ROUND)),
        np.repeat(NODES[:, None], 48, axis=1),
    ],
    axis=-1,
).reshape(-1, 3)
ANGLES = np.repeat(SHARES, 48) * 2.0 * np.pi / 48


def _environment(*fields, **more):
    maps = np.stack([np.broadcast_to(field, HEIGHT * WIDTH).reshape(HEIGHT, WIDTH) for field in fields])
    return EnvironmentLight(maps, (WHITE,) * len(maps), **more)


def _directions(number):
    to = np.random.default_rng(3).normal(size=(number, 3))
    return to / np.linalg.norm(to, axis=1, keepdims=True)


def test_they_are_orthonormal():
    values = harmonics(SPHERE)
    assert np.abs(values.T @ (values * ANGLES[:, None]) - np.eye(COUNT)).max() < 1e-12


def test_each_band_turns_into_itself():
    """The sum of squares over a band is the same in every direction (Unsoeld's theorem)."""
    values = harmonics(unit(np.random.default_rng(0).normal(size=(50, 3))))
    for band in range(BANDS):
        squares = (values[:, band**2 : (band + 1) ** 2] ** 2).sum(axis=1)
        assert squares == pytest.approx((2 * band + 1) / (4.0 * np.pi))


def test_the_clamped_cosine_is_its_integral():
    fine, shares = np.polynomial.legendre.leggauss(400)
    normal = unit(np.array([0.3, -0.7, 0.2]))
    # About z the integral is one-dimensional: the cosine times a Legendre polynomial, upwards only.
    for band in range(BANDS):
        legendre = np.polynomial.legendre.Legendre.basis(band)
        up = 0.5 * (fine + 1.0)
        exact = 2.0 * np.pi * (shares * 0.5 * up * legendre(up)).sum()
        ratio = clamped_cosine(normal[None])[0, band**2] / harmonics(normal[None])[0, band**2]
        assert ratio == pytest.approx(exact, abs=1e-12)


def test_a_uniform_sky_gives_pi_whatever_the_normal():
    normals = unit(np.random.default_rng(0).normal(size=(20, 3)))
    sky = harmonics(SPHERE).T @ ANGLES
    assert clamped_cosine(normals) @ sky == pytest.approx(np.pi)


def test_harmonics_are_those_of_scipy():
    to = _directions(20)
    theta, phi = np.arccos(to[:, 2]), np.arctan2(to[:, 1], to[:, 0])
    found = harmonics(to, 7)
    for band in range(7):
        for m in range(band + 1):
            expected = sph_harm_y(band, m, theta, phi) * (-1) ** m * (np.sqrt(2.0) if m else 1.0)
            np.testing.assert_allclose(found[:, band**2 + band + m], expected.real, atol=1e-12)
            if m:
                np.testing.assert_allclose(found[:, band**2 + band - m], expected.imag, atol=1e-12)


def test_illuminance_by_harmonics_is_near_the_exact_one_under_a_smooth_sky():
    sky = _environment(1.0 + TO[:, 1], np.exp(3.0 * TO[:, 0]), rotation_deg=40.0)
    normals = _directions(50)
    found = harmonics(normals) * cosine_factors() @ project_light(sky).T
    np.testing.assert_allclose(found, Irradiance.of(sky)(normals), rtol=0.01)


@pytest.mark.parametrize("sharpness", [1e-6, 1.0, 30.0])
def test_factors_of_a_gaussian_are_its_means_of_harmonics(sharpness):
    axis = _directions(1)
    kernel = np.exp(sharpness * (TO @ axis[0] - 1.0)) * SOLID
    expected = kernel @ harmonics(TO) / kernel.sum()
    found = harmonics(axis) * gaussian_factors(np.array([sharpness]))
    np.testing.assert_allclose(found[0], expected, atol=2e-4)
