"""Fits of whole materials: the budget, the declared error, and the hard cases."""

import dataclasses

import numpy as np
import pytest
from metamer.materials.analytic import AshikhminShirley, CoatedDiffuse, CookTorrance, Lambert, OrenNayar
from metamer.materials.core.axes import Axis
from metamer.materials.core.brdf import Brdf, Lobe
from metamer.materials.core.directions import spherical
from metamer.materials.core.protocol import LIGHT_ANGLES_DEG, LIGHTS, sphere_protocol
from metamer.materials.fitting.brdf_table import tabulate
from metamer.materials.fitting.fit import fit
from metamer.materials.fitting.grids import filled, floored, lobe_axes, node_weights
from metamer.runtime.errors import InputError
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

L = len(WORKING_WAVELENGTHS_NM)
RAMP = np.linspace(0.0, 1.0, L)
PIXELS = 64


def reflectance(values) -> Spectrum:
    return Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.broadcast_to(values, (L,)).astype(float))


RED, BLACK, DARK = reflectance(0.05 + 0.6 * RAMP**2), reflectance(0.0), reflectance(0.03)
GREY = reflectance(0.04)


@dataclasses.dataclass(frozen=True, eq=False)
class Scaled(Brdf):
    """A Lambert surface times a function of the directions, for making awkward ones."""

    shape: object
    spectrum: np.ndarray
    wavelengths_nm: np.ndarray = dataclasses.field(default_factory=lambda: WORKING_WAVELENGTHS_NM)
    isotropic: bool = True

    def eval(self, wi, wo):
        lit = (wi[..., 2] > 0) & (wo[..., 2] > 0)
        return (np.where(lit, self.shape(wi, wo), 0.0) / np.pi)[..., None] * self.spectrum


@pytest.mark.slow_cases("cook_torrance-10_1")
@pytest.mark.parametrize(
    ("brdf", "terms"),
    [
        (Lambert(RED), 1),
        (OrenNayar(RED, 0.35), 8),
        (AshikhminShirley(RED, GREY, 20.0, 20.0), 4),
        (AshikhminShirley(DARK, GREY, 200.0, 200.0), 4),
        (CookTorrance(RED, 1.49 + 0.02 * RAMP, 0.0 * RAMP, 0.15, 0.5), 10),
        (CookTorrance(RED, 0.2 + 1.3 * RAMP, 3.6 - 1.7 * RAMP, 0.1, 1.0), 10),
    ],
    ids=lambda value: getattr(value, "NAME", value),
)
def test_every_kind_of_material_meets_its_budget_with_few_terms(brdf, terms):
    found = fit(brdf, pixels=PIXELS)
    assert found.rank <= terms
    assert found.error.p99 <= 0.7
    assert found.error.mean <= 0.2
    assert found.error.most_negative > -0.01
    assert found.fast.error == found.error


def test_lobes_that_meet_the_budget_once_they_are_refined_together_get_no_more_terms():
    yellow = reflectance(0.13 + 0.76 / (1.0 + np.exp(-(WORKING_WAVELENGTHS_NM - 505.0) / 12.0)))
    trials = []
    found = fit(CoatedDiffuse(yellow, 1.5, 0.016), pixels=32, tried=trials.append)
    # The grid of the body alone is too coarse, with any number of terms.
    assert min(trial.score for trial in trials if not trial.joint and trial.lobe == 0) > 0.5
    assert found.rank == max(trial.rank for trial in trials if trial.joint) == 2 and found.score <= 0.5


def test_the_declared_error_is_that_of_the_packs_as_a_brdf():
    brdf = AshikhminShirley(RED, GREY, 20.0, 20.0)
    found = fit(brdf, pixels=PIXELS)
    sphere = sphere_protocol(PIXELS).under(found.error.light)
    again = sphere.compare(sphere.reference(brdf), sphere.reference(found.fast))
    for name in ("mean", "p95", "p99", "maximum"):
        assert getattr(again, name) == pytest.approx(getattr(found.error, name), rel=1e-6)
    assert f"{PIXELS} x {PIXELS}" in found.error.protocol
    assert found.error.observer == "1931_2"
    assert [one.light for one in found.error.lights] == list(LIGHTS)
    assert found.error.p99 == max(one.p99 for one in found.error.lights)


