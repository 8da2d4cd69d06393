"""Light between fluorescent surfaces in J numbers, against the full matrices."""

import numpy as np
import pytest
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.bispectral import fluorophore
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.radiance_basis import radiance_basis, radiance_operators
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

EYE, NM = observer("1931_2"), np.arange(360.0, 831.0)
SAMPLES = np.arange(380.0, 781.0, 10.0)
SENSITIVITY = EYE.sensitivity(NM)


def bump(centre, width):
    return np.exp(-(((SAMPLES - centre) / width) ** 2))


@pytest.fixture(scope="module")
def surfaces(chart):
    """Three dyes and eight ordinary patches, (11,L,L)."""
    grey = Spectrum.sampled(SAMPLES, np.full(SAMPLES.size, 0.3))
    dyes = [
        fluorophore(grey, 0.6 * bump(centre, 40), bump(centre + shift, 25), 0.9)
        for centre, shift in ((400, 50), (450, 70), (520, 80))
    ]
    plain = Spectrum.sampled(WORKING_WAVELENGTHS_NM, chart.reflectances[12:20]).resampled(NM).samples
    return np.stack([dye.on(NM) for dye in dyes] + [np.diag(values) for values in plain])


@pytest.fixture(scope="module")
def lights():
    """(3,L) at Y = 1; the last is dark over half of the spectrum."""
    powers = [illuminant(name).resampled(NM).samples for name in ("D65", "A", "D65")]
    powers[2] = np.where(NM < 480, powers[2], 0.0)
    return np.stack([power / (SENSITIVITY[1] @ power) for power in powers])


def two_surfaces(basis, surfaces, lights):
    """ΔE94 of every pair of surfaces under every light; the first sees the light itself."""
    first = np.einsum("nlk,mk->mnl", surfaces, lights, optimize=True)
    truth = np.einsum("cl,plk,mnk->mnpc", SENSITIVITY, surfaces, first, optimize=True)
    operators = radiance_operators(basis, surfaces)
    seen = np.einsum("cj,pjk,mnk->mnpc", SENSITIVITY @ basis.synthesis, operators, basis.project(first), optimize=True)
    whites = lights @ SENSITIVITY.T
    return np.stack([delta_e_xyz(*pair) for pair in zip(truth, seen, whites, strict=True)])


def test_error_falls_with_size_and_beats_the_orthonormal_basis(surfaces, lights):
    full = radiance_basis(surfaces, lights, SENSITIVITY, NM)
    worst = {size: two_surfaces(full.truncated(size), surfaces, lights).max() for size in (4, 6, 8, 10, 12, 16)}
    first = np.einsum("nlk,mk->mnl", surfaces, lights, optimize=True).reshape(-1, NM.size)
    peercy = SpectralBasis.peercy(first, SENSITIVITY.T, 12, NM)
    assert worst[8] < 4.0 and worst[12] < 0.1 and worst[16] < 0.02, worst
    assert worst[16] < worst[10] < worst[6] < worst[4], worst
    assert two_surfaces(peercy, surfaces, lights).max() > 3 * worst[12]


def test_at_full_rank_the_matrices_are_exact(surfaces, lights):
    full = radiance_basis(surfaces, lights, SENSITIVITY, NM)
    assert two_surfaces(full, surfaces, lights).max() < 1e-6


def test_one_surface_alone_needs_three_numbers(surfaces, lights):
    """Seen directly nothing follows but the observer: the three rows of its sensitivity."""
    basis = radiance_basis(surfaces, lights, SENSITIVITY, NM, bounces=1)
    assert basis.size == 3
    sent = surfaces[1] @ lights[0]
    np.testing.assert_allclose(SENSITIVITY @ basis.synthesis @ basis.project(sent), SENSITIVITY @ sent, rtol=1e-9)


def test_a_light_that_is_dark_in_places_is_a_light_like_any_other(surfaces, lights):
    """Relative to the light the operator would be divided by zero; in radiance the dark costs nothing."""
    basis = radiance_basis(surfaces, lights, SENSITIVITY, NM, size=16)
    assert (lights[2] == 0).mean() > 0.5
    assert two_surfaces(basis, surfaces, lights)[2].max() < 0.05


def test_operators_of_ordinary_surfaces_are_the_plain_ones(surfaces, lights):
    basis = radiance_basis(surfaces, lights, SENSITIVITY, NM, size=8)
    np.testing.assert_allclose(
        radiance_operators(basis, surfaces)[5], basis.operator(np.diag(surfaces[5])), rtol=1e-9, atol=1e-12
    )


def test_the_same_input_gives_the_same_bits_when_paths_are_drawn(surfaces, lights):
    many = np.concatenate([surfaces] * 7)
    one, other = (radiance_basis(many, lights, SENSITIVITY, NM, size=8) for _ in range(2))
    np.testing.assert_array_equal(one.analysis, other.analysis)


def test_radiances_start_at_the_lights_own_resolution(surfaces):
    """A line of 1 nm comes in through `Bispectral.radiance`, not through the grid of the basis."""
    grey = Spectrum.sampled(SAMPLES, np.full(SAMPLES.size, 0.3))
    dye = fluorophore(grey, 0.6 * bump(450, 40), bump(520, 25), 0.9)
    line = Spectrum.sampled([360.0, 435.3, 435.8, 436.3, 830.0], [1e-3, 1e-3, 1.0, 1e-3, 1e-3], "emission")
    sent = dye.emission(line, NM)
    np.testing.assert_allclose(SENSITIVITY @ sent / EYE.luminous(line), dye.fold_emission(line, EYE), rtol=1e-9)


def test_black_surfaces_make_an_empty_basis(lights):
    basis = radiance_basis(np.zeros((2, NM.size, NM.size)), lights, SENSITIVITY, NM)
    assert basis.size == 1 and not basis.analysis.any()
