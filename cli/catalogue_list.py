"""`metamer catalogue list`: every material with its model and measured error."""

from __future__ import annotations

import argparse

from .catalogue_words import add_catalogue_argument, opened, print_table, say, terms_words


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `list`."""
    listing = verbs.add_parser("list", help="every material with its model and measured error")
    add_catalogue_argument(listing)
    listing.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """List; 0, or 4 where a file could not be read."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    catalogue, console = opened(args.catalogue), Console()
    table = Table(box=box.SIMPLE)
    for heading in ("material", "model", "kind"):
        table.add_column(heading, no_wrap=True)
    for heading in ("terms", "ΔE94 p99"):
        table.add_column(heading, justify="right", no_wrap=True)
    unusable, measured = [], set()
    for material_id in catalogue.ids():
        try:
            record = catalogue.load(material_id)
        except Exception as reason:
            from ..spectral.errors import InputError

            if not isinstance(reason, InputError):
                raise
            unusable.append(reason)
            continue
        p99 = f"{record.error.p99:.3f}" if record.error else "?"
        if record.error:
            measured.add(f"{record.error.light} and the observer {record.error.observer}")
        table.add_row(material_id, record.model, record.provenance.kind, terms_words(record), p99)
    print_table(table)
    for reason in unusable:
        say(console, str(reason))
    for conditions in sorted(measured):
        say(console, f"ΔE94 p99: factored against original data, on a sphere under {conditions}; show ID says more")
    say(console, f"{catalogue.folder}: {table.row_count} materials")
    return 4 if unusable else 0
