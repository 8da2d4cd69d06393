"""The truth that methods are compared with: sums over every texel of the light, and how good they are."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ...lighting.environment import latlong
from ...lighting.environment.convolution import half_size
from ...lighting.environment.environment import EnvironmentLight
from .methods import MethodTask


def true_terms(task: MethodTask) -> tuple[Float[np.ndarray, "N K T"], Float[np.ndarray, "N K T"]]:
    """Return the terms, and the same from texels twice as wide: the first is about a third of their difference off.

    Texels count at their middles, by their solid angle, so that highlights have to be wider than they are. Under a
    light of one direction both are one, and exact; nothing is hidden from it.
    """
    light = task.light.light
    if not isinstance(light, EnvironmentLight):
        found = _arriving(task)
        return found, found
    return _summed(task, light, light.fields), _summed(task, light, half_size(light.fields))


def _arriving(task: MethodTask) -> Float[np.ndarray, "N 1 T"]:
    at = task.light.arrivals(task.points)
    terms = task.surface.terms(task.points.local(at.directions), task.points.viewer)
    return (terms * at.illuminance_lux[:, None])[:, None, :]


def _summed(
    task: MethodTask, light: EnvironmentLight, fields: Float[np.ndarray, "K H W"]
) -> Float[np.ndarray, "N K T"]:
    height, width = fields.shape[1:]
    to = latlong.texel_directions(height, width).reshape(-1, 3) @ light.world_from_map.T
    arrives = (fields * latlong.solid_angles(height, width)[:, None]).reshape(len(fields), -1)
    seen = np.ones((1, len(to)), dtype=bool) if task.hiding is None else task.hiding.seen(to)
    seen = np.broadcast_to(seen, (len(task.points), len(to)))
    found = np.empty((len(task.points), len(fields), len(task.surface.spectra)))
    for number, (frame, viewer) in enumerate(zip(task.points.world_from_local, task.points.viewer, strict=True)):
        wi = to @ frame
        lit = np.flatnonzero((wi[:, 2] > 0.0) & seen[number])
        found[number] = arrives[:, lit] @ task.surface.terms(wi[lit], np.broadcast_to(viewer, (len(lit), 3)))
    return found
