"""Directions drawn as surfaces scatter: whatever the table holds, the density must be that of what is drawn."""

from functools import cache

import numpy as np
import pytest
from metamer.materials.analytic import AshikhminShirley, CookTorrance, Lambert, OrenNayar
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.core.points import Points
from metamer.materials.core.sampling import DirectionSampler, _Cells
from metamer.materials.svbrdf.texture import SpectralTexture
from metamer.spectral.bispectral import Bispectral
from metamer.spectral.folding import Folding
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

EVEN = Folding(observer("1931_2"), [Spectrum(np.ones(2), np.array([360.0, 830.0]), "emission")])
WHITE, BLACK = (Spectrum.sampled(NM, np.full(81, value)) for value in (1.0, 0.0))


def metal(alpha, masking="smith"):
    return CookTorrance(BLACK, np.full(81, 0.2), np.full(81, 3.4), alpha, 1.0, "ggx", masking)


SURFACES = {
    "white": Lambert(WHITE),
    "black": Lambert(BLACK),
    "rough": OrenNayar.examples(NM)[2],
    "plastic": CookTorrance.examples(NM)[1],
    "gloss": CookTorrance.examples(NM)[3],
    "roughness 1": metal(1.0),
    "roughness 0.01": metal(0.01),
    "nearly a mirror": metal(1e-6),
    "brushed": AshikhminShirley(Spectrum.sampled(NM, np.full(81, 0.1)), WHITE, 10.0, 400.0),
}


def viewers(degrees, count):
    theta = np.deg2rad(degrees)
    return np.tile([0.8 * np.sin(theta), 0.6 * np.sin(theta), np.cos(theta)], (count, 1))


@cache
def sampler_of(name):
    return DirectionSampler(SURFACES[name])


def weights(surface, wo, sampler=None, seed=0):
    """f_r cos / density of drawn directions, Y; 0 below the horizon."""
    sampler = sampler or DirectionSampler(surface)
    wi = sampler.drawn(wo, np.random.default_rng(seed).random((len(wo), 2)))
    np.testing.assert_allclose(np.linalg.norm(wi, axis=1), 1.0, atol=1e-12)
    up = wi[:, 2] > 0
    density = sampler.density(wo[up], wi[up])
    assert (density > 0).all()
    out = np.zeros(len(wo))
    out[up] = surface.xyz(Points(wi[up], wo[up]), EVEN)[:, 1] * wi[up, 2] / density
    return out


def albedo(surface, wo):
    """Y of all that leaves to one viewer under even light, by a rule of many half vectors about the normal."""
    # Half vectors at evenly spaced logarithms of the angle, so that the narrowest highlight is resolved.
    edges = np.concatenate([[0.0], np.geomspace(1e-9, 0.5 * np.pi, 500)])
    theta, width = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
    phi = (np.arange(36) + 0.5) * (2.0 * np.pi / 36)
    t, p = np.meshgrid(theta, phi, indexing="ij")
    h = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1).reshape(-1, 3)
    solid = np.repeat(np.sin(theta) * width, 36) * (2.0 * np.pi / 36)
    h_wo = h @ wo
    wi = 2.0 * h_wo[:, None] * h - wo
    some = (wi[:, 2] > 0) & (h_wo > 0)
    f = surface.xyz(Points(wi[some], np.tile(wo, (some.sum(), 1))), EVEN)[:, 1]
    return float((f * wi[some, 2] * 4.0 * h_wo[some] * solid[some]).sum())


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("degrees", [0.0, 35.0, 80.0])
def test_drawn_directions_integrate_to_the_albedo(name, degrees):
    wo = viewers(degrees, 8000)
    found = weights(SURFACES[name], wo, sampler_of(name))
    error = found.std() / np.sqrt(len(found))
    assert abs(found.mean() - albedo(SURFACES[name], wo[0])) < 5 * error + 2e-3


@pytest.mark.parametrize("name", [name for name in SURFACES if name not in ("nearly a mirror", "roughness 0.01")])
@pytest.mark.parametrize("degrees", [10.0, 70.0, 89.9])
def test_the_density_integrates_to_the_share_above_the_horizon(name, degrees):
    sampler, rng = sampler_of(name), np.random.default_rng(1)
    wo = viewers(degrees, 20_000)
    up = (sampler.drawn(wo, rng.random((len(wo), 2)))[:, 2] > 0).mean()
    z, phi = rng.random(len(wo)), 2.0 * np.pi * rng.random(len(wo))
    across = np.sqrt(1.0 - z * z)
    density = sampler.density(wo, np.stack([across * np.cos(phi), across * np.sin(phi), z], axis=1)) * 2.0 * np.pi
    assert abs(density.mean() - up) < 5 * density.std() / np.sqrt(len(wo)) + 5e-3


