"""Background queries about a still image: clipping, gamut and plan."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Any

from .canvas_readback import read_box
from .display_pass import needs_beyond
from .frame import Frame
from .image_frame import ImageFrame
from .queries import Asking, beyond, clipping, plan_of
from .state import Session


def count_clipped(asking: Asking, frame: Frame | ImageFrame | None, session: Session, seen: Hashable) -> None:
    """Query the clipping of the shown side, unless already queried for this image.

    seen : key of the image.
    """
    if frame is None:
        return
    number = int(session.compare.mode == "B")
    key = (number, session.adaptation, session.exposure, session.surround, frame.display, seen)
    if asking.answer("clipping", key) is not None or asking.busy("clipping"):
        return
    width, height = frame.canvases[number].size
    found = read_box(frame.canvases[number], slice(0, height), slice(0, width)).copy()
    white, display = frame.whites[number], frame.display
    asking.ask("clipping", key, lambda: clipping(found[..., :3], found[..., 3], white, session, display), again=False)


def mark_beyond(asking: Asking, frame: Frame | ImageFrame | None, session: Session, seen: Hashable) -> None:
    """Query the pixels outside the display's gamut, if codes do not show them, and mark them in the frame."""
    if frame is None or frame.compared is None or not needs_beyond(session, frame.display):
        return
    key = session, frame.display, seen
    if (found := asking.answer("beyond", key)) is not None:
        frame.mark(found.result)
    elif not asking.busy("beyond"):
        width, height = frame.compared.size
        xyz_d65, display = read_box(frame.compared, slice(0, height), slice(0, width))[..., :3].copy(), frame.display
        asking.ask("beyond", key, lambda: beyond(xyz_d65, display), again=False)


def ask_plan(asking: Asking, frame: Frame | ImageFrame | None, lights: Sequence[str], catalogue: Any) -> None:
    """Query the plan of side A's scene for further lights."""
    if isinstance(frame, Frame) and frame.sides is not None:
        side = frame.sides[0]
        asking.ask("plan", side.scene, lambda: plan_of(side, lights, catalogue))
