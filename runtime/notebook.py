"""Axes, data frames and tables for notebooks, from libraries loaded on demand."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from typing import Any

from .distribution import install_hint
from .errors import InputError

#: Lines of a table that a notebook shows.
MOST_LINES = 60


def new_axes() -> Any:
    """Return new axes of matplotlib.

    Raises
    ------
    InputError : it is not installed.
    """
    try:
        from matplotlib import pyplot
    except ImportError as reason:
        raise InputError("matplotlib is not installed, which draws", hint=install_hint("plot")) from reason
    return pyplot.subplots()[1]


def data_frame(headings: Sequence[str], lines: Iterable[Sequence[object]]) -> Any:
    """Make a `pandas.DataFrame` of lines under headings.

    Raises
    ------
    InputError : pandas is not installed.
    """
    try:
        import pandas
    except ImportError as reason:
        raise InputError("pandas is not installed, which makes data frames", hint=install_hint("pandas")) from reason
    return pandas.DataFrame([list(line) for line in lines], columns=list(headings))


def html_table(headings: Sequence[str], lines: Sequence[Sequence[object]], count: int | None = None) -> str:
    """Format lines under headings as HTML, numbers with two decimals; of many lines the first, and a count of others.

    count : of all lines, if only the first were made.
    """
    rows = [f"<tr>{''.join(f'<th>{html.escape(name)}</th>' for name in headings)}</tr>"]
    for line in lines[:MOST_LINES]:
        cells = (f"{cell:.2f}" if isinstance(cell, float) else html.escape(str(cell)) for cell in line)
        rows.append(f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>")
    left = (len(lines) if count is None else count) - MOST_LINES
    more = f"<p>and {left} more</p>" if left > 0 else ""
    return f"<table>{''.join(rows)}</table>{more}"
