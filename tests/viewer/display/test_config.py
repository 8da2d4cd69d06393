"""A characterised display through OpenColorIO: files beside memory, GLSL beside the CPU, views, what is said."""

import io
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
from metamer.benchmarks.display.simulated import displays
from metamer.calibration.display.aim import PICTURE_WHITE_XYZ, aimed
from metamer.calibration.display.characterise import characterise
from metamer.calibration.display.cube import Cube, make_cube
from metamer.calibration.display.observer_aims import observer_aims, seen_by
from metamer.calibration.display.patches import patches
from metamer.calibration.report.plots import mask_png
from metamer.runtime.errors import InputError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.image import ColourImage
from metamer.viewer.display.config import COMPENSATED, display_transform, make_config, shown_transform, write_config
from metamer.viewer.display.gl_pass import DisplayPass
from metamer.viewer.display.transform import DEFAULT_VIEW, INTERCHANGE_ROLE, DisplayTransform
from metamer.viewer.review.limits import limits_of
from metamer.viewer.review.words import display_words
from PIL import Image

NAME = "Desk, left"


@pytest.fixture(scope="module")
def record():
    """Make the record of a display whose channels do not add up, with spectra."""
    display, codes = displays()[5], patches(61)
    read = replace(display.measured(codes, 0), spectra=display.spectra(codes))
    return characterise(read, "Desk, left").record


@pytest.fixture(scope="module")
def aim(record):
    return aimed(record.model)


@pytest.fixture(scope="module")
def cube(record):
    return make_cube(record.model, 17)


@pytest.fixture(scope="module")
def others(record):
    return observer_aims(record)


@pytest.fixture(scope="module")
def folder(record, aim, cube, others, tmp_path_factory):
    folder = tmp_path_factory.mktemp("config")
    write_config(folder, NAME, record.model, cube, aim, others=others)
    record.write(folder / "display.json")
    return folder


@pytest.fixture(scope="module")
def relative(record, aim):
    """Colours that the display shows, dark ones too, as XYZ-D65."""
    codes = np.random.default_rng(0).random((400, 3))
    codes[:100] **= 3.0
    return record.model.xyz(codes) @ np.linalg.inv(aim.adapted).T


@pytest.mark.parametrize("file", ["config.ocio", "Desk_left.ocioz"])
def test_both_views_do_what_the_cube_does(folder, file, cube, aim, relative):
    for view, black in ((DEFAULT_VIEW, "absolute"), (COMPENSATED, "bpc")):
        found = DisplayTransform(NAME, view, str(folder / file)).apply(relative)
        assert np.abs(found - cube.look_up(aim.xyz(relative, black))).max() < 2e-5


@pytest.mark.parametrize("file", ["config.ocio", "Desk_left.ocioz"])
def test_a_display_is_aimed_for_the_observer_of_its_pictures(gl, folder, file, record, cube, aim, others, relative):
    """Through the same tables, by both views, there and back; menus have one display."""
    where = str(folder / file)
    assert [one for one in DisplayTransform(NAME, config=where)._config.getDisplays() if "Desk" in one] == [NAME]
    for one in others:
        for view, black in ((DEFAULT_VIEW, "absolute"), (COMPENSATED, "bpc")):
            transform = DisplayTransform(NAME, view, where, observer=one.observer)
            assert (transform.name, transform.aimed_for) == (f"{NAME} ({one.observer})", one.observer)
            asked = one.aim.xyz(relative, black) @ np.linalg.inv(one.aim.adapted).T
            codes = cube.look_up(aim.xyz(asked @ one.front[:, :3].T + one.front[:, 3]))
            assert np.abs(transform.apply(relative) - codes).max() < 3e-5
            image = relative.reshape(20, 20, 3)
            assert np.abs(DisplayPass(gl, transform)(image) - transform.apply(image)).max() <= 1e-5
        seen = replace(record.model, seen=seen_by(record.readings, one.observer)[0])
        inside = np.random.default_rng(7).random((200, 3))
        shown = transform.shown(inside).astype(np.float64) @ one.aim.adapted.T
        assert delta_e_xyz(seen.xyz(inside), shown, one.aim.white_xyz).max() < 0.3
        words = " ".join(transform.describe())
        assert f"observer {one.observer}; white D65" in words and "still aimed" not in words
    first = DisplayTransform(NAME, DEFAULT_VIEW, where, observer="1931_2")
    assert (first.name, first.aimed_for) == (NAME, "1931_2")
    plain = DisplayTransform("sRGB - Display", DEFAULT_VIEW, where, observer="1964_10")
    assert (plain.name, plain.aimed_for) == ("sRGB - Display", "1931_2")
    assert "still aimed for the CIE 1931 2" in " ".join(plain.describe())


