"""Tables of figures as plain text, columns under each other."""

from __future__ import annotations

from collections.abc import Sequence

#: Title, headings, and rows of cells; the first column is text, the others are numbers.
TextTable = tuple[str, list[str], list[list[str]]]


def text_tables(tables: Sequence[TextTable]) -> str:
    """The tables one after another, an empty line between them."""
    lines: list[str] = []
    for title, header, rows in tables:
        widths = [max(map(len, column)) for column in zip(header, *rows, strict=True)]
        lines += [""] * bool(lines) + [title]
        for row in (header, ["-" * width for width in widths], *rows):
            cells = [cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
            lines.append("  ".join([row[0].ljust(widths[0]), *cells]).rstrip())
    return "\n".join(lines)
