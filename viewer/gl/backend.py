"""Headless OpenGL back end of render sessions, and the choice between it and numpy."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from ...materials.core.fast import Summand, TermShader
from ...runtime.errors import InputError
from ..render.cache import Backend, Needs, Piece
from ..render.geometry import LightGeometry
from ..render.holes import reaching_texels, seen_texels
from ..render.layers import AnyLayer, Layer, SpreadLayer, split_by_terms
from ..render.raster import TileWindow, WindowTriangles
from ..render.scene_layers import Filtering, RenderSettings
from ..render.session import RenderSession
from ..render.surfaces import surface_samples
from ..render.view import View
from ..software.backend import software_session
from .context import NoGL, create_context, describe, make_current, release_context
from .environment_light import GLGathering
from .passes import MOST_QUADS, MOST_SPECTRA, Passes
from .resources import (
    MOST_TRIANGLES,
    ROW_LENGTH,
    Owner,
    TriangleTables,
    palette_texels,
    release_spares,
)
from .tile import GLTerms, GLTile, area_light_textures, part_places, read

if TYPE_CHECKING:
    import moderngl

# Shader of a summand, and its textures by name.
Uploaded = tuple[TermShader, "dict[str, moderngl.Texture]"]


def create_session(filtering: Filtering = "linear", keeps_terms: bool = True) -> tuple[RenderSession, NoGL | None]:
    """Make a session on OpenGL, or on numpy together with the reason why OpenGL is unavailable; see
    `RenderSettings`.
    """
    try:
        return gl_session(filtering=filtering, keeps_terms=keeps_terms), None
    except NoGL as reason:
        return software_session(filtering, keeps_terms), reason


def gl_session(
    context: moderngl.Context | None = None, filtering: Filtering = "linear", keeps_terms: bool = False
) -> RenderSession:
    """Make a session on OpenGL; see `GLBackend` and `RenderSettings`.

    Raises
    ------
    NoGL : no context can be made.
    """
    return RenderSession(GLBackend(context), RenderSettings(filtering, keeps_terms))


class GLBackend(Backend):
    """Back end on OpenGL 4.10 core, headless.

    Parameters
    ----------
    context : a context to share; by default one is created, and released with the back end.

    Raises
    ------
    NoGL : no context can be made.
    """

    chunk = MOST_SPECTRA

    def __init__(self, context: moderngl.Context | None = None) -> None:
        self._owns_context = context is None
        self.context = create_context() if context is None else context
        self.make_current()
        self.name = describe(self.context)
        self.passes = Passes(self.context)
        self._gathering = GLGathering(self.context, self.passes)

    def make_current(self) -> None:
        """Make the back end's context current on this thread."""
        make_current(self.context)

    def close(self) -> None:
        """Release all programs, and the context if it was created here; do not use the back end afterwards."""
        self.make_current()
        self._gathering.release()
        self.passes.release()
        release_spares(self.context)
        if self._owns_context:
            release_context(self.context)

    def keep_lights(self, lights: Collection[LightGeometry]) -> None:
        """Free the shadow tables of all lights but these."""
        self.passes.keep_shadows(list(lights))

    def tile(self, view: View, window: TileWindow, triangles: WindowTriangles, needs: Needs) -> GLTile:
        """Draw the visible geometry at a window's samples into textures."""
        scene = view.scene
        if max(len(triangles.parent), len(scene.faces)) >= MOST_TRIANGLES:
            raise InputError("too many triangles", found=len(scene.faces), expected=f"below {MOST_TRIANGLES}")
        side = view.camera.samples
        owner, scratch = Owner(self.context), Owner(self.context)
        try:
            surface = None if scene.tracer is None else surface_samples(view, window, triangles)
            size = (window.width, window.height)
            tables = self.passes.triangles(scratch, view, triangles)
            if surface is None:
                seen = self.passes.visibility(owner, window, tables)
            else:
                seen = owner.texture(size, 1, seen_texels(surface, window).tobytes())
            free = [
                None
                if surface is None
                else scratch.texture(size, 1, reaching_texels(view, light, surface, window).tobytes())
                for light in scene.lights
            ]
            lights = tuple(
                self.passes.light(owner, view, light, seen, tables, needs.mipmapped, share)
                for light, share in zip(scene.lights, free, strict=True)
            )
            uv = self.passes.uv(owner, view.uv(triangles), seen, tables) if needs.uv else ()
            frames: tuple[moderngl.Texture, ...] = ()
            if needs.frames:
                frames = (
                    *self.passes.frames(owner, view, seen, tables),
                    *self._standing(owner, view, seen, tables, triangles),
                )
            covered = self.passes.coverage(owner, seen, side)
        except BaseException:
            owner.release()
            raise
        finally:
            scratch.release()
        parts = part_places(triangles, scene.first_face, side, covered.size)
        return GLTile(needs, parts, side, covered, seen, uv, frames, lights, owner)

    def _standing(
        self, owner: Owner, view: View, seen: moderngl.Texture, tables: TriangleTables, triangles: WindowTriangles
    ) -> tuple[moderngl.Texture, moderngl.Texture]:
        """Return textures of the barycentric weights of the second and third corner at every sample, and of each
        triangle's index + 1, negative if its back is seen, with its normal on the viewer's side.
        """
        scratch = Owner(self.context)
        try:
            corners = np.tile(np.eye(3)[:, 1:], (len(triangles.parent), 1, 1))
            corners[triangles.cut] = triangles.weights[:, :, 1:]
            weights, _ = self.passes.uv(scratch, corners, seen, tables)
            kept = owner.texture(weights.size, 2, weights.read())
        finally:
            scratch.release()
        side = view.side[triangles.parent]
        normals = view.scene.face_normals[triangles.parent] * side[:, None]
        faces = np.column_stack([side * (triangles.parent + 1), normals]).astype(np.float32)
        return kept, owner.table(faces, ROW_LENGTH)

    def discard(self, kept: Any) -> None:
        """Free the textures of a tile or of terms."""
        kept.owner.release()

    def _uploaded(self, owner: Owner, summand: Summand, mipmapped: bool) -> Uploaded:
        made = summand.shader(mipmapped)
        sizes = {"MIXED": summand.mixed, **made.sizes}
        sizes |= {"MIPMAPPED": 1} if mipmapped else {}
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
        """Add a layer under each of its lights: folded with `palette` if given, else its terms."""
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
            self.passes.shade(target, None if palette is None else box, written, made, samplers, given)

    def terms(self, tile: GLTile, layer: AnyLayer) -> GLTerms | None:
        """Draw a layer's terms into textures, four per texel."""
        if isinstance(layer, SpreadLayer):
            return self._gathered_terms(tile, layer)
        place = tile.parts[layer.part]
        if place is None:
            return None
        _, box = place
        owner, scratch = Owner(self.context), Owner(self.context)
        try:
            uploaded = self._uploaded(scratch, layer.summand, tile.needs.mipmapped)
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
            self._gathering.terms(quads, layer, tile.needs.mipmapped, area_light_textures(tile, layer), values)
        except BaseException:
            owner.release()
            raise
        return GLTerms(layer, 16 * box[2] * box[3] * len(quads), box, quads, owner)

    @contextmanager
    def added_up(
        self, piece: Piece, layers: Sequence[AnyLayer], columns: slice, keep: bool, count: int
    ) -> Iterator[Sequence[moderngl.Texture]]:
        """Add up layers into textures RGBA32F; see `Backend.added_up`."""
        # Terms of a single draw call are folded in it; with more calls factors are looked up only once.
        kept, direct = split_by_terms(layers, keep or count > MOST_SPECTRA)
        piece.keep_terms({layer.terms_key for layer in kept})
        folded = ((layer, terms, (0, 0)) for layer, terms in piece.with_terms(kept, True))
        with self.summed(piece, direct, folded, columns) as pictures:
            yield pictures

    @contextmanager
    def summed(
        self,
        piece: Piece,
        direct: Sequence[AnyLayer],
        folded: Iterable[tuple[AnyLayer, GLTerms, tuple[int, int]]],
        columns: slice,
    ) -> Iterator[Sequence[moderngl.Texture]]:
        """Add up layers in a window, drawn directly or folded from terms, into textures RGBA32F that are valid within
        the context.

        folded : layers with their terms, and the window's first pixel in the image that the terms' box refers to.
        """
        owner = Owner(self.context)
        try:
            pictures = [owner.texture(piece.size, 4) for _ in range(columns.start, columns.stop, 3)]
            target = owner.keep(self.context.framebuffer(pictures))
            target.clear()
            self._add_at_once(target, owner, piece, direct, columns)
            for layer, terms, corner in folded:
                self.add_terms(target, layer, terms, columns, corner)
            yield pictures
        finally:
            owner.release()

    def pixels(self, image: moderngl.Texture) -> Float[np.ndarray, "h w 3"]:
        """Read a texture back."""
        return read(image)[..., :3]

    def _add_at_once(
        self,
        target: moderngl.Framebuffer,
        owner: Owner,
        piece: Piece,
        layers: Sequence[AnyLayer],
        columns: slice,
    ) -> None:
        """Add layers to a target without caching their terms."""
        # Parts share materials, so each summand is uploaded once.
        known: dict[int, Uploaded] = {}
        for layer in layers:
            tile = piece.worked_out()
            place = tile.parts[layer.part]
            if place is None:
                continue
            palette, shape = _palette_of(owner, layer, columns)
            if isinstance(layer, SpreadLayer):
                values = {"part": place[0], "samples": tile.samples, "origin": (0, 0), "palette_shape": shape}
                samplers = {**area_light_textures(tile, layer), "palette": palette}
                self._gathering.pictures(target, place[1], layer, tile.needs.mipmapped, samplers, values)
                continue
            if id(layer.summand) not in known:
                known[id(layer.summand)] = self._uploaded(owner, layer.summand, tile.needs.mipmapped)
            written = {"SPECTRA": len(target.color_attachments)}
            values = {"rows": -(-layer.summand.rank // 4), "palette_shape": shape}
            self._add(target, tile, layer, known[id(layer.summand)], written, values, {"palette": palette})

    def add_terms(
        self,
        target: moderngl.Framebuffer,
        layer: AnyLayer,
        terms: GLTerms,
        columns: slice,
        corner: tuple[int, int] = (0, 0),
    ) -> None:
        """Fold terms and add them to a target, whose first pixel is `corner` of the image that their box refers to."""
        left, top = terms.box[0] - corner[0], terms.box[1] - corner[1]
        low = max(left, 0), max(top, 0)
        high = min(left + terms.box[2], target.width), min(top + terms.box[3], target.height)
        if high[0] <= low[0] or high[1] <= low[1]:
            return
        box = (*low, high[0] - low[0], high[1] - low[1])
        spectra = len(target.color_attachments)
        colours = layer.colours[0, :, columns]
        padded = np.pad(colours, ((0, 4 * len(terms.quads) - len(colours)), (0, 0))).astype(np.float32)
        weights = padded.reshape(len(terms.quads), 4, -1).transpose(0, 2, 1)
        for row in range(0, len(terms.quads), MOST_QUADS):
            some = slice(row, row + MOST_QUADS)
            self.passes.fold(target, box, spectra, terms.quads[some], weights[some], (left, top))


def _palette_of(owner: Owner, layer: AnyLayer, columns: slice) -> tuple[moderngl.Texture, tuple[int, int]]:
    """Upload some columns of a layer's colours for `fold.glsl`; return the texture and its layout."""
    texels, shape = palette_texels(layer.colours[..., columns])
    return owner.texels(texels), shape
