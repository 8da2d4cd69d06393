"""Spectra: what may stand in them, and resampling."""

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

GRID = np.arange(400.0, 701.0, 10.0)


def flat(value, quantity="reflectance"):
    return Spectrum.sampled(GRID, np.full(GRID.size, value), quantity)


@pytest.mark.parametrize(
    ("value", "quantity", "message"),
    [
        (np.nan, "reflectance", "reflectance is not a number"),
        (np.inf, "emission", "emission is not a number"),
        (-0.01, "reflectance", "negative reflectance"),
        (-1.0, "emission", "negative emission"),
        (18.0, "reflectance", "looks like percent"),
        (92.0, "transmittance", "transmittance looks like percent"),
        (1.02, "reflectance", "reflectance above 1"),
        (np.nan, "radiance factor", "radiance factor is not a number"),
    ],
)
def test_impossible_values_are_named_with_their_wavelength(value, quantity, message):
    values = np.full(GRID.size, 0.5)
    values[3] = value
    with pytest.raises(InputError, match=message) as caught:
        Spectrum.sampled(GRID, values, quantity)
    assert "430 nm" in str(caught.value)


def test_emission_may_exceed_one():
    assert flat(1e4, "emission").samples.max() == 1e4


def test_radiance_factor_may_exceed_one_and_is_never_negative():
    assert flat(3.5, "radiance factor").samples.max() == 3.5
    with pytest.raises(InputError, match="negative radiance factor"):
        flat(-0.01, "radiance factor")


def test_resampling_a_radiance_factor_above_one_stays_smooth():
    """Sprague, as reflectance has it; the bound at 1 is not there, the one at 0 is."""
    fine = np.arange(400.0, 701.0)
    values = 1.5 + 0.9 * np.sin(GRID / 40)
    smooth = Spectrum.sampled(GRID, values, "radiance factor").resampled(fine).samples
    half = Spectrum.sampled(GRID, values / 3.0).resampled(fine).samples
    np.testing.assert_allclose(smooth, 3.0 * half, atol=1e-12)
    step = np.where(GRID < 550, 0.0, 2.0)
    edge = Spectrum.sampled(GRID, step, "radiance factor").resampled(fine).samples
    np.testing.assert_allclose(edge, np.interp(fine, GRID, step), atol=1e-12)


def test_unknown_quantity():
    with pytest.raises(InputError, match="unknown quantity"):
        # The annotation refuses it first while shapes are checked; users of the installed package meet this message.
        Spectrum.__post_init__(_bare(quantity="radiosity"))


def _bare(quantity):
    found = object.__new__(Spectrum)
    for field, value in (("samples", np.zeros(2)), ("wavelengths_nm", GRID[:2]), ("quantity", quantity)):
        object.__setattr__(found, field, value)
    return found


def test_values_that_do_not_fit_the_axis():
    with pytest.raises(InputError, match="do not fit the wavelengths"):
        Spectrum.sampled(GRID, np.zeros(GRID.size - 1))


def test_resampling_a_smooth_reflectance_follows_sprague(colour):
    values = 0.5 + 0.3 * np.sin(GRID / 40)
    fine = np.arange(400.0, 701.0)
    oracle = colour.SpragueInterpolator(GRID, values)(fine)
    np.testing.assert_allclose(Spectrum.sampled(GRID, values).resampled(fine).samples, oracle, atol=1e-12)


def test_resampling_next_to_a_step_stays_between_0_and_1():
    """Sprague rings at a steep edge; that spectrum alone falls back to linear."""
    step = np.where(GRID < 550, 0.0, 1.0)
    smooth = 0.5 + 0.3 * np.sin(GRID / 40)
    fine = np.arange(400.0, 701.0)
    both = Spectrum.sampled(GRID, np.array([step, smooth])).resampled(fine).samples
    np.testing.assert_allclose(both[0], np.interp(fine, GRID, step), atol=1e-12)
    assert np.abs(both[1] - np.interp(fine, GRID, smooth)).max() > 1e-4


def test_resampling_a_line_spectrum_never_rings_below_zero():
    line = np.zeros(GRID.size)
    line[15] = 1.0
    fine = Spectrum.sampled(GRID, line, "emission").resampled(np.arange(400.0, 701.0)).samples
    assert fine.min() == 0.0 and fine.max() == 1.0


def test_resampling_onto_its_own_grid_is_the_same_object():
    grey = flat(0.5)
    assert grey.resampled(GRID.copy()) is grey


@pytest.mark.parametrize(("policy", "end"), [("hold", 0.5), ("zero", 0.0)])
def test_extrapolation_does_what_it_says(policy, end):
    found = flat(0.5).resampled(WORKING_WAVELENGTHS_NM, policy).samples
    assert found[[0, -1]] == pytest.approx([end, end], rel=1e-14)
    assert found[40] == pytest.approx(0.5)


def test_extrapolation_as_an_error():
    with pytest.raises(InputError, match="beyond the measured range"):
        flat(0.5).resampled(WORKING_WAVELENGTHS_NM, "error")


def test_range_note_says_what_was_invented():
    assert flat(0.5).range_note(GRID[3:5]) is None
    assert flat(0.5).range_note(WORKING_WAVELENGTHS_NM) == (
        "known from 400 to 700 nm; from 380 to 780 nm, its end values are repeated"
    )
    assert "taken as zero" in flat(0.5).range_note(WORKING_WAVELENGTHS_NM, "zero")


def test_batch_axes_go_through():
    image = Spectrum.sampled(GRID, np.full((2, 3, GRID.size), 0.25))
    assert image.resampled(WORKING_WAVELENGTHS_NM).samples.shape == (2, 3, 81)
