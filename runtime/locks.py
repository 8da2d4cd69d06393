"""Locks that say who is at work, on a folder or a file: the system frees them however a process ends.

Where there are none (Windows, some network disks) nothing is locked, and nothing is taken for left behind.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import InputError


@contextmanager
def at_work(path: Path, clear_away: Callable[[], None]) -> Iterator[None]:
    """Lock `path`, a file or a folder, while this process writes there; who finds nobody there first clears away.

    Several may be at work at once, and none loses what it is writing: only leftovers of killed ones are there when
    `clear_away` is called.
    """
    descriptor = _opened(path)
    if descriptor is None:
        yield
        return
    try:
        if _locked(descriptor, alone=True):
            clear_away()
        _locked(descriptor, alone=False)
        yield
    finally:
        os.close(descriptor)


@contextmanager
def alone_at_work(folder: Path, otherwise: str) -> Iterator[None]:
    """Lock a folder for one process; raises `InputError` that says `otherwise` where another one has it."""
    descriptor = _opened(folder)
    if descriptor is None:
        yield
        return
    try:
        if _locked(descriptor, alone=True) is False:
            raise InputError(otherwise, file=folder, hint="wait for it, or name another folder")
        yield
    finally:
        os.close(descriptor)


@contextmanager
def made_and_held(path: Path, make: Callable[[], object]) -> Iterator[None]:
    """`make()` what is to be at `path`, and hold it while this process lives, so that `abandoned` leaves it alone."""
    while True:
        make()
        descriptor = _opened(path)
        if descriptor is None or not _locked(descriptor, alone=False):
            break
        # Between the two steps somebody may have found it without a lock, and cleared it away.
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(descriptor), path.stat()):
                break
        os.close(descriptor)
    try:
        yield
    finally:
        if descriptor is not None:
            os.close(descriptor)


def abandoned(path: Path) -> bool:
    """Return whether nobody holds what `made_and_held` has made: its process was killed."""
    descriptor = _opened(path)
    if descriptor is None:
        return False
    try:
        return _locked(descriptor, alone=True) is True
    finally:
        os.close(descriptor)


def _opened(path: Path) -> int | None:
    try:
        import fcntl  # noqa: F401

        return os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
    except (ImportError, OSError):
        return None


def _locked(descriptor: int, alone: bool) -> bool | None:
    """Return whether the lock was had; None where there are no locks. One that is shared is waited for."""
    import fcntl

    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB if alone else fcntl.LOCK_SH)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True
