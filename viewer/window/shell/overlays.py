"""Overlays on the image: names of sides, the wipe's line, the scale, pins, regions."""

from __future__ import annotations

from imgui_bundle import ImVec2, imgui

from ....spectral.observers import observer_title
from ..display_pass import map_colour
from ..picture_position import seen_at
from ..state import Session
from .lens import PicturePlace
from .style import grey
from .widgets import em
from .window import Window

# Numbers along the scale.
_TICKS = 5
# Pieces that the scale is drawn in, each from one colour to the next.
_STEPS = 32


class _Pen:
    """Drawing in image coordinates."""

    def __init__(self, window: Window, corner: ImVec2, place: PicturePlace, scale: float) -> None:
        self.list = imgui.get_window_draw_list()
        self._corner, self._place, self._scale = corner, place, scale
        self._display = window.style.display

    def at(self, column: float, row: float) -> ImVec2:
        x, y = self._place.screen_of(column, row)
        return ImVec2(self._corner.x + x / self._scale, self._corner.y + y / self._scale)

    def colour(self, lightness: float, alpha: float = 1.0) -> int:
        return imgui.color_convert_float4_to_u32(grey(lightness, self._display, alpha))

    def tag(self, words: str, x: float, y: float, from_right: bool = False) -> None:
        """Draw text on a dark plate with its corner at a screen position."""
        size, pad = imgui.calc_text_size(words), em(0.35)
        x = x - size.x - 2.0 * pad if from_right else x
        self.list.add_rect_filled(
            ImVec2(x, y), ImVec2(x + size.x + 2 * pad, y + size.y + pad), self.colour(12, 0.75), 3
        )
        self.list.add_text(ImVec2(x + pad, y + pad / 2), self.colour(95), words)


def draw_overlays(
    window: Window, corner: ImVec2, size: ImVec2, place: PicturePlace, scale: float,
    dragged: tuple[float, float, float, float] | None,
) -> None:  # fmt: skip
    """Draw them over the picture, whose upper left is `corner` and whose size is `size` on the screen."""
    session, pen = window.desk.session, _Pen(window, corner, place, scale)
    pen.list.push_clip_rect(corner, ImVec2(corner.x + size.x, corner.y + size.y), True)
    _sides(window, session, pen, corner, size, place)
    if session.seen == "difference":
        _scale(window, session, pen, corner, size)
    for spot in window.probing.pins if session.pins else ():
        if spot.pixel is not None:
            for where in seen_at(session, place.seen_size, spot.pixel[0] + 0.5, spot.pixel[1] + 0.5):
                _cross(pen, pen.at(*where), spot.name)
    width, height = place.seen_size
    for one in session.regions:
        low, high = pen.at(one.left * width, one.top * height), pen.at(one.right * width, one.bottom * height)
        _box(pen, low, high)
        pen.tag(one.name, low.x, low.y)
    if dragged is not None:
        _box(pen, pen.at(*dragged[:2]), pen.at(*dragged[2:]))
    pen.list.pop_clip_rect()


def side_words(session: Session, window: Window) -> tuple[str, str]:
    """Describe each side in a few words: the differences between them."""
    other, choices = session.other, window.desk.choices
    first, second = [], []
    material = choices.material(session)
    if session.subject.kind == "image":
        first.append(_tail(session.subject.path or ""))
        second.append(_tail(other.file or session.subject.path or ""))
    else:
        first.append(_tail(material))
        second.append(_tail(other.material or material))
    if other.light is not None and other.light != session.light:
        first.append(session.light.words)
        second.append(other.light.words)
    if other.observer is not None and other.observer != session.observer:
        first.append(observer_title(session.observer).removeprefix("CIE "))
        second.append(observer_title(other.observer).removeprefix("CIE "))
    if other.made != "fast":
        first.append("fast form")
        second.append("reference" if other.made == "reference" else _tail(other.file or ""))
    if other.catalogue is not None:
        second.append(_tail(other.catalogue))
    return ", ".join(filter(None, first)), ", ".join(filter(None, second))


def _tail(name: str) -> str:
    return name.replace("\\", "/").rstrip("/").split("/")[-1]