def test_a_finer_sphere_tells_the_same():
    brdf = AshikhminShirley(RED, GREY, 20.0, 20.0)
    found = fit(brdf, pixels=PIXELS)
    fine = sphere_protocol(256).under(found.error.light)
    error = fine.compare(fine.reference(brdf), fine.sample(found.fast))
    assert error.p99 == pytest.approx(found.error.p99, rel=0.1)
    assert error.mean == pytest.approx(found.error.mean, rel=0.1)


def test_half_a_sphere_has_the_statistics_of_the_whole():
    brdf = OrenNayar(RED, 0.35)
    fast = fit(brdf, ranks=(2,), pixels=32).fast
    half, whole = (sphere_protocol(PIXELS, isotropic) for isotropic in (True, False))
    assert 2 * len(half.wi) == len(whole.wi)
    one, other = (sphere.compare(sphere.reference(brdf), sphere.sample(fast)) for sphere in (half, whole))
    assert one.mean == pytest.approx(other.mean, rel=1e-9)
    assert one.maximum == pytest.approx(other.maximum, rel=1e-9)


def test_the_protocol_shows_a_perfect_diffuser_at_its_cosine():
    sphere = sphere_protocol(PIXELS)
    xyz = sphere.reference(Lambert(reflectance(1.0)))
    np.testing.assert_allclose(xyz[:, 1], sphere.wi[:, 2], rtol=1e-12)
    assert sphere.wi[:, 2].min() > 0.01
    apart = np.degrees(np.arccos(np.sum(sphere.wi * sphere.wo, axis=-1)))
    assert set(np.round(np.unique(np.round(apart, 6)))) == set(LIGHT_ANGLES_DEG)


@pytest.mark.parametrize("specular", [0.0, 0.05])
def test_a_separable_material_is_found_at_rank_one(specular):
    """Lambert, and the diffuse part of Ashikhmin-Shirley, are one product in frame io."""
    brdf = AshikhminShirley(RED, reflectance(specular), 50.0, 50.0).lobes()[0].brdf
    found = fit(brdf, pixels=PIXELS)
    assert found.rank == 1
    assert found.error.relative_error < 1e-5
    assert found.error.p99 < 0.1


def test_a_separable_sum_is_found_at_its_exact_rank():
    def shape(wi, wo):
        return 0.5 * wi[..., 2] * wo[..., 2] + 0.2 * np.sqrt(1 - wi[..., 2] ** 2) * (1 - wo[..., 2])

    found = fit(Scaled(shape, RED.samples), budget=0.02, pixels=PIXELS)
    assert found.rank == 2
    assert found.error.relative_error < 1e-4


def test_a_black_material_is_zero_everywhere():
    found = fit(Lambert(BLACK), pixels=PIXELS)
    assert found.rank == 1
    assert not found.fast.packs[0].palette.values[0].any()
    assert (found.error.maximum, found.error.relative_error, found.error.most_negative) == (0.0, 0.0, 0.0)


def test_a_lobe_without_light_is_left_out():
    found = fit(AshikhminShirley(BLACK, GREY, 20.0, 20.0), pixels=PIXELS)
    assert [pack.frame for pack in found.fast.packs] == ["hd"]


@pytest.mark.slow_cases("10000.0")
@pytest.mark.parametrize("exponent", [1.0, 10000.0])
def test_exponents_from_1_to_10000(exponent):
    brdf = AshikhminShirley(DARK, GREY, exponent, exponent)
    found = fit(brdf, pixels=PIXELS)
    assert found.error.p99 <= 0.7
    # In the middle of the highlight, which a narrow lobe shows in too few pixels to count.
    theta = np.radians([5.0, 20.0, 40.0])
    wi, wo = spherical(theta, 0.0), spherical(theta, np.pi)
    np.testing.assert_allclose(found.fast.eval(wi, wo), brdf.eval(wi, wo), rtol=0.08)


