"""Locks of a working process on a folder or a file, which the system releases however the process ends.

On POSIX systems the file or folder is locked itself. Elsewhere a locked file can be neither read nor renamed, and
folders have no locks: there a small hidden file is locked, beside the file or in the folder, and removed with the lock.
Every lock is exclusive to one process, and no wait exceeds `PATIENCE_S`.

If nothing can be locked (some network disks), nothing is, and nothing counts as abandoned.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from .errors import InputError

#: Longest wait for another process that looks whether something is held, seconds: it needs microseconds.
PATIENCE_S = 10.0
_PAUSE_S = 0.01
# Files that go while they are being locked, before that counts as somebody else's.
_TRIES = 100
# The locked file in a folder, and the ending of one beside a file, where these are not locked themselves.
_IN_FOLDER, _BESIDE_FILE = ".metamer.lock", ".lock"


@contextmanager
def alone_at_work(folder: Path, otherwise: str) -> Iterator[None]:
    """Lock a folder for one process; raises `InputError` with the words `otherwise` if another one has it."""
    try:
        lock = _locked(folder)
    except BlockingIOError:
        raise InputError(otherwise, file=folder, hint="wait for it, or name another folder") from None
    try:
        yield
    finally:
        if lock:
            lock.free()


@contextmanager
def made_and_held(path: Path, make: Callable[[], object]) -> Iterator[None]:
    """Create `path` by `make()`, and lock it during the block, which protects it from `remove_abandoned`.

    Raises
    ------
    InputError : another process had it locked for `PATIENCE_S`.
    """
    until = time.monotonic() + PATIENCE_S
    while True:
        if not os.path.lexists(path):
            make()
        with suppress(BlockingIOError):
            lock = _locked(path)
            # Between the two steps somebody may have found it without a lock, and cleared it away.
            if os.path.lexists(path):
                break
            if lock:
                lock.free()
        if time.monotonic() > until:
            hint = "end the process that holds it, which may be stopped; or name another folder"
            found = f"still locked by another process after {PATIENCE_S:g} s"
            raise InputError("cannot be locked", file=path, found=found, hint=hint)
        time.sleep(_PAUSE_S)
    try:
        yield
    finally:
        if lock:
            lock.free()


def remove_abandoned(path: Path) -> bool:
    """Remove a file or folder of `made_and_held` whose process was killed; returns whether it was one.

    One that cannot be removed remains.
    """
    try:
        lock = _locked(path, make=False)
    except BlockingIOError:
        return False
    if lock is None:
        return False
    try:
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            with suppress(OSError):
                path.unlink()
    finally:
        lock.free()
        if lock.beside is not None:
            # A folder goes after the file in it that was locked.
            with suppress(OSError):
                path.rmdir()
    return True


@dataclass(frozen=True)
class _Lock:
    """Lock of this process. `beside`: the file made for it, if the object itself cannot be locked."""

    descriptor: int
    beside: Path | None

    def free(self) -> None:
        left = self.beside
        # Gone before it is free, so that nobody locks a file that another one is about to remove.
        if left is not None:
            with suppress(OSError):
                left.unlink()
                left = None
        os.close(self.descriptor)
        if left is not None:
            # A system that removes no open file: this fails where another process has opened it by now, rightly.
            with suppress(OSError):
                left.unlink()


def _locked(path: Path, make: bool = True) -> _Lock | None:
    """Lock `path`; None without support for locks, or if it does not exist.

    make : create the locked file if it is not `path` itself; otherwise it must exist.

    Raises
    ------
    BlockingIOError : another process, or another block of this one, has it.
    """
    flags, beside = os.O_RDONLY, None
    if not _locks_things_themselves():
        beside = path / _IN_FOLDER if path.is_dir() else path.with_name(path.name + _BESIDE_FILE)
        flags = os.O_RDWR | (os.O_CREAT if make else 0)
    for _ in range(_TRIES):
        try:
            descriptor = os.open(beside or path, flags | getattr(os, "O_NOFOLLOW", 0), 0o600)
        except OSError:
            return None
        lock = _Lock(descriptor, beside)
        with ExitStack() as stack:
            stack.callback(os.close, descriptor)
            try:
                _lock_descriptor(descriptor)
            except BlockingIOError:
                raise
            except OSError:
                return None
            # Another process may have removed it between the two steps.
            with suppress(OSError):
                if os.path.samestat(os.fstat(descriptor), (beside or path).stat()):
                    stack.pop_all()
                    return lock
    raise BlockingIOError


def _locks_things_themselves() -> bool:
    try:
        import fcntl  # noqa: F401
    except ImportError:
        return False
    return True


def _lock_descriptor(descriptor: int) -> None:
    """Lock an open file or folder at once.

    Raises
    ------
    BlockingIOError : another has it.
    OSError : it cannot be locked.
    """
    try:
        import fcntl
    except ImportError:
        from filelock import lock_descriptor

        if not lock_descriptor(descriptor, blocking=False):
            raise BlockingIOError from None
    else:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
