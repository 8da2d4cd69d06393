"""Worker processes: one thread each, deaf to Ctrl-C, and gone when their work is no longer wanted."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from multiprocessing import resource_tracker
from typing import Any, TypeVar

Result = TypeVar("Result")

# The processes are the parallelism; threads of their own would only contend.
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def usable_cores() -> int:
    """Cores that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def worker_pool(
    jobs: int, initializer: Callable[..., Any] | None = None, arguments: tuple = ()
) -> Iterator[ProcessPoolExecutor]:
    """A pool of spawned processes. Leaving it early, by Ctrl-C or an error, ends them at once.

    Workers inherit a blocked SIGINT and BLAS set to one thread, so the pool is started whole on entry.
    """
    others = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), initializer, arguments)
    finished = False
    try:
        with as_workers_should_start():
            for _ in range(jobs):
                pool.submit(_awake)
        yield pool
        finished = True
    finally:
        pool.shutdown(wait=finished, cancel_futures=True)
        if not finished:
            ours = set(multiprocessing.active_children()) - others
            for process in ours:
                process.terminate()
            for process in ours:
                process.join(timeout=5)


def each_done(work: Callable[..., Result], tasks: Iterable[tuple[Any, ...]], jobs: int) -> Iterator[Result]:
    """`work(*task)` for every task, as each is done: in this process, in order, where `jobs` is 1, else in so many."""
    if jobs <= 1:
        for task in tasks:
            yield work(*task)
        return
    with worker_pool(jobs) as pool:
        for future in as_completed([pool.submit(work, *task) for task in tasks]):
            yield future.result()


def _awake() -> None:
    """Work that only makes the pool start a process."""


@contextmanager
def as_workers_should_start() -> Iterator[None]:
    """What is started within this inherits a blocked SIGINT and BLAS set to one thread."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    masks = hasattr(signal, "pthread_sigmask")
    if masks:
        # It comes with the first process, and when it starts, SIGINT is let through again.
        resource_tracker.ensure_running()
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if masks else set()
    try:
        os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
        if masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
