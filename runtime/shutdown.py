"""Early shutdown of a command: cleanup, a final message, and reliable delivery of signals.

An exception does not end a process reliably: raised inside `__del__` or the callback of a weak reference,
KeyboardInterrupt is printed and forgotten, and in a `finally` it skips the cleanup. So a signal raises nothing here.
Its handler runs the registered actions (`clearing`, `saying`), prints one line and ends the process. If the main thread
is busy in a library and cannot respond, a second thread does the same. The registering blocks also run their actions on
normal exit.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

#: Signals that end a command: by name, and what is said of them. The exit code is 128 and their number.
ENDING = {"SIGINT": "interrupted", "SIGTERM": "terminated", "SIGHUP": "the terminal has gone"}
# Seconds that the main thread has to answer a signal, and that everything may take.
_PATIENCE_S = 0.7
_LIMIT_S = 2.0

_duties: dict[object, Callable[[], object]] = {}
_last_words: dict[object, Callable[[], str]] = {}
_begun = threading.Event()
_ours = threading.Lock()


class _Held:
    """Number of blocks that defer signals, the deferred signal, and the exit code once all is done."""

    depth = 0
    waiting: int | None = None
    finished: int | None = None
    ending_thread: int | None = None


@contextmanager
def clearing(clear: Callable[[], object]) -> Iterator[None]:
    """Call `clear()` on leaving this block: at its end, on an error, or when a signal ends the process in it.

    Enter the block before there is anything to remove: `clear` may find nothing, and may be called twice.
    """
    key = object()
    _duties[key] = clear
    try:
        yield
    finally:
        clear()
        _duties.pop(key, None)


@contextmanager
def saying(words: Callable[[], str]) -> Iterator[None]:
    """Have a signal that ends the process in this block print `words()`, the state reached; innermost blocks first."""
    key = object()
    _last_words[key] = words
    try:
        yield
    finally:
        _last_words.pop(key, None)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Defer signals to the end of this block, for short steps that belong together."""
    _Held.depth += 1
    try:
        yield
    finally:
        _Held.depth -= 1
        if not _Held.depth and _Held.waiting is not None:
            _end(_Held.waiting)


def end_on_signals() -> None:
    """End this process on the signals of `ENDING` from now on, except those ignored by its parent's choice."""
    numbers = [getattr(signal, name) for name in ENDING if hasattr(signal, name)]
    numbers = [number for number in numbers if signal.getsignal(number) != signal.SIG_IGN]
    for number in numbers:
        signal.signal(number, _on_signal)
    if os.name == "posix":
        heard, write_end = os.pipe()
        os.set_blocking(write_end, False)
        # Written to by the system's own handler, at once, whatever Python is doing.
        signal.set_wakeup_fd(write_end, warn_on_full_buffer=False)
        threading.Thread(target=_watch, args=(heard, frozenset(numbers)), daemon=True).start()


def finished(code: int) -> None:
    """Mark the work as done: a signal while Python shuts down changes nothing any more."""
    _Held.finished = code


def _on_signal(number: int, _frame: FrameType | None) -> None:
    if _Held.depth:
        _Held.waiting = number
    else:
        _end(number)


def _watch(heard: int, numbers: frozenset[int]) -> None:
    """End the process if the main thread does not, or if its end takes too long."""
    while not (found := numbers.intersection(os.read(heard, 64))):
        pass
    deadline = time.monotonic() + _LIMIT_S
    number = min(found)
    if not _begun.wait(_PATIENCE_S):
        threading.Thread(target=_end, args=(number,), daemon=True).start()
    time.sleep(max(0.0, deadline - time.monotonic()))
    os._exit(_exit_code(number))


def _exit_code(number: int) -> int:
    return 128 + number if _Held.finished is None else _Held.finished


def _end(number: int) -> None:
    if not _ours.acquire(blocking=False):
        if _Held.ending_thread != threading.get_ident():
            # The other thread ends the process; this one must do no more.
            threading.Event().wait()
        return
    _Held.ending_thread = threading.get_ident()
    _begun.set()
    if _Held.finished is None:
        for clear in reversed([*_duties.values()]):
            with suppress(BaseException):
                clear()
        line = closing_line(number)
        with suppress(BaseException):
            sys.stdout.flush()
        with suppress(OSError):
            os.write(2, line.encode("utf-8", "replace"))
    os._exit(_exit_code(number))


def closing_line(number: int, more: str = "") -> str:
    """Return the final line of a command ended by a signal, with additions of the blocks of `saying` and `more`."""
    said = []
    for words in reversed([*_last_words.values()]):
        with suppress(BaseException):
            said.append(words())
    word = ENDING.get(signal.Signals(number).name, "ended")
    line = " ".join([f"metamer: {word}; nothing half-written is left behind.", *said, more])
    # A terminal has the bar that was there, whose cursor is hidden, and ^C on its line.
    before = "\n\x1b[?25h" if os.isatty(2) and os.environ.get("TERM", "dumb") != "dumb" else ""
    return f"{before}{' '.join(line.split())}\n"
