"""Live rendering on the GPU: several sides of a comparison at once, one window of the image at a time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...lighting.camera import Camera
from ..render.cache import KEPT_TERMS, Backend, Piece
from ..render.geometry import knows_geometry
from ..render.indirect_cache import IndirectCache
from ..render.layers import AnyLayer
from ..render.scene_layers import LayerBuilder, RenderSettings
from ..render.session import RenderSession, Target
from ..render.view import view_key
from .backend import GLBackend
from .full_screen import FullScreen
from .programs import Programs
from .resources import Owner
from .side import CanvasSide
from .side_layers import PreparedSide, SideLayers
from .tile import GLTerms

if TYPE_CHECKING:
    import moderngl


#: Box of pixels: left, top, width and height.
Box = tuple[int, int, int, int]
# Columns of a layer's colours for one spectrum.
_XYZ = slice(0, 3)
# Number of states with cached indirect light: of two sides, a part as is and black.
_KEPT_STATES = 4


class Canvas(Target):
    """Texture to draw onto: RGBA32F, XYZ premultiplied by coverage and coverage, row 0 on top."""

    count = 1

    def __init__(self, texture: moderngl.Texture) -> None:
        self.texture = texture
        self._put = FullScreen(texture.ctx, "put.frag", {"PICTURE": 1, "COVERAGE": 1})

    def put(self, backend: Backend, piece: Piece, first: int, images: Sequence[moderngl.Texture]) -> None:
        """Copy a window's image to its place on the canvas."""
        owner = Owner(self.texture.ctx)
        try:
            covered = owner.texture(piece.size, 1, piece.coverage.tobytes())
            _put_window(self._put, self.texture, piece, images[0], covered)
        finally:
            owner.release()

    def release(self) -> None:
        """Free the program; the texture is kept."""
        self._put.release()


def _put_window(
    put: FullScreen, onto: moderngl.Texture, piece: Piece, image: moderngl.Texture, covered: moderngl.Texture
) -> None:
    """Copy a window's image and coverage to their place on a canvas."""
    corner = piece.left, piece.top
    put.draw(onto, {"picture": image, "coverage": covered}, {"corner": corner}, (*corner, *piece.size))


