"""Spans of a sample in each angle: against many points in the sample, and where surfaces end, bend and turn."""

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.vectors import dot, orthonormal_frame, stated_tangents, unit
from metamer.materials.core.directions import half_difference, io_angles
from metamer.viewer.render.footprints import footprints
from metamer.viewer.render.geometry import scene_geometry
from metamer.viewer.render.surfaces import surface_samples
from metamer.viewer.render.view import view_of

TURN = 2 * np.pi
NAMES = {"io": ("theta_i", "theta_o", "phi", "phi_i"), "hd": ("theta_h", "theta_d", "phi_d", "phi_h")}


def spans_of(scene):
    """Every sample of a scene's only tile, and by angle what it spans for the first light."""
    view = view_of(scene_geometry(scene), scene.camera())
    (window,) = view.windows()
    triangles = view.triangles(window)
    surface = surface_samples(view, window, triangles)
    found = footprints(view, view.scene.lights[0], triangles, surface, np.arange(len(surface.pixel)))
    return surface, {name: found[frame][:, k] for frame, names in NAMES.items() for k, name in enumerate(names)}


@pytest.fixture(scope="module")
def ball(scenes):
    """A unit sphere of 40 pixels' radius from the front, one sample a pixel."""
    scene = scenes.sphere_scene("gloss", size=88, samples=1)
    return scene, *spans_of(scene)


def angles_within(scene, surface, count=15):
    """Angles of the exact sphere at count x count points of each sample, (N, count^2)."""
    camera = scene.camera()
    step = camera.height / camera.height_px
    inside = (np.arange(count) + 0.5) / count - 0.5
    across = ((surface.point[:, :1] / 256 + np.tile(inside, count)) * step) - 0.5 * camera.height
    up = 0.5 * camera.height - (surface.point[:, 1:] / 256 + np.repeat(inside, count)) * step
    normal = unit(np.stack([across, up, np.sqrt(np.maximum(1.0 - across**2 - up**2, 0.0))], axis=-1))
    frame = orthonormal_frame(normal, stated_tangents(normal))
    wi = np.einsum("...ij,j->...i", frame, scene.lights[0].direction_to_light)
    wo = np.einsum("...ij,j->...i", frame, camera.axes[2])
    theta_i, theta_o, phi = io_angles(wi, wo)
    theta_h, theta_d, phi_d, phi_h = half_difference(wi, wo)
    values = {"theta_i": theta_i, "theta_o": theta_o, "phi": phi}
    return values | {"theta_h": theta_h, "theta_d": theta_d, "phi_d": phi_d, "phi_h": phi_h}


@pytest.mark.slow
def test_spans_are_those_of_many_points_in_a_sample(ball):
    """A span's square is twelve times the variance, as that of a box is, wherever an angle changes evenly."""
    scene, surface, spans = ball
    middle = unit(surface.position)[:, 2] > 0.6
    values = angles_within(scene, surface)
    for name in ("theta_i", "theta_o", "theta_h", "phi_d", "phi_h"):
        many = values[name]
        even = middle & (many.min(axis=1) > 0.15) & (np.ptp(many, axis=1) < 0.3)
        assert even.sum() > 1000, name
        expected = np.sqrt(12.0) * many[even].std(axis=1)
        np.testing.assert_allclose(spans[name][even], expected, rtol=0.08, atol=1e-3, err_msg=name)
    assert spans["theta_d"].max() < 1e-6


def test_a_highlight_s_peak_within_a_sample_has_the_span_of_its_neighbours(ball):
    """theta_h has a kink there: its differences across the sample all but cancel."""
    scene, surface, spans = ball
    half = unit(scene.lights[0].direction_to_light + scene.camera().axes[2])
    off = np.arccos(np.clip(dot(surface.frame[:, 2], np.broadcast_to(half, (len(surface.pixel), 3))), -1, 1))
    peak = int(off.argmin())
    ring = (off > 0.08) & (off < 0.12)
    assert off[peak] < 0.02
    assert spans["theta_h"][peak] == pytest.approx(np.median(spans["theta_h"][ring]), rel=0.3)
    for name in ("phi_d", "phi_h"):
        assert 1.0 < spans[name][peak] <= TURN
        assert spans[name][ring].max() < 1.0


