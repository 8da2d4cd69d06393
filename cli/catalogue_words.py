"""What the verbs of `metamer catalogue` share: the folder to look in, plain text that is never cut, and JSON."""

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


def say(text: str) -> None:
    """One paragraph, as it is but for control characters."""
    print(visible(text, lines=True))


def print_json(document: Any) -> None:
    """Every figure, for a program."""
    import json

    print(json.dumps(document, ensure_ascii=False, indent=1))


def write_text(path: Path, text: str) -> None:
    """A file that is there whole or not at all."""
    from ..spectral.files import written_whole

    with written_whole(path) as beside:
        beside.write_text(text, encoding="utf-8")


def columns(headings: Sequence[str], rows: Sequence[Sequence[str]], left: int = 1, words: bool = False) -> str:
    """A table as text, never cut; the first `left` columns stand to the left, figures to the right.

    words : whether the last column is text, too.
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
