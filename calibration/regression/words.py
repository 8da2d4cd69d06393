"""Comparison as a few lines of text: the verdict, the changes, the worst first."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from ...runtime.wording import counted
from ...spectral.sample import distinct_titles, title_from_id
from ..report.review_facts import light_words, within_sentence
from ..report.row_name import short_observer
from ..report.text_tables import columns
from .causes import what_changed
from .criteria import TIERS, Tier
from .result import Result, RowResult
from .row import RowName

# Most rows shown in a terminal, and most notes on each.
MOST_ROWS = 20
# Ids of a catalogue; names of files and of readings are said as they are.
_ID = re.compile(r"[a-z0-9-]+(/[a-z0-9-]+)+")
_STILL = ("identical", "same")
_MOVED: dict[Tier, str] = {"fail": "clearly", "warn": "slightly", "pass": "within the limits"}
_ASKED: dict[Tier, str] = {"fail": "fails", "warn": "is near its limits"}


def verdict_words(result: Result) -> str:
    """State the result in one sentence, for page, print and terminal.

    A difference of zero is described as equal bytes, or as other bytes of equal colour.
    """
    if not result.valid:
        return "Not valid: a known difference that was put in was not found, so that nothing here can be believed"
    rows, total = result.rows, len(result.rows)
    what = things(result)
    asked = "" if result.tier == "pass" else f"; what is asked of them {_ASKED[result.tier]}"
    if result.identical:
        alike = f"the one {what} is" if total == 1 else f"all {total} {what}s are"
        return f"Nothing moved: {alike} the same, byte for byte{asked}"
    moved = [row for row in rows if row.state not in (*_STILL, "added", "removed")]
    parts = []
    if moved:
        counts = [(sum(row.tier == tier for row in moved), words) for tier, words in _MOVED.items()]
        told = ", ".join(f"{count} {words}" for count, words in counts if count)
        parts.append(f"{len(moved)} of {counted(total, what)} moved: {told}")
    for state, words in (("removed", "gone"), ("added", "new")):
        if count := sum(row.state == state for row in rows):
            parts.append(f"{count} {'is' if count == 1 else 'are'} {words}")
    still = total - len(moved) - sum(row.state in ("added", "removed") for row in rows)
    if parts and not moved and still:
        parts.append(f"the other {'one' if still == 1 else still} did not move")
    if not parts:
        return f"Nothing moved beyond rounding and noise: {counted(total, what)}{asked}"
    worst = max(moved, key=lambda row: (TIERS.index(row.tier), row.largest), default=None)
    if worst is not None and total > 1:
        change = what_changed(worst)[0].removesuffix(".")
        where = f", where {change[:1].lower()}{change[1:]}" if change else ""
        parts.append(f"most of all {readable_names(rows)[worst.name]}{where}")
    return "; ".join(parts)


def things(result: Result) -> str:
    """Name what rows are: "picture", or "reading"."""
    return "reading" if all("reading" in row.layers for row in result.rows) else "picture"


def titles_of(rows: Sequence[RowResult]) -> dict[str, str]:
    """Return titles of materials: ids spelt out, except ambiguous ones and names of files."""
    names = [*dict.fromkeys(row.name.material for row in rows)]
    titles = [title_from_id(name) if _ID.fullmatch(name) else name for name in names]
    return dict(zip(names, distinct_titles(titles, names), strict=True))


def readable_names(rows: Sequence[RowResult]) -> dict[RowName, str]:
    """Return readable names of rows, without their common parts: "Cyan gloss under tungsten lamp A"."""
    common, titles = common_parts(rows), titles_of(rows)
    found = {}
    for row in rows:
        own = row.name.without(common)
        material = titles[row.name.material] if own.material or not any(own) else ""
        light = light_words(own.light)
        light = within_sentence(light) if material else light
        under = " under ".join(part for part in (material, light) if part)
        found[row.name] = str(RowName(under, "", short_observer(own.observer), own.scene, own.view))
    return found


def shown_rows(result: Result) -> tuple[RowResult, ...]:
    """Return rows with something to report, the worst first."""
    return tuple(row for row in result.worst_first if row.state not in ("identical", "same") or row.tier != "pass")


def as_text(result: Result) -> str:
    """Return all of it for a terminal; `MOST_ROWS` rows are listed."""
    sides = (("before: ", result.before), ("after:  ", result.after))
    lines = [f"{label}{side.path} ({side.kind})" for label, side in sides]
    shown, said_once = shown_rows(result), common_parts(result.rows)
    if any(said_once):
        lines.append(f"all rows: {said_once._replace(observer=short_observer(said_once.observer))}")
    if shown:
        headings = ("row", "", "", "mean", "p95", "p99", "max", "ΔL*", "Δa*", "Δb*", "of")
        names = readable_names(result.rows)
        cells = [line for row in shown[:MOST_ROWS] for line in _cells(row, names[row.name])]
        lines += ["", columns(headings, cells, left=3, words=True)]
        if len(shown) > MOST_ROWS:
            lines.append(f"... and {len(shown) - MOST_ROWS} more")
        said = Counter(note for row in shown for note in row.notes)
        lines += [f"{note} ({count} rows)" if count > 1 else note for note, count in said.most_common(MOST_ROWS)]
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
    """Return the parts of names common to all rows, "" for the others; none for a single row."""
    parts = zip(*(row.name for row in rows), strict=True) if len(rows) > 1 else [[""]] * len(RowName._fields)
    return RowName(*(found[0] if len(set(found)) == 1 else "" for found in parts))


def _cells(row: RowResult, name: str) -> list[list[str]]:
    """Return a line per changed layer, or one without any."""
    rows = []
    for kind, found in row.layers.items():
        if found.identical and len(row.layers) > 1:
            continue
        statistics = (f"{value:.3f}" for value in (found.mean, found.p95, found.p99, found.max))
        shift = (f"{value:+.3f}" for value in found.shift)
        rows.append([name, row.state, row.tier, *statistics, *shift, kind])
    return rows or [[name, row.state, row.tier, *[""] * 8]]
