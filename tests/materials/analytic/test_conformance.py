"""Laws that every BRDF has to keep, tried on every analytic model at the ends of its parameters."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from metamer.materials.analytic import MODELS
from metamer.materials.core.directions import TAU, io_from_half_difference, spherical

WAVELENGTHS = np.array([400.0, 500.0, 600.0, 700.0])
EXAMPLES = [
    pytest.param(brdf, id=f"{model.NAME}-{index}")
    for model in MODELS
    for index, brdf in enumerate(model.examples(WAVELENGTHS))
]
every_brdf = pytest.mark.parametrize("brdf", EXAMPLES)

GRAZING = np.radians(89.9)
polar = st.floats(0.0, GRAZING)
turn = st.floats(0.0, TAU)


def pairs(count, seed):
    """Pairs of every kind: uniform over the hemisphere, around the mirror direction, retro, and grazing."""
    random = np.random.default_rng(seed)
    theta_i, theta_o = np.arccos(random.random((2, count)) * (1 - np.cos(GRAZING)) + np.cos(GRAZING))
    phi_i, phi_o = random.random((2, count)) * TAU
    wi, wo = spherical(theta_i, phi_i), spherical(theta_o, phi_o)
    lean = 0.5 * np.pi * random.random(count) ** 8
    near_i, near_o = io_from_half_difference(lean, theta_i, phi_i, phi_o)
    lit = (near_i[:, 2] > 0) & (near_o[:, 2] > 0)
    steep = spherical(np.full(count, GRAZING), phi_i)
    return np.concatenate([wi, near_i[lit], wi, steep]), np.concatenate([wo, near_o[lit], wi, wo])


def evidence(worst, wi, wo, *values):
    worst = np.unravel_index(int(worst), values[0].shape)
    row = worst[0]
    return f"at {worst}: wi {wi[row]}, wo {wo[row]}: " + " against ".join(repr(v[worst]) for v in values)


@every_brdf
def test_reciprocity(brdf):
    wi, wo = pairs(3000, 1)
    there, back = brdf.eval(wi, wo), brdf.eval(wo, wi)
    gap = np.abs(there - back) - 1e-12 * np.abs(there)
    assert gap.max() <= 0, evidence(gap.argmax(), wi, wo, there, back)


@every_brdf
def test_finite_and_not_negative_up_to_89_9_degrees(brdf):
    wi, wo = pairs(3000, 2)
    values = brdf.eval(wi, wo)
    assert np.isfinite(values).all(), evidence((~np.isfinite(values)).argmax(), wi, wo, values)
    assert values.min() >= 0, evidence(values.argmin(), wi, wo, values)


@every_brdf
def test_finite_at_the_last_direction_above_the_horizon(brdf):
    level = np.array([[1.0, 0.0, 6e-17], [-1.0, 0.0, 6e-17], [0.0, 1.0, 6e-17], [0.0, 0.0, 1.0]])
    values = brdf.eval(level[:, None], level[None])
    assert np.isfinite(values).all() and values.min() >= 0


@every_brdf
@settings(max_examples=50, deadline=None)
@given(theta_i=polar, theta_o=polar, phi_i=turn, phi_o=turn)
def test_reciprocal_finite_and_not_negative_wherever_hypothesis_looks(brdf, theta_i, theta_o, phi_i, phi_o):
    wi, wo = spherical(theta_i, phi_i), spherical(theta_o, phi_o)
    there, back = brdf.eval(wi, wo), brdf.eval(wo, wi)
    assert np.isfinite(there).all() and there.min() >= 0
    np.testing.assert_allclose(there, back, rtol=1e-12)


@every_brdf
def test_zero_on_and_below_the_horizon(brdf):
    above = spherical(0.4, 0.3)
    for low in (spherical(2.0, 1.0), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, -1.0])):
        for wi, wo in ((low, above), (above, low), (low, low)):
            np.testing.assert_array_equal(brdf.eval(wi, wo), np.zeros(len(WAVELENGTHS)))


@every_brdf
def test_turning_both_directions_changes_an_isotropic_brdf_nowhere(brdf):
    wi, wo = pairs(500, 3)
    wi, wo = wi[wi[:, 2] > 0.01], wo[wi[:, 2] > 0.01]
    angle = 1.234
    turned = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    values, elsewhere = brdf.eval(wi, wo), brdf.eval(wi @ turned.T, wo @ turned.T)
    # A lobe of exponent 1e5 turns one rounding error of the half vector into 1e-10.
    gap = np.abs(values - elsewhere) - (1e-8 * np.abs(values) + 1e-12)
    if brdf.isotropic:
        assert gap.max() <= 0, evidence(gap.argmax(), wi, wo, values, elsewhere)
    else:
        assert gap.max() > 0, "says that it is anisotropic, and is not"


@every_brdf
def test_mirror_symmetry_in_the_plane_of_x_and_the_normal(brdf):
    wi, wo = pairs(500, 4)
    across = np.array([1.0, -1.0, 1.0])
    np.testing.assert_allclose(brdf.eval(wi * across, wo * across), brdf.eval(wi, wo), rtol=1e-12)


@every_brdf
def test_lobes_sum_to_the_whole(brdf):
    wi, wo = pairs(1000, 5)
    lobes = brdf.lobes()
    whole = brdf.eval(wi, wo)
    np.testing.assert_allclose(sum(lobe.brdf.eval(wi, wo) for lobe in lobes), whole, rtol=1e-12)
    assert all(lobe.frame in ("io", "hd") for lobe in lobes)
    assert all(lobe.brdf.isotropic or not brdf.isotropic for lobe in lobes)
    assert all(np.array_equal(lobe.brdf.wavelengths_nm, WAVELENGTHS) for lobe in lobes)


@every_brdf
def test_batches_broadcast_and_blocks_do_not_show(brdf):
    wi, wo = pairs(1500, 6)
    whole = brdf.eval(wi, wo)
    assert len(wi) > 2048, "more than one block"
    np.testing.assert_array_equal(whole[::7], brdf.eval(wi[::7], wo[::7]))
    grid = brdf.eval(wi[:4, None], wo[None, :6])
    assert grid.shape == (4, 6, len(WAVELENGTHS))
    np.testing.assert_allclose(grid[2, 3], brdf.eval(wi[2], wo[3]), rtol=1e-14)
    # Rows below the horizon take the gathering path.
    wi[5] *= -1
    np.testing.assert_allclose(brdf.eval(wi, wo)[6:], whole[6:], rtol=1e-14)


@every_brdf
def test_float32_directions_are_computed_in_float64(brdf):
    wi, wo = (w.astype(np.float32) for w in pairs(100, 8))
    np.testing.assert_array_equal(brdf.eval(wi, wo), brdf.eval(wi.astype(float), wo.astype(float)))
    assert brdf.eval(wi, wo).dtype == np.float64


@every_brdf
def test_parameters_round_trip(brdf):
    rebuilt = type(brdf).from_parameters(WAVELENGTHS, brdf.parameters())
    wi, wo = pairs(50, 7)
    np.testing.assert_array_equal(rebuilt.eval(wi, wo), brdf.eval(wi, wo))
    assert rebuilt.parameters().keys() == brdf.parameters().keys()


@every_brdf
@pytest.mark.parametrize("degrees", [0, 30, 60, 80, 88])
def test_no_more_light_leaves_than_arrives(brdf, degrees):
    for azimuth in (0.0,) if brdf.isotropic else (0.0, 0.9, 0.5 * np.pi):
        albedo = directional_albedo(brdf, spherical(np.radians(degrees), azimuth))
        # The quadrature is good to 1e-3 where it is worst, at the edge of a narrow lobe cut by the horizon.
        assert albedo.max() <= brdf.ALBEDO_BOUND + 1e-3, f"albedo {albedo} at azimuth {azimuth}"
        assert albedo.min() >= 0


def test_the_quadrature_finds_known_albedos():
    lambert, *_ = MODELS[0].examples(WAVELENGTHS)
    np.testing.assert_allclose(
        directional_albedo(lambert, spherical(0.7, 0.0)), lambert.parameters()["reflectance"], atol=1e-12
    )


def test_white_furnace():
    """In a uniform surround of radiance 1 a surface shows its albedo: 1 for the perfect diffuser; others keep
    to their model's bound."""
    shown, bounds = {}, {}
    for model in MODELS:
        for index, brdf in enumerate(model.examples(WAVELENGTHS)):
            shown[model.NAME, index] = directional_albedo(brdf, spherical(np.radians(40), 0.0))
            bounds[model.NAME, index] = brdf.ALBEDO_BOUND
    assert shown["lambert", 0][-1] == pytest.approx(1.0, abs=1e-12)
    excess = {key: albedo.max() for key, albedo in shown.items() if albedo.max() > bounds[key] + 1e-9}
    assert not excess


