"""Another light or observer after a first picture: whatever asks for it, terms are folded and nothing is shaded."""

from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import metamer
import numpy as np
import pytest
from metamer.lighting.environment import bright_light, prefiltering
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.environment.softbox import SoftboxLight
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.scene_file.files import load_scene
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum
from metamer.viewer import api
from metamer.viewer.gl.backend import GLBackend, create_session, gl_session
from metamer.viewer.gl.passes import Passes
from metamer.viewer.render import light_cache as kept_light
from metamer.viewer.render.session import RenderSession
from metamer.viewer.software.backend import NumpyBackend, software_session

D65, A, FL11, D50 = (illuminant(name) for name in ("D65", "A", "FL11", "D50"))
# Everything between a scene and its terms; folds alone may follow another light.
PASSES = ("visibility", "light", "uv", "frames", "shade", "gather")


def sky(spectra, **settings):
    rng = np.random.default_rng(4)
    return EnvironmentLight(rng.uniform(0.2, 4.0, (len(spectra), 16, 32)), spectra, **settings)


def studio(scenes, shaded=False):
    """A ball, or two of which one shades the other, under two lamps, a sky of two spectra and a softbox."""
    scene = scenes.two_balls(size=16) if shaded else scenes.sphere_scene(size=16, samples=1)
    lamps = scenes.lamp((1.6, 2.2, 2.0)), scenes.sun((-0.5, 0.8, 0.3), 400.0)
    panel = SoftboxLight((0.0, 3.0, 2.0), (0.0, 0.0, 0.0), 1.0, 1.0, D50, 400.0)
    return replace(scene, lights=(*lamps, sky((D65, A)), panel))


@pytest.fixture(params=["numpy", "GL"])
def renderer(request):
    """A renderer that keeps terms."""
    if request.param == "GL":
        return gl_session(request.getfixturevalue("gl"), keeps_terms=True)
    return software_session(keeps_terms=True)


@pytest.fixture
def work(monkeypatch):
    """Counts passes, terms, tiles, and what is found of lights, by name."""
    counts = Counter()

    def count(home, name):
        called = getattr(home, name)

        def counted(*args, **kwargs):
            counts[name] += 1
            return called(*args, **kwargs)

        monkeypatch.setattr(home, name, counted)

    for name in (*PASSES, "fold"):
        count(Passes, name)
    for kind in (GLBackend, NumpyBackend):
        count(kind, "terms")
        count(kind, "tile")
    count(kept_light, "scene_visibility")
    monkeypatch.setattr(
        kept_light, "GatheredLight", type("Counted", (), {"of": lambda light: _counted(counts, "gathered", light)})
    )
    count(bright_light, "taken_apart")
    return counts


def _counted(counts, name, light):
    counts[name] += 1
    return prefiltering.GatheredLight.of(light)


def shaded(counts):
    """All that was done but folds."""
    return sum(counts.values()) - counts["fold"]


OTHERS = {
    "illuminant": lambda scene: scene.with_illuminant(A, "A"),
    "a copy of it": lambda scene: scene.with_illuminant(Spectrum(A.samples.copy(), A.wavelengths_nm, "emission")),
    "observer": lambda scene: replace(scene, observer=observer("1964_10")),
    "lamp for lamp": lambda scene: replace(
        scene,
        lights=tuple(
            light.with_spectrum(spectrum) for light, spectrum in zip(scene.lights, (FL11, FL11, A, D65), strict=True)
        ),
    ),
    "dimmed sky": lambda scene: replace(
        scene,
        lights=tuple(
            replace(light, illuminance_lux=300.0) if isinstance(light, EnvironmentLight) else light
            for light in scene.lights
        ),
    ),
    "illuminant and observer": lambda scene: replace(scene, observer=observer("1964_10")).with_illuminant(FL11),
}


@pytest.mark.slow_cases("GL")
def test_another_light_or_observer_is_a_fold(scenes, renderer, work):
    check_folds(studio(scenes), dict(scenes.SURFACES), renderer, work, OTHERS)


