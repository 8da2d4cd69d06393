"""Half-precision storage: nothing overflows, and what it costs is measured."""

import dataclasses

import numpy as np
import pytest
from metamer.materials.analytic import AshikhminShirley, OrenNayar
from metamer.materials.core.directions import spherical
from metamer.materials.core.protocol import sphere_protocol
from metamer.materials.factored.pack import FactoredBrdf
from metamer.materials.fitting.fit import fit
from metamer.materials.fitting.half_precision import half_storage, rounded_to_half
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

L = len(WORKING_WAVELENGTHS_NM)
PIXELS = 48


def flat(value: float) -> Spectrum:
    return Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.full(L, value))


def p99_against(brdf):
    sphere = sphere_protocol(PIXELS)
    reference = sphere.reference(brdf)
    return lambda packs: sphere.compare(reference, sphere.sample(FactoredBrdf(packs))).p99


@pytest.mark.slow_cases("100.0", "10000.0")
@pytest.mark.parametrize("exponent", [1.0, 100.0, 10000.0, 100000.0])
def test_exponents_from_1_to_100000_do_not_overflow_and_cost_little(exponent):
    brdf = AshikhminShirley(flat(0.03), flat(0.04), exponent, exponent)
    found = fit(brdf, pixels=PIXELS, ranks=(1, 2, 4, 6))
    stored = half_storage(found.fast.packs, p99_against(brdf))
    assert stored.half, stored.reason
    assert stored.cost <= 0.1
    for pack in stored.packs:
        for factor in pack.factors:
            assert np.isfinite(factor.astype(np.float16)).all()
            np.testing.assert_array_equal(factor.astype(np.float16), factor)
            assert np.abs(factor).max() <= 1.0
    theta = np.radians([5.0, 20.0, 40.0])
    wi, wo = spherical(theta, 0.0), spherical(theta, np.pi)
    single, half = (FactoredBrdf(packs).eval(wi, wo) for packs in (found.fast.packs, stored.packs))
    np.testing.assert_allclose(half, single, rtol=0.01)


def test_a_cost_above_the_allowance_keeps_single_and_says_why():
    brdf = OrenNayar(flat(0.4), 0.35)
    packs = fit(brdf, pixels=PIXELS, ranks=(4,)).fast.packs
    stored = half_storage(packs, p99_against(brdf), allowed=-1.0)
    assert not stored.half
    assert stored.packs is packs
    assert "kept single" in stored.reason


def test_zero_terms_stay_zero_and_lengths_far_beyond_half_are_kept():
    (pack,) = fit(OrenNayar(flat(0.4), 0.35), pixels=PIXELS, ranks=(3,)).fast.packs
    first = pack.factors[0].copy()
    first[:, 1] = 0.0
    tall = dataclasses.replace(pack, factors=(first * 1e9, pack.factors[1] * 1e-9, *pack.factors[2:]))
    small = rounded_to_half(tall)
    assert not small.factors[0][:, 1].any()
    wi, wo = spherical(np.array([0.3, 1.2]), 0.0), spherical(np.array([0.7, 0.2]), 2.0)
    np.testing.assert_allclose(small.shade(wi, wo), tall.shade(wi, wo), rtol=5e-3, atol=1e-4)
