"""Angles of directions and back, at the places where a careless formula loses digits."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from metamer.materials.core.directions import (
    TAU,
    angles,
    azimuth_difference,
    folded,
    half_difference,
    io_angles,
    io_from_half_difference,
    spherical,
)

polar = st.floats(0.0, np.radians(89.99))
turn = st.floats(0.0, TAU, exclude_max=True)


def turned_apart(a, b):
    """Distance of two azimuths on the circle."""
    return abs(np.angle(np.exp(1j * (np.asarray(a) - np.asarray(b)))))


@given(theta=polar, phi=turn)
def test_spherical_and_back(theta, phi):
    back_theta, back_phi = angles(spherical(theta, phi))
    assert back_theta == pytest.approx(theta, abs=1e-15)
    assert 0 <= back_phi < TAU
    assert np.sin(theta) * turned_apart(back_phi, phi) < 1e-14


@given(theta_i=polar, phi_i=turn, theta_o=polar, phi_o=turn)
def test_io_angles_say_how_the_pair_lies_and_not_where(theta_i, phi_i, theta_o, phi_o):
    wi, wo = spherical(theta_i, phi_i), spherical(theta_o, phi_o)
    found_i, found_o, phi = io_angles(wi, wo)
    assert (found_i, found_o) == (pytest.approx(theta_i, abs=1e-15), pytest.approx(theta_o, abs=1e-15))
    assert 0 <= phi <= np.pi
    assert phi == pytest.approx(folded(azimuth_difference(wi, wo)), abs=1e-15)
    # An azimuth weighs as much as the sines of the polar angles let it.
    weight = min(np.sin(theta_i), np.sin(theta_o))
    assert weight * turned_apart(azimuth_difference(wi, wo), phi_o - phi_i) < 1e-14


@given(theta_i=polar, phi_i=turn, theta_o=polar, phi_o=turn)
def test_half_difference_and_back(theta_i, phi_i, theta_o, phi_o):
    wi, wo = spherical(theta_i, phi_i), spherical(theta_o, phi_o)
    theta_h, theta_d, phi_d, phi_h = half_difference(wi, wo)
    assert 0 <= theta_h <= np.pi / 2 and 0 <= theta_d <= np.pi / 2
    assert 0 <= phi_d < TAU and 0 <= phi_h < TAU
    back_i, back_o = io_from_half_difference(theta_h, theta_d, phi_d, phi_h)
    # For wi and wo nearly opposite, h is short and its direction is known to 1e-16 / |h|.
    slack = 1e-15 / max(np.linalg.norm(wi + wo), 1e-3) + 1e-14
    np.testing.assert_allclose(back_i, wi, rtol=0, atol=slack)
    np.testing.assert_allclose(back_o, wo, rtol=0, atol=slack)


@given(theta_h=polar, theta_d=st.floats(1e-4, np.radians(89.99)), phi_d=turn, phi_h=turn)
def test_exchanging_light_and_viewer_adds_half_a_turn_to_phi_d(theta_h, theta_d, phi_d, phi_h):
    wi, wo = io_from_half_difference(theta_h, theta_d, phi_d, phi_h)
    here, there = half_difference(wi, wo), half_difference(wo, wi)
    np.testing.assert_array_equal([here[0], here[1], here[3]], [there[0], there[1], there[3]])
    assert turned_apart(here[2] + np.pi, there[2]) < 1e-13


def test_pinned_half_difference():
    # Light at 40 deg, viewer at 20 deg on the other side: h leans 10 deg to the light, 30 deg from it.
    wi, wo = spherical(np.radians(40), 0.0), spherical(np.radians(20), np.pi)
    theta_h, theta_d, phi_d, phi_h = np.degrees(half_difference(wi, wo))
    np.testing.assert_allclose([theta_h, theta_d, phi_d, phi_h], [10, 30, 0, 0], atol=1e-12)
    wi, wo = spherical(np.radians(30), 0.7), spherical(np.radians(30), 0.7)
    np.testing.assert_allclose(np.degrees(half_difference(wi, wo))[:2], [30, 0], atol=1e-12)


def test_out_of_plane_light_at_normal_half_vector_keeps_its_azimuth():
    wi, wo = spherical(0.5, 2.0), spherical(0.5, 2.0 + np.pi)
    theta_h, theta_d, phi_d, phi_h = half_difference(wi, wo)
    assert theta_h < 1e-15 and theta_d == pytest.approx(0.5)
    assert turned_apart(phi_d + phi_h, 2.0) < 1e-12


def test_a_pair_one_microradian_apart_keeps_twelve_digits():
    wi, wo = spherical(0.4 + 1e-6, 0.3), spherical(0.4, 0.3)
    assert half_difference(wi, wo)[1] == pytest.approx(0.5e-6, rel=1e-9)


def test_grazing_mirror_pair():
    theta = np.radians(89.9)
    theta_h, theta_d, _, _ = half_difference(spherical(theta, 0.0), spherical(theta, np.pi))
    assert theta_h < 1e-13
    assert theta_d == pytest.approx(theta, abs=1e-14)


def test_tiny_negative_azimuth_stays_below_a_full_turn():
    assert angles(np.array([1.0, -1e-18, 0.0]))[1] == 0.0


def test_batches_broadcast():
    wi, wo = spherical(np.full((4, 1), 0.3), 0.0), spherical(0.5, np.linspace(0, 3, 7))
    assert all(angle.shape == (4, 7) for angle in half_difference(wi, wo))
    assert io_angles(wi, wo)[2].shape == (4, 7)
