"""The work of an import on a Dask cluster that is already there.

Each worker needs the same metamer as here: data go out with each task, packs come back, and only this process writes
files, so that no common file system is needed. A worker that dies costs what it was doing: the scheduler gives that to
another one, three times at most.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from ...runtime.dask_cluster import AHEAD, check_workers, connected, lost, scheduler_lost
from ...runtime.errors import InputError
from ..records.source import MaterialSource
from .code_version import code_hash
from .import_plan import PlannedMaterial
from .work import FitResult, fit_material

if TYPE_CHECKING:
    from distributed import Client


def fitted_on_cluster(
    pending: Iterator[tuple[PlannedMaterial, MaterialSource | InputError]], budget: float, scheduler: str
) -> Iterator[tuple[PlannedMaterial, MaterialSource | None, FitResult]]:
    """Yield each material with what the cluster made of it, as results come. Closing the iterator cancels the rest.

    Raises
    ------
    InputError
        Dask is not installed; no scheduler at the address; it has no workers; theirs is another metamer or Python; the
        scheduler is lost on the way.
    """
    client = connected(scheduler)
    try:
        check_workers(client, scheduler, _code)
        yield from _drained(client, pending, budget, scheduler)
    finally:
        # Work in progress is nobody's any more: closing releases every future, and the scheduler forgets it.
        client.close(timeout=5)


def _drained(
    client: Client,
    pending: Iterator[tuple[PlannedMaterial, MaterialSource | InputError]],
    budget: float,
    scheduler: str,
) -> Iterator[tuple[PlannedMaterial, MaterialSource | None, FitResult]]:
    from distributed import as_completed

    sent: dict[Any, tuple[PlannedMaterial, MaterialSource]] = {}
    finished = as_completed(loop=client.loop)
    while True:
        room = AHEAD * max(1, sum(client.nthreads().values()))
        while len(sent) < room and (item := next(pending, None)) is not None:
            material, source = item
            if isinstance(source, InputError):
                yield material, None, FitResult(None, 0.0, str(source))
                continue
            # A key of its own each time: what another import left on the scheduler is not taken for this one's result.
            future = client.submit(_checked_fit, source, budget, code_hash(source.model), pure=False, retries=1)
            sent[future] = material, source
            finished.add(future)
        if not sent:
            return
        future = next(finished)
        yield *sent.pop(future), _result(future, client, scheduler)
        future.release()


def _checked_fit(source: MaterialSource, budget: float, code: str) -> FitResult:
    """`fit_material`, where this worker has the same code: one may have joined after the first look at all of them."""
    if code_hash(source.model) != code:
        return FitResult(None, 0.0, "a worker of the cluster has another version of metamer; install the same one")
    return fit_material(source, budget)


def _result(future: Any, client: Client, scheduler: str) -> FitResult:
    from distributed import KilledWorker

    try:
        return future.result()
    except KilledWorker as reason:
        said = f"{reason.allowed_failures + 1} workers of the cluster died over it, as when memory runs out"
        return FitResult(None, 0.0, f"{said}; give each worker more memory, or fewer threads")
    except Exception as reason:
        if scheduler_lost(client, future):
            raise lost(scheduler) from None
        return FitResult(None, 0.0, f"the cluster gave no result: {type(reason).__name__}: {reason}")


def _code() -> str:
    """Hash the code that has to be equal here and there."""
    return code_hash("lambert")
