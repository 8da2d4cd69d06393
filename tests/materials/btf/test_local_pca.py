"""Local PCA of BTFs: what it keeps, hard cases, and what a file keeps of it."""

import numpy as np
import pytest
from btf_samples import bumps, rings
from metamer.materials.btf.clusters import clustered
from metamer.materials.btf.form import SIZES, BtfForm, btf_form
from metamer.materials.btf.hemisphere import Hemisphere
from metamer.materials.btf.images import HeldImages, displacement
from metamer.materials.btf.local_pca import Size, local_pca
from metamer.materials.btf.metric import folding_of, seen
from metamer.materials.btf.reduced import reduced
from metamer.materials.core.points import Points
from metamer.runtime.errors import InputError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.folding import Folding
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer


@pytest.fixture(scope="module")
def bumpy():
    return bumps()


@pytest.fixture(scope="module")
def few_directions():
    """As many texels, seen and lit from a tenth of the pairs."""
    return bumps(views=3, lights=3)


@pytest.fixture(scope="module")
def fine(bumpy):
    return btf_form(bumpy, FINE)


FINE = Size(24, 4, 16, 0.1, 0.2)


def decoded(form):
    """All images again, (V,Lt,H,W,J)."""
    table, weights = form.table(), form.weights.astype(float)
    found = table[form.number][..., 0, :] + np.einsum("hwc,hwvlcj->hwvlj", weights, table[form.number][..., 1:, :])
    return found.transpose(2, 3, 0, 1, 4)


def off(form, images):
    folding = Folding(observer("1931_2"), [illuminant("D65")])
    to_xyz, white = np.pi * folding.coefficients(images.basis), folding.weights(images.basis.wavelengths_nm).sum(axis=0)
    return delta_e_xyz(images.values @ to_xyz, decoded(form) @ to_xyz, white)


def with_values(images, values):
    return HeldImages(images.views, images.lights, values.astype(np.float32), images.basis)


def test_the_metric_is_the_colour_difference_of_small_changes(bumpy):
    folding = Folding(observer("1931_2"), [illuminant(name) for name in ("D65", "A", "FL11")])
    weights, whites = np.pi * folding.coefficients(bumpy.basis), folding.weights(bumpy.basis.wavelengths_nm).sum(axis=0)
    draw = np.random.default_rng(2)
    colours = draw.uniform(0.01, 0.3, (500, 3))
    change = 1e-4 * draw.normal(size=(500, 3)) * colours
    each = [
        delta_e_xyz(colours @ weights[:, at], (colours + change) @ weights[:, at], whites[at])
        for at in (slice(0, 3), slice(3, 6), slice(6, 9))
    ]
    expected = np.sqrt(np.mean(np.square(each), axis=0))
    found = np.linalg.norm(np.einsum("njk,nj->nk", seen(colours, bumpy.basis), change), axis=1)
    np.testing.assert_allclose(found, expected, rtol=2e-3)


def test_a_black_colour_has_a_metric_without_infinities(bumpy):
    found = seen(np.array([[0.0, 0.0, 0.0], [-0.1, 0.0, 0.0]]), bumpy.basis)
    assert np.isfinite(found).all() and (np.diagonal(found, axis1=1, axis2=2) > 0).all()


def test_what_is_kept_is_what_was_measured(bumpy, fine):
    coarse = local_pca(bumpy, Size(8, 4, 2, 1.0, 1.0))
    kept = off(fine.texels.form, bumpy).mean()
    assert kept < 0.5 * off(coarse, bumpy).mean()
    assert kept < 0.6


def test_the_stated_error_is_that_of_other_texels(bumpy, fine):
    by_light = {row.light: row for row in fine.error.lights}
    # All the texels there are: the figures are those of the whole.
    np.testing.assert_allclose(by_light["D65"].mean, off(fine.texels.form, bumpy).mean(), rtol=1e-4)
    assert fine.error.p99 == max(row.p99 for row in fine.error.lights)


def test_a_constant_texture_is_one_cluster_and_exact(few_directions):
    same = with_values(
        few_directions, np.broadcast_to(few_directions.values[:, :, :1, :1], few_directions.values.shape)
    )
    form = local_pca(same, SIZES["medium"])
    assert len(form.parts) == 1
    assert off(form, same).max() < 0.05


