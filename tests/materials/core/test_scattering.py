"""Surfaces in an even and a glossy part, whose sum they are; and parts that fold light before they are evaluated."""

import numpy as np
import pytest
from metamer.materials.analytic import MODELS, AshikhminShirley, CoatedDiffuse, CookTorrance, Lambert, OrenNayar
from metamer.materials.analytic.cook_torrance import FoldedFresnel, fresnel
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.core.directions import spherical
from metamer.materials.core.points import Points
from metamer.materials.core.scattering import Scattering, sampling_key
from metamer.materials.svbrdf.texture import SpectralTexture
from metamer.spectral.bispectral import Bispectral
from metamer.spectral.folding import Folding
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

FOLDING = Folding(observer("1931_2"), [illuminant(name) for name in ("D65", "A", "FL11")])
EXAMPLES = [example for model in MODELS for example in model.examples(NM)]


def pairs(count=3000, seed=2):
    rng = np.random.default_rng(seed)
    found = rng.normal(size=(2, count, 3))
    # Some below the horizon, some that graze, and some about the mirrored direction.
    found[:, ::3, 2] *= 0.01
    found[0, ::5] = found[1, ::5] * [-1.0, -1.0, 1.0] + 0.02 * rng.normal(size=found[0, ::5].shape)
    return Points(*(found / np.linalg.norm(found, axis=2, keepdims=True)))


@pytest.mark.parametrize("surface", EXAMPLES)
def test_what_is_folded_before_it_is_evaluated_is_what_every_wavelength_comes_to(surface):
    points = pairs()
    for part in [surface, *(lobe.brdf for lobe in surface.lobes())]:
        expected = part.at(points) @ FOLDING.weights(part.wavelengths_nm)
        np.testing.assert_allclose(part.xyz(points, FOLDING), expected, rtol=3e-7, atol=1e-12)


@pytest.mark.parametrize("surface", EXAMPLES)
def test_the_even_and_the_glossy_part_are_the_whole(surface):
    points, scattering = pairs(), Scattering(surface)
    parts = [one for one in (scattering.even, scattering.glossy) if one is not None]
    assert parts
    expected = surface.xyz(points, FOLDING)
    np.testing.assert_allclose(sum(one.xyz(points, FOLDING) for one in parts), expected, rtol=1e-6, atol=1e-9)
    assert scattering.glossy is None or not scattering.glossy_sampler.even


def test_matt_surfaces_are_even_highlights_are_not():
    matt = [*Lambert.examples(NM), OrenNayar.examples(NM)[1]]
    matt.append(FluorescentLambert(Bispectral(NM, NM, np.diag(np.full(81, 0.2)))))
    assert all(Scattering(one).glossy is None for one in matt)
    metals = [one for one in CookTorrance.examples(NM) if one.specular_weight == 1.0 and one.roughness < 0.5]
    assert metals and all(Scattering(one).even is None for one in metals)
    gloss = Scattering(AshikhminShirley.examples(NM)[4])
    assert gloss.even is not None and gloss.glossy is not None


def test_a_texture_is_not_taken_apart_nor_taken_for_even():
    scattering = Scattering(SpectralTexture(NM, np.full((2, 2, 81), 0.4)))
    assert scattering.glossy is scattering.surface or scattering.even is scattering.surface


def test_where_an_index_gives_a_kink_every_wavelength_is_evaluated():
    eta, k = np.full(81, 0.3), np.zeros(81)
    weights = FOLDING.weights(NM)
    cos = np.linspace(0.01, 1.0, 777)
    found = FoldedFresnel(eta, k, weights)(cos**2, 1.0 - cos**2)
    np.testing.assert_allclose(found, fresnel(cos**2, 1.0 - cos**2, eta, k) @ weights, rtol=1e-13)


@pytest.mark.parametrize("eta", [1.3, 1.5, 1.8, 2.4])
def test_fresnel_of_a_dielectric_is_looked_up(eta, monkeypatch):
    folded = FoldedFresnel(np.full(81, eta), np.zeros(81), FOLDING.weights(NM))
    cos = np.linspace(0.01, 1.0, 777)
    expected = fresnel(cos**2, 1.0 - cos**2, np.full(81, eta), np.zeros(81)) @ FOLDING.weights(NM)
    monkeypatch.setattr("metamer.materials.analytic.cook_torrance.fresnel", None)
    np.testing.assert_allclose(folded(cos**2, 1.0 - cos**2), expected, rtol=3e-7)


def test_terms_times_spectra_are_the_lobe_and_equal_keys_are_equal_terms():
    points, by_key = pairs(), {}
    up = np.minimum(points.wi[:, 2], points.wo[:, 2]) > 0.0
    wi, wo = points.wi[up], points.wo[up]
    for lobe in (lobe.brdf for surface in EXAMPLES for lobe in surface.lobes()):
        if lobe.sum_of_terms is not None:
            values = lobe.sum_of_terms.terms(wi, wo)
            # Both sides of a lobe that cannot be told from a mirror are next to nothing.
            np.testing.assert_allclose(values @ lobe.sum_of_terms.spectra, lobe.eval(wi, wo), rtol=1e-12, atol=1e-14)
            np.testing.assert_array_equal(by_key.setdefault(lobe.sum_of_terms.key, values), values)
    assert len(by_key) > 15
    assert len({values.tobytes() for values in by_key.values()}) == len(by_key)


@pytest.mark.parametrize("sigma", [0.0, 0.35, 0.6, 0.65, 0.66, 0.7, 1.0, 0.5 * np.pi])
def test_rough_walls_are_terms_where_none_is_held_at_zero(sigma):
    theta = np.radians([0.0, 20.0, 50.0, 75.0, 89.0, 89.999])
    wi, wo = spherical(theta[:, None], 0.0 * theta), spherical(theta, np.full((6, 1), np.pi))
    wall = OrenNayar(Spectrum.sampled(NM, np.zeros(81)), sigma)
    lowest = wall._terms(wi.reshape(-1, 3), wo.reshape(-1, 3))[:, 0].min()
    assert (wall.sum_of_terms is not None) == (lowest >= 0.0)


def test_one_term_is_drawn_alike_in_all_colours_and_several_are_not():
    grey, red = (Spectrum.sampled(NM, values) for values in (np.full(81, 0.4), np.linspace(0.1, 0.8, 81)))
    coats = [[sampling_key(lobe.brdf) for lobe in CoatedDiffuse(one, 1.5, 0.1).lobes()] for one in (grey, red)]
    assert coats[0] == coats[1]
    assert sampling_key(OrenNayar(grey, 0.3)) != sampling_key(OrenNayar(red, 0.3))
    assert sampling_key(CookTorrance(grey, np.full(81, 1.5), np.zeros(81), 0.2, 1.0)) is None
