"""Progress of `metamer catalogue import`: examined files, then fits, with fraction done and time left."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...materials.intake.progress import Doing, fit_seconds
from ...runtime.errors import visible
from ...runtime.progress import TimeLeft
from ...runtime.wording import counted, in_words
from ..output import end_of_name, shows_bars
from .lines import Ticker, left_column, say_line

if TYPE_CHECKING:
    from ...materials.intake.import_cost import Jobs
    from ...materials.intake.import_plan import PlannedFile, PlannedMaterial
    from ...materials.intake.importing import ImportOutcome

# Cells of a name, and of what is done to it, beside bar, count and times.
_NAME, _PHASE = 28, 32
# The beginning of a fit that takes longer than this is worth a line.
_LONG_S = 10.0
# Seconds of a file that is looked at, beside those of fits; and the most that fits say of themselves.
_LOOKING_S, _NEARLY = 0.2, 0.99
# Items of the work: what is done first, and fits of files that were not looked at yet.
_LOOKING, _FURTHER = "looking", "further fits"


class _Import:
    """State of a displayed import: examined files, finished and running fits, and the total time left."""

    def __init__(self) -> None:
        self._left = TimeLeft()
        self._pending: dict[str, str] | None = None
        self._finished = self._looked = self._total = 0
        # Seconds that fits so far are expected to take.
        self._fits = 0.0
        # Step of each material that is fitted, and when it began.
        self._at_work: dict[str, tuple[float, Doing]] = {}

    def _looked_at(self, done: int, total: int, file: PlannedFile) -> None:
        """Extrapolate the number of fits to the remaining files."""
        if not self._looked:
            self._left.expect_stage(_LOOKING, _LOOKING_S * total)
        self._looked, self._total = done, total
        self._left.heard(done, total, _LOOKING)
        for material in file.materials:
            if material.status == "new":
                self._fits += fit_seconds(material.model)
                self._left.expect(material.id, material.model, fit_seconds(material.model), evenly=True)
        self._left.expect(_FURTHER, _FURTHER, self._fits * (total - done) / done)

    def _begun_with(self, pending: Sequence[PlannedMaterial], jobs: Jobs) -> None:
        self._pending, self._left.jobs = {material.id: material.model for material in pending}, jobs.count
        for material in pending:
            if material.id not in self._left:
                self._left.expect(material.id, material.model, fit_seconds(material.model), evenly=True)
        self._left.expect(_FURTHER, _FURTHER, 0.0)

    def _at(self, material_id: str, doing: Doing) -> bool:
        """Record the current step of a material; returns whether it is the first one."""
        first = material_id not in self._at_work
        begun = time.monotonic() if first else self._at_work[material_id][0]
        self._at_work[material_id] = begun, doing
        if material_id in self._left:
            self._left.at(material_id, min(doing.share, _NEARLY))
        return first

    def _done(self, outcome: ImportOutcome) -> bool:
        """Return whether the material was one of those begun."""
        self._at_work.pop(outcome.id, None)
        if outcome.id in self._left:
            self._left.done(outcome.id, outcome.seconds)
        if self._pending is None or outcome.id not in self._pending:
            return False
        self._finished += 1
        return True


class PlainImport(_Import):
    """Progress as lines: starts, every finished material, and from time to time the state of each process."""

    def __init__(self, stack: ExitStack, sources: Sequence[str | Path]) -> None:
        super().__init__()
        self._sources = ", ".join(visible(str(source)) for source in sources)
        self._begun = time.monotonic()
        # The file that is looked at, and what is done to it.
        self._reading: dict[str, str] = {}
        say_line(f"looking at {self._sources}")
        self._ticker = stack.enter_context(Ticker(self.line))

    def looked_at(self, done: int, total: int, file: PlannedFile) -> None:
        """Update after each file."""
        self._looked_at(done, total, file)
        self._reading = {}

    def begins(self, pending: Sequence[PlannedMaterial], jobs: Jobs) -> None:
        """Update before the first fit."""
        self._begun_with(pending, jobs)
        if jobs.why:
            say_line(jobs.why)
        if pending:
            processes = f"{jobs.count} processes" if jobs.count > 1 else "one process"
            say_line(f"fitting {counted(len(pending), 'material')} in {processes}{self._time_left()}")
            self._ticker.said()

    def doing(self, material_id: str, doing: Doing) -> None:
        """Show the step of a material; before the fits, of a file."""
        if self._pending is None:
            first, self._reading = material_id not in self._reading, {material_id: doing.phase}
            if first:
                say_line(f"{doing.phase}: {visible(material_id)}")
                self._ticker.said()
            return
        if self._at(material_id, doing) and fit_seconds(self._pending.get(material_id, "")) > _LONG_S:
            say_line(f"fitting {visible(material_id)}")
            self._ticker.said()

    def progress(self, done: int, total: int, outcome: ImportOutcome) -> None:
        """Update after each material."""
        if outcome.status == "skipped":
            # It took no time: a line each would bury the others.
            return
        self._done(outcome)
        print(f"[{done}/{total}] {outcome.status} {visible(outcome.id)}", flush=True)

    def line(self) -> str:
        """Write the line of progress."""
        now = time.monotonic()
        if self._pending is None:
            at = "".join(f"; {phase}: {visible(name)}" for name, phase in self._reading.items())
            if not self._looked:
                return f"looking at {self._sources}: {in_words(now - self._begun)} so far{at}"
            return f"looked at {self._looked} of {counted(self._total, 'file')}{self._time_left(' left')}{at}"
        at_work = [
            f"{visible(name)} ({doing.phase}, {in_words(now - begun)} so far)"
            for name, (begun, doing) in list(self._at_work.items())
        ]
        if not at_work:
            return ""
        done = f"{self._finished} of {counted(len(self._pending), 'material')} done"
        return f"{done}{self._time_left(' left')}; at {'; '.join(at_work)}"

    def _time_left(self, left: str = "") -> str:
        seconds = self._left.seconds
        return "" if seconds is None else f", about {in_words(seconds)}{left}"


class BarImport(_Import):
    """Progress as bars: the files, then the whole import with the time left, and a line per process with its step."""

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
        self._whole = self._bars.add_task(f"looking at {what}", total=None, count="", left=self._seconds)
        self._rows: dict[str, Any] = {}

    def looked_at(self, done: int, total: int, file: PlannedFile) -> None:
        """Update after each file."""
        self._looked_at(done, total, file)
        said = f"looking at {end_of_name(visible(Path(file.name).name), _NAME)}"
        self._bars.update(self._whole, completed=done, total=total, description=said, count=f"{done}/{total}")

    def begins(self, pending: Sequence[PlannedMaterial], jobs: Jobs) -> None:
        """Update before the first fit."""
        self._begun_with(pending, jobs)
        if jobs.why:
            self._bars.console.print(jobs.why, markup=False, highlight=False)
        self._bars.remove_task(self._whole)
        self._whole = self._bars.add_task(
            "fitting",
            total=len(pending),
            count=f"0/{len(pending)}",
            left=self._seconds,
            visible=bool(pending),
        )

    def doing(self, material_id: str, doing: Doing) -> None:
        """Show the step of a material."""
        if self._pending is None:
            name = end_of_name(visible(Path(material_id).name), _NAME)
            self._bars.update(self._whole, description=f"{doing.phase}: {name}")
            return
        if self._at(material_id, doing):
            self._rows[material_id] = self._bars.add_task("", total=1.0, count="", left=lambda: None)
        said = f"  {end_of_name(visible(material_id), _NAME)}: {doing.phase[:_PHASE]}"
        self._bars.update(self._rows[material_id], completed=doing.share, description=said)

    def progress(self, done: int, total: int, outcome: ImportOutcome) -> None:
        """Update after each material."""
        if not self._done(outcome):
            return
        if (row := self._rows.pop(outcome.id, None)) is not None:
            self._bars.remove_task(row)
        self._bars.update(self._whole, completed=self._finished, count=f"{self._finished}/{len(self._pending or ())}")

    def _seconds(self) -> float | None:
        return self._left.seconds


def import_shown(stack: ExitStack, sources: Sequence[str | Path]) -> PlainImport | BarImport:
    """Return bars if standard error is a terminal, else lines; they exist as long as `stack`."""
    return (BarImport if shows_bars(sys.stderr) else PlainImport)(stack, sources)
