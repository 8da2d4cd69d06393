"""Camera and shape."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from ...numeric_controls import SAMPLES, TURNTABLE
from ..widgets import button, combo, dial_slider, section
from ..window import Window


def draw(window: Window) -> None:
    """Camera, turntable, shape, samples."""
    if not section("View", opened=False):
        return
    desk, session, choices = window.desk, window.desk.session, window.desk.choices
    clicked = combo("camera", [(one.name, one.name) for one in choices.cameras], session.view.name)
    if clicked is not None:
        chosen = next(one for one in choices.cameras if one.name == clicked)
        desk.do(lambda now: replace(now, view=chosen), f"Camera {clicked}")
    if imgui.button("Frame all"):
        desk.run("view.frame")
    imgui.same_line()
    if button("Turntable", session.turntable_deg_s != 0.0, window.style):
        desk.run("turntable")
    if session.turntable_deg_s:
        dial_slider(desk, TURNTABLE, "%+.0f°/s")
    options = [("scene", "the scene's own shape"), *((one, one.replace("_", " ")) for one in choices.shapes)]
    clicked = combo("shape", options, session.subject.shape or "scene")
    if clicked is not None:
        desk.run(f"shape.{clicked}")
    dial_slider(desk, SAMPLES, "%.0f samples a pixel's side")
