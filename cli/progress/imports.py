"""Progress of `metamer catalogue import`: what is looked at, then what is fitted, how far, how long."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...materials.intake.progress import Doing, Expected, in_words
from ...runtime.errors import visible
from ..output import counted, end_of_name, shows_bars
from .lines import Ticker, left_column, say_line

if TYPE_CHECKING:
    from ...materials.intake.import_cost import Jobs
    from ...materials.intake.import_plan import PlannedMaterial
    from ...materials.intake.importing import ImportOutcome

# Cells of a name, and of what is done to it, beside bar, count and times.
_NAME, _PHASE = 28, 32
# The beginning of a fit that takes longer than this is worth a line.
_LONG_S = 10.0


class _Import:
    """State of a shown import: what the fits are expected to take, and how many are done."""

    def __init__(self) -> None:
        self._expected: Expected | None = None
        self._finished = self._pending = 0

    def _begun_with(self, pending: Sequence[PlannedMaterial], jobs: Jobs) -> Expected:
        self._pending = len(pending)
        self._expected = Expected({material.id: material.model for material in pending}, jobs.count)
        return self._expected

    def _done(self, outcome: ImportOutcome) -> bool:
        """Return whether it is one of those that were begun."""
        if self._expected is None or outcome.id not in self._expected.pending:
            return False
        self._expected.done(outcome.id, outcome.seconds)
        self._finished += 1
        return True


class PlainImport(_Import):
    """Lines: what is begun, every material that is finished, and from time to time where each process is."""

    def __init__(self, stack: ExitStack, sources: Sequence[str | Path]) -> None:
        super().__init__()
        self._sources = ", ".join(visible(str(source)) for source in sources)
        self._begun, self._looked, self._total = time.monotonic(), 0, 0
        # The file that is looked at, and what is done to it.
        self._at: dict[str, str] = {}
        say_line(f"looking at {self._sources}")
        self._ticker = stack.enter_context(Ticker(self.line))

    def looked_at(self, done: int, total: int, name: str) -> None:
        """After each file."""
        self._looked, self._total, self._at = done, total, {}

    def begins(self, pending: Sequence[PlannedMaterial], jobs: Jobs) -> None:
        """Before the first fit."""
        expected = self._begun_with(pending, jobs)
        if jobs.why:
            say_line(jobs.why)
        if pending:
            processes = f"{jobs.count} processes" if jobs.count > 1 else "one process"
            left = in_words(expected.seconds_left)
            say_line(f"fitting {counted(len(pending), 'material')} in {processes}, about {left}")
            self._ticker.said()

    def doing(self, material_id: str, doing: Doing) -> None:
        """Show the step of a material; before the fits, of a file."""
        if self._expected is None:
            first, self._at = material_id not in self._at, {material_id: doing.phase}
            if first:
                say_line(f"{doing.phase}: {visible(material_id)}")
                self._ticker.said()
            return
        if material_id not in self._expected.at_work and self._expected.of(material_id) > _LONG_S:
            say_line(f"fitting {visible(material_id)}, about {in_words(self._expected.of(material_id))}")
            self._ticker.said()
        self._expected.at(material_id, doing)

    def progress(self, done: int, total: int, outcome: ImportOutcome) -> None:
        """After each material."""
        if outcome.status == "skipped":
            # It took no time: a line each would bury the others.
            return
        self._done(outcome)
        print(f"[{done}/{total}] {outcome.status} {visible(outcome.id)}", flush=True)

    def line(self) -> str:
        """Write the line of progress."""
        elapsed = time.monotonic() - self._begun
        if self._expected is None:
            at = "".join(f"; {phase}: {visible(name)}" for name, phase in self._at.items())
            if not self._looked:
                return f"looking at {self._sources}: {in_words(elapsed)} so far{at}"
            left = elapsed / self._looked * (self._total - self._looked)
            return f"looked at {self._looked} of {counted(self._total, 'file')}, about {in_words(left)} left{at}"
        at_work = [
            f"{visible(name)} ({doing.phase}, {in_words(seconds)} so far)"
            for name, (seconds, doing) in self._expected.at_work.items()
        ]
        if not at_work:
            return ""
        left = in_words(self._expected.seconds_left)
        return (
            f"{self._finished} of {counted(self._pending, 'material')} done, about {left} left; at {'; '.join(at_work)}"
        )


class BarImport(_Import):
    """Bars: the files, then the whole import with the time left, and a line for each process with what it is at."""

    def __init__(self, stack: ExitStack, sources: Sequence[str | Path]) -> None:
        from rich import progress
        from rich.console import Console

        super().__init__()
        text = progress.TextColumn("{task.description}", markup=False)
        columns = (text, progress.BarColumn(bar_width=20), progress.TextColumn("{task.fields[count]}", markup=False))
        times = (progress.TimeElapsedColumn(), left_column())
        self._bars: Any = stack.enter_context(
            progress.Progress(*columns, *times, console=Console(file=sys.stderr), transient=True)
        )
        what = end_of_name(", ".join(visible(str(source)) for source in sources), _NAME + _PHASE)
        self._whole = self._bars.add_task(f"looking at {what}", total=None, count="", left=None)
        self._rows: dict[str, Any] = {}

    def looked_at(self, done: int, total: int, name: str) -> None:
        """After each file."""
        said = f"looking at {end_of_name(visible(Path(name).name), _NAME)}"
        self._bars.update(self._whole, completed=done, total=total, description=said, count=f"{done}/{total}")

    def begins(self, pending: Sequence[PlannedMaterial], jobs: Jobs) -> None:
        """Before the first fit."""
        expected = self._begun_with(pending, jobs)
        if jobs.why:
            self._bars.console.print(jobs.why, markup=False, highlight=False)
        self._bars.remove_task(self._whole)
        self._whole = self._bars.add_task(
            "fitting",
            total=len(pending),
            count=f"0/{len(pending)}",
            left=lambda: expected.seconds_left,
            visible=bool(pending),
        )

    def doing(self, material_id: str, doing: Doing) -> None:
        """Show the step of a material."""
        if self._expected is None:
            name = end_of_name(visible(Path(material_id).name), _NAME)
            self._bars.update(self._whole, description=f"{doing.phase}: {name}")
            return
        self._expected.at(material_id, doing)
        if material_id not in self._rows:
            self._rows[material_id] = self._bars.add_task("", total=1.0, count="", left=None)
        said = f"  {end_of_name(visible(material_id), _NAME)}: {doing.phase[:_PHASE]}"
        self._bars.update(self._rows[material_id], completed=doing.share, description=said)

    def progress(self, done: int, total: int, outcome: ImportOutcome) -> None:
        """After each material."""
        if not self._done(outcome):
            return
        if (row := self._rows.pop(outcome.id, None)) is not None:
            self._bars.remove_task(row)
        self._bars.update(self._whole, completed=self._finished, count=f"{self._finished}/{self._pending}")


def import_shown(stack: ExitStack, sources: Sequence[str | Path]) -> PlainImport | BarImport:
    """Bars where standard error is a terminal, else lines; they live as long as `stack`."""
    return (BarImport if shows_bars(sys.stderr) else PlainImport)(stack, sources)
