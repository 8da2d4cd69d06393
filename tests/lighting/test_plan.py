"""The plan takes what the scene needs and no more, and says why in numbers."""

import numpy as np
import pytest
from metamer.lighting.plan import SPECTRAL_SHARE, bounce_basis, plan_scene
from metamer.materials.core.axes import Axis
from metamer.materials.factored.pack import FactoredBrdf, FactorPack
from metamer.runtime.errors import InputError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.colour_library import colour_science
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.folding import Folding
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.palette import Palette
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

AXES = (Axis("theta_i", 2, np.pi / 2), Axis("theta_o", 2, np.pi / 2), Axis("phi", 2, np.pi))


def flat(reflectance: np.ndarray) -> FactoredBrdf:
    """A surface of one colour in all directions."""
    factors = tuple(np.ones((2, 1)) for _ in AXES)
    return FactoredBrdf((FactorPack("io", AXES, factors, Palette.of(reflectance[None] / np.pi)),))


@pytest.fixture(scope="module")
def chart() -> list[FactoredBrdf]:
    patches = colour_science().SDS_COLOURCHECKERS["BabelColor Average"].values()
    spectra = [Spectrum.sampled(p.wavelengths, p.values).resampled(WORKING_WAVELENGTHS_NM) for p in patches]
    return [flat(s.samples) for s in spectra]


def test_one_light_and_no_bounce_is_exact_at_three(chart):
    for name in ("D65", "A", "FL11", "HP1"):
        plan = plan_scene(chart, [illuminant(name)], observer("1931_2"))
        assert plan.basis_size == 3, name
        assert plan.spectral_delta_e94 < 1e-9, name
        assert any("three numbers" in reason for reason in plan.reasons)


def test_several_lights_take_the_smallest_size_within_the_share(chart):
    lights = [illuminant(name) for name in ("D65", "A", "FL11")]
    plan = plan_scene(chart, lights, observer("1931_2"), budget_delta_e94=1.0)
    assert 3 < plan.basis_size <= 9
    assert plan.spectral_delta_e94 <= SPECTRAL_SHARE
    for name in ("Balanced", "Minimax"):
        smaller = [r for r in plan.reasons if r.startswith(f"{name} basis, J = {plan.basis_size - 1}:")]
        assert smaller and float(smaller[0].rstrip(".").split()[-1]) > SPECTRAL_SHARE


def test_a_tighter_budget_never_takes_fewer_coefficients(chart):
    lights = [illuminant(f"FL{n}") for n in (1, 4, 9, 11)]
    sizes = [plan_scene(chart, lights, observer("1931_2"), b).basis_size for b in (10.0, 3.0, 1.0, 0.1)]
    assert sizes == sorted(sizes) and sizes[-1] > sizes[0], sizes


def test_a_bounce_takes_more_coefficients(chart):
    plans = [plan_scene(chart, [illuminant("FL11")], observer("1931_2"), bounces=b) for b in (0, 1)]
    assert plans[0].basis_size == plans[1].basis_size == 3  # products under one light are still three numbers each
    lights = [illuminant(name) for name in ("D65", "A", "FL11")]
    direct, bounced = (plan_scene(chart, lights, observer("1931_2"), 0.5, b).basis_size for b in (0, 1))
    assert bounced >= direct


def test_black_materials_plan_too():
    plan = plan_scene([flat(np.zeros(81))], [illuminant("D65")], observer("1931_2"))
    assert plan.basis_size == 1 and plan.spectral_delta_e94 == 0.0


def test_nothing_to_plan_and_budgets_that_are_none(chart):
    with pytest.raises(InputError, match="nothing to plan for"):
        plan_scene([], [illuminant("D65")], observer("1931_2"))
    with pytest.raises(InputError, match="budget must be positive"):
        plan_scene(chart, [illuminant("D65")], observer("1931_2"), 0.0)


def on(wavelengths_nm, reflectance):
    """The surface of one colour, sampled elsewhere than on the working wavelengths."""
    factors = tuple(np.ones((2, 1)) for _ in AXES)
    spectral = np.asarray(reflectance(wavelengths_nm))[None] / np.pi
    palette = Palette.of(spectral, SpectralBasis.sampled(wavelengths_nm))
    return FactoredBrdf((FactorPack("io", AXES, factors, palette),))


GRIDS = {
    "working": WORKING_WAVELENGTHS_NM,
    "ten": np.arange(400.0, 701.0, 10.0),
    "fine": np.arange(360.0, 781.0, 1.0),
    "shifted": np.arange(382.0, 731.0, 10.0),
    "uneven": np.array([390.0, 410.0, 440.0, 447.5, 520.0, 600.0, 610.0, 690.0]),
}


@pytest.mark.parametrize("names", [("working", "ten"), ("ten", "shifted"), ("uneven", "working"), tuple(GRIDS)])
@pytest.mark.parametrize("turned", [False, True])
def test_packs_of_different_wavelengths_are_planned_together(names, turned):
    """Each still has its own colour under every light, to the share of the budget that the plan says it spends."""
    lights, eye = [illuminant(name) for name in ("D65", "A", "FL11")], observer("1931_2")
    surfaces = [on(GRIDS[name], lambda nm, k=k: 0.4 + 0.3 * np.sin(nm / (40 + 9 * k))) for k, name in enumerate(names)]
    plan = plan_scene(surfaces[::-1] if turned else surfaces, lights, eye, 0.5)
    for palette in (surface.packs[0].palette for surface in surfaces):
        for light in lights:
            under = Folding(eye, [light], np.pi)
            own, shown = (one.folded(under)[0, 0] for one in (palette, palette.in_basis(plan.basis)))
            assert delta_e_xyz(own, shown, eye.white(light)) < plan.spectral_delta_e94 + 0.01


def test_a_finer_neighbour_leaves_colours_on_the_working_wavelengths_as_they_are(chart):
    """Ten wavelengths are found among the 81: the grid of the scene is that of the packs that are shaded in it."""
    plan = plan_scene([*chart, on(GRIDS["ten"], lambda nm: nm / 1000)], [illuminant("D65")], observer("1931_2"))
    np.testing.assert_array_equal(plan.basis.wavelengths_nm, WORKING_WAVELENGTHS_NM)


def test_light_between_surfaces_is_kept_in_few_numbers():
    """Products of up to three reflectances, seen by way of a fourth, within a tenth of the budget."""
    nm = WORKING_WAVELENGTHS_NM
    ramps = ((0.04, 0.08, 0.75, 0.8), (0.05, 0.6, 0.1, 0.08), (0.6, 0.3, 0.08, 0.05), (0.5, 0.5, 0.5, 0.5))
    surfaces = np.stack([np.interp(nm, [400, 500, 600, 700], ramp) for ramp in ramps])
    lights, seen_by = [illuminant(name) for name in ("D65", "A")], observer("1931_2")
    basis = bounce_basis(surfaces, lights, seen_by, nm)
    assert 4 <= basis.size <= 10
    products = np.array([a * b * c for a in surfaces for b in surfaces for c in surfaces])
    shown = basis.reconstruct(basis.project(products))
    for light in lights:
        weights = seen_by.weights(light, nm).T
        for last in surfaces:
            off = delta_e_xyz((products * last) @ weights, (shown * last) @ weights, weights.sum(axis=0))
            assert off.max() <= 0.1
    assert bounce_basis(np.zeros((2, len(nm))), lights, seen_by, nm).size == 1
