"""Integrals over polygons beside sums over many points of them."""

import numpy as np
import pytest
from metamer.lighting.environment.polygon import gaussian_shares, solid_angle, surface_moments
from metamer.materials.core.environment_form import bends


def rectangles(count, seed=1, size=(0.2, 2.0), far=(0.3, 4.0)):
    """Corners (n, 4, 3) as the origin sees them, of positive solid angle; near, far, and seen from the side."""
    rng = np.random.default_rng(seed)
    corners = []
    for _ in range(count):
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        to = rng.normal(size=3)
        middle = to / np.linalg.norm(to) * rng.uniform(*far)
        right, up = rng.uniform(*size, 2)[:, None] * axes[:2] / 2.0
        four = np.array([middle + a * right + b * up for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
        corners.append(four if np.linalg.det(np.stack([right, up, middle])) > 0.0 else four[::-1])
    return np.array(corners)


def summed(corners, values, across=500):
    """The integral over what the origin sees of a rectangle of a function of unit directions (n, 3)."""
    at, weight = np.polynomial.legendre.leggauss(across)
    at, weight = 0.5 * (at + 1.0), 0.5 * weight
    right, up = corners[1] - corners[0], corners[3] - corners[0]
    points = (corners[0] + at[:, None, None] * right + at[:, None] * up).reshape(-1, 3)
    far = np.linalg.norm(points, axis=1)
    angles = np.abs(points @ np.cross(right, up)) / far**3 * np.outer(weight, weight).ravel()
    return angles @ values(points / far[:, None])


def test_solid_angles_are_those_of_many_points():
    corners = rectangles(20)
    truth = [summed(one, lambda to: np.ones(len(to))) for one in corners]
    assert np.abs(solid_angle(corners) - truth).max() < 1e-7


@pytest.mark.slow
def test_shares_of_gaussians_are_within_what_is_said():
    rng = np.random.default_rng(2)
    corners = rectangles(60)
    # Axes within, beside, and anywhere, the opposite among them.
    inside = corners[:, 0] + np.einsum(
        "nk,nki->ni", rng.uniform(-0.5, 1.5, (60, 2)), corners[:, [1, 3]] - corners[:, :1]
    )
    inside[::5] = rng.normal(size=(12, 3))
    inside[1::10] = -corners[1::10].mean(axis=1)
    axes = inside / np.linalg.norm(inside, axis=1, keepdims=True)
    sharpness = np.exp(rng.uniform(np.log(0.3), np.log(1000.0), 60))
    found = gaussian_shares(corners, axes[:, None], sharpness[:, None])[:, 0]
    for k, one in enumerate(corners):
        whole = 2.0 * np.pi * -np.expm1(-2.0 * sharpness[k]) / sharpness[k]
        truth = summed(one, lambda to, k=k: np.exp(sharpness[k] * (to @ axes[k] - 1.0))) / whole
        assert found[k] == pytest.approx(truth, abs=3e-4)


def test_a_broad_gaussian_sees_the_solid_angle_and_a_sharp_one_what_is_there():
    corners = rectangles(10)
    middle = corners.mean(axis=1)
    axes = (middle / np.linalg.norm(middle, axis=1, keepdims=True))[:, None]
    broad = gaussian_shares(corners, axes, np.full((10, 1), 1e-4))[:, 0]
    assert np.abs(broad - solid_angle(corners) / (4.0 * np.pi)).max() < 1e-4
    assert np.abs(gaussian_shares(corners, axes, np.full((10, 1), 1e7)) - 1.0).max() < 1e-3
    # Beside it nothing, not what rounding leaves of sums.
    assert gaussian_shares(corners, -axes, np.full((10, 1), 1e4)).max() < 1e-30


def test_an_axis_on_an_edge_sees_half():
    corners = np.array([[[0.0, -1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]]])
    assert solid_angle(corners)[0] > 0.0
    assert gaussian_shares(corners, np.array([[[0.0, 0.0, 1.0]]]), np.array([[2000.0]]))[0, 0] == pytest.approx(
        0.5, abs=1e-4
    )


@pytest.mark.slow
@pytest.mark.parametrize("far", [(0.3, 4.0), (30.0, 60.0)])
def test_moments_are_those_of_many_points(far):
    for one in rectangles(4, 3, far=far):
        # The horizon cuts some: what is below it counts as nothing.
        truth = summed(one, lambda to: np.maximum(to[:, 2:], 0.0) * bends(to), 1200)
        largest = max(solid_angle(one[None])[0], 1e-12)
        assert np.abs(surface_moments(one[None])[0] - truth).max() < 3e-6 * largest


def test_what_is_below_the_horizon_gives_nothing():
    corners = rectangles(8, 4)
    corners[..., 2] = -np.abs(corners[..., 2]) - 0.1
    assert (surface_moments(corners) == 0.0).all()
