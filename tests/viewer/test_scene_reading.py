"""Reading by a 45:0 instrument of a material, in the light of a scene."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.catalogue.instrument_reading import InstrumentReading
from metamer.spectral.bispectral import Bispectral
from metamer.spectral.illuminants import illuminant
from metamer.viewer.display.transform import DisplayTransform
from metamer.viewer.review.facts import display_swatches, reviewed_materials, xyz_in


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
    assert display_swatches(DisplayTransform(), white[None], scene.adopted_white()) == [(255, 255, 255)]


def test_colours_of_materials_are_encoded_once_a_light_and_are_those_of_each(scenes, tiny_catalogue, monkeypatch):
    catalogue, encode, encoded = Catalogue.open(tiny_catalogue), DisplayTransform.encode, []
    records = {name: catalogue.load(name) for name in catalogue}
    spectra = {"names": ("A", "as lit"), "spectra": (illuminant("A"), None)}
    setting = SimpleNamespace(scene=scenes.sphere_scene(), display=DisplayTransform(), records=records, **spectra)

    def reviewed(*names):
        return reviewed_materials(setting, names, lambda name: InstrumentReading.of(records[name].brdf()))

    monkeypatch.setattr(DisplayTransform, "encode", lambda *given: encoded.append(given) or encode(*given))
    found = reviewed(*records)
    # Two observers; two lights of pictures and the four others that figures are given for.
    assert len(found) == len(records) > 2 and len(encoded) == 2 * 6
    for one in found:
        (alone,) = reviewed(one.id)
        for colour, by_itself in zip(one.colours, alone.colours, strict=True):
            assert (colour.light, colour.observer) == (by_itself.light, by_itself.observer)
            assert colour.shift.words == by_itself.shift.words and colour.swatch == by_itself.swatch
            assert colour.shift.delta_e == pytest.approx(by_itself.shift.delta_e, rel=1e-9, abs=1e-9)
            for name in ("xyz", "lab", "adapted_lab"):
                np.testing.assert_allclose(getattr(colour, name), getattr(by_itself, name), rtol=1e-12, atol=1e-12)
