"""Spectra from RGB: the colour that comes back, the published methods, and scales without end."""

import warnings

import numpy as np
import pytest
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.upsampling import METHODS, upsampling, xyz_from_rgb
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

CUBE = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 9)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)[1:]
# ΔE94 under D65 of the colour that comes back: the sigmoids are solved, the printed tables have four digits, and the
# seven spectra of Smits were never meant to close.
ROUND_TRIP = {"mallett-yuksel": 0.02, "jakob-hanika": 1e-6, "smits": 5.5}


@pytest.mark.parametrize("method", METHODS)
def test_the_colour_comes_back_under_d65(method):
    weights = observer("1931_2").weights(illuminant("D65"), NM)
    back = upsampling(method).spectra(CUBE) @ weights.T
    difference = delta_e_xyz(CUBE @ xyz_from_rgb().T, back, weights.sum(axis=1))
    worst = int(difference.argmax())
    assert difference[worst] <= ROUND_TRIP[method], (CUBE[worst], difference[worst])


@pytest.mark.parametrize("method", METHODS)
def test_grey_is_flat_and_black_is_black(method):
    spectra = upsampling(method).spectra(np.array([[0.3, 0.3, 0.3], [0.0, 0.0, 0.0]]))
    np.testing.assert_allclose(spectra[0], 0.3, rtol=1e-3)
    assert np.all(spectra[1] == 0)


@pytest.mark.parametrize("method", METHODS)
def test_spectra_are_never_negative_and_do_not_depend_on_the_scale(method):
    spectra = upsampling(method).spectra(CUBE)
    assert spectra.min() >= 0
    # A highlight a million times as bright, and a reading near the detector's noise.
    for scale in (1e6, 1e-9):
        np.testing.assert_allclose(upsampling(method).spectra(scale * CUBE), scale * spectra, rtol=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_spectra_are_continuous_in_rgb(method):
    path = np.linspace([0.9, 0.05, 0.0], [0.0, 0.4, 0.8], 4001)
    steps = np.abs(np.diff(upsampling(method).spectra(path), axis=0)).max(axis=1)
    assert steps.max() < 4e-3, (path[steps.argmax()], steps.max())


def test_batch_shapes_are_kept():
    rgb = np.random.default_rng(0).random((4, 5, 3))
    for method in METHODS:
        spectra = upsampling(method).spectra(rgb)
        assert spectra.shape == (4, 5, len(NM))
        np.testing.assert_allclose(spectra[2, 3], upsampling(method).spectra(rgb[2, 3]), atol=1e-15)


COLOURS = [(0.4, 0.1, 0.05), (0.1, 0.4, 0.2), (0.1, 0.2, 0.45), (0.5, 0.5, 0.1), (0.2, 0.5, 0.5), (0.5, 0.1, 0.4)]


@pytest.mark.parametrize("rgb", COLOURS)
def test_the_linear_methods_are_those_of_colour_science(rgb):
    from metamer.spectral.colour_library import colour_science

    recovery = colour_science().recovery
    published = {
        "mallett-yuksel": recovery.RGB_to_sd_Mallett2019,
        "smits": recovery.RGB_to_sd_Smits1999,
    }
    for method, function in published.items():
        theirs = function(np.array(rgb))
        ours = np.interp(theirs.wavelengths, NM, upsampling(method).spectra(np.array(rgb)))
        # Their ten samples lie between ours, where two straight lines meet.
        np.testing.assert_allclose(ours, theirs.values, atol=1e-12 if method == "mallett-yuksel" else 0.02)


@pytest.mark.parametrize("rgb", COLOURS[:3])
def test_sigmoids_are_those_of_colour_science(rgb):
    from metamer.spectral.colour_library import colour_science

    level = 0.5 * np.array(rgb) / max(rgb)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        theirs = colour_science().recovery.XYZ_to_sd_Jakob2019(xyz_from_rgb() @ level)
    ours = upsampling("jakob-hanika").spectra(level)
    difference = np.abs(ours - np.interp(NM, theirs.wavelengths, theirs.values))
    # Theirs stops at a just noticeable difference, ours blends the spectra of the nearest chromaticities.
    assert difference.max() < 0.03, (NM[difference.argmax()], difference.max())


def test_white_of_the_matrix_is_the_perfect_diffuser():
    white = observer("1931_2").weights(illuminant("D65"), NM).sum(axis=1)
    np.testing.assert_allclose(xyz_from_rgb().sum(axis=1), white, rtol=1e-12)


@pytest.mark.parametrize("bad", [-1.0, -1e-12, np.nan, np.inf])
def test_what_no_reflectance_has_is_refused(bad):
    rgb = np.full((2, 3), 0.5)
    rgb[1, 2] = bad
    with pytest.raises(InputError, match=r"rgb\[1\]"):
        upsampling("smits").spectra(rgb)


def test_an_unknown_method_is_named_with_its_neighbours():
    with pytest.raises(UnknownNameError, match="smits"):
        upsampling("smit")


@pytest.mark.parametrize("method", METHODS)
def test_provenance_says_that_spectra_are_made_up(method):
    assert upsampling(method).provenance == f"uplifted({method})"


@pytest.mark.parametrize("method", METHODS)
def test_colours_fold_before_they_are_mixed_as_their_spectra_do_after(method):
    rgb, weights = np.random.default_rng(3).random((200, 3)) ** 3 * 4.0, np.random.default_rng(4).random((81, 6))
    make = upsampling(method)
    np.testing.assert_allclose(make.folded(rgb, weights), make.spectra(rgb) @ weights, rtol=1e-12)
    with pytest.raises(InputError, match="no reflectance"):
        make.folded(np.array([[0.1, -0.2, 0.3]]), weights)
