"""An image: what its file says, what it leaves open, and the image on B."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from imgui_bundle import imgui

from ...spectral_image import XyzPicture
from ..widgets import facts, heading, quiet, section, tooltip
from ..window import Window


def draw(window: Window) -> None:
    """Facts, and questions that only a person can answer."""
    if not section("Image"):
        return
    desk, session = window.desk, window.desk.session
    image = desk.loaded.image
    subject = session.subject
    quiet(Path(subject.path or "").name)
    if image is None:
        quiet("being read")
        return
    if isinstance(image, XyzPicture):
        facts("image", [("kind", image.kind), ("light", image.light or "not said"),
                        ("observer", image.observer or "not said")])  # fmt: skip
        for note in image.notes:
            quiet(note)
        return
    nm = image.wavelengths_nm
    rows = [("kind", image.kind), ("wavelengths", f"{len(nm)}, {nm[0]:g} to {nm[-1]:g} nm"),
            ("light of its own", image.light or "not said")]  # fmt: skip
    if len(image.into) > len(nm):
        rows.append(("fluoresces", f"{len(image.into) - len(nm)} pairs"))
    facts("image", rows)
    units = (f"units: {image.units or 'not said'}",) if image.kind == "emission" else ()
    for words in (*units, *image.notes):
        quiet(words)
    if image.kind == "emission":
        heading("WHAT THE FILE DOES NOT SAY", window.style)
        _ask(window, "own light", "lamp that it was made in", subject.own_light)
        if not image.relative:
            _ask(
                window,
                "luminance",
                "luminance of white, cd/m²",
                f"{subject.luminance:g}" if subject.luminance else None,
            )


def _ask(window: Window, key: str, hint: str, now: str | None) -> None:
    desk = window.desk
    if now:
        quiet(f"{hint}: {now}")
    imgui.set_next_item_width(-1.0)
    entered, window.kept.typed[key] = imgui.input_text_with_hint(
        f"##{key}", hint, window.kept.typed.get(key, ""), imgui.InputTextFlags_.enter_returns_true
    )
    tooltip("Enter takes it.")
    text = window.kept.typed[key].strip()
    if not (entered and text):
        return
    if key == "own light":
        desk.do(lambda s: replace(s, subject=replace(s.subject, own_light=text)), f"Made in {text}")
    else:
        try:
            value = float(text)
        except ValueError:
            desk.tell(f"{text}: not a number of cd/m²", problem=True, about="luminance")
            return
        desk.do(lambda s: replace(s, subject=replace(s.subject, luminance=value)), f"White of {value:g} cd/m²")
        desk.forget("luminance")
    window.kept.typed[key] = ""
