"""glTF's BRDF: its formulas line by line, its limits, and what it refuses."""

import math

import numpy as np
import pytest
from metamer.materials.analytic import CookTorrance, Lambert, MetallicRoughness
from metamer.materials.core.directions import spherical
from metamer.materials.fitting.fit import fit
from metamer.runtime.errors import InputError
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

WAVELENGTHS = np.array([450.0, 550.0, 650.0])
UP = np.array([0.0, 0.0, 1.0])


def flat(*values):
    return Spectrum.sampled(WAVELENGTHS, np.broadcast_to(values, 3))


def appendix_b(wi, wo, diffuse, f0, f90, alpha, coat, coat_alpha):
    """Appendix B.3.2 and B.3.5 of the specification, word for word, in cosines."""
    h = (wi + wo) / np.linalg.norm(wi + wo)
    vh, nl, nv, nh = wo @ h, wi[2], wo[2], h[2]

    def distribution(a):
        return a**2 / (math.pi * (nh**2 * (a**2 - 1) + 1) ** 2)

    def visibility(a):
        one = nl + math.sqrt(a**2 + (1 - a**2) * nl**2)
        two = nv + math.sqrt(a**2 + (1 - a**2) * nv**2)
        return (1 / one) * (1 / two)

    fresnel = f0 + (f90 - f0) * (1 - abs(vh)) ** 5
    base = (1 - fresnel) * diffuse / math.pi + fresnel * distribution(alpha) * visibility(alpha)
    over = coat * (0.04 + 0.96 * (1 - abs(vh)) ** 5)
    return base * (1 - over) + over * distribution(coat_alpha) * visibility(coat_alpha)


@pytest.mark.parametrize("coat", [0.0, 0.7])
@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (0.5, 0.6, 2.8), (1.2, 0.3, 1.0), (1.4, 1.5, 3.1)])
def test_against_the_specification_in_cosines(angles, coat):
    wi, wo = spherical(angles[0], 0.4), spherical(angles[1], 0.4 + angles[2])
    found = MetallicRoughness(flat(0.1, 0.5, 0.9), flat(0.04, 0.5, 0.2), 0.9, 0.3, coat, 0.05).eval(wi, wo)
    pairs = zip((0.1, 0.5, 0.9), (0.04, 0.5, 0.2), strict=True)
    expected = [appendix_b(wi, wo, rho, f0, 0.9, 0.3, coat, 0.05) for rho, f0 in pairs]
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_by_hand_at_normal_incidence():
    # D = 1/(pi a^2), V = 1/4: a white plastic of alpha 1/2 returns 0.96/pi + 0.04/pi.
    value = np.pi * MetallicRoughness(flat(1.0), flat(0.04), 1.0, 0.5).eval(UP, UP)
    np.testing.assert_allclose(value, 0.96 + 0.04, rtol=1e-14)


def test_without_facets_it_is_lambert():
    wi, wo = spherical(0.7, 0.0), spherical(1.1, 2.0)
    bare = MetallicRoughness(flat(0.2, 0.5, 1.0), flat(0.0), 0.0, 0.5)
    np.testing.assert_allclose(bare.eval(wi, wo), Lambert(flat(0.2, 0.5, 1.0)).eval(wi, wo), rtol=1e-14)


def test_facets_are_those_of_cook_torrance_at_the_normal():
    """A metal of the same reflectance at the normal: at theta_d = 0, only the Fresnel terms could differ."""
    eta = 1.5
    facets = CookTorrance(flat(0.0), np.full(3, eta), np.zeros(3), 0.3, 1.0, "ggx", "smith")
    schlick = MetallicRoughness(flat(0.0), flat(((eta - 1) / (eta + 1)) ** 2), 1.0, 0.3)
    w = spherical(0.9, 0.3)
    np.testing.assert_allclose(schlick.eval(w, w), facets.eval(w, w), rtol=1e-9)


@pytest.mark.slow
def test_it_factors_into_few_terms():
    body = Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.linspace(0.05, 0.8, 81))
    sheen = Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.full(81, 0.04))
    found = fit(MetallicRoughness(body, sheen, 1.0, 0.25, 1.0, 0.01), budget=0.5)
    assert found.error.p99 < 0.5
    assert sum(pack.palette.values[0].shape[0] for pack in found.fast.packs) <= 8


@pytest.mark.parametrize(
    ("values", "field"),
    [
        ((1.5, 0.3, 0.0, 1.0), "edge"),
        ((1.0, 0.0, 0.0, 1.0), "alpha"),
        ((1.0, 1.1, 0.0, 1.0), "alpha"),
        ((1.0, 0.3, -0.1, 1.0), "coat"),
        ((1.0, 0.3, 1.0, 0.0), "coat_alpha"),
        ((1.0, math.nan, 0.0, 1.0), "alpha"),
    ],
)
def test_parameters_out_of_their_domain(values, field):
    with pytest.raises(InputError) as caught:
        MetallicRoughness(flat(0.5), flat(0.04), *values)
    assert caught.value.field == field
