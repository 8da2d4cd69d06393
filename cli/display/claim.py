"""`metamer display claim`: the difference of a display from its claim."""

from __future__ import annotations

import argparse

from ..options import add_json_option
from ..output import write_json
from .common import add_readings_argument, readings_of


def add_parser(kinds: argparse._SubParsersAction) -> None:
    """Add `display claim`."""
    verb = kinds.add_parser(
        "claim",
        help="how far a display is from sRGB, P3, Adobe RGB, or its ICC profile",
        description="Compare readings with what the display says it is, white at its own luminance.",
    )
    add_readings_argument(verb)
    verb.add_argument(
        "--against",
        type=_claim,
        default="sRGB",
        metavar="CLAIM",
        help="sRGB (default), P3, AdobeRGB, or the file of an ICC profile",
    )
    add_json_option(verb)
    verb.set_defaults(run=run)


def _claim(text: str) -> str:
    """Return a claim as it is; unknown words are wrong usage, profiles are read later."""
    from ...calibration.display.claims import claim_named
    from ...runtime.errors import InputError, UnknownNameError

    try:
        claim_named(text)
    except UnknownNameError as reason:
        raise argparse.ArgumentTypeError(str(reason)) from None
    except InputError:
        pass
    return text


def run(args: argparse.Namespace) -> int:
    """Compare and print; 0."""
    import numpy as np

    from ...calibration.display.claims import held_to

    held = held_to(readings_of(args), args.against)
    mean, p95, most = float(held.delta_e.mean()), float(np.percentile(held.delta_e, 95)), float(held.delta_e.max())
    print(
        f"{len(held.readings)} patches against {held.claim.name}: ΔE94 mean {mean:.2f}, p95 {p95:.2f}, max {most:.2f}"
    )
    print(f"white {held.white:.2f}; " + ", ".join(f"{name} {value:.2f}" for name, value in held.corners.items()))
    if args.json is not None:
        figures = {
            "against": held.claim.name,
            "delta_e94": {"mean": mean, "p95": p95, "max": most},
            "white": held.white,
            "corners": held.corners,
        }
        write_json(args.json, figures)
    return 0
