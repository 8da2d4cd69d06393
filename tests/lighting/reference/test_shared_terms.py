"""Sums over drawn directions that materials of the same terms share: the numbers are those of each by itself."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.environment.booth import light_booth
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.environment.softbox import SoftboxLight
from metamer.lighting.mesh.shapes import plane, sphere
from metamer.lighting.reference import spread
from metamer.lighting.reference.geometry import visible_geometry
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.scene import Part, Scene, Viewing
from metamer.materials.analytic import AshikhminShirley, CoatedDiffuse, CookTorrance, Lambert, OrenNayar
from metamer.materials.analytic.metallic_roughness import MetallicRoughness
from metamer.materials.core.brdf import Brdf, Lobe
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM as NM
from metamer.spectral.spectrum import Spectrum

D65, A, FL11 = (illuminant(name) for name in ("D65", "A", "FL11"))
UP, DOWN, GREY, BLACK = (
    Spectrum.sampled(NM, np.broadcast_to(values, 81))
    for values in (np.linspace(0.1, 0.7, 81), np.linspace(0.9, 0.2, 81), 0.04, 0.0)
)
METAL = (np.linspace(0.2, 1.4, 81), np.full(81, 3.0))
CAMERA = Camera(position=(0.6, 1.2, 4.0), target=(0, 0, 0), vertical_fov_deg=40, width=3, height_px=3, samples=2)
# Two colours of each kind.
PAIRS = {
    "matt": (Lambert(UP), Lambert(DOWN)),
    "black": (Lambert(BLACK), Lambert(UP)),
    "rough": (OrenNayar(UP, 0.35), OrenNayar(DOWN, 0.35)),
    "held at 0": (OrenNayar(UP, 1.5), OrenNayar(DOWN, 1.5)),
    "gloss paint": (CoatedDiffuse(UP, 1.5, 0.016), CoatedDiffuse(DOWN, 1.5, 0.016)),
    "black under gloss": (CoatedDiffuse(BLACK, 1.5, 0.06), CoatedDiffuse(DOWN, 1.5, 0.06)),
    "another coat": (CoatedDiffuse(UP, 1.5, 0.06), CoatedDiffuse(UP, 1.5, 0.3)),
    "two lobes of highlights": tuple(MetallicRoughness(s, GREY, 1.0, 0.2, 1.0, 0.05) for s in (UP, DOWN)),
    "two terms of highlights": tuple(AshikhminShirley(s, GREY, 60.0, 60.0) for s in (UP, DOWN)),
    "two kinds": (CoatedDiffuse(UP, 1.5, 0.06), CookTorrance(DOWN, *METAL, 0.2, 0.5)),
    "no body": tuple(CookTorrance(s, *METAL, 0.2, 1.0, "ggx", "smith") for s in (UP, DOWN)),
}
METALLIC = ("two kinds", "no body")
FIELDS = np.random.default_rng(5).random((2, 16, 32)) ** 4
ONE_TEXEL, NONE = np.zeros((16, 32)), np.zeros((16, 32))
ONE_TEXEL[3, 9] = 1.0
LIGHTS = {
    "booth": (light_booth("D65"),),
    "softbox": (SoftboxLight((1.0, 2.0, 1.5), (0.0, 0.0, 0.0), 1.0, 0.5, D65, 4000.0),),
    "two spectra": (EnvironmentLight(FIELDS, (D65, A), 1000.0),),
    "three fields of two spectra": (EnvironmentLight(FIELDS[[0, 1, 0]], (D65, A, D65), 1000.0),),
    "one direction": (EnvironmentLight(ONE_TEXEL[None], (D65,), 1000.0),),
    "booth and a field without power": (
        light_booth("A"),
        EnvironmentLight(np.stack([FIELDS[0], NONE]), (D65, A), 100.0),
    ),
}


class Unknown(Brdf):
    """A BRDF of which nobody knows terms: spectra first, folded then."""

    def __init__(self, brdf):
        self.brdf, self.wavelengths_nm, self.isotropic = brdf, brdf.wavelengths_nm, brdf.isotropic

    def eval(self, wi, wo):
        return self.brdf.eval(wi, wo)

    def lobes(self):
        each = self.brdf.lobes()
        return tuple(Lobe(one.frame, self if len(each) == 1 else Unknown(one.brdf)) for one in each)


def scene_of(lights, two_parts=True):
    parts = [Part("ball", sphere(4), "first")]
    if two_parts:
        down = np.eye(4)
        down[1, 3] = -1.0
        parts.append(Part("floor", plane(6, 6).transformed(down), "second"))
    viewing = Viewing(reference_illuminance_lux=1000.0)
    return Scene(tuple(parts), lights, (CAMERA,), observer("1931_2"), viewing)


def drawn(scene, surfaces, illuminants=(None, D65, FL11), geometry=None, **more):
    surfaces = dict(zip(("first", "second"), surfaces, strict=True))
    geometry = visible_geometry(scene) if geometry is None else geometry
    return reference_images(scene, None, surfaces, illuminants, geometry=geometry, most_directions=32, **more).xyz


@pytest.mark.parametrize(("kind", "light"), list(zip(PAIRS, ("booth", "two spectra") * 9, strict=False)))
def test_terms_give_what_spectra_give(kind, light):
    scene, surfaces = scene_of(LIGHTS[light]), PAIRS[kind]
    expected = drawn(scene, [Unknown(one) for one in surfaces])
    # Fresnel's term of metals is looked up.
    np.testing.assert_allclose(drawn(scene, surfaces), expected, rtol=1e-8 if kind in METALLIC else 1e-12, atol=1e-14)


@pytest.mark.parametrize("light", LIGHTS)
def test_terms_give_what_spectra_give_under_any_light(light):
    scene, surfaces = scene_of(LIGHTS[light]), PAIRS["gloss paint"]
    expected = drawn(scene, [Unknown(one) for one in surfaces])
    assert expected.any()
    np.testing.assert_allclose(drawn(scene, surfaces), expected, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize(
    ("kind", "kept_bytes"), [*((kind, spread._KEPT_BYTES) for kind in PAIRS if kind not in METALLIC), ("rough", 0)]
)
def test_the_next_material_of_a_geometry_is_drawn_as_on_a_new_one(kind, kept_bytes, monkeypatch):
    monkeypatch.setattr(spread, "_KEPT_BYTES", kept_bytes)
    scene, geometry = scene_of(LIGHTS["booth"]), visible_geometry(scene_of(LIGHTS["booth"]))
    for surfaces in (PAIRS[kind], PAIRS[kind][::-1]):
        new = drawn(scene, surfaces)
        np.testing.assert_array_equal(drawn(scene, surfaces, geometry=geometry), new)


def test_other_lights_seeds_and_budgets_have_sums_of_their_own():
    scene, surfaces = scene_of(LIGHTS["booth"]), PAIRS["gloss paint"]
    dimmed = replace(scene, lights=(light_booth("D65", illuminance_lux=300.0),))
    geometry = visible_geometry(scene)
    for lit, more in ((scene, {}), (dimmed, {}), (scene, {"seed": 1}), (scene, {"budget": 9.0}), (scene, {})):
        shared = drawn(lit, surfaces, geometry=geometry, **more)
        np.testing.assert_array_equal(shared, drawn(lit, surfaces, **more))


def test_coats_over_other_bodies_draw_nothing_again(monkeypatch):
    scene, calls = scene_of(LIGHTS["booth"], two_parts=False), []
    geometry, add = visible_geometry(scene), spread.SpreadSum._add
    monkeypatch.setattr(spread.SpreadSum, "_add", lambda *args: (calls.append(1), add(*args)))
    pictures = []
    for number, paint in enumerate(PAIRS["gloss paint"]):
        surfaces = {"first": paint}
        # The largest number of directions: how many are needed is another question.
        found = reference_images(scene, None, surfaces, (D65,), geometry=geometry, most_directions=32, budget=1e-9)
        pictures.append(found.xyz)
        assert bool(calls) == (number == 0)
        calls.clear()
    assert not np.allclose(*pictures)


def test_drawing_that_was_interrupted_leaves_nothing_behind(monkeypatch):
    scene, surfaces = scene_of(LIGHTS["booth"]), PAIRS["rough"]
    geometry, add, calls = visible_geometry(scene), spread.SpreadSum._add, []

    def interrupted(*args):
        calls.append(1)
        if len(calls) == 4:
            raise KeyboardInterrupt
        add(*args)

    monkeypatch.setattr(spread, "_PAIRS", 64)
    monkeypatch.setattr(spread.SpreadSum, "_add", interrupted)
    with pytest.raises(KeyboardInterrupt):
        drawn(scene, surfaces, geometry=geometry)
    np.testing.assert_array_equal(drawn(scene, surfaces, geometry=geometry), drawn(scene, surfaces))
