"""Uncertainties of differences, against Monte Carlo."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from metamer.calibration.match.batch import batch
from metamer.calibration.match.pairs import MatchOptions, matched
from metamer.calibration.match.uncertainty import Repeatability, scatter, spread
from metamer.calibration.match.whites import white_indices
from metamer.runtime.errors import InputError
from metamer.spectral.difference import lab_from_xyz
from metamer.spectral.formula import formula
from metamer.spectral.illuminants import illuminant
from metamer.spectral.metamerism import Conditions
from metamer.spectral.observers import observer
from metamer.spectral.whiteness import index_of_xyz
from orange_batch import NM, ORANGE, sample

FORMULAS = tuple(formula(name) for name in ("CIE 1976", "CIE 1994", "CIE 2000", "CMC 2:1"))
WHITE = observer("1964_10").white(illuminant("D65"))
WHITE_TILE = 0.85 + 0.01 * np.tanh((NM - 450.0) / 40.0)
# Noise of readings, in fractions: of each wavelength, and of all together.
NOISE, TOGETHER = 8e-4, 5e-4


def noisy(rng, row, count):
    return row + rng.normal(0.0, NOISE, (count, NM.size)) + rng.normal(0.0, TOGETHER, (count, 1))


@cache
def repeated(name):
    """Repeatability from 2000 readings of one tile."""
    rng = np.random.default_rng(6)
    return Repeatability(repeated=sample("tile", *noisy(rng, {"orange": ORANGE, "white": WHITE_TILE}[name], 2000)))


@pytest.mark.parametrize("apart", [1.0, 1.004, 1.03], ids=["a match", "near", "apart"])
def test_what_readings_scatter_by_is_what_monte_carlo_finds(apart):
    rng = np.random.default_rng(4)
    many, light, eye = 20_000, illuminant("D65"), observer("1964_10")
    weights = eye.weights(light, NM)
    first, second = (lab_from_xyz(noisy(rng, row, many) @ weights.T, WHITE) for row in (ORANGE, apart * ORANGE))
    known = repeated("orange")
    standard, other = sample("master", ORANGE), sample("lot", apart * ORANGE)
    covariance = scatter(standard, other, known, "D65", "1964_10")
    labs = [side.lab("D65", "1964_10") for side in (standard, other)]
    found = spread(*labs, WHITE, covariance, FORMULAS)
    off = (second - first).std(axis=0)
    np.testing.assert_allclose([found.lightness, found.a, found.b], 2.0 * off, rtol=0.06)
    from metamer.spectral.difference import xyz_from_lab

    xyz = [xyz_from_lab(lab, WHITE) for lab in (first, second)]
    for one in FORMULAS:
        assert found.delta_e[one.name] == pytest.approx(2.0 * one(*xyz, WHITE).std(), rel=0.08), one.name


@pytest.mark.parametrize("scale", ["CIE 2004", "ASTM E313", "yellowness"])
def test_whiteness_scatters_as_monte_carlo_finds(scale):
    rng = np.random.default_rng(5)
    many, known = 20_000, repeated("white")
    sides = sample("master", WHITE_TILE), sample("lot", 0.99 * WHITE_TILE)
    (found,) = white_indices(*sides, (scale,), (Conditions("D65", "1964_10"),), known)
    weights = observer("1964_10").weights(illuminant("D65"), NM)
    method = None if scale == "yellowness" else scale
    first, second = (
        index_of_xyz(noisy(rng, side.readings[0].samples, many) @ weights.T, Conditions("D65", "1964_10"), method)
        for side in sides
    )
    assert found.off == pytest.approx((second - first).mean(), abs=0.05)
    assert found.uncertainty == pytest.approx(2.0 * (second - first).std(), rel=0.06)


def test_means_of_more_readings_are_known_better():
    known = Repeatability(0.1)
    alone = scatter(sample("a", ORANGE), sample("b", ORANGE), known, "D65", "1964_10")
    mean = scatter(sample("a", *[ORANGE] * 4), sample("b", *[ORANGE] * 4), known, "D65", "1964_10")
    np.testing.assert_allclose(mean, alone / 4.0)
    np.testing.assert_allclose(np.trace(alone), 2.0 * 0.1**2)


def test_too_few_readings_tell_no_scatter():
    with pytest.raises(InputError, match="too few readings"):
        Repeatability(repeated=sample("tile", ORANGE, 1.01 * ORANGE))
    assert "known to" in Repeatability(repeated=sample("tile", ORANGE, 1.01 * ORANGE, 1.02 * ORANGE)).words
    for number in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(InputError, match="not a repeatability"):
            Repeatability(number)


def of_batch(rows):
    lots = [sample(f"lot {at}", row) for at, row in enumerate(rows)]
    asked = MatchOptions((Conditions("D65", "1964_10"),), (formula("CIE 2000"),))
    found = matched(sample("master", ORANGE), lots, asked)
    return batch([one.differences[0] for one in found], asked.judging)


def test_a_batch_that_drifts_is_told_from_one_that_scatters():
    rng = np.random.default_rng(0)
    drifting = of_batch([(1.0 + 0.004 * at) * ORANGE + rng.normal(0, 2e-4, NM.size) for at in range(8)])
    assert any("L*" in words for words in drifting.drifts)
    scattered = of_batch(noisy(rng, ORANGE, 8))
    assert scattered.drifts == () and scattered.per_sample is not None
    assert of_batch(noisy(rng, ORANGE, 4)).per_sample is None and of_batch([1.1 * ORANGE]) is None


def test_the_mean_of_a_batch_is_its_means():
    found = of_batch([0.98 * ORANGE, 1.02 * ORANGE])
    assert abs(found.mean[0]) < 0.01 and found.count == 2
    # The deviation of two readings is their distance over the root of two.
    labs = [sample("", share * ORANGE).lab("D65", "1964_10")[0] for share in (0.98, 1.02)]
    assert found.deviation[0] == pytest.approx((labs[1] - labs[0]) / np.sqrt(2.0))