def test_a_display_that_was_read_for_another_observer_says_so(record, cube, aim, tmp_path):
    """It is no display of 1931, and without spectra stays what it is."""
    write_config(tmp_path, NAME, record.model, cube, aim, seen_by="1964_10")
    for who, still in (("", False), ("1964_10", False), ("1931_2", True)):
        transform = DisplayTransform(NAME, DEFAULT_VIEW, str(tmp_path / "config.ocio"), observer=who)
        assert (transform.name, transform.aimed_for) == (NAME, "1964_10")
        assert ("still aimed for the CIE 1964 10" in " ".join(transform.describe())) == still


def test_files_say_what_memory_does(folder, cube, aim, relative):
    import PyOpenColorIO as ocio

    depth, lossless = ocio.BIT_DEPTH_F32, ocio.OPTIMIZATION_LOSSLESS
    processors = (
        ocio.Config.CreateRaw().getProcessor(display_transform(cube, aim)),
        ocio.Config.CreateFromFile(str(folder / "config.ocio")).getProcessor(INTERCHANGE_ROLE, NAME),
    )
    found = []
    for processor in processors:
        values = relative.astype(np.float32)
        processor.getOptimizedCPUProcessor(depth, depth, lossless).applyRGB(values)
        found.append(values)
    assert np.abs(found[0] - found[1]).max() <= 1e-6


def test_glsl_says_what_the_cpu_does(gl, folder, relative):
    transform = DisplayTransform(NAME, DEFAULT_VIEW, str(folder / "config.ocio"))
    image = relative.reshape(20, 20, 3)
    assert np.abs(DisplayPass(gl, transform)(image) - transform.apply(image)).max() <= 1e-5


def test_an_asymmetric_cube_is_not_turned(aim):
    """OCIO takes blue fastest: red and blue in each other's place would be wrong by 20 and say nothing."""
    import PyOpenColorIO as ocio

    levels = np.linspace(0.0, 1.0, 5)
    red, green, blue = np.meshgrid(levels, levels, levels, indexing="ij")
    nodes = np.stack([0.5 * red + 0.25 * green, green**2, 0.9 * blue + 0.05 * red], axis=-1)
    curves = np.repeat(np.linspace(0.0, 1.0, 4096)[:, None], 3, axis=1)
    cube = Cube(np.linalg.inv(aim.adapted), np.zeros(3), (0.0, 1.0), curves, nodes)
    values = np.random.default_rng(2).random((100, 3)).astype(np.float32) ** 3
    wanted = cube.look_up(values @ aim.adapted.T)
    processor = ocio.Config.CreateRaw().getProcessor(display_transform(cube, aim)).getDefaultCPUProcessor()
    processor.applyRGB(values)
    assert np.abs(values - wanted).max() < 1e-5


def test_what_codes_show_is_what_the_model_says(folder, record, aim):
    """The cube takes what the display cannot show to its nearest colours; turned round, it gave some of the former."""
    levels = np.linspace(0.0, 1.0, 5)
    codes = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1).reshape(-1, 3)
    codes = np.concatenate([codes, np.random.default_rng(1).random((200, 3))])
    expected = record.model.xyz(codes) @ np.linalg.inv(aim.adapted).T
    for file in ("config.ocio", "Desk_left.ocioz"):
        transform = DisplayTransform(NAME, DEFAULT_VIEW, str(folder / file))
        for found in (transform.shown(codes), transform.decode(codes)):
            off = delta_e_xyz(expected, found.astype(np.float64), PICTURE_WHITE_XYZ)
            assert off.mean() < 0.05 and off.max() < 0.3


def test_the_configuration_is_valid_and_this_display_comes_first(folder, record, cube, aim):
    import PyOpenColorIO as ocio

    for file in ("config.ocio", "Desk_left.ocioz"):
        config = ocio.Config.CreateFromFile(str(folder / file))
        config.validate()
        assert config.getDefaultDisplay() == NAME and config.getDefaultView(NAME) == DEFAULT_VIEW
        assert "sRGB - Display" in list(config.getDisplays())
        for space in config.getColorSpaces():
            config.getProcessor(space.getName(), NAME)
    transforms = display_transform(cube, aim), shown_transform(record.model, aim)
    first = make_config(NAME, *transforms, aim, "bpc")
    assert first.getDefaultView(NAME) == COMPENSATED
    with pytest.raises(InputError, match="a name that a configuration cannot hold"):
        make_config('The "left" one', *transforms, aim)
    with pytest.raises(InputError, match="a name that the configuration has already"):
        make_config("sRGB - Display", *transforms, aim)


