"""The display end of the chain: white, sRGB, clipping, backgrounds, broken configurations, files."""

import zlib
from pathlib import Path

import numpy as np
import pytest
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.colour_library import colour_science
from metamer.spectral.illuminants import illuminant, illuminant_names
from metamer.spectral.image import ColourImage
from metamer.spectral.observers import OBSERVERS, observer
from metamer.viewer.display import transform as display
from metamer.viewer.display.png import quantise, write_png
from metamer.viewer.display.transform import DISPLAY_WHITE_XYZ, DisplayTransform, composite
from PIL import Image

OWN_CONFIG = """ocio_profile_version: 2.1
roles:
  default: raw
  scene_linear: xyz
  cie_xyz_d65_interchange: xyz
displays:
  Bench:
    - !<View> {name: Plain, colorspace: bench}
    - !<View> {name: Broken, colorspace: broken}
colorspaces:
  - !<ColorSpace>
    name: raw
    isdata: true
  - !<ColorSpace>
    name: xyz
  - !<ColorSpace>
    name: bench
    from_scene_reference: !<ExponentTransform> {value: 0.5}
  - !<ColorSpace>
    name: broken
    from_scene_reference: !<FileTransform> {src: not_there.cube}
"""


def image(xyz, white=DISPLAY_WHITE_XYZ) -> ColourImage:
    """One row of pixels."""
    return ColourImage(np.asarray(xyz, dtype=np.float32).reshape(1, -1, 3), "xyz", np.asarray(white, dtype=np.float64))


def own_config(folder: Path) -> str:
    """A configuration with one display, written here; returns its path."""
    path = folder / "config.ocio"
    path.write_text(OWN_CONFIG)
    return str(path)


@pytest.fixture(autouse=True)
def _no_configuration_from_outside(monkeypatch):
    monkeypatch.delenv("OCIO", raising=False)


@pytest.fixture(scope="module")
def srgb() -> DisplayTransform:
    return DisplayTransform(config=display.PINNED_CONFIG)


@pytest.mark.parametrize("observer_name", OBSERVERS)
def test_perfect_diffuser_is_display_white_under_every_illuminant(srgb, observer_name):
    names = illuminant_names()
    eye = observer(observer_name)
    worst = {}
    for name in names:
        white = eye.white(illuminant(name))
        adapted = srgb.adaptation_from(white) @ white
        rgb, notes = srgb.encode(image(white, white))
        worst[name] = max(np.abs(adapted / DISPLAY_WHITE_XYZ - 1.0).max(), np.abs(rgb - 1.0).max())
        assert quantise(rgb).tolist() == [[[255, 255, 255]]], name
        assert quantise(rgb, 16).tolist() == [[[65535, 65535, 65535]]], name
        assert notes == ()
    name = max(worst, key=worst.__getitem__)
    assert worst[name] <= 1e-6, f"{name}: off by {worst[name]:.2e}"


def test_xyz_to_srgb_agrees_with_colour_science(srgb):
    """With matrices computed from the primaries, as OCIO has them: 1.1e-5, the slope that OCIO fits to the toe."""
    colour = colour_science()
    space = colour.RGB_COLOURSPACES["sRGB"].copy()
    space.use_derived_transformation_matrices(True)
    rgb = np.random.default_rng(0).random((200, 500, 3))
    xyz = colour.models.eotf_sRGB(rgb) @ space.matrix_RGB_to_XYZ.T
    ours, _ = srgb.encode(ColourImage(xyz.astype(np.float32), "xyz", DISPLAY_WHITE_XYZ))
    error = np.abs(ours - rgb)
    assert error.max() < 2e-5, f"worst at {np.unravel_index(error.argmax(), error.shape)}: {error.max():.2e}"


