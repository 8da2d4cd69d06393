"""Rough matt surfaces as instruments read them: the walls are found from the reading of the whole."""

from itertools import pairwise

import numpy as np
import pytest
from metamer.materials.analytic import OrenNayar
from metamer.materials.core.directions import spherical
from metamer.runtime.errors import InputError
from metamer.spectral.spectrum import Spectrum

NM = np.array([450.0, 550.0, 650.0, 750.0])
READING = np.array([0.0, 0.05, 0.4, 0.6])
ROUGH = [0.0, 0.1, 0.35, 0.8, 0.5 * np.pi]


def rough(sigma, values=0.0):
    return OrenNayar(Spectrum.sampled(NM, np.broadcast_to(values, 4).astype(float)), sigma)


def sphere_reads(brdf, degrees):
    """The share of the light from one direction that leaves, by quadrature of f_r cos(theta) between its kinks."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    total = 0.0
    for low, high in pairwise(np.radians([0.0, degrees, 90.0])):
        for first, last in pairwise(0.5 * np.pi * np.arange(5)):
            theta, phi = 0.5 * (low + high + (high - low) * nodes), 0.5 * (first + last + (last - first) * nodes)
            share = np.outer(weights * np.sin(theta) * np.cos(theta), weights).ravel()
            theta, phi = (one.ravel() for one in np.meshgrid(theta, phi, indexing="ij"))
            seen = brdf.eval(spherical(theta, phi), np.broadcast_to(spherical(np.radians(degrees), 0.0), (1600, 3)))
            total = total + 0.25 * (high - low) * (last - first) * (share @ seen)
    return total


@pytest.mark.parametrize("sigma", ROUGH)
@pytest.mark.parametrize("geometry", ["45:0", "45/0", "0:45", "45a:0"])
def test_what_is_lit_at_45_degrees_reads_as_it_was_read(sigma, geometry):
    found = rough(sigma).reads(Spectrum.sampled(NM, READING), geometry)
    for turn in (0.0, 1.1, 3.0):
        read = np.pi * found.eval(spherical(0.25 * np.pi, turn), spherical(0.0, 0.0))
        np.testing.assert_allclose(read, READING, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("sigma", ROUGH)
@pytest.mark.parametrize(
    ("geometry", "degrees"), [("di:8", 8.0), ("de:8", 8.0), ("d/8", 8.0), ("8:d", 8.0), ("d:0", 0.0), ("d:6", 6.0)]
)
def test_spheres_read_the_spectrum_that_the_walls_were_found_from(sigma, geometry, degrees):
    found = rough(sigma).reads(Spectrum.sampled(NM, READING), geometry)
    np.testing.assert_allclose(sphere_reads(found, degrees), READING, rtol=0.0, atol=1e-9)


def test_a_smooth_surface_has_the_spectrum_that_was_read():
    for geometry in ("45:0", "di:8", "de:8"):
        found = rough(0.0).reads(Spectrum.sampled(NM, READING), geometry)
        np.testing.assert_allclose(found.reflectance.samples, READING, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("geometry", ["", "directional", "45as15", "30:0"])
def test_a_geometry_that_is_not_stated_is_asked_about(geometry):
    with pytest.raises(InputError, match="45:0") as refusal:
        rough(0.3).reads(Spectrum.sampled(NM, READING), geometry)
    assert refusal.value.field == "geometry"


def test_readings_that_no_walls_give_are_refused_by_wavelength():
    with pytest.raises(InputError, match="brighter than white walls") as refusal:
        rough(0.8).reads(Spectrum.sampled(NM, np.array([0.1, 0.2, 0.95, 0.3])), "45:0")
    assert "at 650 nm" in str(refusal.value) and "sigma 0.8" in str(refusal.value)
