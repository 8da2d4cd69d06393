"""Any surface as light between parts meets it."""

import numpy as np
import pytest
from metamer.benchmarks.papers.transfer_tensors.families import cook_torrance
from metamer.benchmarks.papers.transfer_tensors.parametric import Tuned
from metamer.lighting.transfer.cells import HemisphereCells
from metamer.lighting.transfer.reflection import Reflection
from metamer.materials.analytic.cook_torrance import CookTorrance
from metamer.materials.analytic.lambert import Lambert
from metamer.materials.core.points import Points
from metamer.materials.factored.pack import FactoredBrdf
from metamer.materials.fitting.fit import fit
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

CELLS = HemisphereCells(8)
RED = np.interp(NM, [380, 560, 620, 780], [0.04, 0.08, 0.75, 0.8])
TUNED = Tuned(NM, 0.2 * RED, np.ones(len(NM)), cook_torrance(), (0.3, 0.3))


@pytest.fixture(scope="module")
def tuned():
    return Reflection.of(TUNED, CELLS)


def evenly(count, seed):
    u, v = np.random.default_rng(seed).random((2, count))
    radius, turn = np.sqrt(u), 2.0 * np.pi * v
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1.0 - u)], axis=1)


def test_a_matt_surface_has_no_terms():
    found = Reflection.of(Lambert(Spectrum.sampled(NM, RED)), CELLS)
    assert found.is_matt
    np.testing.assert_allclose(found.matt, RED, rtol=1e-12)
    np.testing.assert_allclose(found.albedo, RED, rtol=1e-12)


def test_terms_and_matt_are_the_surface(tuned):
    wi, wo = evenly(500, 0), evenly(500, 1)
    np.testing.assert_allclose(tuned.matt, 0.2 * RED, rtol=1e-12)
    found = tuned.scalars(wi, wo) @ tuned.spectra + tuned.matt / np.pi
    np.testing.assert_allclose(found, TUNED.at(Points(wi, wo)), rtol=1e-12)


def test_the_table_has_the_energy_of_the_surface(tuned):
    drawn = np.pi * TUNED.at(Points(evenly(200_000, 2), evenly(200_000, 3))).mean(axis=0)
    np.testing.assert_allclose(tuned.albedo, drawn, rtol=0.03)


def test_the_table_is_what_cells_see(tuned):
    """Of one pair of cells, and of one that a turn by right angles has made."""
    for out, into in ((36, 27), (9, 50), (54, 13)):
        u = np.random.default_rng(4).random((2, 20_000, 2))
        wo, wi = (CELLS.within(np.full(20_000, cell), places) for cell, places in ((out, u[0]), (into, u[1])))
        assert tuned.table[0, out, into] == pytest.approx(tuned.scalars(wi, wo).mean(), rel=0.4)


def test_a_highlight_in_even_light_is_right_with_few_rays(tuned):
    """Whatever rays happen to meet, and however few of them."""
    for cosine in (0.3, 0.7, 0.95):
        wo = np.array([np.sqrt(1.0 - cosine**2), 0.0, cosine])
        wi = evenly(400_000, 5)
        truth = np.pi * tuned.scalars(wi, np.broadcast_to(wo, wi.shape)).mean()
        few = tuned.scalars(wi[:128], np.broadcast_to(wo, (128, 3)))[None]
        found = np.pi * few.mean() * tuned.correction(few, np.array([cosine]))[0, 0]
        assert found == pytest.approx(truth, rel=0.03)


def test_a_correction_is_bounded(tuned):
    """Rays that all miss say nothing."""
    assert tuned.correction(np.zeros((1, 16, 1)), np.array([0.5])) == 1.0
    assert tuned.correction(np.full((1, 16, 1), 1e-6), np.array([0.5])) == 2.0


def test_a_surface_that_is_not_taken_apart_has_a_term_a_wavelength():
    metal = CookTorrance(Spectrum.sampled(NM, RED), np.full(len(NM), 1.5), np.full(len(NM), 3.0), 0.3, 1.0)
    found = Reflection.of(metal, HemisphereCells(4))
    wi, wo = evenly(50, 6), evenly(50, 7)
    np.testing.assert_allclose(found.scalars(wi, wo) @ found.spectra, metal.at(Points(wi, wo)), rtol=1e-12)


def test_packs_are_terms(packs):
    found = Reflection.of(packs, CELLS)
    wi, wo = evenly(500, 8), evenly(500, 9)
    ours = found.scalars(wi, wo) @ found.spectra + found.matt / np.pi
    np.testing.assert_allclose(ours, packs.at(Points(wi, wo)), rtol=1e-6, atol=1e-9)
    assert len(found.spectra) <= packs.rank


@pytest.fixture(scope="module")
def packs() -> FactoredBrdf:
    return fit(TUNED, ranks=(4,), method="refitted", pixels=24).fast
