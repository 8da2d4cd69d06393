"""Image of a session, updated in small steps: rendered, compared and displayed."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float, UInt8

from ...calibration.report.statistics import DeltaEStatistics, delta_e_statistics
from ...materials.catalogue.catalogue import Catalogue
from ...materials.search.edited_material import VariedCatalogue
from ...runtime.distribution import installed_version
from ...runtime.errors import InputError, MetamerError
from ...spectral.formats.xyz_exr import write_xyz_exr
from ...spectral.image import ColourImage
from ..display.transform import DisplayTransform
from ..gl.difference_map import DifferencePass
from ..gl.programs import read_again
from ..gl.shaders import ShaderError
from ..gl.side import CanvasSide
from ..gl.tile import read
from ..picture import display_for, picture_words
from .canvas_renderer import CanvasRenderer, Clock, Quality
from .display_pass import Showing, display_of, to_display
from .sides import SessionObjects
from .state import Session
from .view_error import AskedView
from .work import Work, work

if TYPE_CHECKING:
    import moderngl


class Frame(CanvasRenderer):
    """Image of a session on the GPU.

    `show` sets the session, `step` works towards its image, `texture` has the display's codes.

    Attributes
    ----------
    display : display transform of the sides.
    problem : reason why the last session is not shown; the previous image stays.
    """

    def __init__(self, context: moderngl.Context, sources: SessionObjects, clock: Clock = time.perf_counter) -> None:
        super().__init__(context, sources, clock)
        self._showing, self._differing = Showing(context), DifferencePass(context)
        # Drawing counter and formula of the differences.
        self._differed = -1, ""
        self._counted: tuple[tuple, DeltaEStatistics | None, float] | None = None
        self.display: DisplayTransform = display_for(sources.scene)
        self._beyond: UInt8[np.ndarray, "h w"] | None = None
        self.problem: str | None = None
        self.texture: moderngl.Texture | None = None

    def release(self) -> None:
        """Free all resources."""
        self._showing.release()
        self._differing.release()
        super().release()
        self.texture = None

    def show(self, session: Session, size: tuple[int, int], moving: bool = False) -> Work:
        """Show a session's image at a size; return the kind of work needed.

        moving : further changes follow at once, as in a drag, so that no finer image is begun.

        On failure `problem` has the reason, and the previous image stays.
        """
        if self._session is not None and session.other == self._session.other and self.sides and self.sides[1].still:
            size = self._size
        asked = max(work(self._session, session), Work.VIEW if size != self._size else Work.NOTHING)
        if asked == Work.NOTHING:
            # Already shown, whatever was refused in between.
            self.problem = self._refused
            unfinished = Quality.NONE < self.quality < Quality.EXACT and self._settling is None
            if not moving and not self.problem and unfinished:
                self._settling = self._to_exact(Quality(self.quality + 1))
            return asked
        try:
            sides = self.sides if self.sides and asked == Work.SHOW else self._sources.sides(session)
            if sides[1].still is not None:
                # An image read from a file determines the size of the other side.
                height, width = sides[1].still.coverage.shape
                size = width, height
            self._check(session, sides)
        except InputError as reason:
            self.problem = str(reason)
            return Work.NOTHING
        self.problem, self._to_show, self._beyond = None, True, None
        self._session, self.sides = session, sides
        self._resize(size)
        if asked > Work.SHOW:
            self._begin(asked, moving)
        return asked

    def turn_to(self, sources: SessionObjects, session: Session, size: tuple[int, int]) -> bool:
        """Switch to a reloaded scene or materials; on failure set `problem`, keep the previous image, and return False.
        Programs and cached data of unchanged meshes are kept.
        """
        before = self._sources, self._session
        self._sources, self._session = sources, None
        self.show(session, size)
        if self.problem is not None:
            self._sources, self._session = before
            sources.close()
            return False
        before[0].close()
        return True

    def read_shaders_again(self) -> str | None:
        """Recompile all shaders from their files and redraw; on failure keep the programs, and return the reason."""
        drawing = [*self._renderers.values(), self._showing, self._differing]
        try:
            read_again(programs for one in drawing for programs in one.all_programs)
        except ShaderError as reason:
            return str(reason)
        for renderer in self._renderers.values():
            renderer.session.cache.forget_view()
        self._differed = -1, ""
        if self._session is not None and self.sides is not None:
            self._begin(Work.VIEW, False)
        return None

    @property
    def catalogue(self) -> Any:
        """Catalogue of materials, including edited ones."""
        return self._sources.seen_catalogue

    def step(self, seconds: float = 0.05) -> bool:
        """Work for about `seconds`, at least one step, and update the display; return whether more remains."""
        if self._sources.arrived() and self._session is not None:
            self._fitted(self._session)
        if self._settling is not None:
            end = self._clock() + seconds
            try:
                for reached in self._settling:
                    self.reached = reached
                    if self._clock() >= end:
                        break
                else:
                    self._settling = None
                    self.quality, self.reached = Quality.EXACT, 1.0
            except MetamerError as reason:
                # Raised before an exact image, for instance by interreflection of non-absorbing surfaces.
                self.problem, self._settling = str(reason), None
        if (self._to_show or self._redrawn) and self._session is not None:
            begun = self._clock()
            self._show_now(self._session)
            self.seconds["display"] = self._clock() - begun
        return self._settling is not None or self._sources.pending

    def settle(self) -> None:
        """Work until the image is exact."""
        while self.step(1.0):
            pass

    @property
    def compared(self) -> moderngl.Texture | None:
        """XYZ under the display's white, as shown last; None before."""
        return None if self.texture is None else self._showing.compared

    def mark(self, beyond: UInt8[np.ndarray, "h w"]) -> None:
        """Mark pixels found by `queries.beyond` in the last image, until another is shown."""
        if beyond is not self._beyond:
            self._beyond, self._to_show = beyond, True

    def statistics(self) -> tuple[DeltaEStatistics | None, float]:
        """Return statistics of ΔE with A as the reference over compared pixels of the exact image, and the share above
        the tolerance; None if not exact yet, or without comparison.
        """
        if self.quality != Quality.EXACT or self._session is None:
            return None, 0.0
        compare = self._session.compare
        key = self._drawn, compare.formula, compare.tolerance
        if self._counted is None or self._counted[0] != key:
            begun = self._clock()
            found = self._differing.whole(self._differ(), self.canvases, self.whites, compare.formula)
            self._to_show |= self._session.seen == "difference"
            counted = found[~np.isnan(found)]
            numbers = bool(np.isfinite(counted).any())
            over = float((counted > compare.tolerance).mean()) if numbers else 0.0
            self._counted = key, delta_e_statistics(found) if numbers else None, over
            self.seconds["statistics"] = self._clock() - begun
        return self._counted[1:]

    @property
    def session(self) -> Session | None:
        """Shown session."""
        return self._session

    def put_reference(self, xyz: Float[np.ndarray, "H W 3"], coverage: Float[np.ndarray, "H W"]) -> None:
        """Set the reference of side B, whole or some rows of it with coverage 0 elsewhere; see `asked_reference`."""
        if self.sides is None or self.sides[1].made != "reference" or coverage.shape != self._size[::-1]:
            return
        self._write(1, xyz, coverage)
        self._changed()

    def keep(self, path: str | Path) -> None:
        """Write side A's exact image as OpenEXR in XYZ, which side B can show.

        Raises
        ------
        InputError : the image is not exact yet, or the file cannot be written.
        """
        if self.quality != Quality.EXACT or self.sides is None:
            expected, hint = "an exact picture", "wait until it is exact"
            raise InputError("the picture is not settled yet", field="picture", expected=expected, hint=hint)
        side, found = self.sides[0], read(self.canvases[0])
        made_by = self._renderer(Quality.EXACT, 0).session.made_by
        words = picture_words(side.lit, self.camera, made_by, installed_version())
        write_xyz_exr(path, ColourImage(found[..., :3], "xyz", side.white), found[..., 3], words)

    def asked_reference(self, number: int = 1) -> AskedView | None:
        """Return the view of a side with side A's image, for `ReferenceWorker`; None before it is exact, and for sides
        without a reference: a file, an influence.
        """
        if self.quality != Quality.EXACT or self.sides is None or not isinstance(self.catalogue, Catalogue):
            return None
        side = self.sides[number]
        if side.made == "file" or side.influence is not None:
            return None
        scene, catalogue = side.lit, self.catalogue
        if scene.bounces == "auto":
            scene = replace(scene, bounces=self._renderer(Quality.EXACT, 0).sides.bounces_of(side))
        made = catalogue.made.items() if isinstance(catalogue, VariedCatalogue) else ()
        picture = read(self.canvases[0 if side.made == "reference" else number])
        return AskedView(
            scene,
            self.camera,
            str(catalogue.folder),
            picture[..., :3],
            picture[..., 3],
            side.dimming,
            made={name: one.surface() for name, one in made},
        )

    def _check(self, session: Session, sides: tuple[CanvasSide, CanvasSide]) -> None:
        """Set the display of a session; raises if it cannot show the sides."""
        display = self.display
        before = self._session
        if before is None or (session.shown, session.observer) != (before.shown, before.observer):
            display = display_of(session, display_for(self._sources.scene))
        for side in sides:
            to_display(side.white, session.adaptation)
        self._showing.check(display, session)
        self.display = display

    def _fitted(self, session: Session) -> None:
        """Update materials that have been fitted."""
        try:
            sides = self._sources.sides(session)
            self._check(session, sides)
        except InputError as reason:
            self.problem = str(reason)
            return
        if sides[0] is not self.sides[0] or sides[1] is not self.sides[1]:  # type: ignore[index]
            self.sides, self._to_show = sides, True
            self._begin(Work.TERMS, False)

    def _differ(self) -> moderngl.Texture:
        """Return the ΔE map of the canvases."""
        assert self._session is not None
        formula = self._session.compare.formula
        if self._differed != (self._drawn, formula):
            self._differing.draw(self._differences, self.canvases, self.whites, formula)
            self._differed = self._drawn, formula
        return self._differences

    def _show_now(self, session: Session) -> None:
        differences = self._differ() if session.seen == "difference" else self._differences
        boxes = None if self._to_show else self._redrawn
        self.texture = self._showing.draw(
            self.canvases, differences, self.whites, session, self.display, self._beyond, boxes
        )
        self._to_show, self._redrawn = False, []
