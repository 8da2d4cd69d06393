"""Light: booths and maps in place of a scene's lights, blends of lamps, rotation, dimming, light between surfaces."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from .....spectral.observers import observer_title
from ...light_choice import Lamp, LightChoice
from ...numeric_controls import DIMMING, ROTATION
from ...state import Session
from ..widgets import combo, dial_slider, em, heading, quiet, section, tooltip
from ..window import Window


def draw(window: Window) -> None:
    """Draw controls of side A's light, and of B's own."""
    if not section("Light"):
        return
    desk, session, style = window.desk, window.desk.session, window.style
    light, choices = session.light, desk.choices
    if choices.booths:
        options = [("", "no booth"), *((name, f"booth {name}") for name in choices.booths)]
        clicked = combo("booth", options, light.booth or "")
        if clicked is not None:
            desk.run(f"booth.{clicked}" if clicked else "light.scene")
        dial_slider(desk, ROTATION, "turned by %.0f°")
    dial_slider(desk, DIMMING, "dimmed to %.3f")
    _blend(window)
    if session.subject.kind != "image":
        _map(window)
        changed, _ = imgui.checkbox("light between surfaces", session.bounces)
        if changed:
            desk.run("bounces")
        options = [("", "all light"), *((name, f"what {name} puts on others") for name in choices.parts)]
        clicked = combo("influence", options, session.influence or "")
        if clicked is not None:
            desk.run(f"influence.{clicked or 'none'}")
    heading("LIGHT AND OBSERVER OF B", style)
    other = session.other
    options = [("as A", "as A"), *((name or "scene", name or "the scene's own") for name in choices.lights)]
    now = "as A" if other.light is None else other.light.lamps[0].name if other.light.lamps else "scene"
    clicked = combo("other light", options, now)
    if clicked == "as A":
        desk.do(lambda s: replace(s, other=replace(s.other, light=None)), "Light of B as that of A")
    elif clicked is not None:
        desk.run(f"other.light.{clicked}")
    options = [
        ("as A", "observer as A"),
        *((name, observer_title(name).removeprefix("CIE ")) for name in choices.observers),
    ]
    clicked = combo("other observer", options, other.observer or "as A")
    if clicked == "as A":
        desk.do(lambda s: replace(s, other=replace(s.other, observer=None)), "Observer of B as that of A")
    elif clicked is not None:
        desk.run(f"other.observer.{clicked}")


def _blend(window: Window) -> None:
    """Any lamp by its name or file; a second one makes a blend, whose shares are dragged."""
    desk, lamps = window.desk, window.desk.session.light.lamps
    for number, one in enumerate(lamps if len(lamps) > 1 else ()):
        imgui.set_next_item_width(-em(2.2))
        changed, share = imgui.slider_float(f"##share {number}", one.share, 0.01, 1.0, f"{one.name} %.2f")
        if changed:
            desk.do(lambda s, n=number, v=share: _with_share(s, n, v), f"Share of {one.name}", stroke=f"share {number}")
        imgui.same_line()
        if imgui.small_button(f"x##lamp {number}"):
            desk.do(lambda s, n=number: _without(s, n), f"Without {one.name}")
    imgui.set_next_item_width(-em(4.5))
    entered, window.kept.typed["lamp"] = imgui.input_text_with_hint(
        "##lamp", "lamp: name or file", window.kept.typed.get("lamp", ""), imgui.InputTextFlags_.enter_returns_true
    )
    imgui.same_line()
    clicked = imgui.button("Blend##lamp")
    tooltip("Adds the lamp to those that there are. Enter takes it in their place.")
    name = window.kept.typed["lamp"].strip()
    if name and (entered or clicked):
        blended = clicked and bool(lamps)
        desk.do(lambda s: _with_lamp(s, name, blended), f"Light: {name}")
        window.kept.typed["lamp"] = ""


def _map(window: Window) -> None:
    """A map of an environment, by its file."""
    desk, light = window.desk, window.desk.session.light
    if light.map is not None:
        quiet(f"map {light.map}")
        if imgui.small_button("No map"):
            desk.do(lambda s: replace(s, light=replace(s.light, map=None, uplift=None)), "No map")
        return
    typed = window.kept.typed
    imgui.set_next_item_width(-1.0)
    entered, typed["map"] = imgui.input_text_with_hint(
        "##map",
        "environment: EXR or HDR file",
        typed.get("map", ""),
        imgui.InputTextFlags_.enter_returns_true,
    )
    name = window.kept.typed["map"].strip()
    if entered and name:
        desk.do(lambda s: replace(s, light=replace(s.light, map=name, booth=None)), f"Environment: {name}")
        window.kept.typed["map"] = ""


def _with_lamp(session: Session, name: str, blended: bool) -> Session:
    light = session.light
    if not blended:
        chosen = LightChoice(lamps=(Lamp(name),), rotation_deg=light.rotation_deg, dimming=light.dimming)
        return replace(session, light=chosen)
    return replace(session, light=replace(light, lamps=(*light.lamps, Lamp(name))))


def _with_share(session: Session, number: int, share: float) -> Session:
    lamps = list(session.light.lamps)
    lamps[number] = replace(lamps[number], share=share)
    return replace(session, light=replace(session.light, lamps=tuple(lamps)))


def _without(session: Session, number: int) -> Session:
    lamps = tuple(one for place, one in enumerate(session.light.lamps) if place != number)
    return replace(session, light=replace(session.light, lamps=lamps))
