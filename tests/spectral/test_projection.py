"""Projection from finer grids to the working one: the colour of the measurement, not that of every fifth sample."""

from pathlib import Path

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.formats.csv import read_csv_spectra
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.projection import projected, projection_matrix
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM as NM
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.wavelengths import common_wavelengths, interpolation_matrix, is_finer, material_wavelengths
from scipy.special import expit

LIGHTS = ("D65", "A", "FL2", "FL11", "LED-B3", "HP1")
EYE = observer("1931_2")
EVERY = np.arange(380.0, 801.0)
CHIPS = Path(__file__).resolve().parents[2] / "catalogs" / "shipped" / "spectra" / "munsell_nist_cqs9.csv"


def worst(fine_nm, fine, working, lights=LIGHTS):
    """Largest ΔE94 of each spectrum under these lights, (N,), against its integral over every sample."""
    found = np.zeros(len(fine))
    for name in lights:
        light = illuminant(name)
        truth, shown = fine @ EYE.weights(light, fine_nm).T, working @ EYE.weights(light, NM).T
        found = np.maximum(found, delta_e_xyz(truth, shown, EYE.white(light)))
    return found


@pytest.fixture(scope="module")
def chart():
    """1269 reflectances of paper chips every nanometre, with the noise of an instrument: about 0.1 % of white."""
    chips = np.stack([s.resampled(EVERY).samples for s in read_csv_spectra(CHIPS, "reflectance").values()])
    rng = np.random.default_rng(1943)
    pairs, share = rng.integers(len(chips), size=(2, 1269)), rng.random((1269, 1))
    mixed = (share * chips[pairs[0]] + (1 - share) * chips[pairs[1]]) * rng.uniform(0.15, 1.3, (1269, 1))
    return np.clip(mixed + rng.normal(scale=0.0012, size=mixed.shape), 0.0, 1.0)


def test_every_chip_measured_every_nanometre_keeps_its_colour(chart):
    errors = worst(EVERY, chart, projected(chart, EVERY, NM, 1.0))
    assert errors.max() < 0.03, errors.max()
    # Every fifth sample would not do.
    picked = worst(EVERY, chart, chart @ interpolation_matrix(EVERY, NM).T)
    assert picked.max() > 0.5 and np.mean(picked > 0.1) > 0.2


def edges(width_nm, count=60):
    """Dyes that let through what is longer or shorter than some wavelength; 10 to 90 % over `width_nm`."""
    rng = np.random.default_rng(7)
    at, sign = rng.uniform(420.0, 680.0, (count, 1)), rng.choice([-1.0, 1.0], (count, 1))
    return 0.03 + 0.9 * expit(sign * (EVERY - at) / (width_nm / 4.4))


@pytest.mark.parametrize(("width_nm", "most", "picked"), [(2.0, 1.0, 5.0), (5.0, 0.1, 1.0), (10.0, 0.025, 0.05)])
def test_steep_dyes_come_as_near_as_the_grid_allows(width_nm, most, picked):
    """Edges that 5 nm cannot hold: far nearer than every fifth sample, and what is left is known (`Lambert`)."""
    fine = edges(width_nm)
    found = projected(fine, EVERY, NM, 1.0)
    assert worst(EVERY, fine, found).max() < most
    assert worst(EVERY, fine, fine @ interpolation_matrix(EVERY, NM).T).max() > picked
    assert found.min() >= 0 and found.max() <= 1


def test_fringes_finer_than_the_grid_average_out():
    """Of a film whose fringes stand 4 nm apart, every fifth sample shows bands that are not there."""
    fringes = np.broadcast_to(0.4 + 0.3 * np.sin(2 * np.pi * EVERY / 4), (1, EVERY.size))
    assert worst(EVERY, fringes, fringes @ interpolation_matrix(EVERY, NM).T, ("FL11",)).max() > 5
    assert worst(EVERY, fringes, projected(fringes, EVERY, NM, 1.0)).max() < 0.1


def test_bounds_are_kept_by_the_nearest_spectrum_within_them_not_by_cutting():
    fine = edges(2.0)
    free = fine @ projection_matrix(EVERY, NM).T
    found = projected(fine, EVERY, NM, 1.0)
    over = (free < 0).any(axis=1)
    assert over.any() and (found[over].min(axis=1) == 0).all()
    np.testing.assert_allclose(found[~over & (free <= 1).all(axis=1)], free[~over & (free <= 1).all(axis=1)])
    cut = np.clip(free, 0.0, 1.0)
    assert worst(EVERY, fine[over], found[over]).mean() < 0.8 * worst(EVERY, fine[over], cut[over]).mean()


