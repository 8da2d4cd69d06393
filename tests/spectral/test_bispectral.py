"""Donaldson matrices: what they refuse, how they fold with lights, and a slow twin of the folding."""

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.bispectral import Bispectral, band_widths, fluorophore
from metamer.spectral.folding import Folding
from metamer.spectral.formats.spectral_exr import read_spectral_exr
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.palette import DonaldsonPalette
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

EYE = observer("1931_2")
LIGHTS = ("D65", "A", "E", "FL2", "FL11")
NM = np.arange(300.0, 781.0, 10.0)
GREY = Spectrum.sampled(NM, np.full(NM.size, 0.3))


def bump(centre, width, grid=NM):
    return np.exp(-(((grid - centre) / width) ** 2))


def brightener():
    """Absorbs below 400 nm only, shines near 440 nm."""
    return fluorophore(GREY, np.where(NM < 395, 0.6 * bump(350, 40), 0.0), bump(440, 25), 0.8)


def dye():
    """Absorbs green, shines orange."""
    return fluorophore(GREY, 0.6 * bump(500, 40), bump(590, 25), 0.9)


def without_ultraviolet(name, below_nm=400.0):
    light = illuminant(name)
    grid = np.arange(light.wavelengths_nm[0], light.wavelengths_nm[-1] + 0.5)
    power = light.resampled(grid).samples
    return Spectrum.sampled(grid, np.where(grid <= below_nm, 0.0, power), "emission")


def line(centre_nm, background=0.0):
    """A line 1 nm wide at half its height, of area 1, beside enough equal energy to be seen by."""
    grid = np.arange(300.0, 831.0)
    return Spectrum.sampled(grid, np.where(grid == centre_nm, 1.0, 0.0) + background, "emission")


def refusal(*arguments):
    with pytest.raises(InputError) as caught:
        Bispectral(*arguments)
    return str(caught.value)


# Physics.


@pytest.mark.parametrize("light", LIGHTS)
def test_a_diagonal_matrix_is_the_ordinary_reflectance_exactly(chart, light):
    weights = EYE.weights(illuminant(light), WORKING_WAVELENGTHS_NM)
    for patch in chart.reflectances:
        surface = Bispectral.diagonal(Spectrum.sampled(WORKING_WAVELENGTHS_NM, patch))
        np.testing.assert_array_equal(surface.fold(illuminant(light), EYE), weights @ patch)
        assert not surface.reradiation.any()
    np.testing.assert_array_equal(surface.on(WORKING_WAVELENGTHS_NM), np.diag(patch))


def test_a_light_without_ultraviolet_removes_the_emission_of_a_brightener():
    surface, light = brightener(), without_ultraviolet("D65")
    np.testing.assert_allclose(surface.fold_emission(light, EYE), 0.0, atol=1e-15)
    np.testing.assert_allclose(surface.fold(light, EYE), surface.without_emission().fold(light, EYE), atol=1e-15)
    lamps = {name: illuminant(name) for name in ("A", "D65")}
    blue = {name: surface.fold_emission(lamp, EYE)[2] / EYE.white(lamp)[2] for name, lamp in lamps.items()}
    assert blue["D65"] > 0.1 and blue["A"] < 0.5 * blue["D65"], blue


def test_more_photons_come_back_than_the_yield_never():
    surface = dye()
    photons = surface.photon_yield - 0.3
    np.testing.assert_allclose(photons[20], 0.9 * 0.6, rtol=1e-12)  # at 500 nm, where all of the emission is longer
    assert (photons <= 0.9 * 0.6 + 1e-12).all()
    assert (surface.power_yield <= surface.photon_yield + 1e-12).all(), "each photon loses energy on its way"
    assert surface.power_yield.max() < 1


def test_total_radiance_factor_may_exceed_one_while_power_does_not():
    """A white that shines: Y above the perfect diffuser, under a light that is mostly absorbed and shifted."""
    base, taken = np.where(NM < 450, 0.05, 0.9), np.where(NM < 450, 0.9 * bump(400, 60), 0.0)
    strong = fluorophore(Spectrum.sampled(NM, base), taken, bump(555, 30), 0.95)
    assert strong.power_yield.max() <= 1
    violet = Spectrum.sampled(NM, bump(400, 15) + 0.01, "emission")
    assert strong.fold(violet, EYE)[1] > 1


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("make", [dye, brightener])
def test_fold_is_the_plain_double_sum_at_a_tenth_of_a_nanometre(light, make):
    """The slow twin: every pair of wavelengths, the kernel per nm read off by hand."""
    surface, lamp = make(), illuminant(light)
    step = 0.1
    into, out = np.arange(295.0 + step / 2, 785.0, step), np.arange(360.0, 780.1, 1.0)
    power = np.interp(into, lamp.wavelengths_nm, lamp.samples)
    # Between samples the kernel is linear both ways.
    columns = np.stack([np.interp(into, NM, row) for row in surface.reradiation / 10.0])
    radiance_at_samples = (columns * power).sum(axis=1) * step
    radiance = np.interp(out, NM, radiance_at_samples)
    cmfs = np.stack([np.interp(out, EYE.wavelengths_nm, c) for c in EYE.cmfs.T], axis=1)
    fine = np.arange(360.0, 830.1, 1.0)
    luminous = np.trapezoid(np.interp(fine, lamp.wavelengths_nm, lamp.samples) * EYE.cmfs[:, 1], fine)
    expected = np.trapezoid(radiance[:, None] * cmfs, out, axis=0) / luminous
    np.testing.assert_allclose(surface.fold_emission(lamp, EYE), expected, rtol=2e-4)


