"""Colour-difference maps, their statistics, and the check that a known difference comes back."""

import numpy as np
import pytest
from metamer.calibration.report.statistics import (
    DeltaEStatistics,
    compared_pixels,
    delta_e_map,
    delta_e_statistics,
    self_check,
    verdict,
    xyz_from_lab,
)
from metamer.runtime.errors import ComparisonError, InputError
from metamer.spectral.difference import lab_from_xyz

WHITE = np.array([0.95047, 1.0, 1.08883])


@pytest.fixture
def reference() -> np.ndarray:
    return np.random.default_rng(5).uniform(0.01, 0.9, (12, 10, 3))


def test_statistics_of_known_numbers():
    found = delta_e_statistics(np.arange(101.0))
    assert found == DeltaEStatistics(mean=50.0, p95=95.0, p99=99.0, max=100.0, pixels=101)


def test_only_wholly_covered_pixels_count(reference):
    coverage = np.ones((12, 10))
    coverage[0] = 0.5
    sample = reference.copy()
    sample[0] *= 2.0
    found = delta_e_map(reference, sample, WHITE, coverage)
    assert np.isnan(found[0]).all()
    assert delta_e_statistics(found) == DeltaEStatistics(0.0, 0.0, 0.0, 0.0, 110)


def test_unlit_pixels_do_not_flatter_the_mean(reference):
    reference[:6] = 0.0
    sample = reference * 1.01
    found = delta_e_map(reference, sample, WHITE, np.ones((12, 10)))
    assert np.isnan(found[:6]).all()
    sample[3, 3] = 0.1
    assert np.isfinite(delta_e_map(reference, sample, WHITE, np.ones((12, 10)))[3, 3])


def test_a_surface_that_reflects_nothing_is_compared():
    black = np.zeros((4, 4, 3))
    found = delta_e_statistics(delta_e_map(black, black.copy(), WHITE, np.ones((4, 4))))
    assert (found.max, found.pixels) == (0.0, 16)


def test_missing_numbers_are_counted_and_never_pass(reference):
    sample = reference.copy()
    sample[2, 3, 1] = np.nan
    reference[4, 4, 0] = np.inf
    found = delta_e_statistics(delta_e_map(reference, sample, WHITE, np.ones((12, 10))))
    assert (found.undefined, found.pixels, found.max) == (2, 118, 0.0)
    assert verdict(found, 1.0) == "over"


def test_missing_numbers_outside_the_part_do_not_matter(reference):
    coverage = np.ones((12, 10))
    coverage[2, 3] = 0.0
    sample = reference.copy()
    sample[2, 3] = np.nan
    assert delta_e_statistics(delta_e_map(reference, sample, WHITE, coverage)).undefined == 0


@pytest.mark.parametrize("values", [np.full((3, 3), np.nan), np.full((3, 3), np.inf), np.zeros((0, 3))])
def test_nothing_to_compare_is_an_error(values):
    with pytest.raises(InputError, match="no pixel"):
        delta_e_statistics(values)


def test_a_picture_is_not_compared_with_itself(reference):
    with pytest.raises(ComparisonError, match="same array"):
        delta_e_map(reference, reference, WHITE, np.ones((12, 10)))
    with pytest.raises(ComparisonError, match="same array"):
        delta_e_map(reference[:6], reference[2:8], WHITE, np.ones((6, 10)))


def test_pictures_of_different_sizes_are_not_compared(reference):
    with pytest.raises(ComparisonError, match="different sizes"):
        delta_e_map(reference, reference[:5].copy(), WHITE, np.ones((12, 10)))


@pytest.mark.parametrize("delta", [0.05, 1.0, 5.0])
def test_known_difference_is_recovered(reference, delta):
    checks = self_check(reference, WHITE, np.ones((12, 10)), delta)
    assert checks[0].expected == pytest.approx(delta)
    assert checks[1].expected < delta
    for check in checks:
        assert check.passed, check


def test_self_check_would_see_swapped_sides(reference):
    lab = lab_from_xyz(reference, WHITE)
    chroma = np.hypot(lab[..., 1], lab[..., 2])[..., None]
    stronger = xyz_from_lab(np.concatenate([lab[..., :1], lab[..., 1:] * (1 + 5 / chroma)], axis=-1), WHITE)
    right = delta_e_statistics(delta_e_map(reference, stronger, WHITE, np.ones((12, 10)))).mean
    swapped = delta_e_statistics(delta_e_map(stronger, reference, WHITE, np.ones((12, 10)))).mean
    assert right == pytest.approx(self_check(reference, WHITE, np.ones((12, 10)), 5.0)[1].expected, abs=1e-3)
    assert abs(swapped - right) > 1e-2


def test_lab_solved_for_xyz_is_its_inverse():
    xyz = np.random.default_rng(0).uniform(-0.05, 1.2, (50, 3))
    np.testing.assert_allclose(xyz_from_lab(lab_from_xyz(xyz, WHITE), WHITE), xyz, atol=1e-12)


def test_verdicts():
    rows = [DeltaEStatistics(0.1, 0.2, p99, 9.0, 10) for p99 in (0.9, 1.0, 1.2, 1.5, 1.6)]
    assert [verdict(row, 1.0) for row in rows] == ["pass", "pass", "near", "near", "over"]


def test_compared_pixels_follow_the_smaller_coverage():
    ones = np.ones((2, 2, 3))
    coverage = np.array([[1.0, 0.9995], [0.99, 0.0]])
    assert compared_pixels(coverage, ones, ones).tolist() == [[True, True], [False, False]]
