"""Progress of work that takes long: bars on a terminal; elsewhere plain lines, the first at once, then ever fewer.

All on standard error: what a command says on standard output goes into files and other programs.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from ..output import shortened, shows_bars

# A line after so many seconds, and then each time a share more has passed, but at most so seldom.
_FIRST_S, _MORE, _SELDOM_S = 1.0, 0.5, 60.0
# Cells that bar, count, time left and the gaps between them take on a line of progress.
_BESIDE_THE_NAME = 34
# Before this share of the work is done, its beginning, which is slow, says little of the rest.
_TELLING = 0.1


class Ticker:
    """Says where the work is from time to time, whatever it is at: `line()` gives the words, "" for nothing to say.

    Nothing is said where something else was within the last moment (`said`).
    """

    def __init__(self, line: Callable[[], str]) -> None:
        self._line = line
        self._ended = threading.Event()
        self._last = time.monotonic()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Ticker:
        self._thread.start()
        return self

    def __exit__(self, *reason: object) -> None:
        self._ended.set()

    def said(self) -> None:
        """Something has been said elsewhere."""
        self._last = time.monotonic()

    def _run(self) -> None:
        begun = time.monotonic()
        pause = _FIRST_S
        while not self._ended.wait(pause):
            pause = next_pause(time.monotonic() - begun)
            if time.monotonic() - self._last >= min(pause, _FIRST_S) and (line := self._line()):
                say_line(line)
                self.said()


def next_pause(elapsed: float) -> float:
    """Seconds until the next line: short at first, so that nobody waits for a sign, and a minute in the end.

    >>> next_pause(1.0), next_pause(10.0), next_pause(1000.0)
    (1.0, 5.0, 60.0)
    """
    return min(max(_FIRST_S, _MORE * elapsed), _SELDOM_S)


def left_column() -> Any:
    """A column of a bar for the time left: what the task's field `left` says when it is called, else its own speed."""
    from rich.progress import ProgressColumn, Task
    from rich.text import Text

    from ...materials.intake.progress import in_words

    class Left(ProgressColumn):
        max_refresh = 0.5

        def render(self, task: Task) -> Text:
            seconds_left: Callable[[], float | None] | None = task.fields.get("left")
            seconds = seconds_left() if seconds_left is not None else task.time_remaining
            return Text("" if seconds is None or task.finished else f"about {in_words(seconds)} left")

    return Left()


def say_line(line: str) -> None:
    """A whole line at once, which no other process's cuts in two."""
    sys.stderr.write(line + "\n")
    sys.stderr.flush()


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
        from ...materials.intake.progress import in_words

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
