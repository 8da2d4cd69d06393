"""A coat over a matt body: its energy, its facets and body by other ways, and what instruments read of it."""

import numpy as np
import pytest
from metamer.materials.analytic import CoatedDiffuse, CookTorrance
from metamer.materials.analytic.coated_diffuse import diffuse_fresnel
from metamer.materials.analytic.cook_torrance import fresnel
from metamer.materials.core.directions import TAU, spherical
from metamer.runtime.errors import InputError
from metamer.spectral.spectrum import Spectrum

WAVELENGTHS = np.array([450.0, 550.0, 650.0])
READING = (0.05, 0.4, 0.88)


def flat(*values):
    return Spectrum.sampled(WAVELENGTHS, np.broadcast_to(values, 3))


def reflected(cosine, index):
    """Fresnel's reflectance by the formula for metals."""
    cos2 = np.atleast_1d(cosine) ** 2
    return fresnel(cos2, 1.0 - cos2, np.array([index]), np.zeros(1))[:, 0]


def hemisphere(nodes=48):
    """Directions, and their weights in the cosine-weighted hemisphere, whose integral is 1."""
    u, share = np.polynomial.legendre.leggauss(nodes)
    cos2, phi = np.meshgrid(0.5 * (u + 1.0), TAU * (np.arange(nodes) + 0.5) / nodes, indexing="ij")
    return spherical(np.arccos(np.sqrt(cos2)).ravel(), phi.ravel()), np.repeat(0.5 * share / nodes, nodes)


@pytest.mark.parametrize("index", [1.2, 1.5, 3.0])
def test_reflectance_for_even_light_is_fresnels_mean(index):
    cosine, share = np.polynomial.legendre.leggauss(200)
    cosine, share = 0.5 * (cosine + 1.0), 0.5 * share
    assert diffuse_fresnel(index) == pytest.approx(2.0 * (share * cosine) @ reflected(cosine, index), abs=1e-10)


@pytest.mark.parametrize("index", [1.2, 1.5, 3.0])
@pytest.mark.parametrize("degrees", [0.0, 40.0, 80.0, 89.0])
def test_a_white_body_gives_back_all_that_the_coat_lets_in(index, degrees):
    """And a grey one what is left of it, bounce by bounce within the coat."""
    wo, share = hemisphere()
    body, _ = CoatedDiffuse(flat(0.0, 0.5, 1.0), index, 0.02).lobes()
    found = np.pi * share @ body.brdf.eval(spherical(np.radians(degrees), 0.0), wo)
    let_in = 1.0 - reflected(np.cos(np.radians(degrees)), index)[0]
    back = 1.0 - (1.0 - diffuse_fresnel(index)) / index**2
    bounces = sum(0.5 * (1.0 - back) * (0.5 * back) ** k for k in range(60))
    np.testing.assert_allclose(found, let_in * np.array([0.0, bounces, 1.0]), rtol=2e-5, atol=1e-15)


@pytest.mark.parametrize("roughness", [0.005, 0.05, 0.4])
def test_the_coat_is_a_surface_of_facets_of_glass(roughness):
    facets = CookTorrance(flat(0.0), np.full(3, 1.5), np.zeros(3), roughness, 1.0, "beckmann", "smith")
    random = np.random.default_rng(3)
    wi, wo = spherical(np.arccos(random.random((2, 500))), TAU * random.random((2, 500)))
    expected = facets.eval(wi, wo)
    np.testing.assert_allclose(CoatedDiffuse(flat(0.0), 1.5, roughness).eval(wi, wo), expected, rtol=1e-9)


@pytest.mark.parametrize("roughness", [0.016, 0.06, 0.3, 1.0])
@pytest.mark.parametrize("degrees", [0.0, 8.0, 50.0, 75.0])
def test_a_coated_white_surface_sends_back_no_more_than_it_gets(roughness, degrees):
    surface = CoatedDiffuse(flat(1.0), 1.5, roughness)
    cosine = np.cos(np.radians(degrees))
    albedo = surface._coat_albedo(cosine) + 1.0 - reflected(cosine, 1.5)[0]
    assert albedo <= CoatedDiffuse.ALBEDO_BOUND
    if roughness < 0.02:
        assert albedo == pytest.approx(1.0, abs=2e-3)


def test_instruments_read_the_spectrum_that_the_body_was_found_from():
    """The reading by quadrature of f_r in place of the closed form; the coat is wide enough for it."""
    coat = CoatedDiffuse(flat(0.0), 1.5, 0.4)
    at_45 = coat.reads(flat(*READING), "0/45")
    np.testing.assert_allclose(np.pi * at_45.eval(spherical(np.pi / 4, 2.0), spherical(0.0, 0.0)), READING, rtol=1e-12)
    wo, share = hemisphere(96)
    sphere = spherical(np.radians(8.0), 0.0)
    included, excluded = (coat.reads(flat(*READING), words) for words in ("d/8 SCI", "de:8"))
    np.testing.assert_allclose(np.pi * share @ included.eval(sphere, wo), READING, rtol=1e-4)
    body, _ = excluded.lobes()
    np.testing.assert_allclose(np.pi * share @ body.brdf.eval(sphere, wo), READING, rtol=1e-4)
    # Gloss that was counted is no colour of the body.
    assert np.all(included.diffuse.samples < excluded.diffuse.samples)


@pytest.mark.parametrize("gloss", [0.002, 0.016, 0.06])
def test_a_smooth_coat_reads_as_fresnel_has_it(gloss):
    """Saunderson's correction: of a sphere with the specular component, the 4 % of glass more than without."""
    coat = CoatedDiffuse(flat(0.0), 1.5, gloss)
    more = 0.2 + reflected(np.cos(np.radians(8.0)), 1.5)[0]
    included, excluded = coat.reads(flat(more), "di:8"), coat.reads(flat(0.2), "de:8")
    np.testing.assert_allclose(included.diffuse.samples, excluded.diffuse.samples, rtol=1e-3)


@pytest.mark.parametrize("geometry", ["", "d:8", "directional, field spectrometer", "45as15", "di:8 and de:8 as told"])
def test_a_geometry_that_leaves_the_gloss_open_is_asked_about(geometry):
    with pytest.raises(InputError) as refusal:
        CoatedDiffuse(flat(0.0), 1.5, 0.05).reads(flat(0.3), geometry)
    assert refusal.value.field == "geometry" and "de:8" in str(refusal.value)


@pytest.mark.parametrize(
    ("reading", "geometry", "says"),
    [
        ((0.3, 0.03, 0.3), "di:8", "darker than the coat alone"),
        ((0.3, 0.3, 0.97), "de:8", "brighter than white"),
        ((0.3, 0.3, 0.0001), "d/8 SCI", "darker than the coat alone"),
    ],
)
def test_readings_that_no_body_gives_are_refused_by_wavelength(reading, geometry, says):
    with pytest.raises(InputError, match=says) as refusal:
        CoatedDiffuse(flat(0.0), 1.5, 0.05).reads(flat(*reading), geometry)
    wrong = WAVELENGTHS[int(np.argmax(np.abs(np.array(reading) - 0.3)))]
    assert f"at {wrong:g} nm, read at {geometry}" in str(refusal.value)
