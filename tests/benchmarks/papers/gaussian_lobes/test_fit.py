"""Lobes fitted to BRDFs: found again where they are some, near where they are not, and refused where they cannot be."""

import numpy as np
import pytest
from metamer.benchmarks.papers.gaussian_lobes.brdf import SHADOWING_DEG, GaussianBrdf
from metamer.benchmarks.papers.gaussian_lobes.fit import colour_difference_slope, fit_gaussians
from metamer.materials.analytic.ashikhmin_shirley import AshikhminShirley
from metamer.materials.analytic.lambert import Lambert
from metamer.materials.core.protocol import LIGHTS, sphere_protocol
from metamer.materials.measured.merl import MerlBrdf
from metamer.runtime.errors import InputError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.spectrum import Spectrum

WAVELENGTHS = np.arange(400.0, 701.0, 20.0)
RAMP = np.linspace(0.0, 1.0, len(WAVELENGTHS))


def _made(**changed):
    """Two lobes over a red body."""
    root = np.sqrt(np.maximum(np.cos(np.radians(SHADOWING_DEG)), 0.01))
    fields = {
        "wavelengths_nm": WAVELENGTHS,
        "diffuse": 0.1 * RAMP,
        "sharpness": np.array([15.0, 400.0]),
        "normal": np.stack([0.02 + 0.02 * RAMP, 0.5 + 0.0 * RAMP]),
        "grazing": np.stack([0.3 + 0.0 * RAMP, 2.0 + 0.0 * RAMP]),
        "shadowing": root,
    }
    return GaussianBrdf(**fields | changed)


def _error(original, found, pixels=96):
    """Mean ΔE94 of the sphere under each of the protocol's illuminants."""
    sphere = sphere_protocol(pixels)
    both = [sphere.references(surface, LIGHTS) for surface in (original, found)]
    return [sphere.under(light).differences(*pair).mean() for light, *pair in zip(LIGHTS, *both, strict=True)]


def test_it_is_what_its_formula_says():
    brdf, wi, wo = _made(), np.array([0.6, 0.0, 0.8]), np.array([-0.36, 0.48, 0.8])
    half = (wi + wo) / np.linalg.norm(wi + wo)
    rise = (1.0 - half @ wo) ** 5
    # Both directions lie at the same angle, between nodes of the table.
    shadowing = np.interp(-0.8, -np.cos(np.radians(SHADOWING_DEG)), brdf.shadowing)
    lobes = np.exp(brdf.sharpness * (half[2] - 1.0)) * shadowing**2 / 0.64
    expected = brdf.diffuse + lobes @ ((1.0 - rise) * brdf.normal + rise * brdf.grazing)
    np.testing.assert_allclose(brdf.eval(wi, wo), expected, rtol=1e-12)
    np.testing.assert_allclose(brdf.eval(wo, wi), expected, rtol=1e-12)
    assert (brdf.eval(wi, -wo) == 0.0).all()


def test_lobes_are_found_again():
    made = _made()
    found = fit_gaussians(made, 2)
    assert max(_error(made, found)) < 0.1
    np.testing.assert_allclose(found.sharpness, made.sharpness, rtol=0.03)
    assert (np.diff(found.sharpness) > 0.0).all()


def test_a_matt_surface_is_its_body():
    red = Lambert(Spectrum.sampled(WAVELENGTHS, 0.1 + 0.5 * RAMP))
    found = fit_gaussians(red, 1)
    assert max(_error(red, found)) < 0.02


def test_a_black_surface_stays_black():
    black = Lambert(Spectrum.sampled(WAVELENGTHS, 0.0 * RAMP))
    found = fit_gaussians(black, 2)
    assert max(_error(black, found)) == 0.0


# Mean ΔE94 under D65, three lobes; over all twelve of that folder the median is 0.81, the worst 1.43.
MERL = {"gray-plastic": 0.5, "chrome-steel": 0.65}


@pytest.mark.slow
@pytest.mark.parametrize("name", MERL)
def test_measured_materials_in_three_lobes(merl_table, name):
    brdf = MerlBrdf(merl_table(name))
    error = _error(brdf, fit_gaussians(brdf, 3), 64)
    assert error[0] <= MERL[name]
    # Spectra, not colours, are fitted: other lights are no worse.
    assert max(error) <= 1.1 * error[0]


def test_the_slope_is_that_of_the_colour_difference():
    white = np.array([0.95, 1.0, 1.09])
    random = np.random.default_rng(7)
    xyz = random.random((40, 3)) * white * 0.9 + 0.02
    xyz[0] = 0.4 * white
    change = 1e-6 * random.normal(size=xyz.shape)
    expected = delta_e_xyz(xyz, xyz + change, white)
    found = np.linalg.norm(np.einsum("nab,nb->na", colour_difference_slope(xyz, white), change), axis=1)
    # A grey has no chroma: what is along it and what is across it weigh the same there.
    np.testing.assert_allclose(found, expected, rtol=1e-3)


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"diffuse": RAMP[:-1]}, "diffuse"),
        ({"normal": np.zeros((3, len(RAMP)))}, "normal"),
        ({"grazing": np.full((2, len(RAMP)), -1e-3)}, "grazing"),
        ({"shadowing": np.full(8, np.nan)}, "shadowing"),
        ({"sharpness": np.array([0.0, 1.0])}, "sharpness"),
    ],
)
def test_lobes_that_do_not_fit_are_refused(changed, field):
    with pytest.raises(InputError, match=field):
        _made(**changed)


def test_what_cannot_be_fitted_is_refused():
    with pytest.raises(InputError, match="lobes"):
        fit_gaussians(_made(), 0)
    with pytest.raises(InputError, match="lobes"):
        fit_gaussians(_made(), 8)
    body = Spectrum.sampled(WAVELENGTHS, 0.5 + 0.0 * RAMP)
    with pytest.raises(InputError, match="anisotropic"):
        fit_gaussians(AshikhminShirley(body, body, 10.0, 100.0))
