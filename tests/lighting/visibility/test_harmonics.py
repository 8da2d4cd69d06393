"""Spherical harmonics: orthonormal, and the clamped cosine in them."""

import numpy as np
import pytest
from metamer.lighting.environment.harmonics import BANDS, COUNT, clamped_cosine, harmonics
from metamer.lighting.vectors import unit

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
