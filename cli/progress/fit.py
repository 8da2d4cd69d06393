"""Progress of `metamer fit`: current step, fraction done, and estimated time left."""

from __future__ import annotations

import sys
import time
from contextlib import ExitStack
from typing import Any

from ...materials.intake.progress import Doing, fit_seconds
from ...runtime.errors import visible
from ...runtime.progress import TimeLeft
from ...runtime.wording import in_words
from ..output import shows_bars
from .lines import Ticker, left_column, say_line

# The most that a fit says of itself: what follows is not part of it.
_NEARLY = 0.99


class FitProgress:
    """Bar on a terminal; elsewhere lines on standard error, between those of the trials. Ends with `stack`."""

    def __init__(self, stack: ExitStack, material: str) -> None:
        self._material, self._left = material, TimeLeft()
        self._begun, self._doing = 0.0, Doing(f"loading {visible(material)}")
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
        self._task = self._bar.add_task(self._doing.phase, total=1.0, left=lambda: self._left.seconds)

    def begins(self, model: str) -> None:
        """Record that the material is loaded and its fit begins."""
        self._left.expect(self._material, model, fit_seconds(model), evenly=True)
        self._begun = time.monotonic()
        self.at("tabulating", 0.0)
        if self._bar is None:
            say_line(f"fitting {visible(self._material)}")
            self._ticker.said()

    def at(self, phase: str, share: float) -> None:
        """Record the step of the fit, and the fraction done."""
        self._doing = Doing(phase, share)
        self._left.at(self._material, min(share, _NEARLY))
        if self._bar is not None:
            self._bar.update(self._task, completed=share, description=phase)

    def say(self, text: str) -> None:
        """Print a permanent line on standard output."""
        if self._bar is None:
            print(text, flush=True)
        else:
            self._bar.console.print(text, markup=False, highlight=False)

    def line(self) -> str:
        """Write the line of progress."""
        if not self._begun:
            return f"still {self._doing.phase}"
        seconds = self._left.seconds
        left = "" if seconds is None else f", about {in_words(seconds)} left"
        return f"{self._doing.phase}, {in_words(time.monotonic() - self._begun)} so far{left}"
