"""The row below: the colour chain in words, what is drawn, and where help is."""

from __future__ import annotations

from imgui_bundle import imgui

from ...canvas_renderer import Quality
from ...chain import chain
from ...frame import Frame
from ..widgets import paragraph, right
from ..window import Window

_QUALITY = {
    Quality.NONE: "not drawn yet",
    Quality.MOVING: "coarse; what is finer is being worked out",
    Quality.FIRST: "first picture by rays",
    Quality.STILL: "settling",
    Quality.EXACT: "exact",
}


def draw(window: Window) -> None:
    """Two lines."""
    frame, session = window.frame, window.desk.session
    if frame is None or frame.texture is None:
        imgui.text_disabled("The picture is being prepared.")
        return
    paragraph("  ·  ".join(chain(session, frame.display)))
    width, height = window.shown_size
    state = "moving" if frame.quality == Quality.MOVING and window.moving else _QUALITY[Quality(frame.quality)]
    if isinstance(frame, Frame) and frame.quality == Quality.FIRST:
        state += f", noise of ΔE94 {frame.noise:.2g}"
    if isinstance(frame, Frame) and frame.quality < Quality.EXACT and 0.0 < frame.shadowed < 1.0:
        state += f"; shadows {frame.shadowed:.0%}"
    if frame.quality != Quality.EXACT and frame.reached:
        state += f", {frame.reached:.0%} of the exact picture"
    samples = f", {session.samples} x {session.samples} samples a pixel" if isinstance(frame, Frame) else ""
    words = [f"{width} x {height}{samples}", state]
    if session.turntable_deg_s:
        words.append(f"turntable {session.turntable_deg_s:+g}°/s")
    if not frame.display.is_colorimetric:
        words.append("tone-mapped: judge no colour by it")
    imgui.text_disabled("   ".join(words))
    beside = "? keys    Ctrl+Shift+P all commands"
    if window.measuring is not None and isinstance(frame, Frame):
        beside = f"this view: {window.measuring.words()}    {beside}"
    imgui.same_line()
    right(beside)
