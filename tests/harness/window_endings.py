"""Opens `metamer view` and does one thing to its window: python window_endings.py HOW SCENE CATALOGUE

HOW: "close" as soon as anything is drawn, "minimise" and then close, "interrupt" by SIGINT once the reference is being
measured, whose process is named on standard output.
"""

from __future__ import annotations

import os
import signal
import sys

import glfw
from imgui_bundle.glfw_utils import glfw_window_hello_imgui
from metamer.cli.main import main
from metamer.viewer.window.shell.window import Window


def close():
    glfw.set_window_should_close(glfw_window_hello_imgui(), True)


def ending(how):
    """Return what is done after each step of the window."""
    frames = 0

    def after(window):
        nonlocal frames
        frames += 1
        if how == "close" and frames == 3:
            close()
        elif how == "minimise":
            {4: lambda: glfw.iconify_window(glfw_window_hello_imgui()),
             9: lambda: glfw.restore_window(glfw_window_hello_imgui()),
             14: close}.get(frames, int)()  # fmt: skip
        elif how == "interrupt" and (process := window.measuring._worker._process) is not None and process.pid:
            print(process.pid, flush=True)
            os.kill(os.getpid(), signal.SIGINT)
        elif how == "interrupt" and frames == 3:
            # A small picture is exact soon, and then it is measured.
            glfw.set_window_size(glfw_window_hello_imgui(), 160, 120)

    return after


if __name__ == "__main__":
    how, scene, catalogue = sys.argv[1:]
    step, after = Window.step, ending(how)

    def stepped(window):
        step(window)
        after(window)

    Window.step = stepped
    # A shell's background job hands an ignored SIGINT down to all of its children.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    # The words of the command, as if typed.
    sys.argv = ["metamer", "view", scene, "--catalogue", catalogue]
    sys.exit(main())