def test_white_below_full_code_is_told_for_what_it_is(folder):
    """D65 is not this display's own white: its codes are not full, and it is colorimetric."""
    words = " ".join(DisplayTransform(NAME, DEFAULT_VIEW, str(folder / "config.ocio")).describe())
    assert "full code is not white on this display" in words and "changes white" not in words
    mapped = " ".join(
        DisplayTransform("sRGB - Display", "ACES 1.0 - SDR Video", str(folder / "config.ocio")).describe()
    )
    assert "changes white" in mapped


def test_room_above_white_is_not_taken_for_a_view_that_limits(tmp_path, record, cube):
    """White at half of what the display can do, and HDR: what is brighter is shown, and beyond it counted."""
    aim = aimed(record.model, luminance=0.5 * aimed(record.model).white_xyz[1])
    write_config(tmp_path, NAME, record.model, cube, aim)
    for name in (NAME, "Rec.2100-PQ - Display"):
        transform = DisplayTransform(name, DEFAULT_VIEW, str(tmp_path / "config.ocio"))
        assert transform.shows_limits and "limits values" not in " ".join(transform.describe())
    toned = DisplayTransform("sRGB - Display", "ACES 1.0 - SDR Video", str(tmp_path / "config.ocio"))
    assert not toned.shows_limits and "limits values above white itself" in " ".join(toned.describe())


def test_what_the_display_cannot_show_is_counted(folder):
    transform = DisplayTransform(NAME, DEFAULT_VIEW, str(folder / "config.ocio"))
    pixels = np.repeat(PICTURE_WHITE_XYZ[None, None], 4, axis=1) * np.array([0.2, 0.5, 0.98, 1.2])[None, :, None]
    _, notes = transform.encode(ColourImage(pixels, "xyz_d65", PICTURE_WHITE_XYZ))
    assert len(notes) == 1 and notes[0].startswith("1 of 4 pixels")


def test_shadows_below_black_are_not_called_out_of_gamut(folder, record, aim):
    """By the light of black in the view: the compensated one has none there, and an ideal display nowhere."""
    black = record.model.xyz(np.zeros((1, 3)))[0] @ np.linalg.inv(aim.adapted).T
    green, grey = np.array([0.05, 0.3, 0.02]), 0.3 * PICTURE_WHITE_XYZ
    image = ColourImage(np.stack([np.zeros(3), 0.5 * black, green, grey])[None], "xyz_d65", PICTURE_WHITE_XYZ)
    where = str(folder / "config.ocio")
    for name, view, counted, mask in (
        (NAME, DEFAULT_VIEW, "1 below it (outside its gamut) and 2 darker than its black", (5, 5, 1, 0)),
        (NAME, COMPENSATED, "1 below it (outside its gamut)", (0, 0, 1, 0)),
        ("sRGB - Display", DEFAULT_VIEW, "1 below it (outside its gamut)", (0, 0, 1, 0)),
    ):
        transform = DisplayTransform(name, view, where)
        (note,) = transform.encode(image)[1]
        assert note.endswith(f"clipped to “{name}”: {counted}.")
        limits, found = limits_of(image, np.ones((1, 4)), transform)
        assert found[0].tolist() == list(mask)
        assert (limits.below_gamut, limits.below_black) == (np.count_nonzero(mask) / 4, mask.count(5) / 4)
        assert limits.too_strong == 0.25
        with Image.open(io.BytesIO(mask_png(found))) as written:
            np.testing.assert_array_equal(np.asarray(written), found)
            assert (np.asarray(written.convert("RGBA"))[..., 3] > 0).tolist() == (found > 0).tolist()


def test_a_review_names_the_display_and_its_last_verification(folder, record):
    transform = DisplayTransform(NAME, DEFAULT_VIEW, str(folder / "config.ocio"))
    assert "never verified" in display_words(transform)[1]
    one = {"when": "2026-01-01T00:00:00+00:00", "verdict": "pass", "criteria": "Metamer", "figures": {"average": 0.4}}
    replace(record, verifications=(one,)).write(folder / "display.json")
    words = display_words(transform, datetime(2026, 1, 11, 12, tzinfo=UTC))
    record.write(folder / "display.json")
    assert words[0].startswith("Display: Desk, left") and "10 days ago" in words[1] and "0.40" in words[1]
    assert display_words(DisplayTransform()) == []


def test_a_full_disk_while_the_configuration_is_written(room_for, tmp_path, record, cube, aim):
    (tmp_path / "config.ocio").write_text("as it was")
    with room_for(20_000), pytest.raises((InputError, OSError)):
        write_config(tmp_path, NAME, record.model, cube, aim)
    assert (tmp_path / "config.ocio").read_text() == "as it was"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["config.ocio", "luts"]
    assert not list((tmp_path / "luts").iterdir())
