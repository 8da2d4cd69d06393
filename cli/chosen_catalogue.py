"""The catalogue that a subcommand uses: the one asked for, or the default one."""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from ..materials.catalogue.shipped import shipped_sources
from .import_progress import import_shown

if TYPE_CHECKING:
    from ..materials.catalogue.catalogue import Catalogue


def add_catalogue_option(command: argparse.ArgumentParser) -> None:
    """`--catalogue`."""
    command.add_argument(
        "--catalogue",
        type=Path,
        metavar="CAT",
        help="default: $METAMER_CATALOGUE, or ./metamer-catalogue, made from the shipped materials where missing",
    )


def catalogue_for(folder: Path | None, jobs: int) -> Catalogue:
    """The catalogue asked for; the default one is first made from the shipped materials where it is missing."""
    from ..materials.catalogue.catalogue import Catalogue, default_catalogue

    if folder is None:
        folder = default_catalogue()
        if not folder.exists():
            from ..materials.intake.importing import import_sources
            from ..runtime.shutdown import saying

            print(f"No catalogue at {folder} yet: importing the shipped materials.", flush=True)
            with ExitStack() as stack:
                stack.enter_context(saying(lambda: "`metamer catalogue import` completes the catalogue."))
                shown = import_shown(stack, [shipped_sources()])
                hooks = {"looked_at": shown.looked_at, "begins": shown.begins, "doing": shown.doing}
                import_sources([shipped_sources()], folder, jobs=jobs, progress=shown.progress, **hooks)
    return Catalogue.open(folder)
