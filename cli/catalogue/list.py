"""`metamer catalogue list`: all or matching materials, with model, colour and measured error."""

from __future__ import annotations

import argparse
import dataclasses
from typing import TYPE_CHECKING

from ...calibration.report.text_tables import columns
from ...materials.records.query import WORDS
from ...materials.records.standing import missed_figures, misses_budget
from ...runtime.wording import counted
from ..options import add_catalogue_argument, add_json_option
from ..output import on_standard_output, write_json
from .query import add_query_options, found_by

if TYPE_CHECKING:
    from ...materials.catalogue.head_index import HeadIndex
    from ...materials.records.query import Heads, Summary

# Maxima above ten budgets that are listed with their places.
_MOST_FAR = 10


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `list`."""
    listing = verbs.add_parser(
        "list",
        help="every material, or those that fit, with model, colour and measured error",
        description="Filters take several words with commas between them, and * and ?.",
    )
    add_catalogue_argument(listing)
    add_query_options(listing)
    add_json_option(listing, "everything that is known of each, for a program")
    listing.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """List; 0, or 4 where a file could not be used."""
    asked = found_by(args)
    folder, everything, found, unusable = asked.catalogue.folder, asked.everything, asked.fitting, asked.unusable
    if args.json is not None:
        materials = [dataclasses.asdict(one) for one in found]
        write_json(
            args.json,
            {"catalogue": str(folder), "materials": materials, "unusable": [str(reason) for reason in unusable]},
        )
    if not on_standard_output(args.json):
        if found:
            _print_table(found, args)
        for reason in unusable:
            print(reason)
        for observer in sorted({one.observer for one in found if one.light and one.observer}):
            said = "on a sphere under the light that shows it most"
            print(f"fit ΔE94 p99: factored against original data, {said}, observer {observer}; show ID says more")
        far = sorted((one for one in found if one.far_off), key=lambda one: -(one.maximum or 0.0))
        for one in far[:_MOST_FAR]:
            print(f"{one.id}: {one.far_off}")
        if len(far) > _MOST_FAR:
            print(
                f"{counted(len(far) - _MOST_FAR, 'material')} more of a maximum above ten budgets; show ID says where"
            )
        if doubtful := sum(one.standing in ("uplifted", "reconstructed") for one in found):
            print(f"{counted(doubtful, 'material')} uplifted or reconstructed: a small fit is no small error of colour")
        if missed := sum(map(misses_budget, found)):
            print(f"{counted(missed, 'fit')} over budget: score > budget, and what one more step of terms came to")
        of = f"{len(found)} of " if len(found) != len(everything) else ""
        print(f"{folder}: {of}{counted(len(everything), 'material')}")
        if everything and not found:
            print(asked.nearest_words or _what_there_is(everything))
    return 4 if unusable else 0


def _print_table(found: tuple[Summary, ...], args: argparse.Namespace) -> None:
    headings = ["material", "model", "kind", "terms", "fit ΔE94 p99", "under", "L*", "a*", "b*"]
    if args.near is not None:
        headings.append(f"ΔE{args.formula}")
    over = any(map(misses_budget, found))
    headings += ["over budget"] if over else []
    rows = []
    for one in found:
        terms = " + ".join(f"{count} {frame}" for count, frame in one.terms)
        row = [one.id, one.model, one.kind, terms or one.quantity]
        row.append("" if not one.terms else "?" if one.p99 is None else f"{one.p99:.3f}")
        row.append(one.light if one.terms and one.light else "")
        row += [f"{value:.1f}" for value in one.lab] if one.lab else ["", "", ""]
        if args.near is not None:
            row.append("" if one.distance is None else f"{one.distance:.2f}")
        rows.append([*row, missed_figures(one)] if over else row)
    print(columns(headings, rows, left=3))


def _what_there_is(everything: Heads | HeadIndex) -> str:
    lines = []
    for name, several in WORDS.items():
        shown = sorted(everything.words(name))
        lines.append(f"{several} here: {', '.join(shown[:12])}{' ...' if len(shown) > 12 else ''}")
    return "\n".join(lines)
