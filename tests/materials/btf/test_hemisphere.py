"""Between measured directions: rings, few directions, grazing light, and the table that the triangles are found by."""

import numpy as np
import pytest
from btf_samples import of_degrees, rings
from metamer.materials.btf import hemisphere
from metamer.materials.btf.hemisphere import Hemisphere
from metamer.runtime.errors import InputError


def anywhere(count=20000):
    directions = np.random.default_rng(3).normal(size=(count, 3))
    directions[:, 2] = np.abs(directions[:, 2])
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def test_a_measured_direction_is_itself():
    around = Hemisphere(rings())
    index, share = around.shares(around.directions)
    assert (index[np.arange(81), share.argmax(axis=1)] == np.arange(81)).all()
    assert share.max(axis=1).min() > 1.0 - 1e-9


def test_what_is_linear_in_the_plane_stays_so_and_shares_are_continuous():
    around, directions = Hemisphere(rings()), anywhere()
    index, share = around.shares(directions)
    np.testing.assert_allclose(share.sum(axis=1), 1.0, atol=1e-12)
    theta = np.arccos(directions[:, 2])
    inside = theta < np.radians(73.0)
    from_shares = np.einsum("nk,nk->n", share, np.arccos(around.directions[index, 2]) * around.directions[index, 0])
    assert np.isfinite(from_shares).all()
    plane = np.stack([theta * directions[:, axis] / np.sin(theta) for axis in (0, 1)], axis=1)
    corners = around.corners[:81]
    np.testing.assert_allclose(np.einsum("nk,nkc->nc", share, corners[index])[inside], plane[inside], atol=1e-9)
    # Across the horizon's ring and every side of a triangle nothing jumps.
    values = np.random.default_rng(5).uniform(size=81)
    near = directions + 1e-7 * np.random.default_rng(6).normal(size=directions.shape)
    near[:, 2] = np.maximum(near[:, 2], 0.0)
    near /= np.linalg.norm(near, axis=1, keepdims=True)
    there, part = around.shares(near, falling=True)
    index, share = around.shares(directions, falling=True)
    change = np.einsum("nk,nk->n", part, values[there]) - np.einsum("nk,nk->n", share, values[index])
    assert np.abs(change).max() < 1e-4


def test_triangles_are_tried_until_a_direction_is_in_one(monkeypatch):
    around, directions = Hemisphere(rings()), np.concatenate([anywhere(3000), rings()])
    index, share = around.shares(directions)
    # The triangle whose smallest share is the largest, among all.
    here = np.concatenate([hemisphere._plane(directions), np.ones((len(directions), 1))], axis=1)
    every = np.einsum("tij,nj->nti", around.inverse, here)
    best = every.min(axis=2).argmax(axis=1)
    expected = np.maximum(every[np.arange(len(here)), best], 0.0)
    values = np.random.default_rng(4).uniform(size=81)
    there = np.einsum("nk,nk->n", expected, values[around.measured[around.triangles[best]]]) / expected.sum(axis=1)
    np.testing.assert_allclose(np.einsum("nk,nk->n", share, values[index]), there, rtol=1e-9)
    tried, einsum = [], np.einsum
    monkeypatch.setattr(np, "einsum", lambda how, *of: tried.append(len(of[-1])) or einsum(how, *of))
    around.shares(directions)
    assert len(directions) <= sum(tried) < 2 * len(directions)


def test_light_below_the_lowest_ring_keeps_its_f_r():
    around = Hemisphere(rings())
    low = of_degrees([(89.9, 7.0), (80.0, 200.0)])
    index, share = around.shares(low, falling=True)
    cosine = around.directions[index, 2]
    np.testing.assert_allclose(np.einsum("nk,nk->n", share, cosine), low[:, 2], rtol=1e-9)
    # A matt surface is then exact everywhere beyond: f_r cos(theta_i) with f_r = 1.
    np.testing.assert_allclose(around.shares(low)[1].sum(axis=1), 1.0)


def test_weights_of_lights_add_up_to_what_a_matt_surface_receives():
    around = Hemisphere(rings())
    assert abs(float(around.solid_angles @ around.directions[:, 2]) - np.pi) < 0.03 * np.pi


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_single_light_and_a_few(count):
    few = Hemisphere(rings()[[4, 5, 6][:count]])
    index, share = few.shares(anywhere(2000))
    np.testing.assert_allclose(share.sum(axis=1), 1.0, atol=1e-12)
    assert set(np.unique(index)) == set(range(count))


def test_directions_in_a_row():
    row = Hemisphere(of_degrees([(theta, 90.0) for theta in (0, 20, 40, 60)]))
    _, share = row.shares(anywhere(2000), falling=True)
    assert (share >= 0.0).all() and (share.sum(axis=1) <= 1.0 + 1e-12).all()


def test_triangles_do_not_hang_on_rounding():
    exact, given = Hemisphere(rings()), rings()
    for seed in range(4):
        off = given + 1e-12 * np.random.default_rng(seed).normal(size=given.shape)
        off[:, 2] = np.abs(off[:, 2])
        other = Hemisphere(off / np.linalg.norm(off, axis=1, keepdims=True))
        same = {tuple(sorted(t)) for t in exact.triangles} == {tuple(sorted(t)) for t in other.triangles}
        assert same


@pytest.mark.parametrize(
    ("directions", "word"),
    [
        ([[0.0, 0.0, 2.0]], "unit vectors"),
        ([[0.0, 0.6, -0.8]], "below the horizon"),
        ([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]], "twice"),
        (np.zeros((0, 3)), "unit vectors"),
    ],
)
def test_what_is_refused(directions, word):
    with pytest.raises(InputError, match=word):
        Hemisphere(np.asarray(directions, dtype=float))
