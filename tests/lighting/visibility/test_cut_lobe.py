"""Lobes that a boundary cuts: what is left of them, against integrals over what is free above their own horizons."""

import numpy as np
import pytest
from metamer.lighting.environment.octahedral import texel_directions
from metamer.lighting.visibility.cut_lobe import cut_lobe, mean_cosine
from metamer.lighting.visibility.free_share import free_share

TO = texel_directions(256).reshape(-1, 3)
AREA = np.abs(TO).sum(axis=1) ** 3
AXIS, TOWARDS = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])


def mean_direction(angle, sharpness):
    """Average directions of what lies beyond a great circle at `angle` from the axis, above the axis' own horizon."""
    free = (TO @ (np.cos(angle) * TOWARDS + np.sin(angle) * AXIS) > 0.0) & (TO[:, 1] > 0.0)
    weight = np.exp(sharpness * (TO[:, 1] - 1.0)) * AREA * free
    return weight @ TO / weight.sum()


@pytest.mark.parametrize("sharpness", [2.0, 4.0, 8.0, 16.0, 40.0, 120.0])
def test_its_middle_and_its_spread_are_those_of_what_is_free(sharpness):
    for angle in np.array([-1.0, -0.5, 0.0, 0.5, 1.0, 2.0]) / np.sqrt(sharpness):
        exact = mean_direction(angle, sharpness)
        found = cut_lobe(np.array([angle]), np.ones(1), np.array([sharpness]))
        assert found.turn == pytest.approx(np.arctan2(exact[0], exact[1]), abs=0.03)
        spread = (1.0 - mean_cosine(np.array([sharpness]))) / (1.0 - np.linalg.norm(exact))
        assert found.sharpness / sharpness == pytest.approx(np.minimum(spread, 2.0), rel=0.2)


@pytest.mark.parametrize("sharpness", [1e-4, 0.5, 3.0, 50.0, 1e5])
def test_nothing_moves_where_nothing_is_hidden_or_no_boundary_is_near(sharpness):
    lambda_ = np.full(3, sharpness)
    open_sky = cut_lobe(np.full(3, 0.5 * np.pi), np.array([0.0, 0.5, 1.0]), lambda_)
    assert (open_sky.share == 1.0).all() and (open_sky.turn == 0.0).all()
    assert open_sky.sharpness == pytest.approx(lambda_, rel=1e-12)
    angles = np.array([-0.3, 0.0, 0.3])
    flat = cut_lobe(angles, np.zeros(3), lambda_)
    assert (flat.turn == 0.0).all() and flat.share.tolist() == free_share(angles, lambda_).tolist()


def test_the_more_is_hidden_the_farther_it_turns_and_never_beyond_a_quarter():
    for sharpness in (0.01, 1.0, 20.0, 300.0):
        angles = np.linspace(0.5 * np.pi, -2.0 / np.sqrt(max(sharpness, 4.0)), 100)
        found = cut_lobe(angles, np.ones(100), np.full(100, sharpness))
        assert (np.diff(found.turn) >= -1e-9).all() and (found.turn <= 0.5 * np.pi).all()
        assert ((found.sharpness >= sharpness) & (found.sharpness <= 2.0 * sharpness)).all()


@pytest.mark.parametrize("sharpness", [1e-12, 1e-4, 0.0099, 0.0101, 1.0, 1e6])
def test_the_mean_cosine_is_the_integral_at_any_sharpness(sharpness):
    cosine, weights = np.polynomial.legendre.leggauss(64)
    reach = min(1.0, 40.0 / sharpness)
    cosine = 1.0 - 0.5 * reach * (1.0 - cosine)
    weights = weights * np.exp(sharpness * (cosine - 1.0))
    found = mean_cosine(np.array([sharpness]))[0]
    assert found == pytest.approx(weights @ cosine / weights.sum(), abs=1e-6)
