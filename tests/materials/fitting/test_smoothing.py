"""Moving averages of factors."""

import numpy as np
from metamer.materials.core.axes import Axis
from metamer.materials.factored.pack import FactorPack
from metamer.materials.fitting.lobe_table import smoothed, smoothed_pack
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.palette import Palette


def test_constants_are_kept_and_a_turn_is_wrapped():
    np.testing.assert_allclose(smoothed(np.full((9, 2), 3.0)), 3.0)
    turn = np.arange(9.0)[:, None] % 8
    np.testing.assert_allclose(smoothed(turn, periodic=True)[[0, -1]], 3.0)


def test_a_ripple_of_four_nodes_vanishes_and_a_ramp_stays():
    ripple = np.cos(0.5 * np.pi * np.arange(20.0))[:, None]
    np.testing.assert_allclose(smoothed(ripple)[2:-2], 0.0, atol=1e-12)
    ramp = np.arange(20.0)[:, None]
    np.testing.assert_allclose(smoothed(ramp)[2:-2], ramp[2:-2])


def test_a_pack_is_smoothed_over_its_angles_only():
    axes = (Axis("theta_i", 9, 1.5), Axis("theta_o", 8, 1.5), Axis("phi", 7, np.pi))
    generator = np.random.default_rng(0)
    factors = tuple(generator.random((axis.size, 3)) for axis in axes)
    basis = SpectralBasis.sampled()
    pack = FactorPack("io", axes, factors, Palette.of(generator.random((3, basis.size)), basis))
    found = smoothed_pack(pack)
    np.testing.assert_array_equal(found.palette.values, pack.palette.values)
    for before, after in zip(pack.factors, found.factors, strict=True):
        assert np.abs(np.diff(after, axis=0)).sum() < np.abs(np.diff(before, axis=0)).sum()
