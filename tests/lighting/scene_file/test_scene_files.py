import re
from dataclasses import fields
from inspect import signature
from pathlib import Path

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.lights import DirectionalLight, PointLight
from metamer.lighting.mesh import shapes
from metamer.lighting.mesh.files import SUFFIXES, load_mesh
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.scene import Part, Review, Scene, Viewing
from metamer.lighting.scene_file import keys as scene_keys
from metamer.lighting.scene_file.files import load_scene, scene_file
from metamer.lighting.scene_file.light_tables import LIGHTS
from metamer.materials.intake.sources import read_sources
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.illuminants import illuminant

ROOT = Path(__file__).resolve().parents[3]


class Ids:
    """A catalogue, as far as scenes look at it."""

    def __init__(self, *ids):
        self._ids = ids

    def ids(self):
        return self._ids


@pytest.fixture
def scene(tmp_path):
    def load(text, catalogue=None):
        path = tmp_path / "scene.toml"
        path.write_text(text, encoding="utf-8")
        return load_scene(path, catalogue)

    return load


BARE = '[[part]]\nshape = "sphere"\nsubdivisions = 2\nmaterial = "paint/red"\n'


def test_python_and_the_file_use_the_same_words():
    """Keys are fields of the types, or parameters of what makes and places a mesh."""

    def words(kind):
        return {field.name for field in fields(kind)}

    # Pictures are cut into parts by whoever draws them, not by files.
    assert words(Camera) - {"part_of"} == set(scene_keys.CAMERA)
    assert words(Viewing) == set(scene_keys.VIEWING)
    assert words(Review) == set(scene_keys.REVIEW)
    assert words(Scene) >= set(scene_keys.SCENE)
    for light in LIGHTS.values():
        known = {*signature(light.make).parameters}
        assert known - {"spectrum_name", "say"} == {"name", "spectrum", *light.keys}
    for shape, keys in scene_keys.SHAPES.items():
        assert set(signature(getattr(shapes, shape)).parameters) >= set(keys)
    places, reads = ({*signature(one).parameters} - {"self", "path"} for one in (Mesh.placed, load_mesh))
    # A row of patches has a part for each of its `materials`.
    # The material says whether a part has holes.
    assert (words(Part) - {"cutout"}) | places | reads == set(scene_keys.PART) - {"shape", "materials"}


def test_a_part_and_a_material_are_enough(scene):
    loaded = scene(BARE)
    (light,) = loaded.lights
    assert isinstance(light, DirectionalLight)
    assert light.illuminance_lux == 1000
    assert light.spectrum is illuminant("D65")
    assert (light.direction_to_light * [-1, 1, 1] > 0).all(), "from the upper left front"
    assert loaded.observer.name == "CIE 1931 2 Degree Standard Observer"
    assert loaded.viewing.reference_illuminance_lux == 1000
    assert len(loaded.notes) == 2, loaded.notes
    camera = loaded.camera()
    ball = loaded.parts[0].mesh.vertices
    clip = np.c_[ball, np.ones(len(ball))] @ camera.clip_from_world().T
    ndc = clip[:, :3] / clip[:, 3:]
    assert np.abs(ndc).max() < 1
    assert np.abs(ndc[:, 1]).max() > 0.7


def test_everything_that_can_be_said(scene, tmp_path):
    (tmp_path / "lamp.csv").write_text("wavelength,booth,spot\n380,1,2\n500,2,2\n780,1,2\n")
    (tmp_path / "tri.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n")
    loaded = scene(
        """
        [scene]
        name = "All"
        observer = "1964_10"
        [viewing]
        reference_illuminance_lux = 250
        background_reflectance = 0.4
        adaptation = "CAT16"
        display = "sRGB - Display"
        view = "Video (colorimetric)"
        [[part]]
        name = "triangle"
        mesh = "tri.obj"
        material = "paint/red"
        translate = [1, 2, 3]
        rotate_deg = [0, 0, 90]
        scale = [2, 1, 1]
        [[light]]
        name = "lamp"
        kind = "point"
        position = [0, 4, 0]
        intensity_cd = 500
        spectrum = "lamp.csv"
        spectrum_column = "spot"
        [[camera]]
        name = "ortho"
        projection = "orthographic"
        position = [0, 0, 9]
        height = 4
        [review]
        on = "triangle"
        materials = ["paint/*"]
        illuminants = ["F2"]
        """,
        Ids("paint/red", "paint/blue"),
    )
    np.testing.assert_allclose(loaded.parts[0].mesh.vertices, [[1, 2, 3], [1, 4, 3], [0, 2, 3]], atol=1e-15)
    (lamp,) = loaded.lights
    assert isinstance(lamp, PointLight)
    assert lamp.spectrum_name == "spot"
    assert lamp.spectrum.samples.tolist() == [2, 2, 2]
    np.testing.assert_allclose(loaded.camera("ortho").target, [0.5, 3, 3])
    assert loaded.viewing.adaptation == "CAT16"
    assert loaded.review.illuminants == ("F2",)
    assert loaded.notes == ()


