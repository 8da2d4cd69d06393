"""Edit: parameters of the shown material, and its neighbours: like this, but warmer."""

from __future__ import annotations

from functools import partial
from typing import cast

from imgui_bundle import imgui

from .....materials.search.appearance_offset import WORDS
from .....materials.search.sliders import Slider
from ...queries import find_neighbours, sliders_of
from ..widgets import em, heading, quiet, tooltip
from ..window import Window

#: Largest wish, units of CIELAB.
MOST = 60.0


def draw(window: Window) -> None:
    """Draw controls of the material on the shown part, side A."""
    desk, session, style = window.desk, window.desk.session, window.style
    if session.subject.kind == "image":
        quiet("An image has no parameters.")
        return
    material = desk.choices.material(session)
    heading("PARAMETERS", style)
    quiet(material)
    edits = {one.parameter: one.value for one in session.edits if one.material == material}
    window.asking.ask("sliders", material, lambda: sliders_of(desk.loaded.catalogue, material), again=False)
    answer = window.asking.answer("sliders", material)
    if answer is not None and answer.problem:
        quiet(answer.problem)
    for one in (answer.result or ()) if answer else ():
        _slider(window, material, one, edits.get(one.name))
    if edits and imgui.button("As in the catalogue"):
        desk.run("material.unedited")
    heading("LIKE THIS, BUT", style)
    _neighbours(window, material)


def _slider(window: Window, material: str, one: Slider, edited: float | None) -> None:
    desk, (low, high) = window.desk, one.shown
    if not low < high:
        return
    value = one.value if edited is None else edited
    flags = imgui.SliderFlags_.always_clamp | (imgui.SliderFlags_.logarithmic if one.logarithmic else 0)
    imgui.set_next_item_width(-em(2.0))
    label = f"{one.name.replace('_', ' ')} %.4g"
    changed, found = imgui.slider_float(f"##{one.name}", value, low, high, label, flags)
    if changed:
        desk.do(lambda s: s.edited(material, one.name, found), f"{one.name} of {material}", stroke=f"edit {one.name}")
    tooltip(f"{one.domain.words}; {one.value:.4g} in the catalogue")
    if edited is not None:
        imgui.same_line()
        if imgui.small_button(f"x##{one.name}"):
            desk.do(lambda s: s.edited(material, one.name, None), f"{one.name} as in the catalogue")


def _neighbours(window: Window, material: str) -> None:
    asking, catalogue = window.asking, window.desk.loaded.catalogue
    imgui.set_next_item_width(-1.0)
    _, window.kept.amount = imgui.slider_float("##amount", window.kept.amount, 1.0, MOST, "by %.0f")
    tooltip("In units of CIELAB; of gloss a stop, which doubles the image of a lamp, counts ten.")
    by = window.kept.amount
    for number, word in enumerate(WORDS):
        if number % 4:
            imgui.same_line(0.0, em(0.2))
        if imgui.small_button(word):
            amount = by / 10.0 if word in ("glossier", "duller") else by
            work = partial(find_neighbours, catalogue, material, word, amount)
            asking.ask("like", (material, word, amount), work)
    answer = asking.answer("like")
    if asking.busy("like"):
        quiet("looking through the catalogue")
    if answer is None:
        return
    of, word, amount = cast(tuple[str, str, float], answer.key)
    quiet(f"{of}, but {word} by {amount:g}:")
    if answer.problem:
        quiet(answer.problem)
        return
    for number, one in enumerate(answer.result.found):
        if imgui.selectable(f"{one.summary.id}  {one.distance:.1f}###like {number}", False)[0]:
            window.desk.run(f"other.material.{one.summary.id}")
        tooltip("A click puts it on B. The number is how far it is from what was asked for: ΔE94 and gloss.")
    if not answer.result.found:
        quiet("nothing here is nearer to that than itself")
