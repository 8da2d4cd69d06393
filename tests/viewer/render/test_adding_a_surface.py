"""The fast form of docs/adding_a_surface.md, by its word: two files and a row, and everything works from there."""

import ast
import importlib.util
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.lighting.plan import plan_scene
from metamer.lighting.reference.reference import reference_images
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.core.protocol import measured
from metamer.materials.factored.pack import FactoredBrdf
from metamer.materials.records import models, record
from metamer.materials.records.material import MaterialRecord, Provenance
from metamer.materials.records.record_head import read_head
from metamer.runtime.errors import InputError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.folding import Folding
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM
from metamer.viewer.gl.backend import gl_session
from metamer.viewer.gl.shaders import ShaderError
from metamer.viewer.software.backend import NumpyBackend, software_session

PAGE = Path(__file__).parents[3] / "docs" / "adding_a_surface.md"
LIGHTS = [illuminant(name) for name in ("D65", "A", "FL11", "LED-B3", "HP1")]
# Sides of the texture: not square, and no power of two.
HEIGHT, WIDTH = 5, 7


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """The page's module, from files that hold what the page prints, with its rows in their tables."""
    (python, row), (twin,) = (
        re.findall(rf"```{kind}\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL) for kind in ("python", "glsl")
    )
    folder = tmp_path_factory.mktemp("materials")
    (folder / "matt_texture.py").write_text(python, encoding="utf-8")
    (folder / "matt_texture.glsl").write_text(twin, encoding="utf-8")
    name = "metamer.materials.matt_texture"
    spec = importlib.util.spec_from_file_location(name, folder / "matt_texture.py")
    module = importlib.util.module_from_spec(spec)
    known = re.search(r'`"matt_texture": (Measured\(.*?\))`', PAGE.read_text(encoding="utf-8"))[1]
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, name, module)
        spec.loader.exec_module(module)
        forms = eval(ast.unparse(ast.parse(row).body[0].value), {"FactoredBrdf": FactoredBrdf, **vars(module)})
        patch.setattr(record, "FORMS", forms)
        patch.setitem(models.MEASURED, "matt_texture", eval(known, {"Measured": models.Measured}))
        yield module


@pytest.fixture(scope="module")
def texture(page):
    rng = np.random.default_rng(7)
    x = np.linspace(0.0, 1.0, WORKING_WAVELENGTHS_NM.size)
    phase, slope = rng.uniform(0.0, 6.0, (2, HEIGHT, WIDTH, 1))
    return page.MattTexture(WORKING_WAVELENGTHS_NM, 0.45 + 0.4 * np.sin(phase + slope * x))


@pytest.fixture(params=["numpy", "GL"])
def renderer(request):
    with software_session() if request.param == "numpy" else gl_session(request.getfixturevalue("gl")) as made:
        yield made


def textured_scene(scenes, *, mirrored=False, repeats=2.5):
    """A textured ball beside a uniform one, on a textured ground, under two lights of different spectra."""
    ball, ground = shapes.sphere(3, uv=True), shapes.plane(6.0, 6.0)
    ground = replace(ground, uv=repeats * ground.uv * ((-1.0, 1.0) if mirrored else (1.0, 1.0)))
    parts = [
        (ball.placed(translate=(-0.8, 0.9, 0.0)), "cloth"),
        (shapes.sphere(3).placed(translate=(1.2, 0.9, 0.0)), "gloss"),
        (ground, "cloth"),
    ]
    camera = Camera("c", (0.5, 3.5, 6.0), (0.0, 0.5, 0.0), vertical_fov_deg=36.0, width=72, height_px=54, samples=2)
    return scenes.scene_of(parts, [scenes.sun(), scenes.lamp()], camera)


@pytest.mark.parametrize("mirrored", [False, True], ids=["plain", "mirrored uv"])
def test_pictures_of_both_renderers_are_the_reference(scenes, texture, renderer, mirrored):
    scene, fast = textured_scene(scenes, mirrored=mirrored), texture.own_form()
    truth = reference_images(scene, None, {"cloth": texture, "gloss": scenes.SURFACES["gloss"]}, LIGHTS)
    shown = renderer.render_many(scene, None, {"cloth": fast, "gloss": scenes.SURFACES["gloss"]}, LIGHTS)
    for (xyz, coverage), reference, light in zip(shown, truth.xyz, LIGHTS, strict=True):
        whole = (coverage == 1.0) & (truth.coverage == 1.0)
        off = delta_e_xyz(reference[whole], xyz[whole].astype(float), scene.observer.white(light))
        # Two shadows' outlines and the ball's grazing texels are all that is left.
        assert whole.mean() > 0.5 and np.median(off) < 0.01 and np.percentile(off, 95) < 0.3
        spread = np.std(xyz[whole], axis=0)
        assert spread.min() > 0.05, "a texture is to be seen"


def test_gl_and_numpy_agree_on_every_pixel(scenes, texture, drawn_by_both):
    surfaces = {"cloth": texture.own_form(), "gloss": scenes.SURFACES["gloss"]}
    assert drawn_by_both(textured_scene(scenes), surfaces).off.max() < 0.05


