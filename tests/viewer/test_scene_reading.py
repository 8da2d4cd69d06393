"""Reading by a 45:0 instrument of a material, in the light of a scene."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.catalogue.instrument_reading import InstrumentReading
from metamer.spectral.bispectral import Bispectral
from metamer.viewer.display.transform import DisplayTransform
from metamer.viewer.review.facts import display_swatch, xyz_in


def test_colour_of_a_fluorescent_material_counts_what_it_sends_out(scenes):
    """A fifth of what comes in at 450 nm leaves at 550 nm, beside a grey of a half."""
    matrix = 0.5 * np.eye(41)
    matrix[17, 7] = 0.2
    grid = np.arange(380.0, 781.0, 10.0)
    brdf = FluorescentLambert(Bispectral(grid, grid, matrix))
    scene = scenes.sphere_scene()
    light, eye = scene.lights[0].spectrum, scene.observer
    found = xyz_in(scene, InstrumentReading.of(brdf))
    np.testing.assert_allclose(found, brdf.bispectral.fold(light, eye), rtol=1e-9)
    bare = FluorescentLambert(brdf.bispectral.without_emission())
    assert found[1] > 0.503 > 0.501 > xyz_in(scene, InstrumentReading.of(bare))[1]


@pytest.mark.parametrize("distance", [0.0, 1e-3, 0.05, 0.5, 3.0])
def test_swatch_of_the_perfect_diffuser_is_display_white_however_near_a_lamp_is(scenes, distance):
    """Swatch and white weigh the lights alike: a lamp in the middle of the scene turns neither against the other."""
    lights = [scenes.lamp((distance, 0.0, 0.0), 100.0, "A"), scenes.sun(name="D65")]
    scene = replace(scenes.sphere_scene("white", size=8, samples=1), lights=tuple(lights))
    nm = scene.observer.wavelengths_nm
    white = xyz_in(scene, InstrumentReading(nm, np.ones(nm.size)))
    np.testing.assert_allclose(white, scene.adopted_white(), rtol=1e-9)
    assert display_swatch(DisplayTransform(), white, scene.adopted_white()) == (255, 255, 255)
