"""Sets of texture maps: which files make one, in which depth they are read, what is rendered and what is kept."""

import io
import struct
import zlib

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from metamer.materials.formats import maps
from metamer.materials.formats.pictures.map_names import map_name
from metamer.materials.formats.pictures.map_record import kept_texture, texel_reflectances
from metamer.materials.records.models import rebuild
from metamer.materials.records.source import MaterialSource, Rejected
from metamer.materials.svbrdf.textures import Texture
from metamer.runtime.errors import InputError
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.formats.import_options import NO_ANSWER, ImportOptions
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.srgb import srgb_to_linear
from metamer.spectral.upsampling import xyz_from_rgb
from PIL import Image


def colour(samples):
    """Linear sRGB, under D65, of a reflectance on the working wavelengths."""
    weights = observer("1931_2").weights(illuminant("D65"), np.linspace(380.0, 780.0, 81))
    return np.linalg.solve(xyz_from_rgb(), weights @ np.asarray(samples))


def save(path, values):
    Image.fromarray(np.asarray(values, np.uint8)).save(path)
    return path


def png16(values, key=None):
    """A PNG of 16 bits a channel (H,W,C), by the PNG specification: Pillow writes none in colour."""
    height, width, channels = values.shape

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 16, {1: 0, 2: 4, 3: 2, 4: 6}[channels], 0, 0, 0)
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in values)
    told = b"" if key is None else chunk(b"tRNS", np.asarray(key, ">u2").tobytes())
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + told + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    )


def tiff16(values, order, planar=1):
    """An uncompressed RGB TIFF of 16 bits a channel, by the TIFF 6.0 specification."""
    height, width, channels = values.shape
    data = values.astype(f"{order}u2").tobytes()
    entries = [(256, 4, 1, width), (257, 4, 1, height), (258, 3, 3, 0), (259, 3, 1, 1), (262, 3, 1, 2)]
    entries += [(273, 4, 1, 0), (277, 3, 1, channels), (278, 4, 1, height), (279, 4, 1, len(data)), (284, 3, 1, planar)]
    bits_at = 8 + 2 + 12 * len(entries) + 4
    out = (b"II*\0" if order == "<" else b"MM\0*") + struct.pack(f"{order}IH", 8, len(entries))
    for tag, kind, count, value in entries:
        value = bits_at if tag == 258 else bits_at + 6 if tag == 273 else value
        packed = struct.pack(f"{order}HH", value, 0) if kind == 3 and count == 1 else struct.pack(f"{order}I", value)
        out += struct.pack(f"{order}HHI", tag, kind, count) + packed
    return out + b"\0\0\0\0" + struct.pack(f"{order}HHH", 16, 16, 16) + data


def grey_tiff(data, width, bits, order="<", white_is_0=False, kind=1):
    """A TIFF of one grey row, by the TIFF 6.0 specification; kind: 1 whole numbers, 2 with a sign, 3 floats."""
    entries = [(256, 4, width), (257, 4, 1), (258, 3, bits), (259, 3, 1), (262, 3, 0 if white_is_0 else 1)]
    entries += [(273, 4, 8), (277, 3, 1), (278, 4, 1), (279, 4, len(data)), (339, 3, kind)]
    out = (b"II*\0" if order == "<" else b"MM\0*") + struct.pack(f"{order}I", 8 + len(data)) + data
    out += struct.pack(f"{order}H", len(entries))
    for tag, form, value in entries:
        packed = struct.pack(f"{order}HH", value, 0) if form == 3 else struct.pack(f"{order}I", value)
        out += struct.pack(f"{order}HHI", tag, form, 1) + packed
    return out + b"\0\0\0\0"


def read(path, uplift="mallett-yuksel", answer=NO_ANSWER):
    (found,) = maps.read_sources(path, uplift, answer)
    assert isinstance(found, MaterialSource)
    rebuild(found.model, found.parameters)
    return found


