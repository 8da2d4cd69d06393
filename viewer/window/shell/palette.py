"""Ctrl+Shift+P: every command, found by words."""

from __future__ import annotations

from imgui_bundle import ImVec2, imgui

from .widgets import em, right
from .window import Window

# Rows that are seen at once.
_ROWS = 16


def draw_palette(window: Window, opened: bool) -> bool:
    """Return a field and a list; whether it is done. opened : in this very frame."""
    kept, desk = window.kept, window.desk
    if opened:
        kept.found, kept.row = "", 0
        imgui.set_keyboard_focus_here()
    imgui.set_next_item_width(-1.0)
    changed, kept.found = imgui.input_text_with_hint("##command", "what is to be done?", kept.found)
    found = desk.commands.found(kept.found)
    if changed:
        kept.row = 0
    for key, step in ((imgui.Key.down_arrow, 1), (imgui.Key.up_arrow, -1), (imgui.Key.page_down, _ROWS),
                      (imgui.Key.page_up, -_ROWS)):  # fmt: skip
        if imgui.is_key_pressed(key):
            kept.row += step
            window.kept.tab = None
    kept.row = min(max(kept.row, 0), max(len(found) - 1, 0))
    chosen = found[kept.row] if found and imgui.is_key_pressed(imgui.Key.enter) else None
    imgui.begin_child("commands", ImVec2(0.0, _ROWS * imgui.get_text_line_height_with_spacing() + em(0.5)))
    clipper = imgui.ListClipper()
    clipper.begin(len(found))
    # The chosen row is drawn, wherever the list has been scrolled to.
    if found:
        clipper.include_item_by_index(kept.row)
    while clipper.step():
        for number in range(clipper.display_start, clipper.display_end):
            one = found[number]
            if imgui.selectable(f"{one.words}##{one.name}", number == kept.row)[0]:
                chosen = one
            if number == kept.row and not imgui.is_item_visible():
                imgui.set_scroll_here_y()
            imgui.same_line()
            right(f"{one.group}   {one.keys[0]}" if one.keys else one.group)
    imgui.end_child()
    if not found:
        imgui.text_disabled("no command has these words")
    if chosen is not None:
        desk.dialog = None
        desk.run(chosen)
        # It may have opened a dialog of its own.
        return desk.dialog is None
    return False
