"""Metamerism: which lights and observers part materials that match, worst first."""

from __future__ import annotations

from functools import partial

import numpy as np
from imgui_bundle import ImVec2, imgui, implot

from .....spectral.observers import observer_title
from ...metamerism import Cell, session_of_cell
from ...queries import metamers
from ...state import Session
from ..widgets import em, quiet, right, tooltip
from ..window import Window


def draw(window: Window) -> None:
    """A table whose rows are clicked to see them, and the same as bars."""
    session, choices = window.desk.session, window.desk.choices
    if session.subject.kind == "image":
        quiet("Materials have metamers; of an image put two lights on A and B.")
        return
    asking, compared = window.asking, window.kept.compared
    answer = asking.answer("metamerism")
    if answer is None:
        quiet("The materials on A and B, and those that are added, under all lights on keys, for all observers.")
    for name in tuple(compared):
        imgui.text_unformatted(name)
        imgui.same_line()
        if imgui.small_button(f"x##{name}"):
            compared.remove(name)
    if imgui.button("Add A"):
        add(window, choices.material(session))
    imgui.same_line()
    if imgui.button("Add B"):
        add(window, session.other.material or choices.material(session))
    imgui.same_line()
    if imgui.button("Compare##metamers"):
        ask(window)
    tooltip("The first is the standard.")
    if asking.busy("metamerism"):
        imgui.same_line()
        imgui.text_disabled("comparing")
    if answer is None:
        return
    if answer.problem:
        quiet(answer.problem)
        return
    found = answer.result
    quiet(f"standard {found.standard}, {found.formula}; index: {found.reference.words} as reference")
    _plot(window, found.cells)
    _table(window, found.standard, found.cells)


def add(window: Window, name: str) -> None:
    """One more material to compare; each once."""
    if name and name not in window.kept.compared:
        window.kept.compared.append(name)


def ask(window: Window) -> None:
    """Compare those that were added; where none were, those on A and B."""
    desk, session, choices = window.desk, window.desk.session, window.desk.choices
    if not window.kept.compared:
        add(window, choices.material(session))
        add(window, session.other.material or "")
    names = tuple(window.kept.compared)
    lights = tuple(name for name in choices.lights if name)
    catalogue, formula = desk.loaded.catalogue, session.compare.formula
    window.asking.ask("metamerism", names, lambda: metamers(catalogue, names, lights, choices.observers, formula))


def _table(window: Window, standard: str, cells: tuple[Cell, ...]) -> None:
    flags = imgui.TableFlags_.sizing_stretch_prop | imgui.TableFlags_.row_bg | imgui.TableFlags_.scroll_y
    if not imgui.begin_table("metamers", 4, flags, ImVec2(0.0, em(16.0))):
        return
    for name, width in (("light, observer", 1.6), ("material", 1.6), ("ΔE", 0.7), ("index", 0.7)):
        imgui.table_setup_column(name, imgui.TableColumnFlags_.width_stretch, width)
    imgui.table_setup_scroll_freeze(0, 1)
    imgui.table_headers_row()
    desk = window.desk
    clipper = imgui.ListClipper()
    clipper.begin(len(cells))
    while clipper.step():
        for number in range(clipper.display_start, clipper.display_end):
            one = cells[number]
            imgui.table_next_row()
            imgui.table_next_column()
            whole = imgui.SelectableFlags_.span_all_columns
            words = f"{one.conditions.illuminant}, {observer_title(one.conditions.observer).removeprefix('CIE ')}"
            if imgui.selectable(f"{words}##cell {number}", False, whole)[0]:
                said = f"See {one.material} under {one.conditions.words}"
                desk.do(partial(_seen, window, one, standard), said)
            tooltip(f"{one.material} under {one.conditions.words}: click to see it beside the standard")
            imgui.table_next_column()
            imgui.text_unformatted(one.material.split("/")[-1])
            imgui.table_next_column()
            right(f"{one.delta_e:.2f}")
            imgui.table_next_column()
            right("-" if one.index is None else f"{one.index:.2f}")
            if one.no_index:
                tooltip(one.no_index)
    imgui.end_table()


def _seen(window: Window, cell: Cell, standard: str, session: Session) -> Session:
    return session_of_cell(session, cell, standard, window.desk.choices)


def _plot(window: Window, cells: tuple[Cell, ...]) -> None:
    flags = implot.Flags_.no_menus | implot.Flags_.no_title | implot.Flags_.no_mouse_text | implot.Flags_.no_inputs
    if not implot.begin_plot("##metamers", ImVec2(-1.0, em(7.5)), flags | implot.Flags_.no_legend):
        return
    values = np.array([one.delta_e for one in cells], dtype=np.float64)
    implot.setup_axes("conditions, worst first", "ΔE", implot.AxisFlags_.no_tick_labels, 0)
    implot.setup_axes_limits(-0.5, len(values) - 0.5, 0.0, 1.1 * max(float(values.max()), 1e-3), implot.Cond_.always)
    spec = implot.Spec()
    spec.fill_color = spec.line_color = window.style.line_b
    implot.plot_bars("ΔE", values, 0.8, 0.0, spec)
    implot.end_plot()
