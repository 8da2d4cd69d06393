"""Ratings of materials by reviewers under lights, and the reviewer's protocol, the file of all of them.

A rating has a verdict, a score, a note, and the probe's values.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from ...runtime.errors import InputError, UnknownNameError
from ...runtime.toml_records import RecordFile

Verdict = Literal["approved", "rejected", "open"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
#: Scores go from 1, bad, to 5, good; 0 is none.
MOST = 5


@dataclass(frozen=True)
class Probed:
    """Reading of a probe at the time of a rating, a number by its name ("L*", "ΔE94"), which states its subject."""

    name: str
    value: float

    def __post_init__(self) -> None:
        if not self.name.strip():
            raise InputError("a value without a name", field="name", expected="some letters")
        if not math.isfinite(self.value):
            raise InputError("not a number", field=self.name, found=self.value, expected="a finite number")


@dataclass(frozen=True)
class Rating:
    """One material under one light, as judged by a reviewer.

    Parameters
    ----------
    material, light, observer : in the notation of reports.
    verdict : "approved", "rejected", or "open" for a score or a note alone.
    score : 1 (bad) to 5 (good); 0 is none.
    note : in the reviewer's words.
    reviewer : name. at : time, ISO 8601.
    probed : readings of the probe.

    Raises
    ------
    InputError, UnknownNameError : no material or light, another verdict, a score out of range.
    """

    material: str
    light: str
    observer: str
    verdict: Verdict = "open"
    score: int = 0
    note: str = ""
    reviewer: str = ""
    at: str = ""
    probed: tuple[Probed, ...] = ()

    def __post_init__(self) -> None:
        for field in ("material", "light", "observer"):
            if not getattr(self, field).strip():
                raise InputError("a rating of nothing", field=field, expected="what was seen")
        if self.verdict not in VERDICTS:
            raise UnknownNameError("verdict", self.verdict, VERDICTS, field="verdict")
        if not (type(self.score) is int and 0 <= self.score <= MOST):
            expected = f"1 to {MOST}, or 0 for none"
            raise InputError("not a score", field="score", found=self.score, expected=expected)

    @property
    def key(self) -> tuple[str, str, str]:
        """Key of the rating: a later one of the same key replaces it."""
        return self.material, self.light, self.observer


@dataclass(frozen=True)
class _Protocol:
    """Content of the file."""

    ratings: tuple[Rating, ...] = ()

    def __post_init__(self) -> None:
        keys = [one.key for one in self.ratings]
        if twice := [key for key in keys if keys.count(key) > 1]:
            raise InputError("rated twice", field="ratings", found=" under ".join(twice[0][:2]), expected="once")


_FILE = RecordFile(_Protocol, "metamer_protocol", 1, "reviewer's protocol", "the review window")


def write_protocol(path: str | Path, ratings: Iterable[Rating]) -> None:
    """Write ratings as TOML. The last of several for the same material, light and observer is kept.

    Raises
    ------
    InputError, NoRoomError : as of `RecordFile.write`.
    """
    latest = {one.key: one for one in ratings}
    _FILE.write(path, _Protocol(tuple(latest.values())))


def read_protocol(path: str | Path) -> tuple[Rating, ...]:
    """Read the file of `write_protocol`; errors as of `RecordFile.read`, and duplicate ratings."""
    return _FILE.read(path).ratings


def as_json(ratings: Sequence[Rating]) -> list[dict[str, Any]]:
    """Encode ratings for `review.json`; a score of 0 and missing values are null."""
    listed = []
    for one in ratings:
        fields = asdict(one) | {"score": one.score or None}
        fields["probed"] = {probed.name: probed.value for probed in one.probed}
        listed.append({key: None if value == "" else value for key, value in fields.items()})
    return listed