def test_grazing_to_89_9_degrees_is_finite():
    brdf = AshikhminShirley(RED, GREY, 200.0, 200.0)
    packs = fit(brdf, pixels=PIXELS).fast.packs
    steep = np.radians(np.array([0.0, 60.0, 85.0, 89.0, 89.9]))
    theta_i, theta_o, phi = np.meshgrid(steep, steep, np.linspace(0.0, 2 * np.pi, 37), indexing="ij")
    wi, wo = spherical(theta_i, 0.0 * phi), spherical(theta_o, phi)
    shaded = sum(pack.shade(wi, wo) for pack in packs)
    assert np.isfinite(shaded).all()
    assert np.abs(shaded).max() <= (brdf.eval(wi, wo) * wi[..., 2:]).max()


def test_the_masked_region_never_influences_a_fit():
    brdf = AshikhminShirley(RED, GREY, 8.0, 8.0).lobes()[1].brdf
    luminous = np.full(L, np.pi / L)
    table = tabulate(brdf, "hd", lobe_axes(brdf, "hd", luminous), np.ones((L, 1)) / L)
    assert 0.05 < (~table.reached).mean() < 0.5
    spiked = table.values.copy()
    spiked[~table.reached] = 1e12
    values = filled(table)
    np.testing.assert_array_equal(filled(dataclasses.replace(table, values=spiked)), values)
    assert values.max() == table.values[table.reached].max()
    weights = node_weights(table, values[..., 0])
    assert not weights[~table.reached].any()
    share = np.sum((floored(weights, values) * values[..., 0] ** 2)[~table.reached])
    assert share < 1e-4 * np.sum(weights * values[..., 0] ** 2)


def test_the_same_seed_gives_the_same_bits():
    brdf = OrenNayar(RED, 0.35)
    one, other = (fit(brdf, seed=3, ranks=(4,), pixels=PIXELS) for _ in range(2))
    assert one.error == other.error
    for a, b in zip(one.fast.packs, other.fast.packs, strict=True):
        np.testing.assert_array_equal(a.palette.values, b.palette.values)
        for left, right in zip(a.factors, b.factors, strict=True):
            np.testing.assert_array_equal(left, right)


@pytest.mark.slow
def test_terms_stay_of_the_size_of_the_material():
    brdf = CookTorrance(RED, 0.2 + 1.3 * RAMP, 3.6 - 1.7 * RAMP, 0.3, 1.0)
    found = fit(brdf, ranks=(16,), pixels=PIXELS)
    sphere = sphere_protocol(PIXELS)
    (pack,) = found.fast.packs
    terms = pack.values_at(sphere.points.angles("hd"))[:, :, None] * np.abs(pack.spectra).max(axis=1)[None, :, None]
    assert np.abs(terms).max() < 100 * (brdf.eval(sphere.wi, sphere.wo) * sphere.wi[:, 2:]).max()


@pytest.mark.slow
def test_negative_reconstructions_are_reported_and_not_clipped():
    brdf = AshikhminShirley(BLACK, GREY, 4.0, 60.0)
    axes = (
        Axis("theta_h", 24, 1.5, "sqrt"),
        Axis("theta_d", 10, 0.5 * np.pi),
        Axis("phi_d", 9, 2 * np.pi, periodic=True),
        Axis("phi_h", 17, 2 * np.pi, periodic=True),
    )
    lobe = brdf.lobes()[-1]

    class OneLobe(Scaled):
        def lobes(self):
            return (Lobe("hd", lobe.brdf),)

        def eval(self, wi, wo):
            return lobe.brdf.eval(wi, wo)

    found = fit(OneLobe(None, GREY.samples, isotropic=False), axes=axes, ranks=(3,), pixels=32)
    sphere = sphere_protocol(32, isotropic=False)
    shaded = np.pi * sum(pack.shade(sphere.wi, sphere.wo) for pack in found.fast.packs)
    assert shaded.min() < 0.0, "the case is meant to ring below zero; choose a harder one"
    assert found.error.most_negative <= shaded.min()
    assert shaded.min() > -0.2 * shaded.max()


