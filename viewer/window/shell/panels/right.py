"""The column on the right: what is under the cursor, and by tabs what else there is to know and to do."""

from __future__ import annotations

from imgui_bundle import imgui

from ..window import Window
from . import edit, metamerism, pins, probe, protocol, trust

_TABS = (
    ("Pins", pins.draw),
    ("Edit", edit.draw),
    ("Metamerism", metamerism.draw),
    ("Protocol", protocol.draw),
    ("Trust", trust.draw),
)


def draw(window: Window) -> None:
    """The probe above, the tabs below."""
    probe.draw(window)
    wanted, window.kept.tab = window.kept.tab, None
    if imgui.begin_tab_bar("tabs"):
        for name, draw_tab in _TABS:
            flags = imgui.TabItemFlags_.set_selected if wanted == name else 0
            if imgui.begin_tab_item(name, None, flags)[0]:
                draw_tab(window)
                imgui.end_tab_item()
        imgui.end_tab_bar()
