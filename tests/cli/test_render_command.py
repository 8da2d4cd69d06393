"""`metamer render`: a picture, a file that holds XYZ, a file that holds spectra, and what it refuses."""

import numpy as np
import pytest
from icc_profiles import matrix_profile, profile
from metamer.spectral.difference import delta_e_lab, delta_e_xyz, lab_from_xyz
from metamer.spectral.formats.spectral_exr import read_spectral_exr
from metamer.spectral.illuminants import illuminant
from metamer.spectral.srgb import srgb_to_linear
from metamer.spectral.upsampling import xyz_from_rgb
from pictures import read_xyz_exr
from PIL import Image


@pytest.fixture
def render(metamer, scene, tiny_catalogue, tmp_path):
    """Renders the tiny scene in numpy to a file of that name; (code, stdout, stderr, path)."""

    def run(name, *words):
        path = tmp_path / name
        options = ["--catalogue", tiny_catalogue, "--renderer", "software", "-o", path]
        return *metamer("render", scene, *options, *words), path

    return run


def test_png(render):
    code, said, _, path = render("ball.png")
    assert code == 0
    assert said.splitlines()[-1] == str(path)
    with Image.open(path) as picture:
        codes = np.asarray(picture)
    assert codes.shape == (32, 32, 3) and codes.dtype == np.uint8
    red, green, blue = codes[12, 12]
    assert red > 1.5 * max(green, blue), codes[12, 12]
    assert len(set(map(int, codes[0, 0]))) == 1, "the background is not neutral"


def test_exr_and_its_reference(render):
    code, _, _, path = render("ball.exr")
    assert code == 0
    fast, coverage = read_xyz_exr(path)
    code, _, _, path = render("truth.exr", "--reference")
    assert code == 0
    slow, _ = read_xyz_exr(path)
    np.testing.assert_allclose(fast.white_xyz, slow.white_xyz, atol=1e-6)
    delta = delta_e_xyz(slow.values.astype(float), fast.values.astype(float), slow.white_xyz, "CIE 1994")
    inside = coverage == 1
    assert inside.sum() > 400
    assert delta[inside].max() < 0.1
    assert (fast.values != slow.values).any(), "the reference is the picture"


def test_bounces_of_a_reference_say_so_and_change_nothing_of_a_single_ball(render):
    code, _, said, path = render("bounced.exr", "--reference", "--bounces", "2", "--noise", "0.5")
    assert code == 0, said
    plain, bounced = read_xyz_exr(render("plain.exr", "--reference")[3])[0], read_xyz_exr(path)[0]
    np.testing.assert_allclose(plain.values, bounced.values, atol=1e-6)
    assert b"2 bounces" in path.read_bytes()


@pytest.mark.slow
def test_bounces_of_a_picture_are_told_and_one_ball_has_none(render, scene):
    code, said, _, _ = render("ball.exr", "--bounces", "auto")
    assert code == 0 and "no bounces" in said
    scene.write_text(
        scene.read_text(encoding="utf-8")
        + '[[part]]\nshape = "plane"\nmaterial = "tiny/matt-red"\ntranslate = [0.0, -1.0, 0.0]\n'
        + "[interreflection]\nbounces = 1\n",
        encoding="utf-8",
    )
    code, said, _, path = render("two.exr")
    assert code == 0 and "1 bounce of light between surfaces" in said and "256 rays" in said
    assert b"1 bounce" in path.read_bytes()
    plain = read_xyz_exr(render("plain.exr", "--bounces", "0")[3])[0].values
    added = read_xyz_exr(path)[0].values - plain
    assert added.min() > -1e-6 and added.max() > 0.01


def test_illuminant_replaces_that_of_every_light(render):
    pictures = {name: read_xyz_exr(render(f"{name}.exr", "--illuminant", name)[3])[0] for name in ("D65", "A")}
    assert pictures["A"].white_xyz[2] == pytest.approx(0.3558, abs=1e-3)
    assert pictures["D65"].white_xyz[2] == pytest.approx(1.0888, abs=1e-3)
    # A red surface is lighter under A.
    assert pictures["A"].values[..., 1].mean() > 1.2 * pictures["D65"].values[..., 1].mean()


def test_a_measured_lamp_is_named_by_its_file(render, tmp_path):
    file, nm = tmp_path / "booth.csv", np.arange(380, 781, 5)
    lamps = np.column_stack([nm, *(np.interp(nm, one.wavelengths_nm, one.samples) for one in map(illuminant, "EA"))])
    np.savetxt(file, lamps, "%.4f", ",", header="nm,flat,warm", comments="")
    code, _, said, path = render("warm.exr", "--illuminant", f"{file}#warm")
    assert code == 0, said
    assert read_xyz_exr(path)[0].white_xyz[2] == pytest.approx(0.3558, abs=1e-3)
    assert b"warm" in path.read_bytes()
    code, _, said, _ = render("which.exr", "--illuminant", file)
    assert code == 4 and "which spectrum" in said and f"{file}#1" in said
    code, _, said, _ = render("none.exr", "--illuminant", tmp_path / "both.csv")
    assert code == 64 and "no such file" in said


