"""Texture coordinates and footprints by rays: against closed forms, seams, mirrored and missing uv."""

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.lights import DirectionalLight
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import plane, speed_shape, sphere
from metamer.lighting.reference.geometry import visible_geometry
from metamer.lighting.scene import Part, Scene
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer

SIZE = {"width": 24, "height_px": 18, "samples": 2}
CAMERAS = {
    "perspective": Camera(position=(0.4, 1.5, 2.5), target=(0.1, 0, 0.2), vertical_fov_deg=30, **SIZE),
    "orthographic": Camera(
        position=(0.4, 1.5, 2.5), target=(0.1, 0, 0.2), projection="orthographic", height=1.2, **SIZE
    ),
}


def scene_of(*meshes, camera=CAMERAS["perspective"]):
    parts = tuple(Part(f"part{number}", mesh, "m") for number, mesh in enumerate(meshes))
    light = DirectionalLight((0.3, 0.9, 0.5), illuminant("D65"), 1000)
    return Scene(parts, (light,), (camera,), observer("1931_2"))


def floor_uv(camera, column, row):
    """Find where the ray through a place of the picture, in samples, meets y = 0, in the uv of `plane(4, 5)`."""
    across, down = camera.width * camera.samples, camera.height_px * camera.samples
    half_width, half_height = camera.half_extent
    right, up, back = camera.axes
    beside = (2 * column / across - 1) * half_width * right + (1 - 2 * row / down) * half_height * up
    origin, direction = camera.position, beside - back
    if camera.projection == "orthographic":
        origin, direction = camera.position + beside, -back
    met = origin - origin[1] / direction[1] * direction
    return np.array([met[0] / 4 + 0.5, 0.5 - met[2] / 5])


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_uv_and_footprints_of_a_floor_are_those_of_its_projection(camera):
    found = visible_geometry(scene_of(plane(4, 5), camera=camera), with_uv=True)
    columns = camera.width * camera.samples
    assert len(found.uv) == columns * camera.height_px * camera.samples
    step = 1e-4
    for number in range(0, len(found.uv), 61):
        row, column = np.divmod(number, columns) + np.array(0.5)
        np.testing.assert_allclose(found.uv[number], floor_uv(camera, column, row), atol=1e-12)
        for axis, (x, y) in enumerate(((step, 0), (0, step))):
            ahead, behind = floor_uv(camera, column + x, row + y), floor_uv(camera, column - x, row - y)
            np.testing.assert_allclose(
                found.footprint[number, axis], (ahead - behind) / (2 * step), rtol=1e-6, atol=1e-9
            )


def test_footprints_are_of_a_sample_and_not_of_a_pixel():
    one, two = (
        visible_geometry(scene_of(plane(4, 5), camera=Camera(position=(0, 3, 1), width=8, height_px=8, samples=s)),
                         with_uv=True)
        for s in (1, 2)
    )  # fmt: skip
    area = [np.abs(np.linalg.det(found.footprint)).mean() for found in (one, two)]
    assert area[0] / area[1] == pytest.approx(4, rel=0.02)


@pytest.mark.parametrize("make", [sphere, speed_shape])
def test_closed_shapes_are_split_along_the_seam_and_at_the_poles_alone(make):
    body, bare = make(5, uv=True), make(5)
    assert 0 < len(body.vertices) - len(bare.vertices) < 200
    np.testing.assert_array_equal(body.vertices[body.faces], bare.vertices[bare.faces])
    assert (body.tangents.handedness == 1).all()
    assert np.ptp(body.uv[body.faces][..., 0], axis=1).max() < 0.3
    assert body.uv.min() >= 0 and body.uv[:, 1].max() <= 1


def test_a_seam_shows_neither_in_uv_nor_in_footprints():
    """From behind, where u passes from 1 to 0, and over a pole."""
    body = sphere(5, uv=True)
    camera = Camera(position=(0.3, 1.2, -5), width=48, height_px=48, samples=1, vertical_fov_deg=40)
    found = visible_geometry(scene_of(body, camera=camera), with_uv=True)
    uv = np.full((48 * 48, 2), np.nan)
    uv[found.pixel] = found.uv
    uv = uv.reshape(48, 48, 2)
    assert np.nanmax(uv[..., 0]) > 0.9 and np.nanmin(uv[..., 0]) < 0.1
    jump = np.diff(uv[..., 0], axis=1)
    jump -= np.round(jump)
    away = np.isfinite(jump) & (np.abs(uv[:, 1:, 1] - 0.5) < 0.4)
    assert np.abs(jump[away]).max() < 0.2
    # A sample's footprint says where its neighbour's uv is, across the seam as elsewhere.
    across = np.full((48 * 48, 2), np.nan)
    across[found.pixel] = found.footprint[:, 0]
    inner = away & (np.abs(jump) < 0.05)
    expected = 0.5 * (across.reshape(48, 48, 2)[:, 1:, 0] + across.reshape(48, 48, 2)[:, :-1, 0])
    assert np.percentile(np.abs(expected - jump)[inner] / np.abs(jump[inner]), 90) < 0.15


