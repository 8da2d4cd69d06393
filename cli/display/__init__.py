"""`metamer display`: a module a verb; a display measured, modelled, driven and verified."""

from __future__ import annotations

import argparse

from . import characterise, claim, config, observer, patches, proof, verify


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add `display`."""
    command = subparsers.add_parser(
        "display",
        help="what a display really shows: measured, driven through OpenColorIO, verified",
        description="What a display really shows: patches to measure, a model of the readings, a configuration of "
        "OpenColorIO, and a verification that is signed. docs/display.md has the way through.",
    )
    kinds = command.add_subparsers(metavar="{patches,characterise,claim,config,verify,proof,observer}", required=True)
    for module in (
        patches,
        characterise,
        claim,
        config,
        verify,
        proof,
        observer,
    ):
        module.add_parser(kinds)
