"""Shared parts of `report baseline` and `report run`: a suite, rendered, or an existing review."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from ...runtime.progress import TimeLeft
from ..options import add_catalogue_option, add_renderer_option, add_scheduler_option, catalogue_for, positive_count
from ..output import on_standard_output, say, warn
from ..progress.lines import progress_bar

if TYPE_CHECKING:
    from ...calibration.regression.criteria import Criteria
    from ...calibration.regression.row import ComparedSide


def add_suite_options(command: argparse.ArgumentParser) -> None:
    """Add options for the suite, and for its rendering."""
    command.add_argument(
        "suite", type=Path, metavar="SUITE", help="suite.toml, scene.toml, or the folder of a review that is there"
    )
    command.add_argument("--again", action="store_true", help="also render the rows that an earlier run has left")
    command.add_argument("--jobs", type=positive_count, metavar="N", help="processes; default: one a core")
    add_scheduler_option(command, "draw")
    add_catalogue_option(command)
    add_renderer_option(command)


def render_suite_side(
    args: argparse.Namespace, work: Path, check: Callable[[dict[str, str]], None]
) -> tuple[ComparedSide, dict[str, str], Criteria]:
    """Return the rows of the suite, its description, and its criteria; reviews are written to `work`.

    `check` is called with the description of the suite before anything is rendered.
    """
    from ...calibration.regression.criteria import default_criteria
    from ...calibration.regression.review_folder import review_side
    from ...calibration.regression.suite import read_suite
    from ...runtime.worker_pool import usable_cores
    from ...viewer.api import renderer_named
    from ...viewer.suite_run import run_suite

    if args.suite.is_dir():
        side = review_side(args.suite)
        scenes = dict.fromkeys(row.name.scene for row in side.rows)
        said = {"name": f"review of {', '.join(scenes)}"}
        check(said)
        return side, said, default_criteria()
    suite = read_suite(args.suite)
    check(suite.said)
    jobs = args.jobs or usable_cores()
    catalogue = catalogue_for(args.catalogue, jobs)
    renderer, why = renderer_named(args.renderer)
    if why is not None:
        # Standard output may be a program's.
        say(f"no OpenGL here, so the software path renders. {why}")
    quiet, left = on_standard_output(getattr(args, "json", None)), TimeLeft()
    with renderer, progress_bar("Rendering", quiet=quiet, work=None if args.scheduler else left) as progress:
        renderer.configure(jobs=args.jobs, on_message=say)
        side = run_suite(
            suite,
            catalogue,
            work,
            renderer,
            jobs=jobs,
            scheduler=args.scheduler,
            again=args.again,
            progress=progress,
            left=left,
            warn=warn,
            resumed=lambda found, total: say(f"resumed: {found} of {total} rows were there"),
        )
    return side, suite.said, suite.criteria
