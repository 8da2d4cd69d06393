"""`metamer catalogue show`: one material in words."""

from __future__ import annotations

import argparse

from .catalogue_words import add_catalogue_argument, opened, say


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `show`."""
    show = verbs.add_parser("show", help="one material: provenance, model, packs, measured error")
    show.add_argument("id", metavar="ID", help='such as "colorchecker/red-gloss"')
    add_catalogue_argument(show)
    show.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Show; 0."""
    from rich.console import Console

    console, record = Console(), opened(args.catalogue).load(args.id)
    said = record.provenance
    # What a measured file says of itself is in the source and in the notes.
    told = ("name", "description", "measurement_notes") if record.model == "scattered" else ()
    parameters = ", ".join(_parameter(name, value) for name, value in record.parameters.items() if name not in told)
    lines = [
        ("material", record.id),
        ("model", record.model),
        ("parameters", parameters),
        ("kind", said.kind),
        ("source", said.source),
        ("licence", said.licence),
        ("geometry", said.geometry or "not stated"),
        ("notes", said.notes.replace(" + ", f"\n{'':11}") or "none"),
        ("packs", "; ".join(_pack(pack) for pack in record.packs)),
    ]
    if record.error:
        error = record.error
        figures = f"mean {error.mean:.3f}, p95 {error.p95:.3f}, p99 {error.p99:.3f}, max {error.maximum:.3f}"
        lines += [("ΔE94", f"{figures} ({error.light}, {error.observer})"), ("protocol", error.protocol)]
    for label, text in lines:
        say(console, f"{label:11}{text}")
    return 0


def _pack(pack) -> str:
    grid = " x ".join(f"{axis.name} {axis.size}" for axis in pack.axes)
    return f"{pack.rank} terms in frame {pack.frame} ({grid}; {pack.basis.size} spectral coefficients)"


def _parameter(name: str, value: object) -> str:
    shape = getattr(value, "shape", ())
    return f"{name} {shape}" if shape else f"{name} {value}"
