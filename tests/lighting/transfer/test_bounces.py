"""Light that is passed on until nothing is left."""

import numpy as np
import pytest
from metamer.lighting.transfer.bounces import interreflected
from metamer.lighting.transfer.edge_refinement import placed
from metamer.lighting.transfer.operator import irradiance_operator
from metamer.lighting.transfer.regions import Regions
from metamer.runtime.errors import InputError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

SAMPLED, SEEN = SpectralBasis.sampled(), observer("1931_2")
RED = np.interp(NM, [380, 560, 620, 780], [0.04, 0.08, 0.75, 0.8])
GREEN = np.interp(NM, [380, 480, 540, 600, 780], [0.05, 0.1, 0.6, 0.1, 0.08])
BLUE = np.interp(NM, [380, 480, 560, 780], [0.6, 0.65, 0.08, 0.05])


@pytest.fixture(scope="module")
def box(scene_of, room):
    """G of the room, and the side that each site belongs to."""
    hits = placed(scene_of(*room)).traced(128)
    side = np.full(len(hits.sites), -1)
    side[hits.corners] = hits.part[:, None]
    some = hits.backs >= 0
    side[hits.backs[some]] = np.broadcast_to(hits.part[:, None], hits.backs.shape)[some]
    # Sites outside of the room are of its sides' backs.
    return irradiance_operator(hits), side, hits.corners


def followed(operator, regions, lux, light="D65", **more):
    lamp = illuminant(light)
    fold = regions.basis.fold(lamp, SEEN)
    return interreflected(operator, regions, lux, [fold], SEEN.white(lamp), 1000.0, **more), fold


def test_a_closed_white_box_keeps_its_light(box):
    """All receive E and pass on rho of all: in the end each sends rho E / (1 - rho)."""
    operator, side, _ = box
    lux = np.where(np.asarray(operator.sum(axis=1)) > 0.5, 1000.0, 0.0)[:, None]
    regions = Regions(np.zeros(len(side), dtype=np.int64), np.full((1, 81), 0.8), SAMPLED)
    found, _ = followed(operator, regions, lux, enough=1e-3)
    inside = lux[:, 0] > 0.0
    np.testing.assert_allclose(found.all[inside], 1000.0 * 0.8 / 0.2, rtol=1e-3)
    assert found.bounces > 30


def test_what_is_left_is_below_what_is_said(box):
    operator, side, _ = box
    lux = np.random.default_rng(0).uniform(0.0, 3000.0, (len(side), 1))
    regions = Regions(side, np.stack([RED, GREEN, BLUE, RED, GREEN, BLUE]), SAMPLED)
    rough, fold = followed(operator, regions, lux, enough=0.5)
    fine, _ = followed(operator, regions, lux, enough=1e-4)
    seen = [one.all.reshape(len(side), -1) @ fold.T / 1000.0 for one in (fine, rough)]
    off = delta_e_xyz(*seen, SEEN.white(illuminant("D65"))).max()
    assert 0.0 < off <= 1.1 * rough.left <= 0.55
    assert (seen[0] - seen[1])[:, 1].max() <= rough.bound
    assert rough.bounces < fine.bounces


@pytest.mark.slow
def test_nearly_all_is_reflected(box):
    operator, side, _ = box
    lux = np.full((len(side), 1), 1000.0)
    regions = Regions(np.zeros(len(side), dtype=np.int64), np.full((1, 81), 0.97), SAMPLED)
    found, _ = followed(operator, regions, lux)
    inside = np.asarray(operator.sum(axis=1)).ravel() > 0.5
    np.testing.assert_allclose(found.all[inside], 1000.0 * 0.97 / 0.03, rtol=5e-3)
    with pytest.raises(InputError, match="does not end"):
        followed(operator, regions, lux, most=20)


def test_a_black_scene_needs_no_bounce(box):
    operator, side, _ = box
    regions = Regions(np.zeros(len(side), dtype=np.int64), np.zeros((1, 81)), SAMPLED)
    found, _ = followed(operator, regions, np.full((len(side), 1), 1000.0))
    assert (found.bounces, found.left, found.bound) == (0, 0.0, 0.0)
    assert not found.all.any()


