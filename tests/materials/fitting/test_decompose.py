"""Decomposition of dense tables: exact ranks, the paper's packs, and the classical hard cases."""

import tracemalloc

import numpy as np
import pytest
from metamer.materials.fitting.cp import absorbed
from metamer.materials.fitting.decompose import METHODS, decompose
from metamer.materials.fitting.tucker import compressed, mode_gram, projected
from metamer.runtime.errors import InputError
from tensorly.cp_tensor import cp_to_tensor
from tensorly.tenalg import mode_dot, multi_mode_dot

SHAPE = (13, 11, 9, 3)


def a_tensor(rank: int, seed: int = 0, shape: tuple[int, ...] = SHAPE) -> np.ndarray:
    generator = np.random.default_rng(seed)
    return cp_to_tensor((None, [generator.standard_normal((size, rank)) for size in shape]))


def error_of(found, tensor: np.ndarray) -> float:
    return float(np.linalg.norm(cp_to_tensor(found.cp) - tensor) / np.linalg.norm(tensor))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rank", [1, 3])
def test_an_exact_rank_is_found(rank, method):
    tensor = a_tensor(rank)
    found = decompose(tensor, rank, method=method)
    assert found.relative_error < 1e-4
    assert (found.rank, found.packs) == (rank, 1)


@pytest.mark.parametrize("method", METHODS)
def test_the_declared_error_is_the_one_measured_on_the_table(method):
    tensor = np.exp(-(sum(np.meshgrid(*(np.linspace(0, 1, n) for n in SHAPE), indexing="ij")) ** 2))
    for rank in (1, 2, 6):
        found = decompose(tensor, rank, method=method)
        assert found.relative_error == pytest.approx(error_of(found, tensor), rel=1e-3, abs=1e-7)


def test_joint_refits_beat_packs_left_as_they_were_found():
    tensor = a_tensor(12)
    alone, refitted = (decompose(tensor, 12, method=method) for method in ("incremental", "refitted"))
    assert refitted.relative_error < 0.7 * alone.relative_error
    assert refitted.packs == 3


@pytest.mark.parametrize("method", METHODS)
def test_a_rank_higher_than_the_tensors_own_is_harmless(method):
    tensor = a_tensor(2)
    found = decompose(tensor, 14, method=method)
    assert found.rank == 14
    assert found.relative_error < 1e-4
    assert found.longest < 10
    assert all(np.isfinite(factor).all() for factor in absorbed(found.cp))


@pytest.mark.parametrize("method", METHODS)
def test_duplicate_and_zero_slices(method):
    tensor = a_tensor(3)
    tensor[4], tensor[:, 2], tensor[:, :, 5], tensor[..., 1] = tensor[5], 0.0, 0.0, tensor[..., 0]
    found = decompose(tensor, 3, method=method)
    assert found.relative_error < 1e-4
    whole = cp_to_tensor(found.cp)
    assert np.abs(whole[:, 2]).max() < 1e-12 * np.abs(tensor).max()
    np.testing.assert_allclose(whole[4], whole[5], atol=1e-10 * np.abs(tensor).max())


@pytest.mark.parametrize("method", METHODS)
def test_an_all_zero_table_stays_zero(method):
    found = decompose(np.zeros(SHAPE), 5, method=method)
    assert (found.relative_error, found.longest) == (0.0, 0.0)
    assert not any(factor.any() for factor in absorbed(found.cp))


@pytest.mark.parametrize("method", METHODS)
def test_two_factor_degeneracy_leaves_the_terms_bounded_and_reports_the_error(method):
    """A tensor of rank 3 that terms of rank 2 approach only by growing without bound (De Silva and Lim 2008)."""
    a, b = np.linalg.qr(np.random.default_rng(3).standard_normal((12, 2)))[0].T
    tensor = sum(np.einsum("i,j,k->ijk", *vectors)[..., None] for vectors in ((a, a, b), (a, b, a), (b, a, a)))
    found = decompose(tensor, 2, method=method, sweeps=5000)
    assert found.longest < 100
    assert found.relative_error == pytest.approx(error_of(found, tensor), rel=1e-6)
    assert 1e-6 < found.relative_error < 0.1


