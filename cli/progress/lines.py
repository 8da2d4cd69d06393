"""Progress of long work: bars on a terminal; elsewhere plain lines, the first at once, then less and less often.

All on standard error, since standard output goes into files and other programs.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from ...runtime.progress import TimeLeft
from ...runtime.wording import in_words
from ..output import end_of_name, shows_bars

# A line after so many seconds, and then each time a share more has passed, but at most so seldom.
_FIRST_S, _MORE, _SELDOM_S = 1.0, 0.5, 60.0
# Cells that bar, count, time left and the gaps between them take on a line of progress.
_BESIDE_THE_NAME = 34
# Seconds below which no time left is told.
_QUICK_S = 2.0


class Ticker:
    """Periodic report of progress: `line()` returns the words, "" for none.

    Reports are skipped shortly after other output (`said`).
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
        """Record other output."""
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
    """Return the seconds until the next line: short at first, as a sign of life, and a minute in the end.

    >>> next_pause(1.0), next_pause(10.0), next_pause(1000.0)
    (1.0, 5.0, 60.0)
    """
    return min(max(_FIRST_S, _MORE * elapsed), _SELDOM_S)


def left_column() -> Any:
    """Return a column of a bar for the time left, by calling the task's field `left`."""
    from rich.progress import ProgressColumn, Task
    from rich.text import Text

    class Left(ProgressColumn):
        max_refresh = 0.5

        def render(self, task: Task) -> Text:
            seconds: float | None = task.fields["left"]()
            return Text("" if seconds is None or task.finished else f"about {in_words(seconds)} left")

    return Left()


def say_line(line: str) -> None:
    """Write a whole line at once, which output of other processes cannot split."""
    sys.stderr.write(line + "\n")
    sys.stderr.flush()


@contextmanager
def progress_bar(
    title: str,
    *,
    quiet: bool = False,
    after: float = 0.0,
    stages: Iterable[tuple[str, float]] = (),
    work: TimeLeft | None = None,
) -> Iterator[Callable[[int, int, str], None]]:
    """Yield a callback that shows progress on standard error.

    On a terminal a live bar with the time left; elsewhere a line every tenth of the way, and now and then in between;
    nothing if `quiet`, nor in the first `after` seconds.

    stages : of `TimeLeft`, whose total time left is shown. work : source of the time left in place of the counts;
    updated elsewhere.
    """
    if quiet:
        yield lambda *_: None
        return
    counting = TimeLeft(stages)
    shown = _bar if shows_bars(sys.stderr) else _lines
    with shown(title, work or counting, after) as show:

        def heard(done: int, total: int, what: str) -> None:
            show(done, total, what, counting.heard(done, total, what))

        yield heard


Show = Callable[[int, int, str, bool], None]


@contextmanager
def _lines(title: str, work: TimeLeft, after: float) -> Iterator[Show]:
    begun, tenths, counted = time.monotonic(), -1, ""

    def line() -> str:
        elapsed = time.monotonic() - begun
        seconds = work.seconds if elapsed > _QUICK_S else None
        words = f", about {in_words(seconds)} left" if seconds else ""
        return f"{title}: {counted}{words}" if counted and elapsed >= after else ""

    with Ticker(line) as ticker:

        def show(done: int, total: int, what: str, anew: bool) -> None:
            nonlocal tenths, counted
            counted, tenths = f"{done}/{total} {what}", -1 if anew else tenths
            if done * 10 // total > tenths and (said := line()):
                tenths = done * 10 // total
                say_line(said)
                ticker.said()

        yield show


@contextmanager
def _bar(title: str, work: TimeLeft, after: float) -> Iterator[Show]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), left_column())
    begun, console = time.monotonic(), Console(stderr=True)
    progress = Progress(*columns, console=console)
    task = progress.add_task(title, total=None, left=lambda: work.seconds)
    # The count and the time left are never cut for the sake of a long name.
    room = max(0, console.width - len(title) - _BESIDE_THE_NAME)

    def show(done: int, total: int, what: str, anew: bool) -> None:
        if time.monotonic() - begun >= after:
            progress.start()
        progress.update(task, completed=done, total=total, description=f"{title}: {end_of_name(what, room)}")

    try:
        if not after:
            progress.start()
        yield show
    finally:
        # To stop what never began would leave an empty line.
        if progress.live.is_started:
            progress.stop()
