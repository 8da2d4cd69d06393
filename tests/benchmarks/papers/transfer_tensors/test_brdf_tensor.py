"""A family as factors of members, view and light, with its highlights apart."""

import numpy as np
import pytest
from metamer.benchmarks.papers.transfer_tensors.brdf_tensor import brdf_tensor
from metamer.benchmarks.papers.transfer_tensors.disc import Disc, raised
from metamer.benchmarks.papers.transfer_tensors.families import blinn_phong, cook_torrance
from metamer.benchmarks.papers.transfer_tensors.separation import separated


@pytest.fixture(scope="module")
def family():
    return cook_torrance(np.array([(f0, slope) for f0 in (0.1, 0.9) for slope in (0.1, 0.2, 0.4)]))


def directions(count=3000, lowest=0.4):
    to = np.random.default_rng(1).normal(size=(2, count, 3))
    to[..., 2] = np.abs(to[..., 2]) + lowest
    return to / np.linalg.norm(to, axis=-1, keepdims=True)


def test_a_plane_is_looked_up_as_it_is():
    disc = Disc(9)
    table = disc.nodes[:, :2] @ np.array([[1.0, 2.0], [3.0, -1.0]]) + 0.5
    to = raised(np.random.default_rng(0).uniform(-0.4, 0.4, (200, 2)))
    np.testing.assert_allclose(
        disc.look_up(table, to), to[:, :2] @ np.array([[1.0, 2.0], [3.0, -1.0]]) + 0.5, atol=1e-12
    )


def test_every_direction_lies_between_nodes_that_are_used():
    disc = Disc(16)
    to = raised(np.random.default_rng(0).uniform(-1.0, 1.0, (5000, 2)))
    marked = np.where(disc.used, 0.0, 1.0)[:, None]
    assert disc.look_up(marked, to).max() == 0.0


def test_a_gaussian_about_the_mirror_is_found_again(family):
    """A highlight that is one of the four is taken out whole."""
    from dataclasses import replace

    sharpness = separated(family).sharpness

    def bump(member, wi, wo):
        away = np.sum(wi * wo * (-1.0, -1.0, 1.0), axis=1) - 1.0
        return 3.0 * np.exp(sharpness[2] * away) + 0.2

    found = separated(replace(family, one=bump))
    np.testing.assert_allclose(found.amplitudes[..., 2], 3.0, rtol=1e-6)
    np.testing.assert_allclose(np.delete(found.amplitudes, 2, axis=2), 0.0, atol=1e-6)


def test_what_is_taken_out_is_never_negative(family):
    found = separated(family)
    assert found.amplitudes.min() >= 0.0
    # A narrow highlight is nearly all Gaussians at an upright view, a wide one hardly.
    upright = found.amplitudes[:, -1].sum(axis=1)
    peak = family.values(np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, 1.0]]))[:, 0]
    assert upright[0] > 0.9 * peak[0]
    assert upright[2] < 0.7 * peak[2]


def test_separation_leaves_less(family):
    """Of the whole family, on the disc: figure 5's comparison."""
    wi, wo = directions()
    off = []
    for separate in (False, True):
        found = brdf_tensor(family, (4, 8, 8), Disc(10), separate)
        errors = [
            np.linalg.norm(found.values(weights, wi, wo) - weights @ family.values(wi, wo))
            / np.linalg.norm(weights @ family.values(wi, wo))
            for weights in np.eye(len(family))
        ]
        off.append(float(np.mean(errors)))
    assert off[1] < 0.87 * off[0]


@pytest.mark.slow
def test_larger_tensors_leave_less():
    family = blinn_phong(12)
    errors = [brdf_tensor(family, ranks, Disc(12)).error for ranks in ((1, 2, 2), (2, 6, 6), (4, 24, 24))]
    assert errors[0] > 2.0 * errors[1] > 8.0 * errors[2]


@pytest.mark.slow
def test_a_broad_family_is_followed():
    """What a tensor of many factors gives between nodes and members is the formula's."""
    family = blinn_phong(8)
    wi, wo = directions()
    found = brdf_tensor(family, (4, 40, 40), Disc(20), separate=False)
    weights = family.weights(4.5)
    truth = weights @ family.values(wi, wo)
    assert np.linalg.norm(found.values(weights, wi, wo) - truth) < 0.03 * np.linalg.norm(truth)
