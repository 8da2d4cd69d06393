"""Import of sources into a catalogue: plan, work, report. Each material is written whole or not at all."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal

from ...runtime.errors import InputError, NoRoomError
from ...runtime.files import half_written, made_folder
from ...runtime.locks import remove_abandoned
from ...runtime.remote import local_folder
from ...runtime.shutdown import saying
from ...runtime.worker_pool import Lost, Task, supervised
from ...spectral.formats.import_options import NO_ANSWER, ImportOptions
from ...spectral.upsampling import DEFAULT_METHOD
from ..core.fit_error import DEFAULT_BUDGET, FitError
from ..records.material import MaterialRecord
from ..records.record import MARKER, SUFFIX, check_marker, material_path, write_marker, write_record
from ..records.source import MaterialSource
from . import import_history
from .import_cost import Jobs, fit_too_large, jobs_for
from .import_history import Known
from .import_plan import LookedAt, PlannedFile, PlannedMaterial, Settings, planned
from .inputs import inputs_of
from .progress import Doing, Hears, in_bytes
from .sources import check_uplift, nothing_to_import
from .work import FitResult, fit_material

# An import writes no other files: what else is there is not its own to clear away.
_WRITTEN = (SUFFIX, Path(MARKER).suffix, Path(import_history.FILE).suffix)


@dataclass(frozen=True)
class ImportOutcome:
    """Outcome of one material; "new" in a dry run if it would be imported.

    file, format : its source.
    """

    id: str
    status: Literal["imported", "skipped", "failed", "new"]
    reason: str = ""
    error: FitError | None = None
    seconds: float = 0.0
    file: str = ""
    format: str = ""


Progress = Callable[[int, int, ImportOutcome], None]


@dataclass(frozen=True)
class ImportReport:
    """Outcomes in order of arrival, the number of materials never reached, and the examined files.

    stopped : why the rest was not reached, unless by Ctrl-C: the disk is full.
    """

    folder: Path
    outcomes: tuple[ImportOutcome, ...]
    remaining: int = 0
    files: tuple[PlannedFile, ...] = ()
    stopped: str = ""

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.sentence}>"

    def count(self, status: str) -> int:
        """Materials with that status."""
        return sum(outcome.status == status for outcome in self.outcomes)

    @property
    def not_recognised(self) -> tuple[str, ...]:
        """Names of the files in folders and archives that are of no known format."""
        return tuple(file.name for file in self.files if not file.materials)

    @property
    def sentence(self) -> str:
        """Summarise the import in a sentence."""
        words = {"new": "to import", "imported": "imported", "skipped": "skipped (already there)", "failed": "failed"}
        said = ", ".join(f"{self.count(status)} {word}" for status, word in words.items() if self.count(status))
        said = f"{self.folder}: {said or 'nothing imported'}"
        if self.not_recognised:
            count = len(self.not_recognised)
            said += f"; {count} {'file' if count == 1 else 'files'} not recognised"
        if self.remaining:
            said += f"; stopped with {self.remaining} to go, and the same command goes on from here"
        return said


class ImportInterrupted(KeyboardInterrupt):
    """Ctrl-C during an import. `report` lists the catalogue's new materials; a second run does the rest."""

    def __init__(self, report: ImportReport) -> None:
        super().__init__(report.sentence)
        self.report = report


