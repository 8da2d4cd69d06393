"""Matching of the rows of two sides, and detection of incomparable rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ...runtime.errors import ComparisonError, InputError
from .row import ComparedSide, Row, RowName

# Most differences named.
_FEW = 4


@dataclass(frozen=True, eq=False)
class MatchedRows:
    """Rows of both sides in the order of the first; and rows of only one of them."""

    pairs: tuple[tuple[Row, Row], ...]
    removed: tuple[Row, ...]
    added: tuple[Row, ...]
    notes: tuple[str, ...] = ()


def matched(before: ComparedSide, after: ComparedSide) -> MatchedRows:
    """Match rows by material, light, observer, scene and view; two single-picture files match whatever their names.

    Raises
    ------
    ComparisonError : a side and itself, other observers for the same rows, or nothing in common.
    InputError : a side with two rows of one name.
    """
    _not_itself(before, after)
    ours, theirs = _by_name(before), _by_name(after)
    if before.kind == after.kind == "picture" and len(ours) == len(theirs):
        return _two_pictures(before.rows, after.rows)
    pairs = tuple((row, theirs[name]) for name, row in ours.items() if name in theirs)
    removed = tuple(row for name, row in ours.items() if name not in theirs)
    added = tuple(row for name, row in theirs.items() if name not in ours)
    unseen = {row.name._replace(observer=""): row for row in added}
    _same_eyes([(a, b) for a in removed if (b := unseen.get(a.name._replace(observer=""))) is not None])
    if not pairs:
        raise ComparisonError(
            f"{before.path} and {after.path} have no row in common\n"
            f"  found: {_few(before)}; and {_few(after)}\n"
            "  expected: rows of the same material, light, observer, scene and view\n"
            "  try: name things alike on both sides; `metamer match` holds samples of other names beside a standard"
        )
    return MatchedRows(pairs, removed, added)


def _two_pictures(ours: Sequence[Row], theirs: Sequence[Row]) -> MatchedRows:
    """Pair the lights of two single-picture files in their order."""
    pairs = tuple(zip(ours, theirs, strict=True))
    _same_eyes(pairs)
    notes = []
    for a, b in pairs:
        for part, one, other in zip(RowName._fields, a.name, b.name, strict=True):
            if one != other:
                notes.append(f"The two pictures say another {part}: {one or 'nothing'} and {other or 'nothing'}.")
    return MatchedRows(pairs, (), (), tuple(dict.fromkeys(notes)))


def _by_name(side: ComparedSide) -> dict[RowName, Row]:
    twice = [str(name) for name, count in Counter(row.name for row in side.rows).items() if count > 1]
    if twice:
        raise InputError(
            "two rows of one name", file=side.path, found="; ".join(twice[:_FEW]), expected="each row once"
        )
    return {row.name: row for row in side.rows}


def _few(side: ComparedSide) -> str:
    names = "; ".join(str(row.name) for row in side.rows[:_FEW])
    return f"{names}, ..." if len(side.rows) > _FEW else names


def _not_itself(before: ComparedSide, after: ComparedSide) -> None:
    if before.path.exists() and after.path.exists() and before.path.samefile(after.path):
        raise ComparisonError(f"{before.path} and {after.path} are the same: a comparison with itself says nothing")


def _same_eyes(pairs: Iterable[tuple[Row, Row]]) -> None:
    for a, b in pairs:
        if a.name.observer != b.name.observer and a.name.observer and b.name.observer:
            raise ComparisonError(
                f"{a.name._replace(observer='')}: other observers cannot be compared\n"
                f"  found: {a.name.observer}; and {b.name.observer}\n"
                "  expected: one observer for both sides"
            )
