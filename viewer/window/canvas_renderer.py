"""Progressive rendering of both sides of a comparison onto canvases: a preview at once, the exact image in small steps.

During motion, a simplified scene is drawn with one sample per pixel and fewer pixels. A still view is drawn with all
triangles at one sample, and then exactly like the headless renderer, one window at a time. If only spectra or observers
change, cached terms are folded and the image stays exact. While expensive shadows of area and environment lights are
computed, a coarse ray-traced image shows them (`first_picture`).
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from enum import IntEnum
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from ...lighting.camera import Camera
from ...runtime.errors import MetamerError
from ..gl.backend import GLBackend
from ..gl.live import Box, LiveSession
from ..gl.resources import Owner
from ..gl.side import CanvasSide
from ..gl.side_layers import PreparedSide
from ..render.geometry import knows_geometry, same_geometry
from ..render.light_cache import LightCache
from ..render.scene_layers import VISIBILITY, RenderSettings
from .background import Background
from .coarseness import SLOW, Coarseness
from .display_pass import Whites
from .first_picture import FirstPicture, first_pictures, seen_points
from .sides import SessionObjects
from .state import Session
from .view_error import Tracers
from .viewpoint import Viewpoint
from .work import Work

if TYPE_CHECKING:
    import moderngl

Clock = Callable[[], float]
# Target seconds per window of a still image, and sides of such windows in samples.
_SLICE, _SIDES = 0.04, (192, 2048)
# Number of windows after which larger ones are tried, the required multiple of them still left, and the least growth of
# sides.
_TRIED, _MORE, _LONGER = 4, 4, 1.25
# Seconds that a step waits for background work.
_WAIT = 0.01


class Quality(IntEnum):
    """Quality of an image: fewer triangles and pixels; rays at few pixels; one sample per pixel; as rendered
    headless.
    """

    NONE = 0
    MOVING = 1
    FIRST = 2
    STILL = 3
    EXACT = 4


class _Unwanted(MetamerError):
    """Cancellation of work on light for meshes that are no longer shown."""


def _fitting_side(side: int, seconds: list[float]) -> int:
    """Return the side of windows, in samples, for the target time, given the times of windows of `side`."""
    # Not the slowest one, since a single delay would make all others small.
    typical = float(np.percentile(seconds, 75.0))
    return int(np.clip(side * np.sqrt(_SLICE / max(typical, 1e-6)), *_SIDES))


@lru_cache(maxsize=8)
def _camera(view: Viewpoint, width: int, height: int, samples: int) -> Camera:
    """Return a cached camera, since results are cached by its identity."""
    return view.camera(width, height, samples)


class CanvasRenderer:
    """Progressive renderer of a session's sides.

    Attributes
    ----------
    quality : of the canvases. reached : finished share of the exact image.
    noise : ΔE94 of an image of quality `FIRST`. shadowed : finished share of the work on shadows.
    sides : A and B, one object if they are equal.
    seconds : last duration of each kind of work, by name.
    """

    def __init__(self, context: moderngl.Context, sources: SessionObjects, clock: Clock = time.perf_counter) -> None:
        self._context, self._sources, self._clock = context, sources, clock
        self._sized = Owner(context)
        # By quality, and one more for each if side B has another geometry.
        self._renderers: dict[tuple[Quality, int], LiveSession] = {}
        self._session: Session | None = None
        self._size = (0, 0)
        self._coarseness, self._side = Coarseness(), {Quality.STILL: 256, Quality.EXACT: 256}
        self._settling: Iterator[float] | None = None
        self._working: threading.Thread | None = None
        # Meshes whose light is being computed, and shown meshes; work on others is cancelled.
        self._worked_on: tuple[int, ...] = ()
        self._shown: tuple[int, ...] = ()
        self._rays, self._tracers = Background(), Tracers()
        # Held while the seen points are set for which shadows are computed first.
        self._seeing = threading.Lock()
        self._failed: tuple[object, MetamerError] | None = None
        # Parts of the canvases still to be shown, all or windows; and a counter of drawings.
        self._to_show, self._redrawn, self._drawn = False, list[Box](), 0
        self.sides: tuple[CanvasSide, CanvasSide] | None = None
        self.quality, self.reached = Quality.NONE, 0.0
        self.noise, self.shadowed = 0.0, 0.0
        self.seconds: dict[str, float] = {}

    def release(self) -> None:
        """Free all resources and cancel background work."""
        self._stop()
        self._shown = ()
        self._rays.close()
        self._sources.close()
        if self._working is not None:
            self._working.join()
        # Before the renderers, which free pooled textures.
        self._sized.release()
        for renderer in reversed(self._renderers.values()):
            renderer.close()
        self._renderers.clear()

    @property
    def size(self) -> tuple[int, int]:
        """Size of the image: as requested, or that of side B's file."""
        return self._size

    @property
    def whites(self) -> Whites:
        """Whites of A and B."""
        assert self.sides is not None
        return self.sides[0].white, self.sides[1].white

    @property
    def canvases(self) -> tuple[moderngl.Texture, moderngl.Texture]:
        """XYZ and coverage of A and B, one texture if the sides are equal."""
        assert self.sides is not None
        first, second = self._canvases
        return first, first if self.sides[0] is self.sides[1] else second

    @property
    def camera(self) -> Camera:
        """Camera of the exact image."""
        assert self._session is not None
        return _camera(self._session.view, *self._size, self._session.samples)

    @property
    def _refused(self) -> str | None:
        """Reason why required light could not be computed; None if it was, or was not tried."""
        return str(self._failed[1]) if self._failed is not None and self._failed[0] is self.sides else None

    def _write(self, number: int, xyz: Float[np.ndarray, "H W 3"], coverage: Float[np.ndarray, "H W"]) -> None:
        values = np.concatenate([xyz, coverage[..., None]], axis=2)
        self._canvases[number].write(np.ascontiguousarray(values, dtype=np.float32).tobytes())

    def _supply(self) -> None:
        """Fill side B's canvas if it is not rendered live: with the image read, or empty before there is a
        reference.
        """
        assert self.sides is not None
        side = self.sides[1]
        if side.still is not None:
            self._write(1, side.still.xyz, side.still.coverage)
        elif side.made == "reference":
            width, height = self._size
            self._write(1, np.zeros((height, width, 3)), np.zeros((height, width)))

    def _begin(self, asked: Work, moving: bool) -> None:
        """Draw a preview at once, and leave the rest to steps."""
        self._stop()
        if not moving:
            self._coarseness.rest()
        begun = self._clock()
        self._supply()
        self._shown = self._meshes
        if asked >= Work.VIEW:
            with self._seeing:
                self._lights.find_first(None)
        if asked == Work.FOLD and self.quality == Quality.EXACT and self._folded():
            name = "light, observer"
        elif asked < Work.VIEW and self._worked_out() and self.seconds.get("still", np.inf) < SLOW:
            self._draw(Quality.STILL)
            self.quality, name = Quality.STILL, "material"
            self._settling = None if moving else self._to_exact(Quality.EXACT)
        elif self.quality == Quality.NONE and not moving and self._lacks_shadows():
            self._clear()
            self._settling, name = self._to_exact(Quality.STILL), "asked"
        else:
            self._draw_moving()
            self.quality, name = Quality.MOVING, "moving"
            self._settling = None if moving else self._to_exact(Quality.STILL)
        self._changed()
        self.seconds[name] = self._clock() - begun

    def _clear(self) -> None:
        for canvas in self._canvases:
            target = self._context.framebuffer([canvas])
            target.clear()
            target.release()

    def _folded(self) -> bool:
        """Fold the exact image if all of its terms are cached; return whether that was done."""
        ready = list(self._prepared(Quality.EXACT))
        known = all(renderer.knows(prepared) for renderer, prepared, _ in ready)
        for renderer, prepared, onto in ready if known else ():
            for _ in renderer.drawing(prepared, onto):
                pass
        return known

    def _draw_moving(self) -> None:
        begun = self._clock()
        width, height = (max(1, side // self._coarseness.pixels) for side in self._size)
        assert self._session is not None
        camera = self._session.view.camera(width, height)
        scratch = Owner(self._context)
        try:
            for number, sides, onto in self._groups():
                small = [scratch.texture((width, height), 4) for _ in sides]
                renderer = self._renderer(Quality.MOVING, number)
                moving = [self._sources.moving(side) for side in sides]
                renderer.sides.whole, renderer.session.cache.one_sided = False, self._sources.one_sided
                renderer.draw(moving, camera, small)
                self._share_geometry(number, sides[0], renderer)
                for one, canvas in zip(small, onto, strict=True):
                    renderer.enlarge(one, canvas)
            self._context.finish()
        finally:
            scratch.release()
        self._coarseness.took(self._clock() - begun)

    def _share_geometry(self, number: int, side: CanvasSide, moving: LiveSession) -> None:
        """Share the geometry of a moving image with the still one, if both have the same triangles."""
        scene, known = side.scene.cut(side.surfaces), moving.session.cache.geometry
        still = self._renderer(Quality.STILL, number).session.cache
        idle = self._working is None or not self._working.is_alive()
        if idle and knows_geometry(scene, known) and not knows_geometry(scene, still.geometry):
            still.geometry = known

    def _draw(self, quality: Quality) -> None:
        for renderer, prepared, onto in self._prepared(quality):
            for _ in renderer.drawing(prepared, onto):
                pass

    def _to_exact(self, first: Quality) -> Iterator[float]:
        """Draw window by window; yield the finished share of the exact image.

        Expensive work without the GPU runs in a thread meanwhile.
        """
        if self._lacks_shadows() and not self._has_seen_shadows():
            yield from self._first()
        seen = False
        while self._sources.pending or not self._worked_out():
            if self._failed is not None and self._failed[0] is self.sides:
                raise self._failed[1]
            if not (self._working is not None and self._working.is_alive()) and not self._worked_out():
                groups = [(self._renderer(Quality.STILL, number), sides) for number, sides, _ in self._groups()]
                self._worked_on, self.shadowed = self._meshes, 0.0
                work = groups, self.sides, (self._session, self._size)
                self._working = threading.Thread(target=self._work_out, args=work, daemon=True)
                self._working.start()
            if self._working is not None:
                self._working.join(_WAIT)
            if self._sources.pending:
                time.sleep(_WAIT)
            yield 0.0
            if not seen and self._has_seen_shadows():
                seen, begun = True, self._clock()
                for renderer, prepared, onto in self._prepared(Quality.STILL, whole=False):
                    yield from (0.0 for _ in renderer.beginning(prepared))
                    for *_, box in renderer.drawing(prepared, onto):
                        self._changed(box)
                        yield 0.0
                self.quality = Quality.STILL
                self.seconds["seen"] = self._clock() - begun
        for quality in (Quality.STILL, Quality.EXACT):
            if quality < first:
                continue
            whole = self._clock()
            for renderer, prepared, onto in self._prepared(quality):
                for share in self._in_windows(quality, renderer, prepared, onto):
                    yield share if quality == Quality.EXACT else 0.0
            self.quality = quality
            self.seconds["still" if quality == Quality.STILL else "exact"] = self._clock() - whole

    def _in_windows(
        self, quality: Quality, renderer: LiveSession, prepared: PreparedSide, onto: list[moderngl.Texture]
    ) -> Iterator[float]:
        """Draw window by window, restarting with larger ones if they are fast; yield the finished share."""
        while True:
            side = self._side[quality]
            renderer.session.configure(tile_samples=side)
            for _ in renderer.beginning(prepared):
                yield 0.0
            took: list[float] = []
            begun = self._clock()
            for done, total, box in renderer.drawing(prepared, onto):
                self._context.finish()
                took.append(self._clock() - begun)
                self._changed(box)
                yield done / total
                if done == _TRIED and total > _TRIED * (1 + _MORE):
                    fitting = _fitting_side(side, took)
                    if fitting > _LONGER * side:
                        self._side[quality] = fitting
                        break
                begun = self._clock()
            else:
                self._side[quality] = _fitting_side(side, took)
                return

    def _first(self) -> Iterator[float]:
        """Ray trace the first image in a thread, or draw a preview at once if that is not worthwhile."""
        assert self._session is not None
        groups = list(self._groups())
        sides = [one for _, some, _ in groups for one in some]
        canvases = [one for _, _, some in groups for one in some]
        asked, begun = object(), self._clock()
        work = partial(first_pictures, sides, self._session.view, self._size, self._tracers, self._lights)
        self._rays.ask("first picture", lambda: (asked, work()))
        while self._rays.busy():
            for heard in self._rays.poll():
                if heard.problem is None and heard.result[0] is asked:
                    self._put_first(heard.result[1], canvases)
                    self.seconds["first"] = self._clock() - begun
            time.sleep(_WAIT)
            yield 0.0
        if self.quality == Quality.NONE:
            self._draw_moving()
            self._changed()
            self.quality = Quality.MOVING

    def _put_first(self, pictures: list[FirstPicture], canvases: list[moderngl.Texture]) -> None:
        for picture, canvas in zip(pictures, canvases, strict=False):
            values = np.concatenate([picture.xyz, picture.coverage[..., None]], axis=2)
            height, width = picture.coverage.shape
            scratch = Owner(self._context)
            try:
                small = scratch.texture((width, height), 4, np.ascontiguousarray(values).tobytes())
                self._renderer(Quality.STILL, 0).enlarge(small, canvas)
            finally:
                scratch.release()
            self.quality, self.noise = Quality.FIRST, max(one.noise for one in pictures)
            self._changed()

    def _lacks_shadows(self) -> bool:
        """Return whether shadows of area and environment lights are missing, and rays can show them."""
        for _, sides, _ in self._groups():
            for side in sides:
                lights, scene = side.scene.spread_lights, side.scene
                if side.influence is not None or not lights:
                    return False
                if not all(self._lights.knows(light, scene) for light in lights):
                    return True
        return False

    def _has_seen_shadows(self) -> bool:
        """Return whether shadows of the visible points are available, and nothing else is missing."""
        sides = [one for _, some, _ in self._groups() for one in some]
        if any(one.influence or one.scene.bounces != 0 or not one.scene.spread_lights for one in sides):
            return False
        return all(self._lights.seen_shadows(light, one.scene) for one in sides for light in one.scene.spread_lights)

    @property
    def _lights(self) -> LightCache:
        """Light cache shared by all renderers."""
        return self._renderer(Quality.STILL, 0).session.layers.lights

    def _worked_out(self) -> bool:
        """Return whether all light for still images has been computed."""
        if self._working is not None and self._working.is_alive():
            return False
        return all(
            self._renderer(Quality.STILL, number).sides.has_worked_out(sides) for number, sides, _ in self._groups()
        )

    def _work_out(
        self,
        groups: list[tuple[LiveSession, list[CanvasSide]]],
        asked_for: object,
        seen: tuple[Session, tuple[int, int]],
    ) -> None:
        try:
            if self._lacks_shadows():
                self._find_first(groups[0][1][0], *seen)
            for renderer, sides in groups:
                renderer.sides.work_out(sides)
        except _Unwanted:
            pass
        except MetamerError as reason:
            self._failed = asked_for, reason

    def _find_first(self, side: CanvasSide, session: Session, size: tuple[int, int]) -> None:
        """Request the shadows of visible points first, if they are still visible once known."""
        points = seen_points(side.scene.cut(side.surfaces), session.view, size, self._tracers)
        with self._seeing:
            if self._session is not None and (self._session.view, self._size) == (session.view, size):
                self._lights.find_first(points)

    @property
    def _meshes(self) -> tuple[int, ...]:
        """Identities of the meshes of both sides."""
        return tuple(id(part.mesh) for _, sides, _ in self._groups() for part in sides[0].scene.parts)

    def _on_progress(self, done: int, total: int, work: str) -> None:
        """Record the progress of work on light; cancel it if its meshes are no longer shown."""
        if threading.current_thread() is not self._working:
            return
        if self._worked_on != self._shown:
            raise _Unwanted("this scene is not shown any more")
        if work == VISIBILITY:
            self.shadowed = done / max(total, 1)

    def _prepared(
        self, quality: Quality, whole: bool = True
    ) -> Iterator[tuple[LiveSession, PreparedSide, list[moderngl.Texture]]]:
        """Yield what each geometry's renderer has to draw at a quality, and the canvases."""
        assert self._session is not None
        samples = self._session.samples if quality == Quality.EXACT else 1
        camera = _camera(self._session.view, *self._size, samples)
        for number, sides, onto in self._groups():
            renderer = self._renderer(quality, number)
            if quality == Quality.EXACT:
                still = self._renderer(Quality.STILL, number).session.cache
                renderer.session.cache.geometry = still.geometry or renderer.session.cache.geometry
            renderer.sides.whole = whole or quality == Quality.EXACT
            yield renderer, renderer.sides.prepared(sides, camera), onto

    def _groups(self) -> Iterator[tuple[int, list[CanvasSide], list[moderngl.Texture]]]:
        """Yield the sides drawn by one renderer, and their canvases: all, or each separately if their geometry
        differs.
        """
        assert self.sides is not None
        first, second = self.sides
        if first is second or second.made != "fast":
            yield 0, [first], [self._canvases[0]]
        elif same_geometry(first.scene, second.scene):
            yield 0, [first, second], list(self._canvases)
        else:
            yield 0, [first], [self._canvases[0]]
            yield 1, [second], [self._canvases[1]]

    def _renderer(self, quality: Quality, number: int) -> LiveSession:
        if (quality, number) not in self._renderers:
            like = next(iter(self._renderers.values()), None)
            settings = RenderSettings(keeps_terms=quality == Quality.EXACT, on_progress=self._on_progress)
            self._renderers[quality, number] = LiveSession(GLBackend(self._context), settings, like)
        return self._renderers[quality, number]

    def _changed(self, box: Box | None = None) -> None:
        """Mark a box of the canvases to be shown; None: all."""
        self._drawn += 1
        if box is None:
            self._to_show = True
        else:
            self._redrawn.append(box)

    def _resize(self, size: tuple[int, int]) -> None:
        if size == self._size:
            return
        self._stop()
        self._sized.release()
        self._size = size
        self._canvases = self._sized.texture(size, 4), self._sized.texture(size, 4)
        self._differences = self._sized.texture(size, 1)
        self._changed()

    def _stop(self) -> None:
        """Stop progressive work before its inputs change."""
        if self._settling is not None:
            self._settling.close()
        self._settling, self.reached = None, 0.0
