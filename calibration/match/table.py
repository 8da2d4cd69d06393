"""Match as one flat table, a line per sample and condition, under `headings`; and its display in a notebook."""

from __future__ import annotations

import html
from collections.abc import Iterator, Sequence
from dataclasses import astuple
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from ...runtime.notebook import html_table, new_axes
from ...runtime.sheets import Cell, csv_text, write_workbook
from ...spectral.sample import Sample
from .pairs import MatchedPairs, MatchOptions, PairDifference

_AXES = ("ΔL*", "Δa*", "Δb*", "ΔC*", "ΔH*")
_FIRST = ("standard", "sample", "source", "readings", "verdict of sample", "angle", "illuminant", "observer", "verdict")


class Tabled(Protocol):
    """Match that a table can be made of."""

    @property
    def standard(self) -> Sample:
        """Standard of the match."""
        ...

    @property
    def samples(self) -> Sequence[MatchedPairs]:
        """Samples of the match."""
        ...

    @property
    def asked(self) -> MatchOptions:
        """Options of the match."""
        ...


def headings(report: Tabled) -> list[str]:
    """Return the headings of the columns: indices and whiteness if any, ± if known."""
    labs = [f"{axis} of {side}" for side in ("standard", "sample") for axis in ("L*", "a*", "b*")]
    figures = [*_AXES, *(f"ΔE {one.name}" for one in report.asked.formulas)]
    known = report.asked.repeatability is not None
    whites = []
    for name in _whites(report):
        whites += [f"{name}, {side}" for side in ("standard", "sample", "tint of standard", "tint of sample")]
        whites += [f"{name} ±"] if known else []
    spreads = [f"{one} ±" for one in figures] if known else []
    return [*_FIRST, *labs, *figures, *spreads, "direction", *_indices(report), *whites, "notes"]


def lines(report: Tabled) -> Iterator[list[Cell]]:
    """Yield the lines, samples in the order given."""
    for one in report.samples:
        for found in one.differences:
            yield _line(report, one, found)


def as_csv(report: Tabled) -> str:
    """Format the table by RFC 4180."""
    return csv_text(headings(report), lines(report))


def write_xlsx(report: Tabled, path: Path) -> None:
    """Write the table as a workbook; raises as `write_workbook` does."""
    write_workbook(path, "match", headings(report), lines(report))


def _indices(report: Tabled) -> list[str]:
    """Return names of indices without those of observers and illuminants, which are in the line."""
    return list(dict.fromkeys(index.name for one in report.samples for index in one.indices))


def _whites(report: Tabled) -> list[str]:
    return list(dict.fromkeys(white.name for one in report.samples for white in one.whites))


def _line(report: Tabled, one: MatchedPairs, found: PairDifference) -> list[Cell]:
    where, sample = found.conditions, one.sample
    names = [formula.name for formula in report.asked.formulas]
    cells: list[Cell] = [report.standard.name, sample.name, sample.source, sample.count, one.verdict]
    cells += [where.geometry or None, where.illuminant, where.observer, found.verdict]
    cells += np.concatenate([found.standard_lab, found.sample_lab]).tolist()
    off = found.off
    cells += [float(value) for value in (off.lightness, off.a, off.b, off.chroma, off.hue)]
    cells += [found.delta_e[name] for name in names]
    known = report.asked.repeatability is not None
    if known:
        spread = found.spread
        cells += [None] * (len(_AXES) + len(names)) if spread is None else [*astuple(spread)[: len(_AXES)]]
        cells += [] if spread is None else [spread.delta_e[name] for name in names]
    cells.append(found.words)
    told = {index.name: index for index in one.indices if index.changed == where.words}
    whites = {white.name: white for white in one.whites if white.conditions == where.words}
    cells += [told[name].value if name in told else None for name in _indices(report)]
    for name in _whites(report):
        white = whites.get(name)
        cells += [None] * 4 if white is None else [white.standard, white.sample, white.standard_tint, white.sample_tint]
        cells += [None if white is None else white.uncertainty] if known else []
    # Why a number is missing, each reason once.
    notes = dict.fromkeys(each.words for each in (*told.values(), *whites.values()) if each.words)
    return [*cells, "; ".join(notes) or None]


def as_html(report: Tabled, summary: str, facts: str) -> str:
    """Write the sentences of the page, and a line per sample with its ΔE under each light."""
    asked = report.asked
    head = ["sample", "verdict", *(f"ΔE {asked.judging.name}, {where.words}" for where in asked.conditions)]
    rows = [
        [one.sample.name, one.verdict, *(float(found.delta_e[asked.judging.name]) for found in one.differences)]
        for one in report.samples
    ]
    return f"<p><b>{html.escape(summary)}</b><br>{html.escape(facts)}</p>{html_table(head, rows)}"


def plot(report: Tabled, axes: Any = None) -> Any:
    """Draw samples by Δa* and Δb* from the standard with matplotlib, one marker per light; returns the axes.

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