def test_turns_go_about_x_then_y_then_z(scene, tmp_path):
    (tmp_path / "tri.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    mesh = scene('[[part]]\nmesh = "tri.obj"\nrotate_deg = [90, 90, 0]\n').parts[0].mesh
    # y goes to z about x, and z to x about y.
    np.testing.assert_allclose(mesh.vertices[mesh.vertices[:, 2].argmin()], [0, 0, -1], atol=1e-15)
    assert mesh.vertices[:, 0].max() == pytest.approx(1)


def test_patches_take_one_material_each(scene):
    loaded = scene('[[part]]\nname = "row"\nshape = "patches"\nmaterials = ["a/1", "a/2", "a/1"]\n')
    assert [part.name for part in loaded.parts] == ["row/1", "row/2", "row/3"]
    assert loaded.material_ids == ("a/1", "a/2")


def test_another_material_and_another_illuminant(scene):
    loaded = scene(BARE)
    other = loaded.with_material("sphere", "paint/blue").with_illuminant(illuminant("A"), "A")
    assert other.material_ids == ("paint/blue",)
    assert other.parts[0].mesh is loaded.parts[0].mesh
    assert other.lights[0].spectrum is illuminant("A")
    assert other.lights[0].illuminance_lux == 1000
    assert loaded.material_ids == ("paint/red",)
    np.testing.assert_allclose(other.adopted_white(), loaded.observer.white(illuminant("A")))
    with pytest.raises(UnknownNameError, match="nearest: sphere"):
        loaded.with_material("spere", "paint/blue")


def test_a_part_that_others_are_put_on_may_have_a_material_that_is_not_there(tmp_path):
    path = tmp_path / "scene.toml"
    other = BARE.replace("red", "blue") + 'name = "other"\n'
    for text in (f"{BARE}{other}", f'{other}{BARE}name = "on"\n[review]\non = "on"\nmaterials = ["cloth/*"]\n'):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(UnknownNameError, match="unknown material"):
            load_scene(path, Ids("paint/blue"))
        assert set(load_scene(path, Ids("paint/blue"), swept=True).material_ids) == {"paint/red", "paint/blue"}
        # The other parts are drawn.
        with pytest.raises(UnknownNameError, match="unknown material"):
            load_scene(path, Ids("paint/green"), swept=True)


def test_the_white_of_two_lights_is_mixed_by_their_illuminance(scene):
    lights = "".join(
        f'[[light]]\ndirection_to_light = [0, 0, 1]\nspectrum = "{name}"\nilluminance_lux = {lux}\n'
        for name, lux in (("D65", 300), ("A", 100))
    )
    loaded = scene(BARE + lights)
    d65, a = (loaded.observer.white(illuminant(name)) for name in ("D65", "A"))
    np.testing.assert_allclose(loaded.adopted_white(), 0.75 * d65 + 0.25 * a, rtol=1e-14)
    assert loaded.viewing.reference_illuminance_lux == 400


@pytest.fixture(scope="module")
def shipped():
    return Ids(*(source.id for source in read_sources(ROOT / "catalogs" / "shipped")))


SHOWROOM = ("gloss", "metals", "corner")


@pytest.mark.parametrize("name", SHOWROOM)
def test_scenes_of_the_showroom_load_with_what_ships(name, shipped):
    loaded = load_scene(ROOT / "examples" / "showroom" / f"{name}.toml", shipped)
    assert {part.material for part in loaded.parts} <= set(shipped.ids()) and loaded.camera().width == 1280


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.toml")), ids=lambda path: path.stem)
def test_every_example_loads_without_an_assumption_and_its_materials_ship(path, shipped):
    loaded = load_scene(path, shipped)
    assert loaded.notes == tuple(f"light 1 (booth): {note}" for note in loaded.lights[0].notes)
    assert bool(loaded.notes) == (path.stem in ("booth", "thumbnail", "thumbnail_cloth")), "a booth says what it is"
    assert loaded.review is not None


def test_the_scenes_of_the_manual_load(scene, shipped, tmp_path):
    snippets = re.findall(r"```toml\n(.*?)```", (ROOT / "docs" / "scene.md").read_text(encoding="utf-8"), re.DOTALL)
    assert len(snippets) == 6
    faces = "usemtl Leather\nf 1/1 2/2 3/3\nusemtl Top stitch\nf 3/3 2/2 1/1\n"
    (tmp_path / "seat.obj").write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n{faces}")
    write_exr(tmp_path / "sky.exr", {}, {name: np.ones((4, 8)) for name in "RGB"})
    for snippet in snippets:
        assert scene(snippet, shipped).parts


def test_the_manual_names_every_key():
    manual = (ROOT / "docs" / "scene.md").read_text(encoding="utf-8")
    tables = [scene_keys.SCENE, scene_keys.VIEWING, scene_keys.PART, scene_keys.LIGHT, scene_keys.CAMERA]
    tables += [scene_keys.REVIEW, *scene_keys.SHAPES.values(), *(light.keys for light in LIGHTS.values())]
    assert [key for table in tables for key in table if f"`{key}`" not in manual] == []
    assert [shape for shape in scene_keys.SHAPES if f"`{shape}`" not in manual] == []


@pytest.mark.parametrize(
    ("text", "field", "words"),
    [
        ("[[part]\n", None, "not a TOML file"),
        ("", None, "empty"),
        ('[scene]\nname = "x"\n', "part", "a scene without parts"),
        ("[part]\n", "part", "[[part]], in double brackets"),
        ("[[scene]]\n" + BARE, "scene", "expected: [scene]"),
        (BARE + "[ligth]\n", "ligth", "nearest: light"),
        (BARE + "colour = 3\n", "part 1.colour", "unknown key"),
        (BARE + 'materail = "x"\n', "part 1.materail", "nearest: material"),
        (BARE + "[viewing]\nbackround_reflectance = 0.2\n", "viewing.backround_reflectance", "background_reflectance"),
        (BARE + "[viewing]\nbackground_reflectance = 20\n", "viewing.background_reflectance", "not per cent"),
        (BARE + "[viewing]\nreference_illuminance_lux = 0\n", "viewing.reference_illuminance_lux", "more than 0 lx"),
        (BARE + '[viewing]\nadaptation = "Bratford"\n', "viewing.adaptation", "nearest: Bradford"),
        (BARE + '[scene]\nobserver = "1931_3"\n', "scene.observer", "nearest: 1931_2"),
        (BARE + "[scene]\nname = 7\n", "scene.name", "text in quotes"),
        ('[[part]]\nshape = "sphre"\n', "part 1.shape", "nearest: sphere"),
        ('[[part]]\nname = "x"\n', "part 1 (x)", "found: neither"),
        ('[[part]]\nshape = "sphere"\nmesh = "a.obj"\n', "part 1", "found: both"),
        ('[[part]]\nshape = "sphere"\nwidth = 3\n', "part 1.width", "unknown key"),
        ('[[part]]\nshape = "sphere"\nmaterials = ["a"]\n', "part 1.materials", "expected: material"),
        ('[[part]]\nshape = "patches"\nmaterial = "a"\n', "part 1.material", "one id a patch"),
        ('[[part]]\nshape = "sphere"\nscale = 0\n', "part 1.scale", "none of them 0"),
        ('[[part]]\nshape = "sphere"\ntranslate = [1, 2]\n', "part 1.translate", "three finite numbers"),
        ('[[part]]\nshape = "sphere"\nsubdivisions = 20\n', "part 1.subdivisions", "0 to 9"),
        (2 * (BARE + "name = 'ball'\n"), "parts", "two parts share a name"),
        (BARE + BARE + '[review]\non = "sphere"\n', "review.on", "give the part that is meant a `name`"),
        (BARE + '[[light]]\nspectrum = "D66"\n', "light 1.spectrum", "nearest: D65"),
        (BARE + '[[light]]\nkind = "area"\n', "light 1.kind", "directional, point"),
        (BARE + "[[light]]\nilluminance_lux = 0\n", "light 1.illuminance_lux", "a light of no power"),
        (BARE + '[[light]]\nname = "sun"\nilluminance_lux = -3\n', "light 1 (sun).illuminance_lux", "found: -3"),
        (BARE + "[[light]]\nilluminance_lux = nan\n", "light 1.illuminance_lux", "a finite number"),
        (BARE + "[[light]]\nposition = [0, 1, 0]\n", "light 1.intensity_cd", "expected: a finite number"),
        (BARE + "[[light]]\nposition = [0, 1, 0]\nilluminance_lux = 4\n", "light 1.illuminance_lux", "unknown key"),
        (BARE + "[[light]]\ndirection_to_light = [0, 0, 0]\n", "light 1.direction_to_light", "no length"),
        (BARE + "[[camera]]\nposition = [0, 5, 0]\n", "camera 1.up", "along the viewing direction"),
        (BARE + "[[camera]]\ntarget = [0, 1, 0]\n", "camera 1.position", "a target but no position"),
        (BARE + "[[camera]]\nwidth = 0\n", "camera 1.width", "at least 1"),
        (BARE + "[[camera]]\nfov = 3\n", "camera 1.fov", "unknown key"),
        (BARE + "[[camera]]\n[[camera]]\nname = 'camera'\n", "cameras", "two cameras share a name"),
        (BARE + '[review]\non = "ball"\n', "review.on", "sphere"),
        (BARE + '[review]\nilluminants = ["D56"]\n', "review.illuminants", "D65"),
        (BARE + "[review]\nmaterials = []\n", "review.materials", "a list of texts"),
        (BARE + "[interreflection]\nbounces = -1\n", "interreflection.bounces", "a whole number from 0"),
        (BARE + "[interreflection]\nbounces = true\n", "interreflection.bounces", "a whole number from 0"),
        (BARE + '[interreflection]\nbounces = "all"\n', "interreflection.bounces", "auto"),
    ],
)
def test_a_bad_scene_says_file_key_and_what_to_do(scene, text, field, words):
    with pytest.raises(InputError) as caught:
        scene(text)
    message = str(caught.value)
    assert "scene.toml" in message
    assert caught.value.field == field
    assert words in message
    assert "\n  expected: " in message or "\n  try: " in message


def test_parts_of_one_shape_are_numbered(scene):
    """A name that is given stands; what has none makes way, and the notes say so."""
    found = scene(
        BARE + BARE + '[[part]]\nshape = "plane"\nmaterial = "paint/red"\n' + BARE + "name = 'sphere 3'\n" + BARE
    )
    assert [part.name for part in found.parts] == ["sphere", "sphere 2", "plane", "sphere 3", "sphere 4"]
    assert any('part 2 is called "sphere 2"' in note for note in found.notes)
    assert scene(BARE + BARE + '[review]\non = "sphere 2"\n').reviewed_part == "sphere 2"
    named = scene(BARE + BARE + "name = 'sphere'\n" + '[review]\non = "sphere"\n')
    assert [part.name for part in named.parts] == ["sphere 2", "sphere"] and named.reviewed_part == "sphere"
    chips = '[[part]]\nshape = "patches"\nmaterials = ["paint/red", "paint/red"]\n'
    assert [part.name for part in scene(chips + chips).parts][1:3] == ["patches/2", "patches 2/1"]


def test_an_unknown_material_says_the_nearest(scene):
    ids = Ids("paint/red-gloss", "paint/blue-gloss", "metal/gold")
    with pytest.raises(UnknownNameError) as caught:
        scene('[[part]]\nshape = "sphere"\nmaterial = "paint/red-glos"\n', ids)
    assert caught.value.field == "part 1.material"
    assert caught.value.nearest[0] == "paint/red-gloss"


def test_a_review_pattern_that_matches_nothing_is_an_error(scene):
    with pytest.raises(UnknownNameError, match=r"review\.materials"):
        scene(BARE + '[review]\nmaterials = ["paints/*"]\n', Ids("paint/red"))


def test_materials_are_shown_on_the_reviewed_part_or_the_first(scene):
    two = BARE + '[[part]]\nshape = "plane"\n'
    assert scene(two).reviewed_part == "sphere"
    assert scene(two + '[review]\non = "plane"\n').reviewed_part == "plane"


def test_a_light_spectrum_of_zeros_is_an_error(scene, tmp_path):
    (tmp_path / "dark.csv").write_text("wavelength,lamp\n400,0\n500,0\n700,0\n")
    with pytest.raises(InputError, match=r"(?s)light 1\.spectrum: a light of no power.*dark\.csv"):
        scene(BARE + '[[light]]\nspectrum = "dark.csv"\n')


def test_a_missing_spectrum_or_mesh_is_named_with_its_own_path(scene, tmp_path):
    with pytest.raises(InputError, match=r"(?s)lamp\.csv.*named in: .*scene\.toml, light 1 \(booth\)\.spectrum"):
        scene(BARE + '[[light]]\nname = "booth"\nspectrum = "lamp.csv"\n')
    with pytest.raises(InputError, match=r"(?s)body\.glb: no such mesh file.*named in: .*scene\.toml, part 2 \(car\)"):
        scene(BARE + '[[part]]\nname = "car"\nmesh = "body.glb"\n')
    (tmp_path / "cut.ply").write_bytes(b"ply\nformat ascii 1.0\nelement vertex 3\nend_header\n0 0 0\n")
    with pytest.raises(InputError, match=r"(?s)cut\.ply.*cut short.*named in: .*scene\.toml, part 1"):
        scene('[[part]]\nmesh = "cut.ply"\n')
    (tmp_path / "two.csv").write_text("wavelength,warm,cold\n400,1,2\n700,1,2\n")
    with pytest.raises(UnknownNameError, match="nearest: warm"):
        scene(BARE + '[[light]]\nspectrum = "two.csv"\nspectrum_column = "warn"\n')


def test_a_scene_file_that_is_missing_is_named(tmp_path):
    with pytest.raises(InputError, match=r"gone\.toml: no such file"):
        load_scene(tmp_path / "gone.toml")


def test_repairs_of_a_mesh_reach_the_scene(scene, tmp_path):
    (tmp_path / "thin.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 2\n")
    notes = scene('[[part]]\nmesh = "thin.obj"\n[[light]]\n[[camera]]\n').notes
    assert notes == (
        "thin: dropped 1 of 2 triangles, which have no area",
        "thin: no normals in the file; computed, creased at 40 degrees",
    )


def test_a_lamp_in_the_very_middle_leaves_a_finite_scale(scene):
    """As in a room: by the inverse square law alone the reference illuminance would be infinite."""
    lamp = '[[light]]\nposition = [0, 0, 0]\nintensity_cd = 100\nspectrum = "A"\n'
    loaded = scene(BARE + lamp)
    low, high = loaded.bounds
    nearest = 0.25 * 0.5 * np.linalg.norm(high - low)
    assert loaded.viewing.reference_illuminance_lux == pytest.approx(100 / nearest**2)
    np.testing.assert_allclose(loaded.adopted_white(), loaded.observer.white(illuminant("A")), rtol=1e-14)
    (note,) = [note for note in loaded.notes if "the white" in note]
    assert note.startswith("light 1 stands 0 from the middle of the scene; for the white") and "0.433 off" in note


def test_a_lamp_beyond_the_middle_counts_from_where_it_stands_and_needs_no_note(scene):
    lamp = '[[light]]\nname = "lamp"\nposition = [0, 0, 2]\nintensity_cd = 100\n[[camera]]\n'
    loaded = scene(BARE + lamp)
    assert loaded.viewing.reference_illuminance_lux == pytest.approx(25)
    assert loaded.notes == ()


def test_a_measured_light_says_what_was_assumed_of_it(scene, tmp_path):
    (tmp_path / "booth.csv").write_text("nm,booth\n400,1\n700,1\n")
    notes = scene(BARE + '[[light]]\nspectrum = "booth.csv"\n[[camera]]\n').notes
    assert notes == ("light 1: booth.csv is known from 400 to 700 nm; from 380 to 780 nm, its end values are repeated",)


@pytest.mark.parametrize(
    ("rows", "problem"),
    [
        ("900,1\n950,1\n", "the light is not known where the observer sees"),
        ("380,0\n840,0\n850,1\n", "the light has zero power"),
    ],
)
def test_a_light_that_the_observer_cannot_see_is_named(scene, tmp_path, rows, problem):
    (tmp_path / "lamp.csv").write_text("nm,lamp\n" + rows)
    with pytest.raises(InputError, match=rf"scene\.toml: light 1\.spectrum: {problem}"):
        scene(BARE + '[[light]]\nspectrum = "lamp.csv"\n')


def test_a_lamp_of_one_sample_is_named_with_its_scene(scene, tmp_path):
    (tmp_path / "lamp.csv").write_text("nm,lamp\n546,1\n")
    with pytest.raises(InputError, match=r"(?s)lamp\.csv.*named in: .*scene\.toml, light 1\.spectrum"):
        scene(BARE + '[[light]]\nspectrum = "lamp.csv"\n')


@pytest.mark.parametrize(
    ("table", "key", "right"),
    [
        ("[[camera]]", "heightt", "height"),
        ("[scene]", "observr", "observer"),
        ("[viewing]", "backgroud_reflectance", "background_reflectance"),
        ("[review]", "material", "materials"),
        ("[interreflection]", "bounce", "bounces"),
    ],
)
def test_a_misspelt_key_is_told_before_a_mesh_is_read_or_a_catalogue_made(tmp_path, table, key, right):
    """Whatever follows may take minutes: the mesh here is broken, and nobody looks at it."""
    path = tmp_path / "scene.toml"
    (tmp_path / "ball.obj").write_text("v 0 0 0\nbroken\n", encoding="utf-8")
    path.write_text(f'{table}\n{key} = 1\n[[part]]\nmesh = "ball.obj"\n', encoding="utf-8")
    for read in (scene_file, load_scene):
        with pytest.raises(UnknownNameError) as caught:
            read(path)
        assert key in str(caught.value) and right in caught.value.nearest


def test_keys_that_would_do_nothing_are_errors(scene):
    with pytest.raises(InputError, match=r"part 1\.crease_deg: not a key of this part"):
        scene(BARE + "crease_deg = 30\n")
    with pytest.raises(InputError, match=r"light 1\.spectrum_column: only a file has columns"):
        scene(BARE + '[[light]]\nspectrum = "D65"\nspectrum_column = "booth"\n')


@pytest.mark.parametrize("angle", [0, -20, 180, 400])
def test_an_angle_of_view_out_of_range_is_an_error_also_when_the_camera_frames_itself(scene, angle):
    with pytest.raises(InputError, match="angle out of range"):
        scene(BARE + f"[[camera]]\nvertical_fov_deg = {angle}\n")


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_one_clip_plane_may_be_given_alone(scene, kind):
    for plane in ("near = 50", "far = 2"):
        camera = scene(BARE + f'[[camera]]\nprojection = "{kind}"\nposition = [0, 0, 9]\n{plane}\n').camera()
        assert camera.near < camera.far


def test_shapes_of_no_size_or_without_end_are_errors(scene):
    with pytest.raises(InputError, match=r"part 1\.width: not the size of a plane"):
        scene('[[part]]\nshape = "plane"\nwidth = 0\n')
    with pytest.raises(InputError, match=r"part 1\.divisions: divisions out of range"):
        scene('[[part]]\nshape = "cloth"\ndivisions = 100000\n')


@pytest.mark.parametrize("suffix", [*SUFFIXES, ".GLB"])
def test_a_mesh_in_place_of_a_scene_is_told_where_it_goes(suffix, tmp_path):
    path = tmp_path / f"ball{suffix}"
    with pytest.raises(InputError, match="no such file"):
        load_scene(path)
    path.write_bytes(b"\0\1")
    with pytest.raises(InputError, match=r"(?s)a mesh, not a scene.*scene\.toml.*mesh = \"ball"):
        load_scene(path)


@pytest.mark.parametrize(
    ("start", "kind"),
    [
        (b"PK\x03\x04", "an archive"),
        (b"PK\x05\x06", "an archive"),
        (b"glTF\2\0\0\0", "a material or a measurement"),
        (b"II*\0", "a picture"),
        (b"\x89PNG\r\n\x1a\n", "a picture"),
        (b"\xff\xd8\xff\xe0", "a picture"),
        (b"\x76\x2f\x31\x01", "a picture"),
        (b"MATLAB 5.0 MAT-file", "a material or a measurement"),
    ],
)
def test_other_files_in_place_of_a_scene_are_called_what_they_are(start, kind, tmp_path):
    path = tmp_path / "ball.toml"
    path.write_bytes(start + bytes(40))
    for read in (scene_file, load_scene):
        with pytest.raises(InputError, match=rf"(?s){kind}, not a scene.*expected: a scene\.toml.*try: "):
            read(path)


def test_a_table_of_spectra_in_place_of_a_scene_is_called_so(tmp_path):
    (tmp_path / "paints.csv").write_text("nm,reflectance (%)\n400,10\n500,20\n600,30\n")
    with pytest.raises(InputError, match=r"(?s)a measurement, not a scene.*found: .*table.*try: import it"):
        load_scene(tmp_path / "paints.csv")


def test_a_scene_that_is_no_text_is_refused_for_what_it_should_be(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_bytes(b"\0\1\2")
    with pytest.raises(InputError, match=r"(?s)not a text file.*expected: a scene\.toml"):
        load_scene(path)
