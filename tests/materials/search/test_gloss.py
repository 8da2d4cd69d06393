"""Gloss: a glossmeter's numbers where physics gives them, and stops."""

import numpy as np
import pytest
from metamer.materials.analytic import AshikhminShirley, CoatedDiffuse, CookTorrance, Lambert, OrenNayar
from metamer.materials.analytic.glossmeter import INCIDENCE, WINDOW, gloss_of
from metamer.materials.core.points import Points
from metamer.materials.records.record_colour import annular_45_0, colour_folding
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

EVEN = np.ones(WORKING_WAVELENGTHS_NM.shape)
FOLDING = colour_folding()


def flat(value):
    return Spectrum.sampled(WORKING_WAVELENGTHS_NM, value * EVEN)


def body(surface):
    return float(np.pi * surface.xyz(Points(*annular_45_0()), FOLDING)[:, 1].mean())


def gloss(surface):
    return gloss_of(surface, FOLDING, body(surface))


def glass(roughness, n=1.567, k=0.0):
    return CookTorrance(flat(0.0), n * EVEN, k * EVEN, roughness, 1.0, "beckmann", "smith")


@pytest.mark.parametrize("roughness", [0.001, 0.002, 0.004])
def test_polished_black_glass_has_a_hundred_gloss_units(roughness):
    """The definition of the scale: all of such highlights lies in the window."""
    assert gloss(glass(roughness)).units == pytest.approx(100.0, abs=0.3)


def test_other_glasses_are_to_it_as_fresnel_has_them():
    """Quartz (n = 1.46) by Fresnel's equations at 60 degrees, worked out from Snell's law."""

    def reflected(n):
        inside = np.arcsin(np.sin(INCIDENCE) / n)
        across = (np.cos(INCIDENCE) - n * np.cos(inside)) / (np.cos(INCIDENCE) + n * np.cos(inside))
        along = (n * np.cos(INCIDENCE) - np.cos(inside)) / (n * np.cos(INCIDENCE) + np.cos(inside))
        return 0.5 * (across**2 + along**2)

    ratio = gloss(glass(0.002, 1.46)).units / gloss(glass(0.002)).units
    assert ratio == pytest.approx(reflected(1.46) / reflected(1.567), rel=1e-4)


@pytest.mark.parametrize("reflectance", [0.0, 0.05, 0.5, 1.0])
def test_matt_surfaces_have_no_gloss_whatever_they_reflect(reflectance):
    """Their gloss units are the window's own integral, in closed form: white matt paint is no black one."""
    found = gloss(Lambert(flat(reflectance)))
    half, across = WINDOW
    window = 2.0 * np.sin(half) * np.cos(INCIDENCE) * (across + np.sin(across) * np.cos(across))
    assert found.stops == pytest.approx(0.0, abs=1e-12)
    assert found.units == pytest.approx(reflectance / np.pi * window / 0.1000564 * 100.0, rel=1e-5, abs=1e-12)


def test_rough_matt_walls_that_send_less_forward_have_none_either():
    assert gloss(OrenNayar(flat(0.5), 0.5)).stops == 0.0


def test_a_metal_is_glossier_than_any_glass():
    silver = gloss(glass(0.002, 0.15, 3.5))
    assert 900.0 < silver.units < 1000.0
    assert silver.stops == pytest.approx(8.6, abs=0.05)
    assert silver.stops > gloss(glass(0.002)).stops + 3.0


def test_smoother_is_glossier_and_a_body_below_changes_little():
    exponents = (10.0, 32.0, 100.0, 1000.0, 100000.0)
    stops = [[gloss(AshikhminShirley(flat(d), flat(0.04), n, n)).stops for n in exponents] for d in (0.05, 0.8)]
    assert np.all(np.diff(stops, axis=1) > 0.3)
    assert np.abs(np.subtract(*stops)).max() < 0.4


def test_a_brushed_surface_has_one_gloss_however_it_lies():
    one, other = (AshikhminShirley(flat(0.1), flat(0.5), *pair) for pair in ((20.0, 500.0), (500.0, 20.0)))
    found = gloss(one), gloss(other)
    assert not one.isotropic
    assert found[0].units == pytest.approx(found[1].units, rel=1e-9)
    narrow, wide = (gloss(AshikhminShirley(flat(0.1), flat(0.5), n, n)).units for n in (500.0, 20.0))
    assert wide < found[0].units < narrow


def test_a_coat_of_1_5_has_the_gloss_of_its_fresnel_term_and_no_more():
    """89 units, however white the body, but for what the body itself sends into the window: 2 of white."""
    for body in (0.0, 0.9):
        polished = gloss(CoatedDiffuse(flat(body), 1.5, 0.001)).units
        assert polished == pytest.approx(89.1, abs=0.4 + 2.0 * body)
    units = [gloss(CoatedDiffuse(flat(0.5), 1.5, rough)).units for rough in (0.5, 0.1, 0.06, 0.016, 0.002)]
    assert np.all(np.diff(units) > 5.0)
