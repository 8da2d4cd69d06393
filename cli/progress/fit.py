"""Progress of `metamer fit`: what it is at, how far, and about how long it will take."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from typing import Any

from ...materials.intake.progress import Doing, Expected, in_words
from ...runtime.errors import visible
from ..output import shows_bars
from .lines import Ticker, left_column, say_line


class FitProgress:
    """A bar on a terminal; elsewhere lines on standard error, between those of the trials. Lives as long as `stack`."""

    def __init__(self, stack: ExitStack, material: str) -> None:
        self._material, self._expected = material, Expected({}, 1)
        self._doing = Doing(f"loading {visible(material)}")
        self._bar: Any = None
        if not shows_bars(sys.stdout):
            say_line(self._doing.phase)
            self._ticker = stack.enter_context(Ticker(self.line))
            return
        from rich import progress

        columns = (
            progress.SpinnerColumn(),
            progress.TextColumn("{task.description}", markup=False),
            progress.BarColumn(),
            progress.TimeElapsedColumn(),
            left_column(),
        )
        self._bar = stack.enter_context(progress.Progress(*columns, transient=True))
        self._task = self._bar.add_task(self._doing.phase, total=1.0, left=self._left)

    def begins(self, model: str) -> None:
        """The material is loaded: its fit begins."""
        self._expected = Expected({self._material: model}, 1)
        self.at("tabulating", 0.0)
        if self._bar is None:
            say_line(f"fitting {visible(self._material)}, about {in_words(self._expected.seconds_left)}")
            self._ticker.said()

    def at(self, phase: str, share: float) -> None:
        """Return the step of the fit, and the share that is done."""
        self._doing = Doing(phase, share)
        self._expected.at(self._material, self._doing)
        if self._bar is not None:
            self._bar.update(self._task, completed=share, description=phase)

    def say(self, text: str) -> None:
        """A line that stays, on standard output."""
        if self._bar is None:
            print(text, flush=True)
        else:
            self._bar.console.print(text, markup=False, highlight=False)

    def line(self) -> str:
        """Write the line of progress."""
        at_work = self._expected.at_work.get(self._material)
        if at_work is None:
            return f"still {self._doing.phase}"
        left = in_words(self._expected.seconds_left)
        return f"{self._doing.phase}, {in_words(at_work[0])} so far, about {left} left"

    def _left(self) -> float | None:
        return self._expected.seconds_left if self._expected.at_work else None
