"""What the verbs of `metamer catalogue` share: the folder to look in, and plain text that is never cut."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..materials.catalogue import Catalogue
    from ..materials.material import MaterialRecord

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
    """One paragraph, as it is."""
    console.print(text, markup=False, highlight=False, soft_wrap=True)


def terms_words(record: MaterialRecord) -> str:
    """Terms of each pack and their frame."""
    return " + ".join(f"{pack.rank} {pack.frame}" for pack in record.packs)
