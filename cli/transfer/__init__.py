"""`metamer transfer`: a module per verb; light transport between the parts of a scene."""

from __future__ import annotations

import argparse

from . import build, relight, show


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add `transfer`."""
    command = subparsers.add_parser(
        "transfer",
        help="what the parts of a scene put on each other",
        description="What light does between the parts of a scene.",
    )
    kinds = command.add_subparsers(metavar="{show,build,relight}", required=True)
    show.add_parser(kinds)
    build.add_parser(kinds)
    relight.add_parser(kinds)
