"""Rays traced by the workers of a Dask cluster: blocks come back, and only this process writes files.

Each worker holds the triangles of one scene at a time. They are sent to those that are there when the work begins; one
that joins later says that it has none, and gets its block again with them.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt16

from ...runtime.dask_cluster import AHEAD, check_workers, connected, lost, scheduler_lost
from ...runtime.errors import MetamerError
from .hits import RayTracer

#: `triangle` and `place` of a block, as `Hits` has them.
Ends = tuple[Int[np.ndarray, "n N"], UInt16[np.ndarray, "n N 2"]]
_Bodies = tuple[Float[np.ndarray, "F 3 3"], Float[np.ndarray, "F 3"]]


def traced_on_cluster(
    tasks: Iterator[tuple[Any, ...]], key: str, bodies: _Bodies, scheduler: str, code: Callable[[], str]
) -> Generator[tuple[int, Ends], None, None]:
    """Yield the number of each task and where its rays end, as they come. Closing the iterator cancels the rest.

    Parameters
    ----------
    tasks : starts, normals, number of the first and rays of each block. key, bodies : of the scene; triangles and their
    normals. code : what has to give the same here and at each worker; of a module that they can import.

    Raises
    ------
    InputError : see `connected` and `check_workers`; the scheduler is lost on the way. MetamerError : a block that no
    worker has a result for.
    """
    client = connected(scheduler)
    try:
        check_workers(client, scheduler, code)
        client.run(_hold, key, bodies)
        yield from _drained(client, enumerate(tasks), key, bodies, scheduler)
    finally:
        client.close(timeout=5)


def _drained(
    client: Any, tasks: Iterator[tuple[int, tuple[Any, ...]]], key: str, bodies: _Bodies, scheduler: str
) -> Iterator[tuple[int, Ends]]:
    from distributed import as_completed

    sent: dict[Any, tuple[int, tuple[Any, ...]]] = {}
    finished = as_completed(loop=client.loop)

    def send(number: int, task: tuple[Any, ...], held: _Bodies | None = None) -> None:
        future = client.submit(_traced, key, held, *task, pure=False, retries=1)
        sent[future] = number, task
        finished.add(future)

    while True:
        room = AHEAD * max(1, sum(client.nthreads().values()))
        while len(sent) < room and (item := next(tasks, None)) is not None:
            send(*item)
        if not sent:
            return
        future = next(finished)
        number, task = sent.pop(future)
        try:
            found = future.result()
        except Exception as reason:
            if scheduler_lost(client, future):
                raise lost(scheduler) from None
            raise MetamerError(f"the cluster gave no result: {type(reason).__name__}: {reason}") from None
        future.release()
        if found is None:
            send(number, task, bodies)
        else:
            yield number, found


# What a worker holds: the triangles of the last scene that it was given.
_held: dict[str, RayTracer] = {}


def _hold(key: str, bodies: _Bodies) -> None:
    _held.clear()
    _held[key] = RayTracer(*bodies)


def _traced(
    key: str,
    bodies: _Bodies | None,
    starts: Float[np.ndarray, "n 3"],
    normals: Float[np.ndarray, "n 3"],
    first: int,
    rays: int,
) -> Ends | None:
    """Trace rays on a worker; None where this worker has no triangles of the scene."""
    if bodies is not None:
        _hold(key, bodies)
    # Another thread of this worker may be given another scene meanwhile.
    tracer = _held.get(key)
    return None if tracer is None else tracer.ends(starts, normals, first, rays)
