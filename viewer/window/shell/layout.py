"""Layout of panels: one row on top, a column on either side, the chain below, the picture in the middle."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from imgui_bundle import ImVec2, imgui

from .dialogs import draw_dialog
from .keys import press_keys
from .notices import draw_notices
from .panels import bottom, left_column, right, top_row
from .picture import PictureArea
from .style import grey
from .widgets import em
from .window import Window

# Sizes of text: heights of the rows, widths of the columns; and the least width of a window that has columns.
_TOP, _BOTTOM, _LEFT, _RIGHT, _LEAST = 2.6, 3.4, 16.5, 22.0, 60.0
_FIXED = (
    imgui.WindowFlags_.no_decoration
    | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.no_bring_to_front_on_focus
    | imgui.WindowFlags_.no_nav
)


def draw(window: Window, area: PictureArea) -> None:
    """One frame of the interface; `area` is kept from one to the next."""
    frame = window.frame
    if frame is not None:
        window.style.put(window.desk.session.interface, frame.display)
    else:
        window.style.put(window.desk.session.interface, window.style.display)
    room = imgui.get_main_viewport().size
    shown = window.panels_shown
    columns = shown and room.x >= em(_LEAST)
    above, below = (em(_TOP), em(_BOTTOM)) if shown and room.y >= em(20.0) else (0.0, 0.0)
    before, after = (em(_LEFT), em(_RIGHT)) if columns else (0.0, 0.0)
    height = max(room.y - above - below, 0.0)
    if above:
        with _area("Top", 0.0, 0.0, room.x, above):
            top_row.draw(window)
        with _area("Chain", 0.0, room.y - below, room.x, below):
            bottom.draw(window)
    if columns:
        with _area("Left", 0.0, above, before, height, scrolled=True):
            left_column.draw(window)
        with _area("Right", room.x - after, above, after, height, scrolled=True):
            right.draw(window)
    width = max(room.x - before - after, 0.0)
    if width >= 1.0 and height >= 1.0:
        imgui.push_style_color(imgui.Col_.window_bg, grey(window.desk.session.surround, window.style.display))
        imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(0.0, 0.0))
        with _area("Picture", before, above, width, height):
            area.draw(window, ImVec2(before, above), ImVec2(width, height))
        imgui.pop_style_var()
        imgui.pop_style_color()
    draw_notices(window, before, above, width)
    if not draw_dialog(window):
        press_keys(window.desk)


@contextmanager
def _area(name: str, x: float, y: float, width: float, height: float, scrolled: bool = False) -> Iterator[None]:
    imgui.set_next_window_pos(ImVec2(x, y))
    imgui.set_next_window_size(ImVec2(width, height))
    flags = _FIXED & ~int(imgui.WindowFlags_.no_scrollbar) if scrolled else _FIXED
    imgui.begin(name, None, flags)
    yield
    imgui.end()
