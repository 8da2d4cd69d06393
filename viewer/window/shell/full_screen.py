"""Full screen and back."""

from __future__ import annotations

import glfw
from imgui_bundle.glfw_utils import glfw_window_hello_imgui


class FullScreenSwitch:
    """Takes the first monitor for the window, and gives it back."""

    def __init__(self) -> None:
        self._before: tuple[int, int, int, int] | None = None

    def turn(self) -> None:
        """Turn it on, or off again."""
        window = glfw_window_hello_imgui()
        if self._before is None:
            monitor = glfw.get_primary_monitor()
            if not monitor:
                return
            self._before = (*glfw.get_window_pos(window), *glfw.get_window_size(window))
            mode = glfw.get_video_mode(monitor)
            glfw.set_window_monitor(window, monitor, 0, 0, *mode.size, mode.refresh_rate)
        else:
            glfw.set_window_monitor(window, None, *self._before, 0)  # pyright: ignore[reportArgumentType]
            self._before = None
