"""Commands that change no session by themselves: the window does them, by their names."""

from __future__ import annotations

from collections.abc import Iterator

from .commands import Command

# Name, words, group, keys.
_LISTED: tuple[tuple[str, str, str, tuple[str, ...]], ...] = (
    ("undo", "Undo", "Window", ("Ctrl+Z",)),
    ("redo", "Redo", "Window", ("Ctrl+Shift+Z", "Ctrl+Y")),
    ("palette", "All commands", "Window", ("Ctrl+Shift+P",)),
    ("help", "Keys", "Window", ("?", "H", "F1")),
    ("panels", "Show or hide panels", "Window", ("Tab",)),
    ("fullscreen", "Full screen", "Window", ("F11",)),
    ("open", "Open a scene, an image or a session", "Window", ("Ctrl+O",)),
    ("save", "Save the session", "Window", ("Ctrl+S",)),
    ("save.as", "Save the session as", "Window", ("Ctrl+Shift+S",)),
    ("reload", "Read scene and materials again", "Window", ("F5",)),
    ("screenshot", "Screenshot with the colour chain", "Window", ("F12",)),
    ("screenshot.as", "Screenshot under a name", "Window", ()),
    ("picture.keep", "Keep A's picture in XYZ, for B of another time", "Compare", ()),
    ("protocol.write", "Write the protocol", "Protocol", ()),
    ("quit", "Quit", "Window", ("Ctrl+Q",)),
    ("probe.pin", "Pin a probe under the cursor (Shift+click)", "Probe", ("P",)),
    ("probe.copy", "Copy the probe's values", "Probe", ("Ctrl+C",)),
    ("probe.csv", "Write the probes as CSV", "Probe", ()),
    ("probe.cxf", "Write the probes as CxF", "Probe", ()),
    ("metamerism", "Metamerism table of the materials", "Material", ("Ctrl+M",)),
    ("material.like", "Like this, but warmer", "Material", ("Ctrl+L",)),
    ("rate.approved", "Approve what is seen", "Protocol", ("Ctrl+Enter",)),
    ("rate.rejected", "Reject what is seen", "Protocol", ("Ctrl+Backspace",)),
    ("rate.note", "Rate what is seen, with a note", "Protocol", ("Enter",)),
    ("reference", "Measure this very view against the reference", "Trust", ("Ctrl+R",)),
)


def window_commands() -> Iterator[Command]:
    """Return all of them."""
    return (Command(name, words, group, keys) for name, words, group, keys in _LISTED)
