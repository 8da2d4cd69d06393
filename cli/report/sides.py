"""The two sides of a comparison, as they are named on the command line."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ..options import Added, add_answer_options, answer_of, parse_illuminants, parse_observer

if TYPE_CHECKING:
    from ...calibration.regression.picture_files import SeenSpectra
    from ...calibration.regression.row import ComparedSide


def add_side_options(command: argparse.ArgumentParser) -> None:
    """Add the options for what files leave open."""
    command.add_argument(
        "--illuminants",
        type=parse_illuminants,
        action=Added,
        default=("D65", "A", "FL11"),
        metavar="X,Y",
        help="under which spectra, readings and catalogues are seen (default: D65,A,FL11); pictures in XYZ have theirs",
    )
    command.add_argument(
        "--observer", type=parse_observer, default="1931_2", metavar="NAME", help="of the same (default: 1931_2)"
    )
    command.add_argument(
        "--display", choices=("sRGB",), metavar="NAME", help="that PNG pictures are for, where they do not say: sRGB"
    )
    add_answer_options(command)


def seen_by(args: argparse.Namespace) -> SeenSpectra:
    """Lights and observer; names that are not known are refused before any file is opened."""
    from ...calibration.regression.picture_files import SeenSpectra
    from ...spectral.illuminants import illuminant
    from ...spectral.observers import observer

    for name in args.illuminants:
        illuminant(name)
    observer(args.observer)
    if args.colours_for is not None:
        illuminant(args.colours_for[0])
        observer(args.colours_for[1])
    return SeenSpectra(tuple(args.illuminants), args.observer, answer_of(args))


def side_at(path: Path, seen: SeenSpectra, display: str | None) -> ComparedSide:
    """Return the side that is there; a folder of materials is a catalogue."""
    from ...calibration.regression.sources import side_of
    from ...viewer.catalogue_side import catalogue_side, is_catalogue

    return catalogue_side(path, seen) if is_catalogue(path) else side_of(path, seen, display)
