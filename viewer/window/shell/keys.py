"""Keyboard input: commands of pressed and held keys."""

from __future__ import annotations

from imgui_bundle import imgui

from ..commands import Command, Commands, chord_parts
from ..workspace import Desk

_NAMED: dict[str, imgui.Key] = {
    "Left": imgui.Key.left_arrow, "Right": imgui.Key.right_arrow, "Up": imgui.Key.up_arrow,
    "Down": imgui.Key.down_arrow, "PageUp": imgui.Key.page_up, "PageDown": imgui.Key.page_down,
    "Home": imgui.Key.home, "Space": imgui.Key.space, "Enter": imgui.Key.enter, "Tab": imgui.Key.tab,
    "Backspace": imgui.Key.backspace, ",": imgui.Key.comma, ".": imgui.Key.period, "[": imgui.Key.left_bracket,
    "]": imgui.Key.right_bracket, "=": imgui.Key.equal, "-": imgui.Key.minus,
}  # fmt: skip
# Keys by typed character, for any keyboard layout.
_TYPED = "?+"
# Commands that repeat while their key is held.
_REPEATED = (".up", ".down", ".left", ".right", ".next", ".previous", "zoom.in", "zoom.out", "undo", "redo")


def key_of(name: str) -> imgui.Key | None:
    """Return the key of a name; None for keys identified by typed character, and for Shift alone."""
    if name in _NAMED:
        return _NAMED[name]
    if len(name) == 1 and name.isalnum():
        return getattr(imgui.Key, f"_{name}" if name.isdigit() else name.lower())
    if name[0] == "F" and name[1:].isdigit():
        return getattr(imgui.Key, name.lower())
    return None


def press_keys(desk: Desk) -> None:
    """Run the commands of pressed keys; none while text is being typed."""
    io = imgui.get_io()
    if io.want_text_input:
        _hold(desk, desk.commands, False)
        return
    for chord, command in tuple(desk.commands.by_key.items()):
        if not command.held and _pressed(chord, command.name.endswith(_REPEATED)):
            desk.run(command)
    _hold(desk, desk.commands, True)


def pressed(command: Command) -> bool:
    """Return whether one of a command's keys is pressed in this frame."""
    return any(_pressed(chord, False) for chord in command.keys)


def _pressed(chord: str, repeated: bool) -> bool:
    io = imgui.get_io()
    held = frozenset(
        name for name, down in (("Ctrl", io.key_ctrl), ("Shift", io.key_shift), ("Alt", io.key_alt)) if down
    )
    wanted, name = chord_parts(chord)
    if name in _TYPED:
        return held <= {"Shift"} and name in (chr(code) for code in io.input_queue_characters)
    key = key_of(name)
    return key is not None and wanted == held and imgui.is_key_pressed(key, repeated)


def _hold(desk: Desk, commands: Commands, listen: bool) -> None:
    """Press and release commands that act while held."""
    for command in commands:
        if command.held:
            desk.hold(command, listen and any(_down(command, name) for name in command.keys))


def _down(command: Command, name: str) -> bool:
    io = imgui.get_io()
    if name == "Shift":
        # Only alone, since it has other meanings with other keys and clicks.
        others = io.key_ctrl or io.key_alt or any(imgui.is_mouse_down(number) for number in range(3))
        return io.key_shift and not others
    key = key_of(name)
    return key is not None and imgui.is_key_down(key) and not (io.key_ctrl or io.key_alt)
