"""The row on top: light, observer, and how A and B are compared."""

from __future__ import annotations

from imgui_bundle import imgui

from .....spectral.observers import observer_title
from ...state import MODES
from ..widgets import choice, em
from ..window import Window

_MODE_WORDS = {"A": "A", "B": "B", "wipe": "Wipe", "side by side": "Side by side", "checkerboard": "Checker",
               "difference": "ΔE map"}  # fmt: skip


def draw(window: Window) -> None:
    """All in one row; where there is no room for buttons, lists."""
    desk, style = window.desk, window.style
    session, choices, room = desk.session, desk.choices, imgui.get_window_width()
    lamps = session.light.lamps
    now = lamps[0].name if len(lamps) == 1 and not (session.light.booth or session.light.map) else "scene"
    if session.light.booth or session.light.map or len(lamps) > 1:
        now = ""
    _label("Light")
    options = [(name or "scene", name or "Own") for name in choices.lights]
    if (
        clicked := choice("light", options, now, style, room * 0.4, lambda key: _tip(window, f"light.{key}"))
    ) is not None:
        desk.run(f"light.{clicked}")
    _label("Observer", gap=True)
    options = [(name, observer_title(name).removeprefix("CIE ")) for name in choices.observers]
    clicked = choice("observer", options, session.observer, style, room * 0.24,
                     lambda key: _tip(window, f"observer.{key}"))  # fmt: skip
    if clicked is not None:
        desk.run(f"observer.{clicked}")
    _label("Compare", gap=True)
    options = [(mode, _MODE_WORDS[mode]) for mode in MODES]
    room_left = imgui.get_content_region_avail().x
    clicked = choice("compare", options, session.compare.mode, style, room_left,
                     lambda key: _tip(window, f"compare.{key}"))  # fmt: skip
    if clicked is not None:
        desk.run(f"compare.{clicked}")


def _label(words: str, gap: bool = False) -> None:
    if gap:
        imgui.same_line(0.0, em(1.2))
    imgui.align_text_to_frame_padding()
    imgui.text_disabled(words)
    imgui.same_line()


def _tip(window: Window, name: str) -> str:
    command = window.desk.commands.by_name.get(name)
    if command is None:
        return ""
    return command.words + (f"   {command.keys[0]}" if command.keys else "")
