"""`metamer report baseline`: renders a suite and records it."""

from __future__ import annotations

import argparse
import shutil

from ...runtime.wording import counted
from ..options import add_output_option
from ..progress.lines import progress_bar
from .suite import add_suite_options, render_suite_side


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `baseline`."""
    baseline = verbs.add_parser(
        "baseline",
        help="render a suite and record it",
        description="Render every scene, material, light, observer and camera of a suite and record the pictures and "
        "their references, small enough for version control. Nothing is compared: look at what is recorded.",
    )
    add_suite_options(baseline)
    add_output_option(baseline, "the baseline's folder", metavar="DIR", required=True, old="--into")
    baseline.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Render and record; 0."""
    from ...calibration.regression.baseline import check_place, record
    from ...runtime.files import made_folder
    from ...viewer.suite_run import REVIEWS, environment

    # Beside the baseline, so that what was broken off goes on from there.
    work = args.out.with_name(f".{args.out.name}.unfinished")

    def check(suite: dict[str, str]) -> None:
        check_place(args.out, suite)
        made_folder(args.out)

    side, said, _ = render_suite_side(args, work, check)
    with progress_bar("Recording", after=1.0) as progress:
        record(side, args.out, said, environment(), progress)
    shutil.rmtree(work / REVIEWS, ignore_errors=True)
    if work.exists():
        work.rmdir()
    size = sum(file.stat().st_size for file in args.out.rglob("*") if file.is_file())
    print(f"{counted(len(side.rows), 'row')} of {said['name']} in {args.out}, {size / 1e6:.1f} MB")
    return 0
