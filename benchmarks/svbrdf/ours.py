"""The renderers' own way: slices as lobes and a bent cosine, bright parts of the light hidden each for itself."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from jaxtyping import Float

from ...lighting.environment.bright_light import BrightLight
from ...lighting.environment.environment import EnvironmentLight
from ...lighting.environment.prefiltering import GatheredLight
from ...lighting.visibility.visibility import SceneVisibility
from ...materials.core.environment_form import EnvironmentForm
from ...materials.core.points import Points
from ...materials.slices.fit import mixtures
from ...materials.slices.view_slices import ViewSlices
from ...spectral.palette import Palette
from ...viewer.render.layers import SpreadLayer
from ...viewer.render.light_cache import Shadows
from ...viewer.software.environment_light import TileSamples, gathered_terms
from .meshes import SceneHiding
from .methods import MethodTask
from .surface import GlossySurface, ShadedPoints


def by_slices(task: MethodTask) -> Float[np.ndarray, "N K T"]:
    """Gather light at the task's points as the numpy renderer does, in the open or with visibility at vertices."""
    if task.hiding is not None and not isinstance(task.hiding, SceneHiding):
        raise TypeError("visibility at vertices is needed")
    return gathered_by(slices_of(task.surface), task.points, task.light.environment, task.hiding)


def gathered_by(
    form: EnvironmentForm, points: ShadedPoints, light: EnvironmentLight, hiding: SceneHiding | None = None
) -> Float[np.ndarray, "N K R"]:
    """Compute what an environment form gathers under each of the light's spectra, a number for each of its own."""
    count, rank, fields = len(points), form.palette.rank, slice(0, len(light.spectra))
    shadows, faces, weights = None, np.zeros(count, dtype=np.int64), np.full((count, 3), 1.0 / 3.0)
    back, facet = np.zeros(count, dtype=bool), points.normals
    if hiding is not None:
        shadows, faces, weights = _shadows(hiding.visibility, light), hiding.faces, hiding.weights
        back, facet = hiding.back, hiding.geometric
    frames = np.swapaxes(points.world_from_local, 1, 2)
    seen = TileSamples(np.arange(count), Points(points.viewer, points.viewer), frames, faces, weights, back, facet)
    # Only the number of colours matters: terms come in fours.
    colours = np.zeros((1, -(-rank // 4) * 4 * len(light.spectra), 3))
    layer = SpreadLayer(0, fields, form, _gathered(light), light.world_from_map, 1.0, colours, shadows)
    return gathered_terms(layer, seen).value.reshape(count, len(light.spectra), -1)[:, :, :rank]


@lru_cache(maxsize=32)
def slices_of(surface: GlossySurface) -> ViewSlices:
    """Return its environment form, a term for each of its spectra, as bright as those are: black ones are left out."""
    bright = surface.spectra.mean(axis=1)

    def sampled(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return bright * surface.terms(wi, wo) / wi[:, 2:]

    directions, sharpness, value = mixtures(sampled, len(bright), _isotropic(surface))
    value = value / np.where(bright > 0.0, bright, 1.0)
    return ViewSlices(directions, sharpness, value, Palette.of(surface.spectra))


def _isotropic(surface: GlossySurface) -> bool:
    """Return whether turning both directions changes nothing, by looking at one pair."""
    wi, wo = np.array([[0.3, 0.2, 0.933]]), np.array([[0.1, -0.4, 0.911]])
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    return np.allclose(surface.terms(wi, wo), surface.terms(wi @ turn, wo @ turn), rtol=1e-9)


@lru_cache(maxsize=8)
def _gathered(light: EnvironmentLight) -> GatheredLight:
    return GatheredLight.of(light)


@lru_cache(maxsize=8)
def _shadows(visibility: SceneVisibility, light: EnvironmentLight) -> Shadows:
    found = Shadows(visibility, BrightLight.of(light))
    # Made once a light, as viewers have it: no part of what a picture takes.
    assert found.hidden is not None
    return found
