"""`metamer display show`: patches on a whole screen, for any instrument."""

from __future__ import annotations

import argparse
from pathlib import Path

from ...runtime.wording import counted
from ..options import positive_count
from ..output import say
from ..view import window_module

_PERCENT = range(1, 101)


def add_parser(kinds: argparse._SubParsersAction) -> None:
    """Add `display show`."""
    verb = kinds.add_parser(
        "show",
        help="the patches on a whole screen, one after another, for an instrument that is read by hand",
        description="Show patches in the very codes of the file, not colour-managed. Space and arrows go on and back, "
        "Escape ends. Exit code 4 where no window can be opened.",
    )
    verb.add_argument("patches", type=Path, metavar="PATCHES", help="the .ti1 or .csv of `metamer display patches`")
    verb.add_argument("--seconds", type=positive_count, metavar="S", help="for which each stays (default: until a key)")
    verb.add_argument(
        "--size",
        type=int,
        choices=_PERCENT,
        default=100,
        metavar="PERCENT",
        help="of the screen's area, in its middle; small where the display limits its brightness (default: 100)",
    )
    verb.add_argument(
        "--surround", type=int, choices=range(256), default=0, metavar="CODE", help="of the grey around (default: 0)"
    )
    verb.add_argument("--screen", type=positive_count, default=1, metavar="N", help="which screen (default: the first)")
    verb.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Show; 0 once it is closed."""
    import numpy as np

    from ...calibration.display.patch_files import read_patches

    codes = read_patches(args.patches)
    sent = np.round(255.0 * codes).astype(int)

    def told(at: int) -> None:
        say(f"{at + 1} of {len(sent)}: {' '.join(map(str, sent[at]))}")

    seen = window_module("patch_screen").show_patches(
        codes,
        told,
        seconds=args.seconds,
        size=args.size / 100.0,
        surround=args.surround / 255.0,
        screen=args.screen,
    )
    print(f"{seen} of {counted(len(codes), 'reading')} shown")
    return 0
