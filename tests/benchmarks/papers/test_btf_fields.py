"""Published models of BTFs: what their functions can say is found exactly, and more numbers say more."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from metamer.benchmarks.papers.btf_fields import judged, lafortune, lobe_table, ptm, rfp
from metamer.benchmarks.synthetic_btf.samples import woven
from metamer.materials.btf.hemisphere import Hemisphere
from metamer.materials.btf.images import HeldImages
from metamer.runtime.errors import InputError
from metamer.spectral.basis import SpectralBasis


def rings(*degrees):
    theta, phi = np.radians([(t, p) for t, step in degrees for p in range(0, 360, step)]).T
    return Hemisphere(np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1))


VIEWS, LIGHTS = rings((0, 360), (30, 90), (60, 60)), rings((0, 360), (25, 60), (50, 45), (70, 40))
SAMPLED = SpectralBasis.sampled()
# Three wavelengths, as a basis of coefficients that are easily made up.
THREE = SpectralBasis(
    "three", SAMPLED.wavelengths_nm, SAMPLED.analysis[:, [14, 34, 54]], SAMPLED.synthesis[:, [14, 34, 54]]
)


def held(values):
    return HeldImages(VIEWS, LIGHTS, values.astype(np.float32), THREE)


def made_again(images, field):
    return np.stack([[field.reconstruct(v, l) for l in range(len(LIGHTS))] for v in range(len(VIEWS))])


@pytest.fixture(scope="module")
def cloth():
    sample = replace(woven(2, 12, yarns=4, cells=3), samples=2, gathering=4)
    return sample.images(VIEWS, LIGHTS, basis=SpectralBasis.peercy(sample.dyes.samples, np.ones((81, 1)), 4))


def test_polynomials_are_found_exactly():
    x, y = LIGHTS.directions[:, 0], LIGHTS.directions[:, 1]
    terms = np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)], axis=1)
    random = np.random.default_rng(1)
    each = random.normal(size=(len(VIEWS), 3, 4, 3, 6))
    images = held(np.einsum("vhwjk,lk->vlhwj", each, terms))
    np.testing.assert_allclose(rfp(images).coefficients, each, atol=1e-4)
    one = held(np.broadcast_to(images.values[:1], images.values.shape))
    np.testing.assert_allclose(ptm(one).coefficients, each[:1], atol=1e-4)
    np.testing.assert_allclose(made_again(images, rfp(images)), images.values, atol=1e-4)


def test_lobes_of_the_table_are_found_exactly_with_their_scales():
    table, random = lobe_table(VIEWS, LIGHTS), np.random.default_rng(1)
    lobe = np.stack([np.zeros((3, 4), dtype=int), random.integers(1, table.shape[2], (3, 4))], axis=2)
    rho = random.uniform(0.2, 1.0, (3, 4, 2, 3))
    plain = held(np.einsum("vlhwk,hwkj->vlhwj", table[:, :, lobe], rho))
    np.testing.assert_allclose(made_again(plain, lafortune(plain, 1, scaled=False)), plain.values, atol=1e-5)
    matt = held(np.einsum("vhw,l,hwj->vlhwj", random.uniform(0.5, 2, (len(VIEWS), 3, 4)), table[0, :, 0], rho[:, :, 0]))
    np.testing.assert_allclose(made_again(matt, lafortune(matt, 0)), matt.values, rtol=1e-4)


def test_the_table_is_reciprocal_but_for_the_cosine():
    both = rings((0, 360), (40, 45), (70, 30))
    table = lobe_table(both, both) / both.directions[None, :, 2, None]
    np.testing.assert_allclose(table, table.swapaxes(0, 1), atol=1e-12)
    assert table.max() <= 1.0 + 1e-12


def test_more_numbers_say_more_of_cloth(cloth):
    """Polynomials of each view are nearer than one for all, lobes with each that is added."""
    fields = [ptm(cloth), rfp(cloth)]
    errors = [judged(cloth, field.reconstruct).mean for field in fields]
    assert errors[1] < errors[0]
    assert [field.bytes_per_texel for field in fields] == [6 * 4, 6 * 4 * len(VIEWS)]
    squares = [
        ((made_again(cloth, lafortune(cloth, lobes, scaled)) - cloth.values) ** 2).mean()
        for lobes, scaled in ((0, False), (1, False), (2, False), (2, True))
    ]
    assert all(a > b for a, b in pairwise(squares)), squares
    assert lafortune(cloth, 2).bytes_per_texel == 3 * 4 + 2 * 4 + len(VIEWS)


def test_nothing_lost_is_no_difference(cloth):
    assert judged(cloth, cloth.image) == (0.0, 0.0, 0.0)
    darker = judged(cloth, lambda view, light: 0.9 * cloth.image(view, light))
    assert 0.0 < darker.mean < darker.p95 < darker.p99


def test_memory_changes_nothing(cloth, monkeypatch):
    whole = lafortune(cloth, 2)
    monkeypatch.setattr("metamer.benchmarks.papers.btf_fields._AT_ONCE", 1)
    rows = lafortune(cloth, 2)
    np.testing.assert_array_equal(whole.lobe, rows.lobe)
    np.testing.assert_allclose(whole.rho, rows.rho, rtol=1e-5, atol=1e-6)


def test_one_view_and_one_light():
    one = rings((0, 360))
    images = HeldImages(one, one, np.full((1, 1, 2, 2, 3), 0.3, dtype=np.float32), THREE)
    for field in (ptm(images), rfp(images), lafortune(images, 1)):
        np.testing.assert_allclose(field.reconstruct(0, 0), images.image(0, 0), rtol=1e-5)


def test_lobes_that_there_are_not(cloth):
    for lobes in (-1, 200):
        with pytest.raises(InputError, match="number of lobes"):
            lafortune(cloth, lobes)
