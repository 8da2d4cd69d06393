"""Under the cursor: colours of A and B, what the display is sent, and spectra."""

from __future__ import annotations

import numpy as np
from imgui_bundle import ImVec2, imgui, implot

from ...canvas_readback import CanvasValues
from ...canvas_renderer import Quality
from ...picture_position import side_under
from ...probe import ProbeSpectra
from ..widgets import combo, em, facts, heading, quiet
from ..window import Window

_KINDS = (("reflected", "what leaves"), ("reflectance", "reflectance"), ("incident", "what arrives"))


def draw(window: Window) -> None:
    """Numbers at once, spectra as soon as the pointer rests."""
    style, session = window.style, window.desk.session
    heading("UNDER THE CURSOR", style)
    read = window.read
    if read is None or window.pointer is None:
        imgui.text_disabled("Move over the picture.")
    else:
        _, column, row = side_under(session, window.shown_size, *window.pointer)
        two = _differ(window)
        facts("colours", list(_rows(read, two)), (1.2, 1.0, 1.0) if two else (1.2, 2.0))
        words = f"pixel {column}, {row}"
        spot = window.probing.cursor
        if spot is not None and spot.pixel == (column, row) and spot.readings and spot.readings[0].parts:
            words += f"   {', '.join(spot.readings[0].parts)}"
        if window.frame is not None and window.frame.quality != Quality.EXACT:
            words += "   not exact yet"
        imgui.text_disabled(words)
        if two:
            imgui.text("   ".join(f"ΔE {name.replace('CIE ', '')} {value:.2f}" for name, value in window.off.items()))
    _spectra(window)


def _differ(window: Window) -> bool:
    read = window.read
    return read is not None and (
        bool(np.any(read[0].xyz != read[1].xyz)) or bool(np.any(read[0].white != read[1].white))
    )


def _rows(read: tuple[CanvasValues, CanvasValues], two: bool):
    sides = read if two else read[:1]
    if two:
        yield ("", "A", "B")
    for number, name in enumerate(("L*", "a*", "b*")):
        yield (name, *(f"{one.lab[number]:.2f}" for one in sides))
    yield ("C*  h", *(f"{one.lch[1]:.2f}  {one.lch[2]:.1f}°" for one in sides))
    for number, name in enumerate("XYZ"):
        yield (name, *(f"{100.0 * one.xyz[number]:.3f}" for one in sides))
    yield ("x  y", *("-" if one.xy is None else f"{one.xy[0]:.4f}  {one.xy[1]:.4f}" for one in sides))
    yield ("displayed", *(" ".join(map(str, one.shown.codes)) for one in sides))
    if any(one.shown.clipped for one in sides):
        yield ("clipped", *(one.shown.clipped or "no" for one in sides))
    if any(one.coverage < 1.0 for one in sides):
        yield ("covered", *(f"{one.coverage:.0%}" for one in sides))


def _spectra(window: Window) -> None:
    clicked = combo("spectrum", _KINDS, window.kept.spectrum, em(9.0))
    if clicked is not None:
        window.kept.spectrum = clicked
    spot = window.probing.cursor
    found = () if spot is None else tuple(one.spectra for one in spot.readings if one.spectra is not None)
    if found:
        imgui.same_line()
        imgui.text_disabled(f"of {found[0].made_of}")
    _plot(window, found, window.kept.spectrum, em(10.5))
    if found and not any(np.isfinite(getattr(one, window.kept.spectrum)).any() for one in found):
        quiet("This is not known of emission: choose what leaves.")
    if window.probing.problem:
        quiet(window.probing.problem)


def _plot(window: Window, spectra: tuple[ProbeSpectra, ...], kind: str, height: float) -> None:
    """Spectra of A and B over the visible."""
    flags = implot.Flags_.no_menus | implot.Flags_.no_title | implot.Flags_.no_mouse_text | implot.Flags_.no_inputs
    if len(spectra) < 2:
        flags |= implot.Flags_.no_legend
    if not implot.begin_plot("##spectra", ImVec2(-1.0, height), flags):
        return
    curves = [(one.wavelengths_nm, getattr(one, kind)) for one in spectra]
    tops = [float(np.nanmax(values)) for _, values in curves if np.isfinite(values).any()]
    implot.setup_axes("nm", "", 0, 0)
    implot.setup_axes_limits(380.0, 780.0, 0.0, 1.1 * max([*tops, 1e-3]) if tops else 1.0, implot.Cond_.always)
    implot.setup_legend(implot.Location_.north_east)
    for name, colour, (nm, values) in zip("AB", (window.style.line_a, window.style.line_b), curves, strict=False):
        known = np.isfinite(values)
        if known.any():
            spec = implot.Spec()
            spec.line_color, spec.line_weight = colour, 2.0
            xs = np.ascontiguousarray(nm[known], dtype=np.float64)
            ys = np.ascontiguousarray(values[known], dtype=np.float64)
            implot.plot_line(name, xs, ys, spec)
    implot.end_plot()
