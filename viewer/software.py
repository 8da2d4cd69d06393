"""The renderer in numpy: the same geometry, the same terms, no GL. Twin of `headless.GLRenderer`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, Int

from ..lighting.vectors import dot, unit
from ..materials.axes import Frame
from ..materials.factors import FactorPack, FrameAngles, frame_angles
from .footprints import footprints
from .geometry import LightGeometry
from .keeping import Layer, Piece, Terms, Tile
from .pyramids import filtered_geometry
from .raster import Window, WindowTriangles
from .renderer import Filtering, Renderer
from .shadows import visibility
from .surfaces import Surface, surface_samples
from .view import View


@dataclass(eq=False)
class ShadedSamples:
    """The samples of one part that one light reaches, with their angles as they are asked for.

    irradiance (K,) : pi E / E_ref on a surface that faces the light, times visibility, over the samples of a pixel.
    widths : what a sample spans of each angle of a frame, (K, 4) radians; None where factors are not mip-mapped.
    """

    pixel: Int[np.ndarray, " K"]
    wi: Float[np.ndarray, "K 3"]
    wo: Float[np.ndarray, "K 3"]
    irradiance: Float[np.ndarray, " K"]
    widths: Mapping[Frame, Float[np.ndarray, "K 4"]] | None = None
    _angles: dict[tuple[str, bool], FrameAngles] = field(default_factory=dict)

    def angles(self, pack: FactorPack) -> FrameAngles:
        """What `pack` is looked up at; `scale` includes the irradiance."""
        key = (pack.frame, pack.anisotropic)
        if key not in self._angles:
            at = frame_angles(pack.frame, self.wi, self.wo, pack.anisotropic)
            self._angles[key] = replace(at, scale=at.scale * self.irradiance)
        return self._angles[key]

    def geometry(self, pack: FactorPack) -> Float[np.ndarray, "K R"]:
        """Each term of `pack` at each sample, times the irradiance."""
        at = self.angles(pack)
        if self.widths is None:
            return pack.geometry_at(at)
        return filtered_geometry(pack, at, self.widths[pack.frame][:, : len(pack.axes)])


@dataclass(eq=False)
class SoftwareTerms(Terms):
    """Terms as numbers: pixel (P,) which of the tile's, row by row; values (P, R)."""

    pixel: Int[np.ndarray, " P"]
    values: Float[np.ndarray, "P R"]


@dataclass(eq=False)
class SoftwareTile(Tile):
    """A tile and, by part and light, the samples that are lit."""

    lit: dict[tuple[int, int], ShadedSamples]


class SoftwareRenderer(Renderer):
    """Renders in numpy, on any machine."""

    def __init__(self, filtering: Filtering = "linear", keeps_terms: bool = False) -> None:
        super().__init__(filtering, keeps_terms)
        self.name = "software (numpy)"

    def _tile(self, view: View, window: Window, triangles: WindowTriangles) -> SoftwareTile:
        side, first_face = view.camera.samples, view.scene.first_face
        height, width = window.height // side, window.width // side
        surface = surface_samples(view, window, triangles)
        hits = np.bincount(surface.pixel, minlength=height * width).reshape(height, width)
        lit = {}
        for number, light in enumerate(view.scene.lights):
            which, wi, irradiance = _reached(view, light, surface)
            wo = np.einsum("nij,nj->ni", surface.frame[which], surface.to_viewer[which])
            widths = footprints(view, light, triangles, surface, which) if self.filtering == "mipmapped" else None
            part_of = np.searchsorted(first_face, surface.face[which], side="right") - 1
            for part in range(len(first_face) - 1):
                mine = part_of == part
                lit[part, number] = ShadedSamples(
                    surface.pixel[which[mine]],
                    wi[mine],
                    wo[mine],
                    irradiance[mine],
                    None if widths is None else {frame: values[mine] for frame, values in widths.items()},
                )
        coverage = (hits / side**2).astype(np.float32)
        return SoftwareTile(coverage, lit)

    def _terms(self, tile: SoftwareTile, layer: Layer) -> SoftwareTerms | None:
        found = []
        for light in layer.lights:
            samples = tile.lit[layer.part, light]
            if len(samples.pixel):
                first = np.flatnonzero(np.diff(samples.pixel, prepend=-1))
                found.append((samples.pixel[first], np.add.reduceat(samples.geometry(layer.pack), first, axis=0)))
        if not found:
            return None
        pixel, values = found[0]
        if len(found) > 1:
            pixel = np.unique(np.concatenate([one for one, _ in found]))
            values = np.zeros((len(pixel), layer.pack.rank))
            for one, terms in found:
                values[np.searchsorted(pixel, one)] += terms
        return SoftwareTerms(layer.pack, pixel.nbytes + values.nbytes, pixel, values)

    def _shade(self, piece: Piece, layers: Sequence[Layer], count: int) -> Float[np.ndarray, "M h w 3"]:
        height, width = self._coverage_of(piece).shape
        total = np.zeros((height * width, 3 * count))
        for layer, terms in self._with_terms(piece, layers, self.keeps_terms):
            total[terms.pixel] += terms.values @ layer.weights
        return total.reshape(height, width, count, 3).transpose(2, 0, 1, 3)


def _reached(view: View, light: LightGeometry, surface: Surface):
    """Which samples the light reaches, the local direction to it, and `ShadedSamples.irradiance`."""
    above = np.flatnonzero(view.lit(light)[surface.face])
    position = surface.position[above]
    offset = light.towards(position)
    irradiance = light.irradiance / dot(offset, offset)
    wi = np.einsum("nij,nj->ni", surface.frame[above], unit(offset))
    up = wi[:, 2] > 0.0
    above, wi, position, irradiance = above[up], wi[up], position[up], irradiance[up]
    free = visibility(light.shadows, position, surface.face[above])
    some = free > 0.0
    irradiance = irradiance[some] * free[some] / view.camera.samples**2
    return above[some], wi[some], irradiance
