"""Output of subcommands: lines on standard output and standard error, and files."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any, TextIO

from ..runtime.errors import UsageError, visible

# Stream of figures while other lines of standard output go to standard error.
_figures_stream: TextIO | None = None

#: Options that name a text file, or standard output as `-`.
TEXT_OUTPUTS = ("json", "csv", "html", "junit", "markdown")


def end_of_name(text: str, room: int) -> str:
    """Return the distinguishing end of a name, in `room` characters."""
    return text if len(text) <= room else f"…{text[len(text) - room + 1 :]}" if room > 1 else ""


def shows_bars(stream: io.TextIOBase | TextIO) -> bool:
    """Return whether a stream may show moving bars: a terminal, without a request for plain lines (NO_COLOR)."""
    return stream.isatty() and not os.environ.get("NO_COLOR")


def warn(line: str) -> None:
    """Print a warning on standard error, at once and in one line."""
    print(f"metamer: warning: {line}", file=sys.stderr, flush=True)


def say(line: str) -> None:
    """Announce a long step on standard error, at once."""
    print(f"metamer: {line}", file=sys.stderr, flush=True)


def say_paragraph(text: str) -> None:
    """Print one paragraph, with control characters escaped."""
    print(visible(text, lines=True))


def on_standard_output(target: Path | None) -> bool:
    """Return whether an option requests standard output, `-`."""
    return str(target) == "-"


def figures_file(target: Path | None) -> list[Path]:
    """List the file of `--json`: none for `-`."""
    return [] if target is None or on_standard_output(target) else [target]


@contextmanager
def figures_alone(*targets: Path | None) -> Iterator[None]:
    """Reserve standard output for the requested figures, and redirect all other output to standard error.

    Raises
    ------
    UsageError : two of the targets are standard output.
    """
    global _figures_stream
    asked = sum(map(on_standard_output, targets))
    if asked > 1:
        raise UsageError("two outputs on standard output (-): give one of them a file")
    if not asked:
        yield
        return
    _figures_stream = sys.stdout
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        _figures_stream = None


def write_json(target: Path | None, document: Any) -> None:
    """Write every figure as JSON to the target of `--json`; a document that is text already is not changed."""
    import json

    if target is None:
        return
    text = document if isinstance(document, str) else json.dumps(document, ensure_ascii=False, indent=1)
    write_text(target, text.rstrip("\n") + "\n")


def write_text(path: Path, text: str) -> None:
    """Write a file, whole or not at all, or to standard output."""
    from ..runtime.files import written_whole

    if on_standard_output(path):
        print(text, end="", file=_figures_stream or sys.stdout)
        return
    with written_whole(path) as beside:
        beside.write_text(text, encoding="utf-8")
