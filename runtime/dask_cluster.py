"""Work on an existing Dask cluster, as `worker_pool` does it in processes of this machine.

Each worker needs the same version of metamer: data are sent with each task, results returned, and only this process
writes, so that no common file system is needed. If a worker dies, only its current task is affected: the scheduler
gives it to another one, a few times at most.
"""

from __future__ import annotations

import math
import re
import threading
import time
import uuid
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing
from typing import TYPE_CHECKING, Any

from .distribution import install_hint
from .errors import InputError, MetamerError
from .worker_pool import Lost, Result, Start, Task

if TYPE_CHECKING:
    from distributed import Client

#: Tasks that wait at each thread of the cluster, so that none is idle while a result travels.
AHEAD = 2
PATIENCE_S = 20.0
# Workers come and go; to ask for their number takes as long as to fetch a result.
_ASKED_EVERY_S = 1.0
_ADDRESS = re.compile(r"inproc://\S+|(\w+://)?\S+:\d+/?")


def connected(scheduler: str) -> Client:
    """Return a client of the scheduler at an address.

    Raises
    ------
    InputError : Dask is not installed; no address; no scheduler there.
    """
    try:
        from dask import config
        from distributed import Client
    except ImportError:
        raise InputError(
            "--scheduler: Dask is not installed",
            found=scheduler,
            expected="the extra `cluster`",
            hint=install_hint("cluster"),
        ) from None
    expected = "an address such as tcp://host:8786"
    if not _ADDRESS.fullmatch(scheduler):
        # Dask would look for a host of that name for a long time.
        raise InputError("not an address", field="--scheduler", found=scheduler, expected=expected)
    # Data go with their task on purpose: scattered, they would die with the one worker that holds them.
    config.set({"distributed.admin.large-graph-warning-threshold": "1TB"})
    try:
        return Client(scheduler, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError, TypeError) as reason:
        raise InputError(
            "no scheduler can be reached",
            file=scheduler,
            found=str(reason).split("\n")[0] or type(reason).__name__,
            expected=expected,
            hint="start one with `dask scheduler`, and workers with `dask worker ADDRESS --nthreads 1`",
        ) from None


def check_workers(client: Client, scheduler: str, code: Callable[[], str]) -> None:
    """Raise `InputError` if there are no workers, or if the `code()` or Python of one differs."""
    try:
        client.wait_for_workers(1, timeout=PATIENCE_S)
    except TimeoutError:
        hint = f"dask worker {scheduler} --nthreads 1"
        raise InputError("the scheduler has no workers", file=scheduler, found="none", hint=hint) from None
    ours = _environment(code)
    hint = "install the same version of metamer, with the same Python, on every worker"
    for worker, theirs in client.run(_environment, code, on_error="return").items():
        if theirs != ours:
            found = theirs if isinstance(theirs, Exception) else f"another version (Python {theirs[1]})"
            raise InputError(
                "a worker has not the metamer that is here", file=scheduler, field=worker, found=found, hint=hint
            )


def clustered(
    work: Callable[..., Any],
    tasks: Iterator[Task],
    scheduler: str,
    code: Callable[[], str],
    start: Start | None = None,
) -> Generator[tuple[Any, Any], None, None]:
    """Run `work(*arguments)` for each task on a scheduler's workers; yield (key, result) as completed, perhaps `Lost`.

    `tasks` is advanced when a worker has room. Closing the iterator cancels the rest. `work`, `code` and `start` must
    be in modules that workers can import.

    Parameters
    ----------
    code : function whose result must be equal here and on each worker.
    start : function, with arguments, that each thread of a worker calls before its first task; it is sent once per
        worker, and its state must be thread-local.

    Raises
    ------
    InputError : Dask is not installed; no scheduler at the address; it has no workers; theirs is another metamer or
        Python; the scheduler is lost. And every `MetamerError` of `work`.
    """
    client = connected(scheduler)
    try:
        check_workers(client, scheduler, code)
        key = None
        if start is not None:
            key = uuid.uuid4().hex
            client.run(_keep, key, start)
        yield from _drained(client, work, tasks, scheduler, (code(), code), key, start)
    finally:
        # Work in progress is nobody's any more: closing releases every future, and the scheduler forgets it.
        client.close(timeout=5)


