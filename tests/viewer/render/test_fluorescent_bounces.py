"""Light that fluorescent surfaces put on others, in pictures: both renderers beside paths at every wavelength."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.visibility import refinement
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.factored.pack import matt_brdf
from metamer.runtime.errors import InputError
from metamer.spectral.bispectral import fluorophore
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.palette import Palette
from metamer.spectral.spectrum import Spectrum
from metamer.viewer.render.session import radiance_weights
from metamer.viewer.software.backend import software_session

NM = np.arange(300.0, 781.0, 10.0)
VIOLET = Spectrum.sampled(
    np.array([380.0, 399.0, 400.0, 401.0, 780.0]), np.array([0.0, 0.0, 1.0, 0.0, 0.0]), "emission"
)


def about(centre, width=30.0):
    return np.exp(-(((NM - centre) / width) ** 2))


def dye(peak=430.0, to=610.0):
    """Orange: what it absorbs in the blue comes back red."""
    return FluorescentLambert(
        fluorophore(Spectrum.sampled(NM, np.full(NM.size, 0.2)), 0.7 * about(peak, 50), about(to), 0.9)
    )


def matt(reflectance):
    return matt_brdf(np.ones(1), Palette.of(np.broadcast_to(reflectance, (1, 81)) / np.pi))


ORIGINALS = {"dye": dye(), "white": matt(0.8), "grey": matt(0.4)}
SURFACES = {**ORIGINALS, "dye": dye().own_form()}


@pytest.fixture(autouse=True)
def few_divisions(monkeypatch):
    monkeypatch.setattr(refinement, "MOST_VERTICES", 400)


def corner(scenes, *lights, bounces=2, card="dye", floor="white", size=24):
    """A card that stands on a floor."""
    upright = shapes.plane(2.0, 2.0).placed(rotate_deg=(90.0, 0.0, 0.0), translate=(0.0, 0.9, -1.0))
    parts = [(shapes.plane(2.0, 2.0).placed(translate=(0, -0.1, 0)), floor), (upright, card)]
    camera = Camera("c", (1.2, 1.6, 3.2), (0, 0.4, -0.2), vertical_fov_deg=38.0, width=size, height_px=size, samples=1)
    return replace(scenes.scene_of(parts, lights or [scenes.sun((0.3, 0.9, 0.5))], camera), bounces=bounces)


def off(scene, truth, found, coverage):
    whole = coverage == 1.0
    return delta_e_xyz(truth[whole], np.maximum(found[whole], 0.0), scene.adopted_white())


@pytest.fixture(scope="module")
def traced():
    """Paths of scenes, by name, once for both renderers."""
    known = {}

    def of(name, scene):
        if name not in known:
            known[name] = reference_images(scene, None, ORIGINALS, bounces=1, budget=1.5).xyz[0]
        return known[name]

    return of


@pytest.mark.slow
@pytest.mark.parametrize("lamps", ["FL11", "three"])
def test_pictures_are_the_paths(scenes, make_session, traced, lamps):
    """p95 of ΔE94, and without what surfaces put on each other."""
    lights = {
        "FL11": [scenes.sun((0.3, 0.9, 0.5), name="FL11")],
        # One is a line that is hardly seen, and excites.
        "three": [
            scenes.sun((0.3, 0.9, 0.5), 500.0),
            scenes.lamp((1.2, 1.5, 1.4), 800.0),
            replace(scenes.sun((0.5, 0.8, 0.4), 1.0), spectrum=VIOLET),
        ],
    }[lamps]
    scene = corner(scenes, *lights, bounces=1, size=12)
    truth = traced(lamps, scene)
    with make_session() as renderer:
        found, coverage = renderer.render(scene, None, SURFACES)
        alone, _ = renderer.render(replace(scene, bounces=0), None, SURFACES)
    near, far = (np.percentile(off(scene, truth, one, coverage), 95) for one in (found, alone))
    assert near < 0.7 and far > 8.0 * near, (near, far)


def test_no_picture_without_the_dye_is_like_it(scenes):
    """A card of the same diagonal, which does not fluoresce, is far off on the floor before it."""
    scene = corner(scenes)
    plain = matt_brdf(
        np.ones(1) / np.pi,
        Palette.of(np.interp(np.linspace(380, 780, 81), NM, dye().bispectral.reflectance.samples)[None]),
    )
    with software_session() as renderer:
        found, coverage = renderer.render(scene, None, SURFACES)
        direct, _ = renderer.render(replace(scene, bounces=0), None, SURFACES)
        without, _ = renderer.render(scene, None, {**SURFACES, "dye": plain})
        none, _ = renderer.render(replace(scene, bounces=0), None, {**SURFACES, "dye": plain})
    onto = coverage == 1.0
    shifted = delta_e_xyz((direct + without - none)[onto], found[onto], scene.adopted_white())
    assert np.percentile(shifted, 95) > 1.0


@pytest.mark.slow_cases("GL", "numpy")
def test_each_illuminant_excites_as_it_does(scenes, make_session):
    """Several at once are what each is alone."""
    scene = corner(scenes)
    lamps = [None, illuminant("A"), illuminant("FL11")]
    with make_session() as renderer:
        together = renderer.render_many(scene, None, SURFACES, lamps)
        alone = [renderer.render(scene if one is None else scene.with_illuminant(one), None, SURFACES) for one in lamps]
    for (one, _), (other, _) in zip(together, alone, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-6)


def test_gl_equals_numpy(scenes, drawn_by_both):
    both = drawn_by_both(corner(scenes), SURFACES)
    np.testing.assert_allclose(both.mine, both.theirs, atol=2e-5)


@pytest.mark.parametrize("name", ["D65", "FL11"])
def test_spectra_tell_the_same_as_colours(scenes, name):
    scene = corner(scenes, scenes.sun((0.3, 0.9, 0.5), name=name))
    nm = np.arange(360.0, 831.0, 5.0)
    with software_session() as renderer:
        xyz, coverage = renderer.render(scene, None, SURFACES)
        spectra = renderer.render_spectra(scene, None, SURFACES, nm)
    seen = spectra @ radiance_weights(scene.observer, nm).T
    assert off(scene, xyz, seen, coverage).max() < 0.3


def test_all_parts_may_fluoresce_and_bounces_end(scenes):
    scene = corner(scenes, bounces="auto", floor="dye")
    with software_session() as renderer:
        found, _ = renderer.render(scene, None, SURFACES)
        assert renderer.bounced.bounces >= 2 and np.isfinite(found).all()


def test_a_surface_that_sends_out_all_it_receives_is_refused(scenes):
    whole = FluorescentLambert(fluorophore(Spectrum.sampled(NM, np.ones(NM.size)), np.zeros(NM.size), about(600), 0.5))
    with software_session() as renderer, pytest.raises(InputError, match="what they cannot"):
        renderer.render(corner(scenes), None, {**SURFACES, "dye": whole.own_form()})


def test_scenes_without_dyes_keep_their_spectra_apart(scenes):
    scene = corner(scenes, card="grey")
    with software_session() as renderer:
        renderer.render(scene, None, SURFACES)
        assert renderer.bounced.radiant is None