@pytest.mark.parametrize(
    ("name", "role", "stem"),
    [
        ("rock_wall_nor_gl_2k.png", "normal_gl", "rock_wall_2k"),
        ("rock_wall_diff_2k.jpg", "albedo", "rock_wall_2k"),
        ("Bricks001_1K-PNG_Color.png", "albedo", "Bricks001_1K"),
        ("Bricks001_1K-JPG_NormalDX.jpg", "normal_dx", "Bricks001_1K"),
        ("Leather_Base_Color.TIF", "albedo", "Leather"),
        ("Leather-Ambient Occlusion.png", "occlusion", "Leather"),
        ("metal_plate_metal.png", "metallic", "metal_plate"),
        ("car_metallicRoughness.png", "packed", "car"),
        ("paint_GLOSS_16bit.png", "gloss", "paint"),
        ("albedo.exr", "albedo", ""),
        ("Stone_AlbedoTransparency.png", "albedo", "Stone"),
        ("Stone_MetallicSmoothness.png", "metallic_smoothness", "Stone"),
        ("T_Stone_BC.png", "albedo", "T_Stone"),
        ("T_Stone_vg_2K_B.png", "albedo", "T_Stone_vg_2K"),
        ("T_Stone_D.png", "albedo", "T_Stone"),
        ("T_Stone_N.png", "normal", "T_Stone"),
        ("T_Stone_R.png", "roughness", "T_Stone"),
        ("T_Stone_ORM.png", "packed", "T_Stone"),
        ("Wood_BaseColor_sRGB.png", "albedo", "Wood"),
        ("Wood_Roughness_Raw.png", "roughness", "Wood"),
        ("Wood_basecolor_ACEScg.exr", "albedo", "Wood"),
    ],
)
def test_names_of_the_usual_libraries(tmp_path, name, role, stem):
    found = map_name(tmp_path / name)
    assert (found.role, found.stem) == (role, stem)


@pytest.mark.parametrize(
    "name",
    [
        "holiday.jpg",
        "wood_color.txt",
        "colorful.png",
        "rough_sketch.png",
        "plan_B.png",
        "vitamin D.jpg",
        "t_shirt_d.png",
        "T_B.png",
        "T_Stone_d.png",
        "T_Stone_M.png",
        "scan_raw.tif",
    ],
)
def test_other_pictures_are_no_maps(tmp_path, name):
    assert map_name(tmp_path / name) is None


def test_a_set_is_one_material_and_the_albedo_stands_for_it(tmp_path):
    albedo = save(tmp_path / "Wood_BaseColor_1K.png", np.full((4, 4, 3), 188))
    rough = save(tmp_path / "wood_roughness_1k.png", np.full((4, 4), 128))
    metal = save(tmp_path / "wood_metallic_1k.png", np.zeros((4, 4)))
    normal = save(tmp_path / "wood_nor_gl_1k.jpg", np.full((4, 4, 3), 128))
    other = save(tmp_path / "wood_roughness_2k.png", np.zeros((8, 8)))
    assert maps.recognises(albedo, b"") and not any(
        maps.recognises(path, b"") for path in (rough, metal, normal, other)
    )
    assert set(maps.companions(albedo)) == {rough, metal, normal}
    found = read(albedo, answer=ImportOptions(maps="mean"))
    assert (found.id, found.model) == ("maps/wood-1k", "metallic_roughness")
    assert found.provenance.kind == "uplifted(mallett-yuksel)"
    np.testing.assert_allclose(colour(found.parameters["diffuse"]), srgb_to_linear(np.array(188 / 255)), rtol=2e-3)
    assert found.parameters["alpha"] == pytest.approx((128 / 255) ** 2)
    for slot, path in (("albedo", albedo), ("roughness", rough), ("metallic", metal), ("normal_gl", normal)):
        assert found.original[f"maps.{slot}"].tobytes() == path.read_bytes()
        assert found.original[f"maps.{slot}.file"] == path.name
    assert "green up" in found.provenance.notes


@pytest.mark.parametrize("space", ["ACEScg", "Raw", "linear", "AdobeRGB"])
def test_integers_of_another_colour_space_are_refused(tmp_path, space):
    with pytest.raises(InputError, match="colours in another space") as caught:
        read(save(tmp_path / f"wood_basecolor_{space}.png", np.full((2, 2, 3), 99)))
    assert space in caught.value.found and "sRGB" in caught.value.hint


