"""The renderer in numpy: the same geometry, the same terms, no GL. Twin of `headless.GLRenderer`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, Int

from ..lighting.geometry import LEAST_COSINE
from ..lighting.vectors import dot, orthonormal_frame, unit
from ..materials.factors import FactorPack, FrameAngles, frame_angles
from .geometry import LightGeometry, SceneGeometry
from .raster import SUBSTEPS, Window, WindowTriangles, rasterise
from .renderer import Layer, Renderer, Tile
from .shadows import visibility


@dataclass(frozen=True, eq=False)
class Surface:
    """The N samples of a window that meet a surface, sorted by pixel.

    pixel (N,) : row * width + column in the window. face (N,) : triangle of the scene.
    position (N, 3) : in radii about the scene's centre. to_viewer (N, 3) : unit. frame (N, 3, 3) : rows tangent,
    bitangent and shading normal.
    """

    pixel: Int[np.ndarray, " N"]
    face: Int[np.ndarray, " N"]
    position: Float[np.ndarray, "N 3"]
    to_viewer: Float[np.ndarray, "N 3"]
    frame: Float[np.ndarray, "N 3 3"]


@dataclass(eq=False)
class LitSamples:
    """The samples of one part that one light reaches, with their angles as they are asked for.

    irradiance (K,) : pi E / E_ref on a surface that faces the light, times visibility, over the samples of a pixel.
    """

    pixel: Int[np.ndarray, " K"]
    wi: Float[np.ndarray, "K 3"]
    wo: Float[np.ndarray, "K 3"]
    irradiance: Float[np.ndarray, " K"]
    _angles: dict[tuple[str, bool], FrameAngles] = field(default_factory=dict)

    def angles(self, pack: FactorPack) -> FrameAngles:
        """What `pack` is looked up at; `scale` includes the irradiance."""
        key = (pack.frame, pack.anisotropic)
        if key not in self._angles:
            at = frame_angles(pack.frame, self.wi, self.wo, pack.anisotropic)
            self._angles[key] = replace(at, scale=at.scale * self.irradiance)
        return self._angles[key]


@dataclass(eq=False)
class SoftwareTile(Tile):
    """A tile and, by part and light, the samples that are lit."""

    lit: dict[tuple[int, int], LitSamples]


class SoftwareRenderer(Renderer):
    """Renders in numpy, on any machine."""

    def __init__(self) -> None:
        super().__init__()
        self.name = "software (numpy)"

    def _tile(self, geometry: SceneGeometry, window: Window, triangles: WindowTriangles) -> SoftwareTile:
        side = geometry.camera.samples
        height, width = window.height // side, window.width // side
        surface = surface_samples(geometry, window, triangles)
        hits = np.bincount(surface.pixel, minlength=height * width).reshape(height, width)
        lit = {}
        for number, light in enumerate(geometry.lights):
            which, wi, irradiance = _reached(geometry, number, light, surface)
            wo = np.einsum("nij,nj->ni", surface.frame[which], surface.to_viewer[which])
            part_of = np.searchsorted(geometry.first_face, surface.face[which], side="right") - 1
            for part in range(len(geometry.first_face) - 1):
                mine = part_of == part
                lit[part, number] = LitSamples(surface.pixel[which[mine]], wi[mine], wo[mine], irradiance[mine])
        coverage = (hits / side**2).astype(np.float32)
        return SoftwareTile(window.left // side, window.top // side, coverage, lit)

    def _shade(self, tile: SoftwareTile, layers: Sequence[Layer], count: int) -> Float[np.ndarray, "M h w 3"]:
        height, width = tile.coverage.shape
        total = np.zeros((height * width, 3 * count))
        for layer in layers:
            samples = tile.lit[layer.part, layer.light]
            if len(samples.pixel):
                values = layer.pack.geometry_at(samples.angles(layer.pack)) @ layer.weights
                first = np.flatnonzero(np.diff(samples.pixel, prepend=-1))
                total[samples.pixel[first]] += np.add.reduceat(values, first, axis=0)
        return total.reshape(height, width, count, 3).transpose(2, 0, 1, 3)


def surface_samples(geometry: SceneGeometry, window: Window, triangles: WindowTriangles) -> Surface:
    """Rasterise one window and interpolate to its samples; twin of `surface.glsl`."""
    side = geometry.camera.samples
    seen = rasterise(triangles, window.width, window.height)
    blocks = (window.height // side, side, window.width // side, side)
    # By pixel, and within a pixel by row.
    line, column, sub_line, sub_column = np.nonzero(seen.reshape(blocks).transpose(0, 2, 1, 3) >= 0)
    pixel = line * blocks[2] + column
    row, column = line * side + sub_line, column * side + sub_column
    number = seen[row, column]

    sample = np.stack([column, row], axis=1) * SUBSTEPS + SUBSTEPS // 2
    offsets = triangles.corners[number] - sample[:, None]
    following, last = offsets[:, [1, 2, 0]], offsets[:, [2, 0, 1]]
    weights = (following[..., 0] * last[..., 1] - following[..., 1] * last[..., 0]) * triangles.inverse_w[number]
    weights /= weights.sum(axis=1, keepdims=True)
    if (triangles.weights != np.eye(3)).any():
        weights = np.einsum("nk,nkj->nj", weights, triangles.weights[number])

    face = triangles.parent[number]
    position, normal, tangent = (
        np.einsum("nk,nki->ni", weights, corners[face])
        for corners in (geometry.positions, geometry.normals, geometry.tangents)
    )
    to_viewer = unit(geometry.eye - position) if geometry.perspective else np.broadcast_to(geometry.eye, position.shape)
    normal = unit(normal)
    facing = dot(normal, to_viewer)
    bend = np.where(facing < LEAST_COSINE, LEAST_COSINE - facing, 0.0)
    normal = unit(normal + bend[:, None] * to_viewer)
    return Surface(pixel, face, position, to_viewer, orthonormal_frame(normal, tangent))


def _reached(geometry: SceneGeometry, number: int, light: LightGeometry, surface: Surface):
    """Which samples the light reaches, the local direction to it, and `LitSamples.irradiance`."""
    above = np.flatnonzero((geometry.lit[surface.face] >> number) & 1)
    position = surface.position[above]
    if light.directional:
        to_light = np.broadcast_to(light.vector, position.shape)
        irradiance = np.full(len(above), light.irradiance)
    else:
        offset = light.vector - position
        irradiance = light.irradiance / dot(offset, offset)
        to_light = unit(offset)
    wi = np.einsum("nij,nj->ni", surface.frame[above], to_light)
    up = wi[:, 2] > 0.0
    above, wi, position, irradiance = above[up], wi[up], position[up], irradiance[up]
    free = visibility(light.shadows, position, surface.face[above])
    some = free > 0.0
    irradiance = irradiance[some] * free[some] / geometry.camera.samples**2
    return above[some], wi[some], irradiance
