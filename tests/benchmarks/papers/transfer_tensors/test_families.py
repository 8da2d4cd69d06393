"""Families of highlights, and the way between their members."""

import numpy as np
import pytest
from metamer.benchmarks.papers.transfer_tensors.components import components_of
from metamer.benchmarks.papers.transfer_tensors.families import blinn_phong, cook_torrance, half_cosine
from metamer.runtime.errors import InputError


def pairs(count=4000, lowest=0.3):
    draw = np.random.default_rng(0)
    to = draw.normal(size=(2, count, 3))
    to[..., 2] = np.abs(to[..., 2]) + lowest
    return to / np.linalg.norm(to, axis=-1, keepdims=True)


def test_an_exponent_between_two_is_their_mixture():
    family = blinn_phong(20)
    weights = family.weights(7.25)
    assert weights[6] == 0.75 and weights[7] == 0.25 and weights.sum() == 1.0
    wi, wo = pairs(100)
    cosine = half_cosine(wi, wo)
    want = 0.75 * 15.0 / (8.0 * np.pi) * cosine**7 + 0.25 * 16.0 / (8.0 * np.pi) * cosine**8
    np.testing.assert_allclose(weights @ family.values(wi, wo), want, rtol=1e-12)


def test_a_member_is_itself():
    family = cook_torrance()
    for number in (0, 17, len(family) - 1):
        np.testing.assert_allclose(family.weights(*family.members[number]), np.eye(len(family))[number], atol=1e-9)


def test_between_members_at_most_three_are_mixed():
    family = cook_torrance()
    weights = family.weights(0.33, 0.21)
    assert 0 < np.count_nonzero(weights) <= 3 and weights.min() >= 0.0
    np.testing.assert_allclose(weights.sum(), 1.0, rtol=1e-12)
    np.testing.assert_allclose(weights @ family.members, (0.33, 0.21), rtol=1e-9)


@pytest.mark.parametrize("parameters", [(0.01, 0.2), (0.5, 0.6), (0.5,)])
def test_outside_of_a_family_is_refused(parameters):
    with pytest.raises(InputError, match=r"outside of the family|not as many"):
        cook_torrance().weights(*parameters)


def test_members_on_one_line_are_refused():
    with pytest.raises(InputError, match="on one line"):
        cook_torrance(np.array([(0.1, 0.2), (0.2, 0.3), (0.3, 0.4)]))


def test_cook_torrance_agrees_with_the_analytic_model():
    """At F_0 = 1 both are facets in grooves alone."""
    from metamer.materials.analytic.cook_torrance import CookTorrance
    from metamer.spectral.spectrum import Spectrum

    wi, wo = pairs(500)
    family = cook_torrance(np.array([(1.0, 0.3), (0.9, 0.3), (1.0, 0.4)]))
    nm = np.array([500.0, 600.0])
    # Reflects nearly all at every angle: a refractive index that is large beyond measure.
    mirror = CookTorrance(Spectrum.sampled(nm, np.zeros(2)), np.full(2, 1e-3), np.full(2, 1e6), 0.3, 1.0)
    np.testing.assert_allclose(family.values(wi, wo)[0], mirror.eval(wi, wo)[:, 0], rtol=1e-6)


@pytest.mark.parametrize(("family", "off"), [(blinn_phong(), 2e-3), (cook_torrance(), 0.03)])
def test_all_components_give_the_members_back(family, off):
    """What is left is what tables are linear between."""
    wi, wo = pairs()
    found = components_of(family, len(family))
    for weights in np.eye(len(family))[:: len(family) // 5]:
        truth = weights @ family.values(wi, wo)
        made = found.values(wi, wo) @ (weights @ found.by_member)
        assert np.linalg.norm(made - truth) < off * np.linalg.norm(truth)


def test_more_components_leave_less():
    family = cook_torrance()
    errors = [components_of(family, count).error for count in (2, 4, 8)]
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]
    assert errors[2] < 1e-3
