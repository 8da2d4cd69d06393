"""`metamer catalogue`: a module a verb."""

from __future__ import annotations

import argparse
import importlib

# One module `VERB` a verb, each with `add_parser(verbs)` and `run(args) -> int`; in the order of the help.
VERBS = ("import", "list", "show", "like", "preview", "verify", "diff", "export")
# Words that Python keeps for itself.
_MODULES = {"import": "import_"}


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `catalogue` and what it can do."""
    parser = subparsers.add_parser(
        "catalogue",
        help=f"{', '.join(VERBS)}: the materials of a folder",
        description="Fill, search, show, check, compare and export a folder of materials.",
    )
    verbs = parser.add_subparsers(dest="verb", required=True, metavar=f"{{{','.join(VERBS)}}}")
    for verb in VERBS:
        importlib.import_module(f".{_MODULES.get(verb, verb)}", __package__).add_parser(verbs)