class LiveSession:
    """Render session for the sides of a comparison, drawn onto canvases in steps.

    Canvases are textures as in `Canvas`. `sides` prepares the layers.
    """

    def __init__(self, backend: GLBackend, settings: RenderSettings, like: LiveSession | None = None) -> None:
        """Create a session on a back end, which is closed with it.

        like : another session of the same context, whose programs and light caches are shared; it must be closed later.
        """
        if like is None:
            layers = LayerBuilder(bounces=IndirectCache(_KEPT_STATES))
        else:
            backend.passes.use_programs_of(like._backend.passes)
            layers = LayerBuilder(like.session.layers.lights, like.session.layers.bounces)
        self.session = RenderSession(backend, settings, layers)
        self.sides = SideLayers(self.session)
        #: Limit of cached terms of an image, bytes.
        self.most_terms = 2 * KEPT_TERMS
        self._backend, self._cache = backend, self.session.cache
        self._context = backend.context
        # Terms and coverage of the whole image, valid while its view is cached.
        self._whole: dict[tuple, GLTerms] = {}
        self._covered: tuple[Owner, moderngl.Texture] | None = None
        self._cache.on_forget_view = self._forget_whole
        self._put = FullScreen(self._context, "put.frag", {"PICTURE": 1, "COVERAGE": 1})
        self._place = FullScreen(self._context, "put.frag", {"PICTURE": 1})
        self._cover = FullScreen(self._context, "put.frag", {"COVERAGE": 1})
        self._covering = FullScreen(self._context, "put.frag", {"PICTURE": 1, "ALPHA": 1})
        self._enlarge = [FullScreen(self._context, "enlarge.frag", kind) for kind in ({}, {"DOWN": 1})]

    @property
    def all_programs(self) -> list[Programs]:
        """Return the programs that it draws with."""
        screens = (self._put, self._place, self._cover, self._covering, *self._enlarge)
        return [self._backend.passes.programs, *(one.programs for one in screens)]

    def knows(self, prepared: PreparedSide) -> bool:
        """Return whether all of its terms are cached, so that `drawing` it only folds."""
        view, geometry = self._cache.view, self._cache.geometry
        if view is None or view_key(prepared.camera) != view_key(view.camera):
            return False
        if view.scene is not geometry or not knows_geometry(prepared.scene, geometry):
            return False
        return prepared.keys <= self._whole.keys() and not any(direct for _, direct in prepared.layers)

    def beginning(self, prepared: PreparedSide) -> Iterator[None]:
        """Perform the preparations of `drawing` in steps: the view, then each light's tables on the GPU."""
        if self.knows(prepared):
            return
        self._cache.needs = prepared.needs
        view = self._cache.turned_to(prepared.scene, prepared.camera, self.session.settings.tile_samples)
        yield
        _ = view.boxes
        yield
        for light in view.scene.lights if view.scene.tracer is None else ():
            self._backend.passes.upload_shadows(light)
            yield

    def drawing(self, prepared: PreparedSide, onto: Sequence[moderngl.Texture]) -> Iterator[tuple[int, int, Box]]:
        """Draw each side onto its canvas, of the camera's size; after each window yield the number done, the total, and
        its pixels.

        Terms of the whole image are cached once all of it is drawn, and later only folded.
        """
        if self.knows(prepared):
            self._cache.needs = prepared.needs
            self._fold(prepared, onto)
            yield 1, 1, (0, 0, *onto[0].size)
            return
        # Textures are allocated with the first window, once the view is the camera's.
        filled: dict[tuple, GLTerms] | None = None
        box: Box = (0, 0, 0, 0)

        def draw(piece: Piece) -> None:
            nonlocal filled, box
            filled = self._room(prepared) if filled is None else filled
            self._draw_piece(prepared, onto, filled, piece)
            box = (piece.left, piece.top, *piece.size)

        try:
            for done, total in self.session.in_windows(prepared.scene, prepared.camera, prepared.needs, draw):
                yield done, total, box
            self._whole |= filled or {}
            filled = None
            self._keep_coverage(onto[0])
        finally:
            for terms in (filled or {}).values():
                terms.owner.release()

    def _room(self, prepared: PreparedSide) -> dict[tuple, GLTerms]:
        """Allocate textures for missing terms of the whole image, within the limit, and free those no longer needed."""
        for key in self._whole.keys() - prepared.keys:
            self._whole.pop(key).owner.release()
        used, found = sum(terms.nbytes for terms in self._whole.values()), {}
        for layer in (layer for kept, _ in prepared.layers for layer in kept):
            key = layer.terms_key
            if key in self._whole or key in found:
                continue
            box = self._box(layer.part)
            count = -(-layer.rank // 4)
            size = 16 * box[2] * box[3] * count
            if used + size <= self.most_terms:
                owner = Owner(self._context)
                # Windows copy only the pixels that their part may touch.
                quads = tuple(owner.cleared(box[2:], 4) for _ in range(count))
                found[key] = GLTerms(layer, size, box, quads, owner)
                used += size
        return found

    def _box(self, part: int) -> Box:
        """Return the box of pixels that a part may touch, at least one."""
        view = self._cache.view
        assert view is not None
        faces = slice(*view.scene.first_face[part : part + 2])
        low, high = (one[faces] for one in view.boxes)
        size, side = np.array([view.camera.width, view.camera.height_px]), view.camera.samples
        first = np.clip(np.floor(low.min(axis=0) / side), 0, size - 1).astype(int)
        last = np.clip(np.ceil(high.max(axis=0) / side), first + 1, size).astype(int)
        return int(first[0]), int(first[1]), int(last[0] - first[0]), int(last[1] - first[1])

    def _draw_piece(
        self, prepared: PreparedSide, onto: Sequence[moderngl.Texture], filled: Mapping[tuple, GLTerms], piece: Piece
    ) -> None:
        # Terms of this window; cached ones are copied to their place in the whole.
        made: dict[tuple, GLTerms | None] = {}
        try:
            for (kept, direct), texture in zip(prepared.layers, onto, strict=True):
                folded = self._terms(kept, filled, made, piece)
                with self._backend.summed(piece, direct, folded, _XYZ) as (picture,):
                    _put_window(self._put, texture, piece, picture, piece.worked_out().covered)
        finally:
            for terms in made.values():
                if terms is not None:
                    terms.owner.release()

    def _terms(
        self,
        layers: Sequence[AnyLayer],
        filled: Mapping[tuple, GLTerms],
        made: dict[tuple, GLTerms | None],
        piece: Piece,
    ) -> Iterator[tuple[AnyLayer, GLTerms, tuple[int, int]]]:
        """Yield the layers visible in a window, with terms, for `GLBackend.summed`."""
        for layer in layers:
            key = layer.terms_key
            if key not in made and key not in self._whole:
                made[key] = self._backend.terms(piece.worked_out(), layer)
                self._copy(made[key], filled.get(key), piece)
            terms = self._whole.get(key) or filled.get(key) or made[key]
            if terms is not None:
                yield layer, terms, (0, 0) if terms is made.get(key) else (piece.left, piece.top)

    def _copy(self, made: GLTerms | None, whole: GLTerms | None, piece: Piece) -> None:
        """Copy terms of a window to their place in those of the whole image."""
        if made is None or whole is None:
            return
        corner = piece.left + made.box[0] - whole.box[0], piece.top + made.box[1] - whole.box[1]
        for small, large in zip(made.quads, whole.quads, strict=True):
            self._place.draw(large, {"picture": small}, {"corner": corner}, (*corner, *made.box[2:]))

    def _fold(self, prepared: PreparedSide, onto: Sequence[moderngl.Texture]) -> None:
        """Fold the cached terms of the whole image."""
        owner = Owner(self._context)
        try:
            coverage = self._whole_coverage(prepared)
            for (kept, _), texture in zip(prepared.layers, onto, strict=True):
                self._cover.draw(texture, {"coverage": coverage})
                target = owner.keep(self._context.framebuffer([texture]))
                for layer in kept:
                    self._backend.add_terms(target, layer, self._whole[layer.terms_key], _XYZ)
        finally:
            owner.release()

    def _keep_coverage(self, canvas: moderngl.Texture) -> None:
        """Store the coverage of a finished image, for folding onto other canvases."""
        if self._covered is None and self._whole:
            owner = Owner(self._context)
            self._covered = owner, owner.texture(canvas.size, 1)
            self._covering.draw(self._covered[1], {"picture": canvas}, {"corner": (0, 0)})

    def _whole_coverage(self, prepared: PreparedSide) -> moderngl.Texture:
        """Return the coverage of all windows, which must have been drawn."""
        if self._covered is None:
            found = self.session.coverage(prepared.scene, prepared.camera)
            owner = Owner(self._context)
            self._covered = owner, owner.texture(found.shape[::-1], 1, found.tobytes())
        return self._covered[1]

    def _forget_whole(self) -> None:
        while self._whole:
            self._whole.popitem()[1].owner.release()
        if self._covered is not None:
            self._covered[0].release()
            self._covered = None

    def draw(self, sides: Sequence[CanvasSide], camera: Camera, onto: Sequence[moderngl.Texture]) -> None:
        """Draw all of each side at once."""
        for _ in self.drawing(self.sides.prepared(sides, camera), onto):
            pass

    def enlarge(self, small: moderngl.Texture, onto: moderngl.Texture) -> None:
        """Enlarge a canvas to another one, with cubic interpolation."""
        owner = Owner(self._context)
        try:
            wide = owner.texture((onto.width, small.height), 4)
            for one, taken, drawn, axis in zip(self._enlarge, (small, wide), (wide, onto), (0, 1), strict=True):
                one.draw(drawn, {"small": taken}, {"scale": small.size[axis] / onto.size[axis]})
        finally:
            owner.release()

    def close(self) -> None:
        """Release all resources; do not use it afterwards."""
        self._backend.make_current()
        for one in (self._put, self._place, self._cover, self._covering, *self._enlarge):
            one.release()
        self.session.close()