@pytest.mark.parametrize("space", ["ACEScg", "sRGB"])
def test_floats_of_another_colour_space_are_refused(tmp_path, space):
    path = tmp_path / f"wood_basecolor_{space}.exr"
    write_exr(path, {}, {name: np.full((2, 3), 0.5, np.float32) for name in "RGB"})
    with pytest.raises(InputError, match="colours in another space"):
        read(path)
    path.rename(tmp_path / "wood_basecolor_Raw.exr")
    assert read(tmp_path / "wood_basecolor_Raw.exr").original["maps.albedo.encoding"] == "linear"


def test_maps_named_with_the_space_that_they_have(tmp_path):
    albedo = save(tmp_path / "wood_basecolor_sRGB.png", np.full((2, 2, 3), 188))
    rough = save(tmp_path / "wood_roughness_Raw.png", np.full((2, 2), 128))
    save(tmp_path / "wood_height_sRGB.png", np.full((2, 2), 128))
    assert rough in maps.companions(albedo)
    found = read(albedo)
    assert found.parameters["alpha"] == pytest.approx((128 / 255) ** 2)
    np.testing.assert_allclose(colour(found.parameters["diffuse"]), srgb_to_linear(np.array(188 / 255)), rtol=2e-3)
    assert "the height map is named sRGB" in found.provenance.notes
    assert "the roughness map is named" not in found.provenance.notes


def test_metal_and_smoothness_of_unity(tmp_path):
    albedo = save(tmp_path / "a_AlbedoTransparency.png", [[[255, 255, 255, 255], [255, 255, 255, 128]]])
    packed = save(tmp_path / "a_MetallicSmoothness.png", np.broadcast_to([255, 0, 0, 204], (1, 2, 4)))
    found = read(albedo)
    assert found.model == "metallic_roughness" and found.parameters["alpha"] == pytest.approx(0.2**2)
    np.testing.assert_allclose(found.parameters["diffuse"], 0.0, atol=1e-12)
    assert "1 - smoothness" in found.provenance.notes and "alpha of the albedo is kept" in found.provenance.notes
    save(packed, np.broadcast_to([255, 0, 0], (1, 2, 3)))
    bare = read(albedo)
    assert bare.parameters["alpha"] == 1.0 and "no alpha, where smoothness" in bare.provenance.notes


def test_an_albedo_alone_is_matt(tmp_path):
    found = read(save(tmp_path / "wall_albedo.png", np.full((2, 2, 3), 255)))
    assert found.model == "lambert" and "perfectly diffuse" in found.provenance.notes


def test_any_map_of_a_set_that_is_named_brings_the_set(tmp_path):
    rough = save(tmp_path / "wall_rough.png", np.full((2, 2), 9))
    with pytest.raises(InputError, match="no albedo") as caught:
        read(rough)
    assert caught.value.found == "roughness" and "_albedo" in caught.value.expected and caught.value.hint
    save(tmp_path / "wall_albedo.png", np.full((2, 2, 3), 255))
    assert read(rough).id == "maps/wall"
    with pytest.raises(InputError, match="no albedo"):
        read(save(tmp_path / "holiday.png", np.zeros((2, 2, 3))))


def test_gloss_is_turned_into_roughness(tmp_path):
    save(tmp_path / "a_gloss.png", np.full((2, 2), 204))
    found = read(save(tmp_path / "a_albedo.png", np.full((2, 2, 3), 99)))
    assert found.parameters["alpha"] == pytest.approx(0.2**2) and "1 - gloss" in found.provenance.notes


def test_a_packed_map(tmp_path):
    save(tmp_path / "a_arm.png", np.broadcast_to([10, 102, 255], (2, 2, 3)))
    found = read(save(tmp_path / "a_diff.png", np.full((2, 2, 3), 255)))
    assert found.parameters["alpha"] == pytest.approx(0.4**2)
    np.testing.assert_allclose(found.parameters["diffuse"], 0.0, atol=1e-12)
    assert "green is taken as roughness" in found.provenance.notes


