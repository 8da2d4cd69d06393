"""Tables of figures as aligned plain text; and words escaped for Markdown."""

from __future__ import annotations

import re
from collections.abc import Sequence

#: Title, headings, and rows of cells; the first column is text, the others are numbers.
TextTable = tuple[str, list[str], list[list[str]]]
_MARKED = re.compile(r"([\\`*_{}\[\]<>|#])")


def text_tables(tables: Sequence[TextTable]) -> str:
    """Return the tables one after another, an empty line between them."""
    return "\n\n".join(f"{title}\n{columns(header, rows)}" for title, header, rows in tables)


def columns(headings: Sequence[str], rows: Sequence[Sequence[str]], left: int = 1, words: bool = False) -> str:
    """Format a table as text, never cut; the first `left` columns are left-aligned, figures right-aligned.

    words : True if the last column is text, too.
    """
    widths = [max(map(len, column)) for column in zip(headings, *rows, strict=True)]
    rule = ["─" * width for width in widths]
    lines = []
    for cells in (headings, rule, *rows):
        aligned = [
            cell.ljust(width) if index < left or (words and index == len(widths) - 1) else cell.rjust(width)
            for index, (cell, width) in enumerate(zip(cells, widths, strict=True))
        ]
        lines.append("  ".join(aligned).rstrip())
    return "\n".join(lines)


def escaped(text: str) -> str:
    """Escape words for Markdown, on one line."""
    return _MARKED.sub(r"\\\1", text).replace("\n", " ")
