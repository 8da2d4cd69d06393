"""Maps of glTF materials, drawn texel by texel: where they lie on the mesh, masks, bumps and stretched highlights."""

import json

import numpy as np
import pytest
from metamer.materials.core.points import Points
from metamer.materials.formats import gltf
from metamer.materials.records.models import rebuild
from metamer.materials.records.source import Rejected
from metamer.spectral.formats.import_options import NO_ANSWER, ImportOptions
from metamer.spectral.srgb import srgb_to_linear
from PIL import Image

RNG = np.random.default_rng(3)
BASE = RNG.integers(0, 256, (4, 6, 4)).astype(np.uint8)
PACKED = RNG.integers(0, 256, (4, 6, 3)).astype(np.uint8)
FULL = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 1}}}
APART = {"index": 1, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}}
UP = np.array([[0.0, 0.0, 1.0]])


def read(tmp_path, material, pictures=(BASE, PACKED), answer=NO_ANSWER, **rest):
    for number, picture in enumerate(pictures):
        Image.fromarray(np.asarray(picture, np.uint8)).save(tmp_path / f"{number}.png")
    document = {
        "asset": {"version": "2.0"},
        "materials": [material],
        "textures": [{"source": number, "sampler": 0} for number in range(len(pictures))],
        "samplers": [{}],
        "images": [{"uri": f"{number}.png"} for number in range(len(pictures))],
        **rest,
    }
    path = tmp_path / "room.gltf"
    path.write_text(json.dumps(document))
    found = next(iter(gltf.read_sources(path, "mallett-yuksel", answer)))
    assert not isinstance(found, Rejected), found
    return found


def drawn(tmp_path, material, *pictures, **rest):
    found = read(tmp_path, material, *pictures, **rest)
    assert found.model == "maps", found.provenance.notes
    return rebuild(found.model, found.parameters)


def placed(transform=None, **more):
    """The full material, whose textures have a transform and whatever else."""
    info = more | ({"extensions": {"KHR_texture_transform": transform}} if transform else {})
    textures = FULL["pbrMetallicRoughness"].items()
    return {"pbrMetallicRoughness": {name: value | info for name, value in textures}}


def test_colour_metal_and_roughness_of_each_texel(tmp_path):
    pbr = FULL["pbrMetallicRoughness"] | {"baseColorFactor": [0.5, 1.0, 0.25, 1.0], "roughnessFactor": 0.5}
    surface = drawn(tmp_path, {"pbrMetallicRoughness": pbr})
    row, column = np.divmod(np.arange(24), 6)
    texels = surface.texels(row, column)
    metal = PACKED[row, column, 2:] / 255.0
    base = srgb_to_linear(BASE[row, column, :3] / 255.0) * (0.5, 1.0, 0.25)
    np.testing.assert_allclose(texels.body, base * (1 - metal))
    np.testing.assert_allclose(texels.facets, base * metal + 0.04 * (1 - metal))
    np.testing.assert_allclose(texels.spread[:, 0], np.maximum((0.5 * PACKED[row, column, 1] / 255) ** 2, 0.002) ** 2)


def test_v_grows_downwards_in_the_file_and_upwards_here(tmp_path):
    """The middle of the picture's first texel is at v = 1 - 1/8 of the mesh."""
    surface = drawn(tmp_path, FULL)
    at = surface.at(Points(UP, UP, np.array([[0.5 / 6, 1 - 0.5 / 4]])))
    alone = drawn(tmp_path, FULL, (BASE[:1, :2] * [[[1]], [[1]]][0], PACKED[:1, :2]))
    np.testing.assert_allclose(at, alone.at(Points(UP, UP, np.array([[0.25, 0.5]]))), rtol=1e-9)


def test_texture_transforms_scale_and_move(tmp_path):
    """uv' = offset + scale uv, in the file's coordinates."""
    plain = drawn(tmp_path, FULL)
    moved = drawn(tmp_path, placed({"scale": [2.0, 3.0], "offset": [0.1, 0.2]}))
    uv = RNG.uniform(-1, 2, (50, 2))
    up = np.repeat(UP, 50, axis=0)
    there = np.stack([0.1 + 2.0 * uv[:, 0], 1 - (0.2 + 3.0 * (1 - uv[:, 1]))], axis=1)
    np.testing.assert_allclose(moved.at(Points(up, up, uv)), plain.at(Points(up, up, there)), rtol=1e-7)


