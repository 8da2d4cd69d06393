"""Progress of work that takes long: bars on a terminal; elsewhere plain lines, the first at once, then ever fewer.

All on standard error: what a command says on standard output goes into files and other programs.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from ..output import end_of_name, shows_bars

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
    """Return a column of a bar for the time left: what the task's field `left` says when it is called, else its own
    speed.
    """
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


class TimeLeft:
    """Estimate of the seconds until a command is done, from how fast its stages go.

    Work that is counted anew is the next stage. Its speed is that of the later half of what is done: what begins
    slowly, as tables are made and files are read for the first time, says little of the rest.

    stages : names of the stages to come and the seconds that each is expected to take, in their order. How those that
        are done compare with what was expected of them scales the others; some may be left out.
    """

    def __init__(self, stages: Sequence[tuple[str, float]] = ()) -> None:
        self._later = list(stages)
        # Seconds of the stages that are done, and what was expected of them; and of the one that is not.
        self._spent = self._expected = self._guess = 0.0
        self._total = 0
        self._heard = [(0, time.monotonic())]

    def heard(self, done: int, total: int, name: str) -> bool:
        """Take note that `done` of `total` steps of a stage are done; returns whether they are the first of it."""
        begins = total != self._total or done < self._heard[-1][0]
        if begins:
            self._begin(total, name)
        self._heard.append((done, time.monotonic()))
        return begins

    @property
    def seconds(self) -> float | None:
        """Seconds left; None while too little is done to tell."""
        done, spent = self._heard[-1][0], time.monotonic() - self._heard[0][1]
        telling = self._total > 0 and done >= _TELLING * self._total
        if not telling and not self._guess:
            return None
        rest = self._rest() if telling else 0.0
        known, expected = self._spent, self._expected
        if self._guess and 2 * done >= self._total > 0:
            known, expected = known + spent + rest, expected + self._guess
        scale = known / expected if expected > 0.0 else 1.0
        if not telling:
            rest = max(scale * self._guess - spent, 0.0)
        return rest + scale * sum(seconds for _, seconds in self._later)

    def _begin(self, total: int, name: str) -> None:
        """Begin a stage; nothing is expected any longer of those that it leaves out."""
        now = time.monotonic()
        if self._guess:
            self._spent, self._expected = self._spent + now - self._heard[0][1], self._expected + self._guess
        names = [one for one, _ in self._later]
        self._guess = 0.0
        if name in names:
            self._guess = self._later[names.index(name)][1]
            del self._later[: names.index(name) + 1]
        self._total, self._heard = total, [(0, now)]

    def _rest(self) -> float:
        """Seconds left of this stage, by the speed of the later half of what is done."""
        done, at = self._heard[-1]
        before, then = next(entry for entry in reversed(self._heard) if 2 * entry[0] <= done)
        rest = (at - then) / max(done - before, 1) * (self._total - done)
        return max(rest - (time.monotonic() - at), 0.0)


@contextmanager
def progress_bar(
    title: str, *, quiet: bool = False, after: float = 0.0, stages: Sequence[tuple[str, float]] = ()
) -> Iterator[Callable[[int, int, str], None]]:
    """A live bar with the time left on a terminal; elsewhere a line every tenth of the way; nothing where `quiet`, nor
    in the first `after` seconds. On standard error: what a command says on standard output goes into files and other
    programs. stages : of `TimeLeft`: the time left is that of all of them."""
    if quiet:
        yield lambda *_: None
        return
    begun, left = time.monotonic(), TimeLeft(stages)
    if not shows_bars(sys.stderr):
        from ...materials.intake.progress import in_words

        tenths = -1

        def line(done: int, total: int, what: str) -> None:
            nonlocal tenths
            tenths = -1 if left.heard(done, total, what) else tenths
            if done * 10 // total > tenths and time.monotonic() - begun >= after:
                tenths = done * 10 // total
                seconds = left.seconds if time.monotonic() - begun > 2.0 else None
                words = f", about {in_words(seconds)} left" if seconds else ""
                print(f"{title}: {done}/{total} {what}{words}", file=sys.stderr, flush=True)

        yield line
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), left_column())
    console = Console(stderr=True)
    progress = Progress(*columns, console=console)
    task = progress.add_task(title, total=None, left=lambda: left.seconds)
    # The count and the time left are never cut for the sake of a long name.
    room = max(0, console.width - len(title) - _BESIDE_THE_NAME)

    def bar(done: int, total: int, what: str) -> None:
        left.heard(done, total, what)
        if time.monotonic() - begun >= after:
            progress.start()
        progress.update(task, completed=done, total=total, description=f"{title}: {end_of_name(what, room)}")

    try:
        if not after:
            progress.start()
        yield bar
    finally:
        # To stop what never began would leave an empty line.
        if progress.live.is_started:
            progress.stop()
