"""Shared parts of the verbs of `metamer display`: files of readings and missing information in them."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ..options import parse_observer

if TYPE_CHECKING:
    from ...calibration.display.readings import Readings


def add_readings_argument(verb: argparse.ArgumentParser, name: str = "readings") -> None:
    """Add the file, and options for information that it lacks."""
    verb.add_argument(name, type=Path, metavar=name.upper(), help=".ti3, CSV or CxF3")
    verb.add_argument("--codes", type=float, metavar="N", help="code that is full scale: 1, 100, 255, 1023 or 65535")
    verb.add_argument("--xyz", choices=("cd/m2", "Y100"), help="what XYZ are, where the file does not say it")
    verb.add_argument(
        "--white-luminance", type=float, metavar="L", help="cd/m2 of white, where XYZ are relative to white = 100"
    )
    verb.add_argument(
        "--observer", type=parse_observer, metavar="NAME", help="whose XYZ they are, or are made of spectra (1931_2)"
    )


def readings_of(args: argparse.Namespace, name: str = "readings") -> Readings:
    """Read the file of `add_readings_argument`."""
    from ...calibration.display.reading_files import Answers, read_readings

    return read_readings(getattr(args, name), Answers(args.codes, args.xyz, args.white_luminance, args.observer))
