"""Arrays of which only the numbers other than 0 are kept, and means in few bits."""

import numpy as np
import pytest
from metamer.materials.btf.decoding import uplifted_basis
from metamer.materials.btf.dictionary import dense, sparse
from metamer.materials.btf.metric import seen
from metamer.materials.btf.rounded_mean import RoundedMean, rounded_mean


@pytest.mark.parametrize("share", [0.0, 0.001, 0.01, 0.5, 1.0])
def test_an_array_comes_back(share):
    draw = np.random.default_rng(0)
    values = np.where(draw.random((3, 40, 50)) < share, draw.integers(1, 500, (3, 40, 50)), 0).astype(np.int16)
    kept = sparse(values)
    assert kept["runs"].dtype == np.uint8 and np.count_nonzero(values) == len(kept["others"])
    back = dense(kept)
    assert back.dtype == np.int16 and np.array_equal(back, values)


def test_numbers_that_no_byte_holds_stand_apart():
    values = np.array([0, 127, 0, 128, -127, -128, 0, 0, -32768, 32767, 1], dtype=np.int16)
    kept = sparse(values)
    assert kept["others"].dtype == np.int8 and kept["large"].tolist() == [128, -128, -32768, 32767]
    np.testing.assert_array_equal(dense(kept), values)


@pytest.mark.parametrize("run", [0, 1, 254, 255, 256, 509, 510, 511])
def test_runs_of_every_length(run):
    values = np.zeros(2 * run + 7, dtype=np.int8)
    values[[run, 2 * run + 1]] = -3, 4
    assert np.array_equal(dense(sparse(values)), values)


def test_nothing_at_all():
    empty = np.zeros((0, 4, 5), dtype=np.int8)
    assert dense(sparse(empty)).shape == (0, 4, 5)


@pytest.mark.parametrize("bright", [1e-3, 0.1, 30.0])
def test_a_mean_is_rounded_by_less_than_is_seen(bright):
    basis, draw = uplifted_basis(), np.random.default_rng(1)
    mean = bright * draw.uniform(0.0, 1.0, (9, 11, 3)) * draw.uniform(0.2, 1.0, (9, 11, 1)) ** 4
    found = rounded_mean(mean, basis)
    off = np.einsum("vljk,vlj->vlk", seen(mean, basis), found.values - mean)
    assert np.linalg.norm(off, axis=2).max() < 0.3 and np.sqrt(np.mean(off**2)) < 0.05
    again = RoundedMean.from_stored(found.stored(), basis)
    np.testing.assert_array_equal(again.values, found.values)


def test_black_is_black():
    assert not rounded_mean(np.zeros((2, 3, 3)), uplifted_basis()).values.any()


def test_a_mean_below_zero_is_kept_as_such():
    mean = np.full((2, 3, 3), -0.01)
    np.testing.assert_allclose(rounded_mean(mean, uplifted_basis()).values, mean, atol=1e-4)
