"""The column on the left: what is looked at, in which light, how it is compared and shown."""

from __future__ import annotations

from ..window import Window
from . import camera, compare, display, image, light, materials


def draw(window: Window) -> None:
    """A section each."""
    if window.desk.session.subject.kind == "image":
        image.draw(window)
    else:
        materials.draw(window)
    light.draw(window)
    compare.draw(window)
    display.draw(window)
    if window.desk.session.subject.kind != "image":
        camera.draw(window)
