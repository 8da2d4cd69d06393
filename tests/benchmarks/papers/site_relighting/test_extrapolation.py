"""Limit that bounces tend to, out of few of them."""

import numpy as np
import pytest
from metamer.benchmarks.papers.site_relighting.extrapolation import settled
from metamer.lighting.transfer.bounces import interreflected
from metamer.lighting.transfer.coefficients import Coefficients
from metamer.lighting.transfer.edge_refinement import placed
from metamer.lighting.transfer.operator import ByPart, irradiance_operator
from metamer.lighting.transfer.regions import Regions
from metamer.runtime.errors import InputError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

SAMPLED, SEEN, LAMP = SpectralBasis.sampled(), observer("1931_2"), illuminant("D65")
WEIGHTS = [SEEN.weights(LAMP, NM)]
TO = Coefficients(SAMPLED, (LAMP,), SEEN, 1000.0)
COLOURS = np.stack([0.5 + 0.45 * np.sin(NM / 40.0 + turn) for turn in range(6)])


@pytest.fixture(scope="module")
def box(scene_of, room):
    """G of the room, the side that each site belongs to, and which are inside."""
    hits = placed(scene_of(*room)).traced(64)
    operator = irradiance_operator(hits)
    return operator, hits.part_of_site, np.asarray(operator.sum(axis=1)).ravel() > 0.5


def xyz(found):
    return found.all[:, 0] @ WEIGHTS[0].T / 1000.0


@pytest.mark.parametrize("enough", [1.0, 0.1, 0.01])
def test_what_is_left_is_below_what_is_said(box, enough):
    operator, side, _ = box
    regions = Regions(side, COLOURS, SAMPLED)
    first = regions.first(np.random.default_rng(1).uniform(0.0, 3000.0, (len(side), 1)))
    white = SEEN.white(LAMP)
    found = settled(operator, regions, first, TO.to_xyz, TO.most_y, white, enough)
    all_bounces = interreflected(
        operator, regions, np.random.default_rng(1).uniform(0.0, 3000.0, (len(side), 1)), WEIGHTS, white, 1000.0, 1e-6
    )
    assert found.left <= enough
    assert delta_e_xyz(xyz(all_bounces), xyz(found), white).max() <= enough
    assert np.abs(xyz(all_bounces) - xyz(found))[:, 1].max() <= found.bound
    assert found.bounces < 0.5 * all_bounces.bounces


def test_a_box_of_white_99_percent_takes_few(box):
    operator, side, inside = box
    regions = Regions(np.zeros(len(side), dtype=np.int64), np.full((1, 81), 0.99), SAMPLED)
    first = regions.first(np.where(inside, 1000.0, 0.0)[:, None])
    found = settled(operator, regions, first, TO.to_xyz, TO.most_y, SEEN.white(LAMP))
    np.testing.assert_allclose(found.all[inside], 99_000.0, rtol=5e-3)
    assert found.bounces <= 24


def test_single_precision_does_as_well(box):
    operator, side, _ = box
    regions = Regions(side, np.clip(COLOURS, 0.0, 0.9), SAMPLED)
    first = regions.first(np.random.default_rng(2).uniform(0.0, 3000.0, (len(side), 1)))
    one, other = (
        settled(operator, regions, first.astype(kind), TO.to_xyz, TO.most_y, SEEN.white(LAMP), 1e-3)
        for kind in (np.float64, np.float32)
    )
    assert delta_e_xyz(xyz(one), xyz(other), SEEN.white(LAMP)).max() <= 3e-3


def test_nothing_comes_of_nothing(box):
    operator, side, _ = box
    black = Regions(np.zeros(len(side), dtype=np.int64), np.zeros((1, 81)), SAMPLED)
    first = np.ones((len(side), 1, 81))
    for light in (first, 0.0 * first):
        found = settled(operator, black, light, TO.to_xyz, TO.most_y, SEEN.white(LAMP))
        assert (found.left, found.bound) == (0.0, 0.0)
        np.testing.assert_array_equal(found.all, light)


def test_light_that_does_not_end_is_refused(box):
    operator, side, _ = box
    regions = Regions(side, COLOURS, SAMPLED)
    first = np.random.default_rng(3).uniform(0.0, 3000.0, (len(side), 1, 81))
    with pytest.raises(InputError, match="does not end"):
        settled(operator, regions, first, TO.to_xyz, TO.most_y, SEEN.white(LAMP), 1e-9, most=4)


def test_what_comes_of_each_part_adds_up(box):
    operator, side, _ = box
    lux = np.random.default_rng(4).uniform(0.0, 3000.0, (len(side), 2))
    by_part = ByPart.of(operator, side)
    found = np.concatenate(by_part.irradiance(by_part.amounts(lux), [COLOURS, COLOURS]), axis=1)
    sent = lux[:, :, None] * COLOURS[side][:, None, :]
    np.testing.assert_allclose(found, operator @ sent.reshape(len(side), -1), rtol=1e-5, atol=1e-3)
