"""`metamer display`: a module a verb; a display measured, modelled, driven and verified."""

from __future__ import annotations

import argparse
from types import ModuleType

from . import characterise, claim, config, measure, observer, patches, proof, show, verify

# In the order of the way through.
_VERBS = patches, show, measure, claim, characterise, config, verify, proof, observer


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add `display`."""
    command = subparsers.add_parser(
        "display",
        help="what a display really shows: measured, driven through OpenColorIO, verified",
        description="What a display really shows: patches to measure, a model of the readings, a configuration of "
        "OpenColorIO, and a verification that is signed. docs/display.md has the way through.",
    )
    kinds = command.add_subparsers(metavar=f"{{{','.join(map(_name, _VERBS))}}}", required=True)
    for module in _VERBS:
        module.add_parser(kinds)


def _name(module: ModuleType) -> str:
    return module.__name__.rpartition(".")[2]
