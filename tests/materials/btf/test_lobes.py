"""Lobes: what is made of them is found again, and kept in few bytes."""

import numpy as np
import pytest
from btf_sets import UBO
from metamer.materials.btf import quantisation
from metamer.materials.btf.lobe_amplitudes import solved
from metamer.materials.btf.lobes import fitted_lobes, lobe_values
from metamer.materials.formats.btf_names import directions_of

LIGHTS = directions_of(UBO)


def random_lobes(count, lobes, seed=0):
    draw = np.random.default_rng(seed)
    axes = draw.normal(size=(count, lobes, 3)) + np.array([0.0, 0.0, 1.5])
    axes /= np.linalg.norm(axes, axis=2, keepdims=True)
    return axes, np.exp(draw.uniform(0.0, np.log(24.0), (count, lobes))), draw.uniform(0.05, 0.5, (count, lobes))


def made(diffuse, amplitudes, axes, exponents):
    return diffuse[:, None] + np.einsum("nk,nkl->nl", amplitudes, lobe_values(axes, exponents, LIGHTS))


@pytest.mark.parametrize("lobes", [1, 2])
def test_lobes_are_found_again(lobes):
    axes, exponents, amplitudes = random_lobes(400, lobes)
    values = made(np.full(400, 0.1), amplitudes, axes, exponents)
    found = fitted_lobes(values, np.ones_like(values), LIGHTS, lobes)
    off = np.sqrt(np.mean((made(found.diffuse, found.amplitudes, found.axes, found.exponents) - values) ** 2, axis=1))
    size = values.std(axis=1)
    assert np.median(off / size) < 0.01 and np.percentile(off / size, 90) < (0.02 if lobes == 1 else 0.08)
    np.testing.assert_allclose(np.linalg.norm(found.axes, axis=2), 1.0, atol=1e-9)
    if lobes == 1:
        assert np.median(np.sum(found.axes * axes, axis=2)) > 0.9999
        np.testing.assert_allclose(np.median(found.exponents / exponents), 1.0, atol=0.02)


def test_refining_leaves_less_than_the_lobes_begun_with(monkeypatch):
    draw = np.random.default_rng(3)
    axes, exponents, amplitudes = random_lobes(200, 4, seed=3)
    values = made(np.full(200, 0.2), amplitudes, axes, exponents) * draw.uniform(0.8, 1.2, (200, len(LIGHTS)))

    def left():
        found = fitted_lobes(values, np.ones_like(values), LIGHTS, 2)
        return np.mean((made(found.diffuse, found.amplitudes, found.axes, found.exponents) - values) ** 2, axis=1)

    after = left()
    monkeypatch.setattr("metamer.materials.btf.lobes._STEPS", 0)
    before = left()
    # Rows are scaled and float32: no row is worse by more than rounding.
    assert after.mean() < 0.7 * before.mean() and (after <= before * (1 + 1e-4)).all()


def test_weights_choose_what_is_missed():
    """Two lights that no lobe joins: the one that weighs more is met."""
    values = np.zeros((1, len(LIGHTS)))
    values[0, [20, 60]] = 1.0
    for heavy, light in ((20, 60), (60, 20)):
        weights = np.full_like(values, 0.1)
        weights[0, heavy] = 3.0
        found = fitted_lobes(values, weights, LIGHTS, 1)
        off = np.abs(made(found.diffuse, found.amplitudes, found.axes, found.exponents) - values)[0]
        assert off[heavy] < 0.05 < off[light]


def test_blocks_change_nothing(monkeypatch):
    axes, exponents, amplitudes = random_lobes(60, 2)
    values = made(np.full(60, 0.1), amplitudes, axes, exponents)
    whole = fitted_lobes(values, np.ones_like(values), LIGHTS, 2)
    monkeypatch.setattr("metamer.materials.btf.lobes._BLOCK", 7)
    parts = fitted_lobes(values, np.ones_like(values), LIGHTS, 2)
    both = [made(one.diffuse, one.amplitudes, one.axes, one.exponents) for one in (whole, parts)]
    np.testing.assert_allclose(*both, atol=5e-3)


