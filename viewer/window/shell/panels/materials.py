"""Materials: which is on A, which on B, on which part."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from imgui_bundle import ImVec2, imgui

from .....materials.catalogue.catalogue import Catalogue
from .....runtime.errors import InputError
from ...commands import searched
from ..widgets import combo, em, quiet, section, tooltip
from ..window import Window

# Rows of the list that are seen at once.
_ROWS = 13


def draw(window: Window) -> None:
    """A list that is searched by words; a click puts a material on A, Shift+click or the right button on B."""
    if not section("Materials"):
        return
    desk, session, choices = window.desk, window.desk.session, window.desk.choices
    part = choices.shown_part(session)
    if len(choices.parts) > 1:
        clicked = combo("part", [(name, f"on {name}") for name in choices.parts], part)
        if clicked is not None:
            desk.run(f"part.{clicked}")
    imgui.set_next_item_width(-1.0)
    _, window.kept.searched = imgui.input_text_with_hint("##search", "search", window.kept.searched)
    names = searched(choices.materials, window.kept.searched)
    first = choices.material(session)
    second = session.other.material or first
    height = min(max(len(names), 3), _ROWS) * imgui.get_text_line_height_with_spacing() + em(0.4)
    imgui.begin_child("materials", ImVec2(0.0, height))
    clipper = imgui.ListClipper()
    clipper.begin(len(names))
    while clipper.step():
        for number in range(clipper.display_start, clipper.display_end):
            _row(window, names[number], first, second)
    imgui.end_child()
    if not names:
        quiet("no material has such a name")
    if session.other.material is not None and imgui.small_button("B as A##material"):
        desk.do(lambda now: replace(now, other=replace(now.other, material=None)), "Material of B as that of A")


def _row(window: Window, name: str, first: str, second: str) -> None:
    sides = "".join(side if name == of else " " for side, of in (("A", first), ("B", second)))
    imgui.text_disabled(sides.strip())
    imgui.same_line(em(1.6))
    if imgui.selectable(f"{name.split('/')[-1]}##{name.replace('/', ' ')}", name in (first, second))[0]:
        window.desk.run(f"other.material.{name}" if imgui.get_io().key_shift else f"material.{name}")
    standing = _standing(window.desk.loaded.catalogue, name)
    if standing in ("uplifted", "reconstructed"):
        imgui.same_line()
        imgui.text_disabled(standing)
    if imgui.is_item_clicked(1):
        window.desk.run(f"other.material.{name}")
    tooltip(f"{name}{f' ({standing})' if standing else ''}\nclick: on A; Shift+click or right button: on B")


def _standing(catalogue: Catalogue, name: str) -> str:
    """Measured, analytic, uplifted or reconstructed; "" where the file cannot be read."""
    try:
        return _read_standing(catalogue, name, catalogue.state(name))
    except InputError:
        return ""


@lru_cache(maxsize=4096)
def _read_standing(catalogue: Catalogue, name: str, state: tuple) -> str:
    """`state` : of the file; another is another material."""
    del state
    return catalogue.summary(name).standing
