"""Spectral textures as few coefficients a texel: how few, how far off, and the hard cases."""

import numpy as np
import pytest
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.core.points import Points
from metamer.materials.core.protocol import LIGHTS, measured
from metamer.materials.records.material import MaterialRecord, Provenance
from metamer.materials.records.record import MARKER, write_record
from metamer.materials.svbrdf.texture import SpectralTexture
from metamer.materials.svbrdf.texture_form import texture_form
from metamer.runtime.errors import InputError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.folding import Folding
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer

NM = np.arange(400.0, 701.0, 10.0)
EYE = observer("1931_2")


def dyes(count):
    """Reflectances of so many dyes, (count, L)."""
    rng = np.random.default_rng(count)
    centre, width = rng.uniform(420, 680, count), rng.uniform(15, 60, count)
    return 0.04 + 0.7 * np.exp(-(((NM - centre[:, None]) / width[:, None]) ** 2))


def mixed(count, size=(24, 30), seed=0):
    """Texels that mix so many dyes, (H,W,L)."""
    shares = np.random.default_rng(seed).dirichlet(np.ones(count), size)
    return shares @ dyes(count)


def noise(size=(24, 30)):
    return np.random.default_rng(3).uniform(0.05, 0.95, (*size, NM.size))


def errors(reflectance, form, lights=LIGHTS):
    """ΔE94 of every texel, under each light."""
    folding = Folding(EYE, [illuminant(name) for name in lights])
    truth = reflectance.reshape(-1, NM.size) @ folding.weights(NM)
    planes = form.texture.planes.astype(float).reshape(len(truth), -1)
    shown = np.pi * planes @ form.texture.palette.folded(folding)[0]
    each = (slice(3 * k, 3 * k + 3) for k in range(len(lights)))
    return np.stack(
        [
            delta_e_xyz(truth[:, at], shown[:, at], EYE.white(light))
            for at, light in zip(each, folding.lights, strict=True)
        ]
    )


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_dyes_that_mix_take_no_more_terms_than_there_are(count):
    form = texture_form(NM, mixed(count))
    assert form.rank <= count
    assert np.percentile(errors(mixed(count), form), 99, axis=1).max() <= 0.1


@pytest.mark.parametrize("budget", [2.0, 0.5, 0.1])
def test_a_budget_is_kept_by_texels_of_which_no_two_are_alike(budget):
    form = texture_form(NM, noise(), budget)
    off = errors(noise(), form)
    assert np.percentile(off, 99, axis=1).max() <= 0.2 * budget and off.max() <= budget


def test_a_smaller_budget_takes_more_terms_and_three_a_light_leave_nothing():
    ranks = [texture_form(NM, noise(), budget).rank for budget in (5.0, 0.5, 1e-9)]
    assert ranks == sorted(ranks) and ranks[0] < ranks[-1] == 3 * len(LIGHTS)
    assert errors(noise(), texture_form(NM, noise(), 1e-9)).max() < 1e-3


def test_lights_that_no_basis_saw_are_near():
    """A texture of four dyes is four spectra: under any light at all."""
    off = errors(mixed(4), texture_form(NM, mixed(4)), ("FL2", "LED-V1", "D50", "HP4"))
    assert off.max() < 0.2


def test_half_precision_is_kept_where_it_stays_within_the_budget():
    assert texture_form(NM, mixed(3)).texture.precision == "half"
    precise = texture_form(NM, mixed(3), 1e-3)
    assert precise.texture.precision == "single" and precise.texture.planes.dtype == np.float32


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("black", np.zeros((4, 5, NM.size))),
        ("one texel", np.full((1, 1, NM.size), 0.3)),
        ("one colour", np.full((6, 3, NM.size), 0.3)),
        ("white", np.ones((3, 3, NM.size))),
        ("out of range", np.stack([np.full((3, NM.size), -0.02), np.full((3, NM.size), 1.3)])),
        ("one line", np.where(NM == 550.0, 0.9, 0.0) * np.ones((2, 7, 1))),
        (
            "as bright as daylight and as dark as a crack",
            np.geomspace(1e-5, 1.0, 12).reshape(3, 4, 1) * np.ones(NM.size),
        ),
    ],
)
def test_hard_textures(name, values):
    form = texture_form(NM, values)
    assert np.isfinite(form.texture.planes).all() and errors(values, form).max() <= 0.5, name
    average = form.average()
    found = np.pi * average.eval(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.0]))
    mean = values.mean(axis=(0, 1))
    folding = Folding(EYE, [illuminant("D65")])
    off = delta_e_xyz(mean @ folding.weights(NM), found @ folding.weights(NM), EYE.white(folding.lights[0]))
    assert off < 0.5, name


def test_at_points_the_original_and_its_form_agree_and_the_horizon_is_dark():
    surface = SpectralTexture(NM, mixed(3))
    rng = np.random.default_rng(1)
    wi, wo = rng.normal(size=(2, 300, 3))
    wi, wo = (w / np.linalg.norm(w, axis=1, keepdims=True) for w in (wi, wo))
    points = Points(wi, wo, rng.uniform(-2, 2, (300, 2)))
    lit = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    truth, shown = surface.at(points), surface.own_form().at(points)
    assert not truth[~lit].any() and not shown[~lit].any()
    np.testing.assert_allclose(shown[lit], truth[lit], atol=2e-3)


def test_what_is_not_a_texture_is_refused():
    for wrong in (np.zeros((3, NM.size)), np.zeros((2, 2, 5)), np.zeros((0, 4, NM.size))):
        with pytest.raises(InputError, match="not a texture"):
            SpectralTexture(NM, wrong)


def test_the_catalogue_keeps_it_and_shows_its_average(tmp_path):
    surface = SpectralTexture(NM, mixed(3).astype(np.float32))
    fast = measured(surface.own_form(), surface, 32)
    assert fast.error.p99 < 0.5 and [one.light for one in fast.error.lights] == list(LIGHTS)
    said = Provenance("a test", "none", "measured")
    made = MaterialRecord("cloth/dyed", "cloth", "spectral_texture", surface.parameters(), said, fast)
    (tmp_path / MARKER).write_text("schema = 2\n")
    (tmp_path / "cloth").mkdir()
    write_record(made, tmp_path / "cloth" / "dyed.h5")
    catalogue = Catalogue.open(tmp_path)
    found = catalogue["cloth/dyed"]
    np.testing.assert_array_equal(found.fast.texture.planes, fast.texture.planes)
    assert found.fast.texture.planes.dtype == fast.texture.planes.dtype and found.error == fast.error
    np.testing.assert_array_equal(found.surface().texture, surface.texture)
    assert catalogue.verify() == {"cloth/dyed": None}
    average = surface.average()
    np.testing.assert_allclose(average.reflectance.samples, mixed(3).mean(axis=(0, 1)), rtol=1e-5)
    light = illuminant("D65")
    expected = average.reflectance.samples @ Folding(EYE, [light]).weights(NM)
    np.testing.assert_allclose(found.xyz("D65"), expected, rtol=1e-4)
