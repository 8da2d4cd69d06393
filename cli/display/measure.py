"""`metamer display measure`: patches shown and measured by ArgyllCMS."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path

from ..options import add_output_option, positive_count


def add_parser(kinds: argparse._SubParsersAction) -> None:
    """Add `display measure`."""
    verb = kinds.add_parser(
        "measure",
        help="show the patches and measure them, by ArgyllCMS and an instrument",
        description="Have ArgyllCMS's dispread, which is installed by itself, show patches and read the instrument. It "
        "asks for keys in this terminal. Exit code 4 where it is not there, fails, or says nothing for too long.",
    )
    verb.add_argument("patches", type=Path, metavar="PATCHES.ti1", help="as `metamer display patches` writes them")
    add_output_option(verb, "the readings, .ti3", metavar="FILE", required=True)
    verb.add_argument("--screen", type=positive_count, metavar="N", help="which screen (default: the first)")
    verb.add_argument("--instrument", type=positive_count, metavar="N", help="which instrument (default: the first)")
    verb.add_argument(
        "--correction", type=Path, metavar="FILE", help="of a colorimeter for this kind of display: .ccss or .ccmx"
    )
    verb.add_argument("--spectra", action="store_true", help="keep spectra, where the instrument measures them")
    verb.add_argument(
        "--arguments", type=shlex.split, default=[], metavar="WORDS", help='more of dispread, such as "-yl -F"'
    )
    verb.add_argument(
        "--patience",
        type=positive_count,
        default=300,
        metavar="S",
        help="seconds without a word from dispread after which it is ended (default: 300)",
    )
    verb.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Measure, write and print; 0."""
    from ...calibration.display.argyll import measure
    from ...runtime.errors import UsageError
    from ...runtime.files import check_outputs, existing_file
    from ...runtime.wording import counted

    if args.out.suffix.lower() != ".ti3":
        raise UsageError(f"{args.out}: readings of ArgyllCMS are written as .ti3")
    check_outputs([args.out], [args.patches])
    words = ["-d", str(args.screen)] if args.screen else []
    words += ["-c", str(args.instrument)] if args.instrument else []
    words += ["-X", str(existing_file(args.correction).resolve())] if args.correction else []
    words += ["-s"] if args.spectra else []
    found = measure(args.patches, args.out, [*words, *args.arguments], _pass_on, args.patience)
    print(f"{args.out}: {counted(len(found.codes), 'reading')}" + (f", {found.instrument}" * bool(found.instrument)))
    print(f"next: metamer display characterise {args.out} -o DISPLAY.json")
    return 0


def _pass_on(words: str) -> None:
    sys.stderr.write(words)
    sys.stderr.flush()
