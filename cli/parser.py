"""Parser of the `metamer` command: its subcommands, each imported when called, and suggestions for misspelt words."""

from __future__ import annotations

import argparse
import difflib
import importlib
import re
import sys
from collections.abc import Iterable, Sequence
from typing import Any, NoReturn

# One small module a subcommand; its `add_parser(subparsers)` sets the `run(args) -> int` of what it adds.
COMMANDS = (
    "review",
    "view",
    "report",
    "match",
    "render",
    "transfer",
    "fit",
    "catalogue",
    "display",
    "names",
    "bench",
    "doctor",
)


class _Parser(argparse.ArgumentParser):
    """argparse parser with the documented exit code for wrong usage, and suggestions for unknown words."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        # Lists of numbers that begin with a negative one, as of angles, are no options.
        self._negative_number_matcher = re.compile(r"-\.?\d[\d.,-]*$")

    def error(self, message: str) -> NoReturn:
        self.print_usage(sys.stderr)
        self.exit(64, f"{self.prog}: {message}\n")

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            words = [str(word) for word in action.choices]
            expected = f"choose from {', '.join(words)}"
            raise argparse.ArgumentError(action, f"invalid choice: {value!r}{_nearest(str(value), words)}; {expected}")


class _CommandParser(_Parser):
    """Parser of one command, which reports unknown arguments under its own usage."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:  # type: ignore[override]
        found, unknown = super().parse_known_args(args, namespace)
        if unknown:
            near = _nearest(unknown[0].partition("=")[0], self._option_string_actions)
            self.error(f"unrecognized arguments: {' '.join(unknown)}{near}")
        return found, unknown


def _nearest(word: str, known: Iterable[str]) -> str:
    # Hyphens and the dashes of options are alike in all of them, and make words near that are not.
    close = difflib.get_close_matches(word, list(known), n=1, cutoff=0.7)
    return f" (did you mean {close[0]}?)" if close else ""


def parser(words: Sequence[str] = ()) -> argparse.ArgumentParser:
    """Return the parser of the whole command line or, if `words` begin with a command, of this one alone.

    The other commands are neither imported nor described, which would slow a short command down.
    """
    command = _Parser(prog="metamer", description="Spectral, colour-accurate rendering for design review.")
    command.add_argument("--version", action="store_true", help="print the version and end")
    subparsers = command.add_subparsers(metavar="COMMAND", parser_class=_CommandParser)
    for name in words[:1] if words[:1] and words[0] in COMMANDS else COMMANDS:
        module = importlib.import_module(f".{name}", __package__)
        module.add_parser(subparsers)
    return command
