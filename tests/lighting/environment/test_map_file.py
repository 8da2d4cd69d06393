"""Maps of light as other people write them: what is read, what is refused, and in which words."""

import numpy as np
import OpenEXR
import pytest
from metamer.lighting.environment import map_file
from metamer.lighting.environment.map_file import read_map
from metamer.runtime import memory
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.upsampling import xyz_from_rgb

GENERATOR = np.random.default_rng(7)
RGB = {name: GENERATOR.uniform(0.1, 4.0, (4, 8)) for name in "RGB"}


def write(path, parts, **header):
    """Write with the library itself: whatever it can."""
    if isinstance(parts, dict):
        parts = {name: np.asarray(values) for name, values in parts.items()}
        OpenEXR.File({"type": OpenEXR.scanlineimage, **header}, parts).write(str(path))
    else:
        OpenEXR.File([OpenEXR.Part({"type": OpenEXR.scanlineimage}, at, name) for name, at in parts]).write(str(path))
    return path


def as_type(kind, channels=RGB):
    return {name: values.astype(kind) for name, values in channels.items()}


def refused(path, *words, **settings):
    with pytest.raises(InputError) as caught:
        read_map(path, **settings)
    for word in (str(path), *words):
        assert word in str(caught.value), caught.value


@pytest.mark.parametrize("kind", [np.float16, np.float32])
@pytest.mark.parametrize("compression", ["NO", "RLE", "ZIPS", "ZIP", "PIZ"])
def test_half_and_float_of_every_lossless_compression(tmp_path, kind, compression):
    path = write(tmp_path / "sky.exr", as_type(kind), compression=getattr(OpenEXR, f"{compression}_COMPRESSION"))
    found = read_map(path)
    assert found.kind == "RGB" and found.size == (4, 8)
    np.testing.assert_array_equal(found.channels[1], RGB["G"].astype(kind))
    np.testing.assert_allclose(found.luminance(), sum(
        weight * RGB[name].astype(kind) for weight, name in zip(xyz_from_rgb()[1], "RGB", strict=True)
    ), rtol=1e-6)  # fmt: skip
    assert found.notes == (
        "its RGB is taken to be linear, of the primaries of ITU-R BT.709 (sRGB): the file does not say",
    )


def test_tiles(tmp_path):
    path = write(tmp_path / "t.exr", as_type(np.float32), type=OpenEXR.tiledimage, tiles=OpenEXR.TileDescription())
    np.testing.assert_array_equal(read_map(path).channels[2], RGB["B"].astype(np.float32))


def test_parts_and_layers_beside_the_light_are_named(tmp_path):
    depth = {"Z": np.ones((4, 8), np.float32)}
    found = read_map(write(tmp_path / "parts.exr", [("beauty", as_type(np.float32)), ("depth", depth)]))
    assert found.kind == "RGB" and found.notes[1] == "channels that are not looked at: depth.Z"


def test_one_layer_with_a_name_is_the_light_and_two_are_asked_for(tmp_path):
    left = {f"left.{name}": values for name, values in as_type(np.float32).items()}
    assert read_map(write(tmp_path / "left.exr", left)).kind == "RGB"
    right = {name.replace("left", "right"): values for name, values in left.items()}
    refused(write(tmp_path / "both.exr", left | right), "which layer is the light?", "left, right")


def test_alpha_is_not_looked_at_and_said_where_it_is_not_one(tmp_path):
    rgba = np.ones((4, 8, 4), np.float32)
    assert not any("alpha" in note for note in read_map(write(tmp_path / "one.exr", {"RGBA": rgba})).notes)
    rgba[1, 2, 3] = 0.5
    assert any("alpha" in note for note in read_map(write(tmp_path / "half.exr", {"RGBA": rgba})).notes)


