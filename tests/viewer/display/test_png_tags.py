"""Colour tags of PNG files: code points of standards, profiles of other displays, read back by other readers."""

import io

import numpy as np
import pytest
from icc_profiles import old_tables
from metamer.viewer.display.png import colour_chunks, write_png
from metamer.viewer.display.transform import DisplayTransform
from PIL import Image, ImageCms

# Two displays by transforms that OpenColorIO has built in, one by a power, and one that mixes its channels.
CONFIG = """ocio_profile_version: 2.1
roles:
  default: raw
  scene_linear: xyz
  cie_xyz_d65_interchange: xyz
displays:
  HLG:
    - !<View> {name: Plain, colorspace: hlg}
  Gamma:
    - !<View> {name: Plain, colorspace: gamma}
  Mixed:
    - !<View> {name: Plain, colorspace: mixed}
  Uneven:
    - !<View> {name: Plain, colorspace: uneven}
colorspaces:
  - !<ColorSpace>
    name: raw
    isdata: true
  - !<ColorSpace>
    name: xyz
  - !<ColorSpace>
    name: hlg
    from_scene_reference: !<BuiltinTransform> {style: DISPLAY - CIE-XYZ-D65_to_REC.2100-HLG-1000nit}
  - !<ColorSpace>
    name: gamma
    from_scene_reference: !<BuiltinTransform> {style: DISPLAY - CIE-XYZ-D65_to_G2.6-P3-D65}
  - !<ColorSpace>
    name: mixed
    from_scene_reference: !<GroupTransform>
      children:
        - !<BuiltinTransform> {style: DISPLAY - CIE-XYZ-D65_to_sRGB}
        - !<MatrixTransform> {matrix: [0.98, 0.02, 0, 0, 0.01, 0.98, 0.01, 0, 0, 0.02, 0.98, 0, 0, 0, 0, 1]}
  - !<ColorSpace>
    name: uneven
    from_scene_reference: !<GroupTransform>
      children:
        - !<BuiltinTransform> {style: DISPLAY - CIE-XYZ-D65_to_sRGB}
        - !<MatrixTransform> {matrix: [0.6, 0.4, 0, 0, 0, 0.6, 0.4, 0, 0.4, 0, 0.6, 0, 0, 0, 0, 1]}
        - !<ExponentTransform> {value: [0.4, 0.4, 0.4, 1]}
"""


@pytest.fixture
def display(tmp_path):
    """A display by its name: of the pinned configuration, or of the one here."""
    (tmp_path / "config.ocio").write_text(CONFIG, encoding="utf-8")

    def named(name):
        own = f"\n  {name}:\n" in CONFIG
        return DisplayTransform(name, "Plain", str(tmp_path / "config.ocio")) if own else DisplayTransform(name)

    return named


@pytest.mark.parametrize(
    ("name", "points"),
    [
        ("sRGB - Display", (1, 13)),
        ("Display P3 - Display", (12, 13)),
        ("Rec.2100-PQ - Display", (9, 16)),
        ("ST2084-P3-D65 - Display", (12, 16)),
        ("HLG", (9, 18)),
    ],
)
def test_standards_are_named_by_their_code_points(display, name, points):
    """By what codes show, whatever the display is called; full range, red, green and blue."""
    chunks = dict(colour_chunks(display(name))[0])
    assert chunks[b"cICP"] == bytes([*points, 0, 1])
    assert (b"sRGB" in chunks) == (points == (1, 13)) and (b"iCCP" in chunks) == (points == (12, 13))


@pytest.mark.parametrize("name", ["Rec.1886 Rec.709 - Display", "Gamma", "Display P3 - Display"])
def test_the_profile_within_shows_what_codes_show(display, name, tmp_path):
    """LittleCMS makes of it the codes of sRGB that OpenColorIO does, to one."""
    shown = display(name)
    steps = np.round(np.linspace(0.0, 255.0, 9)).astype(np.uint8)
    codes = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(27, 27, 3)
    path = tmp_path / "a.png"
    assert write_png(path, codes / 255.0, display=shown) == ()
    with Image.open(path) as read:
        np.testing.assert_array_equal(np.asarray(read), codes)
        profile = ImageCms.ImageCmsProfile(io.BytesIO(read.info["icc_profile"]))
    srgb = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB"))
    transform = ImageCms.ImageCmsTransform(
        profile, srgb, "RGB", "RGB", intent=ImageCms.Intent.RELATIVE_COLORIMETRIC, flags=ImageCms.Flags.NOOPTIMIZE
    )
    theirs = np.asarray(transform.apply(Image.fromarray(codes))).astype(float)
    ours = np.clip(DisplayTransform().apply(shown.shown(codes / 255.0)), 0.0, 1.0) * 255.0
    assert np.abs(np.rint(ours) - theirs).max() <= 1.0
    assert np.abs(theirs - codes).max() > 5.0


def test_a_display_of_which_a_matrix_tells_little_is_said(display):
    chunks, said = colour_chunks(display("Mixed"))
    assert [kind for kind, _ in chunks] == [b"iCCP"] and "off by ΔE94" in said[0] and "Mixed" in said[0]
    chunks, said = colour_chunks(display("Uneven"))
    assert chunks == [] and "no colour tag" in said[0] and "take it for sRGB" in said[0]


def test_a_profile_that_was_given_is_within_byte_for_byte(tmp_path):
    data = old_tables(name="Büro, links " + 90 * "x")
    (tmp_path / "desk.icc").write_bytes(data)
    display = DisplayTransform(f"icc:{tmp_path / 'desk.icc'}")
    write_png(tmp_path / "a.png", np.zeros((2, 2, 3)), bits=16, display=display)
    with Image.open(tmp_path / "a.png") as read:
        assert read.info["icc_profile"] == data
    # Written anew, it is the new one.
    (tmp_path / "desk.icc").write_bytes(old_tables(name="Another"))
    (_, content), *_ = colour_chunks(DisplayTransform(f"icc:{tmp_path / 'desk.icc'}"))[0]
    assert content.startswith(b"Another\0")


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("name", ["sRGB - Display", "Rec.2100-PQ - Display", "Gamma"])
def test_openimageio_reads_codes_and_tags(display, name, bits, tmp_path):
    oiio = pytest.importorskip("OpenImageIO")
    rgb = np.random.default_rng(4).uniform(size=(5, 7, 3)).astype(np.float32)
    write_png(tmp_path / "a.png", rgb, bits=bits, display=display(name))
    read = oiio.ImageInput.open(str(tmp_path / "a.png"))
    codes, said = read.read_image(oiio.UINT16), read.spec()
    top = (1 << bits) - 1
    np.testing.assert_array_equal(codes, np.rint(rgb.astype(np.float64) * top) * (65535 // top))
    points = said.getattribute("CICP")
    if name == "Gamma":
        assert points is None and said.getattribute("ICCProfile:profile_description") == "Gamma"
    else:
        assert tuple(points) == ((1, 13, 0, 1) if name.startswith("sRGB") else (9, 16, 0, 1))
