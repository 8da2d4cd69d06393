"""The work of an import on a Dask cluster that is already there.

Each worker needs the same metamer as here: data go out with each task, packs come back, and only this process writes
files, so that no common file system is needed. A worker that dies costs what it was doing: the scheduler gives that to
another one, three times at most.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from ...spectral.errors import InputError
from ..source import MaterialSource
from .code_version import code_hash
from .import_plan import PlannedMaterial
from .work import Fitted, fit_material

if TYPE_CHECKING:
    from distributed import Client

# Tasks that wait at each thread of the cluster, so that none is idle while a result travels.
_AHEAD = 2
_PATIENCE_S = 20.0
_ADDRESS = re.compile(r"inproc://\S+|(\w+://)?\S+:\d+/?")


def fitted_on_cluster(
    pending: Iterator[tuple[PlannedMaterial, MaterialSource | InputError]], budget: float, scheduler: str
) -> Iterator[tuple[PlannedMaterial, MaterialSource | None, Fitted]]:
    """Each material with what the cluster made of it, as results come. Closing the iterator cancels the rest.

    Raises
    ------
    InputError
        Dask is not installed; no scheduler at the address; it has no workers; theirs is another metamer or Python; the
        scheduler is lost on the way.
    """
    client = _connected(scheduler)
    try:
        _check_workers(client, scheduler)
        yield from _drained(client, pending, budget, scheduler)
    finally:
        # Work in progress is nobody's any more: closing releases every future, and the scheduler forgets it.
        client.close(timeout=5)


def _drained(
    client: Client,
    pending: Iterator[tuple[PlannedMaterial, MaterialSource | InputError]],
    budget: float,
    scheduler: str,
) -> Iterator[tuple[PlannedMaterial, MaterialSource | None, Fitted]]:
    from distributed import as_completed

    sent: dict[Any, tuple[PlannedMaterial, MaterialSource]] = {}
    finished = as_completed(loop=client.loop)
    while True:
        room = _AHEAD * max(1, sum(client.nthreads().values()))
        while len(sent) < room and (item := next(pending, None)) is not None:
            material, source = item
            if isinstance(source, InputError):
                yield material, None, Fitted(None, 0.0, str(source))
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


def _checked_fit(source: MaterialSource, budget: float, code: str) -> Fitted:
    """`fit_material`, where this worker has the same code: one may have joined after the first look at all of them."""
    if code_hash(source.model) != code:
        return Fitted(None, 0.0, "a worker of the cluster has another version of metamer; install the same one")
    return fit_material(source, budget)


def _result(future: Any, client: Client, scheduler: str) -> Fitted:
    from distributed import KilledWorker

    try:
        return future.result()
    except KilledWorker as reason:
        said = f"{reason.allowed_failures + 1} workers of the cluster died over it, as when memory runs out"
        return Fitted(None, 0.0, f"{said}; give each worker more memory, or fewer threads")
    except Exception as reason:
        if client.status != "running" or future.status in ("lost", "cancelled"):
            hint = "start it again, and repeat the command: it goes on from here"
            raise InputError("the scheduler was lost on the way", file=scheduler, hint=hint) from None
        return Fitted(None, 0.0, f"the cluster gave no result: {type(reason).__name__}: {reason}")


def _connected(scheduler: str) -> Client:
    try:
        from dask import config
        from distributed import Client
    except ImportError:
        raise InputError(
            "Dask is not installed",
            field="--scheduler",
            found=scheduler,
            expected="the extra `cluster`",
            hint="pip install metamer[cluster]",
        ) from None
    expected = "an address such as tcp://host:8786"
    if not _ADDRESS.fullmatch(scheduler):
        # Dask would look for a host of that name for a long time.
        raise InputError("not an address", field="--scheduler", found=scheduler, expected=expected)
    # Data go with their task on purpose: scattered, they would die with the one worker that holds them.
    config.set({"distributed.admin.large-graph-warning-threshold": "1TB"})
    try:
        return Client(scheduler, timeout=_PATIENCE_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError, TypeError) as reason:
        raise InputError(
            "no scheduler can be reached",
            file=scheduler,
            found=str(reason).split("\n")[0] or type(reason).__name__,
            expected=expected,
            hint="start one with `dask scheduler`, and workers with `dask worker ADDRESS --nthreads 1`",
        ) from None


def _environment() -> tuple[str, str]:
    """What has to be equal here and there: the code of a fit, and the Python that pickles it."""
    import platform

    return code_hash("lambert"), ".".join(platform.python_version_tuple()[:2])


def _check_workers(client: Client, scheduler: str) -> None:
    try:
        client.wait_for_workers(1, timeout=_PATIENCE_S)
    except TimeoutError:
        hint = f"dask worker {scheduler} --nthreads 1"
        raise InputError("the scheduler has no workers", file=scheduler, found="none", hint=hint) from None
    ours = _environment()
    hint = "install the same version of metamer, with the same Python, on every worker"
    for worker, theirs in client.run(_environment, on_error="return").items():
        if theirs != ours:
            found = theirs if isinstance(theirs, Exception) else f"another version (Python {theirs[1]})"
            raise InputError(
                "a worker has not the metamer that is here", file=scheduler, field=worker, found=found, hint=hint
            )