def test_xyz_and_luminance_alone(tmp_path):
    xyz = dict(zip("XYZ", as_type(np.float32).values(), strict=True))
    found = read_map(write(tmp_path / "xyz.exr", xyz))
    assert found.kind == "XYZ" and found.notes == ()
    np.testing.assert_array_equal(found.luminance(), xyz["Y"])
    found = read_map(write(tmp_path / "y.exr", {"Y": xyz["Y"]}))
    assert found.kind == "luminance"
    np.testing.assert_array_equal(found.luminance(), xyz["Y"])


def test_primaries_that_the_file_states_are_taken(tmp_path):
    """ACES 2065-1: its luminance is 0.343966 R + 0.728166 G - 0.072132 B (SMPTE ST 2065-1)."""
    aces = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)
    found = read_map(write(tmp_path / "aces.exr", as_type(np.float32), chromaticities=aces))
    np.testing.assert_allclose(found.xyz_from_channels[1], [0.343966, 0.728166, -0.072132], atol=1e-6)
    assert found.notes == ()
    bt709 = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)
    found = read_map(write(tmp_path / "709.exr", as_type(np.float32), chromaticities=bt709))
    np.testing.assert_allclose(found.xyz_from_channels, xyz_from_rgb(), atol=3e-4)
    refused(
        write(tmp_path / "none.exr", as_type(np.float32), chromaticities=(0.0,) * 8),
        "chromaticities: no primaries of light",
    )


@pytest.mark.parametrize(
    ("value", "word", "found"),
    [
        (np.nan, "not a number", "nan"),
        (np.inf, "infinite", "inf"),
        (-0.25, "negative", "-0.25"),
        (-np.inf, "inf", "-inf"),
    ],
)
def test_a_bad_texel_is_named_by_row_and_column(tmp_path, value, word, found):
    green = RGB["G"].copy()
    green[2, 5] = value
    path = write(tmp_path / "bad.exr", as_type(np.float16, RGB | {"G": green}))
    refused(path, word, "row 2, column 5", f"found: {found}; 1 of 32", "black")
    mended = read_map(path, bad_texels="black")
    assert mended.luminance()[2, 5] == 0 and (mended.luminance() > 0).sum() == 31
    assert "1 of 32 texels" in mended.notes[-1] and "first at row 2, column 5" in mended.notes[-1]
    unknown = "how much light the others would send is not known" in mended.notes[-1]
    assert unknown == (not np.isfinite(value))


def test_what_negative_texels_hold_of_the_light_is_said(tmp_path):
    grey = np.ones((64, 128), np.float32)
    grey[:8, :4] = -1.0
    path = write(tmp_path / "bad.exr", dict.fromkeys("RGB", grey))
    share = (1 - np.cos(np.pi / 8)) / 2 / 32
    note = read_map(path, bad_texels="black").notes[-1]
    assert f"{share:.2g} of all directions" in note and f"hold {share / (1 - share):.2g} of the light" in note
    with pytest.raises(UnknownNameError, match="black"):
        read_map(path, bad_texels="blacken")


@pytest.mark.parametrize("shape", [(8, 8), (4, 9), (3, 8), (6, 1), (1, 1)])
def test_a_map_that_is_not_twice_as_wide_as_high(tmp_path, shape):
    path = write(tmp_path / "sky.exr", {name: np.ones(shape, np.float32) for name in "RGB"})
    refused(path, "not a latitude-longitude map", f"{shape[1]} x {shape[0]}", "twice as wide as high")


def test_the_smallest_map_of_all(tmp_path):
    path = write(tmp_path / "sky.exr", {name: np.ones((1, 2), np.float32) for name in "RGB"})
    assert read_map(path).size == (1, 2)


def test_a_crop_does_not_say_where_it_lies(tmp_path):
    window = (np.array([0, 0], np.int32), np.array([15, 7], np.int32))
    refused(write(tmp_path / "crop.exr", as_type(np.float32), displayWindow=window), "cropped", "dataWindow")