def test_two_maps_of_one_property_are_refused(tmp_path):
    albedo = save(tmp_path / "a_albedo.png", np.zeros((2, 2, 3)))
    save(tmp_path / "a_basecolor.png", np.zeros((2, 2, 3)))
    with pytest.raises(InputError) as caught:
        read(albedo)
    assert caught.value.field == "albedo" and "a_basecolor.png" in caught.value.found and caught.value.hint


def test_maps_of_different_sizes_are_refused(tmp_path):
    save(tmp_path / "a_roughness.png", np.zeros((4, 2)))
    with pytest.raises(InputError) as caught:
        read(save(tmp_path / "a_albedo.png", np.zeros((2, 2, 3))))
    assert "a_roughness.png 2 x 4" in caught.value.found and caught.value.expected and caught.value.hint


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_pngs_of_16_bits_are_read_in_full(tmp_path, channels):
    values = np.random.default_rng(1).integers(0, 65536, (5, 7, channels))
    texture = Texture("albedo", png16(values), "sRGB", tmp_path / "a.png", "albedo")
    np.testing.assert_array_equal(texture.values, values)
    assert texture.values.dtype == np.uint16 and texture.mime == "image/png"


def test_grey_with_alpha_of_16_bits_is_read_in_8_and_says_so(tmp_path):
    values = np.random.default_rng(1).integers(0, 65536, (5, 7, 2))
    texture = Texture("roughness", png16(values), "linear", tmp_path / "a.png", "roughness")
    np.testing.assert_array_equal(texture.values[..., [0, 3]], values >> 8)
    assert "8 are averaged" in texture.notes[0]


@pytest.mark.parametrize("order", "<>")
def test_tiffs_of_16_bits_are_read_in_full(tmp_path, order):
    values = np.random.default_rng(1).integers(0, 65536, (5, 7, 3))
    texture = Texture("albedo", tiff16(values, order), "sRGB", tmp_path / "a.tif", "albedo")
    np.testing.assert_array_equal(texture.values, values)


@pytest.mark.parametrize(("bits", "order"), [(8, "<"), (8, ">"), (16, "<")])
def test_a_tiff_whose_white_is_0_is_turned_round(tmp_path, order, bits):
    values, most = np.array([0, 5, 200, 255]) * (1 if bits == 8 else 257), 255 if bits == 8 else 65535
    for white_is_0 in (False, True):
        data = grey_tiff(values.astype(f"{order}u{bits // 8}").tobytes(), 4, bits, order, white_is_0)
        texture = Texture("roughness", data, "linear", tmp_path / "a.tif", "roughness")
        np.testing.assert_array_equal(texture.values[0, :, 0], most - values if white_is_0 else values)


def test_12_bits_fill_their_range(tmp_path):
    data = grey_tiff(bytes.fromhex("000800fff001"), 4, 12)
    texture = Texture("roughness", data, "linear", tmp_path / "a.tif", "roughness")
    np.testing.assert_allclose(texture.band(0, slice(0, 1))[0], np.array([0, 2048, 4095, 1]) / 4095, atol=1 / 65535)


@pytest.mark.parametrize("stored, bits, kind", [("u4", 32, 1), ("i4", 32, 2), ("i2", 16, 2), ("f4", 32, 3)])
def test_whole_numbers_of_no_scale_are_refused(tmp_path, stored, bits, kind):
    """A few small numbers of 32 bits, or with a sign, may be fractions of anything."""
    data = grey_tiff(np.array([0, 5, 70], f"<{stored}").tobytes(), 3, bits, white_is_0=kind == 3, kind=kind)
    with pytest.raises(InputError, match="whole numbers on no scale"):
        _ = Texture("roughness", data, "linear", tmp_path / "a.tif", "roughness").values


@pytest.mark.parametrize("channels", [1, 3])
def test_a_key_of_16_bits_is_transparent_and_the_rest_is_read_in_full(tmp_path, channels):
    values = np.random.default_rng(1).integers(0, 65536, (2, 3, channels))
    texture = Texture("albedo", png16(values, values[1, 2]), "sRGB", tmp_path / "a.png", "albedo")
    np.testing.assert_array_equal(texture.values[..., :channels], values)
    np.testing.assert_array_equal(texture.values[..., channels], [[65535, 65535, 65535], [65535, 65535, 0]])


