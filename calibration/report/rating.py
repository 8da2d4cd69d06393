"""Rating of a material by a reviewer under a light: a verdict, a score, a note, and the probe's
values; and the reviewer's protocol, the file of all of them."""

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
    """Reading of a probe at the time of a rating, a number by its name ("L*", "ΔE94"); what it was read of is in the
    name.
    """

    name: str
    value: float

    def __post_init__(self) -> None:
        if not self.name.strip():
            raise InputError("a value without a name", field="name", expected="some letters")
        if not math.isfinite(self.value):
            raise InputError("not a number", field=self.name, found=self.value, expected="a finite number")


@dataclass(frozen=True)
class Rating:
    """One material under one light, as somebody saw it.

    Parameters
    ----------
    material, light, observer : what was seen, as reports call it.
    verdict : "approved", "rejected", or "open" where only a score or a note is given.
    score : 1 (bad) to 5 (good); 0 is none.
    note : in the reviewer's words.
    reviewer : who. at : when, ISO 8601.
    probed : what the probe read.

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
        """Key of the rating: a later one of the same key takes its place."""
        return self.material, self.light, self.observer


@dataclass(frozen=True)
class _Protocol:
    """All that is in the file."""

    ratings: tuple[Rating, ...] = ()

    def __post_init__(self) -> None:
        keys = [one.key for one in self.ratings]
        if twice := [key for key in keys if keys.count(key) > 1]:
            raise InputError("rated twice", field="ratings", found=" under ".join(twice[0][:2]), expected="once")


_FILE = RecordFile(_Protocol, "metamer_protocol", 1, "reviewer's protocol", "the review window")


def write_protocol(path: str | Path, ratings: Iterable[Rating]) -> None:
    """Write ratings as TOML. Of two of the same material, light and observer the later one stays.

    Raises
    ------
    InputError, NoRoomError : as of `RecordFile.write`.
    """
    latest = {one.key: one for one in ratings}
    _FILE.write(path, _Protocol(tuple(latest.values())))


def read_protocol(path: str | Path) -> tuple[Rating, ...]:
    """Read what `write_protocol` wrote; errors as of `RecordFile.read`, and something that is rated twice."""
    return _FILE.read(path).ratings


def as_json(ratings: Sequence[Rating]) -> list[dict[str, Any]]:
    """Ratings for `review.json`; a score of 0 is null, and so is what was not said."""
    listed = []
    for one in ratings:
        fields = asdict(one) | {"score": one.score or None}
        fields["probed"] = {probed.name: probed.value for probed in one.probed}
        listed.append({key: None if value == "" else value for key, value in fields.items()})
    return listed
