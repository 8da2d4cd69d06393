"""Work between one session and the next: no more than what changed can reach."""

from __future__ import annotations

from dataclasses import fields
from enum import IntEnum

from .state import Session


class Work(IntEnum):
    """Each includes those below it.

    SHOW : compare, adapt, encode. FOLD : kept terms with other spectra or observers. TERMS : other materials at the
    same samples. VIEW : another camera. GEOMETRY : other meshes, or lights in other places.
    """

    NOTHING = 0
    SHOW = 1
    FOLD = 2
    TERMS = 3
    VIEW = 4
    GEOMETRY = 5


# Work asked for by a change of each field; whether lights stand elsewhere is asked apart.
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
    """Return the most that any of what differs asks for; all of it where nothing was before."""
    if before is None:
        return Work.GEOMETRY
    changed = [one.name for one in fields(Session) if getattr(before, one.name) != getattr(after, one.name)]
    asked = max((WORK_OF[name] for name in changed), default=Work.NOTHING)
    return Work.GEOMETRY if _places(before) != _places(after) else asked


def _places(session: Session) -> list[tuple]:
    """List the settings by which the lights of both sides stand where they do."""
    lights = session.light, session.other.light or session.light
    return [(one.booth, one.map, one.rotation_deg) for one in lights]
