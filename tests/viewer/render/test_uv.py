"""Texture coordinates of rasterised samples: GL as numpy, numpy as rays; mirrored, missing and degenerate uv."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.lights import DirectionalLight
from metamer.lighting.mesh import shapes
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.reference.geometry import visible_geometry
from metamer.lighting.reference.reference import reference_image
from metamer.viewer.gl import resources
from metamer.viewer.gl.backend import gl_session
from metamer.viewer.gl.passes import Passes
from metamer.viewer.render.geometry import scene_geometry
from metamer.viewer.render.surfaces import surface_samples
from metamer.viewer.render.view import view_of
from metamer.viewer.software.backend import software_session


def islands():
    """Two squares of one mesh: the right one's texture is another island, mirrored and turned."""
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    vertices = np.concatenate([square - [1, 0, 0], square])
    uv = np.concatenate([0.4 * square[:, :2], 1.0 - 0.5 * square[:, 1::-1]])
    uv[4:, 0] *= -1
    faces = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    return Mesh(vertices, np.tile([0.0, 0, 1], (8, 1)), faces, uv, name="islands")


def flat_uv():
    """A square of which one triangle has all its corners at u = 1."""
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    uv = np.array([[1.0, 0], [1, 0.5], [1, 1], [0, 1]])
    return Mesh(corners, np.tile([0.0, 0, 1], (4, 1)), np.array([[0, 1, 2], [0, 2, 3]]), uv, name="flat")


def front(samples=1, **other):
    return Camera("front", (0.2, 0.6, 3.5), (0, 0.2, 0), width=72, height_px=60, samples=samples,
                  **({"vertical_fov_deg": 40} | other))  # fmt: skip


def pictured(scenes, meshes, camera):
    return scenes.scene_of([(mesh, "gloss") for mesh in meshes], [scenes.sun()], camera)


SCENES = {
    "cloth and ground": lambda scenes: scenes.cloth_scene(size=72, samples=1),
    "ball with a seam": lambda scenes: pictured(scenes, [shapes.sphere(5, uv=True)], front()),
    "islands": lambda scenes: pictured(scenes, [islands()], front()),
    "flat uv": lambda scenes: pictured(scenes, [flat_uv()], front()),
    "one part without": lambda scenes: pictured(scenes, [shapes.sphere(4), islands()], front()),
    "parallel view": lambda scenes: pictured(
        scenes, [islands()], front(projection="orthographic", height=2.6, vertical_fov_deg=None)
    ),
    "a ground that begins behind the camera": lambda scenes: pictured(
        scenes,
        [shapes.plane(30, 30)],
        Camera("low", (0, 0.7, 0), (0.5, 0, -4), width=48, height_px=40, samples=1),
    ),
}


def samples_of(scene, with_uv=True):
    view = view_of(scene_geometry(scene), scene.camera())
    (window,) = view.windows()
    triangles = view.triangles(window)
    return view, window, triangles, surface_samples(view, window, triangles, with_uv)


@pytest.mark.parametrize("name", SCENES)
def test_numpy_agrees_with_rays(scenes, name):
    """Vertices are put on a grid of 1/256 sample: uv are off by what that is of a footprint."""
    scene = SCENES[name](scenes)
    view, _, _, surface = samples_of(scene)
    rays = visible_geometry(scene, with_uv=True)
    assert view.scene.has_uv == rays.has_uv
    assert np.isfinite(surface.uv).all() and np.isfinite(surface.footprint).all()
    # One sample a pixel, and each pixel once: those that see the same part of the same surface.
    common, mine, theirs = np.intersect1d(surface.pixel, rays.pixel, assume_unique=True, return_indices=True)
    assert len(common) > 0.99 * max(len(surface.pixel), len(rays.pixel))
    part = np.searchsorted(view.scene.first_face, surface.face[mine], side="right") - 1
    same = part == rays.part[theirs]
    there = np.linalg.norm(
        surface.position[mine] * view.scene.radius + view.scene.centre - rays.position[theirs], axis=1
    )
    same &= there < 0.02 * view.scene.radius
    assert same.mean() > 0.99
    span = np.linalg.norm(rays.footprint[theirs][same], axis=(1, 2))
    off = surface.uv[mine][same] - rays.uv[theirs][same]
    if name == "ball with a seam":
        off[:, 0] -= np.round(off[:, 0])
    assert (np.linalg.norm(off, axis=1) <= 0.01 * span + 1e-6).mean() > 0.995
    changed = np.linalg.norm(surface.footprint[mine][same] - rays.footprint[theirs][same], axis=(1, 2))
    # A facet of a few samples is turned by the grid, most where it is seen edge on.
    assert np.percentile(changed / np.maximum(span, 1e-9), 95) < 0.03
    assert np.median(changed / np.maximum(span, 1e-9)) < 0.005


