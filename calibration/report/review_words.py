"""A review in sentences: the same on the page, on paper and in the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .row import ReviewRow
from .statistics import beside, verdict, verdict_limits

#: Share of the surface from which on it is said that a screen cannot show it.
SAID_FROM = 0.01
#: By status of a row: how near its picture is to the reference.
LEVELS = {"pass": "accurate enough", "near": "borderline", "over": "too far off"}
_INVALID = "The report's check of itself is missing or failed: do not rely on its figures."


def summary_of(rows: Sequence[ReviewRow], budget: float) -> dict[str, Any]:
    """Pictures by how near they are, by what the screen cannot show of them, and the one that is farthest off."""
    found = [verdict(row.statistics, budget) for row in rows]
    known = [row.limits for row in rows if row.limits is not None]
    worst = max(rows, key=lambda row: (row.statistics.undefined > 0, row.statistics.p99))
    return {
        "pictures": len(rows),
        "accurate": found.count("pass"),
        "borderline": found.count("near"),
        "too_far_off": found.count("over"),
        "below_gamut": sum(one.below_gamut >= SAID_FROM for one in known),
        "above_white": sum(one.above_white >= SAID_FROM for one in known),
        "limits_unknown": len(rows) - len(known),
        "worst": {"material": worst.material, "illuminant": worst.illuminant, "p99": worst.statistics.p99},
    }


def verdict_sentence(summary: dict[str, Any], display: str, valid: bool) -> str:
    """The one sentence of a review: can colours be judged by its pictures?

    display : such as "sRGB - Display". valid : the report's check of itself succeeded.
    """
    if not valid:
        return _INVALID
    total, accurate = summary["pictures"], summary["accurate"]
    if accurate == total:
        head = f"{_all(total)} accurate enough to judge colour by"
    else:
        head = f"{accurate} of {_counted(total, 'picture')} {_are(accurate)} accurate enough to judge colour by"
        parts = [(summary["borderline"], LEVELS["near"]), (summary["too_far_off"], LEVELS["over"])]
        head += "; " + " and ".join(f"{count} {_are(count)} {words}" for count, words in parts if count)
    limits = []
    if count := summary["below_gamut"]:
        limits.append(f"{count} {_plural(count, 'holds', 'hold')} colours that {screen_words(display)} cannot show")
    if count := summary["above_white"]:
        limits.append(f"{count} {_plural(count, 'has', 'have')} highlights cut at white")
    if summary["limits_unknown"]:
        count = summary["limits_unknown"]
        limits.append(f"of {count} it is not known what the screen cannot show")
    return f"{head}{'; ' if limits else ''}{', and '.join(limits)}."


def facts_sentence(summary: dict[str, Any], budget: float, undefined: int = 0) -> str:
    """State the error of the worst picture, and its limits.

    undefined : pixels of all pictures that hold no number.
    """
    p99 = beside(summary["worst"]["p99"], *verdict_limits(budget))
    missing = f" {undefined} pixels hold no number." if undefined else ""
    return (
        f"Rendering error: 99 % of every surface is within ΔE94 {p99} of the reference (limit {budget:g}).{missing} "
        "This says how far to trust the pictures; it approves no colour."
    )


def screen_name(display: str) -> str:
    """A display's name for people.

    >>> screen_name("sRGB - Display"), screen_name("My wall")
    ('sRGB', 'My wall')
    """
    return display.removesuffix(" - Display")


def screen_words(display: str) -> str:
    """`an sRGB screen`, by the name of the display.

    >>> screen_words("sRGB - Display"), screen_words("Display P3 - Display")
    ('an sRGB screen', 'a Display P3 screen')
    """
    name = screen_name(display)
    vowel = name[:1].lower() in "aeiou" or name[:4] == "sRGB"
    return f"{'an' if vowel else 'a'} {name} screen"


def _all(total: int) -> str:
    return "The one picture is" if total == 1 else f"All {total} pictures are"


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def _plural(count: int, one: str, several: str) -> str:
    return one if count == 1 else several


def _are(count: int) -> str:
    return _plural(count, "is", "are")
