"""Execution of an import on an existing Dask cluster."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing

from ...runtime.dask_cluster import clustered
from ...runtime.errors import InputError
from ...runtime.worker_pool import Lost, Task
from ..records.source import MaterialSource
from .code_version import code_hash
from .import_plan import PlannedMaterial
from .work import FitResult, fit_material


def fitted_on_cluster(
    pending: Iterator[tuple[PlannedMaterial, MaterialSource | InputError]], budget: float, scheduler: str
) -> Iterator[tuple[PlannedMaterial, MaterialSource | None, FitResult]]:
    """Yield each material with its result from the cluster, as results arrive. Closing the iterator cancels the rest.

    Raises
    ------
    InputError : as `clustered` does.
    """
    unread: list[tuple[PlannedMaterial, InputError]] = []

    def tasks() -> Iterator[Task]:
        for material, source in pending:
            if isinstance(source, InputError):
                unread.append((material, source))
            else:
                yield Task((material, source), (source, budget, code_hash(source.model)))

    with closing(clustered(_checked_fit, tasks(), scheduler, _code)) as results:
        for (material, source), result in results:
            yield material, source, FitResult(None, 0.0, result.reason) if isinstance(result, Lost) else result
    for material, reason in unread:
        yield material, None, FitResult(None, 0.0, str(reason))


def _checked_fit(source: MaterialSource, budget: float, code: str) -> FitResult:
    """Run `fit_material`, if this worker has the same code for the material's model."""
    if code_hash(source.model) != code:
        return FitResult(None, 0.0, "a worker of the cluster has another version of metamer; install the same one")
    return fit_material(source, budget)


def _code() -> str:
    """Hash the code that must be equal on both sides."""
    return code_hash("lambert")
