"""Absolute values of the analytic models, computed another way, and what they refuse."""

import functools
import math
from importlib.resources import files

import numpy as np
import pytest
from metamer.materials.analytic import (
    MODELS,
    AshikhminShirley,
    CoatedDiffuse,
    CookTorrance,
    Lambert,
    MetallicRoughness,
    OrenNayar,
)
from metamer.materials.analytic.cook_torrance import beckmann, fresnel, ggx, smith_beckmann, smith_ggx, v_cavity
from metamer.materials.core.directions import TAU, spherical
from metamer.runtime.errors import InputError
from metamer.spectral.spectrum import Spectrum

WAVELENGTHS = np.array([450.0, 550.0, 650.0])
UP = np.array([0.0, 0.0, 1.0])


def flat(*values):
    return Spectrum.sampled(WAVELENGTHS, np.broadcast_to(values, 3))


def test_models_are_the_files_of_the_folder():
    folder = files("metamer.materials.analytic")
    twins = {entry.name.removesuffix(".glsl") for entry in folder.iterdir() if entry.name.endswith(".glsl")}
    modules = {entry.name.removesuffix(".py") for entry in folder.iterdir() if entry.name.endswith(".py")}
    beside = {"__init__", "fluorescent", "glossmeter", "instrument", "model"}
    assert {model.NAME for model in MODELS} == twins == modules - beside
    assert [model.__module__.rpartition(".")[2] for model in MODELS] == [model.NAME for model in MODELS]


def test_lambert_is_rho_over_pi():
    value = Lambert(flat(0.0, 0.5, 1.0)).eval(spherical(0.3, 1.0), spherical(1.2, 4.0))
    np.testing.assert_allclose(value, [0.0, 0.15915494309189535, 0.3183098861837907], rtol=1e-15)


def oren_nayar_in_angles(rho, sigma, theta_i, theta_o, phi):
    """The published formula, line by line, one wavelength, angles only."""
    a, b, s2, c = max(theta_i, theta_o), min(theta_i, theta_o), sigma**2, math.cos(phi)
    c1 = 1 - 0.5 * s2 / (s2 + 0.33)
    c2 = 0.45 * s2 / (s2 + 0.09) * (math.sin(a) if c >= 0 else math.sin(a) - (2 * b / math.pi) ** 3)
    c3 = 0.125 * s2 / (s2 + 0.09) * (4 * a * b / math.pi**2) ** 2
    first = rho / math.pi * (c1 + c * c2 * math.tan(b) + (1 - abs(c)) * c3 * math.tan((a + b) / 2))
    second = 0.17 * rho**2 / math.pi * s2 / (s2 + 0.13) * (1 - c * (2 * b / math.pi) ** 2)
    return first + second


@pytest.mark.parametrize("phi", [0.0, 0.8, 1.6, 2.9, math.pi])
@pytest.mark.parametrize("theta_i, theta_o", [(0.0, 0.7), (0.4, 1.1), (1.2, 0.9), (1.0, 1.0)])
def test_oren_nayar_against_the_formula_in_angles(theta_i, theta_o, phi):
    found = OrenNayar(flat(0.1, 0.5, 0.9), 0.52).eval(spherical(theta_i, 1.1), spherical(theta_o, 1.1 + phi))
    expected = [oren_nayar_in_angles(rho, 0.52, theta_i, theta_o, phi) for rho in (0.1, 0.5, 0.9)]
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_oren_nayar_by_hand_at_normal_incidence():
    # Only C1 and the interreflection are left: s2 = 0.25 gives C1 = 1 - 0.125/0.58 and 0.17 x 0.25/0.38.
    value = np.pi * OrenNayar(flat(0.5), 0.5).eval(UP, UP)
    np.testing.assert_allclose(value, 0.5 * (1 - 0.125 / 0.58) + 0.25 * 0.17 * 0.25 / 0.38, rtol=1e-14)


def test_oren_nayar_interreflection_saturates_colour():
    spectrum = OrenNayar(flat(0.2, 0.4, 0.8), 0.8).eval(UP, UP)
    assert spectrum[2] / spectrum[0] > 4.0


def test_oren_nayar_is_black_where_the_approximation_goes_below_zero():
    theta = math.radians(85)
    assert oren_nayar_in_angles(0.05, 1.2, theta, theta, math.pi) < 0
    assert OrenNayar(flat(0.05), 1.2).eval(spherical(theta, 0.0), spherical(theta, math.pi)).max() == 0