def import_sources(
    sources: str | Path | Iterable[str | Path],
    into: str | Path,
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    budget: float = DEFAULT_BUDGET,
    dry_run: bool = False,
    progress: Progress | None = None,
    looked_at: LookedAt = lambda done, total, file: None,
    uplift: str = DEFAULT_METHOD,
    family: str | None = None,
    apart: bool = False,
    again: bool = False,
    begins: Callable[[Sequence[PlannedMaterial], Jobs], None] = lambda pending, jobs: None,
    doing: Callable[[str, Doing], None] = lambda material_id, doing: None,
    answer: ImportOptions = NO_ANSWER,
    broken_off: Callable[[ImportReport], None] = lambda report: None,
    copy: bool = False,
) -> ImportReport:
    """Fit every material of `sources` and store it in the catalogue folder `into`, which is made if missing.

    Materials that exist already, from the same source and settings, are skipped. A material that cannot be read or
    fitted is reported as failed and does not stop the others; a full disk does, and the report says so.

    Parameters
    ----------
    sources : files, folders, patterns, zip files and addresses of fsspec, as `inputs.inputs_of` takes them; one or
        several.
    jobs : processes; default one a core, as far as memory goes. 1 works in this process, unless `apart`.
    apart : fit in other processes, also in one alone. They have one thread of BLAS each, which decides the last bits of
        a fit; and memory that runs out ends them, not this one.
    scheduler : address of a Dask scheduler, whose workers then do the work; needs the extra `cluster`.
    budget : ΔE94 (99th percentile on the sphere) that a fit aims at; the result is in each outcome's `error`.
    progress : called with (done, total, outcome) after each material.
    looked_at : called with (done, total, file) after each file that was looked at, before anything is fitted.
    uplift : upsampling of RGB measurements to spectra; one of `spectral.upsampling.METHODS`.
    family : replaces the family of every material.
    again : fit and write existing materials, too, which repairs damaged files.
    begins : called with the materials to be fitted and the number of processes, before the first is read.
    doing : called with (id, current work) whenever that changes; while files are examined, with the name of one that
        takes long to read.
    answer : the measured quantity and scale, for files that do not state them.
    copy : copy large arrays that lie in files into the catalogue; else they stay where they are, and the record knows
        them by place and hash. Those of archives and remote addresses are always copied.
    broken_off : receives the report if a signal ends the process (`runtime.shutdown`); elsewhere Ctrl-C raises.

    Raises
    ------
    InputError
        A source that does not exist, a folder that cannot be written to, a scheduler that cannot be reached.
        ImportInterrupted Ctrl-C: finished materials stay, no half-written file does.
    """
    # Taken letter by letter, the path of a file would begin with "/", and all of the disk be looked through.
    sources = [sources] if isinstance(sources, (str, Path)) else list(sources)
    folder, settings = local_folder(into, "an import"), Settings(budget, uplift, family, again, answer, copy)
    check_uplift(uplift)
    with ExitStack() as stack:
        known = Known.of(folder)
        files = planned(stack.enter_context(inputs_of(sources)), folder, settings, looked_at, known, doing)
        if not any(file.materials for file in files):
            raise nothing_to_import(", ".join(map(str, sources)), len(files))
        if not dry_run:
            prepare_folder(folder)
            stack.callback(known.save)
            # Also now: an import that is ended in the middle has looked at its files.
            known.save()
        # From here on an interrupt leaves a catalogue, and a report.
        tally = _Tally(folder, files, progress)

        def last_words() -> str:
            broken_off(tally.report())
            return f"{tally.report().sentence}."

        stack.enter_context(saying(last_words))
        try:
            pending = tally.all_but_new()
            if dry_run:
                for material in pending:
                    tally.count(material, ImportOutcome(material.id, "new"))
                return tally.report()
            # The longest fits first, so that no process works alone at the end; more numbers are a guess at longer.
            pending.sort(key=lambda material: -material.size - material.stored)
            if scheduler:
                begins(pending, Jobs(1))
                work = _on_cluster(pending, budget, scheduler, doing)
            else:
                pending = tally.all_that_fit(pending)
                processes = jobs_for([material.size for material in pending], jobs)
                begins(pending, processes)
                work = _here(pending, budget, processes.count, apart, doing)
            # End the workers at once if the caller stops, by Ctrl-C too.
            with closing(work):
                for material, source, fitted in work:
                    outcome = _stored(folder, material, source, fitted, partial(doing, material.id))
                    if outcome.status == "imported" and (material.copy or not material.stored):
                        known.wrote(material.id, material.source_hash)
                    tally.count(material, outcome)
        except NoRoomError as reason:
            return tally.report(str(reason))
        except KeyboardInterrupt:
            raise ImportInterrupted(tally.report()) from None
        return tally.report()


class _Tally:
    """Outcomes so far, and the callbacks for them."""

    def __init__(self, folder: Path, files: tuple[PlannedFile, ...], progress: Progress | None) -> None:
        self.folder, self.files, self.progress = folder, files, progress
        self.outcomes: list[ImportOutcome] = []
        self.file_of = {id(material): file for file in files for material in file.materials}

    def count(self, material: PlannedMaterial, outcome: ImportOutcome) -> None:
        file = self.file_of[id(material)]
        known_outcome = ImportOutcome(
            outcome.id, outcome.status, outcome.reason, outcome.error, outcome.seconds, file.name, file.format
        )
        self.outcomes.append(known_outcome)
        if self.progress is not None:
            self.progress(len(self.outcomes), len(self.file_of), known_outcome)

    def all_but_new(self) -> list[PlannedMaterial]:
        """Report materials that need no work; return the rest."""
        new = []
        for file in self.files:
            for material in file.materials:
                if material.status == "new":
                    new.append(material)
                else:
                    self.count(material, ImportOutcome(material.id, material.status, material.reason))
        return new

    def all_that_fit(self, pending: Sequence[PlannedMaterial]) -> list[PlannedMaterial]:
        """Report materials whose fit exceeds the memory; return the rest."""
        fitting = []
        for material in pending:
            name = self.file_of[id(material)].name
            if (refusal := fit_too_large(material.size, name, material.id)) is None:
                fitting.append(material)
            else:
                self.count(material, ImportOutcome(material.id, "failed", str(refusal)))
        return fitting

    def report(self, stopped: str = "") -> ImportReport:
        remaining = len(self.file_of) - len(self.outcomes)
        return ImportReport(self.folder, tuple(self.outcomes), remaining, self.files, stopped)


