"""The minimax basis: the least largest error, the same for any order, and sound where spectra are not."""

import numpy as np
import pytest
from metamer.benchmarks.basis import basis_error, stage
from metamer.runtime.errors import InputError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.minimax_basis import minimax_basis


@pytest.fixture(scope="module")
def chart():
    """ColorChecker under D65, A and FL1 to FL12."""
    return stage()


@pytest.mark.slow_cases("10-0.06")
@pytest.mark.parametrize(("size", "bound"), [(6, 1.1), (7, 0.20), (8, 0.16), (10, 0.06)])
def test_largest_error_at_each_size(chart, size, bound):
    ours = basis_error(minimax_basis(chart.reflectances, chart.columns, size), chart)
    balanced = basis_error(SpectralBasis.balanced(chart.reflectances, chart.columns, size), chart)
    assert ours <= bound, (ours, balanced)
    assert ours < 0.9 * balanced


@pytest.mark.slow_cases("2", "3", "16", "4")
@pytest.mark.parametrize("size", [1, 2, 3, 4, 16, 24])
def test_never_worse_than_balanced(chart, size):
    ours = basis_error(minimax_basis(chart.reflectances, chart.columns, size), chart)
    assert ours <= basis_error(SpectralBasis.balanced(chart.reflectances, chart.columns, size), chart) + 1e-9


def test_the_order_of_spectra_and_lights_changes_no_bit(chart):
    random = np.random.default_rng(0)
    spectra = chart.reflectances[random.permutation(len(chart.reflectances))]
    lights = chart.columns.reshape(len(chart.columns), -1, 3)
    lights = lights[:, random.permutation(lights.shape[1])].reshape(len(lights), -1)
    one, other = minimax_basis(chart.reflectances, chart.columns, 7), minimax_basis(spectra, lights, 7)
    for same in (other, minimax_basis(np.concatenate([spectra, spectra[:5]]), lights, 7)):
        np.testing.assert_array_equal(one.analysis, same.analysis)
        np.testing.assert_array_equal(one.synthesis, same.synthesis)


def test_one_light_is_exact_at_three(chart):
    basis = minimax_basis(chart.reflectances, chart.columns[:, :3], 3)
    assert basis_error(basis, stage(("D65",), chart.reflectances)) < 1e-9


@pytest.mark.parametrize("case", ["black", "grey", "one spectrum", "nearly black", "bright"])
def test_hard_cases(chart, case):
    spectra = {
        "black": np.zeros((3, 81)),
        "grey": np.outer([0.0, 0.2, 1.0], np.ones(81)),
        "one spectrum": chart.reflectances[:1],
        "nearly black": np.concatenate([1e-9 * chart.reflectances, chart.reflectances]),
        "bright": np.concatenate([1e3 * chart.reflectances[:4], chart.reflectances]),
    }[case]
    on = stage(("D65", "A", "FL11"), spectra)
    basis = minimax_basis(spectra, on.columns, 6)
    assert np.isfinite(basis.analysis).all() and np.isfinite(basis.synthesis).all()
    assert basis_error(basis, on) <= basis_error(SpectralBasis.balanced(spectra, on.columns, 6), on) + 1e-9


def test_it_ends_where_the_error_is_small_enough(chart):
    balanced = basis_error(SpectralBasis.balanced(chart.reflectances, chart.columns, 8), chart)
    first = minimax_basis(chart.reflectances, chart.columns, 8, enough=balanced)
    np.testing.assert_allclose(basis_error(first, chart), balanced)
    assert basis_error(minimax_basis(chart.reflectances, chart.columns, 8, enough=0.2), chart) <= 0.2


def test_what_is_no_table_of_spectra_or_lights_is_refused(chart):
    with pytest.raises(InputError, match="no spectra and lights"):
        minimax_basis(np.zeros((0, 81)), chart.columns, 4)
    with pytest.raises(InputError, match="three columns a light"):
        minimax_basis(chart.reflectances, chart.columns[:, :4], 4)
    with pytest.raises(InputError, match="finite"):
        minimax_basis(np.full((2, 81), np.nan), chart.columns, 4)
    with pytest.raises(InputError, match="at least one coefficient"):
        minimax_basis(chart.reflectances, chart.columns, 0)
