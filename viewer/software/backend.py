"""Numpy renderer with the same geometry and terms as `gl.backend`, without OpenGL."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ...lighting.vectors import dot, unit
from ...materials.core.points import Points
from ...materials.core.terms import Terms
from ..render.cache import Backend, KeptTerms, Needs, Piece, Tile
from ..render.footprints import footprints
from ..render.geometry import LightGeometry
from ..render.holes import reaching
from ..render.layers import AnyLayer, SpreadLayer
from ..render.raster import TileWindow, WindowTriangles
from ..render.scene_layers import Filtering, RenderSettings
from ..render.session import RenderSession
from ..render.surfaces import SurfaceSamples, surface_samples
from ..render.view import View
from .environment_light import TileSamples, gathered_terms


@dataclass(eq=False)
class SoftwareTerms(KeptTerms):
    """Terms in memory; places are the tile's pixels, row by row."""

    terms: Terms


@dataclass(eq=False)
class SoftwareTile(Tile):
    """Tile in memory.

    lit : by part and light, the lit samples: the pixel (K,) of each, and its points. Incident light is pi E / E_ref on
    a surface facing the light, times visibility, over the samples of a pixel.
    seen : by part, all samples, for area, environment and indirect light.
    """

    coverage: Float[np.ndarray, "h w"]
    lit: dict[tuple[int, int], tuple[Int[np.ndarray, " K"], Points]]
    seen: tuple[TileSamples, ...]


def software_session(filtering: Filtering = "linear", keeps_terms: bool = False) -> RenderSession:
    """Make a session on numpy; see `RenderSettings`."""
    return RenderSession(NumpyBackend(), RenderSettings(filtering, keeps_terms))


class NumpyBackend(Backend):
    """Back end in numpy, for any machine."""

    name = "software (numpy)"
    chunk = 1 << 20

    def tile(self, view: View, window: TileWindow, triangles: WindowTriangles, needs: Needs) -> SoftwareTile:
        """Compute visible geometry and lit samples of a window."""
        side, first_face = view.camera.samples, view.scene.first_face
        height, width = window.height // side, window.width // side
        surface = surface_samples(view, window, triangles, needs.uv)
        hits = np.bincount(surface.pixel, minlength=height * width).reshape(height, width)
        lit = {}
        for number, light in enumerate(view.scene.lights):
            which, wi, irradiance = _reached(view, light, surface)
            wo = np.einsum("nij,nj->ni", surface.frame[which], surface.to_viewer[which])
            widths = footprints(view, light, triangles, surface, which) if needs.mipmapped else None
            part_of = np.searchsorted(first_face, surface.face[which], side="right") - 1
            uv, footprint = (None if one is None else one[which] for one in (surface.uv, surface.footprint))
            points = Points(wi, wo, uv, footprint, irradiance, widths)
            for part in range(len(first_face) - 1):
                mine = part_of == part
                lit[part, number] = surface.pixel[which[mine]], points.chosen(mine)
        coverage = (hits / side**2).astype(np.float32)
        seen = tuple(_seen(view, surface, needs.mipmapped)) if needs.frames else ()
        return SoftwareTile(needs, coverage, lit, seen)

    def terms(self, tile: SoftwareTile, layer: AnyLayer) -> SoftwareTerms | None:
        """Sum a layer's terms over the samples of each pixel."""
        if isinstance(layer, SpreadLayer):
            samples = tile.seen[layer.part]
            if not len(samples.pixel):
                return None
            terms = gathered_terms(layer, samples).summed(samples.pixel)
            return SoftwareTerms(layer, terms.nbytes, terms)
        found = []
        for light in layer.lights:
            pixel, points = tile.lit[layer.part, light]
            if len(pixel):
                found.append(layer.summand.terms(points).summed(pixel))
        if not found:
            return None
        terms = Terms.sum_of(found)
        return SoftwareTerms(layer, terms.nbytes, terms)

    @contextmanager
    def added_up(
        self, piece: Piece, layers: Sequence[AnyLayer], columns: slice, keep: bool, count: int
    ) -> Iterator[list[Float[np.ndarray, "h w 3"]]]:
        """Add up layers; see `Backend.added_up`."""
        height, width = piece.coverage.shape
        total = np.zeros((height * width, columns.stop - columns.start))
        piece.keep_terms({layer.terms_key for layer in layers})
        for layer, kept in piece.with_terms(layers, keep):
            kept.terms.add_to(total, layer.colours[..., columns])
        yield list(total.reshape(height, width, -1, 3).transpose(2, 0, 1, 3))


def _seen(view: View, surface: SurfaceSamples, mipmapped: bool) -> Iterator[TileSamples]:
    """Yield samples for area, environment and indirect light, part by part."""
    first_face, face = view.scene.first_face, surface.face
    part_of = np.searchsorted(first_face, surface.face, side="right") - 1
    wo = np.einsum("nij,nj->ni", surface.frame, surface.to_viewer)
    # Textures are filtered only if footprints are present.
    spans = {} if mipmapped else None
    points = Points(wo, wo, surface.uv, surface.footprint, None, spans)
    side = view.side[face]
    facet = view.scene.face_normals[face] * side[:, None]
    samples = TileSamples(
        surface.pixel, points, surface.frame, face, surface.weights, side < 0.0, facet, surface.position
    )
    for part in range(len(first_face) - 1):
        yield samples.chosen(np.flatnonzero(part_of == part))


def _reached(view: View, light: LightGeometry, surface: SurfaceSamples):
    """Return the samples reached by a light, local directions to it, and irradiance there (`SoftwareTile`)."""
    above = np.flatnonzero(view.lit(light)[surface.face])
    position = surface.position[above]
    offset = light.towards(position)
    irradiance = light.irradiance / dot(offset, offset)
    wi = np.einsum("nij,nj->ni", surface.frame[above], unit(offset))
    up = wi[:, 2] > 0.0
    above, wi, position, irradiance = above[up], wi[up], position[up], irradiance[up]
    free = reaching(view, light, position, surface.face[above])
    some = free > 0.0
    irradiance = irradiance[some] * free[some] / view.camera.samples**2
    return above[some], wi[some], irradiance
