"""Layout of panels: a row on top, a column on either side, the colour chain below, the image at the centre."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from imgui_bundle import ImVec2, imgui

from .dialogs import draw_dialog
from .keys import press_keys
from .panels import (
    bottom,
    camera,
    compare,
    display,
    edit,
    image,
    light,
    materials,
    metamerism,
    pins,
    probe,
    protocol,
    top_row,
    trust,
)
from .picture import PictureArea
from .style import grey
from .widgets import em
from .window import Window

# Heights of rows, widths of columns, and the least width of a window with columns, in text sizes.
_TOP, _BOTTOM, _LEFT, _RIGHT, _LEAST = 2.6, 3.4, 16.5, 22.0, 60.0
_TABS = {"Pins": pins, "Edit": edit, "Metamerism": metamerism, "Protocol": protocol, "Trust": trust}
_FIXED = (
    imgui.WindowFlags_.no_decoration
    | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.no_bring_to_front_on_focus
    | imgui.WindowFlags_.no_nav
)


def draw(window: Window, area: PictureArea) -> None:
    """Draw one frame of the interface; `area` persists between frames."""
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
            _draw_left(window)
        with _area("Right", room.x - after, above, after, height, scrolled=True):
            _draw_right(window)
    width = max(room.x - before - after, 0.0)
    if width >= 1.0 and height >= 1.0:
        imgui.push_style_color(imgui.Col_.window_bg, grey(window.desk.session.surround, window.style.display))
        imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(0.0, 0.0))
        with _area("Picture", before, above, width, height):
            area.draw(window, ImVec2(before, above), ImVec2(width, height))
        imgui.pop_style_var()
        imgui.pop_style_color()
    _draw_notices(window, before, above, width)
    if not draw_dialog(window):
        press_keys(window.desk)


def _draw_left(window: Window) -> None:
    """Draw the left column: subject, light, comparison and display."""
    of_image = window.desk.session.subject.kind == "image"
    (image if of_image else materials).draw(window)
    light.draw(window)
    compare.draw(window)
    display.draw(window)
    if not of_image:
        camera.draw(window)


def _draw_right(window: Window) -> None:
    """Draw the right column: probe above, tabs below."""
    probe.draw(window)
    wanted, window.kept.tab = window.kept.tab, None
    if imgui.begin_tab_bar("tabs"):
        for name, tab in _TABS.items():
            flags = imgui.TabItemFlags_.set_selected if wanted == name else 0
            if imgui.begin_tab_item(name, None, flags)[0]:
                tab.draw(window)
                imgui.end_tab_item()
        imgui.end_tab_bar()


@contextmanager
def _area(name: str, x: float, y: float, width: float, height: float, scrolled: bool = False) -> Iterator[None]:
    imgui.set_next_window_pos(ImVec2(x, y))
    imgui.set_next_window_size(ImVec2(width, height))
    flags = _FIXED & ~int(imgui.WindowFlags_.no_scrollbar) if scrolled else _FIXED
    imgui.begin(name, None, flags)
    yield
    imgui.end()


def _draw_notices(window: Window, x: float, y: float, width: float) -> None:
    """Draw notices over the upper edge of the image, whose area begins at x, y; problems stay until dismissed or
    solved, and messages while the mouse is over them, so that nothing moves under it.
    """
    said = window.desk.said(held=window.kept.notices_hovered)
    window.kept.notices_hovered = False
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
    window.kept.notices_hovered = imgui.is_window_hovered(imgui.HoveredFlags_.allow_when_blocked_by_active_item)
    for one in said:
        # A problem of the image must be solved or reverted, since it would be reported again.
        dismissed = one.problem and one.about != "picture"
        imgui.push_text_wrap_pos(wide - em(6.0 if dismissed else 1.0))
        imgui.text_unformatted(one.words)
        imgui.pop_text_wrap_pos()
        if dismissed:
            imgui.same_line(wide - em(5.5))
            # By its subject: others may go, since their time is up, while the mouse is down on it.
            if imgui.small_button(f"Dismiss##{one.about}"):
                window.desk.forget(one.about)
    imgui.end()
    imgui.pop_style_color()
