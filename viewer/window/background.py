"""Background work of the window in one thread: the newest task of each kind, polled without blocking."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ...runtime.errors import MetamerError


@dataclass(frozen=True, eq=False)
class Heard:
    """Outcome of a task: `result`, or the reason for its absence in `problem`."""

    kind: str
    result: Any = None
    problem: str | None = None


class Background:
    """Thread that performs tasks one after the other; of waiting tasks of a kind only the newest is done.

    Tasks may use numpy and files, but neither the GPU nor the window.
    """

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._waiting: dict[str, Callable[[], Any]] = {}
        self._doing: str | None = None
        self._heard: list[Heard] = []
        self._closed = False
        self._thread: threading.Thread | None = None

    def ask(self, kind: str, work: Callable[[], Any]) -> None:
        """Queue a task, replacing a waiting one of the same kind."""
        with self._changed:
            self._waiting[kind] = work
            if self._thread is None and not self._closed:
                self._thread = threading.Thread(target=self._run, daemon=True)
                self._thread.start()
            self._changed.notify_all()

    def forget(self, kind: str) -> None:
        """Drop the waiting task of a kind; a running one continues."""
        with self._changed:
            self._waiting.pop(kind, None)

    def busy(self, kind: str | None = None) -> bool:
        """Return whether a task of this kind, or any, is waiting, running, or finished but not polled."""
        with self._changed:
            kinds = {*self._waiting, *filter(None, [self._doing]), *(heard.kind for heard in self._heard)}
        return bool(kinds) if kind is None else kind in kinds

    def poll(self) -> list[Heard]:
        """Return the outcomes since the last call."""
        with self._changed:
            heard, self._heard = self._heard, []
        return heard

    def close(self) -> None:
        """Stop; a running task ends by itself and its outcome is dropped."""
        with self._changed:
            self._closed = True
            self._waiting.clear()
            self._changed.notify_all()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._doing = None
                while not self._waiting and not self._closed:
                    self._changed.wait()
                if self._closed:
                    return
                kind = next(iter(self._waiting))
                work = self._waiting.pop(kind)
                self._doing = kind
            found = _done(kind, work)
            with self._changed:
                self._heard.append(found)
                self._doing = None


def _done(kind: str, work: Callable[[], Any]) -> Heard:
    try:
        return Heard(kind, work())
    except MetamerError as reason:
        return Heard(kind, problem=str(reason))
    except OSError as reason:
        return Heard(kind, problem=f"{reason.filename or 'a file'}: {reason.strerror or reason}")
    except MemoryError:
        return Heard(kind, problem="not enough memory")
    except Exception as reason:
        # A defect is reported as the task's outcome, and later tasks are done.
        traceback.print_exc()
        return Heard(kind, problem=f"a defect in Metamer: {reason!r}")
