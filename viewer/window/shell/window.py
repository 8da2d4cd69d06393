"""Work of the window between two frames: changes, background results, and rendering on the GPU."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ....calibration.report.statistics import DeltaEStatistics
from ...gl.context import describe
from ...render.view import view_key
from ..background import Background
from ..canvas_readback import CanvasValues, canvas_differences, values_of
from ..canvas_renderer import Quality
from ..file_watcher import Watch, files_of_shaders
from ..frame import Frame
from ..image_frame import ImageFrame
from ..picture_position import side_under
from ..picture_statistics import count_clipped, mark_beyond
from ..pictures import Pictures
from ..places import Pin, free_name
from ..probe_reader import ProbedView, Probing
from ..queries import Asking
from ..session_loader import Loaded, load
from ..state import Session, turned_on
from ..view_measurement import PATIENCE_S, Measuring
from ..worker import ReferenceWorker
from ..workspace import Desk
from .style import Style

if TYPE_CHECKING:
    import moderngl

#: Seconds per frame for progressive rendering, and polling interval of files.
SLICE_S, LOOK_S = 0.03, 0.5
#: Seconds that the pointer must rest before spectra are read.
REST_S = 0.12


@dataclass
class PanelState:
    """State of panels that is not part of a session, such as typed text and the open tab.

    searched : of materials. typed : into fields, by their names. tab : that is to be opened next. spectrum : which
    kind is plotted. compared : materials that are looked at for metamerism. note, score : of the next rating.
    amount : that a wish asks for. chain_in_full : whether the chain is told at length. found : typed into the palette,
    and the row chosen. notices_hovered : whether the mouse is over what is said.
    """

    searched: str = ""
    typed: dict[str, str] = field(default_factory=dict)
    tab: str | None = None
    spectrum: str = "reflectance"
    compared: list[str] = field(default_factory=list)
    note: str = ""
    score: int = 0
    amount: float = 10.0
    chain_in_full: bool = False
    found: str = ""
    row: int = 0
    notices_hovered: bool = False


class Window:
    """State of an open window; a context manager, entered once there is a GL context.

    Attributes
    ----------
    size : of the picture in pixels of the screen. moving : whether something is being dragged. pointer : the pixel of
    what is seen that the pointer was over last, or None. hovered : whether it still is.
    """

    def __init__(self, desk: Desk) -> None:
        self.desk, self.style = desk, Style()
        self.probing, self.files, self.asking = Probing(), Background(), Asking()
        self.kept = PanelState()
        self.measuring: Measuring | None = None
        self.pictures: Pictures | None = None
        self.size, self.moving, self.pointer, self.hovered = (0, 0), False, None, False
        self.panels_shown, self.measures_by_itself = True, True
        self.asked_to_close = False
        self.dialog_drawn: str | None = None
        self.busy = True
        self.read: tuple[CanvasValues, CanvasValues] | None = None
        self.off: dict[str, float] = {}
        self.regions: dict[str, tuple[CanvasValues, CanvasValues]] = {}
        self.driver = ""
        self.statistics: tuple[DeltaEStatistics | None, float] = (None, 0.0)
        #: Tasks for the thread of the GPU, run between two frames.
        self.between: list[Callable[[], object]] = []
        self._open = ExitStack()
        self._watch = Watch((*desk.loaded.files, *files_of_shaders()))
        self._looked = self._stepped = self._rested = self._still_since = time.monotonic()
        self._seen: Hashable = None
        self._loading: Session | None = None
        self._read_of: tuple | None = None
        self._regions_of: tuple | None = None
        self._view: ProbedView | None = None

    def start(self, context: moderngl.Context) -> None:
        """Initialise GPU resources."""
        self.measuring = Measuring(self._open.enter_context(ReferenceWorker()))
        self.pictures = Pictures(context)
        self.pictures.put(self.desk.loaded)
        self._context = context
        self.driver = describe(context)

    def close(self) -> None:
        """Stop background work and free GPU resources."""
        self.probing.close()
        self.files.close()
        self.asking.close()
        self._open.close()
        if self.pictures is not None:
            self.pictures.release()

    @property
    def frame(self) -> Frame | ImageFrame | None:
        """Current frame."""
        return None if self.pictures is None else self.pictures.frame

    @property
    def view(self) -> ProbedView | None:
        """View for probes of the exact image; None for an image file, or before there is a rendering."""
        frame = self.frame
        if not isinstance(frame, Frame) or frame.sides is None or min(self.size) < 1 or frame.texture is None:
            return None
        session, other = self.desk.session, self.desk.session.other
        lights = session.light.words, (other.light or session.light).words
        now = ProbedView(frame.sides, frame.camera, frame.catalogue, lights)
        # The same object while it is the same view: what was read of it is told apart by that.
        if self._view is None or _key(self._view) != _key(now):
            self._view = now
        return self._view

    def step(self) -> None:
        """Perform all work between two frames; leaves the screen bound as the framebuffer."""
        assert self.pictures is not None and self.measuring is not None
        now = time.monotonic()
        desk = self.desk
        if not self.moving:
            desk.release()
        before = desk.session
        desk.pass_to(turned_on(before, now - self._stepped))
        turning = desk.session is not before and desk.session != before
        self._stepped = now
        self._follow_files(now)
        self._hear()
        while self.between:
            self.between.pop(0)()
        # A scene that is being loaded has no picture yet: the last one stays.
        if desk.loaded.is_of(desk.session):
            self.pictures.show(desk.session, self.size, self.moving or turning)
        self._count()
        more = self.pictures.step(SLICE_S)
        self._say_problem()
        self._read_regions()
        self._read_pointer(now)
        self._follow_picture(now)
        if self._seen is not None and time.monotonic() - self._still_since > PATIENCE_S / 2.0:
            count_clipped(self.asking, self.frame, self.desk.session, self._seen)
            mark_beyond(self.asking, self.frame, self.desk.session, self._seen)
        waiting = self.probing.busy or self.files.busy() or self.asking.busy()
        self.busy = more or turning or self.moving or waiting
        if self._context.screen is not None:
            self._context.screen.use()

    def point_at(self, pixel: tuple[int, int] | None) -> None:
        """Set the pixel under the pointer; with None the last one stays probed."""
        self.hovered = pixel is not None
        if pixel == self.pointer or pixel is None:
            return
        self.pointer, self._rested = pixel, time.monotonic()
        width, height = self.shown_size
        share = (pixel[0] + 0.5) / width, (pixel[1] + 0.5) / height
        self.desk.pass_to(replace(self.desk.session, cursor=share))

    @property
    def shown_size(self) -> tuple[int, int]:
        """Size of the image, in its own pixels."""
        frame = self.frame
        return frame.texture.size if frame is not None and frame.texture is not None else (1, 1)

    def read_again(self) -> None:
        """Reload scene, materials and shaders, changed or not."""
        self.between.append(self._read_shaders)
        self._load(self.desk.session, "Read again")

    def _follow_files(self, now: float) -> None:
        """Load the session's subject, and reload changed files."""
        session, desk = self.desk.session, self.desk
        if not desk.loaded.is_of(session):
            wanted = (session.subject, session.catalogue)
            known = self._loading and (self._loading.subject, self._loading.catalogue)
            if wanted != known:
                self._load(session, "")
        elif now - self._looked > LOOK_S:
            self._looked = now
            if changed := self._watch.changed():
                names = ", ".join(sorted({one.name for one in changed}))
                desk.tell(f"Changed: {names}", about="changed")
                if shaders := set(changed) & set(files_of_shaders()):
                    self.between.append(self._read_shaders)
                if set(changed) - shaders:
                    self._load(session, "Read again")

    def _read_shaders(self) -> None:
        """Reload the shaders; if one does not compile, all stay unchanged."""
        assert self.pictures is not None
        self.desk.forget("shaders")
        if (problem := self.pictures.read_shaders_again()) is not None:
            self.desk.tell(problem, problem=True, about="shaders")

    def _load(self, session: Session, said: str) -> None:
        self._loading = session
        self.files.ask("load", lambda: (load(session.subject, session.catalogue), said))

    def _hear(self) -> None:
        for heard in self.files.poll():
            if heard.kind != "load":
                continue
            if heard.problem is not None:
                self.desk.tell(heard.problem, problem=True, about="load")
                # Its file may be mended.
                continue
            loaded, said = heard.result
            self._put(loaded, said)
        for pin in self.probing.poll():
            if pin is None:
                self.desk.tell("Nothing to pin under the pointer", about="pin")
            else:
                # Another one may have come since it was asked for.
                found = replace(pin, name=free_name("pin", self.desk.session.pins))
                self.desk.do(partial(_with_pin, found), f"Pin {found.name}")
        self.asking.poll()
        assert self.measuring is not None
        if self.measuring.poll() and (found := self.measuring.reference) and isinstance(self.frame, Frame):
            self.frame.put_reference(*found)

    def _put(self, loaded: Loaded, said: str) -> None:
        assert self.pictures is not None
        self._loading = None
        self.desk.arrived(loaded)
        self.desk.forget("load")
        if said:
            self.desk.tell(said, about="changed")
        self.pictures.put(loaded)
        self._watch.put((*loaded.files, *files_of_shaders()))
        self.probing.close()
        self.probing = Probing()
        self._view = None
        self.asking.forget()
        if self.measuring is not None:
            self.measuring.forget()

    def _count(self) -> None:
        """Find how far B is from A over the whole picture, where that is seen or can be read."""
        frame = self.frame
        alike = isinstance(frame, Frame) and frame.sides is not None and frame.sides[0] is frame.sides[1]
        if frame is None or frame.texture is None or alike:
            self.statistics = None, 0.0
        elif not self.moving:
            self.statistics = frame.statistics()

    def _say_problem(self) -> None:
        assert self.pictures is not None
        problem = self.pictures.problem
        if problem is not None:
            # It stays until it is solved: light and display are called as the session has them.
            problem += "\n  Until it is solved, the picture is the one before. Ctrl+Z takes the last step back."
        known = next((one.words for one in self.desk.notices if one.about == "picture"), None)
        if problem is None:
            if known is not None:
                self.desk.forget("picture")
        elif known != problem:
            self.desk.tell(problem, problem=True, about="picture")

    def _read_pointer(self, now: float) -> None:
        frame, session = self.frame, self.desk.session
        if frame is None or frame.texture is None or self.pointer is None or frame.quality == Quality.NONE:
            self.read = None
            return
        width, height = self.shown_size
        if not (0 <= self.pointer[0] < width and 0 <= self.pointer[1] < height):
            self.read = None
            return
        _, column, row = side_under(session, (width, height), *self.pointer)
        key = column, row, session, frame.quality, frame.reached
        if key != self._read_of:
            self._read_of = key
            self.read = values_of(frame, session, slice(row, row + 1), slice(column, column + 1))
            self.off = canvas_differences(*self.read)
        if now - self._rested > REST_S and not self.moving:
            if isinstance(frame, ImageFrame):
                self.probing.at_image(frame, session, (column, row))
            elif (view := self.view) is not None:
                self.probing.at(view, (column, row))

    def _read_regions(self) -> None:
        frame, session = self.frame, self.desk.session
        if frame is None or frame.texture is None or not session.regions or self.moving:
            self.regions = {} if not session.regions else self.regions
            return
        key = session.settled, frame.quality, frame.reached, self.shown_size
        if key != self._regions_of:
            self._regions_of = key
            boxes = {one.name: one.pixels(*self.shown_size) for one in session.regions}
            self.regions = {name: values_of(frame, session, *box) for name, box in boxes.items()}

    def _follow_picture(self, now: float) -> None:
        """Since when the exact picture has been what it is; what was found of another one is forgotten."""
        frame, session, view = self.frame, self.desk.session, self.view
        seen: Hashable = None
        if frame is not None and frame.texture is not None and frame.quality == Quality.EXACT and not self.moving:
            seen = view or (session.light, session.observer, session.other, session.subject)
        if seen != self._seen:
            self._seen, self._still_since = seen, now
        assert self.measuring is not None
        if view is None or not self.measuring.is_of(view):
            self.measuring.forget()
        if view is None or seen is None:
            return
        self.probing.at_pins(view, session.pins)
        if self.measures_by_itself and not self.measuring.is_of(view) and now - self._still_since > PATIENCE_S:
            self.measure()

    def measure(self) -> None:
        """Request the reference of the current view."""
        view, frame = self.view, self.frame
        if view is None or not isinstance(frame, Frame) or frame.quality != Quality.EXACT or self.measuring is None:
            self.desk.tell("The reference is measured once the picture is exact", about="measure")
            return
        asked = frame.asked_reference(int(view.sides[1].made == "reference"))
        if asked is None:
            self.measuring.problem = "this has no reference"
        else:
            self.measuring.ask(view, asked)

    def pin_pointer(self) -> None:
        """Pin the point of the surface under the pointer."""
        view = self.view
        if self.desk.session.subject.kind == "image":
            self.desk.tell("An image has no surface to pin a probe to: Ctrl+drag draws a region", about="pin")
            return
        if view is None or self.pointer is None:
            self.desk.tell("Move over a surface to pin a probe there", about="pin")
            return
        _, column, row = side_under(self.desk.session, self.shown_size, *self.pointer)
        self.probing.pin(view, (column + 0.5, row + 0.5), free_name("pin", self.desk.session.pins))

    def dropped(self, paths: list[str]) -> None:
        """Open the first of the files dropped onto the window."""
        if paths:
            self.desk.open(str(Path(paths[0])))


def _with_pin(pin: Pin, session: Session) -> Session:
    return replace(session, pins=(*session.pins, pin))


def _key(view: ProbedView) -> tuple:
    return *map(id, view.sides), view_key(view.camera), view.lights
