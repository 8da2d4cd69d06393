"""`metamer display characterise`: a model of readings."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..options import add_output_option
from .common import add_readings_argument, readings_of


def add_parser(kinds: argparse._SubParsersAction) -> None:
    """Add `display characterise`."""
    verb = kinds.add_parser(
        "characterise",
        help="a model of a display from readings of it",
        description="Take out drift, fit models, choose one by patches that it has not seen, and keep all of it in a "
        "file. Exit code 1 where something speaks against the readings.",
    )
    add_readings_argument(verb)
    add_output_option(verb, "the file of the display, .json", metavar="FILE", required=True)
    verb.add_argument(
        "--model", choices=("auto", "gog", "matrix-trc", "residual", "minima"), default="auto", help="default: auto"
    )
    verb.add_argument(
        "--primaries",
        type=Path,
        metavar="FILE.ccss",
        help="spectra of the display's primaries, to aim it for other observers where the readings have none",
    )
    verb.add_argument("--name", default="", metavar="WORDS", help="of the display (default: as the readings have it)")
    verb.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Fit, write and print; 0, or 1 with a warning."""
    import numpy as np

    from ...calibration.display.characterise import characterise
    from ...calibration.display.primaries import read_primaries, with_primaries
    from ...runtime.files import check_outputs
    from ..output import warn

    check_outputs([args.out], [one for one in (args.readings, args.primaries) if one is not None])
    readings = readings_of(args)
    if args.primaries is not None:
        readings = with_primaries(readings, read_primaries(args.primaries))
    found = characterise(readings, args.name, args.model)
    found.record.write(args.out)
    record = found.record
    black, white = record.model.xyz(np.array([[0.0] * 3, [1.0] * 3]))
    unit = "cd/m2" if record.readings.absolute else "of white = 100"
    print(f"{record.name}: {len(record.readings)} patches, observer {record.readings.observer}")
    print(f"white x {white[0] / white.sum():.4f}, y {white[1] / white.sum():.4f}, {white[1]:.2f} {unit}; "
          f"black {max(black[1], 0.0):.4f}")  # fmt: skip
    print(f"model {record.reason}")
    for note in record.notes:
        if note not in found.warnings:
            print(note)
    for words in found.warnings:
        warn(words)
    print(f"Written: {args.out}")
    return 1 if found.warnings else 0
