"""Cost and error of visibility, measured with rays at points between vertices."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from metamer.benchmarks.papers import harmonics
from metamer.lighting.environment import octahedral
from metamer.lighting.scene import Scene
from metamer.lighting.vectors import unit
from metamer.lighting.visibility.occluders import OFFSET, Occluders
from metamer.lighting.visibility.precompute import computed_visibility
from metamer.lighting.visibility.sites import scaled_triangles
from metamer.lighting.visibility.visibility import SceneVisibility

# Points whose rays are traced at once. Side of the map of a sky: another one than that of the rays of vertices.
_BLOCK, _SKY = 256, 80


@dataclass(frozen=True)
class VisibilityMeasure:
    """Cost and error of the visibility of one scene.

    cpu_seconds_a_thousand : of precomputing, a thousand vertices.
    bytes_a_vertex : of what is stored.
    misclassified : share of pairs of a point and a direction above both of its horizons whose shadow is wrong.
    misclassified_coarse : the same asked at the corners of the triangles as they are in the scene, undivided.
    illuminance_error : root mean square difference of the illuminance by transfer and by rays under a sky whose
        luminance grows evenly from 1 below to 3 above; of what a horizontal plane receives of it.
    """

    vertices: int
    cpu_seconds_a_thousand: float
    bytes_a_vertex: float
    misclassified: float
    misclassified_coarse: float
    illuminance_error: float


@dataclass(frozen=True, eq=False)
class Truth:
    """N points drawn evenly over all triangles, with Q directions each that rays were sent along.

    faces (N,), weights (N, 3) : where the points are. normals (N, 3) : shading normals.
    free (N, Q) : by rays. counts (N, Q) : whether a direction is above the horizons of triangle and shading normal.
    """

    faces: Int[np.ndarray, " N"]
    weights: Float[np.ndarray, "N 3"]
    normals: Float[np.ndarray, "N 3"]
    directions: Float[np.ndarray, "N Q 3"]
    free: Bool[np.ndarray, "N Q"]
    counts: Bool[np.ndarray, "N Q"]


def truth(scene: Scene, points: int, directions: Float[np.ndarray, "Q 3"] | int, seed: int = 0) -> Truth:
    """Rays at random points on the front of random triangles, along given directions or so many random ones."""
    rng = np.random.default_rng(seed)
    triangles = scaled_triangles(scene)
    occluders = Occluders(triangles)
    geometric = np.concatenate([part.mesh.face_normals for part in scene.parts])
    corners = np.concatenate([part.mesh.normals[part.mesh.faces] for part in scene.parts])
    a, b, c = (triangles[:, k] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    faces = rng.choice(len(areas), points, p=areas / areas.sum())
    root, share = np.sqrt(rng.random(points)), rng.random(points)
    weights = np.stack([1.0 - root, root * (1.0 - share), root * share], axis=1)
    place = np.einsum("nk,nki->ni", weights, triangles[faces]) + OFFSET * geometric[faces]
    normals = unit(np.einsum("nk,nki->ni", weights, corners[faces]))
    if isinstance(directions, int):
        to = unit(rng.normal(size=(points, directions, 3)))
    else:
        to = np.broadcast_to(directions, (points, *directions.shape))
    counts = (np.einsum("nqi,ni->nq", to, geometric[faces]) > 0.0) & (np.einsum("nqi,ni->nq", to, normals) > 0.0)
    free = np.zeros(counts.shape, dtype=bool)
    for start in range(0, points, _BLOCK):
        block = slice(start, start + _BLOCK)
        point, which = np.nonzero(counts[block])
        free[start + point, which] = occluders.free(place[block][point], to[block][point, which])
    return Truth(faces, weights, normals, to, free, counts)


def misclassified(visibility: SceneVisibility, truth: Truth, coarse: bool = False) -> float:
    """Share of the directions that count whose shadow is wrong."""
    corners = visibility.refinement.corners[truth.faces]
    asked = (corners, truth.weights) if coarse else visibility.located(truth.faces, truth.weights)
    found = visibility.signed_distances(*asked, truth.directions) > 0.0
    return float((found != truth.free)[truth.counts].mean())


def illuminance_error(visibility: SceneVisibility, truth: Truth) -> float:
    """Measure the error of transfer against `truth` along all directions of one octahedral map: see
    `VisibilityMeasure`.
    """
    to = truth.directions[0]
    angles = octahedral.solid_angles(round(len(to) ** 0.5))
    luminance = (2.0 + to[:, 1]) * angles
    cosines = np.maximum(truth.normals @ to.T, 0.0)
    exact = (cosines * truth.free) @ luminance
    sky = harmonics.harmonics(to).T @ luminance
    found = np.maximum(
        harmonics.matt_transfer(visibility, *visibility.located(truth.faces, truth.weights), truth.normals) @ sky, 0.0
    )
    horizontal = float(np.maximum(to[:, 1], 0.0) @ luminance)
    return float(np.sqrt(np.mean((found - exact) ** 2)) / horizontal)


def measured(scene: Scene, points: int = 1500, seed: int = 0) -> VisibilityMeasure | None:
    """Compute a scene's visibility and measure it; None where nothing hides anything."""
    begun = time.process_time()
    visibility = computed_visibility(scene)
    seconds = time.process_time() - begun
    if visibility is None:
        return None
    count = visibility.vertices
    hard = truth(scene, points, 96, seed)
    soft = truth(scene, min(points, 400), octahedral.texel_directions(_SKY).reshape(-1, 3), seed + 1)
    return VisibilityMeasure(
        count,
        1000.0 * seconds / count,
        visibility.bytes_a_vertex,
        misclassified(visibility, hard),
        misclassified(visibility, hard, coarse=True),
        illuminance_error(visibility, soft),
    )
