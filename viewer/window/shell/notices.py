"""Notices of the window, over the upper edge of the picture: problems stay until they are dismissed or solved."""

from __future__ import annotations

from imgui_bundle import ImVec2, imgui

from .widgets import em
from .window import Window


def draw_notices(window: Window, x: float, y: float, width: float) -> None:
    """Over the picture, whose area begins at x, y."""
    said = window.desk.said()
    if not said or width < em(12.0):
        return
    wide = min(em(44.0), width - em(2.0))
    imgui.set_next_window_pos(ImVec2(x + (width - wide) / 2.0, y + em(2.6)))
    imgui.set_next_window_size_constraints(ImVec2(wide, 0.0), ImVec2(wide, em(24.0)))
    imgui.set_next_window_bg_alpha(0.94)
    flags = imgui.WindowFlags_
    imgui.push_style_color(imgui.Col_.window_bg, window.style.panel(10.0))
    imgui.begin(
        "Notices", None,
        flags.no_decoration | flags.no_move | flags.no_saved_settings | flags.always_auto_resize
        | flags.no_focus_on_appearing | flags.no_nav,
    )  # fmt: skip
    for number, one in enumerate(said):
        imgui.push_text_wrap_pos(wide - em(6.0 if one.problem else 1.0))
        imgui.text_unformatted(one.words)
        imgui.pop_text_wrap_pos()
        if one.problem:
            imgui.same_line(wide - em(5.5))
            if imgui.small_button(f"Dismiss##{number}"):
                window.desk.forget(one.about)
    imgui.end()
    imgui.pop_style_color()
