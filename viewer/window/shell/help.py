"""`?`: which keys there are."""

from __future__ import annotations

from imgui_bundle import ImVec2, imgui

from .widgets import em, heading
from .window import Window

_MOUSE = (
    ("Drag", "orbit; of an image, move it"),
    ("Right or middle drag", "pan"),
    ("Wheel", "zoom"),
    ("Drag the wipe's line", "move it"),
    ("Shift+click", "pin a probe"),
    ("Ctrl+drag", "draw a region"),
    ("Hold Space or Shift", "flick to the other side"),
)


def draw_help(window: Window) -> None:
    """Draw all keys by group, in columns, inside the current window."""
    groups = window.desk.commands.help()
    if imgui.begin_table("keys", 4, imgui.TableFlags_.sizing_stretch_same):
        imgui.table_next_column()
        _group(window, "Mouse", _MOUSE)
        rows, per_column = 8, sum(len(some) + 2 for some in groups.values()) / 4
        for name, some in groups.items():
            if rows > per_column:
                imgui.table_next_column()
                rows = 0
            _group(window, name, [(", ".join(one.keys), one.words) for one in some])
            rows += len(some) + 2
        imgui.end_table()


def _group(window: Window, name: str, rows) -> None:
    heading(name.upper(), window.style)
    if imgui.begin_table(f"##{name}", 2, imgui.TableFlags_.sizing_stretch_prop):
        imgui.table_setup_column("", imgui.TableColumnFlags_.width_stretch, 0.95)
        imgui.table_setup_column("", imgui.TableColumnFlags_.width_stretch, 1.5)
        for keys, words in rows:
            imgui.table_next_row()
            imgui.table_next_column()
            imgui.text_wrapped(keys)
            imgui.table_next_column()
            imgui.push_style_color(imgui.Col_.text, imgui.get_style().color_(imgui.Col_.text_disabled))
            imgui.push_text_wrap_pos(0.0)
            imgui.text_unformatted(words)
            imgui.pop_text_wrap_pos()
            imgui.pop_style_color()
        imgui.end_table()
    imgui.dummy(ImVec2(0.0, em(0.3)))
