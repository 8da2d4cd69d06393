"""`metamer transfer`: what light does between the parts of a scene."""

from __future__ import annotations

import argparse

from . import transfer_build, transfer_relight, transfer_show


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add `transfer`."""
    command = subparsers.add_parser(
        "transfer",
        help="what the parts of a scene put on each other",
        description="What light does between the parts of a scene.",
    )
    kinds = command.add_subparsers(metavar="{show,build,relight}", required=True)
    transfer_show.add_parser(kinds)
    transfer_build.add_parser(kinds)
    transfer_relight.add_parser(kinds)
