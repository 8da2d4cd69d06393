"""Match as a notebook shows it: its verdict, ΔE by sample and light, and where samples lie about their standard."""

from __future__ import annotations

import html
from typing import Any

from ...runtime.notebook import html_table, new_axes
from .table import Tabled


def as_html(report: Tabled, summary: str, facts: str) -> str:
    """Write the sentences of the page, and a line a sample with its ΔE under each light."""
    asked = report.asked
    headings = ["sample", "verdict", *(f"ΔE {asked.judging.name}, {where.words}" for where in asked.conditions)]
    lines = [
        [one.sample.name, one.verdict, *(float(found.delta_e[asked.judging.name]) for found in one.differences)]
        for one in report.samples
    ]
    return f"<p><b>{html.escape(summary)}</b><br>{html.escape(facts)}</p>{html_table(headings, lines)}"


def plot(report: Tabled, axes: Any = None) -> Any:
    """Draw samples by Δa* and Δb* from the standard with matplotlib, a kind of mark for each light; returns the axes.

    Raises
    ------
    InputError : matplotlib is not installed.
    """
    axes = new_axes() if axes is None else axes
    axes.axhline(0.0, color="0.7", linewidth=0.8)
    axes.axvline(0.0, color="0.7", linewidth=0.8)
    for at, where in enumerate(report.asked.conditions):
        off = [one.differences[at].off for one in report.samples]
        axes.plot([one.a for one in off], [one.b for one in off], "osD^v<>"[at % 7], label=where.words)
    for one in report.samples:
        first = one.differences[0].off
        axes.annotate(one.sample.name, (first.a, first.b), xytext=(4, 4), textcoords="offset points")
    axes.set_xlabel("Δa*")
    axes.set_ylabel("Δb*")
    axes.legend()
    return axes
