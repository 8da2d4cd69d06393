"""The `metamer` command: reads the words, calls the package, turns errors into exit codes.

0 pass, 1 warn, 2 fail, 3 the two sides cannot be compared, 4 a file is unusable, 64 wrong usage, 130 interrupted.
"""

from __future__ import annotations

import argparse
import importlib
import io
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from ..spectral.errors import MetamerError

# One small module a subcommand; its `add_parser(subparsers)` sets the `run(args) -> int` of what it adds.
COMMANDS = ("review", "render", "fit", "catalogue", "bench", "doctor")


class _Parser(argparse.ArgumentParser):
    """argparse, with the exit code that the command documents for wrong usage."""

    def error(self, message: str) -> NoReturn:
        self.print_usage(sys.stderr)
        self.exit(64, f"{self.prog}: {message}\n")


def parser() -> argparse.ArgumentParser:
    """The whole command line."""
    command = _Parser(prog="metamer", description="Spectral, colour-accurate rendering for design review.")
    command.add_argument("--version", action="store_true", help="print the version and end")
    subparsers = command.add_subparsers(metavar="COMMAND", parser_class=_Parser)
    for name in COMMANDS:
        module = importlib.import_module(f".{name}", __package__)
        module.add_parser(subparsers)
    return command


def main(words: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    # Python has None for a stream that whoever started it has closed.
    sys.stdout = sys.stdout or _nowhere()
    sys.stderr = sys.stderr or _nowhere()
    for stream in (sys.stdout, sys.stderr):
        # A terminal that has no Δ gets a question mark, not a traceback.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    command = parser()
    args = command.parse_args(words)
    if args.version:
        from importlib.metadata import version

        print(f"metamer {version('metamer')}")
        return 0
    if not hasattr(args, "run"):
        command.print_help()
        return 64
    try:
        code = args.run(args)
        # Here, and not while Python shuts down, a reader that has left can be forgiven.
        sys.stdout.flush()
        return code
    except MetamerError as reason:
        print(f"metamer: {reason}", file=sys.stderr)
        return reason.exit_code
    except KeyboardInterrupt as reason:
        print(f"\nmetamer: interrupted; nothing half-written is left behind. {reason}".rstrip(), file=sys.stderr)
        return 130
    except BrokenPipeError:
        # The reader of our output has left, as `head` does; what is still buffered goes nowhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as reason:
        # A full disk, a folder where a file should go: the system's own words name the file.
        print(f"metamer: {reason}", file=sys.stderr)
        return 4


def _nowhere() -> io.TextIOWrapper:
    return Path(os.devnull).open("w", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
