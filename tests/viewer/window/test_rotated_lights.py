"""Lights turned about a scene."""

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.environment.softbox import SoftboxLight
from metamer.lighting.lights import DirectionalLight, PointLight
from metamer.lighting.mesh import shapes
from metamer.lighting.scene import Part, Scene
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.viewer.window.rotated_lights import turned_lights


@pytest.fixture
def scene():
    """A ball about (2, 0, 0), a sun, a lamp and a softbox."""
    lift = np.eye(4)
    lift[0, 3] = 2.0
    ball, light = shapes.sphere(2).transformed(lift), illuminant("D65")
    lights = (
        DirectionalLight(np.array([1.0, 1.0, 0.0]), light, 100.0),
        PointLight(np.array([5.0, 1.0, 0.0]), light, 100.0),
        SoftboxLight(np.array([5.0, 2.0, 0.0]), np.array([2.0, 0.0, 0.0]), 1.0, 0.5, light),
    )
    return Scene((Part("ball", ball, "paint"),), lights, (Camera(),), observer("1931_2"))


def test_a_quarter_turn_is_anticlockwise_from_above_about_the_middle(scene):
    low, high = scene.bounds
    middle = 0.5 * (low + high)
    sun, lamp, box = turned_lights(scene, 90.0).lights
    np.testing.assert_allclose(sun.direction_to_light, np.array([0.0, 1.0, -1.0]) / np.sqrt(2.0), atol=1e-12)
    for turned, before in ((lamp.position, scene.lights[1].position), (box.position, scene.lights[2].position)):
        x, y, z = before - middle
        np.testing.assert_allclose(turned - middle, (z, y, -x), atol=1e-12)
    # It faces the middle as before, with what it gives there.
    np.testing.assert_allclose(np.linalg.norm(box.target - box.position), np.sqrt(13.0))
    assert box.illuminance_lux == scene.lights[2].illuminance_lux


def test_no_turn_is_the_scene_itself_and_a_whole_one_the_same_light(scene):
    assert turned_lights(scene, 0.0) is scene
    again = turned_lights(turned_lights(scene, 140.0), 220.0)
    for turned, before in zip(again.lights[1:], scene.lights[1:], strict=True):
        np.testing.assert_allclose(turned.position, before.position, atol=1e-12)
