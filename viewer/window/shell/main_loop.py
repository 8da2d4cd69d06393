"""Main loop of the window: hello_imgui hosts it, moderngl draws in its GL context."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import glfw
import moderngl
from imgui_bundle import hello_imgui, imgui, immapp
from imgui_bundle.glfw_utils import glfw_window_hello_imgui

from ....runtime.errors import MetamerError
from ...gl.context import REQUIRED_VERSION
from ..state import SESSION_FILE
from ..workspace import Desk
from .actions import put_actions
from .layout import draw
from .picture import PictureArea
from .style import Style
from .window import Window

#: In units of 1/96 inch, as in hello_imgui.
SIZE = (1440, 860)
_WITHOUT = "`metamer render SCENE -o OUT.png` and `metamer review` need no display"
_VERSION = f"{REQUIRED_VERSION // 100}.{REQUIRED_VERSION % 100 // 10}"


class NoWindow(MetamerError):
    """Error for a window that cannot be opened; the message has the reason and alternatives."""

    def __init__(self, reason: str, without: str = _WITHOUT) -> None:
        super().__init__(f"no window can be opened: {reason}\n  without one: {without}")


def check_screen(without: str = _WITHOUT) -> None:
    """Raise `NoWindow` if this system has no display."""
    linux = sys.platform.startswith(("linux", "freebsd"))
    if linux and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise NoWindow("neither DISPLAY nor WAYLAND_DISPLAY is set, so there is no display", without)


def run(
    desk: Desk,
    keep: Path | None = None,
    size: tuple[int, int] = SIZE,
    runs: Callable[[hello_imgui.RunnerParams, Window], None] | None = None,
    scale: float = 0.0,
) -> None:
    """Open the window, and return once it is closed.

    Parameters
    ----------
    keep : file for the session when the window is closed. size : of the window.
    runs : replaces hello_imgui's loop, for tests. scale : of text; 0 is the display's.

    Raises
    ------
    NoWindow : no display, no sufficient OpenGL, or failure to open.
    """
    check_screen()
    window = Window(desk)
    params = _params(window, size, scale)
    try:
        if runs is None:
            immapp.run(params, immapp.AddOnsParams(with_implot=True))
        else:
            runs(params, window)
    except RuntimeError as reason:
        if window.pictures is not None:
            raise
        raise NoWindow(_first_line(reason)) from reason
    finally:
        if keep is not None and window.pictures is not None:
            SESSION_FILE.write(keep, desk.session)


def _params(window: Window, size: tuple[int, int], scale: float) -> hello_imgui.RunnerParams:
    params = hello_imgui.RunnerParams()
    shown = params.app_window_params
    shown.window_title = "Metamer"
    shown.window_geometry.size = size
    shown.restore_previous_geometry = False
    params.dpi_aware_params.dpi_window_size_factor = scale
    params.ini_disable = True
    kind = hello_imgui.DefaultImGuiWindowType
    params.imgui_window_params.default_imgui_window_type = kind.no_default_window
    options = hello_imgui.OpenGlOptions()
    options.major_version, options.minor_version = REQUIRED_VERSION // 100, REQUIRED_VERSION % 100 // 10
    options.use_core_profile = options.use_forward_compat = True
    options.glsl_version = str(REQUIRED_VERSION)
    # More samples double the time of every frame, and smooth nothing that is drawn here.
    options.anti_aliasing_samples = 0
    params.renderer_backend_options.open_gl_options = options
    called = params.callbacks
    called.load_additional_fonts = window.style.load_fonts
    called.setup_imgui_config = _configure
    called.setup_imgui_style = Style.sizes
    called.post_init = lambda: _begin(window)
    called.pre_new_frame = lambda: _step(window, params)
    area = PictureArea()
    called.show_gui = lambda: draw(window, area)
    called.before_exit = window.close
    return params


def _configure() -> None:
    hello_imgui.imgui_default_settings.setup_default_imgui_config()
    io = imgui.get_io()
    # Arrows orbit, Tab hides panels: keys are commands here.
    io.config_flags &= ~int(imgui.ConfigFlags_.nav_enable_keyboard)
    io.config_input_trickle_event_queue = True


def _begin(window: Window) -> None:
    context = moderngl.create_context()
    if context.version_code < REQUIRED_VERSION:
        found = f"{context.version_code // 100}.{context.version_code % 100 // 10}"
        raise RuntimeError(f"OpenGL {found}, and {_VERSION} is needed")
    window.start(context)
    put_actions(window)
    # GLFW tells of files that are dropped, imgui does not; pyGLFW makes a list of what its types do not say.
    glfw.set_drop_callback(glfw_window_hello_imgui(), lambda _, paths: window.dropped(paths))  # pyright: ignore[reportArgumentType]


def _step(window: Window, params: hello_imgui.RunnerParams) -> None:
    window.step()
    params.fps_idling.enable_idling = not window.busy
    if window.asked_to_close:
        params.app_shall_exit = True


def _first_line(reason: Exception) -> str:
    """Put the many lines of hello_imgui into one; OpenGL by its name."""
    words = " ".join(str(reason).split()) or type(reason).__name__
    return f"{words} (OpenGL {_VERSION} is needed)" if "OpenGL" not in words else words