def test_mip_mapped_factors_are_said_in_the_file(render, scene):
    # Every factor of a matt surface is one: there is nothing to average.
    scene.write_text(scene.read_text(encoding="utf-8").replace("matt-red", "satin-green"), encoding="utf-8")
    pictures = {name: render(f"{name}.exr", "--filtering", name)[3] for name in ("linear", "mipmapped")}
    linear, mipmapped = (read_xyz_exr(path)[0].values for path in pictures.values())
    assert 0.0 < np.abs(mipmapped - linear).max() < 0.1 * linear.max()
    assert b"mipmapped factors" in pictures["mipmapped"].read_bytes()
    assert b"mipmapped" not in pictures["linear"].read_bytes()


def test_spectral(render):
    code, _, _, path = render("ball.exr", "--spectral", "--illuminant", "A")
    assert code == 0
    spectrum = read_spectral_exr(path).spectrum
    assert spectrum.quantity == "emission"
    assert spectrum.samples.shape == (32, 32, 81)


@pytest.mark.parametrize(
    ("name", "words", "said"),
    [
        ("ball.jpg", [], "written as .exr or .png"),
        ("ball", [], "written as .exr or .png"),
        ("ball.jpg", ["--reference"], "written as .exr or .png"),
        ("ball.png", ["--spectral"], "written as .exr"),
        ("ball.exr", ["--spectral", "--reference"], "choose one"),
        ("ball.exr", ["--filtering", "mipmapped", "--reference"], "no factors to filter"),
        ("ball.exr", ["--bounces", "some"], "neither a whole number"),
        ("ball.exr", ["--noise", "0.2"], "--noise requires --reference"),
        ("ball.exr", ["--reference", "--bounces", "-1"], "neither a whole number"),
        ("ball.exr", ["--reference", "--noise", "0"], "above 0"),
    ],
)
def test_wrong_usage_is_said_before_any_work(render, monkeypatch, name, words, said):
    monkeypatch.setattr("metamer.cli.render.catalogue_for", lambda *_: pytest.fail("a catalogue was opened"))
    code, _, err, path = render(name, *words)
    assert code == 64
    assert said in err
    assert not path.exists()


@pytest.mark.parametrize("command", ["render", "review"])
def test_missing_scene_is_said_before_a_catalogue_is_made(metamer, monkeypatch, tmp_path, command):
    monkeypatch.setattr(f"metamer.cli.{command}.catalogue_for", lambda *_: pytest.fail("a catalogue was opened"))
    output = ["--output", tmp_path / "ball.png"] if command == "render" else ["--out", tmp_path / "review"]
    code, _, err = metamer(command, tmp_path / "gone.toml", *output)
    assert code == 4
    assert "no such file" in err and "gone.toml" in err


def test_a_material_in_place_of_a_scene_is_told_what_to_write(metamer, tmp_path):
    code, _, err = metamer("render", "tiny/copper", "--output", tmp_path / "ball.png")
    assert code == 4 and "this may be a material, not a scene" in err
    assert 'material = "tiny/copper"' in err and "metamer view tiny/copper" in err


@pytest.mark.parametrize(
    ("name", "said"), [("no/folder/ball.png", "no such folder"), ("made", "a folder, where a file")]
)
def test_place_that_cannot_be_written_to_is_said_before_any_work(render, monkeypatch, tmp_path, name, said):
    monkeypatch.setattr("metamer.cli.render.catalogue_for", lambda *_: pytest.fail("a catalogue was opened"))
    (tmp_path / "made.exr").mkdir()
    code, _, err, _ = render(f"{name}.exr" if name == "made" else name)
    assert code == 4
    assert said in err


def test_notes_say_that_the_lights_have_another_spectrum(render, scene):
    scene.write_text(
        scene.read_text(encoding="utf-8").replace(
            'direction_to_light = [-0.45, 0.46, 0.766]\nspectrum = "D65"', 'kind = "booth"\nbooth = "D65"'
        ),
        encoding="utf-8",
    )
    own, replaced = render("own.png")[1], render("replaced.png", "--illuminant", "A")[1]
    assert "booth D65" in own and "in place of" not in own
    assert "lit by A in place of the spectra that the scene gives its lights" in replaced
    assert replaced.index("booth D65") < replaced.index("lit by A")


