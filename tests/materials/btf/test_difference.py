"""Differences between texels of two fast forms, beside what is worked out by hand."""

import numpy as np
import pytest
from btf_sets import NINE, held
from metamer.materials.btf.difference import texel_difference
from metamer.materials.btf.form import btf_form
from metamer.materials.btf.hemisphere import Hemisphere
from metamer.materials.btf.images import HeldImages
from metamer.materials.btf.metric import folding_of
from metamer.spectral.difference import delta_e_xyz

LIGHTS = ("D65", "A", "FL11")
FOLDING = folding_of(LIGHTS)


def grey(values, views=NINE, lights=NINE):
    """A matt sample: reflectance (H,W), the same in every direction."""
    blank = held(views, lights, np.shape(values))
    cosine = blank.lights.directions[None, :, None, None, 2:]
    filled = np.broadcast_to(np.asarray(values)[..., None] * cosine / np.pi, blank.values.shape)
    return HeldImages(blank.views, blank.lights, filled.astype(np.float32), blank.basis)


def form(images, name="rfp"):
    return btf_form(images, name=name)


def test_greys_differ_in_lightness_alone():
    """ΔE94 of greys is that of L*: 116 cbrt(0.5 c) - 116 cbrt(0.4 c), c the cosine of each light."""
    a, b = (form(grey(np.full((3, 5), value)), "lpca") for value in (0.4, 0.5))
    found = texel_difference(a, b, FOLDING)
    cosine = grey(np.ones((1, 1))).lights.directions[:, 2]
    lightness = 116.0 * (np.cbrt(0.5 * cosine) - np.cbrt(0.4 * cosine))
    expected = np.broadcast_to(lightness, (15, 9, 9)).ravel()
    assert found.compared == "15 of 15 texels, all 9 views, all 9 lights"
    for each in found.each:
        np.testing.assert_allclose(each, expected, atol=0.05)


def test_the_first_is_the_reference_and_a_form_is_no_way_from_itself():
    a, b = (form(held(seed=seed)) for seed in (1, 2))
    assert not texel_difference(a, a, FOLDING).each.any()
    there, back = (texel_difference(*pair, FOLDING).each for pair in ((a, b), (b, a)))
    assert abs(there - back).max() > 0.5


@pytest.mark.parametrize("names", [("rfp", "lpca"), ("lpca", "rfnl-1")])
def test_another_kind_of_form_is_compared_texel_by_texel(names):
    images = held(size=(4, 6))
    a, b = (form(images, name) for name in names)
    made = [np.stack(list(one.texels.form.decoded(np.arange(24)))) for one in (a, b)]
    found = texel_difference(a, b, FOLDING)
    for light in range(3):
        at = slice(3 * light, 3 * light + 3)
        white = FOLDING.weights(images.basis.wavelengths_nm).sum(axis=0)[at]
        xyz = [
            np.pi * values @ FOLDING.coefficients(one.texels.form.basis)[:, at]
            for values, one in zip(made, (a, b), strict=True)
        ]
        np.testing.assert_allclose(found.each[light], delta_e_xyz(*xyz, white).ravel(), rtol=1e-3, atol=1e-3)


def test_the_largest_is_where_one_texel_was_changed():
    values = np.full((3, 5), 0.3)
    a = form(grey(values))
    values[2, 1] = 0.6
    b = form(grey(values))
    found = texel_difference(a, b, FOLDING)
    assert all(where.startswith("texel 1,2, light 0/0°") for where in found.where)


def test_of_other_directions_those_of_both_are_compared_wherever_they_stand():
    """Polynomials are of each view alone: of fewer views, and lights in another order, they are the same."""
    images, views, lights = held(), np.array([8, 3, 0, 5]), np.roll(np.arange(9), 4)
    fewer = HeldImages(
        Hemisphere(images.views.directions[views]),
        Hemisphere(images.lights.directions[lights]),
        images.values[views][:, lights],
        images.basis,
    )
    found = texel_difference(form(images), form(fewer), FOLDING)
    assert found.compared == "15 of 15 texels, 4 views that both have, of 9 and 4, all 9 lights"
    assert found.each.shape == (3, 15 * 4 * 9)
    # In steps of 8 bits.
    assert np.percentile(found.each, 99) < 1.0
    assert np.median(texel_difference(form(images), form(held(seed=9)), FOLDING).each) > 5.0


def test_another_number_of_texels_or_no_direction_of_both_is_said_and_not_compared():
    a = form(held())
    found = texel_difference(a, form(held(size=(4, 5))), FOLDING)
    assert found.compared == "texels not compared: 5 x 3 and 5 x 4 of them"
    assert not found.each.size and not found.where
    turned = [(theta, phi + 20) for theta, phi in NINE[1:]]
    found = texel_difference(a, form(held(views=turned)), FOLDING)
    assert found.compared.startswith("texels not compared: 0 views that both have, of 9 and 8")
    assert not found.each.size
