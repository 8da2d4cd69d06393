"""What `report baseline` and `report run` share: a suite, rendered, or a review that is there already."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from .chosen_catalogue import add_catalogue_option, catalogue_for
from .shared import add_renderer_option, positive_count, progress_bar, renderer_for, say, warn

if TYPE_CHECKING:
    from ..calibration.regression.criteria import Criteria
    from ..calibration.regression.row import Side


def add_suite_options(command: argparse.ArgumentParser) -> None:
    """The suite, and how it is rendered."""
    command.add_argument(
        "suite", type=Path, metavar="SUITE", help="suite.toml, scene.toml, or the folder of a review that is there"
    )
    command.add_argument("--again", action="store_true", help="also render the rows that an earlier run has left")
    command.add_argument("--jobs", type=positive_count, metavar="N", help="processes; default: one a core")
    add_catalogue_option(command)
    add_renderer_option(command)


def rendered(args: argparse.Namespace, work: Path) -> tuple[Side, dict[str, str], Criteria]:
    """The rows of the suite, what is said of it, and its criteria; `work` takes the reviews."""
    from ..calibration.regression.criteria import default_criteria
    from ..calibration.regression.review_folder import review_side
    from ..calibration.regression.suite import read_suite
    from ..spectral.processes import usable_cores
    from ..viewer.suite_run import run_suite

    if args.suite.is_dir():
        # Other materials and scenes are other rows; the name keeps baselines of other reviews apart.
        return review_side(args.suite), {"name": args.suite.resolve().name}, default_criteria()
    suite = read_suite(args.suite)
    jobs = args.jobs or usable_cores()
    catalogue = catalogue_for(args.catalogue, jobs)
    renderer = renderer_for(args.renderer)
    with renderer, progress_bar("Rendering", quiet=getattr(args, "json", False)) as progress:
        renderer.jobs, renderer.say = args.jobs, say
        side = run_suite(
            suite,
            catalogue,
            work,
            renderer,
            jobs=jobs,
            again=args.again,
            progress=progress,
            warn=warn,
            resumed=lambda found, total: say(f"resumed: {found} of {total} rows were there"),
        )
    return side, suite.said, suite.criteria
