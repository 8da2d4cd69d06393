"""Screenshots: PNG files that say how they were made."""

from __future__ import annotations

from pathlib import Path

from ..display.png import write_png
from .canvas_readback import read_codes
from .canvas_renderer import Quality
from .chain import chain
from .frame import Frame
from .image_frame import ImageFrame
from .session import session_text
from .state import Session


def write_screenshot(path: str | Path, frame: Frame | ImageFrame, session: Session) -> Path:
    """Write the picture as the display is sent it; its description has the chain, how exact it is, and the session.

    Raises
    ------
    InputError, NoRoomError : a folder that cannot be written to.
    """
    assert frame.texture is not None
    quality = "as the headless renderer draws it" if frame.quality == Quality.EXACT else "while it was settling"
    words = ("Metamer", *chain(session, frame.display), f"drawn {quality}", "", session_text(session))
    codes = read_codes(frame.texture)
    write_png(path, codes / 255.0, display=frame.display, words=words)
    return Path(path)
