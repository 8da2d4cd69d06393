"""The ways to render that are compared: a name and a function each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..papers.gaussian_lobes.ndf import slice_of
from ..papers.harmonics import cosine_factors, harmonics
from . import paper
from .hiding import Hiding
from .light import Gamma, PreparedLight
from .surface import GlossySurface, ShadedPoints


@dataclass(frozen=True, eq=False)
class MethodTask:
    """Task of a method: a surface at points under a light, in so many lobes; `hiding` None is in the open."""

    surface: GlossySurface
    points: ShadedPoints
    light: PreparedLight
    hiding: Hiding | None
    lobes: int

    @property
    def free_share(self) -> paper.FreeShare | None:
        """Free share of light, as a signed distance function knows it (eqs. 23 to 31)."""
        return None if self.hiding is None else self.hiding.free_share


#: A method: (N, K, T) terms, cd/m^2: of the body, and of the facets.
Method = Callable[[MethodTask], np.ndarray]


def by_paper(task: MethodTask) -> np.ndarray:
    """Lobes warped, the visibility's share of each (eqs. 36 to 43)."""
    return _with(task, task.free_share)


def without_visibility(task: MethodTask) -> np.ndarray:
    """Return the same, as if nothing were hidden."""
    return _with(task, None)


def with_ambient_occlusion(task: MethodTask) -> np.ndarray:
    """Return the same, and all of it times the share of the clamped cosine that is free."""
    found = _with(task, None)
    return found * _occlusion(task)


def by_harmonics(task: MethodTask) -> np.ndarray:
    """25 harmonics of the light, the body exact in them, the lobes warped as the paper has them; ambient occlusion."""
    body = (harmonics(task.points.normals) * cosine_factors()) @ task.light.kept_harmonics.T / np.pi
    facets = _facets(task, task.light.smooth_gamma, None)
    found = np.concatenate([body[:, :, None], facets], axis=2)
    return found * _occlusion(task)


def by_paper_locally(task: MethodTask) -> np.ndarray:
    """Lobes warped and multiplied with the light's own (eqs. 42 and 43); for lights of one direction."""
    light = task.light.local_lobes(task.points)
    body = paper.local_diffuse(task.points, light, task.free_share)
    facets = np.zeros((len(task.points), 1, len(task.surface.facets)))
    if task.surface.density is not None:
        facets = paper.local_specular(task.surface, task.points, light, task.free_share, task.lobes)
    return np.concatenate([body[:, :, None], facets], axis=2)


def at_half_vectors(task: MethodTask) -> np.ndarray:
    """Lobes of the distribution taken at the half vector itself: no warp; for lights of one direction."""
    at = task.light.arrivals(task.points)
    wi, wo = task.points.local(at.directions), task.points.viewer
    half = wi + wo
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    arrives = np.where(wi[:, 2] > 0.0, wi[:, 2] * at.illuminance_lux, 0.0)
    facets = np.zeros((len(wi), len(task.surface.facets)))
    if task.surface.density is not None:
        facets = slice_of(task.surface.lobes(task.lobes), half)[:, None] * task.surface.smooth(wi, wo)
    return (arrives[:, None] * np.column_stack([np.full(len(wi), 1.0 / np.pi), facets]))[:, None, :]


def _occlusion(task: MethodTask) -> Float[np.ndarray, "N 1 1"]:
    """Return the share of the clamped cosine that is free."""
    if task.hiding is None:
        return np.ones((len(task.points), 1, 1))
    return task.hiding.occlusion(task.points.normals)[:, None, None]


def _with(task: MethodTask, free_share: paper.FreeShare | None) -> np.ndarray:
    body = paper.diffuse(task.points, task.light.lobes, free_share)
    return np.concatenate([body[:, :, None], _facets(task, task.light.gamma, free_share)], axis=2)


def _facets(task: MethodTask, gamma: Gamma, free_share: paper.FreeShare | None) -> np.ndarray:
    if task.surface.density is None:
        return np.zeros((len(task.points), len(task.light.spectra), len(task.surface.facets)))
    return paper.specular(task.surface, task.points, gamma, free_share, task.lobes)


#: Methods that render under any light; a further one is a line here.
METHODS: dict[str, Method] = {
    "paper": by_paper,
    "no-visibility": without_visibility,
    "ambient-occlusion": with_ambient_occlusion,
    "sh25": by_harmonics,
}
#: Methods for lights of one direction.
DELTA_METHODS: dict[str, Method] = {"paper": by_paper_locally, "half-vector": at_half_vectors}
