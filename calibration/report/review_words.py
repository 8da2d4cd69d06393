"""A review in sentences, for page, print and terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ...runtime.wording import counted
from .review_facts import light_words, within_sentence
from .row import ReviewRow
from .statistics import beside, verdict, verdict_limits
from .text_tables import escaped

#: Share of the surface from which on it is said that a screen cannot show it.
SAID_FROM = 0.01
#: By status of a row: how near its picture is to the reference.
LEVELS = {"pass": "accurate enough", "near": "borderline", "over": "too far off"}
_SIGNS = {"pass": "✅", "near": "⚠️", "over": "❌", "invalid": "❌"}
# Rows of a summary: more are not read in a merge request.
_MOST = 15
_INVALID = "The report's check of itself is missing or failed: do not rely on its figures."


def summary_of(rows: Sequence[ReviewRow], budget: float) -> dict[str, Any]:
    """Count pictures by closeness and by the parts that the screen cannot show, and find the worst one."""
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
        "too_strong": sum(one.too_strong >= SAID_FROM for one in known),
        "below_black": sum(one.below_black >= SAID_FROM for one in known),
        "limits_unknown": len(rows) - len(known),
        "worst": {"material": worst.material, "illuminant": worst.illuminant, "p99": worst.statistics.p99},
    }


def verdict_sentence(summary: dict[str, Any], display: str, valid: bool) -> str:
    """State whether colours can be judged by the pictures of a review.

    display : such as "sRGB - Display". valid : the report's self-check succeeded.
    """
    if not valid:
        return _INVALID
    total, accurate = summary["pictures"], summary["accurate"]
    if accurate == total:
        head = f"{_all(total)} accurate enough to judge colour by"
    else:
        head = f"{accurate} of {counted(total, 'picture')} {_are(accurate)} accurate enough to judge colour by"
        parts = [(summary["borderline"], LEVELS["near"]), (summary["too_far_off"], LEVELS["over"])]
        head += "; " + " and ".join(f"{count} {_are(count)} {words}" for count, words in parts if count)
    limits = []
    if count := summary.get("too_strong", summary["below_gamut"]):
        limits.append(f"{count} {_plural(count, 'holds', 'hold')} colours that {screen_words(display)} cannot show")
    if count := summary["above_white"]:
        limits.append(f"{count} {_plural(count, 'has', 'have')} highlights cut at white")
    if count := summary.get("below_black", 0):
        limits.append(f"{count} {_plural(count, 'has', 'have')} shadows darker than the screen's black")
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


def row_words(document: Mapping[str, Any], result: Mapping[str, Any]) -> str:
    """Name a picture of a review, from the content of `review.json`: "Signal red under tungsten lamp A"."""
    material = next(one["title"] for one in document["materials"] if one["id"] == result["material"])
    light = light_words(result["illuminant"])
    return f"{material} under {within_sentence(light)}"


def as_markdown(document: Mapping[str, Any]) -> str:
    """Format a review for a merge request: its sentences, and the pictures that need attention.

    document : the content of `review.json`.
    """
    lines = [
        "### Can colours be judged by these pictures?",
        "",
        f"{_SIGNS[document['status']]} {document['verdict']}",
        "",
    ]
    lines += [document["facts"], ""]
    limits = verdict_limits(document["budget_delta_e94"])
    doubtful = [one for one in document["results"] if one["status"] != "pass" or _limits_words(one["limits"])]
    doubtful.sort(key=lambda one: (one["undefined_pixels"] > 0, one["delta_e94"]["p99"]), reverse=True)
    if doubtful:
        screen = screen_words(document["display"])
        lines += [f"| needs a look | | on average | 99 % within | at most | {screen} cannot show |"]
        lines += ["|---|---|--:|--:|--:|---|"]
    for one in doubtful[:_MOST]:
        figures = (beside(one["delta_e94"][name], *limits) for name in ("mean", "p99", "max"))
        cells = (escaped(row_words(document, one)), LEVELS[one["status"]], *figures, _limits_words(one["limits"]))
        lines.append(f"| {' | '.join(cells)} |")
    if len(doubtful) > _MOST:
        lines += ["", f"... and {len(doubtful) - _MOST} more."]
    lines += ["", *(f"- {escaped(warning)}" for warning in document["warnings"])]
    return "\n".join(lines).rstrip() + "\n"


def _limits_words(limits: Mapping[str, float] | None) -> str:
    """Describe the parts of the surface that a screen cannot show; "" if they are negligible."""
    if limits is None:
        return ""
    # Files of before this was told apart have none of it.
    black = limits.get("below_black", 0.0)
    told = (
        (limits["below_gamut"] - black, "too strong"),
        (limits["above_white"], "cut at white"),
        (black, "darker than its black"),
    )
    return ", ".join(f"{share:.0%} {words}".replace("%", " %") for share, words in told if share >= SAID_FROM)


def screen_name(display: str) -> str:
    """Return a display's name for text.

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


def _plural(count: int, one: str, several: str) -> str:
    return one if count == 1 else several


def _are(count: int) -> str:
    return _plural(count, "is", "are")
