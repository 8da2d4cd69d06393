"""Mitsuba scenes of surfaces of maps: what each picture holds, where it lies, and what is said of it."""

from xml.etree import ElementTree

import numpy as np
import pytest
from metamer.materials.export.files import export
from metamer.materials.formats.mitsuba_maps import write_mitsuba_maps
from metamer.materials.records.material import MaterialRecord, Provenance
from metamer.materials.svbrdf.map_set import Placement
from metamer.materials.svbrdf.maps import MappedSurface
from metamer.materials.svbrdf.texel_map import TexelMap
from metamer.materials.svbrdf.texels import look_up
from metamer.spectral.formats.exr import read_picture
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM

pytestmark = pytest.mark.mitsuba

RNG = np.random.default_rng(0)
BASE = TexelMap(RNG.integers(0, 256, (3, 4, 3)).astype(np.uint8), srgb=True)
PLACE = Placement((2.0, 3.0), (0.1, -0.3), ("mirror", "mirror"))


def surface_of(**others):
    given = {"base": BASE, "roughness": TexelMap.constant(0.4), "uplift": "mallett-yuksel", "placement": PLACE} | others
    return MappedSurface(WORKING_WAVELENGTHS_NM, **given)


def picture(path):
    channels = read_picture(path, 1000).channels
    return np.stack([channels[name] for name in ("RGB" if "R" in channels else "Y")], axis=-1)


def test_every_map_is_a_picture(tmp_path):
    normal = TexelMap(np.tile(np.array([0.6, 0.0, 0.8]), (3, 4, 1)))
    mask = TexelMap(RNG.integers(0, 2, (3, 4, 1)).astype(np.uint8) * np.uint8(255))
    metal = TexelMap(RNG.integers(0, 256, (3, 4, 1)).astype(np.uint8))
    surface = surface_of(normal=normal, coverage=mask, cutoff=0.5, metallic=metal)
    notes = " ".join(write_mitsuba_maps(tmp_path, surface))
    assert "not the same" in notes and "cut out" in notes
    for name, one in (("base_color", BASE), ("metallic", metal), ("opacity", mask)):
        np.testing.assert_allclose(picture(tmp_path / f"{name}.exr"), one.decoded(one.values), atol=1e-6)
    np.testing.assert_allclose(picture(tmp_path / "normalmap.exr")[0, 0], [0.8, 0.5, 0.9], atol=1e-6)
    kinds = [each.get("type") for each in ElementTree.parse(tmp_path / "scene.xml").getroot().iter("bsdf")]
    assert kinds == ["mask", "normalmap", "principled"]


def test_a_matt_surface_is_diffuse_alone(tmp_path):
    notes = write_mitsuba_maps(tmp_path, surface_of(weight=TexelMap.constant(0.0)))
    (bsdf,) = ElementTree.parse(tmp_path / "scene.xml").getroot().iter("bsdf")
    assert bsdf.get("type") == "diffuse" and len(notes) == 1


def test_the_catalogue_exports_it_with_its_maps(tmp_path):
    surface = surface_of(roughness=TexelMap(RNG.uniform(0.2, 0.9, (3, 4, 2))), reflected=TexelMap.constant(0.1))
    said = Provenance("a test", "none", "uplifted(mallett-yuksel)")
    record = MaterialRecord("maps/tiles", "maps", "maps", surface.parameters(), said, None)
    (done,) = export([record], "mitsuba", tmp_path / "tiles")
    assert "not stretched" in " ".join(done.notes) and "4 %" in " ".join(done.notes)
    assert {file.name for file in done.path.iterdir()} == {"scene.xml", "base_color.exr", "roughness.exr"}


def test_mitsuba_finds_every_texel_where_it_is(tmp_path):
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    surface = surface_of(weight=TexelMap.constant(0.0))
    write_mitsuba_maps(tmp_path, surface)
    scene = mi.load_file(str(tmp_path / "scene.xml"))
    matt = scene.shapes()[0].bsdf()
    for uv in RNG.uniform(size=(20, 2)):
        at = mi.SurfaceInteraction3f()
        # Mitsuba's v grows downwards.
        at.uv, at.wi = mi.Point2f(uv[0], 1.0 - uv[1]), mi.Vector3f(0, 0, 1)
        found = np.array(matt.eval(mi.BSDFContext(), at, mi.Vector3f(0, 0, 1))) * np.pi
        expected = look_up(BASE.decoded(BASE.values), PLACE.of(uv[None]), PLACE.wrap)[0]
        np.testing.assert_allclose(found, expected, atol=1e-4)
