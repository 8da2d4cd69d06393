"""Lights that spread in scenes: read from `scene.toml`, counted, mixed, planned for, and warned of."""

import metamer
import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.environment.map_light import load_environment
from metamer.lighting.environment.softbox import SoftboxLight
from metamer.lighting.lights import DirectionalLight
from metamer.lighting.mesh import shapes
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.reference.placement import placement_warnings, why_black
from metamer.lighting.scene import Part, Scene
from metamer.lighting.scene_file.files import load_scene
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum
from metamer.viewer.review.cases import _distinct_lights

PART = '[[part]]\nshape = "sphere"\nsubdivisions = 2\n[[camera]]\n'


@pytest.fixture
def scene(tmp_path):
    """The scene of a sphere and these lights; `sky.exr` beside it has a bluish sky and a brown ground."""
    values = np.full((8, 16, 3), (0.4, 0.6, 1.0))
    values[4:] = (0.3, 0.2, 0.1)
    write_exr(tmp_path / "sky.exr", {}, {name: values[..., index] for index, name in enumerate("RGB")})

    def load(table, head=""):
        (tmp_path / "scene.toml").write_text(head + PART + table, encoding="utf-8")
        return load_scene(tmp_path / "scene.toml")

    return load


SKY = '[[light]]\nname = "sky"\nkind = "environment"\nmap = "sky.exr"\n'
BOX = '[[light]]\nkind = "softbox"\nposition = [0, 3, 0]\ntarget = [0, 0, 0]\nwidth = 1\nheight = 1\n'


def test_an_environment_of_a_scene(scene):
    loaded = scene(SKY + 'spectrum = "FL11"\nrotation_deg = 90\nilluminance_lux = 2000\n')
    (light,) = loaded.lights
    assert loaded.spread_lights == loaded.lights and loaded.delta_lights == ()
    assert (light.rotation_deg, light.illuminance_lux, light.name, light.spectrum_name) == (90, 2000, "sky", "FL11")
    assert loaded.viewing.reference_illuminance_lux == pytest.approx(2000)
    np.testing.assert_allclose(loaded.adopted_white(), loaded.observer.white(illuminant("FL11")))
    assert all(note.startswith("light 1 (sky): sky.exr: ") for note in loaded.notes) and len(loaded.notes) == 2


def test_every_one_of_its_spectra_is_planned_for(scene):
    loaded = scene(SKY + 'uplift = "mallett-yuksel"\n')
    (light,) = loaded.lights
    spectra = _distinct_lights(loaded, [None])
    assert len(light.spectra) == 2 and spectra == list(light.spectra)
    assert _distinct_lights(loaded, [illuminant("A")]) == [illuminant("A")]
    under_a = loaded.with_illuminant(illuminant("A"), "A").lights[0]
    assert under_a.spectra == (illuminant("A"),) * 2 and under_a.origin == "stated"
    assert under_a.fields is light.fields and under_a.spectrum is illuminant("A")


def test_the_spectra_of_other_lights_are_their_one():
    for light in (
        DirectionalLight((0, 0, 1), illuminant("A")),
        SoftboxLight((0, 3, 0), (0, 0, 0), 1, 1, illuminant("A")),
    ):
        assert light.spectra == (illuminant("A"),) and light.notes == ()


