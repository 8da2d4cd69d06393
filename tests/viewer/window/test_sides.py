"""Whatever a session names is drawn as the headless renderer draws it: what settles is the same picture."""

import re
import shutil
import time
from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.environment.map_light import load_environment
from metamer.lighting.scene import Part
from metamer.lighting.visibility import refinement
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.factored.pack import FactoredBrdf
from metamer.materials.search.edited_material import VariedCatalogue, varied
from metamer.materials.svbrdf.texture import SpectralTexture
from metamer.runtime.errors import InputError
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.formats.xyz_exr import write_xyz_exr
from metamer.spectral.image import ColourImage
from metamer.viewer.gl import shaders
from metamer.viewer.gl.backend import gl_session
from metamer.viewer.gl.tile import read
from metamer.viewer.window import edited_materials
from metamer.viewer.window.canvas_renderer import Quality
from metamer.viewer.window.choices import opened
from metamer.viewer.window.frame import Frame
from metamer.viewer.window.light_choice import Lamp, LightChoice
from metamer.viewer.window.sides import SessionObjects
from metamer.viewer.window.state import Compare, Other, Subject
from metamer.viewer.window.work import Work
from patience import patient

from .test_frame import Shelf

SIZE = 32, 24
BALL, SMALL, FLOOR = "part0", "part1", "part2"
NM = np.arange(400.0, 701.0, 20.0)
WOVEN = SpectralTexture(NM, np.random.default_rng(2).uniform(0.1, 0.9, (16, 16, len(NM)))).own_form()


@pytest.fixture(scope="module", autouse=True)
def few_divisions(tmp_path_factory):
    """Floors of few sites: these tests have to be quick. What is kept of them is not for tests that divide as usual."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(refinement, "MOST_VERTICES", 400)
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("few")))
        yield


@pytest.fixture(scope="module")
def scene(scenes, tmp_path_factory):
    made = scenes.two_balls()
    camera = replace(made.camera(), height_px=24, samples=2)
    return replace(made, cameras=(camera,), path=tmp_path_factory.mktemp("scene") / "balls.toml")


@pytest.fixture(scope="module")
def session(scene):
    return opened(scene, Subject(path="balls.toml"), part=BALL)


@pytest.fixture(scope="module")
def map_file(scene):
    """A sky in colours, brighter at one side."""
    rng = np.random.default_rng(3)
    texels = rng.uniform(0.2, 1.0, (16, 32, 3)).astype(np.float32)
    texels[4:7, 8:12] *= 6.0
    path = scene.path.parent / "sky.exr"
    primaries = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)
    channels = dict(zip("RGB", texels.transpose(2, 0, 1), strict=True))
    write_exr(path, {"chromaticities": primaries}, channels)
    return path.name


@pytest.fixture(scope="module")
def surfaces(scenes):
    return scenes.SURFACES | {"woven": WOVEN}


@pytest.fixture(scope="module")
def shared_frame(gl, scene, surfaces):
    made = Frame(gl, SessionObjects(scene, Shelf(surfaces)))
    yield made
    made.release()


@pytest.fixture
def frame(shared_frame, scene, surfaces, session):
    """The frame that all tests share, with this file's scene and surfaces, whatever another test turned it to."""
    sources = shared_frame._sources
    if sources.scene is not scene or getattr(sources.catalogue, "_surfaces", None) is not surfaces:
        assert shared_frame.turn_to(SessionObjects(scene, Shelf(surfaces)), session, SIZE)
    return shared_frame


@pytest.fixture(scope="module")
def renderer(gl, shared_frame):
    """Make the session as `metamer render` has it; programs are compiled once for it and for the frame."""
    made = gl_session(gl)
    made.backend.passes.use_programs_of(shared_frame._renderer(Quality.EXACT, 0).session.backend.passes)
    yield made
    made.release()


@pytest.fixture(scope="module")
def headless(renderer):
    """Draws a side once more, whole."""

    def drawn(frame, number):
        side = frame.sides[number]
        (xyz, coverage), *_ = renderer.render_many(side.scene, frame.camera, side.surfaces, (side.illuminant,))
        return side.dimming * xyz, coverage

    return drawn


def settled(frame, session):
    frame.show(session, SIZE)
    assert frame.problem is None, frame.problem
    frame.settle()
    assert frame.problem is None and frame.quality == Quality.EXACT
    return [read(one) for one in frame.canvases]


def assert_as_headless(frame, headless, number=0):
    found = read(frame.canvases[number])
    xyz, coverage = headless(frame, number)
    off = np.abs(found[..., :3] - xyz).max(axis=-1)
    assert xyz.max() > 0.05 and (off > 0.002).mean() <= 1e-4, off.max()
    assert (found[..., 3] != coverage).mean() <= 1e-2