def test_samplers_say_how_a_texture_goes_on(tmp_path):
    samplers = [{"wrapS": 33071, "wrapT": 33648}]
    assert drawn(tmp_path, FULL, samplers=samplers).placement.wrap == ("clamp", "mirror")
    assert drawn(tmp_path, FULL).placement.wrap == ("repeat", "repeat")
    path = tmp_path / "room.gltf"
    path.write_text(path.read_text().replace('"samplers": [{}]', '"samplers": [{"wrapS": 7}]'))
    (refused,) = gltf.read_sources(path, "mallett-yuksel")
    assert isinstance(refused, Rejected) and "samplers[0].wrapS" in str(refused.reason)


@pytest.mark.parametrize(
    ("material", "why"),
    [
        (placed(texCoord=1), "another set"),
        (placed({"texCoord": 2}), "another set"),
        (placed({"rotation": 0.3}), "rotated"),
        (
            FULL | {"normalTexture": {"index": 1, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}}},
            "lie apart",
        ),
        (
            FULL | {"extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatTexture": APART}}},
            "apart",
        ),
    ],
)
def test_what_is_not_drawn_by_texels_is_drawn_by_its_mean_and_says_so(tmp_path, material, why):
    found = read(tmp_path, material)
    assert found.model == "metallic_roughness" and "the mean of the maps" in found.provenance.notes
    assert "not drawn texel by texel" in found.provenance.notes and why in found.provenance.notes
    mean = read(tmp_path, material, answer=ImportOptions(maps="mean"))
    assert "not drawn texel by texel" not in mean.provenance.notes
    np.testing.assert_array_equal(mean.parameters["diffuse"], found.parameters["diffuse"])


def test_bumps_are_opengls_and_scaled(tmp_path):
    normal = np.tile(np.array([128, 128, 255], np.uint8), (4, 6, 1))
    normal[1, 2] = 200, 240, 200
    found = read(tmp_path, FULL | {"normalTexture": {"index": 2, "scale": 0.5}}, (BASE, PACKED, normal))
    lean = rebuild(found.model, found.parameters).texels(np.array([1]), np.array([2])).normal[0]
    expected = (np.array([200, 240, 200]) / 127.5 - 1) * (0.5, 0.5, 1.0)
    np.testing.assert_allclose(lean, (expected / np.linalg.norm(expected))[:2])
    assert "bumps" not in found.provenance.notes


def test_masks_cut_and_blends_do_not(tmp_path):
    surface = drawn(tmp_path, FULL | {"alphaMode": "MASK", "alphaCutoff": 0.4})
    row, column = np.divmod(np.arange(24), 6)
    uv = np.stack([(column + 0.5) / 6, 1 - (row + 0.5) / 4], axis=1)
    up = np.repeat(UP, 24, axis=0)
    there = surface.at(Points(up, up, uv)).any(axis=1)
    np.testing.assert_array_equal(there, BASE[row, column, 3] / 255.0 >= 0.4)
    blended = read(tmp_path, FULL | {"alphaMode": "BLEND"})
    assert "rendered opaque" in blended.provenance.notes
    assert rebuild(blended.model, blended.parameters).at(Points(up, up, uv)).any(axis=1).all()


def test_a_blend_of_nothing_but_0_and_1_is_a_mask(tmp_path):
    """As exporters write cut-outs; what is opaque has no holes, whatever its alpha."""
    base = BASE.copy()
    base[..., 3] = 255 * (RNG.uniform(size=(4, 6)) > 0.5)
    found = read(tmp_path, FULL | {"alphaMode": "BLEND"}, (base, PACKED))
    surface = rebuild(found.model, found.parameters)
    assert surface.cutoff == 0.5 and surface.cutout is not None and "so that it is a mask" in found.provenance.notes
    opaque = drawn(tmp_path, FULL, (base, PACKED))
    assert opaque.cutout is None and "mask" not in read(tmp_path, FULL, (base, PACKED)).provenance.notes
    faint = FULL["pbrMetallicRoughness"] | {"baseColorFactor": [1.0, 1.0, 1.0, 0.5]}
    half = read(tmp_path, {"pbrMetallicRoughness": faint, "alphaMode": "BLEND"}, (base, PACKED))
    assert "rendered opaque" in half.provenance.notes


