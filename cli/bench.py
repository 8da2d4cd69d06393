"""`metamer bench`: speed against error, measured here and now."""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path

from ..spectral.files import written_whole
from .shared import comma_separated

WHAT = ("basis", "shading", "factor", "all")


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add `bench`."""
    command = subparsers.add_parser("bench", help="speed against error, measured on this machine")
    command.add_argument(
        "what",
        nargs="?",
        choices=WHAT,
        default="all",
        help="default: all, which is basis and shading; factor takes minutes, with measured data half an hour",
    )
    command.add_argument("--json", type=Path, metavar="F", help="also write the figures to F")
    factor = command.add_argument_group("factor")
    factor.add_argument("--html", type=Path, metavar="F", help="also write a page with pictures, maps and plots")
    factor.add_argument("--cases", type=comma_separated, metavar="A,B", help="surfaces by name; default: all there are")
    factor.add_argument(
        "--data",
        type=Path,
        metavar="DIR",
        help="measured surfaces join in, a minute or two each; default: $METAMER_DATA, without it analytic ones only",
    )
    factor.add_argument("--baseline", action="store_true", help="also time tensorly, half a minute a surface")
    factor.add_argument("--no-points", action="store_true", help="leave out speed against error")
    factor.add_argument("--growth", action="store_true", help="decompose tables up to the paper's size and beyond")
    command.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Measure and print; 0."""
    if args.what == "factor":
        return _factor(args)
    figures = {}
    if args.what in ("basis", "all"):
        from ..calibration import basis_benchmark

        figures["basis"] = basis_benchmark.run()
        print(basis_benchmark.report(figures["basis"]))
    if args.what in ("shading", "all"):
        from ..viewer.benchmarks import shading

        figures["shading"] = shading.run()
        print(shading.report(figures["shading"]))
    if args.json:
        _write(args.json, json.dumps(figures, indent=1) + "\n")
    return 0


def _factor(args: argparse.Namespace) -> int:
    from ..viewer.benchmarks.factor import benchmark, report

    data = args.data or (Path(folder) if (folder := os.environ.get("METAMER_DATA")) else None)
    measured = benchmark.run(
        args.cases,
        data=data,
        picture_pixels=140 if args.html else 0,
        baseline=args.baseline,
        points=not args.no_points,
        growth=args.growth,
        progress=lambda line: print(line, flush=True),
    )
    print(report.report(measured))
    if args.json:
        _write(args.json, json.dumps(report.document(measured), indent=1) + "\n")
    if args.html:
        _write(args.html, report.page(measured))
    return 0


def _write(path: Path, text: str) -> None:
    with written_whole(path) as beside:
        beside.write_text(text, encoding="utf-8")
    print(path)
