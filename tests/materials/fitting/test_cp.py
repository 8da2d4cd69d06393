"""The decomposition itself: tensors of known rank, and the classical hard cases."""

import numpy as np
import pytest
from metamer.materials.fitting.cp import CompressedTable, WeightedTable, cp_tensor, weighted_cp

SHAPE = (13, 11, 9, 3)


def a_tensor(rank: int, seed: int = 0) -> np.ndarray:
    generator = np.random.default_rng(seed)
    return cp_tensor([generator.standard_normal((size, rank)) for size in SHAPE])


def decomposed(tensor: np.ndarray, rank: int, weights: np.ndarray | None = None, sweeps: int = 300):
    weights = np.ones(tensor.shape[:-1]) if weights is None else weights
    roots = tuple(np.ones(size) for size in weights.shape)
    start = CompressedTable.of(tensor, roots).decomposed(rank, seed=0)
    return weighted_cp(WeightedTable(tensor, weights), start, sweeps)


def longest(factors: list[np.ndarray]) -> float:
    return float(np.prod([np.linalg.norm(factor, axis=0) for factor in factors], axis=0).max())


@pytest.mark.parametrize("rank", [1, 2, 3, 5])
def test_an_exact_rank_is_found(rank):
    tensor = a_tensor(rank)
    factors, left = decomposed(tensor, rank)
    assert left <= 1e-9 * np.sum(tensor**2)
    np.testing.assert_allclose(cp_tensor(factors), tensor, atol=1e-3 * np.abs(tensor).max())


def test_a_rank_higher_than_the_tensors_own_is_harmless():
    tensor = a_tensor(2)
    factors, left = decomposed(tensor, 12)
    assert left <= 1e-8 * np.sum(tensor**2)
    assert all(np.isfinite(factor).all() for factor in factors)
    assert longest(factors) < 10 * np.linalg.norm(tensor)


def test_duplicate_and_zero_slices():
    tensor = a_tensor(3)
    tensor[4], tensor[:, 2], tensor[:, :, 5], tensor[..., 1] = tensor[5], 0.0, 0.0, tensor[..., 0]
    factors, left = decomposed(tensor, 3)
    assert left <= 1e-9 * np.sum(tensor**2)
    found = cp_tensor(factors)
    assert np.abs(found[:, 2]).max() < 1e-3 * np.abs(tensor).max()
    np.testing.assert_allclose(found[4], found[5], atol=1e-3 * np.abs(tensor).max())


def test_an_all_zero_tensor_stays_zero():
    factors, left = decomposed(np.zeros(SHAPE), 3)
    assert left == 0.0
    assert not cp_tensor(factors).any()


def test_two_factor_degeneracy_leaves_the_terms_bounded():
    """A tensor of rank 3 that terms of rank 2 approach only by growing without bound (De Silva and Lim 2008)."""
    a, b = np.linalg.qr(np.random.default_rng(3).standard_normal((12, 2)))[0].T
    tensor = sum(np.einsum("i,j,k->ijk", *vectors)[..., None] for vectors in ((a, a, b), (a, b, a), (b, a, a)))
    factors, left = decomposed(tensor, 2, sweeps=2000)
    assert left < 1e-4 * np.sum(tensor**2)
    assert longest(factors) < 100 * np.linalg.norm(tensor)


def test_entries_without_weight_have_no_influence():
    tensor = a_tensor(2)
    weights = np.ones(SHAPE[:-1])
    weights[:4, 6:, ::2] = 0.0
    spiked = tensor.copy()
    spiked[weights == 0.0] = 1e12
    start = [np.random.default_rng(1).standard_normal((size, 2)) for size in SHAPE]
    clean, left = weighted_cp(WeightedTable(tensor, weights), start, 200)
    spoilt, _ = weighted_cp(WeightedTable(spiked, weights), start, 200)
    for one, other in zip(clean, spoilt, strict=True):
        np.testing.assert_array_equal(one, other)
    assert left <= 1e-9 * np.sum(tensor**2)
    np.testing.assert_allclose(cp_tensor(clean), tensor, atol=1e-3 * np.abs(tensor).max())


def test_weights_decide_where_the_error_goes():
    tensor, weights = a_tensor(6), np.ones(SHAPE[:-1])
    weights[:6] = 1e4
    factors, _ = decomposed(tensor, 3, weights)
    squares = np.sum((cp_tensor(factors) - tensor) ** 2, axis=(1, 2, 3))
    assert squares[:6].mean() < 0.3 * squares[6:].mean()


def test_the_same_seed_gives_the_same_bits():
    tensor = a_tensor(5)
    for one, other in zip(decomposed(tensor, 4)[0], decomposed(tensor, 4)[0], strict=True):
        np.testing.assert_array_equal(one, other)
