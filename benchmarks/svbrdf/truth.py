"""The truth that methods are compared with: sums over every texel of the light, and how good they are."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ...lighting.environment import latlong
from ...lighting.environment.convolution import halved
from ...lighting.environment.environment import EnvironmentLight
from ...lighting.lights import DirectionalLight
from .methods import Task


def truth(task: Task) -> tuple[Float[np.ndarray, "N K 3"], Float[np.ndarray, "N K 3"]]:
    """The terms, and the same from texels twice as wide: the first is about a third of their difference off.

    Texels count at their middles, by their solid angle, so that highlights have to be wider than they are. Under a
    distant light both are one, and exact.
    """
    light = task.light.light
    if isinstance(light, DirectionalLight):
        found = _directional(task, light)
        return found, found
    return _summed(task, light, light.fields), _summed(task, light, halved(light.fields))


def _directional(task: Task, light: DirectionalLight) -> Float[np.ndarray, "N 1 3"]:
    wi = task.points.local(np.broadcast_to(light.direction_to_light, (len(task.points), 3)))
    terms = task.surface.terms(wi, task.points.viewer)
    return (terms * (light.illuminance_lux * task.seen(light.direction_to_light)))[:, None, :]


def _summed(task: Task, light: EnvironmentLight, fields: Float[np.ndarray, "K H W"]) -> Float[np.ndarray, "N K 3"]:
    height, width = fields.shape[1:]
    to = latlong.texel_directions(height, width).reshape(-1, 3) @ light.world_from_map.T
    shown = task.seen(to) > 0.0
    arrives = (fields * latlong.solid_angles(height, width)[:, None]).reshape(len(fields), -1)[:, shown]
    to = to[shown]
    found = np.empty((len(task.points), len(fields), 3))
    for number, (frame, viewer) in enumerate(zip(task.points.world_from_local, task.points.viewer, strict=True)):
        wi = to @ frame
        lit = np.flatnonzero(wi[:, 2] > 0.0)
        found[number] = arrives[:, lit] @ task.surface.terms(wi[lit], np.broadcast_to(viewer, (len(lit), 3)))
    return found
