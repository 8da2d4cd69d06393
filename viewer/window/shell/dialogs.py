"""Dialogs: palette, help, and input of file names."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from imgui_bundle import ImVec2, imgui

from .actions import keep_picture, screenshot, write_probes
from .help import draw_help
from .keys import pressed
from .palette import draw_palette
from .panels import protocol
from .widgets import em, quiet
from .window import Window

# File dialogs: title, prompt, button, and suffix of the written file.
_FILES = {
    "open": ("Open", "scene.toml, session.toml or image.exr", "Open", ""),
    "save.as": ("Save the session", "session.toml", "Save", ".toml"),
    "probe.csv": ("Write the probes as CSV", "probes.csv", "Write", ".csv"),
    "probe.cxf": ("Write the probes as CxF", "probes.cxf", "Write", ".cxf"),
    "protocol.write": ("Write the protocol", "protocol.toml", "Write", ".toml"),
    "picture.keep": ("Keep A's picture in XYZ, for B of another time", "picture.exr", "Write", ".exr"),
    "screenshot.as": ("Screenshot", "picture.png", "Write", ".png"),
}
#: Commands whose panel is a tab on the right.
TABS = {"metamerism": "Metamerism", "material.like": "Edit", "rate.note": "Protocol"}


def draw_dialog(window: Window) -> bool:
    """Draw the open dialog; return whether there is one, which takes keyboard input."""
    desk = window.desk
    name = desk.dialog
    if name in TABS:
        window.panels_shown, window.kept.tab, desk.dialog = True, TABS[name], None
        return False
    if name is None:
        window.dialog_drawn = None
        return False
    opened, window.dialog_drawn = window.dialog_drawn != name, name
    if opened:
        window.kept.typed["dialog"] = window.kept.typed["written over"] = ""
    wide = {"help": 78.0, "palette": 40.0}.get(name, 34.0)
    room = imgui.get_main_viewport().size
    across, top = min(em(wide), room.x), min(em(5.0), room.y * 0.1)
    imgui.set_next_window_pos(ImVec2(room.x / 2.0, top), 0, ImVec2(0.5, 0.0))
    # A dialog taller than the window scrolls.
    imgui.set_next_window_size_constraints(ImVec2(across, 0.0), ImVec2(across, max(room.y - top - em(0.5), em(2.0))))
    flags = imgui.WindowFlags_
    imgui.push_style_color(imgui.Col_.window_bg, window.style.panel(5.0))
    imgui.set_next_window_focus() if opened else None
    imgui.begin("Dialog", None, flags.no_title_bar | flags.no_resize | flags.no_collapse | flags.no_move
                | flags.no_saved_settings | flags.always_auto_resize | flags.no_nav)  # fmt: skip
    done = _DRAWN.get(name, _ask_file)(window, opened)
    if name == "help" and not opened and pressed(desk.commands.by_name["help"]):
        done = True
    lost = not opened and not imgui.is_window_focused(imgui.FocusedFlags_.root_and_child_windows)
    imgui.end()
    imgui.pop_style_color()
    if (done or lost or imgui.is_key_pressed(imgui.Key.escape)) and desk.dialog == name:
        desk.dialog = None
    return True


def _help(window: Window, _opened: bool) -> bool:
    draw_help(window)
    return imgui.button("Close")


def _ask_file(window: Window, opened: bool) -> bool:
    name, typed = window.desk.dialog or "", window.kept.typed
    title, hint, verb, suffix = _FILES[name]
    imgui.text_unformatted(title)
    asked = typed.get("written over")
    if opened or (asked and not imgui.is_any_item_active()):
        imgui.set_keyboard_focus_here()
    imgui.set_next_item_width(-em(6.0))
    entered, typed["dialog"] = imgui.input_text_with_hint(
        "##file", hint, typed["dialog"], imgui.InputTextFlags_.enter_returns_true
    )
    imgui.same_line()
    clicked = imgui.button(verb)
    text = typed["dialog"].strip()
    file = Path(text if text.lower().endswith(suffix) else text + suffix).expanduser()
    if text and asked == str(file):
        quiet(f"{file} is there already: {verb} once more writes over it.")
    else:
        quiet(f"in {Path.cwd()}, or with a folder before it")
    if not text or not (entered or clicked):
        return False
    if suffix and file.exists():
        if any(one.exists() and file.samefile(one) for one in window.desk.looked_at):
            window.desk.tell(f"{file} is being looked at: name another file", problem=True, about=name)
            return False
        if asked != str(file):
            typed["written over"] = str(file)
            return False
    return _do(window, name, file)


def _do(window: Window, name: str, file: Path) -> bool:
    """Perform a dialog's command with a file; return whether it was done."""
    desk = window.desk
    doing: dict[str, Callable[[], object]] = {
        "open": lambda: desk.open(str(file)),
        "save.as": lambda: desk.save_as(file),
        "probe.csv": lambda: write_probes(window, file),
        "probe.cxf": lambda: write_probes(window, file),
        "protocol.write": lambda: protocol.write_protocol_file(window, file),
        "picture.keep": lambda: window.between.append(lambda: keep_picture(window, file)),
        "screenshot.as": lambda: window.between.append(lambda: screenshot(window, file)),
    }
    return doing[name]() is not False


_DRAWN: dict[str, Callable[[Window, bool], bool]] = {"help": _help, "palette": draw_palette}
