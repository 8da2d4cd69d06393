"""Packs keep within their bounds everywhere: what is broken is found, and spectra alone always bring it back."""

from types import SimpleNamespace

import numpy as np
import pytest
from metamer.materials.analytic import AshikhminShirley, Lambert
from metamer.materials.core.axes import Axis
from metamer.materials.core.directions import io_from_half_difference, spherical
from metamer.materials.factored.pack import FactorPack
from metamer.materials.fitting import bounds, refinement
from metamer.materials.fitting.bounded_spectra import within_bounds
from metamer.materials.fitting.bounds import LARGEST, LOWEST, Bounds
from metamer.materials.fitting.candidates import Candidate
from metamer.materials.fitting.fit import fit
from metamer.materials.fitting.visible_samples import seen_samples
from metamer.materials.formats.rgl import read_rgl
from metamer.materials.measured.rgl import RglBrdf
from metamer.spectral.palette import Palette
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

L = len(WORKING_WAVELENGTHS_NM)
GREY = Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.full(L, 0.3))
COAT = Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.full(L, 0.04))
IO = (Axis("theta_i", 33, 0.5 * np.pi), Axis("theta_o", 33, 0.5 * np.pi), Axis("phi", 17, np.pi))


@pytest.fixture(scope="module")
def glossy():
    return AshikhminShirley(GREY, COAT, 30.0, 30.0)


def with_a_dip(packs, depth, wavelength):
    """The packs and one term more: a dip of one cell's width, where light and view are both near the horizon."""
    factors = [np.zeros((axis.size, 1)) for axis in IO]
    for factor, node in zip(factors, (30, 29, 15), strict=True):
        factor[node] = 1.0
    spectrum = np.zeros((1, L))
    spectrum[0, wavelength] = -depth / np.pi
    return (*packs, FactorPack("io", IO, tuple(factors), Palette.of(spectrum)))


@pytest.mark.slow_cases("33", "80")
@pytest.mark.parametrize("wavelength", [0, 33, 80])
def test_a_dip_of_one_cell_at_one_wavelength_is_found(glossy, wavelength):
    packs, bounds = fit(glossy, pixels=32).fast.packs, Bounds.of(glossy)
    assert bounds.extremes(packs).within
    assert not len(bounds.violations(packs))
    dipped = with_a_dip(packs, 3.0, wavelength)
    found = bounds.extremes(dipped)
    node = [axis.nodes[index] for axis, index in zip(IO, (30, 29, 15), strict=True)]
    there = np.pi * sum(p.shade(spherical(node[0], 0.0), spherical(node[1], node[2])) for p in dipped)[wavelength]
    assert found.lowest <= 0.98 * there < LOWEST
    violations = bounds.violations(dipped)
    assert violations.low.all() and set(violations.wavelength.tolist()) == {wavelength}


def test_what_is_too_bright_is_found(glossy):
    packs, bounds = fit(glossy, pixels=32).fast.packs, Bounds(Lambert(COAT), np.full(L, 0.05))
    found = bounds.extremes(packs)
    violations = bounds.violations(packs)
    assert found.ratio > LARGEST and found.lowest >= LOWEST
    assert len(violations) and not violations.low.any()
    shaded = np.pi * sum(p.shade(violations.wi, violations.wo) for p in packs)
    assert found.ratio >= shaded.max() / 0.05 * (1.0 - 1e-9)


def test_spectra_alone_bring_any_packs_back(glossy):
    samples, bounds = seen_samples(glossy, 4000), Bounds.of(glossy)
    rng = np.random.default_rng(0)
    factors = tuple(rng.standard_normal((axis.size, 3)) for axis in IO)
    wild = (FactorPack("io", IO, factors, Palette.of(rng.standard_normal((3, L)))),)
    assert not bounds.extremes(wild).within
    tame, kept = within_bounds(wild, samples, bounds)
    assert kept and bounds.extremes(tame).within
    assert any(np.any(pack.palette.values[0]) for pack in tame)


def test_packs_within_their_bounds_stay_as_they_are(glossy):
    packs, bounds = fit(glossy, pixels=32).fast.packs, Bounds.of(glossy)
    same, kept = within_bounds(packs, seen_samples(glossy, 2000), bounds)
    assert kept and same is packs


@pytest.mark.parametrize("name", ["cc_iris_purple_gem_rgb", "vch_golden_yellow_rgb"])
def test_saturated_lacquers_are_no_darker_than_black(shared_data, name):
    """Their highlights lie outside sRGB: with the primaries' spectra taken off, they had -0.2 and -0.5 of white."""
    brdf = RglBrdf.from_measurement(read_rgl(shared_data / "brdf" / "rgl" / f"{name}.bsdf"))
    half, difference = np.meshgrid(np.linspace(0.0, 0.25, 40), np.linspace(0.0, 0.6, 40), indexing="ij")
    wi, wo = io_from_half_difference(half, difference, np.zeros_like(half))
    wi, wo = wi.reshape(-1, 3), wo.reshape(-1, 3)
    assert (brdf.eval_measured(wi, wo) < 0).any(axis=1).mean() > 0.05
    assert np.min(np.pi * brdf.eval(wi, wo) * wi[:, 2:]) > -0.01


def test_packs_that_are_within_all_bounds_as_they_come_draw_no_samples(monkeypatch):
    monkeypatch.setattr(refinement, "seen_samples", None)
    brdf = Lambert(GREY)
    packs = brdf.own_form().packs
    own = refinement.Refinement(brdf, None, None)
    assert own._enforced(Candidate("lobes", packs, None, 0.0, "")) == (packs, True)


@pytest.mark.parametrize("places", [3, 500, 40_000])
def test_the_worst_of_many_places_are_apart_and_in_their_order(places):
    """Many of the worst are in one place: looking at few of all finds what looking at all of them does."""
    rng = np.random.default_rng(places)
    angles = np.round(rng.uniform(0.0, 1.5, (places, 3)) * rng.integers(0, 2, (places, 1)), 3)
    excess = 1.0 / (1.0 + np.linalg.norm(angles, axis=1)) + rng.integers(0, 3, places)
    found = bounds._strongest(
        [(part, at) for part, at in zip(np.split(excess, [1]), np.split(angles, [1]), strict=True)]
    )
    order = np.argsort(-excess, kind="stable")
    _, first = np.unique(np.round(angles[order] / bounds._PLACE), axis=0, return_index=True)
    np.testing.assert_array_equal(found, angles[order[np.sort(first)[: bounds._DOWNHILL]]])


def test_more_terms_are_refined_on_more_pairs(glossy, monkeypatch):
    asked = []
    monkeypatch.setattr(refinement, "seen_samples", lambda brdf, count, seed: asked.append(count) or (count, seed))
    drawn = refinement.Refinement(glossy, SimpleNamespace(pixels=96), SimpleNamespace(seed=0))
    every = [drawn.samples(terms) for terms in (4, 16, 32, 40, 64)]
    assert asked[0] * 2 < asked[1] < asked[2] == asked[3] and len(asked) == 4
    # The same while the number of terms asks for no others; others of the same number then.
    assert every[2] is every[3] and every[4] != every[3]
    small = refinement.Refinement(glossy, SimpleNamespace(pixels=16), SimpleNamespace(seed=0))
    assert small.samples(4)[0] == small.samples(16)[0]
