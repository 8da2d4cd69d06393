"""The reviewer's protocol: what is seen is approved, rejected or scored, with a note."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from imgui_bundle import imgui

from .....calibration.report.rating import MOST, Rating, Verdict, write_protocol
from ..actions import rate
from ..widgets import em, quiet, tooltip
from ..window import Window

_VERDICTS: tuple[tuple[str, Verdict], ...] = (("Approve", "approved"), ("Reject", "rejected"), ("Note only", "open"))


def draw(window: Window) -> None:
    """Draw the rating of the shown material under its light; below, all ratings."""
    desk, session = window.desk, window.desk.session
    if session.subject.kind == "image":
        quiet("Materials are rated; an image has none.")
        return
    quiet(f"{desk.choices.material(session)} under {session.light.words}")
    imgui.set_next_item_width(-1.0)
    _, desk.reviewer = imgui.input_text_with_hint("##reviewer", "who is reviewing", desk.reviewer)
    imgui.set_next_item_width(-1.0)
    _, window.kept.note = imgui.input_text_with_hint("##note", "note", window.kept.note)
    imgui.set_next_item_width(em(8.0))
    words = "score %d" if window.kept.score else "no score"
    _, window.kept.score = imgui.slider_int("##score", window.kept.score, 0, MOST, words)
    tooltip(f"1 is bad, {MOST} is good.")
    for label, verdict in _VERDICTS:
        if imgui.button(label):
            rate(window, verdict, window.kept.score, window.kept.note)
            window.kept.note, window.kept.score = "", 0
        imgui.same_line()
    imgui.new_line()
    if session.ratings:
        for one in reversed(session.ratings):
            _entry(window, one)
        if imgui.button("Write the protocol..."):
            desk.dialog = "protocol.write"
        tooltip("A TOML file that `metamer review --protocol` puts into its report.")


def _entry(window: Window, one: Rating) -> None:
    score = f", {one.score} of {MOST}" if one.score else ""
    imgui.text_wrapped(f"{one.verdict}{score}: {one.material}")
    quiet(f"{one.light}, {one.observer}{f', {one.reviewer}' if one.reviewer else ''}, {one.at}")
    if one.note:
        imgui.push_text_wrap_pos(0.0)
        imgui.text_unformatted(one.note)
        imgui.pop_text_wrap_pos()
    imgui.same_line()
    if imgui.small_button(f"x##{' '.join(one.key)}"):
        window.desk.do(
            lambda s: replace(s, ratings=tuple(other for other in s.ratings if other.key != one.key)), "Take back"
        )


def write_protocol_file(window: Window, file: Path) -> bool:
    """Write the protocol; whether that was done."""
    ratings = window.desk.session.ratings
    return window.desk.attempt(lambda: write_protocol(file, ratings), "protocol", f"Written: {file}")
