"""Pictures that stay on the GPU: several sides of a comparison at once, a window of the picture at a time.

The passes are those of `GLRenderer`; what it would read back is put into textures instead.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...lighting.camera import Camera
from ..render.geometry import SceneGeometry, knows_geometry
from ..render.keeping import KEPT_TERMS, Layer, Piece, SpreadLayer
from ..render.view import View, view_key, window_count
from .full_screen import FullScreen
from .passes import MOST_QUADS
from .programs import Programs
from .renderer import palette_of
from .resources import Owner
from .side import Side
from .side_layers import Prepared, SideRenderer
from .tile import GLTerms

if TYPE_CHECKING:
    import moderngl


# Columns of a layer's colours: those of its one spectrum.
_XYZ = slice(0, 3)


class LiveRenderer(SideRenderer):
    """A renderer that draws onto canvases: textures, RGBA32F, XYZ premultiplied by coverage and coverage, row 0 on
    top; in steps.
    """

    def __init__(
        self, context: moderngl.Context | None = None, keeps_terms: bool = False, like: LiveRenderer | None = None
    ) -> None:
        """`like` : another one of the same context, whose programs are used; it is closed after this."""
        super().__init__(context, keeps_terms=keeps_terms)
        #: Bytes of terms that are kept of a picture.
        self.most_terms = 2 * KEPT_TERMS
        #: Parts whose triangles are not drawn from behind, by their meshes' identities.
        self.one_sided: frozenset[int] = frozenset()
        self._whole: dict[tuple, GLTerms] = {}
        self._covered: tuple[Owner, moderngl.Texture] | None = None
        if like is not None:
            self._passes.use_programs_of(like._passes)
            self.share_light(like)
        self._put = FullScreen(self.context, "put.frag", {"PICTURE": 1, "COVERAGE": 1})
        self._place = FullScreen(self.context, "put.frag", {"PICTURE": 1})
        self._cover = FullScreen(self.context, "put.frag", {"COVERAGE": 1})
        self._enlarge = FullScreen(self.context, "enlarge.frag")

    @property
    def all_programs(self) -> list[Programs]:
        """Those that are drawn with."""
        return [self._passes.programs, *(one.programs for one in (self._put, self._place, self._cover, self._enlarge))]

    def knows(self, prepared: Prepared) -> bool:
        """Whether all of its terms are kept, so that `drawing` it is a fold."""
        if self._view is None or view_key(prepared.camera) != view_key(self._view.camera):
            return False
        if self._view.scene is not self._geometry:
            return False
        if not knows_geometry(prepared.scene, self._geometry):
            return False
        return prepared.keys <= self._whole.keys() and not any(direct for _, direct in prepared.layers)

    def beginning(self, prepared: Prepared) -> Iterator[None]:
        """What `drawing` would begin with, in steps of its own: the view, then each light's tables on the GPU."""
        if self.knows(prepared):
            return
        self._with_uv, self._with_frames = prepared.with_uv, prepared.with_frames
        view = self._turned_to(prepared.scene, prepared.camera)
        yield
        _ = view.boxes
        yield
        for light in view.scene.lights if view.scene.tracer is None else ():
            self._passes.upload_shadows(light)
            yield

    def _viewed(self, geometry: SceneGeometry, camera: Camera) -> View:
        view = super()._viewed(geometry, camera)
        solid = [id(mesh) in self.one_sided for mesh in geometry.meshes]
        if not any(solid):
            return view
        return replace(view, left_out=np.repeat(solid, np.diff(geometry.first_face)) & (view.side < 0.0))

    def drawing(self, prepared: Prepared, onto: Sequence[moderngl.Texture]) -> Iterator[tuple[int, int]]:
        """Draw each side onto its canvas, of the camera's size; yields windows done and windows in all after each.

        Terms are kept for the whole picture once all of it is drawn: then they are folded at once.
        """
        self._with_uv, self._with_frames = prepared.with_uv, prepared.with_frames
        if self.knows(prepared):
            self._fold(prepared, onto)
            yield 1, 1
            return
        total = window_count(prepared.camera, self.tile_samples)
        filled: dict[tuple, GLTerms] = {}
        try:
            for number, piece in enumerate(self._pieces(prepared.scene, prepared.camera), 1):
                if number == 1:
                    filled = self._room(prepared)
                self._draw_piece(prepared, onto, piece, filled)
                yield number, total
            self._whole |= filled
            filled = {}
        finally:
            for terms in filled.values():
                terms.owner.release()

    def _room(self, prepared: Prepared) -> dict[tuple, GLTerms]:
        """Empty textures for the terms of the whole picture that are not kept, as far as there is room; what is not
        asked for any more is forgotten.
        """
        for key in self._whole.keys() - prepared.keys:
            self._whole.pop(key).owner.release()
        used, found = sum(terms.nbytes for terms in self._whole.values()), {}
        for layer in (layer for kept, _ in prepared.layers for layer in kept):
            key = layer.terms_key
            if key in self._whole or key in found:
                continue
            box, rank = self._box(layer.part), layer.rank if isinstance(layer, SpreadLayer) else layer.summand.rank
            count = -(-rank // 4)
            size = 16 * box[2] * box[3] * count
            if used + size <= self.most_terms:
                owner = Owner(self.context)
                found[key] = GLTerms(layer, size, box, tuple(owner.texture(box[2:], 4) for _ in range(count)), owner)
                used += size
        return found

    def _box(self, part: int) -> tuple[int, int, int, int]:
        """Pixels that a part may touch, one at least: left, top, width and height."""
        view = self._view
        assert view is not None
        faces = slice(*view.scene.first_face[part : part + 2])
        low, high = (one[faces] for one in view.boxes)
        size, side = np.array([view.camera.width, view.camera.height_px]), view.camera.samples
        first = np.clip(np.floor(low.min(axis=0) / side), 0, size - 1).astype(int)
        last = np.clip(np.ceil(high.max(axis=0) / side), first + 1, size).astype(int)
        return int(first[0]), int(first[1]), int(last[0] - first[0]), int(last[1] - first[1])

    def _draw_piece(
        self, prepared: Prepared, onto: Sequence[moderngl.Texture], piece: Piece, filled: Mapping[tuple, GLTerms]
    ) -> None:
        owner = Owner(self.context)
        # Terms of this window: what is kept is copied to its place in the whole.
        made: dict[tuple, GLTerms | None] = {}
        try:
            known = self._coverage_of(piece)
            size = known.shape[::-1]
            coverage = owner.texture(size, 1, known.tobytes())
            for (kept, direct), texture in zip(prepared.layers, onto, strict=True):
                picture = owner.texture(size, 4)
                target = owner.keep(self.context.framebuffer([picture]))
                target.clear()
                self._add_at_once(target, owner, piece, direct, _XYZ)
                for layer in kept:
                    key = layer.terms_key
                    if key not in made and key not in self._whole:
                        made[key] = self._terms(self._tile_of(piece), layer)
                        self._copy(made[key], filled.get(key), piece)
                    terms = self._whole.get(key) or filled.get(key) or made[key]
                    corner = (0, 0) if terms is made.get(key) else (piece.left, piece.top)
                    self._add_folded_terms(target, owner, layer, terms, corner)
                box = (piece.left, piece.top, *size)
                self._put.draw(texture, {"picture": picture, "coverage": coverage}, {"corner": box[:2]}, box)
        finally:
            for terms in made.values():
                if terms is not None:
                    terms.owner.release()
            owner.release()

    def _copy(self, made: GLTerms | None, whole: GLTerms | None, piece: Piece) -> None:
        """Terms of a window to their place in those of the whole picture."""
        if made is None or whole is None:
            return
        corner = piece.left + made.box[0] - whole.box[0], piece.top + made.box[1] - whole.box[1]
        for small, large in zip(made.quads, whole.quads, strict=True):
            self._place.draw(large, {"picture": small}, {"corner": corner}, (*corner, *made.box[2:]))

    def _add_folded_terms(
        self,
        target: moderngl.Framebuffer,
        owner: Owner,
        layer: Layer | SpreadLayer,
        terms: GLTerms | None,
        corner: tuple[int, int],
    ) -> None:
        """Add terms, folded, to a picture whose first pixel is `corner` of that which their box is in."""
        if terms is None:
            return
        left, top = terms.box[0] - corner[0], terms.box[1] - corner[1]
        low = max(left, 0), max(top, 0)
        high = min(left + terms.box[2], target.width), min(top + terms.box[3], target.height)
        if high[0] <= low[0] or high[1] <= low[1]:
            return
        palette, shape = palette_of(owner, layer, _XYZ)
        box = (*low, high[0] - low[0], high[1] - low[1])
        for row in range(0, len(terms.quads), MOST_QUADS):
            some = terms.quads[row : row + MOST_QUADS]
            self._passes.fold(target, box, 1, some, row, palette, shape, (left, top))

    def _fold(self, prepared: Prepared, onto: Sequence[moderngl.Texture]) -> None:
        """Fold the kept terms of the whole picture."""
        owner = Owner(self.context)
        try:
            coverage = self._whole_coverage(prepared.camera)
            for (kept, _), texture in zip(prepared.layers, onto, strict=True):
                self._cover.draw(texture, {"coverage": coverage})
                target = owner.keep(self.context.framebuffer([texture]))
                for layer in kept:
                    self._add_folded_terms(target, owner, layer, self._whole[layer.terms_key], (0, 0))
        finally:
            owner.release()

    def _whole_coverage(self, camera: Camera) -> moderngl.Texture:
        """The coverage of all windows, which are drawn already."""
        if self._covered is None:
            found = np.zeros((camera.height_px, camera.width), dtype=np.float32)
            for piece in self._kept:
                known = self._coverage_of(piece)
                height, width = known.shape
                found[piece.top : piece.top + height, piece.left : piece.left + width] = known
            owner = Owner(self.context)
            size = camera.width, camera.height_px
            self._covered = owner, owner.texture(size, 1, found.tobytes())
        return self._covered[1]

    def _forget_view(self) -> None:
        super()._forget_view()
        while self._whole:
            self._whole.popitem()[1].owner.release()
        if self._covered is not None:
            self._covered[0].release()
            self._covered = None

    def forget_view(self) -> None:
        """Draw all of the next picture anew, terms and all."""
        self._forget_view()

    def draw(self, sides: Sequence[Side], camera: Camera, onto: Sequence[moderngl.Texture]) -> None:
        """Draw all of each side at once."""
        for _ in self.drawing(self.prepared(sides, camera), onto):
            pass

    def enlarge(self, small: moderngl.Texture, onto: moderngl.Texture) -> None:
        """Fill one canvas with another, linearly between its pixels."""
        self._enlarge.draw(onto, {"small": small}, {"scale": tuple(np.divide(small.size, onto.size))})

    def close(self) -> None:
        """Release everything, as of `GLRenderer`."""
        for one in (self._put, self._place, self._cover, self._enlarge):
            one.release()
        super().close()
