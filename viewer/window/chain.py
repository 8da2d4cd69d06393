"""Colour chain from the light to the display, in words and in screenshots."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ...spectral.observers import observer_title
from ..display.png import write_png
from ..display.transform import DisplayTransform
from .canvas_readback import read_codes
from .canvas_renderer import Quality
from .frame import Frame
from .image_frame import ImageFrame
from .state import SESSION_FILE, Session


def chain(session: Session, display: DisplayTransform) -> tuple[str, ...]:
    """Describe light, observer, adaptation, exposure, display and view, each in a few words; also B's own, if any."""
    return tuple(_links(session, display))


def _links(session: Session, display: DisplayTransform) -> Iterator[str]:
    other = session.other
    light, observer = session.light.words, observer_title(session.observer)
    yield light if other.light is None or other.light == session.light else f"{light} (B: {other.light.words})"
    beside = other.observer and other.observer != session.observer
    yield f"{observer} (B: {observer_title(other.observer or '')})" if beside else observer
    yield f"{session.adaptation.words}{' to D65' if session.adaptation.degree else ''}"
    if session.exposure:
        yield f"exposure {session.exposure:+g} EV"
    if session.shown.proof:
        yield f"soft proof of {session.shown.proof}"
    yield f"OCIO {display.name} / {display.view}"
    if session.observer != display.aimed_for:
        yield f"display still aimed for {observer_title(display.aimed_for)}"
    elif beside:
        yield f"display aimed for {observer}"
    yield "colorimetric, no tone mapping" if display.is_colorimetric else "NOT colorimetric: this view changes colours"


def write_screenshot(path: str | Path, frame: Frame | ImageFrame, session: Session) -> Path:
    """Write the image in display codes; its description has the chain, its quality, and the session.

    Raises
    ------
    InputError, NoRoomError : a folder that cannot be written to.
    """
    assert frame.texture is not None
    quality = "as the headless renderer draws it" if frame.quality == Quality.EXACT else "while it was settling"
    words = ("Metamer", *chain(session, frame.display), f"drawn {quality}", "", SESSION_FILE.text(session))
    codes = read_codes(frame.texture)
    write_png(path, codes / 255.0, display=frame.display, words=words)
    return Path(path)
