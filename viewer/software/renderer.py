"""The numpy renderer: the same geometry and terms as `gl.renderer`, without OpenGL."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ...lighting.vectors import dot, unit
from ...materials.points import Points
from ...materials.terms import Terms
from ..render.footprints import footprints
from ..render.geometry import LightGeometry
from ..render.holes import reaching
from ..render.keeping import KeptTerms, Layer, Piece, SpreadLayer, Tile
from ..render.raster import Window, WindowTriangles
from ..render.renderer import Filtering, Renderer
from ..render.surfaces import Surface, surface_samples
from ..render.view import View
from .environment_light import SeenSamples, gathered_terms


@dataclass(eq=False)
class SoftwareTerms(KeptTerms):
    """Terms as numbers; places are the tile's pixels, row by row."""

    terms: Terms


@dataclass(eq=False)
class SoftwareTile(Tile):
    """A tile and, by part and light, the samples that are lit: the pixel (K,) of each, and what is shaded there.

    What arrives at a point is pi E / E_ref on a surface that faces the light, times visibility, over the samples of a
    pixel. seen : by part, all samples, for lights that spread.
    """

    lit: dict[tuple[int, int], tuple[Int[np.ndarray, " K"], Points]]
    seen: tuple[SeenSamples, ...]


class SoftwareRenderer(Renderer):
    """Renders in numpy, on any machine."""

    def __init__(self, filtering: Filtering = "linear", keeps_terms: bool = False) -> None:
        super().__init__(filtering, keeps_terms)
        self.name = "software (numpy)"

    def _tile(self, view: View, window: Window, triangles: WindowTriangles) -> SoftwareTile:
        side, first_face = view.camera.samples, view.scene.first_face
        height, width = window.height // side, window.width // side
        surface = surface_samples(view, window, triangles, self._with_uv)
        hits = np.bincount(surface.pixel, minlength=height * width).reshape(height, width)
        lit = {}
        for number, light in enumerate(view.scene.lights):
            which, wi, irradiance = _reached(view, light, surface)
            wo = np.einsum("nij,nj->ni", surface.frame[which], surface.to_viewer[which])
            widths = footprints(view, light, triangles, surface, which) if self.filtering == "mipmapped" else None
            part_of = np.searchsorted(first_face, surface.face[which], side="right") - 1
            uv, footprint = (None if one is None else one[which] for one in (surface.uv, surface.footprint))
            points = Points(wi, wo, uv, footprint, irradiance, widths)
            for part in range(len(first_face) - 1):
                mine = part_of == part
                lit[part, number] = surface.pixel[which[mine]], points.chosen(mine)
        coverage = (hits / side**2).astype(np.float32)
        seen = tuple(self._seen(view, surface)) if self._with_frames else ()
        return SoftwareTile(coverage, self._with_uv, self._with_frames, lit, seen)

    def _seen(self, view: View, surface: Surface) -> Iterator[SeenSamples]:
        """Part by part."""
        first_face, face = view.scene.first_face, surface.face
        part_of = np.searchsorted(first_face, surface.face, side="right") - 1
        wo = np.einsum("nij,nj->ni", surface.frame, surface.to_viewer)
        # Textures are filtered where there are spans, whatever of.
        spans = {} if self.filtering == "mipmapped" else None
        points = Points(wo, wo, surface.uv, surface.footprint, None, spans)
        side = view.side[face]
        facet = view.scene.face_normals[face] * side[:, None]
        samples = SeenSamples(
            surface.pixel, points, surface.frame, face, surface.weights, side < 0.0, facet, surface.position
        )
        for part in range(len(first_face) - 1):
            yield samples.chosen(np.flatnonzero(part_of == part))

    def _terms(self, tile: SoftwareTile, layer: Layer | SpreadLayer) -> SoftwareTerms | None:
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

    def _shade(self, piece: Piece, layers: Sequence[Layer | SpreadLayer], count: int) -> Float[np.ndarray, "M h w 3"]:
        height, width = self._coverage_of(piece).shape
        total = np.zeros((height * width, 3 * count))
        self._keep_terms(piece, {layer.terms_key for layer in layers})
        for layer, kept in self._with_terms(piece, layers, self.keeps_terms):
            kept.terms.add_to(total, layer.colours)
        return total.reshape(height, width, count, 3).transpose(2, 0, 1, 3)


def _reached(view: View, light: LightGeometry, surface: Surface):
    """Which samples the light reaches, the local direction to it, and what arrives there (`SoftwareTile`)."""
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
