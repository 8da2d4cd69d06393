"""Softboxes as renderers gather them, beside the light that they are."""

import numpy as np
import pytest
from metamer.lighting.environment.panel import GatheredPanel
from metamer.lighting.environment.softbox import SoftboxLight
from metamer.spectral.illuminants import illuminant

LIGHT = SoftboxLight((1.0, 2.0, 0.5), (0, 0, 0), 1.5, 0.8, illuminant("D65"), illuminance_lux=800.0)
CENTRE, RADIUS = np.array([0.3, -0.2, 0.1]), 2.5


def places(count=40):
    """World, on both sides of the light, as the panel takes them too."""
    world = np.random.default_rng(5).uniform(-3.0, 3.0, (count, 3))
    return world, (world - CENTRE) / RADIUS


def frames_about(normals):
    """Rows tangent, bitangent, normal."""
    found = []
    for normal in normals:
        tangent = np.cross(normal, [0.31, 0.87, 0.2])
        tangent = tangent / np.linalg.norm(tangent)
        found.append(np.stack([tangent, np.cross(normal, tangent), normal]))
    return np.array(found)


def test_illuminance_is_the_lights_own_in_any_scale():
    world, scaled = places()
    panel = GatheredPanel.of(LIGHT, CENTRE, RADIUS)
    vectors = LIGHT.irradiance_vectors(world)
    towards = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
    towards[np.linalg.norm(vectors, axis=1) == 0.0] = (0.0, 1.0, 0.0)
    lux = panel.by_frames(scaled, frames_about(towards), 1)[:, 0]
    # A surface whose sky the light fills but for what the horizon cuts receives more than the vector has.
    assert (lux >= np.linalg.norm(vectors, axis=1) - 1e-9).all()
    assert np.median(np.abs(lux - np.linalg.norm(vectors, axis=1))) < 1e-9
    behind = (world - LIGHT.position) @ LIGHT.axes[2] <= 0.0
    assert behind.any() and (lux[behind] == 0.0).all()


def test_mirrored_frames_have_the_moments_of_their_own_axes():
    _, scaled = places(10)
    panel = GatheredPanel.of(LIGHT, CENTRE, RADIUS)
    frames = frames_about(np.tile([[0.6, 0.8, 0.0]], (10, 1)))
    mirrored = frames * np.array([1.0, -1.0, 1.0])[:, None]
    one, other = panel.by_frames(scaled, frames), panel.by_frames(scaled, mirrored)
    signs = np.array([1, 1, -1, 1, -1, -1, 1, 1, 1])
    assert one.max() > 0.0
    assert np.abs(one * signs - other).max() < 1e-12 * one.max()


def test_a_sharp_lobe_sees_the_luminance_of_the_front():
    panel = GatheredPanel.of(LIGHT, CENTRE, RADIUS)
    to = LIGHT.position / np.linalg.norm(LIGHT.position)
    start = -CENTRE[None] / RADIUS
    found = panel.by_lobes(start, to[None, None], np.array([[1e6]]))
    assert found[0, 0] == pytest.approx(LIGHT.luminance_cd_m2, rel=1e-4)


def test_cells_cover_the_panel():
    _, scaled = places()
    panel = GatheredPanel.of(LIGHT, CENTRE, RADIUS)
    front = (scaled - panel.corners[0]) @ panel.facing > 0.3
    to, angles, sharpness = panel.seen_cells(scaled[front])
    lux = panel.by_frames(scaled[front], frames_about(to[:, 5]), 1)[:, 0] / panel.luminance
    summed = (angles * np.maximum(np.einsum("npi,ni->np", to, to[:, 5]), 0.0)).sum(axis=1)
    assert np.abs(summed / lux - 1.0).max() < 0.03
    assert (sharpness >= 1.0).all() and np.isfinite(sharpness).all()
    # At the very middle of a cell, too.
    assert np.isfinite(panel.seen_cells(panel.cells[:1])[1]).all()
