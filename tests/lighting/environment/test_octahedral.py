"""Octahedral maps: every direction has its place, and nothing jumps at the folds."""

import numpy as np
import pytest
from metamer.lighting.environment import octahedral
from metamer.lighting.vectors import unit

RANDOM = unit(np.random.default_rng(3).normal(size=(4000, 3)))


def test_directions_lie_in_their_own_texels():
    assert (octahedral.texel_at(octahedral.texel_directions(32).reshape(-1, 3), 32) == np.arange(32**2)).all()


def test_the_axes_lie_where_the_convention_says():
    x, z = octahedral.places(np.array([[0.0, 2.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -3.0]]))
    assert x.tolist() == [0.0, 1.0, 0.0] and z.tolist() == [0.0, 0.0, -1.0]
    corner = octahedral.places(np.array([[1e-9, -1.0, 1e-9]]))
    assert np.allclose(corner, 1.0)


def test_solid_angles_are_those_of_the_sphere():
    to, angles = octahedral.texel_directions(64).reshape(-1, 3), octahedral.solid_angles(64)
    assert angles.sum() == pytest.approx(4.0 * np.pi)
    assert angles @ to[:, 1] ** 2 == pytest.approx(4.0 * np.pi / 3.0, rel=1e-3)
    assert (angles[to[:, 2] > 0.0]).sum() == pytest.approx(2.0 * np.pi, rel=1e-3)


@pytest.mark.parametrize("size", [8, 32])
def test_what_is_between_texels_is_continuous_over_the_folds(size):
    """Along great circles through poles, corners and rims no step of a random map is larger than the way allows."""
    values = np.random.default_rng(1).normal(size=size**2)
    angle = np.linspace(0.0, 2.0 * np.pi, 20001)
    for a, b in ((0, 1), (1, 2), (0, 2)):
        circle = np.zeros((len(angle), 3))
        circle[:, a], circle[:, b] = np.cos(angle), np.sin(angle)
        for way in (circle, circle @ np.linalg.qr(np.array([[1.0, 2, 3], [0, 1, 4], [5, 6, 0]]))[0]):
            texels, weights = octahedral.around(way, size)
            along = (values[texels] * weights).sum(axis=-1)
            assert np.abs(np.diff(along)).max() < 20.0 * size * (angle[1] - angle[0])


def test_weights_are_shares_and_meet_the_direction():
    texels, weights = octahedral.around(RANDOM, 32)
    assert weights.min() >= 0.0 and np.allclose(weights.sum(axis=-1), 1.0)
    mixed = np.einsum("nk,nkc->nc", weights, octahedral.texel_directions(32).reshape(-1, 3)[texels])
    assert np.degrees(np.arccos((unit(mixed) * RANDOM).sum(axis=1))).max() < 2.5


@pytest.mark.parametrize("size", [8, 32])
def test_slopes_are_how_weights_change_with_the_direction(size):
    to = RANDOM[:500]
    across = unit(np.cross(to, RANDOM[500:1000]))
    texels, weights = octahedral.around(to, size)
    more, then = octahedral.around(unit(to + 1e-6 * across), size)
    same = (more == texels).all(axis=1)
    assert same.sum() > 490
    found = np.einsum("ntk,nk->nt", octahedral.slopes(to, size), across)
    assert np.abs((then - weights)[same] / 1e-6 - found[same]).max() < 1e-3 * size
    # Along the direction itself nothing changes, and weights always add up to 1.
    assert np.abs(np.einsum("ntk,nk->nt", octahedral.slopes(to, size), to)).max() < 1e-9
    assert np.abs(octahedral.slopes(to, size).sum(axis=1)).max() < 1e-9
