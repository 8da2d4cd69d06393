"""`metamer catalogue verify`: is every file what it was when it was written?"""

from __future__ import annotations

import argparse

from .catalogue_words import add_catalogue_argument, opened, say


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `verify`."""
    verify = verbs.add_parser("verify", help="read every file and compare its checksum")
    add_catalogue_argument(verify)
    verify.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Verify; 0, or 4 where a file is damaged."""
    from rich.console import Console

    console, catalogue = Console(), opened(args.catalogue)
    found = catalogue.verify()
    damaged = [reason for reason in found.values() if reason is not None]
    for reason in damaged:
        say(console, str(reason))
    say(console, f"{catalogue.folder}: {len(found) - len(damaged)} materials intact, {len(damaged)} damaged")
    return 4 if damaged else 0