def test_texels_that_are_there_twice(few_directions):
    values = np.tile(few_directions.values[:, :, :2, :2], (1, 1, 4, 4, 1))
    form = local_pca(with_values(few_directions, values), FINE)
    assert len(form.parts) <= 4
    assert off(form, with_values(few_directions, values)).max() < 2.0


def test_a_texel_that_is_black_in_all_images(few_directions):
    values = few_directions.values.copy()
    values[:, :, 3, 5] = 0.0
    black = with_values(few_directions, values)
    form = local_pca(black, FINE)
    assert np.isfinite(decoded(form)).all() and off(form, black).mean() < 0.8


def test_an_all_black_sample(few_directions):
    black = with_values(few_directions, 0.0 * few_directions.values)
    np.testing.assert_array_equal(decoded(local_pca(black, FINE)), 0.0)


def test_saturated_highlights(few_directions):
    values = few_directions.values.copy()
    values[:, :, 4:6, 4:6] *= 30.0
    found = decoded(local_pca(with_values(few_directions, values), FINE))
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found[:, :, 4:6, 4:6].mean(), values[:, :, 4:6, 4:6].mean(), rtol=0.02)


@pytest.mark.parametrize("shape", [(1, 1), (3, 5)])
def test_a_few_texels(shape):
    few = bumps(*shape, views=3, lights=3)
    assert off(local_pca(few, FINE), few).mean() < 0.6


def test_a_single_light():
    one = bumps(views=4, lights=1)
    assert len(one.lights) == 1
    assert off(local_pca(one, FINE), one).mean() < 0.6


def test_a_view_missing_and_a_ring_missing(bumpy):
    """Directions are whatever there are: what is missing lies between others."""
    whole = bumps(views=5, lights=4)
    kept = [view for view in range(len(whole.views)) if view != 3 and not 7 <= view < 19]
    part = HeldImages(Hemisphere(whole.views.directions[kept]), whole.lights, whole.values[kept], whole.basis)
    form = btf_form(part, FINE)
    wo, wi = (
        np.repeat(whole.views.directions[[3, 10]], 2, axis=0),
        np.repeat(rings(2)[[0, 3]][None], 2, axis=0).reshape(4, 3),
    )
    value = form.texels.terms(Points(wi, wo, np.full((4, 2), 0.3))).value
    assert np.isfinite(value).all() and (value > 0.0).all()


def test_numbers_that_are_none_are_refused(bumpy):
    values = bumpy.values.copy()
    values[5, 7, 2, 2, 1] = np.nan
    with pytest.raises(InputError, match="not finite"):
        local_pca(with_values(bumpy, values), FINE)


def test_clusters_that_die_begin_anew():
    """Far more clusters than lumps: none is empty, and each vector is where least of it is left."""
    draw = np.random.default_rng(4)
    lumps = np.concatenate([1e-3 * draw.normal(size=(400, 6)), 50.0 + draw.normal(size=(40, 6))]).astype(np.float32)
    found = clustered(lumps, 16, 1)
    assert 8 <= len(found.origin) <= 16
    assert np.bincount(found.number, minlength=len(found.origin)).min() >= 1
    assert np.isfinite(found.weights).all()


@pytest.mark.slow
def test_a_seed_is_the_same_bits():
    images = bumps(views=3, lights=3)
    one, again, other = (local_pca(images, FINE, seed=seed) for seed in (5, 5, 6))
    first, second = one.stored(), again.stored()
    for name in ("number", "weights", "parts", "part_steps"):
        np.testing.assert_array_equal(first[name], second[name])
    np.testing.assert_array_equal(first["dictionary"]["core"]["others"], second["dictionary"]["core"]["others"])
    # Another seed draws other texels, and is as good.
    assert abs(off(other, images).mean() - off(one, images).mean()) < 0.1


def test_what_a_file_keeps_draws_the_same(fine):
    again = BtfForm.from_stored(fine.stored(), fine.error)
    draw = np.random.default_rng(0)
    wi, wo = (np.abs(draw.normal(size=(50, 3))) for _ in range(2))
    points = Points(
        *(side / np.linalg.norm(side, axis=1, keepdims=True) for side in (wi, wo)), draw.uniform(size=(50, 2))
    )
    np.testing.assert_allclose(again.texels.terms(points).value, fine.texels.terms(points).value, rtol=1e-5)