def test_kept_terms_beside_what_is_drawn_anew(scenes, texture, renderer):
    """A uniform material's terms are kept, a texture's are not: the picture is the same."""
    scene, surfaces = textured_scene(scenes), {"cloth": texture.own_form(), "gloss": scenes.SURFACES["gloss"]}
    plain = renderer.render_many(scene, None, surfaces, LIGHTS[:2])
    renderer.configure(keeps_terms=True)
    for _ in range(2):
        for (kept, _), (once, _) in zip(renderer.render_many(scene, None, surfaces, LIGHTS[:2]), plain, strict=True):
            np.testing.assert_allclose(kept, once, rtol=1e-5, atol=1e-6)


def test_a_uniform_scene_asks_for_no_texture_coordinates_and_a_texture_after_it_does(scenes, texture, renderer):
    scene = textured_scene(scenes)
    uniform = {"cloth": scenes.SURFACES["matt"], "gloss": scenes.SURFACES["gloss"]}
    renderer.render(scene, None, uniform)
    assert not any(piece.tile.needs.uv for piece in renderer.cache.pieces)
    textured, _ = renderer.render(scene, None, uniform | {"cloth": texture.own_form()})
    assert all(piece.tile.needs.uv for piece in renderer.cache.pieces)
    kind = software_session if isinstance(renderer.backend, NumpyBackend) else gl_session
    with kind() as fresh:
        np.testing.assert_array_equal(textured, fresh.render(scene, None, uniform | {"cloth": texture.own_form()})[0])


def test_a_mesh_without_texture_coordinates_is_refused_by_name(scenes, texture, renderer):
    scene = scenes.scene_of([(shapes.sphere(2), "cloth")], [scenes.sun()], scenes.sphere_scene().camera())
    with pytest.raises(InputError, match=r"(?s)part part0.*cloth.*texture coordinates"):
        renderer.render(scene, None, {"cloth": texture.own_form()})
    with pytest.raises(InputError, match="texture coordinates"):
        reference_images(scene, None, {"cloth": texture})


def test_the_catalogue_stores_it_and_the_plan_sees_its_colours(page, texture, tmp_path):
    fast = measured(texture.own_form(), texture, 32)
    assert fast.error.maximum < 1e-6, "exact"
    made = MaterialRecord(
        "cloth/checked", "cloth", "matt_texture", texture.parameters(), Provenance("a test", "none", "measured"), fast
    )
    (tmp_path / "cloth").mkdir()
    (tmp_path / record.MARKER).write_text("schema = 2\n")
    record.write_record(made, tmp_path / "cloth" / "checked.h5")
    catalogue = Catalogue.open(tmp_path)
    found = catalogue.load("cloth/checked")
    assert isinstance(found.fast, page.MattForm) and found.error == fast.error
    np.testing.assert_array_equal(found.fast.summands[0].palette.values, fast.summands[0].palette.values)
    np.testing.assert_array_equal(found.surface().reflectance, texture.reflectance)
    assert catalogue.verify() == {"cloth/checked": None}

    eye = observer("1931_2")
    plan = plan_scene([found.drawn()], LIGHTS, eye, 0.5)
    assert plan.basis_size > 3
    thinned, folding = found.drawn().in_basis(plan.basis), Folding(eye, LIGHTS, np.pi)
    own, shown = (one.summands[0].palette.folded(folding) for one in (fast, thinned))
    for number, light in enumerate(LIGHTS):
        columns = slice(3 * number, 3 * number + 3)
        assert delta_e_xyz(own[..., columns], shown[..., columns], eye.white(light)).max() < 0.5


def test_a_name_that_the_twin_does_not_have_is_refused(page, texture, scenes, gl, monkeypatch):
    """GL itself says nothing of it, and draws something else."""
    shader = page.MattTexels.shader
    wrong = {"texel_count": (WIDTH, HEIGHT)}
    monkeypatch.setattr(page.MattTexels, "shader", lambda self, *other: replace(shader(self), uniforms=wrong))
    with gl_session(gl) as renderer, pytest.raises(ShaderError, match=r"matt_texture\.glsl: no uniform 'texel_count'"):
        renderer.render(textured_scene(scenes), None, {"cloth": texture.own_form(), "gloss": scenes.SURFACES["gloss"]})


def test_its_average_is_what_lists_show(page, texture):
    mean = texture.reflectance.mean(axis=(0, 1))
    for average in (texture.average(), texture.own_form().average()):
        up = np.array([0.0, 0.0, 1.0])
        np.testing.assert_allclose(np.pi * average.eval(up, up), mean, rtol=1e-9)


@pytest.mark.parametrize("original_knows_one", [False, True])
def test_the_original_is_asked_where_the_fast_form_has_no_average(
    page, texture, tmp_path, monkeypatch, original_knows_one
):
    monkeypatch.setattr(page.MattForm, "average", lambda self: self)
    if not original_knows_one:
        monkeypatch.setattr(page.MattTexture, "average", lambda self: self)
    said = Provenance("a test", "none", "measured")
    form = texture.own_form()
    made = MaterialRecord("cloth/checked", "cloth", "matt_texture", texture.parameters(), said, form)
    record.write_record(made, tmp_path / "checked.h5")
    assert (read_head(tmp_path / "checked.h5")["colour"] is not None) is original_knows_one
