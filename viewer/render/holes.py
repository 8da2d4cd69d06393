"""Visibility of delta lights in scenes whose materials have holes, for both renderers.

Visibility through holes is decided in float64 (`surfaces.seen_in`) before a GPU draws anything, so that both renderers
agree. Shadows are ray traced as in the reference, through holes, since shadow grids do not know holes. For area and
environment lights holes are treated as opaque.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from ...lighting.vectors import unit
from .geometry import LightGeometry
from .raster import SUBSTEPS, TileWindow
from .shadows import visibility
from .surfaces import SurfaceSamples
from .view import View


def reaching(
    view: View, light: LightGeometry, position: Float[np.ndarray, "n 3"], face: Int[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Return the share of a light that reaches points on triangles facing it, positions in radii; see
    `shadows.visibility`.
    """
    scene, tracer = view.scene, view.scene.tracer
    if tracer is None:
        return visibility(light.shadows, position, face)
    normals = scene.face_normals[face] * view.side[face, None]
    start = tracer.lifted(scene.centre + scene.radius * position, normals)
    towards = light.towards((start - scene.centre) / scene.radius)
    near = light.vector[3] > 0.0
    distance = scene.radius * np.linalg.norm(towards, axis=1) if near else np.full(len(start), np.inf)
    return tracer.free(start, np.ascontiguousarray(unit(towards)), distance).astype(np.float64)


def seen_texels(surface: SurfaceSamples, window: TileWindow) -> Float[np.ndarray, "h w"]:
    """Return the index + 1 of the window's triangle at each sample, 0 for none, float32."""
    return _texels(window, surface.point, surface.number + 1.0)


def reaching_texels(
    view: View, light: LightGeometry, surface: SurfaceSamples, window: TileWindow
) -> Float[np.ndarray, "h w"]:
    """Return `reaching` at each sample, 0 if the light is below the triangle's horizon, float32."""
    lit = np.flatnonzero(view.lit(light)[surface.face])
    return _texels(window, surface.point[lit], reaching(view, light, surface.position[lit], surface.face[lit]))


def _texels(window: TileWindow, point: np.ndarray, values: np.ndarray) -> np.ndarray:
    out = np.zeros((window.height, window.width), dtype=np.float32)
    column, row = (point // SUBSTEPS).T
    out[row, column] = values
    return out
