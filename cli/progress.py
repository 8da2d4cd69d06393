"""Progress of work that takes long: bars on a terminal; elsewhere plain lines, the first at once, then ever fewer.

All on standard error: what a command says on standard output goes into files and other programs.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from typing import Any

# A line after so many seconds, and then each time a share more has passed, but at most so seldom.
_FIRST_S, _MORE, _SELDOM_S = 1.0, 0.5, 60.0


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

    from ..materials.intake.progress import in_words

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