def _sides(window: Window, session: Session, pen: _Pen, corner: ImVec2, size: ImVec2, place: PicturePlace) -> None:
    first, second = side_words(session, window)
    mode, gap = session.seen, em(0.5)
    top, right = corner.y + gap, corner.x + size.x - gap
    if mode == "A":
        pen.tag(f"A  {first}", corner.x + gap, top)
    elif mode == "B":
        pen.tag(f"B  {second}", corner.x + gap, top)
    elif mode == "difference":
        pen.tag(f"A  {first}   against   B  {second}", corner.x + gap, top)
    else:
        pen.tag(f"A  {first}", corner.x + gap, top)
        pen.tag(f"B  {second}", right, top, from_right=True)
    if mode in ("wipe", "side by side"):
        width, height = place.seen_size
        column = round(session.compare.position * width) if mode == "wipe" else width // 2
        above, below = pen.at(column, 0), pen.at(column, height)
        pen.list.add_line(above, below, pen.colour(8, 0.6), 3.0)
        pen.list.add_line(above, below, pen.colour(96), 1.0)
        if mode == "wipe":
            pen.list.add_circle_filled(ImVec2(above.x, (above.y + below.y) / 2), em(0.3), pen.colour(96))


def _scale(window: Window, session: Session, pen: _Pen, corner: ImVec2, size: ImVec2) -> None:
    compare = session.compare
    found, over = window.statistics
    pad, width, thick = em(0.6), min(em(18.0), size.x - em(3.0)), em(0.8)
    left, bottom = corner.x + em(0.6), corner.y + size.y - em(0.6)
    top = bottom - thick - 3.6 * em(1.0)
    pen.list.add_rect_filled(ImVec2(left, top), ImVec2(left + width + 2 * pad, bottom), pen.colour(12, 0.8), 3)
    words = f"ΔE {compare.formula}, reference A"
    if found is not None:
        words += f"   {over:.1%} over {compare.tolerance:.3g}"
    pen.list.add_text(ImVec2(left + pad, top + pad / 2), pen.colour(95), words)
    bar = top + em(1.9)
    # Beyond its end, so that the colour of what is above is on it, too.
    above = em(1.6)
    width -= above
    pen.list.add_rect_filled(
        ImVec2(left + pad + width + em(0.2), bar), ImVec2(left + pad + width + above, bar + thick), _scale_colour(2.0)
    )
    for step in range(_STEPS):
        low, high = (left + pad + width * place / _STEPS for place in (step, step + 1))
        begin, end = (_scale_colour(place / _STEPS) for place in (step, step + 1))
        pen.list.add_rect_filled_multi_color(ImVec2(low, bar), ImVec2(high, bar + thick), begin, end, end, begin)
    for tick in range(_TICKS + 1):
        number = f"{compare.scale * tick / _TICKS:.3g}"
        shift = imgui.calc_text_size(number).x * tick / _TICKS
        place = ImVec2(left + pad + width * tick / _TICKS - shift, bar + thick + em(0.15))
        pen.list.add_text(place, pen.colour(88), number)
    if compare.tolerance <= compare.scale:
        x = left + pad + width * compare.tolerance / compare.scale
        pen.list.add_line(ImVec2(x, bar - 3), ImVec2(x, bar + thick + 3), pen.colour(100), 2.0)


def _scale_colour(share: float) -> int:
    red, green, blue = map_colour(share)
    return imgui.color_convert_float4_to_u32(imgui.ImVec4(red / 255, green / 255, blue / 255, 1.0))


def _cross(pen: _Pen, at: ImVec2, name: str) -> None:
    reach = em(0.45)
    for colour, thick in ((pen.colour(5, 0.8), 3.0), (pen.colour(98), 1.0)):
        pen.list.add_line(ImVec2(at.x - reach, at.y), ImVec2(at.x + reach, at.y), colour, thick)
        pen.list.add_line(ImVec2(at.x, at.y - reach), ImVec2(at.x, at.y + reach), colour, thick)
    pen.tag(name, at.x + reach, at.y + reach / 2)


def _box(pen: _Pen, low: ImVec2, high: ImVec2) -> None:
    pen.list.add_rect(low, high, pen.colour(5, 0.8), 0.0, 3.0)
    pen.list.add_rect(low, high, pen.colour(98), 0.0, 1.0)