Work = Generator[tuple[PlannedMaterial, MaterialSource | None, FitResult], None, None]


def _loaded(
    pending: Iterable[PlannedMaterial], doing: Callable[[str, Doing], None]
) -> Iterator[tuple[PlannedMaterial, MaterialSource | InputError]]:
    """Yield each material with its data, read on demand."""
    for material in pending:
        assert material.load is not None
        doing(material.id, Doing("reading"))
        try:
            yield material, material.load()
        except InputError as reason:
            yield material, reason


def _here(
    pending: Sequence[PlannedMaterial],
    budget: float,
    jobs: int,
    apart: bool,
    doing: Callable[[str, Doing], None],
) -> Work:
    """Yield results of processes of this machine, or of this one."""
    if not pending:
        return
    unread: list[tuple[PlannedMaterial, FitResult]] = []

    def tasks() -> Iterator[Task]:
        for material, source in _loaded(pending, doing):
            if isinstance(source, InputError):
                unread.append((material, FitResult(None, 0.0, str(source))))
            else:
                yield Task((material, source), (source, budget))

    if jobs <= 1 and not apart:
        for task in tasks():
            yield *task.key, fit_material(*task.arguments, say=partial(doing, task.key[0].id))
    else:
        with closing(supervised(fit_material, tasks(), jobs, lambda key, what: doing(key[0].id, what))) as results:
            for key, result in results:
                yield *key, FitResult(None, 0.0, result.reason) if isinstance(result, Lost) else result
    for material, fitted in unread:
        yield material, None, fitted


def _on_cluster(
    pending: Sequence[PlannedMaterial], budget: float, scheduler: str, doing: Callable[[str, Doing], None]
) -> Work:
    """Yield results of the workers of a Dask scheduler."""
    from .cluster import fitted_on_cluster

    yield from fitted_on_cluster(_loaded(pending, doing), budget, scheduler)


def _stored(
    folder: Path, material: PlannedMaterial, source: MaterialSource | None, fitted: FitResult, say: Hears
) -> ImportOutcome:
    if source is None or fitted.reason:
        return ImportOutcome(material.id, "failed", fitted.reason, seconds=fitted.seconds)
    provenance = source.provenance
    if fitted.fast is not None and fitted.fast.note:
        provenance = replace(provenance, notes=" + ".join(filter(None, (provenance.notes, fitted.fast.note))))
    source = source.heard(in_bytes("copying", source.stored, say))
    record = MaterialRecord(
        source.id,
        source.family,
        source.model,
        source.parameters,
        provenance,
        fitted.fast,
        material.source_hash,
        source.original,
        fitted.trials,
    )
    try:
        write_record(record, material_path(folder, material.id), copy=material.copy)
    except NoRoomError:
        raise
    except InputError as reason:
        return ImportOutcome(material.id, "failed", str(reason), seconds=fitted.seconds)
    return ImportOutcome(material.id, "imported", "", record.error, fitted.seconds)


def prepare_folder(folder: Path) -> None:
    """Make the folder, mark it as a catalogue, and remove leftovers of a killed import.

    Several imports may write to one folder at once: each locks its files, and nobody removes those.

    Raises
    ------
    InputError
        The folder cannot be made or written to, or holds something else.
    """
    made_folder(folder)
    _mark(folder)
    for stray in half_written(folder, _WRITTEN):
        remove_abandoned(stray)


def _mark(folder: Path) -> None:
    if (folder / MARKER).exists():
        check_marker(folder)
        return
    # Hidden files may be another import's, at work or broken off.
    strangers = [entry.name for entry in folder.iterdir() if not entry.name.startswith(".")]
    if strangers:
        hint = "name an empty or a new folder: --catalogue FOLDER"
        raise InputError("not a catalogue", file=folder, found=f"other files, such as {strangers[0]}", hint=hint)
    write_marker(folder)