def test_the_uv_of_a_sphere_are_longitude_and_latitude():
    found = visible_geometry(scene_of(sphere(6, uv=True)), with_uv=True)
    x, y, z = found.position.T
    turn = found.uv[:, 0] - (np.arctan2(x, z) / (2 * np.pi) + 0.5)
    upright = np.abs(y) < 0.95
    np.testing.assert_allclose((turn - np.round(turn))[upright], 0, atol=1e-3)
    np.testing.assert_allclose(found.uv[:, 1], np.arcsin(np.clip(y, -1, 1)) / np.pi + 0.5, atol=1e-3)


def test_parts_without_uv_are_told_and_hold_no_nan():
    ball = sphere(3, 0.3)
    mixed = visible_geometry(scene_of(plane(4, 5), ball), with_uv=True)
    assert mixed.has_uv == (True, False) and set(mixed.part) == {0, 1}
    assert np.isfinite(mixed.uv).all() and np.isfinite(mixed.footprint).all()
    assert not mixed.uv[mixed.part == 1].any() and not mixed.footprint[mixed.part == 1].any()
    assert mixed.footprint[mixed.part == 0].any(axis=(1, 2)).all()
    bare = visible_geometry(scene_of(ball), with_uv=True)
    assert bare.uv is None and bare.footprint is None and bare.has_uv == (False,)


def test_nothing_of_uv_is_worked_out_unasked(monkeypatch):
    monkeypatch.setattr("metamer.lighting.reference.geometry.uv_footprints", lambda *_: pytest.fail("not asked for"))
    found = visible_geometry(scene_of(plane(4, 5)))
    assert found.uv is None and found.footprint is None and found.has_uv == ()


def test_mirrored_uv_mirror_the_local_frame_and_nothing_else():
    floor = plane(4, 5)
    mirrored = Mesh(floor.vertices, floor.normals, floor.faces, floor.uv * [1, -1])
    usual, other = (visible_geometry(scene_of(mesh), with_uv=True) for mesh in (floor, mirrored))
    np.testing.assert_allclose(other.wo, usual.wo * [1, -1, 1], atol=1e-15)
    np.testing.assert_allclose(other.lit[0].wi, usual.lit[0].wi * [1, -1, 1], atol=1e-15)
    np.testing.assert_allclose(other.footprint, usual.footprint * [1, -1], atol=1e-12)


def test_from_below_v_still_runs_along_y_of_the_frame():
    """The floor seen from below: wo stands for the same world direction of u and v, on the other side."""
    below = Camera(position=(0.4, -1.5, 2.5), width=6, height_px=6, samples=1, vertical_fov_deg=20)
    found = visible_geometry(scene_of(plane(40, 40), camera=below))
    world = below.to_viewer(found.position)
    # u is along x, v against z, and the normal on the viewer's side against y.
    np.testing.assert_allclose(found.wo, np.stack([world[:, 0], -world[:, 2], -world[:, 1]], axis=1), atol=1e-12)


def test_uv_without_area_in_a_triangle_have_no_footprint_there():
    uv = np.array([[0.0, 0], [1, 0], [1, 1], [1, 0.5]])
    corners = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [3, 0, -1.0]])
    mesh = Mesh(corners, np.tile([0.0, 1, 0], (4, 1)), np.array([[0, 1, 2], [1, 3, 2]]), uv)
    camera = Camera(position=(0.6, 4, 0), up=(0, 0, -1), target=(0.6, 0, 0), width=20, height_px=20, samples=1)
    found = visible_geometry(scene_of(mesh, camera=camera), with_uv=True)
    second = found.position[:, 0] - 1 > 1e-6
    assert second.any() and (~second).any() and np.isfinite(found.uv).all()
    np.testing.assert_allclose(found.uv[second, 0], 1, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(found.footprint[second]), 0, atol=1e-12)
    assert (np.abs(np.linalg.det(found.footprint[~second])) > 1e-6).all()
