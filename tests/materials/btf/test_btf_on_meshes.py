"""BTFs laid on meshes: turned, mirrored, over seams; beside what texels say of directions worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest
from btf_samples import bumps
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.lighting.reference.geometry import visible_geometry
from metamer.materials.btf.form import btf_form
from metamer.materials.btf.local_pca import Size
from metamer.materials.core.points import Points
from metamer.spectral.folding import Folding
from metamer.viewer.software.backend import software_session

SIZE = Size(64, 4, 16, 0.1, 0.2)
SUN = np.array([0.7, 1.0, 0.2]) / np.linalg.norm([0.7, 1.0, 0.2])


@pytest.fixture(scope="module")
def form():
    """Bumps that look alike from no two sides."""
    return btf_form(bumps(), SIZE)


@pytest.fixture(scope="module")
def leaning():
    """A single texel that leans to one side: what it shows hangs on the tangents alone."""
    images = bumps(shine=1.0)
    return btf_form(replace(images, values=np.ascontiguousarray(images.values[:, :, 2:3, 3:4])), SIZE)


def scene_over(scenes, mesh, pixels=24, fov=10.0, position=(0.6, 2.0, 1.4)):
    """Near enough for a pixel to be smaller than a texel."""
    camera = Camera("c", position, (0.0, 0.0, 0.0), vertical_fov_deg=fov, width=pixels, height_px=pixels, samples=1)
    return scenes.scene_of([(mesh, "cloth")], [scenes.sun(SUN)], camera)


def picture(scene, surface):
    with software_session() as renderer:
        return renderer.render(scene, None, {"cloth": surface})[0].astype(np.float64)


def by_hand(scene, surface, uv, along_u, along_v):
    """XYZ of a floor's points, of directions along u, along v and up."""
    geometry = visible_geometry(scene, scene.cameras[0])
    frame = np.stack([along_u, along_v, (0.0, 1.0, 0.0)])
    to_light = np.broadcast_to(frame @ SUN, (len(geometry.position), 3))
    points = Points(to_light, scene.cameras[0].to_viewer(geometry.position) @ frame.T, uv(geometry.position))
    (light,) = scene.lights
    shone = light.illuminance_lux * np.pi / scene.viewing.reference_illuminance_lux
    return surface.xyz(points, Folding(scene.observer, (light.spectrum,), shone)) * to_light[:, 2:]


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("degrees", [0.0, 33.0, 90.0, 200.0])
def test_a_turned_or_mirrored_texture_is_lit_from_where_the_light_is(scenes, form, degrees, mirrored):
    """Of a plane u runs along x, and v against z."""
    flat = shapes.plane(1.0, 1.0)
    side = -1.0 if mirrored else 1.0
    scene = scene_over(scenes, flat.placed(uv_rotate_deg=degrees, uv_scale=(side, 1.0)))
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))

    def uv(position):
        u, v = 0.5 + position[:, 0], 0.5 - position[:, 2]
        return np.stack([side * (cos * u + sin * v), cos * v - sin * u], axis=1)

    expected = by_hand(scene, form, uv, (side * cos, 0.0, -side * sin), (-sin, 0.0, -cos))
    # Places and texture coordinates of renderers are in single precision.
    found = picture(scene, form).reshape(-1, 3)
    assert found[:, 1].std() > 0.02 * found[:, 1].mean()
    np.testing.assert_allclose(found, expected, rtol=2e-3, atol=1e-4)


@pytest.mark.parametrize("shift", [(1.0, 0.0), (0.0, -3.0), (-2.0, 5.0)])
def test_where_a_texture_begins_anew_there_is_no_seam(scenes, form, shift):
    """The middle of the picture lies where four repeats meet; whole repeats farther on it is the same picture."""
    flat = shapes.plane(1.0, 1.0)
    middle = replace(flat, uv=flat.uv + 0.5)
    found = picture(scene_over(scenes, middle, fov=4.0), form)
    moved = picture(scene_over(scenes, replace(flat, uv=flat.uv + 0.5 + shift), fov=4.0), form)
    np.testing.assert_allclose(moved, found, rtol=1e-5)
    # Steps from pixel to pixel over the seam are as small as elsewhere.
    across, down = np.abs(np.diff(found[..., 1], axis=1)), np.abs(np.diff(found[..., 1], axis=0))
    assert across[:, 10:13].max() <= 1.5 * across.max(axis=1).mean() + 1e-6
    assert down[10:13].max() <= 1.5 * down.max(axis=0).mean() + 1e-6


def test_islands_that_go_on_into_each_other_show_no_edge(scenes, form):
    """Two halves that share no vertex, the second with uv some repeats farther on."""
    flat = shapes.plane(1.0, 1.0)
    halves = [shapes.plane(0.5, 1.0).placed(translate=(x, 0.0, 0.0)) for x in (-0.25, 0.25)]
    own = [
        replace(half, uv=half.uv * (0.5, 1.0) + offset) for half, offset in zip(halves, ((0, 0), (3.5, 2)), strict=True)
    ]
    camera = scene_over(scenes, flat).cameras[0]
    split = scenes.scene_of([(half, "cloth") for half in own], [scenes.sun(SUN)], camera)
    np.testing.assert_allclose(picture(split, form), picture(scene_over(scenes, flat), form), rtol=3e-3, atol=1e-4)


def test_tangents_do_not_jump_at_the_seam_of_a_sphere(scenes, leaning):
    """Seen along the seam and away from it, a ball whose surface leans along u looks alike: it has no edge."""
    ball = shapes.sphere(5, uv=True)
    steps = []
    for turned in (0.0, 137.0):
        scene = scene_over(scenes, ball.placed(rotate_deg=(0.0, turned, 0.0)), 40, 20.0, (-6.0, 0.3, 0.0))
        found = picture(scene, leaning)
        assert found[..., 1].min() >= 0.0 and found[..., 1].max() > 0.05
        steps.append(np.abs(np.diff(found[..., 1], axis=1)).max())
    assert steps[0] < 1.05 * steps[1] and steps[1] < 1.05 * steps[0]
