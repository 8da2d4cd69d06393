"""`metamer report accept`: reviewed rows become the baseline."""

from __future__ import annotations

import argparse
from pathlib import Path

from ...runtime.wording import counted


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `accept`."""
    accept = verbs.add_parser(
        "accept",
        help="take rows of a run over into its baseline",
        description="Take what `metamer report run` has rendered over into the baseline: the rows that are named, or "
        "all. The baseline changes in one step: whatever ends the command before leaves it as it was.",
    )
    accept.add_argument("baseline", type=Path, metavar="DIR", help="the baseline")
    accept.add_argument(
        "--from", dest="run_folder", type=Path, default=Path("report"), metavar="OUT", help="of the run"
    )
    which = accept.add_mutually_exclusive_group(required=True)
    which.add_argument("--all", action="store_true", help="every row; those that were not rendered are removed")
    which.add_argument(
        "--row", action="append", metavar="MATCH", help='materials, as "paint/*", or a row as the report names it'
    )
    accept.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Accept; 0."""
    from ...calibration.regression.accept import accept

    taken = accept(args.baseline, args.run_folder, None if args.all else args.row)
    for name in taken:
        print(name)
    why = "" if taken else f": it holds what {'all' if args.all else 'these'} rows of {args.run_folder} show already"
    print(f"{counted(len(taken), 'row')} accepted into {args.baseline}{why}")
    return 0
