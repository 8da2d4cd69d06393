"""Parts that several subcommands share: options, what ships, and progress."""

from __future__ import annotations

import argparse
import io
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    from ..spectral.formats.import_options import ImportOptions
    from ..viewer.render.session import RenderSession


# Cells that bar, count, time left and the gaps between them take on a line of progress.
_BESIDE_THE_NAME = 34
# Before this share of the work is done, its beginning, which is slow, says little of the rest.
_TELLING = 0.1


def comma_separated(text: str) -> tuple[str, ...]:
    """Words of an option such as `--illuminants D65,A,FL11`."""
    words = tuple(word.strip() for word in text.split(",") if word.strip())
    if not words:
        raise argparse.ArgumentTypeError("names nothing")
    return words


class Added(argparse.Action):
    """An option with several values that adds to what it was given before, each once, in place of the default."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        """Called by argparse for each time that the option stands in a command."""
        had = getattr(namespace, self.dest, self.default)
        before = () if had is self.default else had
        setattr(namespace, self.dest, tuple(dict.fromkeys((*before, *values))))


def positive_count(text: str) -> int:
    """A whole number, at least 1."""
    if not (text.isascii() and text.isdecimal()) or int(text) < 1:
        raise argparse.ArgumentTypeError(f"a whole number, at least 1, not {text}")
    return int(text)


def positive_delta_e(text: str) -> float:
    """A ΔE94 above 0."""
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not 0.0 < number < float("inf"):
        raise argparse.ArgumentTypeError(f"a ΔE94 above 0, not {text}")
    return number


def counted(number: int, what: str) -> str:
    """Write a count of things in words.

    >>> counted(1, "row"), counted(2, "row")
    ('1 row', '2 rows')
    """
    return f"{number} {what}{'' if number == 1 else 's'}"


def add_answer_options(command: argparse.ArgumentParser) -> None:
    """Add options for facts that files of readings leave open: `--as`, `--scale`, `--decimal`, `--colours-for`."""
    command.add_argument(
        "--as",
        dest="quantity",
        type=lambda words: words.strip().replace(" ", "-").replace("_", "-"),
        choices=("reflectance", "radiance-factor", "transmittance", "emission"),
        help="what files hold that do not say it",
    )
    command.add_argument("--scale", choices=("percent", "fraction"), help="what their numbers are that do not say it")
    command.add_argument(
        "--decimal", choices=("comma", "point"), help="the decimal mark of tables whose rows can be read in two ways"
    )
    command.add_argument(
        "--colours-for",
        type=_conditions,
        metavar="LIGHT/OBSERVER",
        help="what XYZ and CIELAB are for in files that do not say it, such as D50/1931_2",
    )


def add_across_option(command: argparse.ArgumentParser) -> None:
    """`--across`: what is compared although it was not measured alike."""
    command.add_argument(
        "--across",
        type=_crossings,
        action=Added,
        default=(),
        metavar="X,Y",
        help="compare readings although their geometry (with the specular component), or their condition (M0 to M3, "
        "filter, polarisation, backing), is not the same: geometry, condition",
    )


def _crossings(text: str) -> tuple[str, ...]:
    names = comma_separated(text)
    for name in names:
        if name not in ("geometry", "condition"):
            raise argparse.ArgumentTypeError(f"{name!r} is neither geometry nor condition")
    return names


def answer_of(args: argparse.Namespace) -> ImportOptions:
    """Return the answer given by the options of `add_answer_options`."""
    from ..spectral.formats.import_options import ImportOptions

    quantity = args.quantity and args.quantity.replace("-", " ")
    return ImportOptions(quantity, args.scale, colours_for=args.colours_for, decimal=args.decimal)


def _conditions(text: str) -> tuple[str, str]:
    light, slash, eye = text.partition("/")
    if not (light and slash and eye):
        raise argparse.ArgumentTypeError(f"{text!r} is not an illuminant and an observer, such as D50/1931_2")
    return light, eye


def add_renderer_option(command: argparse.ArgumentParser) -> None:
    """`--renderer`."""
    command.add_argument(
        "--renderer",
        choices=("auto", "gl", "software"),
        default="auto",
        help="default: GL, else software, and it says so",
    )


def renderer_for(choice: str) -> RenderSession:
    """The renderer asked for; "auto" falls back to software and says why."""
    from ..viewer.api import renderer_named

    renderer, reason = renderer_named(choice)
    if reason is not None:
        print(f"No OpenGL here, so the software path renders. {reason}")
    return renderer


def warn(line: str) -> None:
    """Say a warning on standard error, at once and in one line."""
    print(f"metamer: warning: {line}", file=sys.stderr, flush=True)


def say(line: str) -> None:
    """Say on standard error, at once, which long step begins."""
    print(f"metamer: {line}", file=sys.stderr, flush=True)


def shows_bars(stream: io.TextIOBase | TextIO) -> bool:
    """Return whether bars may move on a stream: a terminal, and nobody has asked for plain lines (NO_COLOR)."""
    return stream.isatty() and not os.environ.get("NO_COLOR")


@contextmanager
def progress_bar(title: str, *, quiet: bool = False, after: float = 0.0) -> Iterator[Callable[[int, int, str], None]]:
    """A live bar with the time left on a terminal; elsewhere a line every tenth of the way; nothing where `quiet`, nor
    in the first `after` seconds. Work whose count changes is another work: its time left is its own. On standard error:
    what a command says on standard output goes into files and other programs."""
    if quiet:
        yield lambda *_: None
        return
    begun = time.monotonic()
    if not shows_bars(sys.stderr):
        from ..materials.intake.progress import in_words

        tenths, start, of = -1, begun, 0

        def line(done: int, total: int, what: str) -> None:
            nonlocal tenths, start, of
            if of and total != of:
                tenths, start = -1, time.monotonic()
            of = total
            if done * 10 // total > tenths and time.monotonic() - begun >= after:
                tenths = done * 10 // total
                spent = time.monotonic() - start
                telling = _TELLING * total <= done < total and spent > 2.0
                left = f", about {in_words(spent * (total - done) / done)} left" if telling else ""
                print(f"{title}: {done}/{total} {what}{left}", file=sys.stderr, flush=True)

        yield line
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    progress = Progress(*columns, console=console)
    task = progress.add_task(title, total=None)
    # The count and the time left are never cut for the sake of a long name.
    room = max(0, console.width - len(title) - _BESIDE_THE_NAME)

    def bar(done: int, total: int, what: str) -> None:
        if time.monotonic() - begun >= after:
            progress.start()
        progress.update(task, completed=done, total=total, description=f"{title}: {shortened(what, room)}")

    try:
        if not after:
            progress.start()
        yield bar
    finally:
        # To stop what never began would leave an empty line.
        if progress.live.is_started:
            progress.stop()


def shortened(text: str, room: int) -> str:
    """The end of a name, which tells it from its neighbours, in so many characters."""
    return text if len(text) <= room else f"…{text[len(text) - room + 1 :]}" if room > 1 else ""
