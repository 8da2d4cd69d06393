"""From sources to a catalogue: each material is fitted in a process of its own, and written whole or not at all."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Future, as_completed
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np

from ..spectral.errors import InputError, MetamerError
from ..spectral.files import made_folder, written_whole
from ..spectral.processes import usable_cores, worker_pool
from ..spectral.upsampling import DEFAULT_METHOD
from .factors import FactorPack, FitError
from .record import MARKER, SCHEMA, SUFFIX, MaterialRecord, read_source_hash, rebuild, write_record
from .sources import MaterialSource, Rejected, read_sources

# ΔE94, 99th percentile: half of what a review accepts, since a picture adds errors of its own.
DEFAULT_BUDGET = 0.5
# The code that every fit depends on, beside that of its model: when it changes, materials are fitted again.
FIT_CODE = ("brdf", "cp", "directions", "factors", "fit", "grids", "protocol", "tabulated", "tucker")
# Models that are no formula, and the code that each of them depends on.
MEASURED_CODE = {
    "scattered": ("scattered", "kriging", "measurement", "lookup"),
    "merl": ("merl", "lookup", "../spectral/upsampling"),
    "rgl": ("rgl", "bilinear_warp", "../spectral/upsampling"),
    "fluorescent_lambert": ("fluorescent", "../spectral/bispectral"),
}


@dataclass(frozen=True)
class ImportOutcome:
    """What became of one material; "new" is what a dry run says of those that it would import."""

    id: str
    status: Literal["imported", "skipped", "failed", "new"]
    reason: str = ""
    error: FitError | None = None
    seconds: float = 0.0


Progress = Callable[[int, int, ImportOutcome], None]


@dataclass(frozen=True)
class ImportReport:
    """Outcomes in the order in which they came, and how many materials were never reached."""

    folder: Path
    outcomes: tuple[ImportOutcome, ...]
    remaining: int = 0

    def count(self, status: str) -> int:
        """Materials with that status."""
        return sum(outcome.status == status for outcome in self.outcomes)

    @property
    def sentence(self) -> str:
        """What was done, for a person."""
        words = {"new": "to import", "imported": "imported", "skipped": "unchanged", "failed": "failed"}
        said = ", ".join(f"{self.count(status)} {word}" for status, word in words.items() if self.count(status))
        said = f"{self.folder}: {said or 'nothing imported'}"
        if self.remaining:
            said += f"; stopped with {self.remaining} to go, and the same command goes on from here"
        return said


class ImportInterrupted(KeyboardInterrupt):
    """Ctrl-C during an import. `report` says what is in the catalogue; a second run does the rest."""

    def __init__(self, report: ImportReport) -> None:
        super().__init__(report.sentence)
        self.report = report


def import_sources(
    sources: Iterable[str | Path],
    into: str | Path,
    *,
    jobs: int | None = None,
    budget: float = DEFAULT_BUDGET,
    dry_run: bool = False,
    progress: Progress | None = None,
    uplift: str = DEFAULT_METHOD,
) -> ImportReport:
    """Fit every material of `sources` and store it in the catalogue folder `into`, which is made where it is missing.

    What is already there, from the same source and settings, is skipped. A material that cannot be read or fitted is
    reported as failed and does not stop the others.

    Parameters
    ----------
    sources : source folders, family descriptions (.toml), measured files (.brdf, .binary), bispectral pictures (.exr).
    jobs : processes; default one a core. Several need a `__main__` that can be imported again (see `multiprocessing`).
    budget : ΔE94 (99th percentile on the sphere) that a fit aims at; what it reached is in each outcome's `error`.
    progress : called with (done, total, outcome) after each material.
    uplift : how spectra are made for what was measured in RGB; one of `spectral.upsampling.METHODS`.

    Raises
    ------
    InputError
        A source that does not exist, a folder that cannot be written to.
    ImportInterrupted
        Ctrl-C: finished materials stay, no half-written file does.
    """
    folder = Path(into)
    found = [material for source in sources for material in read_sources(source, uplift)]
    pending: list[tuple[MaterialSource, str]] = []
    outcomes: list[ImportOutcome] = []

    def tell(outcome: ImportOutcome) -> None:
        outcomes.append(outcome)
        if progress is not None:
            progress(len(outcomes), len(found), outcome)

    if not dry_run:
        _mark(folder)
    try:
        seen: dict[str, Path] = {}
        for material in found:
            if isinstance(material, Rejected):
                tell(ImportOutcome(material.name, "failed", str(material.reason)))
            elif material.id in seen:
                tell(
                    ImportOutcome(material.id, "failed", f"the id is used twice: {seen[material.id]}, {material.file}")
                )
            else:
                seen[material.id] = material.file
                source_hash = _source_hash(material, budget)
                if read_source_hash(_path(folder, material.id)) == source_hash:
                    tell(ImportOutcome(material.id, "skipped"))
                elif dry_run:
                    tell(ImportOutcome(material.id, "new"))
                else:
                    pending.append((material, source_hash))
        # The longest fits first, so that no process works alone at the end; more numbers are a fair guess at longer.
        pending.sort(key=lambda item: -sum(np.size(value) for value in item[0].parameters.values()))
        for (material, source_hash), fitted in _fit_all(pending, budget, jobs or usable_cores()):
            tell(_store(folder, material, source_hash, fitted))
    except KeyboardInterrupt:
        report = ImportReport(folder, tuple(outcomes), len(found) - len(outcomes))
        raise ImportInterrupted(report) from None
    return ImportReport(folder, tuple(outcomes))


@dataclass(frozen=True)
class _Fitted:
    """What comes back from a process: packs and their error, or why there are none."""

    packs: tuple[FactorPack, ...]
    error: FitError | None
    seconds: float
    reason: str = ""


def _fit_one(material: MaterialSource, budget: float) -> _Fitted:
    from .fit import fit
    from .fluorescent import FluorescentLambert

    start = time.perf_counter()
    try:
        brdf = rebuild(material.model, material.parameters)
        if isinstance(brdf, FluorescentLambert):
            packs, error = brdf.measured_packs()
            return _Fitted(packs, error, time.perf_counter() - start)
        result = fit(brdf, budget=budget)
        return _Fitted(result.packs, result.error, time.perf_counter() - start)
    except MetamerError as reason:
        return _Fitted((), None, time.perf_counter() - start, str(reason))
    except (ArithmeticError, ValueError, MemoryError) as reason:
        return _Fitted((), None, time.perf_counter() - start, f"the fit broke down: {type(reason).__name__}: {reason}")


def _fit_all(
    pending: Sequence[tuple[MaterialSource, str]], budget: float, jobs: int
) -> Iterator[tuple[tuple[MaterialSource, str], _Fitted]]:
    jobs = min(jobs, len(pending))
    if jobs <= 1:
        for item in pending:
            yield item, _fit_one(item[0], budget)
        return
    with worker_pool(jobs) as pool:
        futures = {pool.submit(_fit_one, item[0], budget): item for item in pending}
        for future in as_completed(futures):
            yield futures[future], _result(future)


def _result(future: Future[_Fitted]) -> _Fitted:
    try:
        return future.result()
    except BrokenExecutor:
        reason = "the process that fitted it ended abruptly, as it does when memory runs out; try --jobs 1"
        return _Fitted((), None, 0.0, reason)


def _store(folder: Path, material: MaterialSource, source_hash: str, fitted: _Fitted) -> ImportOutcome:
    if not fitted.packs:
        return ImportOutcome(material.id, "failed", fitted.reason, seconds=fitted.seconds)
    record = MaterialRecord(
        material.id,
        material.family,
        material.model,
        material.parameters,
        material.provenance,
        fitted.packs,
        fitted.error,
        source_hash,
    )
    write_record(record, _path(folder, material.id))
    return ImportOutcome(material.id, "imported", "", fitted.error, fitted.seconds)


def _source_hash(material: MaterialSource, budget: float) -> str:
    settings = f"{material.content_hash}|schema {SCHEMA}|budget {budget!r}|code {_code_hash(material.model)}"
    return hashlib.sha256(settings.encode()).hexdigest()


@cache
def _code_hash(model: str) -> str:
    here = Path(__file__).parent
    own = MEASURED_CODE.get(model, (f"analytic/{model}", "analytic/model"))
    return hashlib.sha256(b"".join((here / f"{module}.py").read_bytes() for module in (*FIT_CODE, *own))).hexdigest()


def _path(folder: Path, material_id: str) -> Path:
    return folder / f"{material_id}{SUFFIX}"


def _mark(folder: Path) -> None:
    """Make the folder and say in it that it is a catalogue."""
    made_folder(folder)
    if (folder / MARKER).exists():
        return
    # Hidden files may be another import's, at work or broken off.
    strangers = [entry.name for entry in folder.iterdir() if not entry.name.startswith(".")]
    if strangers:
        hint = "name an empty or a new folder: --into FOLDER"
        raise InputError("not a catalogue", file=folder, found=f"other files, such as {strangers[0]}", hint=hint)
    with written_whole(folder / MARKER) as beside:
        beside.write_text(f"# One HDF5 file a material; read it with metamer, or with h5py.\nschema = {SCHEMA}\n")
