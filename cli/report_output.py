"""Where the result of a comparison goes: the terminal, and files for other programs."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..calibration.regression.result import Result

EXIT_CODES = (
    "Exit code 0: pass, or identical; 1: warnings; 2: failures; 3: the two cannot be compared (the same file, other "
    "whites, observers or sizes, nothing in common); 4: a file is unusable."
)


def add_output_options(command: argparse.ArgumentParser) -> None:
    """`--json` and the files."""
    command.add_argument("--json", action="store_true", help="every figure, for a program")


def said(result: Result, args: argparse.Namespace) -> int:
    """Write and print what was asked for; the exit code of the result."""
    from importlib.metadata import version

    from ..calibration.regression.as_json import as_json
    from ..calibration.regression.words import as_text

    print(as_json(result, version("metamer")) if args.json else as_text(result))
    return result.exit_code
