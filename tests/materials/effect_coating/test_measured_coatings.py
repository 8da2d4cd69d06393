"""Reconstructions of measured coatings from a few angles: what they are off by, and what they say of it."""

import numpy as np
import pytest
from metamer.benchmarks import several_angles

pytestmark = pytest.mark.slow
SPECTRAL = ("garnet_red", "krylon_blue", "mystique")


@pytest.fixture(scope="module")
def figures(shared_data):
    return {path.stem: several_angles.measure(path) for path in several_angles.data_files(shared_data)}


def mean(figures, angles, figure, spectral):
    return float(np.mean([one[angles][figure] for name, one in figures.items() if (name in SPECTRAL) == spectral]))


def test_spectral_coatings_are_near_to_what_was_measured(figures):
    assert mean(figures, 6, "mean", True) <= 2.3 and mean(figures, 6, "p95", True) <= 5.0
    assert max(figures[name][6]["mean"] for name in SPECTRAL) <= 3.1
    assert mean(figures, 6, "front", True) <= 1.8
    assert mean(figures, 12, "mean", True) <= 1.9


def test_coatings_in_rgb_are_near_to_what_was_measured(figures):
    assert mean(figures, 6, "mean", False) <= 4.4 and mean(figures, 12, "mean", False) <= 3.5


@pytest.mark.parametrize("angles", several_angles.ANGLES)
def test_none_is_farther_off_than_its_face_taken_for_matt(figures, angles):
    assert all(one[angles]["mean"] < one[angles]["lambert"] for one in figures.values())


@pytest.mark.parametrize(("angles", "least", "most"), [(6, 0.1, 0.5), (12, 0.2, 1.5)])
def test_readings_come_back(figures, angles, least, most):
    assert max(one[angles]["reread mean"] for one in figures.values()) <= least
    assert max(one[angles]["reread max"] for one in figures.values()) <= most


@pytest.mark.parametrize("angles", several_angles.ANGLES)
def test_what_is_physical_holds(figures, angles):
    for one in figures.values():
        figures_of = one[angles]
        assert figures_of["reciprocity"] <= 1e-6 and figures_of["least"] >= 0.0 and figures_of["albedo"] <= 1.0 + 1e-9


@pytest.mark.parametrize("angles", [6, 12])
def test_what_is_stated_covers_what_is_true(figures, angles):
    found = several_angles.pooled(figures, angles)
    assert found["covered"] >= 0.88 and found["rank"] >= 0.6
    assert min(one[angles]["covered"] for one in figures.values()) >= 0.65
