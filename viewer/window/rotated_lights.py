"""Rotation of a scene's lights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from ...lighting.environment.environment import EnvironmentLight
from ...lighting.environment.softbox import SoftboxLight
from ...lighting.lights import DirectionalLight, Light, PointLight
from ...lighting.scene import Scene


def turned_lights(scene: Scene, degrees: float) -> Scene:
    """Rotate all lights about the vertical through the scene's centre, anticlockwise seen from above; returns the scene
    itself at 0.
    """
    if degrees == 0.0:
        return scene
    low, high = scene.bounds
    lights = tuple(_turned(light, 0.5 * (low + high), degrees) for light in scene.lights)
    return replace(scene, lights=lights)


def _turned(light: Light, centre: Float[np.ndarray, "3"], degrees: float) -> Light:
    if isinstance(light, EnvironmentLight):
        return replace(light, rotation_deg=float(light.rotation_deg) + degrees)
    cosine, sine = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    turn = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])

    def place(point: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        return centre + turn @ (point - centre)

    if isinstance(light, DirectionalLight):
        return replace(light, direction_to_light=turn @ np.asarray(light.direction_to_light))
    if isinstance(light, PointLight):
        return replace(light, position=place(np.asarray(light.position)))
    if isinstance(light, SoftboxLight):
        up = None if light.up is None else turn @ np.asarray(light.up)
        position, target = (place(np.asarray(one)) for one in (light.position, light.target))
        return replace(light, position=position, target=target, up=up)
    raise TypeError(f"nobody knows how to turn a {type(light).__name__}")
