"""What the verbs of `metamer catalogue` share: the folder to look in, and plain text that is never cut."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..spectral.errors import visible

if TYPE_CHECKING:
    from ..materials.catalogue import Catalogue

CATALOGUE_HELP = "catalogue folder (default: $METAMER_CATALOGUE, or ./metamer-catalogue)"


def add_catalogue_argument(verb: argparse.ArgumentParser) -> None:
    """`[CAT]`, the last argument of every verb that reads."""
    verb.add_argument("catalogue", nargs="?", type=Path, metavar="CAT", help=CATALOGUE_HELP)


def opened(folder: Path | None) -> Catalogue:
    """The catalogue asked for, or the default one."""
    from ..materials.catalogue import Catalogue, default_catalogue

    return Catalogue.open(folder or default_catalogue())


def print_table(table: Any) -> None:
    """Whole, on a terminal or through a pipe that is narrower too: a figure cut short is none."""
    from rich.console import Console

    Console(width=max(Console().width, 200)).print(table)


def say(console: Any, text: str) -> None:
    """One paragraph, as it is but for control characters."""
    console.print(visible(text, lines=True), markup=False, highlight=False, soft_wrap=True)


def columns(headings: Sequence[str], rows: Sequence[Sequence[str]], left: int = 1) -> str:
    """A table as text, never cut; the first `left` columns stand to the left, figures to the right."""
    widths = [max(map(len, column)) for column in zip(headings, *rows, strict=True)]
    rule = ["─" * width for width in widths]
    lines = []
    for cells in (headings, rule, *rows):
        aligned = [
            cell.ljust(width) if index < left else cell.rjust(width)
            for index, (cell, width) in enumerate(zip(cells, widths, strict=True))
        ]
        lines.append("  ".join(aligned).rstrip())
    return "\n".join(lines)
