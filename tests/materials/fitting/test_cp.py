"""The decomposition itself: tensors of known rank, and the classical hard cases."""

import numpy as np
import pytest
from metamer.materials.fitting.cp import (
    CompressedTable,
    WeightedTable,
    absorbed,
    khatri_rao,
    mttkrp,
    term_lengths,
    weighted_cp,
)
from tensorly.cp_tensor import CPTensor, cp_to_tensor
from tensorly.random import random_cp
from tensorly.tenalg import khatri_rao as tensorly_khatri_rao
from tensorly.tenalg import unfolding_dot_khatri_rao

SHAPE = (13, 11, 9, 3)


def a_tensor(rank: int, seed: int = 0) -> np.ndarray:
    generator = np.random.default_rng(seed)
    return cp_to_tensor((None, [generator.standard_normal((size, rank)) for size in SHAPE]))


def decomposed(tensor: np.ndarray, rank: int, weights: np.ndarray | None = None, sweeps: int = 300):
    weights = np.ones(tensor.shape[:-1]) if weights is None else weights
    roots = tuple(np.ones(size) for size in weights.shape)
    start = CompressedTable.of(tensor, roots).decomposed(rank, seed=0)
    return weighted_cp(WeightedTable(tensor, weights), start, sweeps)


def longest(found: CPTensor) -> float:
    return float(term_lengths(absorbed(found)).max())


@pytest.mark.parametrize("rank", [1, 2, 3, 5])
def test_an_exact_rank_is_found(rank):
    tensor = a_tensor(rank)
    found, left = decomposed(tensor, rank)
    assert left <= 1e-9 * np.sum(tensor**2)
    np.testing.assert_allclose(cp_to_tensor(found), tensor, atol=1e-3 * np.abs(tensor).max())


def test_a_rank_higher_than_the_tensors_own_is_harmless():
    tensor = a_tensor(2)
    found, left = decomposed(tensor, 12)
    assert left <= 1e-8 * np.sum(tensor**2)
    assert all(np.isfinite(factor).all() for factor in absorbed(found))
    assert longest(found) < 10 * np.linalg.norm(tensor)


def test_duplicate_and_zero_slices():
    tensor = a_tensor(3)
    tensor[4], tensor[:, 2], tensor[:, :, 5], tensor[..., 1] = tensor[5], 0.0, 0.0, tensor[..., 0]
    decomposition, left = decomposed(tensor, 3)
    assert left <= 1e-9 * np.sum(tensor**2)
    found = cp_to_tensor(decomposition)
    assert np.abs(found[:, 2]).max() < 1e-3 * np.abs(tensor).max()
    np.testing.assert_allclose(found[4], found[5], atol=1e-3 * np.abs(tensor).max())


def test_an_all_zero_tensor_stays_zero():
    found, left = decomposed(np.zeros(SHAPE), 3)
    assert left == 0.0
    assert not cp_to_tensor(found).any()


def test_two_factor_degeneracy_leaves_the_terms_bounded():
    """A tensor of rank 3 that terms of rank 2 approach only by growing without bound (De Silva and Lim 2008)."""
    a, b = np.linalg.qr(np.random.default_rng(3).standard_normal((12, 2)))[0].T
    tensor = sum(np.einsum("i,j,k->ijk", *vectors)[..., None] for vectors in ((a, a, b), (a, b, a), (b, a, a)))
    found, left = decomposed(tensor, 2, sweeps=2000)
    assert left < 1e-4 * np.sum(tensor**2)
    assert longest(found) < 100 * np.linalg.norm(tensor)


def test_entries_without_weight_have_no_influence():
    tensor = a_tensor(2)
    weights = np.ones(SHAPE[:-1])
    weights[:4, 6:, ::2] = 0.0
    spiked = tensor.copy()
    spiked[weights == 0.0] = 1e12
    start = CPTensor((None, [np.random.default_rng(1).standard_normal((size, 2)) for size in SHAPE]))
    clean, left = weighted_cp(WeightedTable(tensor, weights), start, 200)
    spoilt, _ = weighted_cp(WeightedTable(spiked, weights), start, 200)
    for one, other in zip(absorbed(clean), absorbed(spoilt), strict=True):
        np.testing.assert_array_equal(one, other)
    assert left <= 1e-9 * np.sum(tensor**2)
    np.testing.assert_allclose(cp_to_tensor(clean), tensor, atol=1e-3 * np.abs(tensor).max())


def test_weights_decide_where_the_error_goes():
    tensor, weights = a_tensor(6), np.ones(SHAPE[:-1])
    weights[:6] = 1e4
    found, _ = decomposed(tensor, 3, weights)
    squares = np.sum((cp_to_tensor(found) - tensor) ** 2, axis=(1, 2, 3))
    assert squares[:6].mean() < 0.3 * squares[6:].mean()


def test_the_same_seed_gives_the_same_bits():
    tensor = a_tensor(5)
    for one, other in zip(*(absorbed(decomposed(tensor, 4)[0]) for _ in range(2)), strict=True):
        np.testing.assert_array_equal(one, other)


def test_weights_of_a_start_count():
    """A start of tensorly's own, whose weights are not 1, is the same start with them multiplied in."""
    tensor = a_tensor(3)
    start = random_cp(SHAPE, 3, random_state=0, normalise_factors=True)
    assert not np.allclose(start.weights, 1.0)
    table, alone = WeightedTable(tensor, np.ones(SHAPE[:-1])), CPTensor((None, absorbed(start)))
    np.testing.assert_allclose(cp_to_tensor(alone), cp_to_tensor(start), atol=1e-12)
    for one, other in zip(*(absorbed(weighted_cp(table, it, 5)[0]) for it in (start, alone)), strict=True):
        np.testing.assert_array_equal(one, other)


def test_products_are_those_of_tensorly():
    tensor, generator = a_tensor(3), np.random.default_rng(2)
    factors = [generator.standard_normal((size, 4)) for size in SHAPE]
    for mode in range(tensor.ndim):
        others = [factor for m, factor in enumerate(factors) if m != mode]
        np.testing.assert_array_equal(khatri_rao(others), tensorly_khatri_rao(factors, skip_matrix=mode))
        expected = unfolding_dot_khatri_rao(tensor, (None, factors), mode)
        np.testing.assert_allclose(mttkrp(tensor, factors, mode), expected, atol=1e-12 * np.abs(expected).max())