def directional_albedo(brdf, wi, nodes=128):
    """Integral of f_r cos(theta_o) over the hemisphere (L,), each lobe on a grid that suits its frame.

    A highlight is integrated over half vectors, packed towards the normal, with d_wo = 4 (h.wi) d_wh.
    """
    total = np.zeros(len(brdf.wavelengths_nm))
    u, weight_u = np.polynomial.legendre.leggauss(nodes)
    u, weight_u = 0.5 * (u + 1), 0.5 * weight_u
    phi, weight_phi = TAU * (np.arange(nodes) + 0.5) / nodes, TAU / nodes
    for lobe in brdf.lobes():
        packed = 4 if lobe.frame == "hd" else 1
        theta = 0.5 * np.pi * u**packed
        weight = weight_u * 0.5 * np.pi * packed * u ** (packed - 1) * np.sin(theta) * weight_phi
        w = spherical(theta[:, None], phi)
        if lobe.frame == "hd":
            along = w @ wi
            wo = 2 * along[..., None] * w - wi
            jacobian = 4 * np.maximum(along, 0)
        else:
            wo, jacobian = w, np.ones(w.shape[:-1])
        flow = weight[:, None] * jacobian * np.maximum(wo[..., 2], 0)
        total += np.tensordot(flow, lobe.brdf.eval(wi, wo), axes=2)
    return total
