"""A comparison as a few lines of text: the verdict, what moved, the worst first."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from ..report.text_tables import columns
from .result import STATES, Result, RowResult
from .row import RowName

# So many rows, and of each row so many notes, are worth a terminal.
MOST_ROWS = 20


def verdict_words(result: Result) -> str:
    """The result in one sentence.

    A difference of zero is said to be one of equal bytes, or of other bytes that are equal in colour.
    """
    if not result.valid:
        return "invalid: a known difference that was put in was not found, so that nothing here can be believed"
    total = f"{len(result.rows)} row{'' if len(result.rows) == 1 else 's'}"
    if result.identical:
        worse = "" if result.tier == "pass" else f"{result.tier}, by what is asked of them: "
        return f"{worse}identical: {total}, byte for byte"
    states = ", ".join(f"{result.count(state)} {state}" for state in STATES if result.count(state))
    return f"{result.tier}: {total}: {states}"


def shown_rows(result: Result) -> tuple[RowResult, ...]:
    """Rows that something is to be said of, the worst first."""
    return tuple(row for row in result.worst_first if row.state not in ("identical", "same") or row.tier != "pass")


def as_text(result: Result, most: int = MOST_ROWS) -> str:
    """All of it for a terminal; `most` rows are listed."""
    sides = (("before: ", result.before), ("after:  ", result.after))
    lines = [f"{label}{side.path} ({side.kind})" for label, side in sides]
    shown, said_once = shown_rows(result), common_parts(result.rows)
    if any(said_once):
        lines.append(f"all rows: {said_once}")
    if shown:
        headings = ("row", "", "", "mean", "p95", "p99", "max", "ΔL*", "Δa*", "Δb*", "of")
        cells = [line for row in shown[:most] for line in _cells(row, said_once)]
        lines += ["", columns(headings, cells, left=3, words=True)]
        if len(shown) > most:
            lines.append(f"... and {len(shown) - most} more")
        said = Counter(note for row in shown for note in row.notes)
        lines += [f"{note} ({count} rows)" if count > 1 else note for note, count in said.most_common(most)]
    lines += ["", *result.notes]
    for one in result.pooled:
        lines.append(f"{one.criterion.label} ({one.of}): {one.value:.3f}: {one.tier}; {one.criterion.words}")
    lines += [
        f"self-check: {one.label}: expected {one.expected:.4f}, found {one.found:.4f}{'' if one.passed else ': FAILED'}"
        for one in result.checks
    ]
    lines += [*dict.fromkeys((*result.before.chain, *result.after.chain)), verdict_words(result)]
    return "\n".join(lines)


def common_parts(rows: Sequence[RowResult]) -> RowName:
    """The parts of names that all of several rows have in common, "" for the others; of one row, none."""
    parts = zip(*(row.name for row in rows), strict=True) if len(rows) > 1 else [[""]] * len(RowName._fields)
    return RowName(*(found[0] if len(set(found)) == 1 else "" for found in parts))


def short_name(row: RowResult, common: RowName) -> str:
    """The parts of a name that are not common."""
    return str(RowName(*("" if own == all_have else own for own, all_have in zip(row.name, common, strict=True))))


def _cells(row: RowResult, common: RowName) -> list[list[str]]:
    """A line a layer that moved, or one where none is there."""
    name = short_name(row, common)
    rows = []
    for kind, found in row.layers.items():
        if found.identical and len(row.layers) > 1:
            continue
        statistics = (f"{value:.3f}" for value in (found.mean, found.p95, found.p99, found.max))
        shift = (f"{value:+.3f}" for value in found.shift)
        rows.append([name, row.state, row.tier, *statistics, *shift, kind])
    return rows or [[name, row.state, row.tier, *[""] * 8]]
