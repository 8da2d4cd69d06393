"""`metamer report`: a module a verb."""

from __future__ import annotations

import argparse
import importlib

# One module `VERB` a verb, each with `add_parser(verbs)` and `run(args) -> int`; in the order of the help.
VERBS = ("compare", "baseline", "run", "accept")


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `report` and what it can do."""
    parser = subparsers.add_parser(
        "report",
        help=f"{', '.join(VERBS)}: did any colour move?",
        description="Compare results of two runs, row by row, in ΔE, against criteria.",
    )
    verbs = parser.add_subparsers(dest="verb", required=True, metavar=f"{{{','.join(VERBS)}}}")
    for verb in VERBS:
        importlib.import_module(f".{verb}", __package__).add_parser(verbs)