@pytest.mark.slow
@pytest.mark.parametrize("light", ["booth", "booth turned", "map of a lamp"])
def test_light_from_all_around(frame, headless, session, map_file, light):
    chosen = {
        "booth": LightChoice(booth="TL84"),
        "booth turned": LightChoice(booth="D65", rotation_deg=120.0, dimming=0.5),
        "map of a lamp": LightChoice(lamps=(Lamp("FL11"), Lamp("A", 0.5)), map=map_file),
    }[light]
    settled(frame, replace(session, light=chosen))
    assert not frame.sides[0].scene.delta_lights
    assert_as_headless(frame, headless)


@pytest.mark.slow
def test_a_booth_beside_the_scenes_light_and_another_spectrum_of_it_is_a_fold(frame, headless, session):
    session = replace(session, light=LightChoice(booth="A"), other=Other(light=LightChoice.named("FL11")))
    settled(frame, session)
    for number in (0, 1):
        assert_as_headless(frame, headless, number)
    session = replace(session, light=LightChoice(booth="A", lamps=(Lamp("HP1"),)), other=Other())
    settled(frame, replace(session, light=LightChoice(booth="A")))
    assert frame.show(session, SIZE) == Work.FOLD and frame.quality == Quality.EXACT
    assert_as_headless(frame, headless)


@pytest.mark.slow
def test_a_map_in_colours_is_that_of_a_scene_file(scene, surfaces, session, map_file):
    sources = SessionObjects(scene, Shelf(surfaces))
    first, _ = sources.sides(replace(session, light=LightChoice(map=map_file, uplift="jakob-hanika")))
    (found,) = first.scene.lights
    wanted = load_environment(scene.path.parent / map_file, uplift="jakob-hanika", illuminance_lux=1000.0)
    np.testing.assert_array_equal(found.fields, wanted.fields)
    assert [one.key for one in found.spectra] == [one.key for one in wanted.spectra]


def test_a_map_that_says_no_spectrum_asks_for_one_and_one_that_is_not_there_is_said(frame, session, map_file):
    settled(frame, session)
    for light, words in ((LightChoice(map=map_file), "of what spectrum"), (LightChoice(map="no.exr"), "no.exr")):
        frame.show(replace(session, light=light), SIZE)
        assert words in frame.problem and frame.quality == Quality.EXACT


@pytest.mark.slow
def test_light_between_surfaces(frame, headless, session):
    direct = settled(frame, session)[0]
    session = replace(session, bounces=True, other=Other(light=LightChoice.named("FL11")))
    settled(frame, session)
    assert np.abs(read(frame.canvases[0]) - direct).max() > 0.02
    for number in (0, 1):
        assert_as_headless(frame, headless, number)


@pytest.mark.slow
def test_what_a_part_puts_on_others_is_what_they_lack_when_it_is_black(frame, renderer, scenes, session):
    settled(frame, replace(session, influence=FLOOR))
    side, found = frame.sides[0], read(frame.canvases[0])
    black = scenes.lambert_pack(np.zeros_like(scenes.spectrum(1)))
    surfaces = {**side.surfaces, "black": FactoredBrdf((black,))}
    pictures = [
        renderer.render(one, frame.camera, surfaces)[0]
        for one in (side.scene, side.scene.with_material(FLOOR, "black"))
    ]
    without = replace(side.scene, parts=side.scene.parts[:2], bounces=0)
    share = renderer.coverage(without, frame.camera)
    others, floor = share == 1.0, (share == 0.0) & (found[..., 3] == 1.0)
    wanted = pictures[0] - pictures[1]
    assert others.sum() > 50 and floor.sum() > 50 and wanted[others].max() > 0.02
    assert np.abs(found[..., :3] - wanted)[others].max() < 0.002
    assert not found[..., :3][floor].any()


