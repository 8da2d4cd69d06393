"""`metamer display proof`: what of a picture a display cannot show, and where."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..options import add_output_option
from ..output import warn


def add_parser(kinds: argparse._SubParsersAction) -> None:
    """Add `display proof`."""
    verb = kinds.add_parser(
        "proof",
        help="what of a picture a display cannot show, and where",
        description="Count the pixels of an sRGB picture that the display cannot show, say how far off what it shows "
        "is, and mark them. Exit code 1 where there are any.",
    )
    verb.add_argument("display", type=Path, metavar="DISPLAY.json", help="what `display characterise` wrote")
    verb.add_argument("picture", type=Path, metavar="PICTURE", help="PNG or JPEG, taken as sRGB")
    verb.add_argument("--luminance", type=float, metavar="L", help="cd/m2 of white (default: as much as there is)")
    verb.add_argument(
        "--black", choices=("absolute", "bpc"), default="absolute", help="of pictures: as it is, or moved"
    )
    add_output_option(verb, "the picture in grey, what is lost in magenta", metavar="F.png")
    verb.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Look and print; 0, or 1 where something cannot be shown."""
    from ...calibration.display.aim import aimed
    from ...calibration.display.cube import make_cube
    from ...calibration.display.proof import proofed
    from ...calibration.display.record import read_record
    from ...runtime.files import check_outputs, written_whole
    from ...viewer.display.received_picture import read_srgb

    if args.out is not None:
        check_outputs([args.out], [args.display, args.picture])
    record = read_record(args.display)
    aim = aimed(record.model, "d65", args.luminance, record.readings.absolute)
    pixels, xyz, stated = read_srgb(args.picture)
    if stated:
        warn(f"{args.picture} says {', '.join(stated)}, which is not applied: it is taken as sRGB")
    found = proofed(record.model, make_cube(record.model), aim, xyz, args.black)
    count = int(found.lost.sum())
    print(f"{args.picture}: {count} of {found.lost.size} pixels ({count / found.lost.size:.2%}) cannot be shown on "
          f"{record.name}, white {aim.words}")  # fmt: skip
    if count:
        off = found.delta_e[found.lost]
        warn(f"where they are, what is shown is off by ΔE94 {off.mean():.2f} on average, at most {off.max():.1f}")
    if args.out is not None:
        from PIL import Image

        marked = pixels.copy()
        marked[...] = marked.mean(axis=-1, keepdims=True)
        marked[found.lost] = (255, 0, 255)
        with written_whole(args.out) as beside:
            Image.fromarray(marked).save(beside, format="PNG")
        print(f"Written: {args.out}")
    return 1 if count else 0
