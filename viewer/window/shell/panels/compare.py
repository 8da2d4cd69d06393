"""Compare: by which formula, how far its colours go, where the contour runs; and what B is."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from ...numeric_controls import CELL, SCALE, TOLERANCE
from ...state import FORMULAS
from ..widgets import button, combo, dial_slider, facts, heading, quiet, section, tooltip
from ..window import Window


def draw(window: Window) -> None:
    """Draw controls of the ΔE map and the checkerboard, and statistics of the whole picture."""
    if not section("Compare"):
        return
    desk, session, style = window.desk, window.desk.session, window.style
    compare = session.compare
    clicked = combo("formula", [(name, f"ΔE {name}") for name in FORMULAS], compare.formula)
    if clicked is not None:
        desk.run(f"formula.{clicked}")
    dial_slider(desk, TOLERANCE, "tolerance ΔE %.2f")
    dial_slider(desk, SCALE, "colours up to ΔE %.2f")
    if imgui.checkbox("contour at the tolerance", compare.contour)[0]:
        desk.run("compare.contour")
    if compare.mode == "checkerboard":
        dial_slider(desk, CELL, "cells of %.3f heights")
    found, over = window.statistics
    if found is not None:
        heading("A TO B, WHOLE PICTURE", style)
        rows = [("mean", f"{found.mean:.2f}"), ("p95", f"{found.p95:.2f}"), ("p99", f"{found.p99:.2f}"),
                ("maximum", f"{found.max:.2f}"), (f"over {compare.tolerance:.3g}", f"{over:.1%}")]  # fmt: skip
        facts("whole", rows)
    heading("B IS MADE", style)
    other, is_image = session.other, session.subject.kind == "image"
    for made, words in (("fast", "as A"), ("reference", "by the reference"))[: 1 if is_image else 2]:
        if button(f"{words}##made", other.made == made, style):
            desk.run(f"other.{made}")
        imgui.same_line()
    imgui.new_line()
    _typed(window, "file", "B from a file: EXR", other.file, "File on B")
    if not is_image:
        _typed(window, "other catalogue", "B from a catalogue: folder", other.catalogue, "Catalogue of B")
    if imgui.button("Swap A and B"):
        desk.run("compare.swap")
    imgui.same_line()
    if imgui.button("B as A"):
        desk.run("other.reset")
    if is_image:
        return
    if imgui.button("Keep A's picture..."):
        desk.run("picture.keep")
    tooltip("In XYZ, to be B of another time.")


def _typed(window: Window, key: str, hint: str, now: str | None, words: str) -> None:
    """A file or folder that B is of."""
    desk = window.desk
    field = "file" if key == "file" else "catalogue"
    if now is not None:
        quiet(now)
        if imgui.small_button(f"without##{key}"):
            desk.do(lambda s: replace(s, other=_other(s.other, field, None)), words)
        return
    imgui.set_next_item_width(-1.0)
    entered, window.kept.typed[key] = imgui.input_text_with_hint(
        f"##{key}", hint, window.kept.typed.get(key, ""), imgui.InputTextFlags_.enter_returns_true
    )
    tooltip("Enter takes it.")
    name = window.kept.typed[key].strip()
    if entered and name:
        desk.do(lambda s: replace(s, other=_other(s.other, field, name)), words)
        window.kept.typed[key] = ""


def _other(other, field: str, name: str | None):
    if field == "file":
        return replace(other, file=name, made="fast" if name is None else "file")
    return replace(other, catalogue=name)