def numbered_on_cluster(
    work: Callable[..., Result],
    tasks: Iterable[tuple[Any, ...]],
    scheduler: str,
    code: Callable[[], str],
    start: Start | None = None,
) -> Generator[tuple[int, Result], None, None]:
    """Yield the place and the result of each task as it is done, as `worker_pool.numbered` does; see `clustered`.

    Raises
    ------
    MetamerError : a task without a result from any worker. And the errors of `clustered`.
    """
    with closing(clustered(work, (Task(*each) for each in enumerate(tasks)), scheduler, code, start)) as results:
        for number, result in results:
            if isinstance(result, Lost):
                raise MetamerError(result.reason)
            yield number, result


def _drained(
    client: Client,
    work: Callable[..., Any],
    tasks: Iterator[Task],
    scheduler: str,
    code: tuple[str, Callable[[], str]],
    key: str | None,
    start: Start | None,
) -> Iterator[tuple[Any, Any]]:
    from distributed import as_completed

    sent: dict[Any, Task] = {}
    room, asked_at = 0, -math.inf
    finished = as_completed(loop=client.loop)

    def send(task: Task, more: Start | None = None) -> None:
        # A key of its own each time: what another command left on the scheduler is not taken for this one's result.
        future = client.submit(_served, code, key, more, work, task.arguments, pure=False, retries=1)
        sent[future] = task
        finished.add(future)

    while True:
        if time.monotonic() - asked_at > _ASKED_EVERY_S:
            room, asked_at = AHEAD * max(1, sum(client.nthreads().values())), time.monotonic()
        while len(sent) < room and (task := next(tasks, None)) is not None:
            send(task)
        if not sent:
            return
        future = next(finished)
        task, result = sent.pop(future), _result(future, client, scheduler)
        future.release()
        if isinstance(result, _Unprepared):
            send(task, start)
        else:
            yield task.key, result


def _result(future: Any, client: Client, scheduler: str) -> Any:
    from distributed import KilledWorker

    try:
        return future.result()
    except MetamerError:
        raise
    except KilledWorker as reason:
        said = f"{reason.allowed_failures + 1} workers of the cluster died over it, as when memory runs out"
        return Lost(f"{said}; give each worker more memory, or fewer threads")
    except Exception as reason:
        if client.status != "running" or future.status in ("lost", "cancelled"):
            raise InputError(
                "the scheduler was lost on the way",
                file=scheduler,
                hint="start it again, and repeat the command: it goes on from here",
            ) from None
        return Lost(f"the cluster gave no result: {type(reason).__name__}: {reason}")


class _Unprepared:
    """Answer of a worker that joined after `start` was sent."""


# Calls that a worker's threads have to make first, by the key of a command; the last one's alone.
_starts: dict[str, Start] = {}


class _Thread(threading.local):
    """Key of the command whose `start` a thread called last."""

    ready: str | None = None


_thread = _Thread()


def _keep(key: str, start: Start) -> None:
    _starts.clear()
    _starts[key] = start


def _served(
    code: tuple[str, Callable[[], str]], key: str | None, start: Start | None, work: Callable[..., Any], given: tuple
) -> Any:
    """Run a task on a worker, which may have joined after the first check of all of them."""
    ours, of_this_worker = code
    if of_this_worker() != ours:
        return Lost("a worker of the cluster has another version of metamer; install the same one")
    if key is not None and _thread.ready != key:
        if start is not None:
            _keep(key, start)
        start = _starts.get(key)
        if start is None:
            return _Unprepared()
        _thread.ready = None
        start[0](*start[1])
        _thread.ready = key
    return work(*given)


def _environment(code: Callable[[], str]) -> tuple[str, str]:
    """Return what must be equal on both sides: the code of the work, and the Python that pickles it."""
    import platform

    return code(), ".".join(platform.python_version_tuple()[:2])