@pytest.mark.parametrize(
    ("name", "words", "said"),
    [
        ("ball.png", ["--illuminant", "D-65"], "nearest: D65"),
        ("ball.png", ["--camera", "back"], "unknown camera"),
        ("no/such/folder/ball.exr", [], "no such folder"),
        ("no/such/folder/ball.png", [], "no such folder"),
    ],
)
def test_bad_input(render, name, words, said):
    code, _, err, path = render(name, *words)
    assert code == (64 if "--illuminant" in words else 4)
    assert said in err, err
    assert not path.exists()


@pytest.mark.parametrize("name", ["ball.png", "ball.exr"])
def test_folder_of_that_name(render, tmp_path, name):
    (tmp_path / name).mkdir()
    code, _, err, _ = render(name)
    assert code == 4
    assert str(tmp_path / name) in err
    assert not list(tmp_path.glob(".ball*")), "half a file is left"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "position = [0, 0, 4]",
            "position = [0, 0, 0.3]",
            'camera "front" stands inside part "ball", and no light does',
        ),
        ("direction_to_light = [-0.45, 0.46, 0.766]", "direction_to_light = [0, 0, -1]", 'camera "front" is black'),
        ("target = [0, 0, 0]", "target = [0, 0, 9]", 'camera "front" sees nothing: it looks 180 degrees past'),
        (
            "direction_to_light = [-0.45, 0.46, 0.766]",
            'name = "lamp"\nposition = [0.1, 0, 0]\nintensity_cd = 9',
            'light "lamp" stands inside part "ball"',
        ),
    ],
)
@pytest.mark.parametrize(
    "words", [("ball.png",), ("ball.exr", "--spectral"), ("ball.exr", "--reference")], ids=" ".join
)
def test_pictures_of_nothing_are_written_with_a_warning(render, scene, old, new, said, words):
    text = scene.read_text(encoding="utf-8")
    assert old in text
    scene.write_text(text.replace(old, new), encoding="utf-8")
    code, _, err, path = render(*words)
    assert code == 0 and path.exists()
    warnings = [line for line in err.splitlines() if line.startswith("metamer: warning: ")]
    assert any(said in line for line in warnings), err
    assert len(warnings) == len(set(warnings))


def test_a_picture_that_is_clipped_as_a_whole_is_said_and_one_in_part_is_not(render, scene):
    text = scene.read_text(encoding="utf-8").replace(
        "direction_to_light = [-0.45, 0.46, 0.766]", "direction_to_light = [0, 0, 1]"
    )
    scene.write_text(text + "[viewing]\nreference_illuminance_lux = 1e-3\n", encoding="utf-8")
    assert "clipped as a whole" in render("ball.png")[2]
    scene.write_text(text + "[viewing]\nreference_illuminance_lux = 100\n", encoding="utf-8")
    assert "clipped" in render("ball.png")[1]
    assert "warning" not in render("ball.png")[2]


def test_material_that_the_catalogue_lacks(render, scene):
    scene.write_text(scene.read_text().replace("matt-red", "matt-rde"), encoding="utf-8")
    code, _, err, _ = render("ball.png")
    assert code == 4
    assert "nearest: tiny/matt-red" in err


def test_missing_default_catalogue_is_made_from_the_shipped_materials(metamer, scene, tmp_path, monkeypatch):
    asked = []

    def import_sources(sources, folder, **options):
        asked.append((sources, folder, options["jobs"]))
        folder.mkdir()
        (folder / "catalogue.toml").touch()

    monkeypatch.setattr("metamer.materials.intake.importing.import_sources", import_sources)
    monkeypatch.setenv("METAMER_CATALOGUE", str(tmp_path / "made"))
    code, said, err = metamer("render", scene, "-o", tmp_path / "ball.png", "--jobs", 3)
    assert code == 4 and "tiny/matt-red" in err
    assert f"No catalogue at {tmp_path / 'made'} yet: importing the shipped materials." in said
    ((sources, folder, jobs),) = asked
    assert [source.name for source in sources] == ["shipped"] and folder == tmp_path / "made" and jobs == 3


def test_a_mesh_in_place_of_a_scene_is_told_where_it_goes(metamer, tmp_path):
    """Before a catalogue is looked for, or made."""
    path = tmp_path / "ball.glb"
    path.write_bytes(b"glTF\2\0\0\0")
    words = ["--catalogue", tmp_path / "none", "-o", tmp_path / "x.exr"]
    code, _, said = metamer("render", path, *words)
    assert code == 4 and "a mesh, not a scene" in said and 'mesh = "ball.glb"' in said
    assert "no such file" in metamer("render", tmp_path / "missing.glb", *words)[2]


@pytest.mark.parametrize("text", ["PK\x03\x04", "hi\n", "[prat]\n"])
def test_no_catalogue_is_made_for_what_is_no_scene(metamer, tmp_path, text, monkeypatch):
    path = tmp_path / "ball.toml"
    path.write_text(text, encoding="latin-1")
    monkeypatch.setenv("METAMER_CATALOGUE", str(tmp_path / "none"))
    code, _, said = metamer("render", path, "-o", tmp_path / "x.exr")
    assert code == 4 and "ball.toml" in said and not (tmp_path / "none").exists()