def test_oren_nayar_exceeds_one_by_as_much_as_it_says():
    white = OrenNayar(flat(1.0), 0.3)
    nodes, weights = np.polynomial.legendre.leggauss(200)
    theta, phi = 0.25 * np.pi * (nodes + 1), TAU * (np.arange(200) + 0.5) / 200
    wo = spherical(theta[:, None], phi)
    flow = (0.25 * np.pi * weights * np.sin(theta) * np.cos(theta))[:, None] * TAU / 200
    albedo = np.sum(flow * white.eval(spherical(np.radians(89.99), 0.0), wo)[..., 0])
    assert albedo == pytest.approx(1.051, abs=5e-4)
    assert albedo <= OrenNayar.ALBEDO_BOUND


def test_ashikhmin_shirley_by_hand_at_normal_incidence():
    # h = n: 33/(8 pi) x 0.05 of highlight, 28/(23 pi) x 0.4 x 0.95 x (1 - 1/32)^2 of body.
    value = AshikhminShirley(flat(0.4), flat(0.05), 32.0, 32.0).eval(UP, UP)
    np.testing.assert_allclose(value, 33 / (8 * math.pi) * 0.05 + 0.38 * 28 / (23 * math.pi) * (31 / 32) ** 2)
    np.testing.assert_allclose(value, 0.2038448, rtol=1e-6)


def test_ashikhmin_shirley_by_hand_off_the_mirror_direction():
    # Light at 60 deg along x, viewer along the normal: h at 30 deg in the plane of u, so that only n_u acts.
    gloss, c = 0.04, math.cos(math.radians(30))
    fresnel_term = gloss + (1 - gloss) * (1 - c) ** 5
    for azimuth, exponent in ((0.0, 10.0), (0.5 * math.pi, 40.0)):
        brdf = AshikhminShirley(flat(0.0), flat(gloss), 10.0, 40.0)
        expected = math.sqrt(11 * 41) / (8 * math.pi) * c**exponent / (c * 1.0) * fresnel_term
        np.testing.assert_allclose(brdf.eval(spherical(math.radians(60), azimuth), UP), expected, rtol=1e-12)


def test_ashikhmin_shirley_exponent_of_a_hundred_thousand_keeps_its_width():
    # Half a lobe's height lies where n sin^2 / 2 = log 2, 0.2 deg from the normal.
    brdf = AshikhminShirley(flat(0.0), flat(1.0), 1e5, 1e5)
    lean = math.asin(math.sqrt(2 * math.log(2) / 1e5))
    wi, wo = spherical(0.5 + lean, 0.0), spherical(0.5 - lean, math.pi)
    peak = brdf.eval(spherical(0.5, 0.0), spherical(0.5, math.pi))
    assert (brdf.eval(wi, wo) / peak)[0] == pytest.approx(0.5, rel=3 * lean)


def test_fresnel_at_normal_incidence():
    eta, k = np.array([1.5, 0.2, 1.0]), np.array([0.0, 3.9, 0.0])
    expected = ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)
    np.testing.assert_allclose(fresnel(np.ones(1), np.zeros(1), eta, k)[0], expected, rtol=1e-14, atol=1e-30)
    np.testing.assert_allclose(expected[0], 0.04)


def test_fresnel_against_complex_arithmetic():
    theta = np.radians(np.concatenate([np.linspace(0, 89.9, 200), [56.309932474020215]]))
    eta, k = np.array([1.5, 0.05, 2.9, 0.7, 1.0]), np.array([0.0, 3.0, 3.3, 0.0, 1e-3])
    found = fresnel(np.cos(theta) ** 2, np.sin(theta) ** 2, eta, k)
    index, cos_i = eta + 1j * k, np.cos(theta)[:, None]
    cos_t = np.sqrt(1 - (np.sin(theta)[:, None] / index) ** 2)
    across = np.abs((cos_i - index * cos_t) / (cos_i + index * cos_t)) ** 2
    along = np.abs((index * cos_i - cos_t) / (index * cos_i + cos_t)) ** 2
    np.testing.assert_allclose(found, 0.5 * (across + along), rtol=1e-9, atol=1e-12)
    # Brewster's angle of n = 1.5: only the part across the plane is left, ((1 - n^2)/(1 + n^2))^2 / 2.
    assert found[-1, 0] == pytest.approx(0.5 * (1.25 / 3.25) ** 2, rel=1e-12)
    # Light inside a denser medium is totally reflected beyond the critical angle.
    np.testing.assert_allclose(found[theta > np.arcsin(0.7) + 1e-3, 3], 1.0, rtol=1e-12)


