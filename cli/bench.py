"""`metamer bench`: speed against error, measured here and now."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from ..spectral.files import written_whole

WHAT = ("basis", "shading", "all")


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    command = subparsers.add_parser("bench", help="speed against error, measured on this machine")
    command.add_argument("what", nargs="?", choices=WHAT, default="all", help="default: all")
    command.add_argument("--json", type=Path, metavar="F", help="also write the figures to F")
    command.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    figures = {}
    if args.what in ("basis", "all"):
        from ..calibration import basis_benchmark

        figures["basis"] = basis_benchmark.run()
        print(basis_benchmark.report(figures["basis"]))
    if args.what in ("shading", "all"):
        from ..viewer import shading_benchmark

        figures["shading"] = shading_benchmark.run()
        print(shading_benchmark.report(figures["shading"]))
    if args.json:
        with written_whole(args.json) as beside:
            beside.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
        print(args.json)
    return 0
