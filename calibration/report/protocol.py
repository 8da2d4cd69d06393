"""A reviewer's protocol: what was said of materials under lights, in a file of its own, and in reports."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ...runtime.errors import InputError
from ...runtime.toml_records import RecordFile
from .rating import Rating


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