def test_highlights_are_stretched_along_their_direction(tmp_path):
    stretch = {"anisotropyStrength": 0.8, "anisotropyRotation": 0.5, "anisotropyTexture": {"index": 2}}
    direction = np.tile(np.array([255, 128, 255], np.uint8), (4, 6, 1))
    direction[2, 3] = 128, 255, 128
    found = read(tmp_path, FULL | {"extensions": {"KHR_materials_anisotropy": stretch}}, (BASE, PACKED, direction))
    assert "stretched" not in found.provenance.notes
    surface = rebuild(found.model, found.parameters)
    a, b, c = surface.texels(np.array([2]), np.array([3])).spread[0]
    alpha = max((PACKED[2, 3, 1] / 255.0) ** 2, 0.002)
    along = alpha + (1 - alpha) * (0.8 * 128 / 255) ** 2
    np.testing.assert_allclose(a + c, along**2 + alpha**2, rtol=1e-5)
    np.testing.assert_allclose(0.5 * np.arctan2(2 * b, a - c), np.pi / 2 + 0.5 - np.pi, atol=0.01)


def test_a_clear_coat_of_each_texel(tmp_path):
    """Its weight is in red, its roughness in green; its bumps are its own, and the mesh's where it has none."""
    coat = {"clearcoatFactor": 0.5, "clearcoatTexture": {"index": 2}, "clearcoatRoughnessTexture": {"index": 2}}
    coat |= {"clearcoatRoughnessFactor": 0.8}
    picture = RNG.integers(60, 256, (4, 6, 3)).astype(np.uint8)
    normal = np.tile(np.array([128, 128, 255], np.uint8), (4, 6, 1))
    normal[1, 2] = 200, 240, 200
    lean = normal[1, 2] / 127.5 - 1
    bumpy = FULL | {"normalTexture": {"index": 3}}
    for words, expected in ((coat, np.zeros(2)), (coat | {"clearcoatNormalTexture": {"index": 3}}, lean[:2])):
        material = bumpy | {"extensions": {"KHR_materials_clearcoat": words}}
        found = read(tmp_path, material, (BASE, PACKED, picture, normal))
        assert "clear" not in found.provenance.notes
        texels = rebuild(found.model, found.parameters).texels(np.array([1]), np.array([2]))
        np.testing.assert_allclose(texels.coat, 0.5 * picture[1, 2, 0] / 255)
        np.testing.assert_allclose(texels.coat_spread, (0.8 * picture[1, 2, 1] / 255) ** 4)
        np.testing.assert_allclose(texels.coat_normal[0] * np.linalg.norm(lean), expected, atol=1e-9)
    mean = read(tmp_path, material, (BASE, PACKED, picture, normal), ImportOptions(maps="mean"))
    assert "bumps of the clear coat" in mean.provenance.notes
    bare = bumpy | {"extensions": {"KHR_materials_clearcoat": coat | {"clearcoatFactor": 0.0}}}
    without = read(tmp_path, bare, (BASE, PACKED, picture, normal))
    assert not rebuild(without.model, without.parameters).coated


def test_maps_of_different_sizes_are_brought_to_one(tmp_path):
    small = PACKED[:2, :3]
    found = read(tmp_path, FULL, (BASE, small))
    assert "maps of different sizes (6 x 4, 3 x 2) were brought to 6 x 4" in found.provenance.notes
    rough = rebuild(found.model, found.parameters).roughness
    assert rough.size == (4, 6)
    inside = rough.decoded(rough.values)[1, 1, 0] * 255
    weights = np.array([[9, 3], [3, 1]]) / 16
    np.testing.assert_allclose(inside, (weights * small[:2, :2, 1]).sum(), rtol=1e-5)


def test_specular_and_glossiness_of_each_texel(tmp_path):
    gloss = {"diffuseTexture": {"index": 0}, "specularGlossinessTexture": {"index": 1}}
    packed = RNG.integers(0, 256, (4, 6, 4)).astype(np.uint8)
    surface = drawn(tmp_path, {"extensions": {"KHR_materials_pbrSpecularGlossiness": gloss}}, (BASE, packed))
    texels = surface.texels(np.array([1]), np.array([4]))
    shine = srgb_to_linear(packed[1, 4, :3] / 255.0)
    np.testing.assert_allclose(texels.facets[0], shine)
    np.testing.assert_allclose(texels.body[0], srgb_to_linear(BASE[1, 4, :3] / 255.0) * (1 - shine.max()))
    np.testing.assert_allclose(texels.spread[0, 0], max((1 - packed[1, 4, 3] / 255.0) ** 2, 0.002) ** 2)


def test_an_unlit_texture_is_matt(tmp_path):
    surface = drawn(tmp_path, FULL | {"extensions": {"KHR_materials_unlit": {}}})
    points = Points(UP, UP, np.array([[0.5 / 6, 1 - 0.5 / 4]]))
    expected = surface.spectra(srgb_to_linear(BASE[:1, 0, :3] / 255.0)) / np.pi
    np.testing.assert_allclose(surface.at(points), expected, rtol=1e-9)