def test_a_picture_goes_through_a_link_to_what_it_leads_to(render, tmp_path):
    (tmp_path / "far.png").write_bytes(b"old")
    (tmp_path / "near.png").symlink_to(tmp_path / "far.png")
    code, _, said, path = render("near.png")
    assert code == 0, said
    assert path.is_symlink() and (tmp_path / "far.png").read_bytes().startswith(b"\x89PNG")


def test_a_display_by_its_icc_profile(render, metamer, scene, tmp_path):
    """On the command and in the scene alike, from the scene's folder; other codes than those of sRGB."""
    (tmp_path / "desk.icc").write_bytes(matrix_profile("gamma"))
    plain, shown, own = (
        np.asarray(Image.open(render(name, *words)[3]))
        for name, words in (("a.png", ()), ("b.png", ("--display", f"icc:{tmp_path / 'desk.icc'}")),
                            ("c.png", ("--display", "Display P3 - Display")))
    )  # fmt: skip
    assert np.abs(shown.astype(int) - plain).max() > 5 and (own != plain).any()
    with scene.open("a", encoding="utf-8") as text:
        text.write('\n[viewing]\ndisplay = "icc:desk.icc"\n')
    code, _, _, path = render("d.png")
    assert code == 0
    np.testing.assert_array_equal(np.asarray(Image.open(path)), shown)
    # Back to another display of OpenColorIO, by its own view.
    code, _, _, path = render("e.png", "--display", "Display P3 - Display")
    np.testing.assert_array_equal(np.asarray(Image.open(path)), own)


def test_sixteen_bits_where_they_are_asked_for(render):
    """The same picture, finer; only of PNG files."""
    fine, coarse = (render(f"{bits}.png", "--bits", str(bits))[3].read_bytes() for bits in (16, 8))
    assert fine[24] == 16 and coarse[24] == 8 and len(fine) > len(coarse)
    for words in (("--bits", "16"), ("--display", "sRGB - Display")):
        code, _, told, path = render("a.exr", *words)
        assert code == 64 and words[0] in told and not path.exists()


@pytest.mark.parametrize("space", ["acescg", "rec709", "rec2020"])
def test_other_programs_show_our_colours(render, space):
    """OpenImageIO finds the space by the header, under A; through it the OpenEXR looks as our PNG does."""
    oiio = pytest.importorskip("OpenImageIO")
    code, said, _, path = render("ball.exr", "--space", space, "--illuminant", "A")
    assert code == 0 and "adapted once, by Bradford, from white x 0.4476" in said
    read = oiio.ImageBuf(str(path))
    spec = read.spec()
    found = spec.get_string_attribute("oiio:ColorSpace")
    assert found == {"acescg": "lin_ap1_scene"}.get(space, f"lin_{space}_scene")
    shown = oiio.ImageBufAlgo.colorconvert(read, found, "srgb_rec709_display").get_pixels(oiio.FLOAT)
    with Image.open(render("ball.png", "--illuminant", "A")[3]) as picture:
        ours = np.asarray(picture) / 255.0
    whole = shown[..., 3] == 1.0
    labs = [
        lab_from_xyz(srgb_to_linear(np.clip(rgb[whole], 0.0, 1.0)) @ xyz_from_rgb().T, xyz_from_rgb() @ np.ones(3))
        for rgb in (shown[..., :3], ours)
    ]
    assert whole.sum() > 400 and delta_e_lab(*labs, "CIE 2000").max() < 0.5


def test_a_space_is_of_pictures_in_openexr(render):
    for name, words in (("a.png", ()), ("a.exr", ("--spectral",))):
        code, _, told, path = render(name, "--space", "rec709", *words)
        assert code == 64 and "--space" in told and not path.exists()


def test_a_profile_that_cannot_be_used_is_said_before_anything_is_made(render, metamer, scene, tmp_path):
    (tmp_path / "printer.icc").write_bytes(profile({}, kind=b"prtr", space=b"CMYK", pcs=b"Lab "))
    for words, said in (
        (f"icc:{tmp_path / 'printer.icc'}", "not a profile of a display"),
        (f"icc:{tmp_path / 'none.icc'}", "no such file"),
        ("sRGB", "sRGB - Display"),
    ):
        code, _, told, path = render("x.png", "--display", words)
        assert code == 4 and said in told and not path.exists()
    nowhere = tmp_path / "nowhere"
    code, _, told = metamer("render", scene, "--display", f"icc:{tmp_path / 'none.icc'}", "-o", tmp_path / "y.png",
                            "--catalogue", nowhere)  # fmt: skip
    assert code == 4 and "none.icc" in told