@pytest.mark.slow
def test_what_hides_light_is_not_found_anew(scenes, renderer, work):
    last = {"illuminant and observer": OTHERS["illuminant and observer"]}
    check_folds(studio(scenes, shaded=True), dict(scenes.SURFACES), renderer, work, last)


def check_folds(scene, surfaces, renderer, work, changes):
    """Changes after a first picture cost folds alone, and the last of them shows what a new renderer shows."""
    renderer.render(scene, None, surfaces)
    assert shaded(work) >= 9
    for name, change in changes.items():
        work.clear()
        other = change(scene)
        drawn, coverage = renderer.render(other, None, surfaces)
        assert shaded(work) == 0, name
    fresh, _ = RenderSession(renderer.backend, renderer.settings).render(other, None, surfaces)
    assert np.abs(drawn - fresh)[coverage > 0.0].max() < 2e-5 * fresh.max()


def test_lamps_of_one_spectrum_are_told_apart_once(scenes, renderer, work):
    scene, surfaces = scenes.two_balls(size=16), dict(scenes.SURFACES)
    scene = scene.with_illuminant(D65)
    first, second = scene.lights
    renderer.render(scene, None, surfaces)
    apart = replace(scene, lights=(first, second.with_spectrum(A)))
    renderer.render(apart, None, surfaces)
    work.clear()
    for lights in (scene.lights, (first.with_spectrum(FL11), second), apart.lights):
        renderer.render(replace(scene, lights=lights), None, surfaces)
    assert shaded(work) == 0


@pytest.mark.slow_cases("GL")
def test_what_is_not_a_spectrum_is_drawn_anew(scenes, renderer, work):
    scene, surfaces = studio(scenes), dict(scenes.SURFACES)
    first, _ = renderer.render(scene, None, surfaces)
    key, fill, dome, panel = scene.lights
    changed = {
        "moved": (replace(key, position=(0.3, 2.0, 1.5)), fill, dome, panel),
        "turned": (key, fill, replace(dome, rotation_deg=40.0), panel),
        "larger panel": (key, fill, dome, replace(panel, width=2.0)),
        "another map": (key, fill, replace(dome, fields=np.roll(dome.fields, 3, axis=2)), panel),
    }
    for name, lights in changed.items():
        work.clear()
        drawn, _ = renderer.render(replace(scene, lights=lights), None, surfaces)
        assert work["terms"] > 0, name
        assert np.abs(drawn - first).max() > 1e-3 * first.max(), name


def test_one_spectrum_for_all_fields_is_their_sum(scenes):
    dome = sky((D65, A, FL11), illuminance_lux=700.0)
    lit = dome.with_spectrum(D50, "D50")
    assert lit.spectrum is D50 and lit.fields is dome.fields and "1 spectrum" in repr(lit)
    one = EnvironmentLight(dome.fields.sum(axis=0, keepdims=True), (D50,), illuminance_lux=700.0)
    scene, surfaces = scenes.sphere_scene(size=12, samples=1), dict(scenes.SURFACES)
    drawn = [software_session().render(replace(scene, lights=(light,)), None, surfaces) for light in (lit, one)]
    (lit_xyz, coverage), (one_xyz, _) = drawn
    assert delta_e_xyz(one_xyz, lit_xyz, scene.observer.white(D50))[coverage > 0.0].max() < 0.02
    truths = [reference_images(replace(scene, lights=(light,)), None, surfaces).xyz for light in (lit, one)]
    np.testing.assert_allclose(*truths, atol=1e-9 * truths[1].max())


def test_weights_of_maps_are_what_the_observer_and_the_strength_make_them():
    dome = sky((D65, A))
    seen = replace(dome.for_observer(observer("1964_10")), illuminance_lux=250.0)
    assert seen.maps.maps is dome.fields and seen.unweighted.fields is dome.fields
    np.testing.assert_allclose(seen.fields, seen.maps.weights[:, None, None] * dome.fields, rtol=1e-14)
    assert seen._relative_illuminances(seen.fields).sum() == pytest.approx(250.0, rel=1e-12)
    assert seen.maps.weights[0] != pytest.approx(seen.maps.weights[1], rel=1e-4)
    other = replace(seen, fields=np.ones((2, 8, 16)))
    assert other.maps.maps is other.fields and (other.maps.weights == 1.0).all()


