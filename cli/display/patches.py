"""`metamer display patches`: which codes to measure."""

from __future__ import annotations

import argparse

from ...runtime.wording import counted
from ..options import add_output_option, positive_count


def add_parser(kinds: argparse._SubParsersAction) -> None:
    """Add `display patches`."""
    verb = kinds.add_parser(
        "patches",
        help="which codes to measure, as .ti1 or CSV",
        description="Write the codes to measure, in the order in which to show them, white between them so that drift "
        "can be taken out.",
    )
    verb.add_argument("-n", type=positive_count, default=125, metavar="N", help="different patches (default: 125)")
    verb.add_argument(
        "--for",
        dest="purpose",
        choices=("characterise", "verify", "uniformity"),
        default="characterise",
        help="sets to verify with hold other colours than those to characterise with",
    )
    verb.add_argument("--bits", type=int, choices=(8, 10, 12, 16), default=8, help="of the codes (default: 8)")
    add_output_option(verb, ".ti1 for ArgyllCMS, or .csv", metavar="FILE", required=True)
    verb.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Write; 0."""
    from ...calibration.display.patch_files import write_patches
    from ...calibration.display.patches import patches

    codes = patches(args.n, args.purpose)
    write_patches(args.out, codes, args.bits)
    white = int((codes >= 1.0).all(axis=1).sum())
    print(f"{args.out}: {counted(len(codes), 'reading')}, {white} of them of white")
    return 0