@pytest.mark.parametrize("light", LIGHTS)
def test_fold_is_the_radiance_seen(light):
    surface, lamp, fine = dye(), illuminant(light), EYE.wavelengths_nm
    seen = np.trapezoid(surface.radiance(lamp, fine)[:, None] * EYE.cmfs, fine, axis=0) / EYE.luminous(lamp)
    np.testing.assert_allclose(seen, surface.fold(lamp, EYE), rtol=1e-6)


def test_scale_of_the_light_does_not_matter():
    lamp = illuminant("FL11")
    strong = Spectrum.sampled(lamp.wavelengths_nm, 1e6 * lamp.samples, "emission")
    np.testing.assert_allclose(dye().fold(strong, EYE), dye().fold(lamp, EYE), rtol=1e-12)


def test_photons_become_power_at_the_door():
    photons = np.array([[0.0, 0.0], [0.5, 0.0]])
    found = Bispectral.from_photons(np.array([400.0, 800.0]), np.array([400.0, 800.0]), photons)
    np.testing.assert_allclose(found.matrix, [[0, 0], [0.25, 0]])
    np.testing.assert_allclose(found.photon_yield, [0.5, 0])
    np.testing.assert_allclose(found.power_yield, [0.25, 0])


# Grids.


def test_on_its_own_grid_the_matrix_is_itself():
    np.testing.assert_array_equal(dye().on(NM), dye().matrix)


@pytest.mark.parametrize("step", [0.5, 1.0, 2.0, 5.0])
def test_on_a_finer_grid_the_same_light_leaves(step):
    surface, grid = dye(), np.arange(290.0, 790.0 + step, step)
    for light in (np.ones(grid.size), grid / 500.0):
        spectrum = Spectrum.sampled(grid, light, "emission")
        np.testing.assert_allclose(surface.on(grid) @ light, surface.radiance(spectrum, grid), rtol=2e-3, atol=1e-12)
    np.testing.assert_allclose((surface.on(grid) - np.diag(np.diag(surface.on(grid)))).min(), 0.0, atol=1e-15)


def test_excitation_of_equal_energy_is_one_in_every_band():
    np.testing.assert_allclose(dye().excitation(illuminant("E")), 100.0, rtol=1e-12)


def test_power_of_a_light_is_shared_out_among_the_bands_whole():
    """Whatever lies between the outer edges is counted once, on uneven bands too."""
    uneven = np.array([300.0, 320.0, 370.0, 380.0, 480.0, 500.0, 700.0, 780.0])
    surface = Bispectral.diagonal(Spectrum.sampled(uneven, np.full(8, 0.5)))
    lamp = line(437.0)
    np.testing.assert_allclose(surface.excitation(lamp) @ band_widths(uneven), 1.0, rtol=1e-12)


def test_ultraviolet_columns_without_rows_of_their_own():
    """Excited from 300 nm on, measured leaving from 380 nm on."""
    whole = brightener()
    partial = Bispectral(NM, NM[8:], whole.matrix[8:])
    assert partial.reflectance.wavelengths_nm[0] == 380
    np.testing.assert_allclose(partial.fold(illuminant("D65"), EYE), whole.fold(illuminant("D65"), EYE), rtol=1e-3)


# Hard cases.


def test_bands_in_which_the_light_has_no_power():
    """Radiance where the light is dark: no division by the light anywhere."""
    lamp = Spectrum.sampled(NM, np.where((NM >= 480) & (NM <= 520), 1.0, 0.0), "emission")
    xyz = dye().fold(lamp, EYE)
    sent = dye().radiance(lamp, NM)
    assert np.isfinite(xyz).all() and (xyz > 0).all()
    assert sent[NM == 590] > 0.05 and lamp.samples[NM == 590] == 0


