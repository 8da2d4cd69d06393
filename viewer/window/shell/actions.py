"""Actions of commands that change no session: files, screenshots, the window itself."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

import glfw
from imgui_bundle import imgui
from imgui_bundle.glfw_utils import glfw_window_hello_imgui

from ....calibration.report.rating import Verdict
from ..canvas_renderer import Quality
from ..chain import write_screenshot
from ..displayed_value import displayed
from ..frame import Frame
from ..probe import ProbeReading
from ..probe_text import Named, copied, write_colours, write_probes_cxf, write_spectra
from ..protocol import rating_of
from .window import Window


def put_actions(window: Window) -> None:
    """Register the action of each command of the window; others open the dialog of their name."""
    actions: dict[str, Callable[[], None]] = {
        "quit": lambda: setattr(window, "asked_to_close", True),
        "panels": lambda: setattr(window, "panels_shown", not window.panels_shown),
        "fullscreen": FullScreenSwitch().turn,
        "reload": window.read_again,
        "screenshot": lambda: window.between.append(lambda: screenshot(window)),
        "probe.pin": window.pin_pointer,
        "probe.copy": lambda: copy_probe(window),
        "rate.approved": lambda: rate(window, "approved"),
        "rate.rejected": lambda: rate(window, "rejected"),
        "reference": lambda: window.between.append(window.measure),
    }
    window.desk.actions |= actions


def screenshot(window: Window, path: Path | None = None) -> None:
    """Write the image as a PNG with the colour chain; by default named after the time."""
    frame = window.frame
    if frame is None or frame.texture is None:
        window.desk.tell("There is no picture yet", about="screenshot")
        return
    file = path or Path(f"metamer-{datetime.now():%Y-%m-%d-%H%M%S}.png")
    window.desk.attempt(lambda: write_screenshot(file, frame, window.desk.session), "screenshot", f"Written: {file}")


def probes(window: Window) -> list[Named] | None:
    """Return the current probes of both sides, at the pointer's last position and at pins; None, with a notice, if
    there are none or they have not been read yet.
    """
    frame, session, probing = window.frame, window.desk.session, window.probing
    view, spots = window.view, []
    kinds = ["cursor"] if probing.cursor is not None else []
    kinds += ["pins"] if session.pins and view is not None else []
    why = None if kinds else "Nothing is probed: move over the picture, or pin a probe"
    if not all(probing.fresh(kind, view) for kind in kinds):
        why = probing.problem or "What is probed is still being read: try again once the picture is exact"
    if why is not None:
        window.desk.tell(why, about="probe")
        return None
    if probing.cursor is not None:
        spots.append(probing.cursor)
    spots += probing.pins if "pins" in kinds else ()
    found: list[Named] = []
    for spot in spots:
        for side, reading in zip("AB", spot.readings, strict=False):
            name = spot.name if len(spot.readings) == 1 else f"{spot.name}, {side}"
            found.append((name, reading, None if frame is None else _shown(frame, session, reading)))
    return found


def _shown(frame, session, reading: ProbeReading):
    return displayed(
        reading.xyz, reading.white, frame.display, session.adaptation, session.exposure, session.surround,
        reading.coverage,
    )  # fmt: skip


def keep_picture(window: Window, file: Path) -> None:
    """Write side A's image in XYZ, for use as side B."""
    frame = window.frame
    if not isinstance(frame, Frame):
        window.desk.tell("Only a scene's picture is kept: an image is a file already", problem=True, about="keep")
    else:
        window.desk.attempt(lambda: frame.keep(file), "keep", f"Written: {file}")


def copy_probe(window: Window) -> None:
    """Copy all probes to the clipboard."""
    found = probes(window)
    if found is None:
        return
    imgui.set_clipboard_text("\n".join(copied(*one) for one in found))
    window.desk.tell(f"Copied: {', '.join(name for name, _, _ in found)}", about="probe")


def write_probes(window: Window, file: Path) -> bool:
    """Write all probes as CxF, or as CSV with spectra in a second file, by the suffix; return whether it was done."""
    found = probes(window)
    if found is None:
        return False
    if file.suffix.lower() == ".cxf":
        return window.desk.attempt(lambda: write_probes_cxf(file, found), "probe", f"Written: {file}")
    if not any(reading.spectra is not None for _, reading, _ in found):
        return window.desk.attempt(lambda: write_colours(file, found), "probe", f"Written: {file}")
    spectra = file.with_name(f"{file.stem}-spectra.csv")

    def both() -> None:
        write_colours(file, found)
        write_spectra(spectra, found)

    return window.desk.attempt(both, "probe", f"Written: {file} and {spectra.name}")


def rate(window: Window, verdict: Verdict, score: int = 0, note: str = "") -> None:
    """Rate the shown material as approved, rejected, or neither."""
    frame, session, probing = window.frame, window.desk.session, window.probing
    if session.subject.kind == "image":
        window.desk.tell("Materials are rated; an image has none", about="rate")
        return
    if verdict != "open" and (frame is None or frame.quality != Quality.EXACT):
        window.desk.tell("The picture is not exact yet: judge no colour by it; a note can be kept", about="rate")
        return
    # A reading under the previous light must not be stored with the name of this one.
    spot = probing.cursor if probing.fresh("cursor", window.view) else None
    reading = other = shown = None
    if spot is not None and frame is not None and spot.readings:
        alone = session.compare.mode == "B"
        first, last = spot.readings[0], spot.readings[-1]
        reading = last if alone else first
        other = last if session.compare.mode not in ("A", "B") and last is not first else None
        shown = _shown(frame, session, reading)
    desk = window.desk

    def rated(now):
        return now.rated(
            rating_of(now, desk.choices, verdict, score=score, note=note, reviewer=desk.reviewer,
                      reading=reading, other=other, shown=shown)
        )  # fmt: skip

    if desk.do(rated, f"Rate: {verdict}"):
        last = desk.session.ratings[-1]
        desk.tell(f"{last.verdict}: {last.material} under {last.light}", about="rate")


class FullScreenSwitch:
    """Switch between full screen on the first monitor and the window."""

    def __init__(self) -> None:
        self._before: tuple[int, int, int, int] | None = None

    def turn(self) -> None:
        """Toggle full screen."""
        window = glfw_window_hello_imgui()
        if self._before is None:
            monitor = glfw.get_primary_monitor()
            if not monitor:
                return
            self._before = (*glfw.get_window_pos(window), *glfw.get_window_size(window))
            mode = glfw.get_video_mode(monitor)
            glfw.set_window_monitor(window, monitor, 0, 0, *mode.size, mode.refresh_rate)
        else:
            glfw.set_window_monitor(window, None, *self._before, 0)  # pyright: ignore[reportArgumentType]
            self._before = None