@pytest.mark.parametrize("name", SCENES)
def test_gl_agrees_with_numpy(scenes, gl, name):
    view, window, triangles, surface = samples_of(SCENES[name](scenes))
    passes, owner = Passes(gl), resources.Owner(gl)
    tables = passes.triangles(owner, view, triangles)
    seen = passes.visibility(owner, window, tables)
    textures = passes.uv(owner, view.uv(triangles), seen, tables)
    read = [
        np.frombuffer(texture.read(), dtype=np.float32).reshape(window.height, window.width, -1) for texture in textures
    ]
    owner.release()
    passes.release()
    column, row = (surface.point // 256).T
    uv, footprint = (values[row, column] for values in read)
    assert not read[0][
        np.bincount(surface.pixel, minlength=window.width * window.height).reshape(window.height, -1) == 0
    ].any()
    span = np.linalg.norm(surface.footprint, axis=(1, 2))
    np.testing.assert_allclose(uv, surface.uv, atol=2e-6 * max(1.0, np.abs(surface.uv).max()))
    changed = np.linalg.norm(footprint.reshape(-1, 2, 2) - surface.footprint, axis=(1, 2))
    assert (changed <= 1e-4 * span + 1e-7).all(), (changed / np.maximum(span, 1e-9)).max()


def test_footprints_tell_where_the_next_sample_lies(scenes):
    """On a plane, half a footprint on either side joins neighbours: to second order they add up."""
    surface = samples_of(pictured(scenes, [shapes.plane(4, 4)], front()))[-1]
    beside = np.flatnonzero((np.diff(surface.pixel) == 1) & (np.diff(surface.point[:, 0]) > 0))
    step = surface.uv[beside + 1] - surface.uv[beside]
    mean = 0.5 * (surface.footprint[beside + 1, 0] + surface.footprint[beside, 0])
    np.testing.assert_allclose(mean, step, rtol=0.02, atol=1e-4)


def test_nothing_of_uv_is_worked_out_unasked(scenes, gl, monkeypatch):
    monkeypatch.setattr(resources, "uv_texels", lambda *_: pytest.fail("not asked for"))
    monkeypatch.setattr("metamer.viewer.render.surfaces.uv_at", lambda *_: pytest.fail("not asked for"))
    scene = scenes.cloth_scene(size=16)
    for renderer in (gl_session(gl), software_session()):
        renderer.render(scene, None, scenes.SURFACES)
        assert "uv" not in renderer.cache.geometry.__dict__
        renderer.close()
    assert samples_of(scene, with_uv=False)[-1].uv is None
    assert samples_of(scenes.sphere_scene(size=16))[-1].uv is None


@pytest.mark.parametrize("above", [True, False], ids=["front", "back"])
def test_the_mirror_image_of_a_scene_is_the_mirrored_picture(scenes, gl, above):
    """Mesh, light and camera mirrored, the texture with them, under a material that tells left from right.

    Without handedness its weave would stay as it was.
    """
    height = 2.4 if above else -1.2
    camera = Camera("c", (0.5, height, 3), (0, 0.4, 0), width=40, height_px=40, samples=2, vertical_fov_deg=34)
    light = scenes.sun((0.7, 0.8 if above else -0.5, 0.6))
    scene = scenes.scene_of([(shapes.cloth(40), "woven")], [light], camera)
    mirror = np.array([-1.0, 1, 1])
    mirrored = scenes.scene_of(
        [(shapes.cloth(40).transformed(np.diag([-1.0, 1, 1, 1])), "woven")],
        [DirectionalLight(light.direction_to_light * mirror, light.spectrum, light.illuminance_lux)],
        replace(camera, position=camera.position * mirror),
    )
    brdfs = {"woven": scenes.SURFACES["woven"]}
    hardware = gl_session(gl)
    renderers = [lambda one, r=r: r.render(one, None, scenes.SURFACES)[0] for r in (hardware, software_session())]
    for draw in (*renderers, lambda one: reference_image(one, None, brdfs)[0]):
        picture, other = draw(scene), draw(mirrored)
        off = np.abs(other[:, ::-1] - picture)
        assert picture.max() > 0.1
        assert np.percentile(off, 98) < 2e-3 * picture.max() and off.mean() < 1e-3 * picture.max()
    hardware.close()


def test_numpy_gl_and_rays_agree_on_mirrored_uv_under_an_anisotropic_material(scenes, gl):
    scene = scenes.scene_of([(islands(), "woven")], [scenes.sun()], front(samples=3))
    reference, _ = reference_image(scene, None, {"woven": scenes.SURFACES["woven"]})
    hardware = gl_session(gl)
    mine, theirs = (r.render(scene, None, scenes.SURFACES)[0] for r in (software_session(), hardware))
    hardware.close()
    np.testing.assert_allclose(theirs, mine, atol=2e-5)
    assert np.percentile(np.abs(mine - reference), 99) < 2e-3
    # The two islands have their textures, and so their weave, in other directions.
    assert np.abs(reference[30, 20] - reference[30, 52]).max() > 0.01
