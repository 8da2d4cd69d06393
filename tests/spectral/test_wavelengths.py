"""Grids, and the matrix that moves values between them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from metamer.runtime.errors import InputError
from metamer.spectral.wavelengths import (
    WORKING_WAVELENGTHS_NM,
    interpolation_matrix,
    is_uniform,
    validated_wavelengths,
)

SMOOTH = np.arange(400.0, 701.0, 10.0)


def test_working_grid_is_380_to_780_by_5():
    assert WORKING_WAVELENGTHS_NM.shape == (81,)
    assert WORKING_WAVELENGTHS_NM[[0, 1, -1]].tolist() == [380.0, 385.0, 780.0]


@pytest.mark.parametrize("step", [5.0, 10.0, 20.0])
def test_sprague_equals_colour_science(colour, rng, step):
    grid = np.arange(400.0, 701.0, step)
    fine = np.arange(400.0, 701.0)
    oracle = colour.SpragueInterpolator(grid, np.eye(grid.size)[0])
    matrix = interpolation_matrix(grid, fine)
    for values in (rng.uniform(size=grid.size), np.sin(grid / 40), grid**2):
        oracle.y = values
        np.testing.assert_allclose(matrix @ values, oracle(fine), rtol=1e-9, atol=1e-9)


def test_sprague_is_exact_for_quadratics_away_from_the_ends():
    fine = np.arange(420.0, 681.0)
    values = 1e-5 * (SMOOTH - 550) ** 2 + 0.1
    np.testing.assert_allclose(interpolation_matrix(SMOOTH, fine) @ values, 1e-5 * (fine - 550) ** 2 + 0.1, atol=1e-12)


def test_sprague_converges_with_the_order_of_its_polynomial():
    """Halving the step of a smooth curve divides the error by 2^4 at least, away from the ends."""
    fine = np.arange(450.0, 650.0)

    def error(step):
        grid = np.arange(400.0, 701.0, step)
        return np.abs(interpolation_matrix(grid, fine) @ np.sin(grid / 15) - np.sin(fine / 15)).max()

    order = np.log2(error(20.0) / error(10.0))
    assert order > 4, f"order {order:.2f}"


@given(st.lists(st.floats(300, 900), min_size=2, max_size=20, unique=True))
def test_linear_equals_numpy_on_any_grid(points):
    grid = np.sort(np.round(points, 3))
    if (np.diff(grid) <= 0).any():
        return
    values = np.cos(grid / 30)
    target = np.linspace(290.0, 910.0, 101)
    np.testing.assert_allclose(
        interpolation_matrix(grid, target, "hold", "linear") @ values, np.interp(target, grid, values), atol=1e-12
    )


def test_uneven_grid_is_interpolated_linearly():
    grid = np.array([400.0, 410, 430, 440, 450, 470, 500])
    target = np.arange(400.0, 501.0, 7.0)
    assert not is_uniform(grid)
    np.testing.assert_allclose(interpolation_matrix(grid, target) @ grid, target)


def test_five_samples_are_too_few_for_sprague():
    grid = np.arange(400.0, 441.0, 10.0)
    found = interpolation_matrix(grid, np.array([405.0]))
    np.testing.assert_array_equal(found, [[0.5, 0.5, 0, 0, 0]])


@pytest.mark.parametrize("grid", [SMOOTH, np.array([400.0, 410, 430, 700]), np.array([550.0])])
def test_rows_sum_to_one_so_that_a_constant_stays_one(grid):
    rows = interpolation_matrix(grid, WORKING_WAVELENGTHS_NM, "hold").sum(axis=1)
    np.testing.assert_allclose(rows, 1.0, atol=1e-13)


def test_samples_on_the_grid_are_kept_as_they_are():
    np.testing.assert_allclose(interpolation_matrix(SMOOTH, SMOOTH), np.eye(SMOOTH.size), atol=1e-15)


def test_hold_keeps_the_end_values():
    found = interpolation_matrix(SMOOTH, np.array([380.0, 780.0]), "hold") @ SMOOTH
    np.testing.assert_allclose(found, [400.0, 700.0], rtol=1e-14)


def test_zero_is_nothing_outside_and_everything_at_the_ends():
    matrix = interpolation_matrix(SMOOTH, np.array([399.0, 400.0, 700.0, 701.0]), "zero")
    np.testing.assert_allclose(matrix @ np.ones(SMOOTH.size), [0.0, 1.0, 1.0, 0.0], rtol=1e-14)


def test_error_policy_says_both_ranges():
    with pytest.raises(InputError) as caught:
        interpolation_matrix(SMOOTH, WORKING_WAVELENGTHS_NM, "error")
    assert "380 to 780 nm asked" in str(caught.value)
    assert "within 400 to 700 nm" in str(caught.value)


@pytest.mark.parametrize(
    ("grid", "message"),
    [
        ([0.38, 0.5, 0.78], "look like micrometres"),
        ([1.7, 2.4, 3.1], "electronvolts, nm = 1239.842 / eV"),
        ([3.8e-7, 7.8e-7], "look like metres"),
        ([380000.0, 780000.0], "not in nanometres"),
        ([-5.0, 400.0, 500.0], "not in nanometres"),
        ([700.0, 600.0, 500.0], "do not ascend"),
        ([400.0, 410.0, 410.0, 420.0], "410 nm"),
        ([400.0, np.nan, 420.0], "not a finite number"),
        ([400.0, np.inf], "not a finite number"),
        ([], "no wavelength axis"),
        ([[400.0, 500.0]], "no wavelength axis"),
        (["blue", "red"], "not numbers"),
    ],
)
def test_unusable_axes_are_named(grid, message):
    with pytest.raises(InputError, match=message) as caught:
        validated_wavelengths(grid, file="paint.csv", field="header")
    assert caught.value.found is not None and caught.value.expected and caught.value.hint


def test_descending_axis_says_where_and_what_to_do():
    with pytest.raises(InputError) as caught:
        validated_wavelengths([400.0, 420.0, 410.0], file="paint.csv", field="header")
    assert str(caught.value).splitlines() == [
        "paint.csv: header: wavelengths do not ascend",
        "  found: 420 nm followed by 410 nm",
        "  expected: ascending wavelengths",
        "  try: sort the samples by wavelength",
    ]
