"""glTF files that are written: read again they are the same material, and what they cannot say is said."""

import json
from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.mesh.files import load_mesh
from metamer.materials.analytic import CookTorrance, Lambert, MetallicRoughness
from metamer.materials.core.points import Points
from metamer.materials.core.protocol import sphere_protocol
from metamer.materials.export.files import export
from metamer.materials.formats import gltf
from metamer.materials.formats.gltf_container import open_gltf
from metamer.materials.records.material import MaterialRecord, Provenance
from metamer.materials.records.models import rebuild
from metamer.materials.records.source import Rejected
from metamer.materials.svbrdf.map_set import Placement
from metamer.materials.svbrdf.maps import MappedSurface
from metamer.materials.svbrdf.texel_map import TexelMap
from metamer.materials.svbrdf.texture import SpectralTexture
from metamer.runtime.errors import InputError
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM

RNG = np.random.default_rng(4)
SAID = Provenance("a test", "CC BY 4.0", "uplifted(mallett-yuksel)", notes="kept in the record and not rendered: ao")
PLACE = Placement((2.0, 3.0), (0.1, -0.3), ("mirror", "clamp"))
ALIKE = TexelMap.constant


def picture(channels, low=0, high=256, bits=8):
    codes = RNG.integers(low << (bits - 8), high << (bits - 8), (4, 6, channels))
    return codes.astype(np.uint8 if bits == 8 else np.uint16)


BASE = TexelMap(picture(3), True, (0.5, 1.0, 0.25))


def surface_of(**others):
    given = {"base": BASE, "roughness": TexelMap(picture(1, 90)), "uplift": "mallett-yuksel", "placement": PLACE}
    return MappedSurface(WORKING_WAVELENGTHS_NM, **(given | others))


def record(surface, name="maps/tiles", said=SAID, **original):
    parameters = dict(surface.parameters()) | {"wavelengths_nm": surface.wavelengths_nm}
    return MaterialRecord(name, name.split("/")[0], surface.NAME, parameters, said, None, "", original)


def exported(tmp_path, surface, name="x.glb", **original):
    (done,) = export([record(surface, **original)], "gltf", tmp_path / name)
    return done.path, " ".join(done.notes)


def back(path):
    (source,) = gltf.read_sources(path, "mallett-yuksel")
    assert not isinstance(source, Rejected), source
    return rebuild(source.model, source.parameters)


def off(one, other):
    """ΔE94 of two surfaces on the sphere, whose points lie all over the texture."""
    sphere = sphere_protocol(32, False)
    (shown,), (again,) = (sphere.references(each, ("D65",)) for each in (one, other))
    return sphere.differences(shown, again)


def bumps(sign):
    return TexelMap(
        picture(3, 100, 156) | np.array([0, 0, 128], np.uint8), False, (1.6, sign * 1.6, 2.0), (-0.8, -sign * 0.8, -1.0)
    )