@pytest.fixture
def ball(tmp_path):
    """A ball in a booth, as a file says it."""
    path = tmp_path / "scene.toml"
    path.write_text(
        '[[part]]\nname = "ball"\nshape = "sphere"\nsubdivisions = 2\nmaterial = "tiny/satin-green"\n'
        '[[light]]\nkind = "booth"\nbooth = "D65"\n[[camera]]\nwidth = 16\nheight_px = 16\n'
    )
    return load_scene(path)


@pytest.mark.slow_cases("software")
@pytest.mark.parametrize("name", ["auto", "software"])
def test_scripts_switch_lights_without_a_renderer_of_their_own(ball, tiny_catalogue, work, name):
    catalogue = Catalogue.open(tiny_catalogue)
    api.close_renderers()
    metamer.render(ball, catalogue, renderer=name)
    assert shaded(work) > 0
    work.clear()
    under_a = metamer.render(ball, catalogue, illuminant="A", renderer=name)
    other = metamer.render(replace(ball, observer=observer("1964_10")), catalogue, renderer=name)
    assert shaded(work) == 0
    # Settings of one call are no settings of the next.
    metamer.render(ball, catalogue, renderer=name, filtering="mipmapped")
    metamer.render(ball, catalogue, renderer=name)
    api.close_renderers()
    fresh = metamer.render(ball, catalogue, illuminant="A", renderer=name)
    assert np.abs(under_a.xyz - fresh.xyz).max() < 2e-5 * fresh.xyz.max()
    assert under_a.made_by == fresh.made_by and other.scene.observer.name != under_a.scene.observer.name
    api.close_renderers()


def test_a_kept_renderer_is_of_its_thread_and_goes_where_drawing_fails(ball, tiny_catalogue, monkeypatch):
    catalogue, made = Catalogue.open(tiny_catalogue), []
    named = api.renderer_named
    monkeypatch.setattr(api, "renderer_named", lambda name: made.append(named(name)) or made[-1])
    api.close_renderers()
    metamer.render(ball, catalogue)
    metamer.render(ball, catalogue)
    assert len(made) == 1
    with ThreadPoolExecutor(1) as pool:
        pool.submit(metamer.render, ball, catalogue).result()
        pool.submit(api.close_renderers).result()
    assert len(made) == 2
    monkeypatch.setattr(api, "picture", lambda *args: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        metamer.render(ball, catalogue)
    monkeypatch.undo()
    monkeypatch.setattr(api, "renderer_named", lambda name: made.append(named(name)) or made[-1])
    metamer.render(ball, catalogue)
    assert len(made) == 3
    api.close_renderers()


def test_scripts_switch_lights_in_a_renderer_that_they_keep(ball, tiny_catalogue, work):
    catalogue = Catalogue.open(tiny_catalogue)
    made, _ = create_session()
    with made:
        metamer.render(ball, catalogue, renderer=made)
        work.clear()
        under_a = metamer.render(ball, catalogue, illuminant="A", renderer=made)
        assert shaded(work) == 0
        expected = metamer.render(ball, catalogue, illuminant="A")
    np.testing.assert_allclose(under_a.xyz, expected.xyz, atol=2e-6)


def test_a_material_whose_file_has_changed_is_read_again(write_matt, tmp_path, scenes):
    folder = tmp_path / "catalogue"
    write_matt(folder, "tiny/grey", 0.5)
    catalogue, scene = Catalogue.open(folder), scenes.sphere_scene("tiny/grey", size=8)
    with software_session() as made:
        first = made.forms(catalogue, scene)["tiny/grey"]
        assert made.forms(catalogue, scene)["tiny/grey"] is first
        write_matt(folder, "tiny/grey", 0.25)
        again = made.forms(catalogue, scene)["tiny/grey"]
        assert again is not first
