"""Slices of every kind of uniform surface as Gaussians and a cosine: exact energies, and finite numbers everywhere."""

from dataclasses import dataclass

import numpy as np
import pytest
from metamer.materials.analytic.ashikhmin_shirley import AshikhminShirley
from metamer.materials.analytic.coated_diffuse import CoatedDiffuse
from metamer.materials.analytic.cook_torrance import CookTorrance
from metamer.materials.analytic.lambert import Lambert
from metamer.materials.core.brdf import Brdf, eval_lit
from metamer.materials.core.points import Points
from metamer.materials.slices.fit import COUNTS, fewest_slices, view_slices
from metamer.materials.slices.quadrature import Grids, slice_directions
from metamer.materials.slices.view_slices import ViewSlices, polar_angles
from metamer.spectral.spectrum import Spectrum

NM = np.linspace(400.0, 700.0, 7)
RAMP = np.linspace(0.2, 0.8, 7)
BLACK = Spectrum.sampled(NM, np.zeros(7))
# Four times as many directions each way.
DENSE = Grids(azimuths=72, even=(64, 144))


@dataclass(frozen=True, eq=False)
class Given(Brdf):
    """Whatever a function of both directions (N,3) says, times a ramp of wavelengths."""

    shape: object
    isotropic: bool = True
    wavelengths_nm = NM

    def eval(self, wi, wo):
        return eval_lit(lambda i, o: np.multiply.outer(self.shape(i, o), RAMP), 7, wi, wo)


def ggx(alpha: float) -> CookTorrance:
    return CookTorrance(BLACK, np.full(7, 0.2), 3.0 + RAMP, alpha, 1.0, "ggx", "smith")


def retro(wi, wo):
    """Back to where it came from, over a dark matt ground."""
    return 0.05 + 0.9 * np.exp(20.0 * (np.sum(wi * wo, axis=1) - 1.0))


def grazing(wi, wo):
    """Bright where both directions graze: no reciprocal surface has to look like it."""
    return 0.1 + 3.0 * (1.0 - wi[:, 2]) ** 5 * (1.0 - wo[:, 2]) ** 3


def noisy(wi, wo):
    """A highlight with a fifth of noise, and below zero in places, as measurements are."""
    lobe = np.exp(30.0 * ((wi + wo)[:, 2] / np.linalg.norm(wi + wo, axis=1) - 1.0))
    noise = np.sin(37.0 * wi[:, 0] + 11.0 * wo[:, 0]) * np.cos(29.0 * wi[:, 1] - 17.0 * wo[:, 2])
    return 0.02 + lobe * (1.0 + 0.2 * noise) + 0.03 * noise


def energies(surface: Brdf, wo: np.ndarray, grids: Grids) -> np.ndarray:
    to, angles = slice_directions(wo, grids)
    return (to[:, 2] * angles) @ surface.at(Points(to, np.broadcast_to(wo, to.shape)))


def form_energies(form: ViewSlices, wo: np.ndarray) -> np.ndarray:
    lobes = form.lobes(Points(wo[None], wo[None]))
    # Over the cosine, 1 has pi, z two thirds of it, and 3 zz - 1 half of it; the other bends have nothing.
    cosine = np.array([1.0, 0.0, 0.0, 2.0 / 3.0, 0.0, 0.0, 0.0, 0.0, 0.5]) @ lobes.matt[0]
    return (lobes.value.sum(axis=1)[0] + cosine) @ form.palette.samples[0]


def energy_of_lobes(form: ViewSlices, wo: np.ndarray) -> np.ndarray:
    """Return the energy of each Gaussian, in the middle of the wavelengths."""
    return form.lobes(Points(wo[None], wo[None])).value[0] @ form.palette.samples[0, :, 3]


def viewers(form: ViewSlices, step: int = 5) -> list[np.ndarray]:
    """At nodes of the grid, where nothing is interpolated."""
    return [np.array([np.sin(t), 0.0, np.cos(t)]) for t in polar_angles(len(form.value))[::step]]


def check_energies(surface: Brdf, form: ViewSlices, within: float) -> None:
    for wo in viewers(form):
        truth = energies(surface, wo, DENSE)
        np.testing.assert_allclose(form_energies(form, wo), truth, rtol=within, atol=1e-6)


@pytest.mark.parametrize("alpha", [0.02, 0.1, 0.5])
def test_the_energy_of_a_slice_is_that_of_the_surface(alpha):
    surface = ggx(alpha)
    check_energies(surface, view_slices(surface, 4), 0.002)


def test_a_matt_surface_has_a_cosine_and_nothing_else():
    surface = Lambert(Spectrum.sampled(NM, RAMP))
    form = fewest_slices(surface, 0.5)
    assert form.count == 0
    for wo in ([0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, -0.99, np.sqrt(1 - 0.99**2)]):
        np.testing.assert_allclose(form_energies(form, np.array(wo)), RAMP, rtol=1e-6)
    assert form.error is not None and form.error.maximum < 0.05


def test_what_is_not_quite_matt_is_not_taken_for_it():
    nearly = Given(lambda wi, wo: 0.3 + 1e-6 * wi[:, 2])
    assert view_slices(nearly, 4).count == 4


def test_a_black_surface_is_a_matt_one_that_sends_nothing():
    form = fewest_slices(Lambert(BLACK), 0.5)
    assert form.count == 0 and not form.value.any()
    assert form.error is not None and form.error.maximum == 0.0