def test_an_anisotropic_material_on_a_small_grid():
    brdf = AshikhminShirley(RED, BLACK, 6.0, 6.0).lobes()[0].brdf
    turned = dataclasses.replace(brdf, isotropic=False)
    axes = (
        Axis("theta_i", 32, 0.5 * np.pi),
        Axis("theta_o", 32, 0.5 * np.pi),
        Axis("phi", 9, 2 * np.pi, periodic=True),
        Axis("phi_i", 9, 2 * np.pi, periodic=True),
    )
    found = fit(turned, axes=axes, pixels=32)
    assert found.rank == 1
    assert found.fast.packs[0].anisotropic
    assert found.error.p99 < 0.5


def test_spectra_are_stored_on_the_working_wavelengths():
    coarse = np.arange(400.0, 701.0, 10.0)
    ramp = 0.2 + 0.5 * (coarse - 400.0) / 300.0
    found = fit(Lambert(Spectrum.sampled(coarse, ramp)), pixels=PIXELS)
    (pack,) = found.fast.packs
    np.testing.assert_array_equal(pack.palette.basis.wavelengths_nm, WORKING_WAVELENGTHS_NM)
    assert found.error.p99 < 0.05
    # Held, not invented, where nothing was measured.
    np.testing.assert_allclose(pack.spectra[:, WORKING_WAVELENGTHS_NM < 400], pack.spectra[:, [4]] @ np.ones((1, 4)))


def test_unusable_arguments_are_refused():
    with pytest.raises(InputError, match="unusable budget"):
        fit(Lambert(RED), budget=0.0)
    with pytest.raises(InputError, match="one grid for several lobes"):
        fit(AshikhminShirley(RED, GREY, 20.0, 20.0), axes=lobe_axes(Lambert(RED), "io", np.ones(L)))
    with pytest.raises(InputError, match="not finite"):
        fit(Scaled(lambda wi, wo: np.where(wi[..., 2] > 0.5, np.nan, 1.0), RED.samples), pixels=PIXELS)


@pytest.mark.slow_cases("many terms", "many terms by angles of incidence")
@pytest.mark.parametrize(
    ("frame", "pixels", "ranks", "most"),
    [
        pytest.param("io", 16, (6,), 4.5, id="few terms by angles of incidence"),
        pytest.param(None, 32, (8, 24), 2.5, id="many terms"),
        pytest.param("io", 32, (8, 24), 2.5, id="many terms by angles of incidence"),
    ],
)
def test_terms_do_not_cancel_where_no_picture_looks(frame, pixels, ranks, most):
    """Told in angles of incidence, a highlight had light of -0.9 in the plane of incidence, or of -0.5: by rounding."""
    brdf = AshikhminShirley(RED, GREY, 40.0, 40.0)
    found = fit(brdf, frame=frame, budget=1.0, pixels=pixels, ranks=ranks)
    rng = np.random.default_rng(3)
    theta_i, theta_o = np.radians(89.9) * rng.random((2, 120_000)) ** 0.7
    phi = np.pi * (1.0 - rng.random(120_000) ** 2)
    wi, wo = spherical(theta_i, 0.0 * theta_i), spherical(theta_o, phi)
    shaded = np.pi * sum(pack.shade(wi, wo) for pack in found.fast.packs)
    original = np.pi * (brdf.eval(wi, wo) * wi[:, 2:]).max(axis=0)
    assert shaded.min() >= -0.02
    assert (shaded.max(axis=0) <= 2.0 * np.maximum(original, 0.02)).all()
    # The reported extremes were looked for there, too.
    assert -0.02 <= found.error.most_negative <= shaded.min() + 1e-3
    assert found.error.largest <= 2.0
    assert found.score <= most


@pytest.mark.slow
def test_a_budget_that_is_met_is_met_by_what_is_stored():
    """Half precision is not chosen where it would take the fit just over the budget."""
    brdf = CookTorrance(RED, 0.2 + 1.3 * RAMP, 3.6 - 1.7 * RAMP, 0.1, 1.0)
    alone = fit(brdf, pixels=PIXELS, precision="single")
    rounded = fit(brdf, pixels=PIXELS)
    assert rounded.storage.half and rounded.score > alone.score, "the case is meant to lose by rounding"
    just = fit(brdf, pixels=PIXELS, budget=0.5 * (alone.score + rounded.score))
    assert not just.storage.half and just.score == alone.score and "budget" in just.storage.reason
