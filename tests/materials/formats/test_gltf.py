"""glTF materials: what is rendered, what is kept, and what is refused."""

import base64
import io
import json
import struct
import zlib

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from metamer.materials.formats import gltf
from metamer.materials.formats.pictures.map_record import kept_texture, texel_reflectances
from metamer.materials.records.models import rebuild
from metamer.materials.records.source import Rejected
from metamer.runtime.errors import InputError
from metamer.spectral.formats.import_options import NO_ANSWER, ImportOptions
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.upsampling import METHODS, xyz_from_rgb
from PIL import Image

RGB_FROM_XYZ = np.linalg.inv(xyz_from_rgb())


@pytest.fixture
def rng():
    return np.random.default_rng(7)


def png(values, mode=None):
    file = io.BytesIO()
    Image.fromarray(np.asarray(values, np.uint8), mode).save(file, "PNG")
    return file.getvalue()


def glb(document, binary=b"", version=2):
    """A .glb, its chunks padded as the specification has it."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if binary:
        binary += b"\0" * (-len(binary) % 4)
        chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", version, 12 + len(chunks)) + chunks


def document(*materials, pictures=(), **rest):
    """A glTF of these materials, each picture in a view of the one buffer; and that buffer."""
    binary, views = b"", []
    for picture in pictures:
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(picture)})
        binary += picture
    made = {
        "asset": {"version": "2.0", "generator": "a test", "copyright": "CC0"},
        "materials": list(materials),
        "textures": [{"source": number} for number in range(len(pictures))],
        "images": [{"bufferView": number, "mimeType": "image/png"} for number in range(len(pictures))],
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}] if binary else [],
    }
    return made | rest, binary


def read(path, uplift="mallett-yuksel", answer=NO_ANSWER):
    return list(gltf.read_sources(path, uplift, answer))


def read_glb(tmp_path, *materials, uplift="mallett-yuksel", answer=NO_ANSWER, **rest):
    path = tmp_path / "Show Room.glb"
    path.write_bytes(glb(*document(*materials, **rest)))
    return read(path, uplift, answer)


# Maps are replaced by their mean.
MEAN = ImportOptions(maps="mean")


def colour(samples):
    """Linear sRGB, under D65, of a reflectance on the working wavelengths."""
    nm = np.linspace(380.0, 780.0, 81)
    return RGB_FROM_XYZ @ observer("1931_2").weights(illuminant("D65"), nm) @ np.asarray(samples)


PAINT = {
    "name": "Red Paint",
    "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.05, 0.02, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.5},
}


def test_factors_become_the_parameters_of_the_model(tmp_path):
    (paint,) = read_glb(tmp_path, PAINT)
    assert (paint.id, paint.family, paint.model) == ("show-room/red-paint", "show-room", "metallic_roughness")
    assert paint.provenance.kind == "uplifted(mallett-yuksel)" and paint.provenance.licence == "CC0"
    np.testing.assert_allclose(colour(paint.parameters["diffuse"]), [0.5, 0.05, 0.02], atol=1e-3)
    np.testing.assert_allclose(paint.parameters["specular"], 0.04, rtol=1e-3)
    assert paint.parameters["alpha"] == 0.25 and paint.parameters["edge"] == 1.0 and paint.parameters["coat"] == 0.0
    assert rebuild(paint.model, paint.parameters).alpha == 0.25
    assert json.loads(paint.original["gltf.material"]) == PAINT


def test_the_licence_that_libraries_add_is_read(tmp_path):
    asset = {"version": "2.0", "extras": {"license": "CC-BY-4.0 (https://creativecommons.org/licenses/by/4.0/)"}}
    (paint,) = read_glb(tmp_path, PAINT, asset=asset)
    assert paint.provenance.licence.startswith("CC-BY-4.0")


def test_a_metal_has_its_colour_in_the_facets(tmp_path):
    (gold,) = read_glb(tmp_path, {"pbrMetallicRoughness": {"baseColorFactor": [1.0, 0.7, 0.3, 1.0]}})
    assert gold.id == "show-room/material-1" and gold.parameters["alpha"] == 1.0
    np.testing.assert_allclose(gold.parameters["diffuse"], 0.0, atol=1e-12)
    np.testing.assert_allclose(colour(gold.parameters["specular"]), [1.0, 0.7, 0.3], atol=1e-3)


def test_white_is_not_refused_for_a_rounding(tmp_path):
    (white,) = read_glb(tmp_path, {"pbrMetallicRoughness": {"metallicFactor": 0}})
    rebuild(white.model, white.parameters)


@pytest.mark.parametrize("uplift", METHODS)
def test_every_method_gives_a_reflectance_of_the_right_colour(tmp_path, uplift):
    """Pure red by jakob-hanika reaches 2: another spectrum of the same colour is mixed in, and the notes say so."""
    red = {"pbrMetallicRoughness": {"baseColorFactor": [1.0, 0.0, 0.0, 1.0], "metallicFactor": 0.0}}
    (paint,) = read_glb(tmp_path, red, uplift=uplift)
    diffuse = paint.parameters["diffuse"]
    assert diffuse.min() >= 0 and diffuse.max() <= 1
    np.testing.assert_allclose(colour(diffuse), [1.0, 0.0, 0.0], atol=0.06 if uplift == "smits" else 2e-3)
    assert paint.provenance.kind == f"uplifted({uplift})"
    assert ("exceed 1" in paint.provenance.notes) == (uplift != "mallett-yuksel")


def test_the_mean_of_a_texture_is_taken_in_linear_light(tmp_path):
    checks = np.zeros((2, 2, 3), np.uint8)
    checks[0, 0] = checks[1, 1] = 255
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0.0}}
    (found,) = read_glb(tmp_path, material, answer=MEAN, pictures=[png(checks)])
    np.testing.assert_allclose(colour(found.parameters["diffuse"]), 0.5, atol=1e-3)
    assert "mean of the maps" in found.provenance.notes


def test_rust_on_steel_is_half_a_metal_and_half_a_dielectric(tmp_path):
    """The mean of what texels reflect, which is not what the mean of the maps would."""
    base = np.zeros((1, 2, 3), np.uint8)
    base[0, 0], base[0, 1] = 255, [188, 0, 0]
    packed = np.array([[[0, 0, 255], [0, 255, 0]]], np.uint8)
    pbr = {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 1}}
    (found,) = read_glb(tmp_path, {"pbrMetallicRoughness": pbr}, answer=MEAN, pictures=[png(base), png(packed)])
    rust = ((188 / 255 + 0.055) / 1.055) ** 2.4
    np.testing.assert_allclose(colour(found.parameters["diffuse"]), [rust / 2, 0, 0], atol=1e-3)
    np.testing.assert_allclose(colour(found.parameters["specular"]), 0.52, atol=1e-3)
    assert found.parameters["alpha"] == pytest.approx(0.25)


def test_textures_stay_textures(tmp_path, rng):
    """The files come back byte for byte, one picture once, and their texels as spectra of the right colour."""
    base, packed = (png(rng.integers(0, 256, (3, 5, 3))) for _ in range(2))
    material = {
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 1}},
        "occlusionTexture": {"index": 1, "strength": 0.5},
        "normalTexture": {"index": 2},
        "extensions": {"KHR_materials_sheen": {"sheenColorTexture": {"index": 0}}},
    }
    (found,) = read_glb(tmp_path, material, pictures=[base, packed, b"\xabKTX 20\xbb\r\n\x1a\n and so on"])
    kept = found.original
    assert kept["maps.pbrMetallicRoughness.baseColorTexture"].tobytes() == base
    assert kept["maps.pbrMetallicRoughness.baseColorTexture.encoding"] == "sRGB"
    assert kept["maps.pbrMetallicRoughness.metallicRoughnessTexture"].tobytes() == packed
    assert kept["maps.occlusionTexture.same_as"] == "pbrMetallicRoughness.metallicRoughnessTexture"
    assert kept["maps.KHR_materials_sheen.sheenColorTexture.encoding"] == "sRGB"
    assert kept["maps.normalTexture"].tobytes().startswith(b"\xabKTX")
    for word in ("sheen", "occlusion", "normal map", "KTX2"):
        assert word in found.provenance.notes, word
    slot = "pbrMetallicRoughness.baseColorTexture"
    texture = kept_texture(kept, slot)
    spectra = texel_reflectances(kept, slot, slice(1, 3), slice(2, 5))
    expected = texture.linear(slice(1, 3))[:, 2:5]
    found_colours = np.array([[colour(texel) for texel in row] for row in spectra])
    np.testing.assert_allclose(found_colours, expected, atol=2e-3)
    np.testing.assert_allclose(spectra, expected @ kept["uplift.spectra"])
    with pytest.raises(InputError, match="unknown map"):
        kept_texture(kept, "colour")


def test_extensions_that_are_rendered(tmp_path):
    material = {
        "extensions": {
            "KHR_materials_ior": {"ior": 2.0},
            "KHR_materials_specular": {"specularFactor": 0.5},
            "KHR_materials_clearcoat": {"clearcoatFactor": 0.8, "clearcoatRoughnessFactor": 0.3},
        },
        "pbrMetallicRoughness": {"metallicFactor": 0.0},
    }
    (found,) = read_glb(tmp_path, material)
    np.testing.assert_allclose(found.parameters["specular"], 0.5 / 9, rtol=1e-3)
    assert found.parameters["edge"] == 0.5
    assert found.parameters["coat"] == 0.8 and found.parameters["coat_alpha"] == pytest.approx(0.09)


def test_specular_and_glossiness(tmp_path):
    gloss = {"diffuseFactor": [0.4, 0.4, 0.4, 1], "specularFactor": [0.5, 0.2, 0.2], "glossinessFactor": 0.6}
    (found,) = read_glb(tmp_path, {"extensions": {"KHR_materials_pbrSpecularGlossiness": gloss}})
    np.testing.assert_allclose(found.parameters["diffuse"], 0.2, rtol=1e-3)
    np.testing.assert_allclose(colour(found.parameters["specular"]), [0.5, 0.2, 0.2], atol=1e-3)
    assert found.parameters["alpha"] == pytest.approx(0.16)


def test_unlit_is_taken_for_matt(tmp_path):
    (found,) = read_glb(tmp_path, {"extensions": {"KHR_materials_unlit": {}}, **PAINT})
    assert found.model == "lambert" and "unlit" in found.provenance.notes
    np.testing.assert_allclose(colour(found.parameters["reflectance"]), [0.5, 0.05, 0.02], atol=1e-3)


def test_a_lamp_gives_its_emission_too(tmp_path):
    strength = {"KHR_materials_emissive_strength": {"emissiveStrength": 100.0}}
    surface, lamp = read_glb(tmp_path, {**PAINT, "emissiveFactor": [1.0, 0.5, 0.25], "extensions": strength})
    assert (surface.id, lamp.id) == ("show-room/red-paint", "show-room/red-paint-emission")
    assert lamp.model == "emission" and lamp.original["quantity"] == "emission" and not lamp.parameters
    light = Spectrum.sampled(lamp.original["wavelengths_nm"], lamp.original["values"], "emission")
    luminance = 683.002 * observer("1931_2").luminous(light)
    assert luminance == pytest.approx(float(xyz_from_rgb()[1] @ [100.0, 50.0, 25.0]), rel=2e-3)


def test_a_black_map_switches_the_lamp_off(tmp_path):
    lamp = {"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}}
    (surface,) = read_glb(tmp_path, lamp, pictures=[png(np.zeros((2, 2, 3)))])
    assert "maps.emissiveTexture" in surface.original


def test_transparent_texels_do_not_count(tmp_path):
    leaf = np.zeros((1, 4, 4), np.uint8)
    leaf[0, 0], leaf[0, 1:] = [0, 255, 0, 255], [255, 0, 255, 10]
    pbr = {"baseColorTexture": {"index": 0}, "metallicFactor": 0.0}
    for mode, red in (("MASK", 0.0), ("OPAQUE", 0.75)):
        (found,) = read_glb(
            tmp_path, {"pbrMetallicRoughness": pbr, "alphaMode": mode}, answer=MEAN, pictures=[png(leaf)]
        )
        np.testing.assert_allclose(colour(found.parameters["diffuse"])[0], red, atol=2e-3)
    masked = {"pbrMetallicRoughness": pbr, "alphaMode": "MASK"}
    (found,) = read_glb(tmp_path, masked, answer=MEAN, pictures=[png(leaf)])
    assert "opacity 0.25" in found.provenance.notes


def test_mirror_is_held_and_said(tmp_path):
    (found,) = read_glb(tmp_path, {"pbrMetallicRoughness": {"roughnessFactor": 0.0}})
    assert found.parameters["alpha"] == 0.002 and "a mirror has no BRDF" in found.provenance.notes


def test_names_are_unique_and_survive_any_script(tmp_path):
    found = read_glb(tmp_path, {"name": "赤"}, {"name": "A"}, {"name": "a!"}, {"name": "\ud800\0"}, {})
    names = [material.id.partition("/")[2] for material in found]
    assert len(set(names)) == 5 and names[1:3] == ["a", "a-2"] and names[4] == "material-5"
    assert "赤" in found[0].provenance.source and found[0].original["gltf.name"] == "赤"
    found[3].provenance.source.encode("utf-8")
    assert "\0" not in found[3].provenance.source


def test_an_emission_takes_no_other_material_s_name(tmp_path):
    found = read_glb(tmp_path, {"name": "lamp", "emissiveFactor": [1, 1, 1]}, {"name": "lamp emission"})
    assert len({material.id for material in found}) == 3


def test_files_beside_a_gltf(tmp_path, rng):
    picture = png(rng.integers(0, 256, (4, 4, 3)))
    (tmp_path / "tex dir").mkdir()
    (tmp_path / "tex dir" / "wood.png").write_bytes(picture)
    (tmp_path / "shape.bin").write_bytes(b"\0" * 12)
    made, _ = document({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    made["images"], made["textures"] = [{"uri": "tex%20dir/wood.png"}], [{"source": 0}]
    made["buffers"] = [{"uri": "shape.bin", "byteLength": 12}]
    path = tmp_path / "chair.gltf"
    path.write_text(json.dumps(made))
    (chair,) = read(path)
    assert chair.original["maps.pbrMetallicRoughness.baseColorTexture"].tobytes() == picture
    assert set(gltf.companions(path)) == {tmp_path / "tex dir" / "wood.png", tmp_path / "shape.bin"}


def test_base64(tmp_path):
    made, _ = document({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0}})
    picture = base64.b64encode(png(np.full((2, 2, 3), 255))).decode()
    made["images"], made["textures"] = [{"uri": f"data:image/png;base64,{picture}"}], [{"source": 0}]
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(made))
    (found,) = read(path)
    np.testing.assert_allclose(found.parameters["diffuse"], 1.0, rtol=1e-4)
    assert picture[:20] not in found.original["gltf.textures"]


def test_recognised_by_content(tmp_path):
    assert gltf.recognises(tmp_path / "any.name", glb(*document(PAINT)))
    assert gltf.recognises(tmp_path / "any.name", b'\n{"asset": {"version": "2.0"}}')
    assert not gltf.recognises(tmp_path / "any.json", b'{"version": 3}')


REFUSED = {
    "an absolute path": ({"images": [{"uri": "/etc/passwd"}]}, "uri", "a file that is not fetched"),
    "a path that climbs": ({"images": [{"uri": "a/../../secret.png"}]}, "uri", "a file that is not fetched"),
    "one in disguise": ({"images": [{"uri": "%2e%2e/secret.png"}]}, "uri", "a file that is not fetched"),
    "backslashes": ({"images": [{"uri": "..\\secret.png"}]}, "uri", "a file that is not fetched"),
    "the network": ({"images": [{"uri": "https://example.org/a.png"}]}, "uri", "a file that is not fetched"),
    "a drive": ({"images": [{"uri": "C:/a.png"}]}, "uri", "a file that is not fetched"),
    "a file scheme": ({"images": [{"uri": "file:///etc/passwd"}]}, "uri", "a file that is not fetched"),
    "a missing picture": ({"images": [{"uri": "wood.png"}]}, "uri", "no such file"),
    "a picture beyond the list": ({"images": []}, "source", "not an index or a size"),
    "no picture at all": ({"images": [{"uri": "data:image/png;base64,"}]}, "baseColorTexture", "cannot be read"),
    "broken base64": ({"images": [{"uri": "data:image/png;base64,####"}]}, "uri", "not valid base64"),
}


@pytest.mark.parametrize(("changes", "field", "problem"), REFUSED.values(), ids=REFUSED)
def test_pictures_that_are_refused(tmp_path, changes, field, problem):
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    made, _ = document(material)
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(made | {"textures": [{"source": 0}]} | changes))
    (found,) = read(path)
    assert isinstance(found, Rejected), found
    said = found.reason
    assert said.file == path and field in said.field and problem in said.problem
    assert said.found and said.expected and said.hint


def test_a_link_out_of_the_folder_is_not_followed(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "secret.png").write_bytes(png(np.zeros((2, 2, 3))))
    (tmp_path / "in" / "a.png").symlink_to(tmp_path / "secret.png")
    made, _ = document({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    path = tmp_path / "in" / "a.gltf"
    path.write_text(json.dumps(made | {"images": [{"uri": "a.png"}], "textures": [{"source": 0}]}))
    (found,) = read(path)
    assert "leads out of the folder" in found.reason.problem


@pytest.mark.parametrize(
    ("material", "field"),
    [
        ({"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1]}}, "pbrMetallicRoughness.baseColorFactor"),
        ({"pbrMetallicRoughness": {"roughnessFactor": 1.5}}, "pbrMetallicRoughness.roughnessFactor"),
        ({"pbrMetallicRoughness": {"metallicFactor": "half"}}, "pbrMetallicRoughness.metallicFactor"),
        ({"pbrMetallicRoughness": {"metallicFactor": 10**400}}, "pbrMetallicRoughness.metallicFactor"),
        ({"pbrMetallicRoughness": []}, "pbrMetallicRoughness"),
        ({"alphaMode": "GLASS"}, "alphaMode"),
        ({"extensions": {"KHR_materials_ior": {"ior": 0.5}}}, "extensions.KHR_materials_ior.ior"),
        ({"name": 3}, "name"),
    ],
)
def test_one_bad_material_does_not_hold_up_the_others(tmp_path, material, field):
    bad, good = read_glb(tmp_path, material, PAINT)
    assert isinstance(bad, Rejected) and good.id == "show-room/red-paint"
    assert bad.reason.field == f"materials[0].{field}"
    assert bad.reason.found and bad.reason.expected and bad.reason.hint


def test_a_picture_bomb_is_not_opened(tmp_path):
    """A PNG that says it is 60000 x 60000."""
    picture = bytearray(png(np.zeros((2, 2, 3))))
    picture[16:24] = struct.pack(">II", 60000, 60000)
    picture[29:33] = struct.pack(">I", zlib.crc32(picture[12:29]))
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    (found,) = read_glb(tmp_path, material, pictures=[bytes(picture)])
    assert "too large a picture" in found.reason.problem


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_bytes_are_refused_in_words(tmp_path, data):
    """Whatever is overwritten or cut, a file gives materials, `Rejected` or `InputError`, and nothing else."""
    pbr = {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 1}}
    whole = glb(*document({"pbrMetallicRoughness": pbr}, pictures=[png(np.eye(4) * 255), png(np.zeros((3, 3, 3)))]))
    raw = bytearray(whole)
    for _ in range(data.draw(st.integers(1, 6))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path / "a.glb"
    path.write_bytes(raw[: data.draw(st.sampled_from([len(raw), len(raw), data.draw(st.integers(0, len(raw)))]))])
    try:
        found = read(path)
        list(gltf.companions(path))
    except InputError as reason:
        assert reason.file == path and reason.hint
        return
    assert all(isinstance(each, Rejected) or rebuild(each.model, each.parameters) for each in found)


def test_the_shader_ball(shared_data):
    (found,) = read(shared_data / "meshes" / "shaderball.glb")
    assert found.id == "shaderball/defaultmaterial" and found.model == "metallic_roughness"
    np.testing.assert_allclose(colour(found.parameters["diffuse"]), 0.6, atol=1e-4)