def test_xyz_to_srgb_agrees_with_the_rounded_matrix_of_the_standard(srgb):
    """`colour.XYZ_to_sRGB` has the four decimals that IEC 61966-2-1 prints: 1e-3 on a chart, 1.4e-3 near black."""
    colour = colour_science()
    chart = colour.CCS_COLOURCHECKERS["ColorChecker24 - After November 2014"]
    xyz = np.array([colour.xyY_to_XYZ(xyy) for xyy in chart.data.values()])[None]
    adapted = xyz @ srgb.adaptation_from(colour.xy_to_XYZ(chart.illuminant)).T
    for values, tolerance in (
        (adapted, 1e-3),
        (colour.sRGB_to_XYZ(np.random.default_rng(0).random((50, 90, 3))), 1.4e-3),
    ):
        ours, _ = srgb.encode(ColourImage(values.astype(np.float32), "xyz_d65", DISPLAY_WHITE_XYZ))
        error = np.abs(ours - np.clip(colour.XYZ_to_sRGB(values), 0, 1))
        assert error.max() < tolerance, f"worst at {np.unravel_index(error.argmax(), error.shape)}: {error.max():.2e}"


def test_absolute_values_of_a_mid_grey(srgb):
    # 0.2140 is the linear value of sRGB code 127.5 (IEC 61966-2-1).
    rgb, _ = srgb.encode(image(0.21404114 * DISPLAY_WHITE_XYZ))
    np.testing.assert_allclose(rgb, 0.5, atol=1e-3)


def test_adapts_once(srgb):
    white = observer("1931_2").white(illuminant("A"))
    rgb, _ = srgb.encode(image([0.3, 0.3, 0.1], white))
    adapted = np.array([0.3, 0.3, 0.1]) @ srgb.adaptation_from(white).T
    again, _ = srgb.encode(ColourImage(adapted.reshape(1, 1, 3).astype(np.float32), "xyz_d65", DISPLAY_WHITE_XYZ))
    np.testing.assert_allclose(rgb, again, atol=1e-6)
    np.testing.assert_allclose(again, srgb.apply(adapted.reshape(1, 1, 3)), atol=1e-6)


def test_default_view_never_tone_maps(srgb):
    rgb = srgb.apply(np.stack([DISPLAY_WHITE_XYZ, 2 * DISPLAY_WHITE_XYZ]))
    np.testing.assert_allclose(rgb[0], 1.0, atol=1e-6)
    assert (rgb[1] > 1.3).all()


def test_clipping_is_counted_and_said(srgb):
    green_laser = [0.17, 0.8, 0.02]
    rgb, notes = srgb.encode(image([DISPLAY_WHITE_XYZ, 2 * DISPLAY_WHITE_XYZ, green_laser, [0, 0, 0]]))
    assert rgb.min() >= 0 and rgb.max() <= 1
    assert len(notes) == 1
    assert "2 of 4 pixels (50.00%) clipped" in notes[0]
    assert "1 below it" in notes[0]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_pixels_without_a_number_are_loud(srgb, value):
    rgb, notes = srgb.encode(image([[0.1, value, 0.1], [0.1, 0.1, 0.1]]))
    assert tuple(rgb[0, 0]) == display.NOT_A_NUMBER_RGB
    assert np.isfinite(rgb).all()
    assert "1 of 2 pixels (50.00%) hold no number" in notes[-1]


def test_background_is_laid_in_linear_light(srgb):
    half = 0.5 * DISPLAY_WHITE_XYZ
    picture = ColourImage(np.stack([half, half * 0]).reshape(1, 2, 3).astype(np.float32), "xyz", DISPLAY_WHITE_XYZ)
    rgb, _ = srgb.encode(picture, np.array([[0.5, 0.0]]), 0.2 * DISPLAY_WHITE_XYZ)
    expected = srgb.apply(np.stack([0.6 * DISPLAY_WHITE_XYZ, 0.2 * DISPLAY_WHITE_XYZ]))
    np.testing.assert_allclose(rgb[0], expected, atol=1e-6)
    np.testing.assert_allclose(composite(picture.values, np.ones((1, 2)), half), picture.values)
    with pytest.raises(InputError, match="coverage"):
        srgb.encode(picture, None, half)


def test_unknown_display_and_view_give_the_nearest_names():
    with pytest.raises(UnknownNameError, match="sRGB - Display"):
        DisplayTransform(display="sRGB Display")
    with pytest.raises(UnknownNameError, match="Un-tone-mapped"):
        DisplayTransform(view="Untone mapped")