def test_other_shapes_stand_where_the_part_stood(frame, headless, session, scene):
    path = scene.path.parent / "wedge.obj"
    path.write_text("v 0 0 0\nv 3 0 0\nv 0 0 2\nv 0 4 0\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    low, high = scene.part(BALL).mesh.bounds
    for shape in ("plane", path.name):
        settled(frame, replace(session, subject=replace(session.subject, shape=shape)))
        assert_as_headless(frame, headless)
        found = frame.sides[0].scene.part(BALL).mesh
        assert found.bounds[0][1] == pytest.approx(low[1])
        assert (found.bounds[1] - found.bounds[0]).max() == pytest.approx((high - low).max())
    frame.show(replace(session, subject=replace(session.subject, shape="no-shape.obj")), SIZE)
    assert "no-shape.obj" in frame.problem


def test_a_texture_is_worn(frame, headless, session):
    settled(frame, session.wearing(FLOOR, "woven"))
    assert_as_headless(frame, headless)


def test_a_file_on_side_b_is_what_it_holds_and_gives_the_picture_its_size(frame, headless, session, scene):
    rng = np.random.default_rng(1)
    xyz, coverage = rng.uniform(0.0, 1.0, (10, 14, 3)), rng.uniform(0.0, 1.0, (10, 14))
    white = np.array([1.1, 1.0, 0.35])
    write_xyz_exr(scene.path.parent / "before.exr", ColourImage(xyz, "xyz", white), coverage)
    session = replace(session, other=Other(made="file", file="before.exr"), compare=Compare("difference"))
    first, second = settled(frame, session)
    np.testing.assert_allclose(second, np.dstack([xyz, coverage]), atol=1e-6)
    np.testing.assert_allclose(frame.whites[1], white, rtol=1e-6)
    assert first.shape == (10, 14, 4) and frame.texture.size == (14, 10)
    assert_as_headless(frame, headless)
    frame.show(replace(session, other=Other(made="file", file="nothing.exr")), SIZE)
    assert "nothing.exr" in frame.problem
    settled(frame, replace(session, other=Other()))
    assert frame.texture.size == SIZE


def test_now_against_a_picture_that_was_kept_is_no_difference(frame, session, scene):
    settled(frame, session)
    frame.keep(scene.path.parent / "kept.exr")
    settled(frame, replace(session, other=Other(made="file", file="kept.exr"), compare=Compare("difference")))
    found, over = frame.statistics()
    assert found.max < 1e-3 and over == 0.0


def test_the_reference_as_side_b_comes_row_by_row(frame, session):
    session = replace(session, other=Other(made="reference"), compare=Compare("difference"))
    first, second = settled(frame, session)
    assert not second.any()
    half = first.copy()
    half[::2] = 0.0
    frame.put_reference(half[..., :3], half[..., 3])
    found, _ = frame.statistics()
    assert found.max < 1e-3 and 0 < found.pixels < (first[..., 3] == 1.0).sum()
    assert not frame.step(0.0)
    settled(frame, replace(session, observer="1964_10"))
    assert not read(frame.canvases[1]).any()


def test_another_version_of_the_catalogue(gl, frame, scene, surfaces, session, monkeypatch):
    sources = SessionObjects(scene, Shelf(surfaces))
    sources._catalogues["before"] = Shelf(surfaces | {"gloss": surfaces["brushed"]})
    assert frame.turn_to(sources, replace(session, other=Other(catalogue="before")), SIZE)
    frame.settle()
    assert frame.sides[1].surfaces["gloss"] is surfaces["brushed"]
    assert frame.sides[0].surfaces["gloss"] is surfaces["gloss"]
    frame.show(replace(session, other=Other(catalogue="/nowhere")), SIZE)
    assert "no such catalogue" in frame.problem


@pytest.fixture(scope="module")
def catalogue(tiny_catalogue):
    return Catalogue.open(tiny_catalogue)


@pytest.fixture
def worn(scene):
    for part in scene.parts:
        scene = scene.with_material(part.name, "tiny/matt-red")
    return scene


def test_an_edited_material_is_fitted_beside_what_is_seen(frame, headless, worn, catalogue, session, monkeypatch):
    held = []
    monkeypatch.setattr(edited_materials, "varied", lambda *args: (held.append(args), varied(*args))[1])
    assert frame.turn_to(SessionObjects(worn, catalogue), session, SIZE)
    frame.settle()
    before = read(frame.canvases[0])
    edited = session.edited("tiny/matt-red", "reflectance_scale", 0.5)
    frame.show(edited, SIZE)
    assert frame.step(0.0)
    deadline = time.monotonic() + patient(60)
    while frame.step(0.05):
        assert time.monotonic() < deadline
    assert len(held) == 1 and frame.problem is None and frame.quality == Quality.EXACT
    assert_as_headless(frame, headless)
    found = read(frame.canvases[0])
    np.testing.assert_allclose(found[..., :3], 0.5 * before[..., :3], atol=0.004)
    made = frame.catalogue
    assert isinstance(made, VariedCatalogue) and list(made.made) == list(frame.sides[0].scene.material_ids)
    assert frame.asked_reference(0).made.keys() == made.made.keys()
    # Back and forth costs nothing: both are kept.
    for one in (session, edited):
        frame.show(one, SIZE)
        frame.settle()
    assert len(held) == 1


def test_a_parameter_that_is_not_there_is_said(frame, worn, catalogue, session):
    assert frame.turn_to(SessionObjects(worn, catalogue, waits=True), session, SIZE)
    frame.show(session.edited("tiny/matt-red", "fuzz", 0.5), SIZE)
    assert "fuzz" in frame.problem


def test_a_scene_that_breaks_while_it_is_read_again_leaves_the_last_good_one(frame, headless, scene, surfaces, session):
    assert frame.turn_to(SessionObjects(scene, Shelf(surfaces)), session, SIZE)
    frame.settle()
    before = read(frame.canvases[0])
    broken = replace(scene, parts=(*scene.parts[:2], Part(FLOOR, scene.parts[2].mesh, "gone")))

    class Gone(Shelf):
        def surface(self, name):
            if name == "gone":
                raise InputError("no such material", found=name)
            return super().surface(name)

    assert not frame.turn_to(SessionObjects(broken, Gone(surfaces)), session, SIZE)
    assert "gone" in frame.problem
    frame.settle()
    np.testing.assert_array_equal(read(frame.canvases[0]), before)
    settled(frame, replace(session, light=LightChoice.named("A")))
    assert_as_headless(frame, headless)


def test_what_cannot_be_worked_out_is_said_once_and_the_window_goes_on(frame, scene, surfaces, session, monkeypatch):
    assert frame.turn_to(SessionObjects(scene, Shelf(surfaces)), session, SIZE)
    frame.settle()

    def refused(*_args):
        raise InputError("a material that reflects more than it receives")

    monkeypatch.setattr("metamer.viewer.gl.side_layers.SideLayers.work_out", refused)
    asked = replace(session, bounces=True).wearing(FLOOR, "gloss")
    frame.show(asked, SIZE)
    deadline = time.monotonic() + patient(20)
    while frame.step(0.05):
        assert time.monotonic() < deadline
    assert "reflects more" in frame.problem
    frame.show(asked, SIZE)
    assert "reflects more" in frame.problem and not frame.step()
    frame.show(session, SIZE)
    frame.settle()
    assert frame.problem is None and frame.quality == Quality.EXACT


def test_a_lamp_of_no_power_is_said(frame, scene, session):
    settled(frame, session)
    dark = scene.path.parent / "dark.csv"
    dark.write_text("wavelength_nm,power\n" + "".join(f"{nm},0.0\n" for nm in range(380, 781, 10)))
    frame.show(replace(session, light=LightChoice.named(dark.name)), SIZE)
    assert frame.problem and frame.quality == Quality.EXACT


def test_three_hundred_materials_are_gone_through_in_bounded_memory(frame, scene, scenes, session):
    names = {f"m{number}": scenes.SURFACES["matt"] for number in range(300)}
    sources = SessionObjects(scene, Shelf(scenes.SURFACES | names))
    assert frame.turn_to(sources, session, SIZE)
    for name in names:
        frame.show(session.wearing(BALL, name), SIZE, moving=True)
        assert frame.problem is None
    assert len(sources._surfaces) <= 64 and len(sources._sides) <= 32
    frame.show(session.wearing(BALL, "m299"), SIZE)
    frame.settle()
    assert frame.quality == Quality.EXACT


def test_a_shader_that_breaks_leaves_the_last_good_one_and_says_where(
    frame, scene, surfaces, session, monkeypatch, tmp_path
):
    folder = shutil.copytree(str(shaders.shader_folder()), tmp_path / "shaders")
    monkeypatch.setattr(shaders, "shader_folder", lambda: folder)
    assert frame.turn_to(SessionObjects(scene, Shelf(surfaces)), session, SIZE)
    frame.settle()
    before = read(frame.canvases[0])
    put, text = folder / "put.frag", (folder / "put.frag").read_text()
    put.write_text(text.replace("void main() {", "void main() {\n    none_such(1);", 1))
    words = frame.read_shaders_again()
    assert "put.frag" in words and "none_such" in words
    settled(frame, replace(session, observer="1964_10"))
    settled(frame, session)
    np.testing.assert_allclose(read(frame.canvases[0]), before, atol=1e-6)
    put.write_text(re.sub(r"(void main\(\) \{)", r"\1\n    // as it was", text, count=1))
    assert frame.read_shaders_again() is None
    frame.settle()
    assert frame.quality == Quality.EXACT
    np.testing.assert_allclose(read(frame.canvases[0]), before, atol=1e-6)