LEANING = TexelMap(RNG.normal([0, 0, 1], [0.2, 0.2, 0.01], (4, 6, 3)).astype(np.float32))
MASK = TexelMap((RNG.uniform(size=(4, 6, 1)) > 0.3).astype(np.uint8) * np.uint8(255))
TURN = TexelMap(RNG.uniform(-3, 3, (4, 6, 1)).astype(np.float32))
CASES = {
    "as it came": ({"metallic": TexelMap(picture(1)), "normal": bumps(1)}, 1e-7),
    "DirectX": ({"normal": bumps(-1)}, 1e-7),
    "gloss": ({"roughness": TexelMap(picture(1, 0, 150), False, (-1.0,), (1.0,))}, 1e-7),
    "16 bits beside 8": ({"roughness": TexelMap(picture(1, 90, bits=16)), "metallic": TexelMap(picture(1))}, 1e-7),
    "a mask": ({"coverage": MASK, "cutoff": 0.4}, 1e-7),
    "one colour with a mask": ({"base": ALIKE(0.2, 0.3, 0.4), "coverage": MASK, "cutoff": 0.4}, 1e-7),
    "floats": ({"base": TexelMap(RNG.uniform(size=(4, 6, 3))), "normal": LEANING}, 1e-4),
    "other facets": ({"reflected": ALIKE(0.1, 0.05, 0.02), "weight": TexelMap(picture(1))}, 1e-7),
    "facets of many colours": ({"reflected": TexelMap(RNG.uniform(0.02, 0.9, (4, 6, 3)))}, 1e-4),
    "stretched": ({"roughness": TexelMap(RNG.uniform(0.4, 0.8, (4, 6, 2))), "turn": TURN}, 5e-4),
    "stretched alike": ({"roughness": ALIKE(0.4, 0.7), "turn": ALIKE(0.3)}, 1e-7),
    "glossy": ({"glossy": True, "reflected": TexelMap(RNG.uniform(0.02, 0.9, (4, 6, 3)))}, 1e-4),
    "a coat": ({"coat": ALIKE(0.6), "coat_roughness": ALIKE(0.2)}, 1e-7),
    "a coat with maps": ({"coat": TexelMap(picture(1)), "coat_roughness": TexelMap(picture(1, 60))}, 1e-7),
    "bumps of the coat alone": ({"coat": ALIKE(1.0), "coat_normal": LEANING, "coat_roughness": ALIKE(0.3)}, 1e-4),
    "alike everywhere but bumps": ({"base": ALIKE(0.2, 0.3, 0.4), "roughness": ALIKE(0.5), "normal": LEANING}, 1e-4),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("suffix", ["glb", "gltf"])
def test_what_is_read_again_is_the_same_surface(tmp_path, name, suffix):
    others, within = CASES[name]
    surface = surface_of(**others)
    path, _ = exported(tmp_path, surface, f"x.{suffix}")
    found = back(path)
    at = np.divmod(np.arange(24), 6) if surface.size != (1, 1) else (np.zeros(1, int), np.zeros(1, int))
    one, other = surface.texels(*at), found.texels(*(at if found.size != (1, 1) else np.zeros((2, len(at[0])), int)))
    for field in ("body", "facets", "through", "rest", "edge", "normal", "spread"):
        if field == "body" or not name.startswith("glossy") or field != "through":
            mine, theirs = getattr(one, field), getattr(other, field)
            if field == "body":
                mine, theirs = mine * one.through[:, None], theirs * other.through[:, None]
            np.testing.assert_allclose(theirs, np.broadcast_to(mine, theirs.shape), atol=within, err_msg=field)
    for field in ("coat", "coat_spread", "coat_normal") if surface.coated else ():
        np.testing.assert_allclose(getattr(other, field), getattr(one, field), atol=within, err_msg=field)
    there = [each.covers >= cut for each, cut in ((one, surface.cutoff), (other, found.cutoff))]
    np.testing.assert_array_equal(*there)
    assert found.placement.wrap == PLACE.wrap
    np.testing.assert_allclose((found.placement.scale, found.placement.offset), (PLACE.scale, PLACE.offset), atol=1e-12)


@pytest.mark.parametrize("name", CASES)
def test_pictures_of_what_is_read_again_are_the_same(tmp_path, name):
    surface = surface_of(**CASES[name][0])
    path, _ = exported(tmp_path, surface)
    assert off(surface, back(path)).max() < 0.05


def test_measured_colours_become_those_that_d65_shows(tmp_path):
    nm = np.arange(400.0, 701.0, 10.0)
    values = RNG.uniform(0.1, 0.4, (4, 6, 1)) * (1.0 + 0.3 * np.sin(nm / 60.0 + RNG.uniform(0, 3, (4, 6, 1))))
    for surface in (
        MappedSurface(nm, TexelMap(values), ALIKE(0.5), ""),
        SpectralTexture(nm, values.astype(np.float32)),
    ):
        path, notes = exported(tmp_path, surface, f"{surface.NAME}.glb")
        assert "reduced to linear sRGB under D65" in notes and off(surface, back(path)).max() < 0.1
        (material,) = open_gltf(path).root.children("materials")
        assert "reduced" in material.values["extras"]["metamer"]["export"]


def test_a_colour_outside_srgb_is_clipped_and_counted(tmp_path):
    green = np.exp(-(((WORKING_WAVELENGTHS_NM - 520.0) / 12.0) ** 2))
    values = np.stack([np.full(81, 0.5), green])[None]
    _, notes = exported(tmp_path, SpectralTexture(WORKING_WAVELENGTHS_NM, values))
    assert "1 of 2 colours lie outside sRGB and are clipped" in notes


def uniform():
    nm = WORKING_WAVELENGTHS_NM
    red = Spectrum.sampled(nm, np.interp(nm, [500, 600], [0.1, 0.6]))
    black, low = (Spectrum.sampled(nm, np.full(81, number)) for number in (0.0, 0.06))
    return {
        "matt": Lambert(red),
        "plastic": MetallicRoughness(red, low, 1.0, 0.2),
        "metal": MetallicRoughness(black, red, 1.0, 0.3),
        "half of the facets, coated": MetallicRoughness(red, low, 0.5, 0.3, 0.8, 0.1),
    }


@pytest.mark.parametrize("name", uniform())
def test_uniform_surfaces_are_numbers(tmp_path, name):
    surface = uniform()[name]
    path, notes = exported(tmp_path, surface)
    assert off(surface, back(path)).max() < 0.05 and "reduced" in notes
    assert not open_gltf(path).root.children("images")


def test_what_gltf_has_no_words_for_is_refused(tmp_path):
    other = CookTorrance.examples(WORKING_WAVELENGTHS_NM)[0]
    with pytest.raises(InputError, match="no words") as refused:
        exported(tmp_path, other)
    assert "mitsuba" in str(refused.value) and "maps/tiles" in str(refused.value)
    loud = surface_of(base=TexelMap(np.full((4, 6, 3), 1.2)))
    with pytest.raises(InputError, match=r"1\.2"):
        exported(tmp_path, loud)
    assert not list(tmp_path.iterdir())


def test_what_is_lost_is_said(tmp_path):
    surface = surface_of()
    assert "not rendered: ao" in exported(tmp_path, surface)[1]
    kept = {"uplift.method": "smits"}
    assert "--uplift smits" in exported(tmp_path, replace(surface, uplift="smits"), "s.glb", **kept)[1]
    mean = {"maps.albedo": np.zeros(3, np.uint8)}
    assert "their mean" in exported(tmp_path, uniform()["plastic"], "m.glb", **mean)[1]


def test_several_materials_are_one_file_with_a_sphere_each(tmp_path):
    records = [record(surface_of(), "maps/tiles"), record(uniform()["matt"], "paint/red", replace(SAID, licence="CC0"))]
    (done,) = export(records, "gltf", tmp_path / "both.glb")
    first, second = gltf.read_sources(done.path, "mallett-yuksel")
    assert (first.id, second.id) == ("both/maps-tiles", "both/paint-red")
    assert first.provenance.licence == "CC BY 4.0; CC0"
    mesh = load_mesh(done.path)
    assert len(mesh.part_names) == 2 and mesh.uv is not None
    # The note is on the tiles, which are repeated.
    assert [note.partition(":")[0] for note in mesh.notes] == ["material maps/tiles"]
    assert "KHR_texture_transform" in mesh.notes[0]
    # Outwards, u to the right and v upwards as seen from in front.
    for part, middle in zip(("maps/tiles", "paint/red"), (0.0, 2.5), strict=True):
        one = load_mesh(done.path, mesh_part=part)
        local = one.vertices - (middle, 0.0, 0.0)
        np.testing.assert_allclose(one.normals, local, atol=1e-6)
        a, b, c = (local[one.faces[:, corner]] for corner in range(3))
        assert (np.einsum("ni,ni->n", np.cross(b - a, c - a), a + b + c) > 0).all()
        front = local[:, 2] > 0.7
        assert np.corrcoef(local[front, 0], one.uv[front, 0])[0, 1] > 0.9
        assert np.corrcoef(local[front, 1], one.uv[front, 1])[0, 1] > 0.9


def test_the_text_form_holds_no_bytes_that_are_not_text(tmp_path):
    path, _ = exported(tmp_path, surface_of(), "x.gltf")
    document = json.loads(path.read_text())
    assert document["buffers"][0]["uri"].startswith("data:") and "KHR_texture_transform" in document["extensionsUsed"]


def test_points_between_texels_are_the_same_too(tmp_path):
    surface = surface_of(normal=bumps(1))
    found = back(exported(tmp_path, surface)[0])
    wi, wo = np.tile([[0.6, 0.0, 0.8]], (50, 1)), np.tile([[0.0, -0.6, 0.8]], (50, 1))
    points = Points(wi, wo, RNG.uniform(-1, 2, (50, 2)))
    np.testing.assert_allclose(found.at(points), surface.at(points), rtol=1e-6, atol=1e-9)
