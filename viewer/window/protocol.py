"""Ratings in the window: reviewer, material, light, and probe readings."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime

from ...calibration.report.rating import Probed, Rating, Verdict
from ...spectral.formula import formula
from .choices import Choices
from .displayed_value import Displayed
from .probe import ProbeReading
from .probe_text import colours
from .state import Session


def rating_of(
    session: Session,
    choices: Choices,
    verdict: Verdict,
    *,
    score: int = 0,
    note: str = "",
    reviewer: str = "",
    at: datetime | None = None,
    reading: ProbeReading | None = None,
    other: ProbeReading | None = None,
    shown: Displayed | None = None,
) -> Rating:
    """Return a rating of the shown part's material, on the shown side.

    Parameters
    ----------
    at : now by default. reading : of the probe on side A, or on the only shown side. other : the same pixel of side B
        if both are compared, for ΔE by the session's formula. shown : display value of `reading`.
    """
    alone = session.compare.mode == "B"
    light = (session.other.light or session.light) if alone else session.light
    material = (session.other.material if alone else None) or choices.material(session)
    observer = (session.other.observer if alone else None) or session.observer
    when = (at or datetime.now(UTC)).isoformat(timespec="seconds")
    probed = tuple(_probed(session, reading, other, shown)) if reading is not None else ()
    return Rating(material, light.words, observer, verdict, score, note, reviewer, when, probed)


def _probed(
    session: Session, reading: ProbeReading, other: ProbeReading | None, shown: Displayed | None
) -> Iterator[Probed]:
    for name, value in colours(reading).items():
        if value is not None:
            yield Probed(name, value)
    if shown is not None:
        yield from (
            Probed(f"{channel} displayed", float(code)) for channel, code in zip("RGB", shown.codes, strict=True)
        )
    if other is not None:
        yield from (Probed(f"{name} of B", value) for name, value in colours(other).items() if value is not None)
        off = float(formula(session.compare.formula)(reading.xyz, other.xyz, reading.white))
        yield Probed(f"ΔE {session.compare.formula}, B from A", off)