def test_environment_is_honoured_and_named_when_it_is_broken(monkeypatch, tmp_path):
    monkeypatch.setenv("OCIO", str(tmp_path / "missing.ocio"))
    with pytest.raises(InputError, match=r"\$OCIO=.*missing\.ocio"):
        DisplayTransform()
    (tmp_path / "broken.ocio").write_text("ocio_profile_version: [")
    monkeypatch.setenv("OCIO", str(tmp_path / "broken.ocio"))
    with pytest.raises(InputError, match=r"\$OCIO=.*broken\.ocio"):
        DisplayTransform()
    monkeypatch.setenv("OCIO", own_config(tmp_path))
    transform = DisplayTransform(display="Bench", view="Plain")
    assert "$OCIO=" in " ".join(transform.describe())
    with pytest.raises(UnknownNameError, match="Bench"):
        DisplayTransform()


def test_a_configuration_s_own_display_comes_first(monkeypatch, tmp_path):
    """By name or in the environment: pictures are not for sRGB where somebody's configuration begins with another."""
    path = Path(own_config(tmp_path))
    path.write_text(path.read_text().replace("name: Plain", "name: Un-tone-mapped"))
    assert DisplayTransform(config=str(path)).display == "Bench"
    monkeypatch.setenv("OCIO", str(path))
    assert DisplayTransform().display == "Bench" and DisplayTransform() == DisplayTransform("Bench")
    monkeypatch.delenv("OCIO")
    assert DisplayTransform().display == "sRGB - Display"


def test_configuration_without_the_interchange_role_is_refused(tmp_path):
    path = Path(own_config(tmp_path))
    path.write_text(path.read_text().replace("  cie_xyz_d65_interchange: xyz\n", ""))
    with pytest.raises(InputError, match="cie_xyz_d65_interchange"):
        DisplayTransform(display="Bench", view="Plain", config=str(path))


def test_missing_look_up_table_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match=r"not_there\.cube"):
        DisplayTransform(display="Bench", view="Broken", config=own_config(tmp_path))


def test_description_states_the_chain_and_warns_of_a_tone_mapper(srgb):
    words = " ".join(srgb.describe())
    for part in (
        "Bradford",
        "OpenColorIO 2",
        display.PINNED_CONFIG,
        "sRGB - Display",
        "Un-tone-mapped",
        "(1.0000, 1.0000, 1.0000)",
    ):
        assert part in words
    assert "not colorimetric" not in words
    toned = " ".join(DisplayTransform(view="ACES 1.0 - SDR Video").describe())
    assert "not colorimetric" in toned and "cannot all be counted" in toned


@pytest.mark.parametrize("bits", [8, 16])
def test_png_keeps_every_code_value(tmp_path, bits, srgb):
    rgb = np.random.default_rng(1).random((13, 17, 3)).astype(np.float32)
    path = tmp_path / "a.png"
    assert write_png(path, rgb, bits=bits, display=srgb, words=srgb.describe()) == ()
    codes = quantise(rgb, bits)
    with Image.open(path) as read:
        read.load()
        # Pillow reads 16-bit colour as its upper 8 bits.
        np.testing.assert_array_equal(np.asarray(read), codes if bits == 8 else codes >> 8)
        assert read.info["srgb"] == 1
        assert "Bradford" in read.info["Description"]
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.png"]


def test_sixteen_bit_png_keeps_its_lower_byte(tmp_path):
    rgb = np.array([[[0.0, 1.0, 12345 / 65535]]], dtype=np.float32)
    write_png(tmp_path / "a.png", rgb, bits=16)
    data = (tmp_path / "a.png").read_bytes()
    start = data.index(b"IDAT")
    size = int.from_bytes(data[start - 4 : start], "big")
    row = zlib.decompress(data[start + 4 : start + 4 + size])
    assert row == b"\x01" + np.array([0, 65535, 12345], dtype=">u2").tobytes()


def test_unwritable_folder_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match="no such folder"):
        write_png(tmp_path / "no" / "a.png", np.zeros((1, 1, 3), dtype=np.float32))
    with pytest.raises(InputError, match="8 or 16"):
        quantise(np.zeros((1, 1, 3), dtype=np.float32), 10)