@pytest.mark.parametrize("eye", ["1931_2", "1964_10", "2015_10"])
def test_the_white_is_that_of_all_light_on_a_horizontal_plane_to_every_observer(tmp_path, eye):
    """By hand: the power of all texels, weighed by the cosine, and folded as one light."""
    rng = np.random.default_rng(6)
    values = rng.uniform(0.05, 1.0, (8, 16, 3)) ** 2
    write_exr(tmp_path / "sky.exr", {}, {name: values[..., index] for index, name in enumerate("RGB")})
    light = load_environment(tmp_path / "sky.exr", uplift="mallett-yuksel")
    assert len(light.spectra) == 3
    photometric = observer("1931_2")
    rows = np.sin(np.pi * (0.5 - np.arange(9) / 8)).clip(0) ** 2
    shares = (light.fields.sum(axis=2) * (rows[:-1] - rows[1:])).sum(axis=1)
    power = sum(
        share / photometric.luminous(one) * one.samples for share, one in zip(shares, light.spectra, strict=True)
    )
    whole = Spectrum.sampled(light.spectra[0].wavelengths_nm, power, "emission")
    sphere = Part("ball", shapes.sphere(2), "paint/red")
    made = Scene((sphere,), (light,), (Camera(position=(0, 0, 5)),), observer(eye))
    np.testing.assert_allclose(made.adopted_white(), observer(eye).white(whole), rtol=1e-9)
    # As renderers sum it: each spectrum at Y = 1 for this observer, times its field.
    (seen,) = made.lights
    shares = (seen.fields.sum(axis=2) * (rows[:-1] - rows[1:])).sum(axis=1)
    folded = sum(share * observer(eye).white(one) for share, one in zip(shares, seen.spectra, strict=True))
    np.testing.assert_allclose(folded / folded[1], observer(eye).white(whole), rtol=1e-9)
    assert seen.illuminance_lux == light.illuminance_lux and (seen is light) == (eye == "1931_2")


def test_an_environment_and_a_lamp_are_mixed_by_what_they_give(scene):
    loaded = scene(SKY + 'spectrum = "D65"\nilluminance_lux = 300\n' + BOX + 'spectrum = "A"\nilluminance_lux = 100\n')
    d65, a = (loaded.observer.white(illuminant(name)) for name in ("D65", "A"))
    np.testing.assert_allclose(loaded.adopted_white(), 0.75 * d65 + 0.25 * a, rtol=1e-9)
    assert loaded.viewing.reference_illuminance_lux == pytest.approx(400)


def test_a_softbox_that_faces_away_leaves_no_white(scene):
    with pytest.raises(InputError, match="no light falls on the middle of the scene"):
        scene(BOX.replace("[0, 0, 0]", "[0, 5, 0]"))
    assert scene(BOX.replace("[0, 0, 0]", "[0, 5, 0]") + "[[light]]\n").adopted_white()[1] == pytest.approx(1)


@pytest.mark.parametrize(
    ("table", "field", "words"),
    [
        (SKY, "spectrum", "named in: "),
        (SKY + 'spectrum = "D65"\nuplift = "smits"\n', "light 1 (sky).uplift", "one of the two"),
        (SKY + 'uplift = "jacob"\n', "light 1 (sky).uplift", "nearest: jakob-hanika"),
        (SKY + 'uplift = "smits"\nbad_texels = "white"\n', "light 1 (sky).bad_texels", "black"),
        (SKY + 'spectrum = "D65"\nilluminance_lux = 0\n', "light 1 (sky).illuminance_lux", "no power"),
        (SKY + 'uplift = "smits"\nentry = 2\n', "light 1 (sky).entry", "only a file has columns"),
        (SKY.replace('map = "sky.exr"\n', ""), "light 1 (sky).map", "the name of a file"),
        (SKY.replace("sky.exr", "gone.exr"), None, "gone.exr: no such file"),
        (SKY.replace('"sky.exr"', "3"), "light 1 (sky).map", "the name of a file, in quotes"),
        (SKY + "intensity_cd = 3\n", "light 1 (sky).intensity_cd", "unknown key"),
        (BOX.replace("target = [0, 0, 0]\n", ""), "light 1.target", "a softbox light needs this key"),
        (BOX.replace("width = 1", "width = 0"), "light 1.width", "no size"),
        (BOX + "up = [0, 1, 0]\n", "light 1.up", "along the direction"),
        ('[[light]]\nkind = "booth"\n', "light 1.booth", "one of D65, A, TL84"),
        ('[[light]]\nkind = "booth"\nbooth = "D66"\n', "light 1.booth", "nearest: D65"),
        ('[[light]]\nkind = "booth"\nbooth = "A"\nspectrum = "A"\n', "light 1.booth", "booth and spectrum"),
        ('[[light]]\nkind = "booth"\nbooth = "A"\nwall_reflectance = 43\n', "light 1.wall_reflectance", "per cent"),
        ('[[light]]\nkind = "environmnt"\n', "light 1.kind", "nearest: environment"),
    ],
)
def test_a_bad_table_says_file_key_and_what_to_do(scene, table, field, words):
    with pytest.raises(InputError) as caught:
        scene(table)
    assert caught.value.field == field and words in str(caught.value) and "scene.toml" in str(caught.value)
    assert isinstance(caught.value, UnknownNameError) or caught.value.expected or caught.value.hint


