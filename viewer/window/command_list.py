"""List of commands and their keys, which follow other image viewers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ...spectral.adaptation import degree_of_adaptation
from ...spectral.observers import observer_title
from .choices import Choices
from .commands import Change, Command, Commands, following, stepped
from .light_choice import LightChoice
from .numeric_controls import DIALS, EXPOSURE, SCALE, TOLERANCE
from .state import FORMULAS, MODES, Adaptation, Mode, Other, Session
from .viewpoint import framed, orbited, panned, zoomed

# Degrees, image heights and factors per key stroke.
ORBIT_DEG, PAN, ZOOM = 15.0, 0.1, 1.1
#: Initial speed of the turntable.
TURNTABLE_DEG_S = 30.0
_MODE_KEYS: dict[Mode, tuple[str, ...]] = {
    "A": ("A",),
    "B": ("B",),
    "wipe": ("W", "F6"),
    "side by side": ("S",),
    "checkerboard": ("C",),
    "difference": ("D",),
}

# Commands without change of the session, performed by the window: name, words, group, keys.
_OF_THE_WINDOW: tuple[tuple[str, str, str, tuple[str, ...]], ...] = (
    ("undo", "Undo", "Window", ("Ctrl+Z",)),
    ("redo", "Redo", "Window", ("Ctrl+Shift+Z", "Ctrl+Y")),
    ("palette", "All commands", "Window", ("Ctrl+Shift+P",)),
    ("help", "Keys", "Window", ("?", "H", "F1")),
    ("panels", "Show or hide panels", "Window", ("Tab",)),
    ("fullscreen", "Full screen", "Window", ("F11",)),
    ("open", "Open a scene, an image or a session", "Window", ("Ctrl+O",)),
    ("save", "Save the session", "Window", ("Ctrl+S",)),
    ("save.as", "Save the session as", "Window", ("Ctrl+Shift+S",)),
    ("reload", "Read scene and materials again", "Window", ("F5",)),
    ("screenshot", "Screenshot with the colour chain", "Window", ("F12",)),
    ("screenshot.as", "Screenshot under a name", "Window", ()),
    ("picture.keep", "Keep A's picture in XYZ, for B of another time", "Compare", ()),
    ("protocol.write", "Write the protocol", "Protocol", ()),
    ("quit", "Quit", "Window", ("Ctrl+Q",)),
    ("probe.pin", "Pin a probe under the cursor (Shift+click)", "Probe", ("P",)),
    ("probe.copy", "Copy the probe's values", "Probe", ("Ctrl+C",)),
    ("probe.csv", "Write the probes as CSV", "Probe", ()),
    ("probe.cxf", "Write the probes as CxF", "Probe", ()),
    ("metamerism", "Metamerism table of the materials", "Material", ("Ctrl+M",)),
    ("material.like", "Like this, but warmer", "Material", ("Ctrl+L",)),
    ("rate.approved", "Approve what is seen", "Protocol", ("Ctrl+Enter",)),
    ("rate.rejected", "Reject what is seen", "Protocol", ("Ctrl+Backspace",)),
    ("rate.note", "Rate what is seen, with a note", "Protocol", ("Enter",)),
    ("reference", "Measure this very view against the reference", "Trust", ("Ctrl+R",)),
)


def commands(choices: Choices) -> Commands:
    """Return all commands for given choices."""
    groups = (_light, _observer, _compare, _look, _material, _adaptation, _display, _other, _window)
    return Commands(one for group in groups for one in group(choices))


def _light(choices: Choices) -> Iterator[Command]:
    def named(name: str | None, now: LightChoice) -> LightChoice:
        chosen = LightChoice() if name is None else LightChoice.named(name)
        return replace(chosen, rotation_deg=now.rotation_deg, dimming=now.dimming)

    def of_a(session: Session, name: str | None) -> Session:
        return replace(session, light=named(name, session.light))

    def of_b(session: Session, name: str | None) -> Session:
        return replace(session, other=replace(session.other, light=named(name, session.light)))

    def booth(session: Session, name: str) -> Session:
        now = session.light
        return replace(session, light=LightChoice(booth=name, rotation_deg=now.rotation_deg, dimming=now.dimming))

    def next_one(session: Session, steps: int) -> Session:
        now = session.light.lamps[0].name if session.light.lamps else None
        return of_a(session, following(choices.lights, now, steps))

    def turned(session: Session, degrees: float) -> Session:
        angle = (session.light.rotation_deg + degrees + 180.0) % 360.0 - 180.0
        return replace(session, light=replace(session.light, rotation_deg=angle))

    for number, name in enumerate(choices.lights, 1):
        called = name or "the scene's own"
        key = (str(number),) if number <= 9 else ()
        yield Command(f"light.{name or 'scene'}", f"Light: {called}", "Light", key, partial(of_a, name=name))
    yield Command("light.next", "Next light", "Light", ("L",), partial(next_one, steps=1))
    yield Command("light.previous", "Previous light", "Light", ("Shift+L",), partial(next_one, steps=-1))
    for number, name in enumerate(choices.booths, 1):
        key = (f"Ctrl+{number}",) if number <= 9 else ()
        yield Command(f"booth.{name}", f"Light booth: {name}", "Light", key, partial(booth, name=name))
    yield Command("light.left", "Turn the light left", "Light", (",",), partial(turned, degrees=-15.0))
    yield Command("light.right", "Turn the light right", "Light", (".",), partial(turned, degrees=15.0))
    for number, name in enumerate(choices.lights, 1):
        key = (f"Shift+{number}",) if number <= 9 else ()
        words = f"Light of B: {name or 'the scene’s own'}"
        yield Command(f"other.light.{name or 'scene'}", words, "Side B", key, partial(of_b, name=name))


def _observer(choices: Choices) -> Iterator[Command]:
    def of_a(session: Session, name: str) -> Session:
        return replace(session, observer=name)

    def next_one(session: Session, steps: int) -> Session:
        return of_a(session, following(choices.observers, session.observer, steps))

    for name in choices.observers:
        words = f"Observer: {observer_title(name)}"
        yield Command(f"observer.{name}", words, "Observer", (), partial(of_a, name=name))
    yield Command("observer.next", "Next observer", "Observer", ("O",), partial(next_one, steps=1))
    yield Command("observer.previous", "Previous observer", "Observer", ("Shift+O",), partial(next_one, steps=-1))
    for name in choices.observers:
        words = f"Observer of B: {observer_title(name)}"
        yield Command(f"other.observer.{name}", words, "Side B", (), _of_other(observer=name))


def _compare(choices: Choices) -> Iterator[Command]:
    def put(session: Session, **changes: Any) -> Session:
        return replace(session, compare=replace(session.compare, **changes))

    def next_formula(session: Session) -> Session:
        return put(session, formula=following(FORMULAS, session.compare.formula, 1))

    def flicked(session: Session) -> Session:
        return replace(session, flicked=not session.flicked)

    names = {"A": "Side A alone", "B": "Side B alone", "difference": "ΔE map"}
    for mode in MODES:
        words = names.get(mode, f"A and B: {mode}")
        yield Command(f"compare.{mode}", words, "Compare", _MODE_KEYS[mode], partial(put, mode=mode))
    yield Command("compare.flick", "Flick to the other side", "Compare", ("Space", "Shift"), flicked, held=True)
    yield Command("compare.swap", "Swap A and B", "Compare", ("X",), partial(swapped, choices=choices))
    for formula in FORMULAS:
        yield Command(f"formula.{formula}", f"ΔE by {formula}", "Compare", (), partial(put, formula=formula))
    yield Command("formula.next", "Next ΔE formula", "Compare", ("Shift+D",), next_formula)
    contour = lambda session: put(session, contour=not session.compare.contour)  # noqa: E731
    yield Command("compare.contour", "Contour at the tolerance", "Compare", ("Shift+C",), contour)
    yield from stepped(TOLERANCE, "Compare", ("]",), ("[",))
    yield from stepped(SCALE, "Compare", ("Shift+]",), ("Shift+[",))
    yield Command("other.reset", "B as A", "Side B", (), lambda session: replace(session, other=Other()))
    yield Command("other.reference", "B: the reference", "Side B", (), _of_other(made="reference", file=None))
    yield Command("other.fast", "B: fast forms", "Side B", (), _of_other(made="fast", file=None))


def _look(choices: Choices) -> Iterator[Command]:
    def seen(change: Any, *given: Any) -> Change:
        return lambda session: replace(session, view=change(session.view, *given))

    def camera(session: Session, steps: int) -> Session:
        names = [one.name for one in choices.cameras]
        chosen = following(names, session.view.name, steps)
        return replace(session, view=choices.cameras[names.index(chosen)])

    def turning(session: Session) -> Session:
        return replace(session, turntable_deg_s=0.0 if session.turntable_deg_s else TURNTABLE_DEG_S)

    def shaped(session: Session, shape: str | None) -> Session:
        return replace(session, subject=replace(session.subject, shape=shape))

    yield Command("view.frame", "Frame all", "Look", ("F",), seen(framed, choices.low, choices.high))
    yield Command("view.home", "The scene's camera", "Look", ("Home",), partial(camera, steps=0))
    yield Command("view.next", "Next camera", "Look", ("PageDown",), partial(camera, steps=1))
    yield Command("view.previous", "Previous camera", "Look", ("PageUp",), partial(camera, steps=-1))
    yield Command("view.left", "Orbit left", "Look", ("Left",), seen(orbited, -ORBIT_DEG))
    yield Command("view.right", "Orbit right", "Look", ("Right",), seen(orbited, ORBIT_DEG))
    yield Command("view.up", "Orbit up", "Look", ("Up",), seen(orbited, 0.0, ORBIT_DEG))
    yield Command("view.down", "Orbit down", "Look", ("Down",), seen(orbited, 0.0, -ORBIT_DEG))
    yield Command("pan.left", "Pan left", "Look", ("Shift+Left",), seen(panned, -PAN, 0.0))
    yield Command("pan.right", "Pan right", "Look", ("Shift+Right",), seen(panned, PAN, 0.0))
    yield Command("pan.up", "Pan up", "Look", ("Shift+Up",), seen(panned, 0.0, PAN))
    yield Command("pan.down", "Pan down", "Look", ("Shift+Down",), seen(panned, 0.0, -PAN))
    yield Command("zoom.in", "Zoom in", "Look", ("=", "+"), seen(zoomed, ZOOM))
    yield Command("zoom.out", "Zoom out", "Look", ("-",), seen(zoomed, 1.0 / ZOOM))
    yield Command("turntable", "Turntable on or off", "Look", ("T",), turning)
    for shape in choices.shapes:
        yield Command(f"shape.{shape}", f"Shape: {shape.replace('_', ' ')}", "Look", (), partial(shaped, shape=shape))
    yield Command("shape.scene", "Shape: the scene's own", "Look", (), partial(shaped, shape=None))


def _material(choices: Choices) -> Iterator[Command]:
    def of_a(session: Session, name: str) -> Session:
        return session.wearing(choices.shown_part(session), name)

    def known(session: Session) -> tuple[str, ...]:
        return session.subject.materials or choices.materials

    def next_one(session: Session, steps: int) -> Session:
        return (
            of_a(session, following(there, choices.material(session), steps)) if (there := known(session)) else session
        )

    def next_of_b(session: Session, steps: int) -> Session:
        if not (there := known(session)):
            return session
        now = session.other.material or choices.material(session)
        return _of_other(material=following(there, now, steps))(session)

    def unedited(session: Session) -> Session:
        return replace(session, edits=())

    def part(session: Session, name: str) -> Session:
        return replace(session, part=name)

    for name in choices.materials:
        yield Command(f"material.{name}", f"Material: {name}", "Material", (), partial(of_a, name=name))
        yield Command(f"other.material.{name}", f"Material of B: {name}", "Side B", (), _of_other(material=name))
    yield Command("material.next", "Next material", "Material", ("N",), partial(next_one, steps=1))
    yield Command("material.previous", "Previous material", "Material", ("Shift+N",), partial(next_one, steps=-1))
    yield Command("other.material.next", "Next material of B", "Side B", ("M",), partial(next_of_b, steps=1))
    previous = partial(next_of_b, steps=-1)
    yield Command("other.material.previous", "Previous material of B", "Side B", ("Shift+M",), previous)
    yield Command("material.unedited", "All parameters as in the catalogue", "Material", (), unedited)
    for name in choices.parts:
        yield Command(f"part.{name}", f"Materials are shown on {name}", "Material", (), partial(part, name=name))


def _adaptation(choices: Choices) -> Iterator[Command]:
    # The adapting field is a grey of 20 % of the white.
    incomplete = degree_of_adaptation(choices.reference_illuminance_lux / np.pi * 0.2)
    degrees = {"full": 1.0, "none": 0.0, "incomplete": incomplete}

    def to(session: Session, degree: float) -> Session:
        return replace(session, adaptation=Adaptation(session.adaptation.method, degree))

    def next_one(session: Session) -> Session:
        return to(session, following(tuple(degrees.values()), session.adaptation.degree, 1))

    for name, degree in degrees.items():
        words = f"Adaptation: {name}" + (f" (D = {degree:.2f})" if name == "incomplete" else "")
        yield Command(f"adaptation.{name}", words, "Adaptation", (), partial(to, degree=degree))
    yield Command("adaptation.next", "Next adaptation", "Adaptation", ("K",), next_one)


def _display(choices: Choices) -> Iterator[Command]:
    def put(session: Session, **changes: Any) -> Session:
        return replace(session, shown=replace(session.shown, **changes))

    yield from stepped(EXPOSURE, "Display", ("E",), ("Shift+E",))
    for display, views in choices.views.items():
        for view in views:
            chosen = partial(put, display=display, view=view)
            yield Command(f"display.{display}.{view}", f"Display: {display}, {view}", "Display", (), chosen)
        yield Command(f"proof.{display}", f"Soft proof: {display}", "Display", (), partial(put, proof=display))
    yield Command("proof.none", "No soft proof", "Display", (), partial(put, proof=None))
    warned = lambda session: put(session, gamut_warning=not session.shown.gamut_warning)  # noqa: E731
    yield Command("display.gamut", "Gamut and clipping warning", "Display", ("G",), warned)


def _other(choices: Choices) -> Iterator[Command]:
    def reset(session: Session) -> Session:
        light = replace(session.light, rotation_deg=0.0, dimming=1.0)
        return replace(session, light=light, exposure=0.0, adaptation=Adaptation(session.adaptation.method))

    def bounces(session: Session) -> Session:
        return replace(session, bounces=not session.bounces)

    def influence(session: Session, name: str | None) -> Session:
        return replace(session, influence=name)

    def bright(session: Session) -> Session:
        return replace(session, interface="light" if session.interface == "dark" else "dark")

    yield Command("reset", "Exposure, dimming, rotation and adaptation as at first", "Display", ("R",), reset)
    yield Command("bounces", "Light between surfaces on or off", "Light", ("I",), bounces)
    for name in choices.parts:
        words = f"What {name} puts on other parts"
        yield Command(f"influence.{name}", words, "Light", (), partial(influence, name=name))
    yield Command("influence.none", "The whole picture again", "Light", (), partial(influence, name=None))
    yield Command("interface", "Light or dark panels", "Window", (), bright)
    yield Command("probe.unpin", "Unpin all probes", "Probe", ("U",), lambda session: replace(session, pins=()))
    clear = lambda session: replace(session, regions=())  # noqa: E731
    yield Command("probe.regions.none", "No regions", "Probe", ("Shift+U",), clear)
    keyed = {EXPOSURE.name, TOLERANCE.name, SCALE.name}
    for dial in DIALS:
        if dial.name not in keyed:
            yield from stepped(dial, "Dials")


def _window(choices: Choices) -> Iterator[Command]:
    yield from window_commands()


def _of_other(**changes: Any) -> Change:
    return lambda session: replace(session, other=replace(session.other, **changes))


def swapped(session: Session, choices: Choices) -> Session:
    """Swap A and B in the settings that B overrides; others stay common to both."""
    other, changes = session.other, {}
    now = session
    if other.material is not None:
        changes["material"] = choices.material(session) or None
        now = now.wearing(choices.shown_part(session), other.material)
    if other.light is not None:
        changes["light"] = session.light
        now = replace(now, light=other.light)
    if other.observer is not None:
        changes["observer"] = session.observer
        now = replace(now, observer=other.observer)
    if other.catalogue is not None and session.catalogue is not None:
        changes["catalogue"] = session.catalogue
        now = replace(now, catalogue=other.catalogue)
    return replace(now, other=replace(other, **changes))


def window_commands() -> Iterator[Command]:
    """Yield the commands performed by the window."""
    return (Command(name, words, group, keys) for name, words, group, keys in _OF_THE_WINDOW)