@pytest.mark.parametrize("cosine", [0.9, 0.99, 0.999])
def test_swamps_of_collinear_factors_are_crossed(cosine):
    """Factors of every mode nearly parallel: plain alternating least squares stands still for thousands of sweeps."""
    generator = np.random.default_rng(7)
    factors = []
    for size in (20, 18, 16, 8):
        q = np.linalg.qr(generator.standard_normal((size, 4)))[0]
        factors.append(cosine * q[:, :1] + np.sqrt(1 - cosine**2) * q[:, 1:])
    found = decompose(cp_to_tensor((None, factors)), 3)
    assert found.relative_error < 2e-3
    assert found.longest < 20


def test_an_amplitude_far_from_one_changes_nothing():
    tensor = a_tensor(5)
    one, tall, small = (decompose(tensor * scale, 3) for scale in (1.0, 2.0**300, 2.0**-300))
    assert one.relative_error == pytest.approx(tall.relative_error, rel=1e-6)
    assert one.relative_error == pytest.approx(small.relative_error, rel=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_the_same_seed_gives_the_same_bits(method):
    tensor = a_tensor(6)
    one, other = (decompose(tensor, 4, method=method, seed=5) for _ in range(2))
    for left, right in zip(absorbed(one.cp), absorbed(other.cp), strict=True):
        np.testing.assert_array_equal(left, right)


def test_spectra_that_are_zero_but_in_one_band():
    tensor = np.zeros((12, 10, 8, 81))
    tensor[..., 40] = a_tensor(2, shape=(12, 10, 8))
    found = decompose(tensor, 2)
    assert found.core_shape[-1] == 1
    assert found.relative_error < 1e-4
    assert not np.delete(absorbed(found.cp)[-1], 40, axis=0).any()


def test_grams_and_projections_come_from_views_and_are_right():
    tensor = a_tensor(7)
    for mode in range(tensor.ndim):
        unfolded = np.moveaxis(tensor, mode, 0).reshape(tensor.shape[mode], -1)
        np.testing.assert_allclose(mode_gram(tensor, mode), unfolded @ unfolded.T, rtol=1e-10, atol=1e-10)
        basis = np.linalg.qr(np.random.default_rng(1).standard_normal((tensor.shape[mode], 2)))[0]
        expected = mode_dot(tensor, basis.T, mode)
        np.testing.assert_allclose(projected(tensor, basis, mode), expected, atol=1e-12 * np.abs(tensor).max())


def test_compression_keeps_the_energy_and_says_what_it_lost():
    tensor = a_tensor(4) + 1e-4 * np.random.default_rng(2).standard_normal(SHAPE)
    form = compressed(tensor, 1e-6)
    assert form.core.shape == (4, 4, 4, 3)
    assert form.lost <= 1e-6 * form.energy
    np.testing.assert_allclose(np.sum(form.core**2) + form.lost, form.energy, rtol=1e-12)
    for basis in form.bases:
        np.testing.assert_allclose(basis.T @ basis, np.eye(basis.shape[1]), atol=1e-12)
    left = np.sum((multi_mode_dot(form.core, form.bases) - tensor) ** 2)
    np.testing.assert_allclose(left, form.lost, rtol=1e-6)


def test_memory_stays_below_three_tables():
    table = a_tensor(6, shape=(70, 70, 70, 8)) + 1e-3 * np.random.default_rng(0).standard_normal((70, 70, 70, 8))
    tracemalloc.start()
    decompose(table, 8, sweeps=5)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2 * table.nbytes, peak / table.nbytes


def test_the_table_is_only_read():
    table = a_tensor(3)
    table.setflags(write=False)
    decompose(table, 2)


def test_unusable_arguments_are_refused():
    tensor = a_tensor(2)
    with pytest.raises(InputError, match="unusable rank"):
        decompose(tensor, 0)
    for value in (np.nan, np.inf, 1e300):
        spoilt = tensor.copy()
        spoilt[1, 2, 3] = value
        with pytest.raises(InputError, match="not finite"):
            decompose(spoilt, 2)
    with pytest.raises(InputError, match="not a table"):
        decompose(np.ones(4), 1)