def test_a_surface_that_is_black_from_some_sides_is_finite():
    """From beyond 60 degrees nothing comes at all: there the mixture of the last viewer stays, without a value."""
    surface = Given(lambda wi, wo: np.where(wo[:, 2] > 0.5, 1.0, 0.0) * np.exp(50.0 * (wi[:, 2] - 1.0)))
    form = view_slices(surface, 4)
    assert not form_energies(form, viewers(form)[-1]).any()
    check_energies(surface, form, 0.01)


def test_a_mirror_is_a_sharp_lobe_in_the_mirror_direction():
    surface = ggx(0.002)
    form = view_slices(surface, 4)
    check_energies(surface, form, 0.02)
    wo = np.array([[0.6, 0.0, 0.8]])
    lobes, whole = form.lobes(Points(wo, wo)), energy_of_lobes(form, wo[0])
    mean = (whole[:, None] * lobes.directions[0]).sum(axis=0) / whole.sum()
    np.testing.assert_allclose(mean, [-0.6, 0.0, 0.8], atol=0.02)
    assert lobes.sharpness[0, np.argmax(whole)] > 1e4


def test_a_surface_that_sends_light_back_has_its_lobe_at_the_viewer():
    surface = Given(retro)
    form = view_slices(surface, 4)
    check_energies(surface, form, 0.01)
    wo = np.array([[0.6, 0.0, 0.8]])
    lobes = form.lobes(Points(wo, wo))
    most = np.argmax(energy_of_lobes(form, wo[0]) * lobes.sharpness[0])
    assert lobes.directions[0, most] @ wo[0] > 0.97


def test_a_surface_that_shines_at_grazing_angles_keeps_its_energy():
    surface = Given(grazing)
    check_energies(surface, view_slices(surface, 4), 0.002)


def test_noise_and_numbers_below_zero_stay_in_the_energy():
    surface = Given(noisy)
    form = view_slices(surface, 8)
    directions = slice_directions(viewers(form)[2], DENSE)[0]
    assert surface.eval(directions, viewers(form)[2]).min() < 0.0
    # Waves this short are finer than the grid of directions.
    check_energies(surface, form, 0.05)


def test_a_surface_below_zero_everywhere_is_matt_below_zero():
    form = view_slices(Given(lambda wi, wo: np.full(len(wi), -0.01)))
    np.testing.assert_allclose(form_energies(form, np.array([0.0, 0.0, 1.0])), -0.01 * np.pi * RAMP, rtol=1e-6)


@pytest.mark.slow
def test_brushed_surfaces_have_slices_by_azimuth():
    surface = AshikhminShirley(BLACK, Spectrum.sampled(NM, RAMP), 10.0, 200.0)
    form = fewest_slices(surface, 0.5)
    assert form.sharpness.shape == (16, 16, COUNTS[-1]) and not form.isotropic
    for azimuth in (0.0, 5.0 / 16.0, 12.0 / 16.0):
        for theta in polar_angles(16)[1:12:5]:
            turn = 2.0 * np.pi * azimuth
            wo = np.array([np.sin(theta) * np.cos(turn), np.sin(theta) * np.sin(turn), np.cos(theta)])
            np.testing.assert_allclose(form_energies(form, wo), energies(surface, wo, DENSE), rtol=0.01)
    assert form.error is not None and form.error.mean < 3.0


def test_equal_surfaces_have_equal_slices_to_the_bit():
    one, other = (fewest_slices(ggx(0.3), 5.0).stored() for _ in range(2))
    assert all(np.array_equal(one[name], other[name]) for name in ("directions", "sharpness", "value"))
    assert np.array_equal(one["error"]["figures"], other["error"]["figures"])


def test_numbers_are_those_that_a_file_keeps():
    form = fewest_slices(ggx(0.3), 5.0)
    again = ViewSlices.from_stored(form.stored())
    for name in ("directions", "sharpness", "value"):
        assert np.array_equal(getattr(form, name), getattr(again, name))
    assert again.error == form.error and np.array_equal(again.palette.samples, form.palette.samples)


@pytest.mark.slow
def test_no_more_gaussians_than_a_budget_asks_for():
    rough = ggx(0.6)
    assert fewest_slices(rough, 50.0).count == COUNTS[0]
    counts = [fewest_slices(rough, budget).error.mean for budget in (50.0, 1e-6)]
    assert counts[1] <= counts[0]


@pytest.mark.parametrize(("body", "roughness"), [(0.03, 0.06), (0.6, 0.016), (0.95, 0.06)])
def test_a_clear_coat_over_a_body_is_within_the_budget_with_four_gaussians(body, roughness):
    """Gaussians follow the coat alone: what polynomials leave of the body has none."""
    surface = CoatedDiffuse(Spectrum.sampled(NM, np.full(7, body)), 1.5, roughness)
    form = fewest_slices(surface, 0.5)
    assert form.count == 4
    assert form.error.mean < 0.35 and form.error.p99 < 0.8
    check_energies(surface, form, 0.005)


@pytest.mark.parametrize("index", [1.3, 1.5])
def test_polished_glass_sends_nothing_but_its_highlight(index):
    """More than half of its directions send nothing at all: no polynomial lies beneath it."""
    glass = CookTorrance(BLACK, np.full(7, index), np.zeros(7), 0.02, 1.0, "beckmann", "smith")
    form = fewest_slices(glass, 0.5)
    assert form.error.mean < 0.3 and form.error.p99 < 2.0


def test_finer_wavelengths_come_down_to_the_working_ones():
    nm = np.arange(380.0, 781.0)
    form = view_slices(Lambert(Spectrum.sampled(nm, 0.5 + 0.3 * np.sin(nm / 40.0))))
    working = form.palette.wavelengths_nm
    assert working.size == 81
    found = form_energies(form, np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(found, 0.5 + 0.3 * np.sin(working / 40.0), atol=2e-3)
