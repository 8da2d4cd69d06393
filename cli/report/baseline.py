"""`metamer report baseline`: renders a suite and records it."""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

from ..output import counted
from ..progress.lines import progress_bar
from .suite import add_suite_options, rendered


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `baseline`."""
    baseline = verbs.add_parser(
        "baseline",
        help="render a suite and record it",
        description="Render every scene, material, light, observer and camera of a suite and record the pictures and "
        "their references, small enough for version control. Nothing is compared: look at what is recorded.",
    )
    add_suite_options(baseline)
    baseline.add_argument("--into", type=Path, required=True, metavar="DIR", help="the baseline's folder")
    baseline.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Render and record; 0."""
    from ...calibration.regression.baseline import check_place, record
    from ...runtime.files import made_folder
    from ...viewer.suite_run import REVIEWS, environment

    # Beside the baseline, so that what was broken off goes on from there.
    work = args.into.with_name(f".{args.into.name}.unfinished")

    def check(suite: dict[str, str]) -> None:
        check_place(args.into, suite)
        made_folder(args.into)

    side, said, _ = rendered(args, work, check)
    with progress_bar("Recording", after=1.0) as progress:
        record(side, args.into, said, environment(), progress)
    shutil.rmtree(work / REVIEWS, ignore_errors=True)
    if work.exists():
        work.rmdir()
    size = sum(file.stat().st_size for file in args.into.rglob("*") if file.is_file())
    print(f"{counted(len(side.rows), 'row')} of {said['name']} in {args.into}, {size / 1e6:.1f} MB")
    return 0