def test_planes_of_16_bits_are_refused(tmp_path):
    """Pillow would take them for something else without a word."""
    path = tmp_path / "a_albedo.tif"
    path.write_bytes(tiff16(np.zeros((5, 7, 3)), "<", planar=2))
    with pytest.raises(InputError, match="one plane a channel") as caught:
        read(path)
    assert caught.value.file == path and caught.value.hint


def test_compressed_tiffs_of_16_bits_are_read_in_full(tmp_path):
    values = np.random.default_rng(1).integers(0, 65536, (40, 70, 3))
    with Image.open(io.BytesIO(tiff16(values, "<"))) as picture:
        # Pillow keeps the high bytes alone: what it writes has 8 bits, and must come back so.
        picture.save(tmp_path / "a.tif", compression="tiff_lzw")
    texture = Texture("albedo", (tmp_path / "a.tif").read_bytes(), "sRGB", tmp_path / "a.tif", "albedo")
    np.testing.assert_array_equal(texture.values, values >> 8)


def test_floats_are_linear(tmp_path):
    path = tmp_path / "a_albedo.exr"
    write_exr(path, {}, {name: np.full((2, 3), 0.5**power, np.float32) for power, name in enumerate("RGB", 1)})
    found = read(path)
    np.testing.assert_allclose(colour(found.parameters["reflectance"]), [0.5, 0.25, 0.125], atol=1e-3)
    assert found.original["maps.albedo.encoding"] == "linear"
    assert found.original["maps.albedo.type"] == "image/x-exr"
    texel = texel_reflectances(found.original, "albedo", slice(1, 2), slice(0, 1))[0, 0]
    np.testing.assert_allclose(texel, found.parameters["reflectance"], rtol=1e-6)
    assert kept_texture(found.original, "albedo").size == (2, 3)


def test_an_albedo_of_lights_is_refused(tmp_path):
    path = tmp_path / "a_albedo.exr"
    write_exr(path, {}, {name: np.full((2, 3), 4.0, np.float32) for name in "RGB"})
    with pytest.raises(InputError, match="no reflectance has this colour") as caught:
        read(path)
    assert caught.value.file == path and caught.value.hint


def test_a_colour_profile_is_said(tmp_path):
    path = tmp_path / "a_albedo.png"
    Image.new("RGB", (2, 2)).save(path, icc_profile=b"a profile of another space")
    assert "colour profile" in read(path).provenance.notes


@pytest.mark.parametrize("mode", ["CMYK", "LAB"])
def test_colours_of_another_kind_are_refused(tmp_path, mode):
    path = tmp_path / "a_albedo.tif"
    Image.new(mode, (2, 2)).save(path)
    with pytest.raises(InputError, match="colours of an unknown kind") as caught:
        read(path)
    assert caught.value.found == mode and "RGB" in caught.value.hint


def test_palettes_are_looked_up(tmp_path):
    path = tmp_path / "a_albedo.png"
    Image.new("RGB", (2, 2), (0, 255, 0)).convert("P").save(path)
    np.testing.assert_allclose(colour(read(path).parameters["reflectance"]), [0, 1, 0], atol=1e-3)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data(), kind=st.sampled_from(["png", "jpg", "tif", "tga", "webp", "bmp"]))
def test_damaged_pictures_are_refused_in_words(tmp_path, data, kind):
    path = tmp_path / f"a_albedo.{kind}"
    Image.fromarray(np.arange(192, dtype=np.uint8).reshape(8, 8, 3)).save(path)
    raw = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 6))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(raw[: data.draw(st.sampled_from([len(raw), data.draw(st.integers(0, len(raw)))]))])
    try:
        found = list(maps.read_sources(path, "mallett-yuksel"))
    except InputError as reason:
        assert reason.file == path and reason.expected and reason.hint
        return
    finally:
        path.unlink()
    assert all(isinstance(each, Rejected) or rebuild(each.model, each.parameters) for each in found)
