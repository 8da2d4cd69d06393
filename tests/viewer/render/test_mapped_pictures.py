"""Pictures of surfaces of maps: both renderers beside the reference, near and far."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.lighting.reference.reference import reference_images
from metamer.materials.svbrdf.map_set import Placement
from metamer.materials.svbrdf.maps import MappedSurface
from metamer.materials.svbrdf.texel_map import TexelMap
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM
from metamer.viewer.software.backend import software_session

LIGHTS = [illuminant(name) for name in ("D65", "FL11")]


def hammered(height=24, width=32, **others):
    """Dents in painted metal, brushed along a direction that turns."""
    y, x = np.mgrid[0:height, 0:width] * 2 * np.pi / 8
    normal = np.stack([0.25 * np.sin(x), 0.2 * np.cos(y), np.ones_like(x)], axis=-1).astype(np.float32)
    rng = np.random.default_rng(5)
    base = rng.integers(30, 255, (height, width, 3)).astype(np.uint8)
    metal = (rng.uniform(size=(height, width, 1)) > 0.6).astype(np.uint8) * np.uint8(255)
    rough = rng.uniform(0.35, 0.7, (height, width, 2)).astype(np.float32)
    turn = TexelMap(rng.uniform(0.0, 3.0, (height, width, 1)).astype(np.float32))
    made = MappedSurface(
        WORKING_WAVELENGTHS_NM,
        TexelMap(base, srgb=True),
        TexelMap(rough),
        "mallett-yuksel",
        metallic=TexelMap(metal),
        normal=TexelMap(normal),
        turn=turn,
    )
    return replace(made, **others)


def lacquered(height=24, width=32, **others):
    """The same under a clear coat that runs thin in places, is rough in others, and has waves of its own."""
    y, x = np.mgrid[0:height, 0:width] * 2 * np.pi / 16
    rng = np.random.default_rng(7)
    waves = np.stack([0.15 * np.cos(x), 0.15 * np.sin(y), np.ones_like(x)], axis=-1).astype(np.float32)
    coat = rng.integers(0, 256, (height, width, 1)).astype(np.uint8)
    rough = rng.uniform(0.2, 0.5, (height, width, 1)).astype(np.float32)
    given = {"coat": TexelMap(coat), "coat_roughness": TexelMap(rough), "coat_normal": TexelMap(waves)}
    return hammered(height, width, **(given | others))


SURFACE, COATED = hammered(), lacquered()
FORM, COATED_FORM = SURFACE.own_form(1e-3), COATED.own_form(1e-3)  # in single precision
BOTH = pytest.mark.parametrize("surface, form", [(SURFACE, FORM), (COATED, COATED_FORM)], ids=["bare", "coated"])


def scene_of(scenes, distance=3.0, samples=1, size=48, **mesh):
    floor = shapes.plane(4.0, 4.0)
    parts = [(shapes.speed_shape(4, uv=True).placed(translate=(0, 0.8, 0)), "cloth"), (replace(floor, **mesh), "cloth")]
    eye = distance * np.array([0.3, 0.8, 1.0])
    camera = Camera("c", eye, (0, 0.4, 0), vertical_fov_deg=40.0, width=size, height_px=size, samples=samples)
    return scenes.scene_of(parts, [scenes.sun(), scenes.lamp()], camera)


def differences(scene, surface, form, renderer, lights=LIGHTS):
    truth = reference_images(scene, None, {"cloth": surface}, lights)
    with renderer() as drawing:
        shown = drawing.render_many(scene, None, {"cloth": form}, lights)
    found = []
    for (xyz, coverage), reference, light in zip(shown, truth.xyz, lights, strict=True):
        whole = (coverage == 1.0) & (truth.coverage == 1.0)
        found.append(delta_e_xyz(reference[whole], xyz[whole].astype(float), scene.observer.white(light)))
    return np.concatenate(found)


@BOTH
@pytest.mark.parametrize("repeats", [1.0, -2.0], ids=["as it is", "repeated and mirrored"])
def test_pictures_are_the_reference_point_for_point(scenes, make_session, repeats, surface, form):
    scene = scene_of(scenes, uv=repeats * shapes.plane(4.0, 4.0).uv)
    off = differences(scene, surface, form, make_session)
    assert len(off) > 1000 and np.median(off) < 0.02 and np.percentile(off, 95) < 0.2


@pytest.mark.slow_cases("hammered-wrap0-near-mipmapped", "lacquered-wrap2-near-mipmapped")
@pytest.mark.parametrize("filtering", ["linear", "mipmapped"])
@pytest.mark.parametrize("distance", [2.5, 40.0], ids=["near", "far"])
@pytest.mark.parametrize(
    "made, wrap",
    [(hammered, ("repeat", "repeat")), (hammered, ("clamp", "mirror")), (lacquered, ("repeat", "repeat"))],
)
def test_gl_and_numpy_agree(scenes, drawn_by_both, filtering, distance, made, wrap):
    form = made(placement=Placement((2.0, 3.0), (-0.7, 0.2), wrap)).own_form()
    assert drawn_by_both(scene_of(scenes, distance, size=32), {"cloth": form}, filtering).off.max() < 0.1


@pytest.mark.parametrize("form", [FORM, COATED_FORM], ids=["bare", "coated"])
def test_far_away_means_are_nearer_to_many_samples(scenes, make_session, form):
    """Some ten texels a sample: what lies between is not seen without."""
    scene = scene_of(scenes, 30.0, size=32, uv=8.0 * shapes.plane(4.0, 4.0).uv)
    with software_session() as many:
        truth, whole = many.render(scene, replace(scene.camera(), samples=12), {"cloth": form})
    found = {}
    for filtering in ("linear", "mipmapped"):
        with make_session(filtering) as renderer:
            xyz, _ = renderer.render(scene, None, {"cloth": form})
        inside = whole == 1.0
        found[filtering] = delta_e_xyz(truth[inside].astype(float), xyz[inside].astype(float), scene.adopted_white())
    assert np.mean(found["mipmapped"]) < 0.3 * np.mean(found["linear"]), {k: v.mean() for k, v in found.items()}


def test_roughness_0_in_gl_is_that_of_numpy(scenes, drawn_by_both):
    """Highlights of a two-thousandth: what angles lose in single precision would show."""
    form = hammered(roughness=TexelMap.constant(0.0), turn=None).own_form(1e-3)
    assert drawn_by_both(scene_of(scenes), {"cloth": form}).off.max() < 0.05


@pytest.mark.parametrize("form", [FORM, COATED_FORM], ids=["bare", "coated"])
def test_what_is_alike_everywhere_is_drawn_with_means_too(scenes, drawn_by_both, form):
    """There is nothing to average: the shader has no levels."""
    assert drawn_by_both(scene_of(scenes, size=24), {"cloth": form.average()}, "mipmapped").off.max() < 0.05
