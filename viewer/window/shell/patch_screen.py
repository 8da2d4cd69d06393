"""Patches for an instrument: a sequence of full-screen colours in exact codes."""

from __future__ import annotations

import time
from collections.abc import Callable

import glfw
import moderngl
import numpy as np
from jaxtyping import Float

from ....runtime.errors import InputError
from .main_loop import NoWindow, check_screen

_NEXT = glfw.KEY_SPACE, glfw.KEY_ENTER, glfw.KEY_RIGHT, glfw.KEY_DOWN, glfw.KEY_PAGE_DOWN
_BACK = glfw.KEY_BACKSPACE, glfw.KEY_LEFT, glfw.KEY_UP, glfw.KEY_PAGE_UP
_END = glfw.KEY_ESCAPE, glfw.KEY_Q
# A clear of a framebuffer needs no more than what moderngl itself does.
_GL = 3, 3
_GL_DITHER = 0x0BD0
# Interval of redrawing a static patch, seconds, since it may have been covered.
_AGAIN_S = 0.25
_CODES = 255.0
_WITHOUT = "`metamer display measure` has ArgyllCMS show the patches"
# Errors are reported by callers.
glfw.ERROR_REPORTING = False


class _Sequence:
    """Position in a sequence of patches, moved by keys and by time."""

    def __init__(self, count: int, seconds: float | None) -> None:
        self.count, self.seconds = count, seconds
        self.at, self.ended, self.since = 0, False, time.monotonic()

    def press(self, _window: object, key: int, _scancode: int, action: int, _modifiers: int) -> None:
        """Handle a GLFW key event: next, previous or end; others are ignored."""
        if action == glfw.RELEASE:
            return
        if key in _END:
            self.ended = True
        elif key in _NEXT or key in _BACK:
            self.go(1 if key in _NEXT else -1)

    def go(self, steps: int) -> None:
        """Move by steps, stopping at the first and last patch."""
        self.at = min(max(self.at + steps, 0), self.count - 1)
        self.since = time.monotonic()

    def left(self) -> float:
        """Return the seconds until the next drawing; advances when the time of a patch is up."""
        if self.seconds is None:
            return _AGAIN_S
        left = self.since + self.seconds - time.monotonic()
        if left <= 0.0:
            self.ended = self.at == self.count - 1
            self.go(1)
        return min(max(left, 0.0), _AGAIN_S)


def show_patches(
    codes: Float[np.ndarray, "N 3"],
    on_shown: Callable[[int], object] = lambda _: None,
    *,
    seconds: float | None = None,
    size: float = 1.0,
    surround: float = 0.0,
    screen: int = 1,
) -> int:
    """Show patches full-screen, one after another, until Escape or, with timing, the last.

    Space and the arrow keys go on and back.

    Parameters
    ----------
    codes : 0 to 1, each an exact 8-bit code. on_shown : called with the index of each patch as it is shown.
    seconds : per patch; None waits for a key. size : share of the screen's area, centred.
    surround : code of the grey around. screen : from 1.

    Returns
    -------
    Number of patches shown, from the beginning of the sequence.

    Raises
    ------
    InputError : codes of more than 8 bits; an unknown screen. NoWindow : no display or no OpenGL.
    """
    if np.abs(codes * _CODES - np.round(codes * _CODES)).max() > 0.01:
        raise InputError(
            "codes of more than 8 bits",
            field="codes",
            expected="whole codes from 0 to 255, as the window sends them",
            hint="write the patches with --bits 8, or show them by a program that sends more bits",
        )
    check_screen(_WITHOUT)
    if not glfw.init():
        raise NoWindow(_reason(), _WITHOUT)
    try:
        context, window = _opened(screen)
        sequence, seen = _Sequence(len(codes), seconds), -1
        glfw.set_key_callback(window, sequence.press)
        shown = -1
        while not sequence.ended and not glfw.window_should_close(window):
            at = sequence.at
            _draw(context.screen, glfw.get_framebuffer_size(window), codes[at], size, surround)
            if at != shown:
                shown, seen = at, max(seen, at)
                on_shown(at)
            glfw.swap_buffers(window)
            glfw.wait_events_timeout(max(sequence.left(), 1e-3))
        return seen + 1
    finally:
        glfw.terminate()


def _opened(screen: int):
    """Open a full-screen window; return it with its GL context."""
    monitors = glfw.get_monitors()
    if not 1 <= screen <= len(monitors):
        raise InputError("no such screen", field="--screen", found=screen, expected=f"1 to {len(monitors)}")
    mode = glfw.get_video_mode(monitors[screen - 1])
    hints = {
        glfw.CONTEXT_VERSION_MAJOR: _GL[0], glfw.CONTEXT_VERSION_MINOR: _GL[1],
        glfw.OPENGL_PROFILE: glfw.OPENGL_CORE_PROFILE, glfw.OPENGL_FORWARD_COMPAT: True,
        glfw.RED_BITS: mode.bits.red, glfw.GREEN_BITS: mode.bits.green, glfw.BLUE_BITS: mode.bits.blue,
        glfw.REFRESH_RATE: mode.refresh_rate, glfw.SAMPLES: 0, glfw.SRGB_CAPABLE: False, glfw.AUTO_ICONIFY: False,
    }  # fmt: skip
    for hint, value in hints.items():
        glfw.window_hint(hint, value)
    window = glfw.create_window(*mode.size, "Metamer: patches", monitors[screen - 1], None)
    if not window:
        raise NoWindow(_reason(), _WITHOUT)
    glfw.make_context_current(window)
    glfw.swap_interval(1)
    glfw.set_input_mode(window, glfw.CURSOR, glfw.CURSOR_HIDDEN)
    context = moderngl.create_context()
    context.disable_direct(_GL_DITHER)
    return context, window


def _reason() -> str:
    """Return GLFW's description of the last error."""
    _, words = glfw.get_error()
    return (words or b"the system gives none").decode("utf-8", "replace")


def _draw(
    target: moderngl.Framebuffer, pixels: tuple[int, int], code: np.ndarray, size: float, surround: float
) -> None:
    """Fill the screen with the surround, and its centre with the patch."""
    width, height = (max(round(side * size**0.5), 1) for side in pixels)
    target.use()
    target.viewport = (0, 0, *pixels)
    target.clear(surround, surround, surround, 1.0)
    middle = ((pixels[0] - width) // 2, (pixels[1] - height) // 2, width, height)
    red, green, blue = map(float, code)
    target.clear(red, green, blue, 1.0, viewport=middle)
