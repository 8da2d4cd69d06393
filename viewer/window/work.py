"""Work needed between one session and the next, limited to the effect of changes."""

from __future__ import annotations

from dataclasses import fields
from enum import IntEnum

from .state import Session


class Work(IntEnum):
    """Kinds of work; each includes those before it.

    SHOW : compare, adapt, encode. FOLD : fold cached terms with other spectra or observers. TERMS : other materials at
    the same samples. VIEW : another camera. GEOMETRY : other meshes or positions of lights.
    """

    NOTHING = 0
    SHOW = 1
    FOLD = 2
    TERMS = 3
    VIEW = 4
    GEOMETRY = 5


# Work needed for a change of each field; positions of lights are compared separately.
WORK_OF: dict[str, Work] = {
    "subject": Work.GEOMETRY,
    "catalogue": Work.TERMS,
    "view": Work.VIEW,
    "turntable_deg_s": Work.NOTHING,
    "samples": Work.VIEW,
    "part": Work.TERMS,
    "worn": Work.TERMS,
    "edits": Work.TERMS,
    "light": Work.FOLD,
    "observer": Work.FOLD,
    "other": Work.TERMS,
    "compare": Work.SHOW,
    "adaptation": Work.SHOW,
    "exposure": Work.SHOW,
    "surround": Work.SHOW,
    "shown": Work.SHOW,
    "bounces": Work.TERMS,
    "influence": Work.TERMS,
    "pins": Work.NOTHING,
    "regions": Work.NOTHING,
    "ratings": Work.NOTHING,
    "interface": Work.NOTHING,
    "cursor": Work.NOTHING,
    "flicked": Work.SHOW,
}


def work(before: Session | None, after: Session) -> Work:
    """Return the largest work needed by any difference; all of it without a previous session."""
    if before is None:
        return Work.GEOMETRY
    changed = [one.name for one in fields(Session) if getattr(before, one.name) != getattr(after, one.name)]
    asked = max((WORK_OF[name] for name in changed), default=Work.NOTHING)
    return Work.GEOMETRY if _places(before) != _places(after) else asked


def _places(session: Session) -> list[tuple]:
    """Return the settings that determine the positions of both sides' lights."""
    lights = session.light, session.other.light or session.light
    return [(one.booth, one.map, one.rotation_deg) for one in lights]
