"""`metamer display observer`: what two screens that match look like to other observers."""

from __future__ import annotations

import argparse
from pathlib import Path

from ...calibration.report.text_tables import columns
from ..options import add_json_option, parse_observer
from ..output import write_json


def add_parser(kinds: argparse._SubParsersAction) -> None:
    """Add `display observer`."""
    verb = kinds.add_parser(
        "observer",
        help="what two screens that match look like to other observers",
        description="Set two displays to the same white, D65 for one observer, and say how far apart it is for the "
        "others: what no calibration for one observer removes for another.",
    )
    verb.add_argument("first", type=Path, metavar="A.ccss", help="spectra of a display")
    verb.add_argument("second", type=Path, metavar="B.ccss", help="spectra of another")
    verb.add_argument(
        "--matched-for",
        type=parse_observer,
        default="1931_2",
        metavar="NAME",
        help="whom both are D65 for (default: 1931_2)",
    )
    add_json_option(verb)
    verb.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Compare and print; 0."""
    from ...calibration.display.primaries import apart_for, read_primaries
    from ...spectral.observers import OBSERVERS

    one, other = read_primaries(args.first), read_primaries(args.second)
    found = {name: apart_for(one, other, args.matched_for, name) for name in OBSERVERS}
    print(f"{one.name} beside {other.name}: both D65 for {args.matched_for}; their whites are apart by")
    print(columns(["observer", "ΔE94"], [[name, f"{value:.2f}"] for name, value in found.items()], left=1))
    for note in (*(f"{one.name}: {words}" for words in one.notes), *(f"{other.name}: {w}" for w in other.notes)):
        print(note)
    if args.json is not None:
        figures = {"first": one.name, "second": other.name, "matched_for": args.matched_for, "white_delta_e94": found}
        write_json(args.json, figures)
    return 0