def test_a_bad_texel_is_named_with_its_scene(scene, tmp_path):
    values = np.ones((4, 8))
    values[1, 2] = np.nan
    write_exr(tmp_path / "nan.exr", {}, dict.fromkeys("RGB", values))
    table = SKY.replace("sky.exr", "nan.exr") + 'spectrum = "D65"\n'
    with pytest.raises(InputError, match=r"(?s)nan\.exr: row 1, column 2.*named in: .*scene\.toml, light 1 \(sky\)"):
        scene(table)
    loaded = scene(table + 'bad_texels = "black"\n')
    assert any("1 of 32 texels" in note for note in loaded.notes)


def test_a_lamp_in_a_file_lights_a_map_and_a_booth(scene, tmp_path):
    (tmp_path / "lamp.csv").write_text("nm,ours\n400,1\n500,2\n700,1\n")
    for table in (SKY, '[[light]]\nkind = "booth"\n'):
        loaded = scene(table + 'spectrum = "lamp.csv"\n')
        assert loaded.lights[0].spectrum.samples.tolist() == [1, 2, 1]
        assert any("its end values are repeated" in note for note in loaded.notes)


def seen(light, position=(0, 0, 5), **parts):
    """A scene of meshes under one light, from the front."""
    made = tuple(Part(name, mesh, "paint/red") for name, mesh in parts.items())
    return Scene(made, (light,), (Camera(position=position, width=32, height_px=32, samples=1),), observer("1931_2"))


def test_what_spread_light_reaches_is_not_called_black():
    ball = shapes.sphere(3)
    above = SoftboxLight((0, 3, 0), (0, 0, 0), 1, 1, illuminant("A"))
    sky = EnvironmentLight(np.ones((1, 4, 8)), (illuminant("A"),))
    assert why_black(seen(sky, ball=ball)) == () and why_black(seen(above, ball=ball)) == ()


def test_a_softbox_behind_all_that_is_seen_is_named():
    floor = shapes.plane(2, 2)
    below = SoftboxLight((0, -3, 0), (0, 0, 0), 1, 1, illuminant("A"), name="key")
    (line,) = why_black(seen(below, (0, 5, 1), table=floor))
    assert 'light "key" lights nothing' in line
    roof = shapes.plane(40, 40).placed(translate=(0, 2, 0))
    above = SoftboxLight((0, 3, 0), (0, 0, 0), 1, 1, illuminant("A"), name="key")
    hidden = Scene(
        (Part("table", floor, "paint/red"), Part("roof", roof, "paint/red")), (above,),
        (Camera(position=(0, 1, 4), width=32, height_px=32, samples=1),), observer("1931_2"),
    )  # fmt: skip
    assert len(why_black(hidden)) == 1


def test_a_softbox_inside_a_body_is_warned_of():
    inner = SoftboxLight((0, 0, 0), (0, 0, 1), 0.1, 0.1, illuminant("A"), name="key")
    (line,) = placement_warnings(seen(inner, ball=shapes.sphere(3)))
    assert 'light "key" stands inside part "ball"' in line


def test_names_for_scripts(tmp_path):
    booth = metamer.light_booth("TL84", illuminance_lux=1200)
    assert isinstance(booth, metamer.EnvironmentLight) and repr(booth) == (
        "<Environment light: 256 x 128, 1 spectrum stated, 1200 lx>"
    )
    assert metamer.SoftboxLight is SoftboxLight and metamer.load_environment is load_environment
    assert isinstance(shapes.sphere(1), Mesh)