@pytest.mark.parametrize("size", [1e-20, 1e20])
def test_values_of_any_size(size):
    axes, exponents, amplitudes = random_lobes(30, 1)
    values = made(np.full(30, 0.1), amplitudes, axes, exponents)
    small, large = (fitted_lobes(one, np.ones_like(one), LIGHTS, 1) for one in (values, size * values))
    np.testing.assert_allclose(large.amplitudes, size * small.amplitudes, rtol=1e-3)


def test_black_and_even_rows():
    values = np.stack([np.zeros(len(LIGHTS)), np.full(len(LIGHTS), 0.3)])
    found = fitted_lobes(values, np.ones_like(values), LIGHTS, 2)
    np.testing.assert_allclose(made(found.diffuse, found.amplitudes, found.axes, found.exponents), values, atol=1e-5)
    assert (found.exponents >= quantisation.LEAST * (1 - 1e-9)).all() and (
        found.exponents <= quantisation.MOST * (1 + 1e-9)
    ).all()


def test_axes_are_kept_within_a_degree():
    draw = np.random.default_rng(0)
    axes = draw.normal(size=(20000, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    found = quantisation.decoded_axes(quantisation.coded_axes(axes)).astype(np.float64)
    assert np.degrees(np.arccos(np.clip((found * axes).sum(axis=1), -1, 1))).max() < 1.0
    exact = np.concatenate([np.eye(3), -np.eye(3)])
    np.testing.assert_array_equal(quantisation.decoded_axes(quantisation.coded_axes(exact)), exact)


def test_exponents_are_kept_within_a_fourth_of_an_octave():
    for count in (1, 2, 3):
        exponents = np.exp(
            np.random.default_rng(0).uniform(np.log(quantisation.LEAST), np.log(quantisation.MOST), (500, count))
        )
        codes = quantisation.coded_exponents(exponents)
        assert codes.shape == (500, -(-count // 2)) and codes.dtype == np.uint8
        assert np.abs(np.log2(quantisation.decoded_exponents(codes, count) / exponents)).max() <= 0.25 + 1e-6
    exact = np.array([[0.5, 1.0, 2.0, 64.0]])
    np.testing.assert_allclose(quantisation.decoded_exponents(quantisation.coded_exponents(exact), 4), exact, rtol=1e-6)


def test_amplitudes_are_kept_finer_where_they_are_small():
    largest = np.array([[1.0, 4.0], [0.0, 2.0]])
    share = np.linspace(-1.0, 1.0, 801)[:, None, None]
    codes = quantisation.coded_amplitudes(share * largest, largest)
    off = np.abs(quantisation.decoded_amplitudes(codes, largest) - share * largest)
    assert (off <= (np.sqrt(np.abs(share)) / 127 + 1e-4) * largest + 1e-12).all()
    for end in (0, 400, 800):
        np.testing.assert_allclose(
            quantisation.decoded_amplitudes(codes[end], largest), share[end] * largest, atol=1e-12
        )


def test_many_systems_are_solved():
    draw = np.random.default_rng(0)
    rows = draw.normal(size=(50, 7, 4))
    square, right = rows.swapaxes(1, 2) @ rows, draw.normal(size=(50, 4, 2))
    found = solved(square.transpose(1, 2, 0).copy(), right.transpose(1, 2, 0).copy())
    np.testing.assert_allclose(found.transpose(2, 0, 1), np.linalg.solve(square, right), atol=1e-8)


def test_what_is_rounded_later_makes_up_for_what_was_before():
    draw = np.random.default_rng(0)
    rows = draw.normal(size=(200, 12, 3)) + 2.0
    truth = rows @ draw.normal(size=(200, 3, 1))
    square, right = rows.swapaxes(1, 2) @ rows, rows.swapaxes(1, 2) @ truth
    given = square.transpose(1, 2, 0), right.transpose(1, 2, 0)

    def coarse(number, values):
        return np.rint(values * 4.0) / 4.0

    plain = coarse(0, solved(*(one.copy() for one in given)))
    made_up = solved(*(one.copy() for one in given), coarse)
    off = [np.mean((rows @ one.transpose(2, 0, 1) - truth) ** 2) for one in (plain, made_up)]
    assert (made_up * 4.0 == np.rint(made_up * 4.0)).all() and off[1] < 0.7 * off[0]
