"""`metamer report run`: renders a suite again and compares it with its baseline."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from ..options import add_output_option
from ..output import on_standard_output
from ..progress.lines import progress_bar
from .output import EXIT_CODES, add_output_options, check_output_options, report_result
from .suite import add_suite_options, render_suite_side


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `run`."""
    command = verbs.add_parser(
        "run",
        help="render a suite again and compare it with its baseline",
        description="Render a suite, compare every row with the baseline, and keep what was rendered in OUT, whence "
        f"`metamer report accept` takes it. The baseline is only read. {EXIT_CODES}",
    )
    add_suite_options(command)
    command.add_argument("--baseline", type=Path, required=True, metavar="DIR", help="of `metamer report baseline`")
    add_output_option(command, "default: report", metavar="OUT", default=Path("report"))
    command.add_argument("--criteria", type=Path, metavar="FILE", help="in place of those of the suite")
    add_output_options(command)
    command.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Render and compare; the exit code is in the command's description."""
    from ...calibration.regression.baseline import (
        as_recorded,
        baseline_side,
        check_place,
        check_suite,
        read_kept,
        record,
    )
    from ...calibration.regression.comparison import compare
    from ...calibration.regression.criteria import read_criteria
    from ...calibration.report.history import HISTORY
    from ...runtime.errors import ComparisonError
    from ...viewer.suite_run import environment

    # Before anything is rendered.
    check_output_options(args)
    args.history = args.history or args.out / HISTORY
    kept, before = read_kept(args.baseline), baseline_side(args.baseline)
    if args.out.exists() and args.out.samefile(args.baseline):
        raise ComparisonError(f"{args.out} is the baseline: what is rendered goes into another folder")
    criteria = read_criteria(args.criteria) if args.criteria else None

    def check(suite: dict[str, str]) -> None:
        check_suite(args.baseline, kept.suite, args.suite, suite)
        check_place(args.out, suite)

    side, suite, own = render_suite_side(args, args.out, check)
    with progress_bar("Recording", quiet=on_standard_output(args.json), after=1.0) as progress:
        record(side, args.out, suite, environment(), progress)
    # The new pictures, rounded as the baseline is.
    after = replace(as_recorded(side), facts={**side.facts, **environment()})
    with progress_bar("Comparing", quiet=on_standard_output(args.json), after=1.0) as progress:
        result = compare(before, after, criteria or own, progress)
    if kept.suite.get("sha256") != suite.get("sha256"):
        result = replace(result, notes=(*result.notes, "The files of the suite are others than those of the baseline."))
    return report_result(result, as_recorded(before), after, args)