def test_no_light_needs_no_bounce(box):
    operator, side, _ = box
    regions = Regions(np.zeros(len(side), dtype=np.int64), np.full((1, 81), 0.5), SAMPLED)
    assert followed(operator, regions, np.zeros((len(side), 1)))[0].bounces == 0


@pytest.mark.parametrize("value", [1.0, -0.1, np.nan])
def test_what_no_surface_reflects_is_refused(value):
    with pytest.raises(InputError, match="cannot"):
        Regions(np.zeros(3, dtype=np.int64), np.full((1, 81), value), SAMPLED)


def test_paths_of_regions_are_exact(box):
    """Uniform regions: two bounces are sums over paths of products of spectra, each worked out by itself."""
    operator, side, _ = box
    operator = operator.astype(np.float64)
    spectra = np.stack([RED, GREEN, BLUE])
    region = np.where(side < 0, 0, side % 3)
    regions = Regions(region, spectra, SAMPLED)
    lux = np.random.default_rng(1).uniform(0.0, 3000.0, (len(side), 1))
    now = regions.first(lux)
    total = now.copy()
    for _ in range(2):
        now = regions.reflected((operator @ now.reshape(len(now), -1)).reshape(now.shape))
        total += now
    fold = SAMPLED.fold(illuminant("A"), SEEN)
    by_paths = np.zeros((len(side), 3))
    of = [(region == number).astype(float) for number in range(3)]
    for last in range(3):
        by_paths += (of[last] * lux[:, 0])[:, None] * (fold @ spectra[last])
        for before in range(3):
            once = of[last] * (operator @ (of[before] * lux[:, 0]))
            by_paths += once[:, None] * (fold @ (spectra[last] * spectra[before]))
            for first in range(3):
                twice = of[last] * (operator @ (of[before] * (operator @ (of[first] * lux[:, 0]))))
                by_paths += twice[:, None] * (fold @ (spectra[last] * spectra[before] * spectra[first]))
    found = total[:, 0] @ fold.T
    assert np.abs(found - by_paths).max() / 1000.0 < 1e-12


@pytest.mark.parametrize("light", ["D65", "A", "FL11"])
def test_few_coefficients_travel_as_well(box, light):
    operator, side, _ = box
    spectra = np.stack([RED, GREEN, BLUE])
    region = np.where(side < 0, 0, side % 3)
    lux = np.random.default_rng(2).uniform(0.0, 3000.0, (len(side), 1))
    products = [spectra]
    for _ in range(3):
        products.append((products[-1][:, None] * spectra).reshape(-1, 81))
    weights = np.concatenate([SEEN.weights(illuminant(name), NM) for name in ("D65", "A", "FL11")]).T
    basis = SpectralBasis.balanced(np.concatenate(products), weights, 9)
    seen = []
    for one in (SAMPLED, basis):
        found, fold = followed(operator, Regions(region, spectra, one), lux, light, enough=1e-3)
        seen.append(found.all[:, 0] @ fold.T / 1000.0)
    assert delta_e_xyz(*seen, SEEN.white(illuminant(light))).max() < 0.1


def test_several_spectra_at_once_are_each_as_if_alone(box):
    operator, side, _ = box
    regions = Regions(np.where(side < 0, 0, side % 3), np.stack([RED, GREEN, BLUE]), SAMPLED)
    lux = np.random.default_rng(3).uniform(0.0, 3000.0, (len(side), 3))
    folds = [SAMPLED.fold(illuminant(name), SEEN) for name in ("D65", "A", "FL11")]
    white = SEEN.white(illuminant("D65"))
    together = interreflected(operator, regions, lux, folds, white, 1000.0, enough=1e-3)
    for number, fold in enumerate(folds):
        alone = interreflected(operator, regions, lux[:, number : number + 1], [fold], white, 1000.0, enough=1e-3)
        np.testing.assert_allclose(together.all[:, number], alone.all[:, 0], rtol=2e-3, atol=0.05)