def test_spectra_are_carried_not_colours():
    """Sampled at every tenth wavelength or as three primaries: coefficients of any basis are kept as they are seen."""
    spectra = np.eye(81)[:, 4::9] + 0.2
    basis = SpectralBasis("bands", np.linspace(380, 780, 81), np.linalg.pinv(spectra).T, spectra)
    images = bumps(8, 8, views=3, lights=3, basis=basis)
    assert off(local_pca(images, FINE), images).mean() < 0.6


def test_many_wavelengths_are_carried_by_few_coefficients():
    """Smooth spectra at every tenth wavelength: the form has few of them, and shows what all of them show."""
    grid = np.arange(400.0, 701.0, 10.0)
    images = bumps(6, 6, views=2, lights=2, basis=SpectralBasis.sampled(grid))
    waves = 0.4 + 0.2 * np.sin(grid / 40.0 + np.arange(36)[:, None] / 5.0)
    images.values[...] = images.values[..., :1] * waves.reshape(6, 6, -1)
    few = reduced(images)
    assert 4 <= few.basis.size < 12 and (few.height, few.offset) == (6, 0.0)
    to_xyz, white = (folding_of(("HP1",)).weights(grid), folding_of(("HP1",)).weights(grid).sum(axis=0))
    back = few.image(3, 2) @ few.basis.synthesis.T
    assert delta_e_xyz(np.pi * images.values[3, 2] @ to_xyz, np.pi * back @ to_xyz, white).max() < 0.3
    form = btf_form(images, FINE)
    assert form.texels.palette.rank == few.basis.size
    assert reduced(bumps(3, 3, views=2, lights=2)).basis.size == 3


@pytest.mark.parametrize("offset", [2.0, -1.3])
def test_a_registered_surface_is_found_where_it_is(bumpy, offset):
    """To whole texels exactly, between them as far as what lies there is linear."""
    moved = HeldImages(bumpy.views, bumpy.lights, bumpy.values.copy(), bumpy.basis, offset=offset)
    steps = displacement(bumpy.views.directions, offset)
    y, x = np.mgrid[:12, :16]
    wave = np.cos(2.0 * np.pi * (x / 16 + 0.1))[..., None] * np.ones(3)
    for view in range(len(bumpy.views)):
        shown = np.cos(2.0 * np.pi * ((x - steps[view, 0]) / 16 + 0.1))[..., None] * np.ones(3)
        moved.values[view] = shown + 0.0 * y[..., None]
    for view in (0, 5, 30):
        np.testing.assert_allclose(moved.registered(view, 2), wave, atol=0.02)
    straight = np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5)])
    np.testing.assert_allclose(displacement(straight, 2.0), (-2.0, 0.0), atol=1e-12)


def test_too_many_clusters_are_refused(bumpy):
    with pytest.raises(InputError, match="clusters"):
        local_pca(bumpy, Size(8, 300, 2, 1.0, 1.0))


@pytest.mark.slow
def test_a_budget_chooses_the_size():
    images = bumps(16, 16, views=3, lights=3)
    wide, narrow = btf_form(images, 1.0), btf_form(images, 0.35)
    assert worst_mean(narrow) <= 0.35 < worst_mean(wide) <= 1.0
    assert wide.texels.form.weights.shape[2] < narrow.texels.form.weights.shape[2]
    # Nothing is within a budget of nothing: then it is the one that bytes are best spent on.
    assert worst_mean(btf_form(images, 1e-6)) == worst_mean(btf_form(images, SIZES["fine"]))


def worst_mean(form):
    return max(light.mean for light in form.error.lights)


def test_dark_clusters_are_seen_as_dark_ones(bumpy, monkeypatch):
    """Every second stripe lies in shadow: what is off there shows more than at the mean colour of all texels."""
    draw = np.random.default_rng(8)
    shade = np.where(np.arange(bumpy.width) // 2 % 2, 0.04, 1.0) * draw.uniform(0.8, 1.2, (bumpy.height, bumpy.width))
    striped = with_values(bumpy, bumpy.values * shade[:, :, None])
    few = Size(32, 4, 4, 0.3, 0.5)
    found = np.percentile(off(local_pca(striped, few), striped), (50.0, 99.0))
    monkeypatch.setattr("metamer.materials.btf.local_pca.seen_by_clusters", lambda *given: given[3])
    as_the_mean_shows = np.percentile(off(local_pca(striped, few), striped), (50.0, 99.0))
    assert found[1] < 0.85 * as_the_mean_shows[1] and found[0] < 1.1 * as_the_mean_shows[0]