GRIDS = {
    "every nanometre": np.arange(360.0, 831.0),
    "half": np.arange(380.0, 780.5, 0.5),
    "two": np.arange(400.0, 701.0, 2.0),
    "four": np.arange(380.0, 781.0, 4.0),
    "a third of ten": np.arange(380.0, 731.0, 10.0 / 3.0),
    "just finer": np.arange(380.0, 785.0, 4.9),
    "pixels of a spectrometer": 340.0 + 690.0 * np.linspace(0.0, 1.0, 2048) ** 1.1,
    "partly": np.concatenate([np.arange(400.0, 500.0), np.arange(500.0, 701.0, 20.0)]),
    "far beyond": np.arange(200.0, 2501.0),
}


@pytest.mark.parametrize("name", GRIDS)
def test_any_finer_grid_is_well_conditioned_and_leaves_smooth_spectra_as_they_are(name):
    """Constants stay constant, errors of single samples do not grow, and where little was measured little is made."""
    grid = GRIDS[name]
    assert is_finer(grid)
    matrix = projection_matrix(grid, NM)
    np.testing.assert_allclose(matrix.sum(axis=1), 1.0, atol=1e-12)
    assert np.abs(matrix).sum(axis=1).max() < 3
    inside = (grid[0] + 15 <= NM) & (grid[-1] - 15 >= NM)
    smooth = 0.5 + 0.4 * np.sin(np.stack([grid, grid + 40, grid + 80]) / 60)
    expected = 0.5 + 0.4 * np.sin(np.stack([NM, NM + 40, NM + 80]) / 60)
    tolerance = 0.02 if name == "partly" else 2e-3
    np.testing.assert_allclose((smooth @ matrix.T)[:, inside], expected[:, inside], atol=tolerance)
    beyond = (grid[0] - 15 > NM) | (grid[-1] + 15 < NM)
    held = np.where(grid[0] > NM, smooth[:, :1], smooth[:, -1:])
    np.testing.assert_allclose((smooth @ matrix.T)[:, beyond], held[:, beyond], atol=tolerance)


@pytest.mark.parametrize("grid", [NM, np.arange(360.0, 831.0, 5.0), np.arange(400.0, 701.0, 10.0), NM[::3] + 1.0])
def test_grids_that_are_no_finer_are_interpolated_as_before(grid):
    assert not is_finer(grid)
    np.testing.assert_array_equal(projection_matrix(grid, NM), interpolation_matrix(grid, NM))
    spectrum = Spectrum.sampled(grid, 0.5 + 0.4 * np.sin(grid / 30))
    np.testing.assert_array_equal(spectrum.projected(NM).samples, spectrum.resampled(NM).samples)


def test_the_quantity_sets_the_bounds_and_lamps_are_never_thinned():
    step = np.where(EVERY < 551, 0.0, 1.0)
    for quantity in ("reflectance", "transmittance"):
        found = Spectrum.sampled(EVERY, step, quantity).projected(NM)
        assert found.quantity == quantity and found.samples.min() == 0 and found.samples.max() == 1
    above = Spectrum.sampled(EVERY, step, "radiance factor").projected(NM).samples
    assert above.min() == 0 and above.max() > 1
    with pytest.raises(InputError, match="lamps are not thinned"):
        Spectrum.sampled(EVERY, step, "emission").projected(NM)


def test_samples_closer_than_the_observer_is_tabulated_all_count():
    """A comb of 0.2 nm that happens to be dark at every whole nanometre is a grey, not a black."""
    fine = 380.0 + 0.1 * np.arange(4001)
    comb = np.where(np.arange(4001) % 5 == 0, 0.0, 0.5)
    for name in ("D65", "FL11"):
        light = illuminant(name)
        white = EYE.weights(light, fine) @ np.ones(fine.size)
        np.testing.assert_allclose(white, EYE.white(light), rtol=1e-12)
        np.testing.assert_allclose(EYE.weights(light, fine) @ comb, 0.4 * white, rtol=1e-3)


def test_a_material_keeps_the_grid_of_its_finest_spectrum_as_far_as_it_is_seen():
    uneven = np.array([380.0, 400.0, 470.0, 700.0])
    assert material_wavelengths([]) is NM
    assert material_wavelengths([np.arange(400.0, 701.0, 10.0), uneven]) is NM
    every = np.arange(200.0, 2501.0)
    kept = material_wavelengths([every])
    assert kept[0] < 360 and kept[-1] > 830 and kept.size < 480 and np.isin(kept, every).all()
    np.testing.assert_array_equal(material_wavelengths([EVERY, uneven]), EVERY)
    both = material_wavelengths([np.arange(400.0, 701.0, 0.5), uneven])
    assert np.isin(np.arange(400.0, 701.0, 0.5), both).all() and both[0] == 380


def test_a_common_grid_has_every_sample_of_the_uniform_one_or_every_nanometre():
    ten, five = np.arange(400.0, 701.0, 10.0), np.arange(380.0, 781.0, 5.0)
    assert common_wavelengths([ten, ten]) is ten and common_wavelengths([ten, five]) is five
    np.testing.assert_array_equal(common_wavelengths([ten, ten[:-3] + 2.5]), np.arange(400.0, 701.0))
