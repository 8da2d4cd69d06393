"""Worker processes that may die: each has one task at a time, so that a death costs that task alone, and once.

A pool of the standard library gives up whole when one of its processes is killed, and cannot say over which task. Here
each process has a pipe of its own; the task of one that dies is tried again, alone, when all others are done (two large
materials at once may not fit into memory where one does), and given up the second time.
"""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from ...spectral.processes import as_workers_should_start, usable_cores

_CONTEXT = multiprocessing.get_context("spawn")


@dataclass(frozen=True)
class Lost:
    """What stands in place of the result of a task whose process died, twice."""

    reason: str


@dataclass(frozen=True)
class Task:
    """`arguments` of the work, and the `key` that its result comes back with."""

    key: Any
    arguments: tuple


def supervised(work: Callable[..., Any], tasks: Iterable[Task], jobs: int) -> Generator[tuple[Any, Any], None, None]:
    """Do `work(*arguments)` for each task in `jobs` processes: (key, result) as they come, the result perhaps `Lost`.

    `tasks` is asked for the next one when a process is free, so that it may read what it hands out only then. Closing
    the iterator early, as Ctrl-C does, ends the processes at once. `work` is a function that a fresh Python can import.
    """
    again: list[Task] = []
    for key, result, task in _each(work, iter(tasks), jobs):
        if isinstance(result, Lost):
            again.append(task)
        else:
            yield key, result
    for key, result, _ in _each(work, iter(again), min(1, len(again))):
        yield key, result


def _each(work: Callable[..., Any], tasks: Iterator[Task], jobs: int) -> Iterator[tuple[Any, Any, Task]]:
    # All are started before the first gets anything: a large task would be waited for until its process is up.
    idle = [_Worker(work) for _ in range(jobs)]
    busy: dict[Connection, _Worker] = {}
    try:
        while True:
            while idle and (task := next(tasks, None)) is not None:
                worker = idle.pop(0)
                worker.give(task)
                busy[worker.connection] = worker
            if not busy:
                return
            for connection in wait(list(busy)):
                worker = busy.pop(connection)  # type: ignore[call-overload]
                task, result = worker.take()
                idle.append(_Worker(work) if isinstance(result, Lost) else worker)
                yield task.key, result, task
    finally:
        ours = (*idle, *busy.values())
        for worker in ours:
            worker.process.terminate()
        for worker in ours:
            worker.process.join(timeout=5)
            if worker.process.is_alive():
                worker.process.kill()
            worker.connection.close()


class _Worker:
    """A process, our end of its pipe, and the task that it has."""

    def __init__(self, work: Callable[..., Any]) -> None:
        self.connection, theirs = _CONTEXT.Pipe()
        self.process = _CONTEXT.Process(target=_serve, args=(theirs, work), daemon=True)
        with as_workers_should_start():
            self.process.start()
        theirs.close()
        self.task: Task | None = None

    def give(self, task: Task) -> None:
        self.task = task
        # A process that has died since: `take` finds the pipe closed.
        with suppress(BrokenPipeError, ConnectionResetError):
            self.connection.send(task.arguments)

    def take(self) -> tuple[Task, Any]:
        assert self.task is not None
        task, self.task = self.task, None
        try:
            return task, self.connection.recv()
        except (EOFError, ConnectionResetError):
            self.process.join(timeout=5)
            self.connection.close()
            return task, Lost(f"the process that fitted it ended abruptly ({_ending(self.process.exitcode)})")


def _ending(code: int | None) -> str:
    if code == -9:
        return "signal 9, as when memory runs out; try --jobs 1"
    return f"signal {-code}" if code is not None and code < 0 else f"exit code {code}"


def _serve(connection: Connection, work: Callable[..., Any]) -> None:
    """What a process does: a task, its result, the next; until the pipe or the parent is gone."""
    threading.Thread(target=_end_with_the_parent, daemon=True).start()
    while True:
        try:
            connection.send(work(*connection.recv()))
        except (EOFError, BrokenPipeError, ConnectionResetError):
            return


def _end_with_the_parent() -> None:
    """A parent that is killed cannot end its children: in the middle of a fit they would go on for nobody."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def jobs_that_fit(wanted: int | None, bytes_each: int) -> int:
    """Processes to start: as many as `wanted`, else one a core, but no more than memory holds at `bytes_each`."""
    if wanted is not None:
        return wanted
    free = free_memory()
    return usable_cores() if free is None else max(1, min(usable_cores(), free // max(1, bytes_each)))


def free_memory() -> int | None:
    """Bytes that may still be used: what the system has, and what a container's limit leaves; None where unknown."""
    found = []
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        found += [int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable:")]
        limit = Path("/sys/fs/cgroup/memory.max").read_text(encoding="ascii").strip()
        if limit != "max":
            used = int(Path("/sys/fs/cgroup/memory.current").read_text(encoding="ascii"))
            lines = Path("/sys/fs/cgroup/memory.stat").read_text(encoding="ascii").splitlines()
            # Cached pages of files are given up when somebody needs the room.
            cached = sum(int(line.split()[1]) for line in lines if line.startswith("inactive_file "))
            found.append(int(limit) - used + cached)
    except (OSError, ValueError):
        pass
    return max(0, min(found)) if found else None
