"""The look of the panels: greys of a stated L*, as the display in use shows them; nothing is coloured but pictures."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from imgui_bundle import ImVec2, ImVec4, hello_imgui, imgui, implot

from ...display.transform import DisplayTransform
from ..display_pass import surround_xyz
from ..state import Interface

#: L* of panels, of text, of what is said less loudly, and the sign of steps that stand out.
DARK, LIGHT = (20.0, 88.0, 62.0, 1.0), (88.0, 12.0, 38.0, -1.0)
#: Size of text, and of headings.
TEXT, SMALL = 15.0, 12.5
# Symbols that the font for text lacks.
_SYMBOLS = "fonts/Inconsolata-Medium.ttf"


@lru_cache(maxsize=512)
def grey(lightness: float, display: DisplayTransform, alpha: float = 1.0) -> ImVec4:
    """Return a grey of this L* on the display."""
    red, green, blue = np.clip(display.apply(surround_xyz(min(max(lightness, 0.0), 100.0))), 0.0, 1.0).tolist()
    return ImVec4(red, green, blue, alpha)


class Style:
    """Greys by what they are for, of one interface on one display."""

    def __init__(self) -> None:
        self._of: tuple[Interface, DisplayTransform] | None = None
        self.dark, self.display = True, DisplayTransform()
        self.bold: imgui.ImFont | None = None

    def load_fonts(self) -> None:
        """Text, bold text, and the symbols that those lack; hello_imgui asks for it once."""
        merged = hello_imgui.FontLoadingParams()
        merged.merge_to_last_font = True
        for name in ("fonts/Roboto/Roboto-Regular.ttf", "fonts/Roboto/Roboto-Bold.ttf"):
            self.bold = hello_imgui.load_font(name, TEXT, hello_imgui.FontLoadingParams())
            hello_imgui.load_font(_SYMBOLS, TEXT, merged)

    def put(self, interface: Interface, display: DisplayTransform) -> None:
        """Take these from now on."""
        if self._of == (interface, display):
            return
        self._of, self.dark, self.display = (interface, display), interface == "dark", display
        base, text, quiet, sign = DARK if self.dark else LIGHT
        style, kinds = imgui.get_style(), imgui.Col_
        for number in range(int(kinds.count)):
            # Whatever has no grey of its own below keeps its lightness.
            now = style.color_(number)
            level = 0.2126 * now.x + 0.7152 * now.y + 0.0722 * now.z
            style.set_color_(number, ImVec4(level, level, level, now.w))
        steps = {
            kinds.window_bg: 0, kinds.child_bg: 0, kinds.popup_bg: 4, kinds.menu_bar_bg: 0, kinds.title_bg: 4,
            kinds.title_bg_active: 8, kinds.frame_bg: 7, kinds.frame_bg_hovered: 12, kinds.frame_bg_active: 17,
            kinds.button: 9, kinds.button_hovered: 15, kinds.button_active: 26, kinds.header: 11,
            kinds.header_hovered: 15, kinds.header_active: 22, kinds.slider_grab: 18, kinds.slider_grab_active: 28,
            kinds.border: 9, kinds.separator: 10, kinds.scrollbar_bg: 0, kinds.scrollbar_grab: 14, kinds.tab: 5,
            kinds.scrollbar_grab_hovered: 20, kinds.scrollbar_grab_active: 26, kinds.tab_hovered: 15,
            kinds.tab_selected: 13, kinds.table_header_bg: 6, kinds.table_border_light: 7,
            kinds.table_border_strong: 10, kinds.resize_grip: 8, kinds.text_selected_bg: 25,
            kinds.checkbox_selected_bg: 7,
        }  # fmt: skip
        for kind, step in steps.items():
            style.set_color_(kind, grey(base + sign * step, display))
        for kind in (kinds.text, kinds.check_mark):
            style.set_color_(kind, grey(text, display))
        style.set_color_(kinds.text_disabled, grey(quiet, display))
        style.set_color_(kinds.modal_window_dim_bg, grey(base, display, 0.6))
        plots = implot.get_style()
        for number in range(int(implot.Col_.count)):
            plots.set_color_(number, grey(base + sign * 7, display, 0.0))
        for kind in (implot.Col_.plot_bg, implot.Col_.legend_bg):
            plots.set_color_(kind, grey(base + sign * 6, display))
        for kind in (implot.Col_.axis_text, implot.Col_.legend_text, implot.Col_.title_text, implot.Col_.inlay_text):
            plots.set_color_(kind, grey(text, display))
        plots.set_color_(implot.Col_.axis_grid, grey(base + sign * 15, display))
        plots.set_color_(implot.Col_.crosshairs, grey(text, display))

    @staticmethod
    def sizes() -> None:
        """Distances and corners, in sizes of text; hello_imgui asks for it once, and scales them for the display."""
        style = imgui.get_style()
        style.window_rounding = style.child_rounding = style.window_border_size = 0.0
        style.frame_rounding = style.grab_rounding = style.tab_rounding = style.popup_rounding = 3.0
        style.frame_border_size = style.child_border_size = 0.0
        style.window_padding, style.item_spacing = ImVec2(12, 10), ImVec2(8, 5)
        style.frame_padding, style.scrollbar_size = ImVec2(8, 3), 10.0
        style.cell_padding = ImVec2(6, 2)
        # Words stand on it: it is no wider than a letter, and far from their grey.
        style.grab_min_size = 6.0

    def panel(self, step: float = 0.0, alpha: float = 1.0) -> ImVec4:
        """Return a grey that stands out from the panels' by so much L*."""
        base, _, _, sign = DARK if self.dark else LIGHT
        return grey(base + sign * step, self.display, alpha)

    @property
    def line_a(self) -> ImVec4:
        """Return the colour of side A in plots."""
        return grey(95.0 if self.dark else 8.0, self.display)

    @property
    def line_b(self) -> ImVec4:
        """Return the colour of side B in plots."""
        return grey(62.0 if self.dark else 52.0, self.display)

    @property
    def chosen(self) -> tuple[ImVec4, ImVec4]:
        """Return the colours of a chosen button and its text."""
        return grey(56.0 if self.dark else 48.0, self.display), grey(100.0, self.display)