@functools.cache
def half_vectors():
    """Directions over the hemisphere (N,3), packed towards the normal, with their solid angles (N,)."""
    nodes, weights = np.polynomial.legendre.leggauss(400)
    u, weights = 0.5 * (nodes + 1), 0.5 * weights
    theta, phi = 0.5 * np.pi * u**4, TAU * (np.arange(96) + 0.5) / 96
    solid = weights * 2 * np.pi * u**3 * np.sin(theta) * TAU / 96
    return spherical(theta[:, None], phi).reshape(-1, 3), np.repeat(solid, 96)


@pytest.mark.parametrize("roughness", [0.01, 0.2, 0.6, 1.0])
@pytest.mark.parametrize("density", [beckmann, ggx])
def test_facets_cover_the_surface_once(density, roughness):
    h, solid = half_vectors()
    facets = density(h[:, 2] ** 2, h[:, 0] ** 2 + h[:, 1] ** 2, roughness)
    assert np.sum(facets * h[:, 2] * solid) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("degrees", [0, 40, 70, 85])
@pytest.mark.parametrize("roughness", [0.1, 0.4, 0.9])
@pytest.mark.parametrize("density, one_sided, slack", [(ggx, smith_ggx, 1e-5), (beckmann, smith_beckmann, 6e-3)])
def test_visible_facets_cover_what_the_viewer_sees(density, one_sided, slack, roughness, degrees):
    """The integral of D G1 (h.w) over the facets that face w is the area seen, cos(theta) (Walter 2007, sec. 4)."""
    h, solid = half_vectors()
    w = spherical(np.radians(degrees), 0.0)
    facets = density(h[:, 2] ** 2, h[:, 0] ** 2 + h[:, 1] ** 2, roughness) * np.maximum(h @ w, 0)
    seen = np.sum(facets * solid) * 2 * one_sided(w[None], roughness)[0]
    assert seen == pytest.approx(1.0, abs=slack)


def test_v_cavity_is_the_minimum_of_the_paper():
    random = np.random.default_rng(5)
    wi, wo = (spherical(np.arccos(random.uniform(0.02, 1, 500)), random.random(500) * TAU) for _ in "io")
    h = (wi + wo) / np.linalg.norm(wi + wo, axis=-1, keepdims=True)
    cos_i, cos_o, cos_h, cos_d = wi[:, 2], wo[:, 2], h[:, 2], np.sum(h * wo, axis=-1)
    expected = np.minimum(1, np.minimum(2 * cos_h * cos_o / cos_d, 2 * cos_h * cos_i / cos_d))
    found = v_cavity(cos_i, cos_o, cos_h / cos_d) * 4 * cos_i * cos_o
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_cook_torrance_by_hand_at_normal_incidence():
    # D = 1 / (pi m^2), G = 1, F = 0.04: 0.04 / (4 pi 0.04) and the body's share.
    brdf = CookTorrance(flat(0.3), np.full(3, 1.5), np.zeros(3), 0.2, 0.6, masking="smith")
    np.testing.assert_allclose(brdf.eval(UP, UP), 0.6 / (4 * math.pi) + 0.4 * 0.3 / math.pi, rtol=1e-12)


def test_a_nearly_smooth_metal_reflects_its_fresnel_reflectance():
    eta, k = np.array([1.4, 0.6, 0.2]), np.array([1.9, 2.1, 3.6])
    brdf = CookTorrance(flat(0.0), eta, k, 0.002, 1.0, "beckmann", "smith")
    wi, (h, solid) = spherical(np.radians(50), 0.0), half_vectors()
    wo = 2 * (h @ wi)[:, None] * h - wi
    flow = solid * 4 * np.maximum(h @ wi, 0) * np.maximum(wo[:, 2], 0)
    cos2 = np.cos(np.radians(50)) ** 2
    expected = fresnel(np.array([cos2]), np.array([1 - cos2]), eta, k)[0]
    np.testing.assert_allclose(flow @ brdf.eval(wi, wo), expected, rtol=1e-4)


def test_lobes_are_those_with_a_weight():
    plastic = CookTorrance(flat(0.3), np.full(3, 1.5), np.zeros(3), 0.2, 0.6)
    metal = CookTorrance(flat(0.3), np.full(3, 0.2), np.full(3, 3.0), 0.2, 1.0)
    matte = CookTorrance(flat(0.3), np.full(3, 1.5), np.zeros(3), 0.2, 0.0)
    assert [[lobe.frame for lobe in brdf.lobes()] for brdf in (plastic, metal, matte)] == [["io", "hd"], ["hd"], ["io"]]


