"""Fault-tolerant worker processes with one task at a time: a crash affects that task alone, which is retried once.

A pool of the standard library fails as a whole when one of its processes is killed, cannot name its task, and keeps
semaphores that outlive an abrupt end. Here each process has a pipe of its own; the task of a dead one is retried,
alone, when all others are done (two large ones at once may exceed the memory), and given up the second time. Messages
of a task use the same pipe, before its result.

The processes have one thread of BLAS each, ignore Ctrl-C, and end when their work is no longer wanted: with the
iterator, with a signal that ends this process, and by themselves if it is killed.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import tempfile
import threading
import traceback
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from types import ModuleType
from typing import Any, TypeVar

from .errors import MetamerError
from .private_folder import clear_abandoned, temporary_folder
from .shutdown import clearing, undisturbed

Result = TypeVar("Result")
#: Initialiser of each process before its first task, and its arguments.
Start = tuple[Callable[..., Any], tuple]

# The processes are the parallelism; threads of their own would only contend.
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
#: Start method of worker processes: a fresh Python each.
SPAWNING = multiprocessing.get_context("spawn")


@dataclass(frozen=True)
class Lost:
    """Placeholder for the result of a task whose process died, twice."""

    reason: str


@dataclass(frozen=True)
class Task:
    """Task: `arguments` of the work, and the `key` returned with its result."""

    key: Any
    arguments: tuple


def usable_cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def supervised(
    work: Callable[..., Any],
    tasks: Iterable[Task],
    jobs: int,
    heard: Callable[[Any, Any], None] | None = None,
    start: Start | None = None,
) -> Generator[tuple[Any, Any], None, None]:
    """Run `work(*arguments)` for each task in `jobs` processes; yield (key, result) as completed, perhaps `Lost`.

    `tasks` is advanced when a process is free, so that it can load data lazily. Closing the iterator early ends the
    processes at once. `work` and its arguments must be importable by a fresh Python: the calling script is not run
    again. Exceptions of `work` are raised here.

    heard : receives (key, message) of running tasks; `work` is then called with `say=`, which sends messages.
    """
    again: list[Task] = []
    for key, result, task in _each(work, iter(tasks), jobs, heard, start):
        if isinstance(result, Lost):
            again.append(task)
        else:
            yield key, result
    for key, result, _ in _each(work, iter(again), min(1, len(again)), heard, start):
        yield key, result


def in_order(
    work: Callable[..., Result],
    tasks: Iterable[tuple[Any, ...]],
    jobs: int,
    start: Start | None = None,
    heard: Callable[[int, Any], None] | None = None,
) -> Generator[Result, None, None]:
    """Yield `work(*task)` for every task, in order: in this process if `jobs` is 1, else in `jobs` processes.

    heard : receives (place, message) of running tasks; `work` is then called with `say=`, which sends messages.

    Raises
    ------
    MetamerError : processes died twice on the same task. And exceptions of `work`.
    """
    waiting: dict[int, Result] = {}
    following = 0
    with closing(numbered(work, tasks, jobs, start, heard)) as results:
        for number, result in results:
            waiting[number] = result
            while following in waiting:
                yield waiting.pop(following)
                following += 1


def each_done(work: Callable[..., Result], tasks: Iterable[tuple[Any, ...]], jobs: int) -> Iterator[Result]:
    """Yield `work(*task)` for every task, as completed: in order in this process if `jobs` is 1, else in that many."""
    with closing(numbered(work, tasks, jobs)) as results:
        for _, result in results:
            yield result


def numbered(
    work: Callable[..., Result],
    tasks: Iterable[tuple[Any, ...]],
    jobs: int,
    start: Start | None = None,
    heard: Callable[[int, Any], None] | None = None,
) -> Generator[tuple[int, Result], None, None]:
    """Yield the place and the result of each task as completed; `in_order` holds back early ones."""
    if jobs <= 1:
        if start is not None:
            start[0](*start[1])
        for number, task in enumerate(tasks):
            yield number, work(*task, **({} if heard is None else {"say": partial(heard, number)}))
        return
    with closing(supervised(work, (Task(*each) for each in enumerate(tasks)), jobs, heard, start)) as results:
        for number, result in results:
            if isinstance(result, Lost):
                raise MetamerError(result.reason)
            yield number, result


def _each(
    work: Callable[..., Any],
    tasks: Iterator[Task],
    jobs: int,
    heard: Callable[[Any, Any], None] | None,
    start: Start | None,
) -> Iterator[tuple[Any, Any, Task]]:
    if not jobs:
        return
    ours: list[_Worker] = []
    busy: dict[Connection, _Worker] = {}

    def another() -> _Worker:
        worker = _Worker(work, heard is not None, start)
        ours.append(worker)
        worker.wake()
        return worker

    def hand_out() -> None:
        while idle and (task := next(tasks, None)) is not None:
            worker = idle.pop(0)
            worker.give(task)
            busy[worker.connection] = worker

    with clearing(lambda: _end_all(ours)):
        # All are started before the first gets anything: a large task would be waited for until its process is up.
        idle = [another() for _ in range(jobs)]
        hand_out()
        while busy:
            done: list[tuple[Any, Any, Task]] = []
            for connection in wait(list(busy)):
                worker = busy[connection]  # type: ignore[index]
                task, result = worker.take()
                if isinstance(result, _Said):
                    if heard is not None:
                        heard(task.key, result.what)
                    continue
                del busy[worker.connection]
                if isinstance(result, _Raised):
                    raise result.reason
                idle.append(another() if isinstance(result, Lost) else worker)
                done.append((task.key, result, task))
            # Nobody waits while the caller is at work on what came.
            hand_out()
            yield from done


def _end_all(workers: list[_Worker]) -> None:
    for worker in workers:
        worker.kill()
    for worker in workers:
        worker.forget()
    # Their temporary files have no owner any more.
    clear_abandoned()


@dataclass(frozen=True)
class _Said:
    """Message sent by the pipe before a result."""

    what: Any


@dataclass(frozen=True)
class _Raised:
    """Message sent by the pipe in place of a result."""

    reason: Exception


class _Worker:
    """Process, our end of its pipe, and its task."""

    def __init__(self, work: Callable[..., Any], says: bool, start: Start | None) -> None:
        self.connection, self._theirs = SPAWNING.Pipe()
        self.process = SPAWNING.Process(
            target=_serve, args=(self._theirs, work, says, str(temporary_folder())), daemon=True
        )
        self.task: Task | None = None
        self._start = start

    def wake(self) -> None:
        """Start the process, registered for shutdown before."""
        # Half started it would be nobody's, and print that its parent has gone.
        with undisturbed(), as_workers_should_start():
            self.process.start()
        self._theirs.close()

    def give(self, task: Task) -> None:
        self.task = task
        # A process that has died since: `take` finds the pipe closed.
        with suppress(BrokenPipeError, ConnectionResetError):
            if self._start is not None:
                self.connection.send(("start", self._start))
                self._start = None
            self.connection.send(("task", task.arguments))

    def take(self) -> tuple[Task, Any]:
        """Return the task, and a message from the pipe: its result, `Lost`, or something `_Said` before."""
        assert self.task is not None
        task = self.task
        try:
            result = self.connection.recv()
            if not isinstance(result, _Said):
                self.task = None
            return task, result
        except (EOFError, ConnectionResetError):
            self.task = None
            self.process.join(timeout=5)
            self.connection.close()
            how = ending_words(self.process.exitcode)
            hint = "; try --jobs 1" if self.process.exitcode == -9 else ""
            return task, Lost(f"the process that worked on it ended abruptly ({how}{hint})")

    def kill(self) -> None:
        """Kill the process; it writes nothing that could be left incomplete."""
        if self.process.pid is not None:
            self.process.kill()

    def forget(self) -> None:
        if self.process.pid is not None:
            self.process.join(timeout=1)
        self.connection.close()


def ending_words(code: int | None) -> str:
    """Describe how a process ended, by its exit code."""
    if code == -9:
        return "signal 9, as when memory runs out"
    return f"signal {-code}" if code is not None and code < 0 else f"exit code {code}"


def _serve(connection: Connection, work: Callable[..., Any], says: bool, temporary: str) -> None:
    """Run tasks and send their results, until the pipe or the parent is gone."""
    # Known, it is not tried with a file, which would stay where this process is ended in between.
    tempfile.tempdir = temporary
    threading.Thread(target=end_with_the_parent, daemon=True).start()
    words: dict[str, Any] = {"say": lambda what: connection.send(_Said(what))} if says else {}
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            what, given = connection.recv()
            try:
                if what == "start":
                    given[0](*given[1])
                else:
                    connection.send(work(*given, **words))
            except Exception as reason:
                if not isinstance(reason, MetamerError):
                    reason.add_note(traceback.format_exc())
                connection.send(_Raised(reason))


def end_with_the_parent() -> None:
    """End this process when its parent is killed, which could not end its children in the middle of a task."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def one_thread() -> None:
    """Set BLAS to one thread in this process, unless the environment sets it or numpy is already loaded.

    Our matrices are small: beside other work threads wait for each other, which took twelve times the CPU time in a
    fit, and fifty times in reading a scattered BRDF.
    """
    if "numpy" not in sys.modules:
        for name in _ONE_THREAD:
            os.environ.setdefault(name, "1")


@contextmanager
def as_workers_should_start() -> Iterator[None]:
    """Start processes in this context with SIGINT blocked and BLAS set to one thread, without running our script.

    multiprocessing has each process import the started script, for definitions in it. A script without a check of
    `__name__` would run again in every process.
    """
    script = sys.modules["__main__"]
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    masks = hasattr(signal, "pthread_sigmask")
    if masks:
        # It comes with the first process, and when it starts, SIGINT is let through again.
        resource_tracker.ensure_running()
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if masks else set()
    try:
        os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
        sys.modules["__main__"] = ModuleType("__main__")
        yield
    finally:
        sys.modules["__main__"] = script
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
        if masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
