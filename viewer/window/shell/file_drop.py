"""Files that are dropped onto the window: GLFW tells of them, imgui does not."""

from __future__ import annotations

from collections.abc import Callable


def on_drop(called: Callable[[list[str]], None]) -> bool:
    """Have `called` told the paths of what is dropped; False where this window cannot tell."""
    try:
        import glfw
        from imgui_bundle.glfw_utils import glfw_window_hello_imgui
    except ImportError:
        return False

    def dropped(_window: object, paths: list[str]) -> None:
        called(paths)

    # pyGLFW makes a list of what GLFW passes, which its types do not say.
    glfw.set_drop_callback(glfw_window_hello_imgui(), dropped)  # pyright: ignore[reportArgumentType]
    return True