@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 0.6, 0.99])
def test_a_cut_file(tmp_path, share):
    whole = write(tmp_path / "sky.exr", as_type(np.float32)).read_bytes()
    path = tmp_path / "cut.exr"
    path.write_bytes(whole[: int(share * len(whole))])
    refused(path, "expected")


def test_damage_anywhere_is_refused_or_read_and_never_more(tmp_path):
    whole = write(tmp_path / "sky.exr", as_type(np.float32)).read_bytes()
    path = tmp_path / "hurt.exr"
    generator = np.random.default_rng(3)
    for at in generator.integers(len(whole), size=60):
        hurt = bytearray(whole)
        hurt[at] ^= 1 << int(generator.integers(8))
        path.write_bytes(hurt)
        try:
            read_map(path)
        except InputError as error:
            assert error.expected or error.hint


def test_other_files_and_none(tmp_path):
    path = tmp_path / "sky.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n")
    refused(path, "not a map of light", "clipped")
    refused(tmp_path / "gone.exr", "no such file")
    refused(tmp_path, "no such file")
    refused(write(tmp_path / "depth.exr", {"Z": np.ones((4, 8), np.float32)}), "no light", "found: Z")


def spectral(path, values, quantity="S0", **more):
    """A spectral picture; the wavelengths are the keys."""
    return write(path, {f"{quantity}.{nm},000000nm": np.asarray(at, np.float32) for nm, at in values.items()} | more)


def test_spectra_in_any_order_with_their_preview(tmp_path):
    preview = {name: np.ones((4, 8), np.float32) for name in "RGB"}
    planes = {nm: np.full((4, 8), nm / 100.0) for nm in (700, 400, 550)}
    found = read_map(spectral(tmp_path / "s.exr", planes, **preview))
    assert found.kind == "spectra" and found.wavelengths_nm.tolist() == [400, 550, 700] and found.notes == ()
    assert [channel[0, 0] for channel in found.channels] == [4, 5.5, 7]


def test_a_bad_value_of_one_wavelength_is_a_bad_texel(tmp_path):
    planes = {nm: np.ones((4, 8)) for nm in (400, 550, 700)}
    planes[550][3, 7] = -1e-3
    refused(spectral(tmp_path / "s.exr", planes), "negative", "row 3, column 7")


def test_reflectances_and_one_wavelength_are_no_light(tmp_path):
    ones = np.ones((4, 8))
    refused(spectral(tmp_path / "t.exr", {400: ones, 500: ones}, "T"), "without light", "S0")
    refused(spectral(tmp_path / "one.exr", {550: ones}), "one wavelength is no spectrum")


def test_memory_is_said_before_a_pixel_is_read(tmp_path, monkeypatch):
    path = write(tmp_path / "sky.exr", as_type(np.float32))
    lines = []
    monkeypatch.setattr(map_file, "SAID_FROM_SECONDS", 0.0)
    read_map(path, say=lines.append)
    assert len(lines) == 1 and "32 texels of 3 channels" in lines[0] and "memory" in lines[0]
    monkeypatch.setattr(memory, "available_bytes", lambda: 100)
    refused(path, "does not fit into memory", "half the width takes a quarter")
    assert map_file.MapCost(8192 * 4096, 3).memory_bytes > 2e9


def test_a_written_picture_of_xyz_is_a_map(tmp_path):
    """What Metamer writes is read: X, Y and Z, with alpha."""
    write_exr(tmp_path / "p.exr", {}, {name: np.ones((2, 4)) for name in "XYZA"})
    assert read_map(tmp_path / "p.exr").kind == "XYZ"


def test_real_maps(shared_data):
    maps = sorted((shared_data / "light").glob("*.exr"))
    if not maps:
        pytest.skip("no maps of light")
    for path in maps:
        found = read_map(path)
        assert found.kind == "RGB" and found.size[1] == 2 * found.size[0] and found.luminance().min() >= 0
