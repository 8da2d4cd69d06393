"""Pictures without a window: the GL renderer, and the choice between it and its numpy twin."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from ...lighting.camera import Camera
from ...lighting.scene import Scene
from ...materials.fast import Summand, TermShader
from ...spectral.errors import InputError
from ..render.geometry import LightGeometry
from ..render.holes import reaching_texels, seen_texels
from ..render.keeping import Layer, Piece, SpreadLayer
from ..render.raster import Window, WindowTriangles
from ..render.renderer import Filtering, Renderer
from ..render.surfaces import surface_samples
from ..render.view import View
from ..software.renderer import SoftwareRenderer
from .context import NoGL, create_context, describe, make_current, release_context
from .environment_light import GLGathering
from .passes import MOST_QUADS, MOST_SPECTRA, Passes
from .resources import (
    MOST_TRIANGLES,
    ROW_LENGTH,
    TRIANGLE_TEXELS,
    TRIANGLES_A_ROW,
    Owner,
    palette_texels,
    triangle_texels,
)
from .tile import GLTerms, GLTile, coverage_of, framed, places, read

if TYPE_CHECKING:
    import moderngl

# How a summand is drawn, and its textures by name.
Uploaded = tuple[TermShader, "dict[str, moderngl.Texture]"]

__all__ = ["GLRenderer", "Renderer", "SoftwareRenderer", "create_renderer"]


def create_renderer(filtering: Filtering = "linear", keeps_terms: bool = True) -> tuple[Renderer, NoGL | None]:
    """The GL renderer, or the numpy one and the reason why there is no GL here; parameters as of `Renderer`."""
    try:
        return GLRenderer(filtering=filtering, keeps_terms=keeps_terms), None
    except NoGL as reason:
        return SoftwareRenderer(filtering, keeps_terms), reason


class GLRenderer(Renderer):
    """Renders with OpenGL 4.10 core, headless.

    Parameters
    ----------
    context : a context to share; without it one is made, and released with the renderer.
    filtering, keeps_terms : see `Renderer`.

    Raises
    ------
    NoGL : no context can be made.
    """

    def __init__(
        self,
        context: moderngl.Context | None = None,
        filtering: Filtering = "linear",
        keeps_terms: bool = False,
    ) -> None:
        super().__init__(filtering, keeps_terms)
        self._owns_context = context is None
        self.context = create_context() if context is None else context
        make_current(self.context)
        self.name = describe(self.context)
        self._passes = Passes(self.context)
        self._gathering = GLGathering(self.context, self._passes)

    def close(self) -> None:
        """Release everything, programs and (if it made it) the context included."""
        make_current(self.context)
        self.release()
        self._gathering.release()
        self._passes.release()
        if self._owns_context:
            release_context(self.context)

    def release(self) -> None:
        """Forget everything that is kept and free what it holds on the GPU."""
        make_current(self.context)
        super().release()

    def _pieces(self, scene: Scene, camera: Camera) -> Iterator[Piece]:
        make_current(self.context)
        return super()._pieces(scene, camera)

    def _keep_lights(self, lights: Sequence[LightGeometry]) -> None:
        self._passes.keep_shadows(lights)

    def _tile(self, view: View, window: Window, triangles: WindowTriangles) -> GLTile:
        scene = view.scene
        if max(len(triangles.parent), len(scene.corners)) >= MOST_TRIANGLES:
            raise InputError("too many triangles", found=len(scene.corners), expected=f"below {MOST_TRIANGLES}")
        side = view.camera.samples
        owner, scratch = Owner(self.context), Owner(self.context)
        try:
            surface = None if scene.tracer is None else surface_samples(view, window, triangles)
            size = (window.width, window.height)
            if surface is None:
                seen = self._passes.visibility(owner, window, triangles)
            else:
                seen = owner.texture(size, 1, seen_texels(surface, window).tobytes())
            free = [
                None
                if surface is None
                else scratch.texture(size, 1, reaching_texels(view, light, surface, window).tobytes())
                for light in scene.lights
            ]
            table = scratch.table(triangle_texels(view, triangles), TRIANGLES_A_ROW, TRIANGLE_TEXELS)
            mipmapped = self.filtering == "mipmapped"
            lights = tuple(
                self._passes.light(owner, view, light, seen, table, triangles.parent, mipmapped, share)
                for light, share in zip(scene.lights, free, strict=True)
            )
            uv = self._passes.uv(owner, view.uv(triangles), seen, table) if self._with_uv else ()
            frames: tuple[moderngl.Texture, ...] = ()
            if self._with_frames:
                frames = (
                    *self._passes.frames(owner, view, seen, table),
                    *self._standing(owner, view, seen, table, triangles),
                )
            coverage = coverage_of(seen, side)
        except BaseException:
            owner.release()
            raise
        finally:
            scratch.release()
        parts = places(triangles, scene.first_face, side, coverage.shape[::-1])
        return GLTile(coverage, self._with_uv, self._with_frames, parts, side, seen, uv, frames, lights, owner)

    def _standing(
        self, owner: Owner, view: View, seen: moderngl.Texture, table: moderngl.Texture, triangles: WindowTriangles
    ) -> tuple[moderngl.Texture, moderngl.Texture]:
        """The weights of the second and third corner at every sample; each triangle's number + 1, negative where its
        back is seen, and its normal on the viewer's side.
        """
        scratch = Owner(self.context)
        try:
            weights, _ = self._passes.uv(scratch, triangles.weights[:, :, 1:], seen, table)
            kept = owner.texture(weights.size, 2, weights.read())
        finally:
            scratch.release()
        side = view.side[triangles.parent]
        normals = view.scene.face_normals[triangles.parent] * side[:, None]
        faces = np.column_stack([side * (triangles.parent + 1), normals]).astype(np.float32)
        return kept, owner.table(faces, ROW_LENGTH)

    def _discard(self, tile: GLTile) -> None:
        tile.owner.release()

    def _discard_terms(self, terms: GLTerms) -> None:
        terms.owner.release()

    def _uploaded(self, owner: Owner, summand: Summand) -> Uploaded:
        made = summand.shader(self.filtering == "mipmapped")
        sizes = {"MIXED": summand.mixed, **made.sizes}
        sizes |= {"MIPMAPPED": 1} if self.filtering == "mipmapped" else {}
        sizes |= {"USES_UV": 1} if summand.uses_uv else {}
        textures = {name: owner.texels(values) for name, values in made.textures.items()}
        return replace(made, sizes=sizes), textures

    def _add(
        self,
        target: moderngl.Framebuffer,
        tile: GLTile,
        layer: Layer,
        uploaded: Uploaded,
        written: Mapping[str, int],
        values: Mapping[str, object],
        palette: Mapping[str, moderngl.Texture] | None = None,
    ) -> None:
        """A layer under each of its lights: folded with `palette` where there is one, else its terms."""
        place = tile.parts[layer.part]
        assert place is not None
        numbers, box = place
        made, textures = uploaded
        in_io = layer.summand.frame == "io"
        for light in layer.lights:
            io, hd, azimuth, *spans = tile.lights[light]
            samplers = {"seen": tile.seen, "angles": io if in_io else hd, "azimuth": azimuth, **textures}
            samplers |= {"spans": spans[0 if in_io else 1]} if spans else {}
            samplers |= dict(zip(("uv", "footprint"), tile.uv, strict=False)) if layer.summand.uses_uv else {}
            samplers |= palette or {}
            given = {"part": numbers, "samples": tile.samples, **values}
            self._passes.shade(target, None if palette is None else box, written, made, samplers, given)

    def _terms(self, tile: GLTile, layer: Layer | SpreadLayer) -> GLTerms | None:
        if isinstance(layer, SpreadLayer):
            return self._gathered_terms(tile, layer)
        place = tile.parts[layer.part]
        if place is None:
            return None
        _, box = place
        owner, scratch = Owner(self.context), Owner(self.context)
        try:
            uploaded = self._uploaded(scratch, layer.summand)
            quads = tuple(owner.texture(box[2:], 4) for _ in range(-(-layer.summand.rank // 4)))
            for start in range(0, len(quads), MOST_QUADS):
                some = quads[start : start + MOST_QUADS]
                target = scratch.keep(self.context.framebuffer(some))
                target.clear()
                values = {"origin": box[:2], "first_row": start}
                self._add(target, tile, layer, uploaded, {"QUADS": len(some)}, values)
        except BaseException:
            owner.release()
            raise
        finally:
            scratch.release()
        return GLTerms(layer, 16 * box[2] * box[3] * len(quads), box, quads, owner)

    def _gathered_terms(self, tile: GLTile, layer: SpreadLayer) -> GLTerms | None:
        place = tile.parts[layer.part]
        if place is None:
            return None
        numbers, box = place
        values = {"part": numbers, "samples": tile.samples, "origin": box[:2]}
        owner = Owner(self.context)
        try:
            quads = tuple(owner.texture(box[2:], 4) for _ in range(layer.rank // 4))
            self._gathering.terms(quads, layer, self.filtering == "mipmapped", framed(tile, layer), values)
        except BaseException:
            owner.release()
            raise
        return GLTerms(layer, 16 * box[2] * box[3] * len(quads), box, quads, owner)

    def _shade(self, piece: Piece, layers: Sequence[Layer | SpreadLayer], count: int) -> Float[np.ndarray, "M h w 3"]:
        # Terms that serve one draw call are folded in it; more calls look factors up once.
        kept, direct = with_and_without_terms(layers, self.keeps_terms or count > MOST_SPECTRA)
        self._keep_terms(piece, {layer.terms_key for layer in kept})
        out = np.zeros((count, *self._coverage_of(piece).shape, 3), dtype=np.float32)
        for start in range(0, count, MOST_SPECTRA):
            stop = min(start + MOST_SPECTRA, count)
            out[start:stop] = self._drawn_by(piece, kept, direct, slice(3 * start, 3 * stop))
        if not self.keeps_terms:
            self._keep_terms(piece, ())
        return out

    def _drawn_by(
        self, piece: Piece, kept: Sequence[Layer | SpreadLayer], direct: Sequence[Layer | SpreadLayer], columns: slice
    ) -> Float[np.ndarray, "m h w 3"]:
        """Pictures of the spectra that `columns` of the layers' colours are of, from kept terms or directly."""
        owner = Owner(self.context)
        try:
            pictures = self._painted(owner, piece, kept, direct, columns)
            return np.stack([read(picture)[..., :3] for picture in pictures])
        finally:
            owner.release()

    def _painted(
        self,
        owner: Owner,
        piece: Piece,
        kept: Sequence[Layer | SpreadLayer],
        direct: Sequence[Layer | SpreadLayer],
        columns: slice,
    ) -> list[moderngl.Texture]:
        """`_drawn_by` as textures that `owner` keeps."""
        height, width = self._coverage_of(piece).shape
        pictures = [owner.texture((width, height), 4) for _ in range(columns.start, columns.stop, 3)]
        target = owner.keep(self.context.framebuffer(pictures))
        target.clear()
        self._add_at_once(target, owner, piece, direct, columns)
        self._add_folded(target, owner, piece, kept, columns)
        return pictures

    def _add_at_once(
        self,
        target: moderngl.Framebuffer,
        owner: Owner,
        piece: Piece,
        layers: Sequence[Layer | SpreadLayer],
        columns: slice,
    ) -> None:
        # Parts share materials: each summand is laid out and uploaded once.
        known: dict[int, Uploaded] = {}
        for layer in layers:
            tile = self._tile_of(piece)
            place = tile.parts[layer.part]
            if place is None:
                continue
            palette, shape = palette_of(owner, layer, columns)
            if isinstance(layer, SpreadLayer):
                values = {"part": place[0], "samples": tile.samples, "origin": (0, 0), "palette_shape": shape}
                samplers = {**framed(tile, layer), "palette": palette}
                filtered = self.filtering == "mipmapped"
                self._gathering.pictures(target, place[1], layer, filtered, samplers, values)
                continue
            if id(layer.summand) not in known:
                known[id(layer.summand)] = self._uploaded(owner, layer.summand)
            written = {"SPECTRA": len(target.color_attachments)}
            values = {"rows": -(-layer.summand.rank // 4), "palette_shape": shape}
            self._add(target, tile, layer, known[id(layer.summand)], written, values, {"palette": palette})

    def _add_folded(
        self,
        target: moderngl.Framebuffer,
        owner: Owner,
        piece: Piece,
        layers: Sequence[Layer | SpreadLayer],
        columns: slice,
    ) -> None:
        for layer, terms in self._with_terms(piece, layers, True):
            palette, shape = palette_of(owner, layer, columns)
            for row in range(0, len(terms.quads), MOST_QUADS):
                quads = terms.quads[row : row + MOST_QUADS]
                self._passes.fold(target, terms.box, len(target.color_attachments), quads, row, palette, shape)


def with_and_without_terms(
    layers: Sequence[Layer | SpreadLayer], keep: bool
) -> tuple[list[Layer | SpreadLayer], list[Layer | SpreadLayer]]:
    """The layers that are drawn from terms, and those that are drawn at once: what mixes entries of its palette has no
    terms of a pixel that could be kept.
    """
    kept = [
        one
        for one in layers
        if keep and (isinstance(one, SpreadLayer) or one.summand.palette.entries == one.summand.mixed == 1)
    ]
    return kept, [one for one in layers if one not in kept]


def palette_of(owner: Owner, layer: Layer | SpreadLayer, columns: slice) -> tuple[moderngl.Texture, tuple[int, int]]:
    """Some columns of a layer's colours as `fold.glsl` reads them, and their shape there; kept by `owner`."""
    texels, shape = palette_texels(layer.colours[..., columns])
    return owner.texels(texels), shape