def test_a_white_lambertian_is_drawn_without_any_noise():
    np.testing.assert_allclose(weights(SURFACES["white"], viewers(60.0, 500)), 1.0, rtol=1e-12)


@pytest.mark.parametrize("alpha", [1e-6, 1e-3, 0.05, 0.3, 1.0])
def test_metals_of_every_roughness_are_drawn_well(alpha):
    surface, sampler = metal(alpha), DirectionSampler(metal(alpha))
    for degrees in (0.0, 45.0):
        found = weights(surface, viewers(degrees, 20000), sampler)
        assert found.std() < 0.6 * found.mean()


def test_at_grazing_angles_nothing_becomes_infinite():
    for name, surface in SURFACES.items():
        found = weights(surface, viewers(89.9, 5000), sampler_of(name))
        assert np.isfinite(found).all() and found.max() < 50


def test_an_anisotropic_surface_is_drawn_along_its_grooves():
    sampler, wo = sampler_of("brushed"), viewers(20.0, 20000)
    wi = sampler.drawn(wo, np.random.default_rng(2).random((len(wo), 2)))
    h = wi + wo
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    assert np.median(np.abs(h[:, 0])) > 1.5 * np.median(np.abs(h[:, 1]))


def test_a_texture_is_drawn_as_its_mean_is_and_one_without_a_mean_by_the_cosine():
    even = SpectralTexture(NM, np.full((2, 2, 81), 0.4))
    beyond = SpectralTexture(NM, np.full((2, 2, 81), 1.4))
    for texture in (even, beyond):
        sampler, wo = DirectionSampler(texture), viewers(50.0, 1000)
        wi = sampler.drawn(wo, np.random.default_rng(3).random((1000, 2)))
        np.testing.assert_allclose(sampler.density(wo, wi), wi[:, 2] / np.pi, rtol=1e-12)


def test_a_fluorescent_surface_is_drawn_by_the_cosine():
    donaldson = np.diag(np.full(81, 0.2)) + np.tri(81, 81, -1) * 0.005
    sampler, wo = DirectionSampler(FluorescentLambert(Bispectral(NM, NM, donaldson))), viewers(50.0, 1000)
    wi = sampler.drawn(wo, np.random.default_rng(4).random((1000, 2)))
    np.testing.assert_allclose(sampler.density(wo, wi), wi[:, 2] / np.pi, rtol=1e-12)


def searched(up_to, row, uniform):
    """Cell by cell: the first whose sum is above the number, scaled to where the row ends, and how far into it."""
    sought = uniform * up_to[row, -1]
    cell = min(int(np.sum(up_to[row] <= sought)), up_to.shape[1] - 1)
    before = up_to[row, cell - 1] if cell > 0 else 0.0
    width = up_to[row, cell] - before
    return cell, min(max((sought - before) / (width if width > 0.0 else 1.0), 0.0), 1.0)


@pytest.mark.parametrize("shape", [(1, 1), (1, 16), (24, 16), (5, 3)])
@pytest.mark.parametrize("kind", ["any", "one cell has all", "no cell has any", "ends off 1"])
def test_cells_are_found_as_a_search_of_each_row_finds_them(shape, kind):
    rng = np.random.default_rng(3)
    shares = rng.random(shape) ** 6
    if kind == "one cell has all":
        shares[:, 1:] = 0.0
    up_to = np.cumsum(shares, axis=1)
    up_to = 0.0 * up_to if kind == "no cell has any" else up_to / up_to[:, -1:]
    up_to *= 1.0 - 1e-12 if kind == "ends off 1" else 1.0
    row = rng.integers(0, shape[0], 300)
    uniform = np.concatenate([rng.random(298), [0.0, 1.0 - 2.0**-33]])
    cells, along = _Cells(up_to).found(row, uniform)
    expected = [searched(up_to, *pair) for pair in zip(row, uniform, strict=True)]
    np.testing.assert_array_equal(cells, [cell for cell, _ in expected])
    np.testing.assert_array_equal(along, [share for _, share in expected])
