"""Cause of a change: the material, or the approximation by which pictures are made.

Each has words of its own: an approximation has an error within limits or over them, and a material passes or fails.
"""

from __future__ import annotations

from typing import Literal

from .criteria import Tier
from .result import Result, RowResult, State, worst_tier

#: Cause of a row's change; without a reference on one side, the material.
Cause = Literal["material", "approximation"]
#: Words of pages for a verdict, an icon that needs no colour, and its style.
VERDICTS: dict[Cause, dict[Tier, tuple[str, str, str]]] = {
    "material": {
        "pass": ("hardly moved", "i-ok", "pass"),
        "warn": ("slightly moved", "i-near", "near"),
        "fail": ("clearly moved", "i-warn", "over"),
    },
    "approximation": {
        "pass": ("error within limits", "i-ok", "pass"),
        "warn": ("error near limits", "i-near", "near"),
        "fail": ("error over limits", "i-warn", "over"),
    },
}
_STATES: dict[State, str] = {"worse": "error grew", "better": "error shrank", "changed": "error moved"}


def cause_of(row: RowResult) -> Cause:
    """Return the approximation as the cause if the picture changed and the bytes of its reference did not."""
    picture, reference = row.layers.get("picture"), row.layers.get("reference")
    alone = picture is not None and picture.moved and reference is not None and reference.identical
    return "approximation" if alone else "material"


def what_changed(row: RowResult) -> tuple[str, str]:
    """State which part changed, in a sentence, and the evidence, in another; "" without a change."""
    if row.state in ("added", "removed"):
        if row.state == "added":
            return "It is new.", "It was not there before."
        return "It is gone.", "It was there before and is not there now."
    moved = {kind for kind, one in row.layers.items() if one.moved or one.undefined}
    reference = row.layers.get("reference")
    if not moved:
        return "", ""
    if moved == {"reading"}:
        return "The reading changed.", "It was read anew, or its file is another."
    if reference is None:
        return "The picture changed.", "Without a reference it cannot be told whether the material or the renderer did."
    if "picture" not in moved:
        return "The reference changed.", "The picture is the same: only the reference, made from original data, moved."
    if "reference" in moved:
        return (
            "The material changed.",
            "The reference, made from original data, moved too: material, light or scene is another.",
        )
    if reference.identical:
        return (
            "The renderer changed.",
            "The material is the same: the picture alone moved, by its fit, its plan or the renderer.",
        )
    return "The picture changed.", "The reference moved by no more than its noise: material or renderer is another."


def state_words(row: RowResult) -> str:
    """Return the state in the words of pages."""
    return _STATES.get(row.state, row.state) if cause_of(row) == "approximation" else row.state


def told_apart(result: Result) -> bool:
    """Return whether any row has both a picture and its reference."""
    return any({"picture", "reference"} <= row.layers.keys() for row in result.rows)


def verdicts(row: RowResult) -> dict[Cause, Tier]:
    """Judge the change of a row by its cause; and its error, if criteria apply to that."""
    cause = cause_of(row)
    change: list[Tier] = [one.tier for one in row.asked if one.of != "approximation"]
    if not row.layers or any(one.undefined for one in row.layers.values()):
        # Added, removed, or with pixels that hold no number: no criterion's doing.
        change.append(row.tier)
    found: dict[Cause, Tier] = {cause: worst_tier(change)}
    error: list[Tier] = [one.tier for one in row.asked if one.of == "approximation"]
    if error:
        found["approximation"] = worst_tier([*error, found.get("approximation", "pass")])
    return found


def tier_of(result: Result, cause: Cause) -> Tier:
    """Return the worst tier attributed to a cause."""
    of_rows = worst_tier(tier for row in result.rows for whose, tier in verdicts(row).items() if whose == cause)
    pooled: list[Tier] = [
        one.tier for one in result.pooled if (one.of == "approximation") == (cause == "approximation")
    ]
    return worst_tier([of_rows, *pooled])
