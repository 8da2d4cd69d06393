"""Pinned probes and regions: what each reads now; copied, and written for others."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from ...probe import ProbeReading
from ..widgets import quiet, right
from ..window import Window


def draw(window: Window) -> None:
    """A row a pin and side, a row a region."""
    desk, session = window.desk, window.desk.session
    if imgui.button("Copy"):
        desk.run("probe.copy")
    imgui.same_line()
    if imgui.button("CSV..."):
        desk.run("probe.csv")
    imgui.same_line()
    if imgui.button("CxF..."):
        desk.run("probe.cxf")
    if session.pins or session.regions:
        imgui.same_line()
        if imgui.button("Unpin all"):
            desk.run("probe.unpin")
            desk.run("probe.regions.none")
    if not session.pins and not session.regions:
        surface = "" if session.subject.kind == "image" else "Shift+click, or P, pins a probe to the surface. "
        quiet(f"{surface}Ctrl+drag draws a region.")
        return
    if imgui.begin_table("pins", 6, imgui.TableFlags_.sizing_stretch_prop | imgui.TableFlags_.row_bg):
        for name, width in (("", 1.6), ("", 0.4), ("L*", 1.0), ("a*", 1.0), ("b*", 1.0), ("", 0.5)):
            imgui.table_setup_column(name, imgui.TableColumnFlags_.width_stretch, width)
        imgui.table_headers_row()
        fresh = window.probing.fresh("pins", window.view)
        known = {spot.name: spot for spot in window.probing.pins if fresh}
        for pin in session.pins:
            spot = known.get(pin.name)
            if spot is None or spot.pixel is None:
                _row(window, pin.name, "", None, spot.why if spot else "being read", "pins")
                continue
            for number, reading in enumerate(spot.readings):
                side = "AB"[number] if len(spot.readings) > 1 else ""
                _row(window, pin.name if number == 0 else "", side, reading, "", "pins")
        for region in session.regions:
            values = window.regions.get(region.name)
            for number, one in enumerate(values or ()):
                _row(window, region.name if number == 0 else "", "AB"[number], one, "", "regions")
        imgui.end_table()


def _row(window: Window, name: str, side: str, reading: ProbeReading | object | None, why: str, kind: str) -> None:
    imgui.table_next_row()
    imgui.table_next_column()
    imgui.text_unformatted(name)
    imgui.table_next_column()
    imgui.text_disabled(side)
    if reading is None:
        imgui.table_next_column()
        imgui.text_disabled(why)
    else:
        for value in reading.lab:
            imgui.table_next_column()
            right(f"{value:.2f}")
    imgui.table_set_column_index(5)
    if name and imgui.small_button(f"x##{kind} {name}"):
        window.desk.do(lambda session: _without(session, kind, name), f"Remove {name}")


def _without(session, kind: str, name: str):
    return replace(session, **{kind: tuple(one for one in getattr(session, kind) if one.name != name)})
