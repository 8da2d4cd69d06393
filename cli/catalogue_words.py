"""Parts that the verbs of `metamer catalogue` share: the folder to look in, and how things are said and written."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..runtime.errors import visible

if TYPE_CHECKING:
    from ..materials.catalogue.catalogue import Catalogue

CATALOGUE_HELP = "catalogue folder (default: $METAMER_CATALOGUE, or ./metamer-catalogue)"


def add_catalogue_argument(verb: argparse.ArgumentParser) -> None:
    """`[CAT]`, the last argument of every verb that reads."""
    verb.add_argument("catalogue", nargs="?", type=Path, metavar="CAT", help=CATALOGUE_HELP)


def opened(folder: Path | None) -> Catalogue:
    """The catalogue asked for, or the default one."""
    from ..materials.catalogue.catalogue import Catalogue, default_catalogue

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
    from ..runtime.files import written_whole

    with written_whole(path) as beside:
        beside.write_text(text, encoding="utf-8")
