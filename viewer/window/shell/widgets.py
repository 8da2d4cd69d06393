"""Pieces that several panels are made of."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from imgui_bundle import ImVec2, hello_imgui, imgui

from ..commands import Dial
from ..workspace import Desk
from .style import SMALL, Style


def em(count: float) -> float:
    """Convert a length in text sizes to pixels."""
    return hello_imgui.em_size(count)


def heading(words: str, style: Style) -> None:
    """Draw a heading of a group of widgets."""
    imgui.dummy(ImVec2(0.0, em(0.15)))
    imgui.push_font(style.bold, SMALL)
    imgui.text_disabled(words)
    imgui.pop_font()


def button(label: str, chosen: bool, style: Style) -> bool:
    """Draw a button highlighted if chosen; return whether it was clicked."""
    if chosen:
        back, front = style.chosen
        for kind in (imgui.Col_.button, imgui.Col_.button_hovered):
            imgui.push_style_color(kind, back)
        imgui.push_style_color(imgui.Col_.text, front)
    clicked = imgui.button(label)
    if chosen:
        imgui.pop_style_color(3)
    return clicked


def choice(
    name: str, options: Sequence[tuple[str, str]], chosen: str, style: Style, room: float, tip: Callable[[str], str]
) -> str | None:
    """Draw a choice, as buttons in a row if there is room, else as a combo box; return the clicked key or None.

    options : key and words of each; tests and scripts find a button as "WORDS##NAME".
    """
    gap = em(0.15)
    padding = 2.0 * imgui.get_style().frame_padding.x
    wide = sum(imgui.calc_text_size(words).x + padding + gap for _, words in options)
    if wide > room:
        return combo(name, options, chosen, min(room, em(9.0)))
    clicked = None
    for number, (key, words) in enumerate(options):
        if number:
            imgui.same_line(0.0, gap)
        if button(f"{words}##{name}", key == chosen, style):
            clicked = key
        tooltip(tip(key))
    return clicked


def combo(name: str, options: Sequence[tuple[str, str]], chosen: str, width: float = -1.0) -> str | None:
    """Draw a combo box; return the clicked key or None."""
    clicked = None
    imgui.set_next_item_width(width)
    if imgui.begin_combo(f"##{name}", dict(options).get(chosen, chosen)):
        for key, words in options:
            if imgui.selectable(f"{words}##{key}", key == chosen)[0]:
                clicked = key
            if key == chosen:
                imgui.set_item_default_focus()
        imgui.end_combo()
    return clicked


def dial_slider(desk: Desk, dial: Dial, form: str) -> None:
    """Draw a dial's slider, which can be dragged, or typed into after Ctrl+click."""
    flags = imgui.SliderFlags_.always_clamp
    if dial.logarithmic:
        flags |= imgui.SliderFlags_.logarithmic
    imgui.set_next_item_width(-1.0)
    value = dial.value(desk.session)
    changed, value = imgui.slider_float(f"##{dial.name}", value, dial.low, dial.high, form, flags)
    if changed:
        desk.turn(dial, value)
    tooltip(f"{dial.words}. Ctrl+click to type a number.")


def tooltip(words: str) -> None:
    """Show a tooltip of the last item, after a moment."""
    if words and imgui.is_item_hovered(imgui.HoveredFlags_.for_tooltip):
        imgui.set_tooltip(words)


def facts(name: str, rows: Sequence[Sequence[str]], widths: Sequence[float] = ()) -> None:
    """Draw a table of words, all columns but the first right-aligned; nothing for an empty table."""
    if not rows:
        return
    columns = max(len(row) for row in rows)
    if imgui.begin_table(name, columns, imgui.TableFlags_.sizing_stretch_prop):
        for width in widths:
            imgui.table_setup_column("", imgui.TableColumnFlags_.width_stretch, width)
        for row in rows:
            imgui.table_next_row()
            for number, words in enumerate(row):
                imgui.table_set_column_index(number)
                if number == 0:
                    imgui.text_disabled(words)
                else:
                    right(words)
        imgui.end_table()


def right(words: str) -> None:
    """Write right-aligned text."""
    room = imgui.get_content_region_avail().x - imgui.calc_text_size(words).x
    if room > 0.0:
        imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + room)
    imgui.text_unformatted(words)


def quiet(words: str) -> None:
    """Write text in a quieter colour, wrapped."""
    imgui.push_style_color(imgui.Col_.text, imgui.get_style().color_(imgui.Col_.text_disabled))
    paragraph(words)
    imgui.pop_style_color()


def paragraph(words: str) -> None:
    """Write wrapped text."""
    imgui.push_text_wrap_pos(0.0)
    imgui.text_unformatted(words)
    imgui.pop_text_wrap_pos()


def section(words: str, opened: bool = True) -> bool:
    """Draw a collapsible section; return whether it is open."""
    return imgui.collapsing_header(words, imgui.TreeNodeFlags_.default_open if opened else 0)


@contextmanager
def unusable(when: bool) -> Iterator[None]:
    """Disable the widgets drawn inside."""
    if when:
        imgui.begin_disabled()
    try:
        yield
    finally:
        if when:
            imgui.end_disabled()
