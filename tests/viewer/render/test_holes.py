"""Holes of masks: what stands behind is seen through them, and light comes through: both renderers, and the truth."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.environment import latlong
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.mesh import shapes
from metamer.lighting.reference.geometry import Tracer, visible_geometry
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.visibility import refinement
from metamer.materials.svbrdf.map_set import Placement
from metamer.materials.svbrdf.maps import MappedSurface
from metamer.materials.svbrdf.texel_map import TexelMap
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM

ALIKE = TexelMap.constant


def net(**others):
    """Green threads, a quarter of all texels, in a picture that lies twice across and three times down."""
    rows, columns = np.mgrid[0:16, 0:16]
    there = ((rows // 4 % 2 == 0) | (columns // 4 % 2 == 0)).astype(np.uint8) * np.uint8(255)
    given = {"coverage": TexelMap(there[..., None]), "cutoff": 0.5}
    given["placement"] = Placement((2.0, 3.0), (0.13, 0.21), ("repeat", "repeat"))
    return MappedSurface(WORKING_WAVELENGTHS_NM, ALIKE(0.1, 0.6, 0.1), ALIKE(0.5), "mallett-yuksel", **(given | others))


RED = MappedSurface(WORKING_WAVELENGTHS_NM, ALIKE(0.7, 0.1, 0.05), ALIKE(0.6), "mallett-yuksel")
SURFACES = {"net": net(), "wall": RED}
FORMS = {name: surface.own_form(1e-3) for name, surface in SURFACES.items()}


def scene_of(scenes, lights, size=40, samples=2, near=2.6):
    """A net before a wall, and a ball of net."""
    up = shapes.plane(1.6, 1.6)
    parts = [
        (up.placed(rotate_deg=(90, 0, 0), translate=(0, 0, 0.5)), "net"),
        (shapes.plane(3.0, 3.0).placed(rotate_deg=(90, 0, 0), translate=(0, 0, -0.3)), "wall"),
        (shapes.sphere(3, uv=True).placed(scale=0.35, translate=(0.5, -0.4, 0.9)), "net"),
    ]
    eye = near * np.array([0.3, 0.25, 1.0])
    camera = Camera("c", eye, (0, 0, 0), vertical_fov_deg=45.0, width=size, height_px=size, samples=samples)
    return scenes.scene_of(parts, lights, camera)


def differences(scene, shown, truth):
    (xyz, coverage), reference = shown, truth.xyz[0]
    np.testing.assert_array_equal(coverage, truth.coverage.astype(np.float32))
    seen = coverage == 1.0
    return delta_e_xyz(reference[seen], xyz[seen].astype(float), scene.adopted_white())


@pytest.mark.parametrize("cut", [True, False], ids=["seen through", "seen past"])
def test_pictures_with_holes_are_the_reference(scenes, make_session, cut):
    scene = scene_of(scenes, [scenes.sun(), scenes.lamp()])
    surfaces = SURFACES if cut else {**SURFACES, "net": net(coverage=ALIKE(1.0))}
    forms = {name: surface.own_form(1e-3) for name, surface in surfaces.items()}
    truth = reference_images(scene, None, surfaces)
    with make_session() as renderer:
        off = differences(scene, renderer.render(scene, None, forms), truth)
    assert len(off) > 500 and np.median(off) < 0.02 and np.percentile(off, 99) < 0.5


def test_through_holes_is_seen_what_stands_behind(scenes, make_session):
    """Where the net is not, the picture is that of a scene without it, but for its shadows."""
    scene = scene_of(scenes, [scenes.sun()], samples=1)
    bare = replace(scene, parts=scene.parts[1:2])
    geometry = visible_geometry(scene.cut(SURFACES), with_uv=True)
    behind = np.zeros(scene.camera().width * scene.camera().height_px, dtype=bool)
    behind[geometry.pixel[geometry.part == 1]] = True
    with make_session() as renderer:
        xyz, coverage = renderer.render(scene, None, FORMS)
        alone, _ = renderer.render(bare, None, FORMS)
    whole = (coverage == 1.0).ravel() & behind
    same = np.abs(xyz - alone).reshape(-1, 3)[whole].max(axis=1) < 1e-4
    shaded = xyz.reshape(-1, 3)[whole].max(axis=1) == 0.0
    assert whole.sum() > 300 and (same | shaded).all() and same.sum() > 150 and shaded.sum() > 50


@pytest.mark.parametrize("filtering", ["linear", "mipmapped"])
def test_gl_equals_numpy(scenes, drawn_by_both, filtering):
    for near in (2.6, 9.0):
        scene = scene_of(scenes, [scenes.sun(), scenes.lamp()], near=near)
        assert drawn_by_both(scene, FORMS, filtering).off.max() < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("filtering", ["linear", "mipmapped"])
def test_gl_equals_numpy_in_light_from_all_around(scenes, drawn_by_both, filtering, monkeypatch):
    monkeypatch.setattr(refinement, "MOST_VERTICES", 200)
    to = latlong.texel_directions(16, 32)
    sky = EnvironmentLight((1.0 + 0.5 * np.sin(3.0 * to[..., 0]) + 0.5 * to[..., 1])[None], (illuminant("D65"),))
    scene = scene_of(scenes, [sky], size=16, samples=1)
    both = drawn_by_both(scene, FORMS, filtering)
    seen = both.coverage > 0.0
    assert both.off[seen].max() < 0.1 and np.median(both.mine[seen]) > 0.1


def test_from_afar_threads_are_what_is_there_and_holes_what_is_behind(scenes, make_session):
    """Threads far thinner than a sample: their colour is not mixed with black."""
    thin = net(placement=Placement((40.0, 40.0), (0.0, 0.0), ("repeat", "repeat")))
    scene, forms = scene_of(scenes, [scenes.sun()], samples=4), {**FORMS, "net": thin.own_form(1e-3)}
    truth = reference_images(scene, None, {**SURFACES, "net": thin})
    with make_session("mipmapped") as renderer:
        xyz, coverage = renderer.render(scene, None, forms)
    seen = (coverage == 1.0) & (truth.coverage == 1.0)
    off = delta_e_xyz(truth.xyz[0][seen], xyz[seen].astype(float), scene.adopted_white())
    assert np.median(off) < 0.5


def test_rays_go_on_through_many_holes(scenes):
    """Ten nets one behind the other, and at last the wall."""
    parts = [(shapes.plane(1.6, 1.6).placed(rotate_deg=(90, 0, 0), translate=(0, 0, z)), "net") for z in range(10)]
    parts.append((shapes.plane(9.0, 9.0).placed(rotate_deg=(90, 0, 0), translate=(0, 0, -1.0)), "wall"))
    scene = scenes.scene_of(parts, [scenes.sun()], scenes.sphere_scene().camera()).cut(SURFACES)
    x, y = np.meshgrid(np.linspace(-0.7, 0.7, 30), np.linspace(-0.7, 0.7, 30))
    start = np.stack([x.ravel(), y.ravel(), np.full(900, 20.0)], axis=1)
    tracer = Tracer(scene)
    part = tracer.part[tracer.first(start, np.tile([0.0, 0.0, -1.0], (900, 1)))]
    assert set(part) == {9, 10} and 0.15 < (part == 10).mean() < 0.35


def test_geometry_of_other_holes_is_not_used(scenes):
    scene = scene_of(scenes, [scenes.sun()], samples=1)
    known = visible_geometry(scene, with_uv=True)
    one, other = (reference_images(scene, None, SURFACES, geometry=geometry) for geometry in (None, known))
    np.testing.assert_array_equal(one.xyz, other.xyz)
    assert scene.cut({"net": RED, "wall": RED}) is scene
