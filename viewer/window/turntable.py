"""Turntable."""

from __future__ import annotations

from dataclasses import replace

from .state import Session
from .viewpoint import orbited

#: Seconds that one step may stand for: after a pause it does not leap.
LONGEST_S = 0.25


def turned_on(session: Session, seconds: float) -> Session:
    """Return the session so much later, as its turntable has it."""
    if not session.turntable_deg_s or session.subject.kind == "image":
        return session
    degrees = session.turntable_deg_s * min(seconds, LONGEST_S)
    return replace(session, view=orbited(session.view, degrees))