def test_azimuths_that_pass_a_whole_turn_do_not_jump(ball):
    scene, surface, spans = ball
    values = angles_within(scene, surface)
    for name in ("phi_d", "phi_h"):
        passing = (values[name].min(axis=1) < 0.05) & (values[name].max(axis=1) > TURN - 0.05)
        clear = passing & (values["theta_h"].min(axis=1) > 0.2) & (surface.frame[:, 2, 2] > 0.4)
        assert clear.sum() > 5, name
        assert spans[name][clear].max() < 0.5, name


def test_a_silhouette_takes_nothing_from_what_lies_behind(scenes, ball):
    """The spans on the ball are the same before a wall."""
    scene, alone, spans = ball
    behind = np.eye(4)
    behind[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    behind[2, 3] = -1.5
    wall = shapes.plane(8, 8).transformed(behind)
    walled = scenes.scene_of([(scene.parts[0].mesh, "gloss"), (wall, "matt")], scene.lights, scene.camera())
    surface, theirs = spans_of(walled)
    on_ball = surface.face < len(scene.parts[0].mesh.faces)
    assert on_ball.sum() == len(alone.pixel) < len(surface.pixel)
    for name, found in spans.items():
        np.testing.assert_allclose(theirs[name][on_ball], found, rtol=1e-3, atol=1e-4, err_msg=name)
        assert theirs[name][~on_ball].max() < 1e-6, name


def test_creases_and_flat_faces_span_nothing(scenes):
    """A roof of two planes by a parallel light, in a parallel view: no angle changes on either, edges included."""
    corners = np.array([[-1, 0, 0], [0, 0.8, 0], [0, 0.8, 2], [-1, 0, 2], [1, 0, 0], [1, 0, 2.0]])
    faces = np.array([[0, 2, 1], [0, 3, 2], [1, 2, 5], [1, 5, 4]])
    split = corners[faces].reshape(-1, 3)
    normals = np.repeat(unit(np.cross(split[1::3] - split[::3], split[2::3] - split[::3])), 3, axis=0)
    roof = Mesh(split, normals, np.arange(12).reshape(4, 3), name="roof")
    camera = Camera("above", (0.3, 5, 1.2), (0, 0, 1), (0, 0, -1), "orthographic", height=3, width=40, height_px=40)
    surface, spans = spans_of(scenes.scene_of([(roof, "gloss")], [scenes.sun()], camera))
    assert len(surface.pixel) > 5000
    for name, found in spans.items():
        assert found.max() < 1e-6, name


def test_a_plane_to_its_horizon_has_finite_spans(scenes):
    camera = Camera("low", (0, 1, 0), (0, 0.6, -4), vertical_fov_deg=60, width=48, height_px=48, samples=1)
    scene = scenes.scene_of([(shapes.plane(4000, 4000), "gloss")], [scenes.lamp((0, 2.0, -3.0))], camera)
    surface, spans = spans_of(scene)
    assert surface.pixel.max() < 48 * 48 and len(surface.pixel) > 800
    for name, found in spans.items():
        assert np.isfinite(found).all() and (found >= 0).all() and found.max() <= TURN, name
    # A pixel farther away shows more of the plane.
    rows = surface.pixel // 48
    assert np.median(spans["theta_i"][rows == rows.min() + 3]) > 2 * np.median(spans["theta_i"][rows == 40])


def test_triangles_smaller_than_a_sample_give_the_spans_of_their_surface(scenes):
    """The same ball of 10 pixels across from 1 280 and from 81 920 triangles."""
    camera = scenes.sphere_scene(size=12, samples=1).camera()
    spans = {}
    for subdivisions in (3, 6):
        scene = scenes.scene_of([(shapes.sphere(subdivisions), "gloss")], [scenes.sun()], camera)
        surface, found = spans_of(scene)
        clear = surface.frame[:, 2, 2] > 0.3
        spans[subdivisions] = np.stack([found[name][clear] for name in ("theta_i", "theta_o", "theta_h")])
    assert spans[3].shape == spans[6].shape
    np.testing.assert_allclose(spans[6], spans[3], rtol=0.15, atol=0.01)
