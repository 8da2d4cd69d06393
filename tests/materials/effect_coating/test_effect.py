"""Surfaces that count as effect coatings, and their colours around the mirror direction."""

from __future__ import annotations

import numpy as np
import pytest
from metamer.materials.analytic import AshikhminShirley, CookTorrance, Lambert
from metamer.materials.catalogue.instrument_reading import InstrumentReading
from metamer.materials.effect_coating.off_specular import ANGLES, effect_of, towards
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum

NM = np.arange(380.0, 781.0, 10.0)
DARK, MID = np.full(NM.size, 0.04), np.full(NM.size, 0.4)


def spectrum(values):
    return Spectrum.sampled(NM, values)


def satin(diffuse):
    return AshikhminShirley(spectrum(diffuse), spectrum(DARK), 40.0, 40.0)


def metal(roughness):
    return CookTorrance(spectrum(0.0 * DARK), np.full(NM.size, 0.3), np.full(NM.size, 3.0), roughness, 1.0)


@pytest.mark.parametrize("brdf", [Lambert(spectrum(MID)), satin(MID), satin(0.1 * MID)], ids=["matt", "satin", "dark"])
def test_paint_is_no_effect_coating(brdf):
    assert effect_of(brdf) == "" and InstrumentReading.of(brdf).around is None
    assert InstrumentReading.of(brdf).xyz_around(illuminant("D65"), observer("1964_10")).shape == (0, 3)


def test_a_metal_is_read_from_three_sides():
    found = InstrumentReading.of(metal(0.3))
    assert "times as bright" in effect_of(metal(0.3))
    luminance = found.xyz_around(illuminant("D65"), observer("1964_10"))[:, 1]
    assert luminance.shape == (len(ANGLES),) and luminance[0] > luminance[1] > luminance[2] > 0.0


def test_a_mirror_that_is_dark_everywhere_else_is_none():
    assert effect_of(metal(0.001)) == ""


def test_angles_are_from_the_mirror_direction_towards_the_light():
    to_light, to_viewer = towards([0.0, 45.0, 90.0])
    mirror = to_light[0] * [-1.0, -1.0, 1.0]
    np.testing.assert_allclose(to_viewer, [mirror, [0.0, 0.0, 1.0], to_light[0]], atol=1e-15)
