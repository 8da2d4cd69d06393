"""`metamer display verify`: a display measured again, and the page that is signed."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from ...calibration.report.text_tables import columns
from ..options import add_json_option
from ..output import on_standard_output, write_json, write_text
from .common import add_readings_argument, readings_of

_CODES = {"recommended": 0, "pass": 0, "not measured": 0, "not resolved": 1, "fail": 2}


def add_parser(kinds: argparse._SubParsersAction) -> None:
    """Add `display verify`."""
    verb = kinds.add_parser(
        "verify",
        help="whether a display still shows what it did",
        description="Judge new readings by what the model says of their codes, and keep the figures in the file of the "
        "display, for the trend. Exit code 1 where a verdict is not resolved, 2 where one fails, 3 where the readings "
        "are not to be compared: of another display or observer, or of another state of it.",
    )
    verb.add_argument("display", type=Path, metavar="DISPLAY.json", help="what `display characterise` wrote")
    add_readings_argument(verb)
    verb.add_argument(
        "--criteria", metavar="WORDS", help="metamer, iso-14861, iso-12647-7, or a TOML file (default: metamer)"
    )
    verb.add_argument("--any-state", action="store_true", help="judge it even where its white is another one")
    verb.add_argument("--not-kept", action="store_true", help="do not keep the figures in DISPLAY.json")
    verb.add_argument("--html", type=Path, metavar="FILE", help="a page to print and sign")
    add_json_option(verb)
    verb.add_argument("--junit", type=Path, metavar="FILE", help="for a build server")
    verb.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Judge, write and print; the exit code is in the command's description."""
    from datetime import UTC, datetime

    from ...calibration.display.criteria import criteria_named
    from ...calibration.display.record import read_record
    from ...calibration.display.verification import verify
    from ...runtime.files import check_outputs

    outputs = [path for path in (args.html, args.json, args.junit) if path is not None and not on_standard_output(path)]
    check_outputs(outputs, [args.display, args.readings])
    record, criteria = read_record(args.display), criteria_named(args.criteria)
    when = datetime.now(UTC).isoformat(timespec="seconds")
    found = verify(record, readings_of(args), criteria, when, any_state=args.any_state)
    write_json(args.json, found.document)
    if not on_standard_output(args.json):
        print(f"{record.name}, {len(found.readings)} patches by {criteria.name}: {found.verdict}")
        rows = [
            [row.words, "-" if row.value is None else f"{row.value:.2f}", row.unit, f"{row.criterion.nominal:g}",
             f"{row.criterion.recommended:g}", row.verdict, row.note]
            for row in found.rows
        ]  # fmt: skip
        print(columns(["", "found", "", "nominal", "recommended", "verdict", ""], rows, left=1))
        for note in found.notes:
            print(note)
    if args.html is not None:
        from ...calibration.display.verification_outputs import verification_page

        write_text(args.html, verification_page(found))
    if args.junit is not None:
        from ...calibration.display.verification_outputs import verification_junit

        write_text(args.junit, verification_junit(found))
    if not args.not_kept:
        replace(record, verifications=(*record.verifications, found.kept)).write(args.display)
    return _CODES[found.verdict]
