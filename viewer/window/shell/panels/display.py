"""Display of the picture: exposure, surround, adaptation, the display and its view, warnings, soft proof."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

from imgui_bundle import imgui

from .....calibration.display.icc_profile import PREFIX
from .....runtime.errors import InputError
from ....display.transform import DisplayTransform
from ...numeric_controls import DEGREE, EXPOSURE, SURROUND
from ...session_loader import display_views
from ...state import Session
from ..widgets import button, combo, dial_slider, em, heading, quiet, section
from ..window import Window


def draw(window: Window) -> None:
    """Draw controls of what is between the picture and the eye."""
    if not section("Display"):
        return
    desk, session, style = window.desk, window.desk.session, window.style
    dial_slider(desk, EXPOSURE, "exposure %+.1f EV")
    dial_slider(desk, SURROUND, "surround L* %.0f")
    heading("ADAPTATION", style)
    adapted = {1.0: "full", 0.0: "none"}.get(session.adaptation.degree, "incomplete")
    for name in ("full", "incomplete", "none"):
        if button(f"{name.capitalize()}##adaptation", name == adapted, style):
            desk.run(f"adaptation.{name}")
        imgui.same_line(0.0, em(0.2))
    imgui.new_line()
    dial_slider(desk, DEGREE, "degree D %.2f")
    heading("DISPLAY AND VIEW", style)
    frame = window.frame
    shown = frame.display if frame is not None else style.display
    _config(window, shown.display if shown.profile is not None else session.shown.config)
    there = _views(session.shown.config, shown)
    # As menus list it, whomever it is aimed for.
    listed = shown.display if shown.profile is None else shown.name
    clicked = combo("display", [(name, name) for name in there], listed)
    if clicked is not None and clicked != listed:
        view = shown.view if shown.view in there[clicked] else there[clicked][0]
        desk.do(partial(_put, display=clicked, view=view), f"Display {clicked}, {view}")
    clicked = combo("view", [(name, name) for name in there.get(shown.display, (shown.view,))], shown.view)
    if clicked is not None:
        desk.do(partial(_put, display=shown.display, view=clicked), f"Display {shown.display}, {clicked}")
    if not shown.is_colorimetric:
        quiet("This view is tone-mapped: it is not colorimetric.")
    if imgui.checkbox("mark what is clipped", session.shown.gamut_warning)[0]:
        desk.run("display.gamut")
    if session.shown.gamut_warning:
        quiet("Red: brighter than white. Blue: outside the gamut. Green: darker than black.")
    _proof(window, session.shown.proof or "")
    if imgui.button("Light panels" if session.interface == "dark" else "Dark panels"):
        desk.run("interface")


def _proof(window: Window, now: str) -> None:
    """Choose what another display would show: one of the configuration, or one by its ICC profile."""
    desk = window.desk
    named = [*desk.choices.views, *([now] if now.startswith(PREFIX) else [])]
    clicked = combo("proof", [("", "no soft proof"), *((name, f"proof {name}") for name in named)], now)
    if clicked is not None and clicked != now:
        desk.run(f"proof.{clicked}" if clicked else "proof.none")
    name = _entered(window, "proof", "icc:FILE to proof for")
    if name:
        desk.do(partial(_put, proof=name), f"Soft proof by {name}")


def _entered(window: Window, key: str, hint: str) -> str:
    """Return what was typed and confirmed; "" until it is."""
    typed = window.kept.typed
    imgui.set_next_item_width(-1.0)
    entered, typed[key] = imgui.input_text_with_hint(
        f"##{key}", hint, typed.get(key, ""), imgui.InputTextFlags_.enter_returns_true
    )
    return typed.pop(key).strip() if entered else ""


def _config(window: Window, now: str | None) -> None:
    """Another configuration of OpenColorIO: its first display, colorimetric where it says so; or an ICC profile."""
    desk = window.desk
    if now is not None:
        quiet(now)
        if imgui.small_button("Display as before"):
            desk.do(partial(_put, config=None, display=None, view=None), "Display as before")
        return
    name = _entered(window, "config", "config.ocio, ocio://... or icc:FILE")
    if name:
        desk.do(partial(_configured, name=name), f"Display by {name}")


def _configured(session: Session, name: str) -> Session:
    if name.startswith(PREFIX):
        return _put(session, config=None, display=name, view=None)
    there = display_views(name)
    display = next(iter(there))
    plain = [view for view in there[display] if "un-tone" in view.lower() or "colorimetric" in view.lower()]
    return _put(session, config=name, display=display, view=(plain or list(there[display]))[0])


def _put(session: Session, **changes: str | None) -> Session:
    return replace(session, shown=replace(session.shown, **changes))


def _views(config: str | None, shown: DisplayTransform) -> Mapping[str, tuple[str, ...]]:
    """Return what there is to choose from; what is shown where the configuration cannot be read any more."""
    own = {shown.name: (shown.view,)} if shown.profile is not None else {}
    try:
        return {**own, **display_views(config or shown.config)}
    except InputError:
        return {shown.display: (shown.view,)}