@pytest.mark.parametrize("centre", [487.0, 500.0, 503.5])
def test_a_line_of_one_nanometre_excites_by_its_area(centre):
    surface = dye()
    lamp = Spectrum.sampled([300.0, centre - 1, centre, centre + 1, 830.0], [0, 0, 1.0, 0, 0], "emission")
    kernel = np.array([np.interp(centre, NM, row) for row in surface.reradiation]) / 10.0  # per nm
    np.testing.assert_allclose(surface.emission(lamp, NM), kernel, rtol=0.03, atol=1e-8)
    assert surface.fold(lamp, EYE)[0] > 1.05 * surface.without_emission().fold(lamp, EYE)[0]


def test_a_line_in_the_ultraviolet_beside_a_dim_lamp():
    surface = brightener()
    lit, dim = line(365.0, background=1e-4), line(365.0)
    assert surface.fold(lit, EYE)[2] > 10, "nearly all that is seen is fluorescence"
    with pytest.raises(InputError, match="zero power"):
        surface.fold(Spectrum.sampled([300.0, 364.0, 365.0, 366.0, 900.0], [0, 0, 0, 0, 0], "emission"), EYE)
    assert np.isfinite(surface.fold(dim, EYE)).all(), "an observer sees a little at 365 nm"


def test_black_that_shines_and_black_that_does_not():
    shifted = np.zeros((NM.size, NM.size))
    black = Bispectral(NM, NM, shifted)
    np.testing.assert_array_equal(black.fold(illuminant("D65"), EYE), 0.0)
    palette = DonaldsonPalette.of_surface(black)
    np.testing.assert_array_equal(palette.folded(Folding(EYE, [illuminant("D65")])), np.zeros((1, 1, 3)))
    shifted[24, 10] = 0.5
    assert (Bispectral(NM, NM, shifted).fold(illuminant("D65"), EYE) > 0).all()


def test_no_light_is_refused():
    with pytest.raises(InputError, match="not a light"):
        dye().excitation(GREY)
    with pytest.raises(InputError, match="not one reflectance"):
        Bispectral.diagonal(illuminant("D65"))


# Refusals


def test_refusals_name_place_and_value():
    good = dye().matrix
    for change, problem in (
        ((30, 10, -0.01), "negative"),
        ((30, 10, np.nan), "not a number"),
        ((10, 30, 0.05), "shorter wavelength"),
        ((10, 10, 1.2), "above 1"),
        ((40, 20, 0.9), "more power leaves than arrives"),
    ):
        broken = good.copy()
        broken[change[0], change[1]] = change[2]
        said = refusal(NM, NM, broken)
        assert problem in said and "found" in said, said
    assert "transpose" in refusal(NM, NM, good.T)


def test_noise_on_the_wrong_side_is_kept_as_measured():
    noisy = dye().matrix.copy()
    noisy[10, 30] = 5e-4
    assert Bispectral(NM, NM, noisy).reradiation[10, 30] == 5e-4


def test_wavelengths_that_do_not_fit():
    assert "rows are what leaves" in refusal(NM, NM, np.zeros((3, 3)))
    assert "no reflectance where light leaves" in refusal(NM, NM + 5.0, np.zeros((NM.size, NM.size)))
    assert "ascend" in refusal(NM[::-1], NM, np.zeros((NM.size, NM.size)))


# The palette of one surface.


def test_one_term_folds_like_the_surface_and_sends_out_the_same_radiance():
    surface = dye()
    palette, lamp = DonaldsonPalette.of_surface(surface), illuminant("FL2")
    np.testing.assert_array_equal(palette.folded(Folding(EYE, [lamp]))[0, 0], surface.fold(lamp, EYE))
    np.testing.assert_array_equal(palette.radiance(lamp, NM)[0, 0], surface.radiance(lamp, NM))
    np.testing.assert_array_equal(palette.samples[0, 0], surface.reflectance.samples)


# Real files.


def test_real_fluorescent_image_folds(shared_data):
    """A checker of a yellow and a pink sticky note: green and red light that no reflectance would send out."""
    image = read_spectral_exr(shared_data / "spectra" / "exr" / "BiSpectral.exr")
    light = illuminant("D65")
    found = {}
    for row, column in np.ndindex(16, 16):
        note = image.bispectral(row, column)
        found.setdefault(tuple(np.round(note.fold(light, EYE), 6)), note)
    assert len(found) == 2
    for note in found.values():
        # Band for band: taken per nm, ten times as many photons would leave and the file would be refused.
        assert note.photon_yield.min() > 0.3 and note.photon_yield.max() < 1
        assert (note.fold(light, EYE) > note.without_emission().fold(light, EYE)).all()


def test_real_chart_without_reradiation_is_diagonal(shared_data):
    image = read_spectral_exr(shared_data / "spectra" / "exr" / "Ohta1997.exr")
    surface = image.bispectral(1, 2)
    assert not surface.reradiation.any()
    np.testing.assert_array_equal(surface.reflectance.samples, image.spectrum.samples[1, 2])