STORED = {
    Lambert: {"reflectance": [0.5] * 3},
    OrenNayar: {"reflectance": [0.5] * 3, "sigma": 0.5},
    AshikhminShirley: {"diffuse": [0.5] * 3, "specular": [0.1] * 3, "exponent_u": 10.0, "exponent_v": 10.0},
    CookTorrance: {
        "diffuse": [0.5] * 3,
        "eta": [1.5] * 3,
        "k": [0.0] * 3,
        "roughness": 0.3,
        "specular_weight": 0.5,
        "distribution": "ggx",
        "masking": "smith",
    },
    MetallicRoughness: {
        "diffuse": [0.5] * 3,
        "specular": [0.04] * 3,
        "edge": 1.0,
        "alpha": 0.3,
        "coat": 0.5,
        "coat_alpha": 0.1,
    },
    CoatedDiffuse: {"diffuse": [0.5] * 3, "index": 1.5, "roughness": 0.05},
}


@pytest.mark.parametrize(
    "model, name, value, says",
    [
        (Lambert, "reflectance", [0.5, 1.2, 0.5], "1.2 at 550 nm"),
        (Lambert, "reflectance", [0.5, math.nan, 0.5], "not a number"),
        (Lambert, "reflectance", [0.5, -0.1, 0.5], "negative"),
        (Lambert, "reflectance", [50.0, 40.0, 30.0], "percent"),
        (Lambert, "reflectance", [0.5, 0.5], "shape (2,)"),
        (Lambert, "reflectance", "red", "not numbers"),
        (OrenNayar, "sigma", -0.1, ">= 0"),
        (OrenNayar, "sigma", 30.0, "<= 1.5708"),
        (OrenNayar, "sigma", math.nan, "nan"),
        (OrenNayar, "sigma", "rough", "'rough'"),
        (AshikhminShirley, "exponent_u", 0.0, "> 0"),
        (AshikhminShirley, "exponent_v", -3.0, "> 0"),
        (AshikhminShirley, "exponent_v", math.inf, "inf"),
        (AshikhminShirley, "specular", [0.1, 0.1, 1.5], "1.5 at 650 nm"),
        (CookTorrance, "eta", [1.5, 0.0, 1.5], "> 0"),
        (CookTorrance, "k", [0.0, -1.0, 0.0], "-1 at 550 nm"),
        (CookTorrance, "k", [0.0, 0.0], "shape (2,)"),
        (CookTorrance, "roughness", 0.0, "> 0"),
        (CookTorrance, "roughness", 1.5, "<= 1"),
        (CookTorrance, "specular_weight", 1.1, "<= 1"),
        (CookTorrance, "distribution", "bekmann", "nearest: beckmann"),
        (CookTorrance, "masking", "none", "v_cavity, smith"),
        (CoatedDiffuse, "index", 1.0, ">= 1.2"),
        (CoatedDiffuse, "index", math.nan, "nan"),
        (CoatedDiffuse, "roughness", 0.0, "> 0"),
        (CoatedDiffuse, "diffuse", [0.5, 0.5, 1.1], "1.1 at 650 nm"),
    ],
)
def test_bad_parameters_name_the_field_and_the_value(model, name, value, says):
    with pytest.raises(InputError) as refusal:
        model.from_parameters(WAVELENGTHS, STORED[model] | {name: value})
    assert refusal.value.field == name
    assert says in str(refusal.value)


@pytest.mark.parametrize("model", MODELS)
def test_missing_and_unknown_parameters_are_named(model):
    stored = STORED[model]
    assert model.from_parameters(WAVELENGTHS, stored).parameters().keys() == stored.keys()
    for name in stored:
        with pytest.raises(InputError, match=name):
            model.from_parameters(WAVELENGTHS, {key: value for key, value in stored.items() if key != name})
    with pytest.raises(InputError, match="colour"):
        model.from_parameters(WAVELENGTHS, stored | {"colour": 1.0})


def test_spectra_on_different_wavelengths_are_refused():
    elsewhere = Spectrum.sampled([400.0, 500.0, 600.0], [0.1] * 3)
    with pytest.raises(InputError, match=r"specular.*wavelengths differ") as refusal:
        AshikhminShirley(flat(0.5), elsewhere, 10.0, 10.0)
    assert "resample" in str(refusal.value)


def test_a_light_is_not_a_reflectance():
    with pytest.raises(InputError, match="quantity"):
        Lambert(Spectrum.sampled(WAVELENGTHS, [0.5] * 3, "emission"))


def test_models_survive_pickling_with_their_lobes():
    import pickle

    brdf = CookTorrance.from_parameters(WAVELENGTHS, STORED[CookTorrance])
    wi, wo = spherical(0.4, 0.0), spherical(0.5, 3.0)
    copies = pickle.loads(pickle.dumps(brdf.lobes()))
    np.testing.assert_allclose(sum(lobe.brdf.eval(wi, wo) for lobe in copies), brdf.eval(wi, wo), rtol=1e-14)
