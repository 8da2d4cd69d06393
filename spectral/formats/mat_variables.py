"""Variables of MATLAB files of version 4, 5 and 7.3, read by a process of their own that a damaged file may end."""

from __future__ import annotations

import atexit
import io
import json
import os
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from ...runtime.errors import InputError
from ...runtime.files import existing_file
from ...runtime.shutdown import clearing, undisturbed
from .mat_library import ANSWERS, HEAD, PATIENCE, Variable, is_hdf5
from .shared.entry_rules import MOST_SAMPLES

__all__ = ["LARGEST", "Variable", "is_hdf5", "read_variables"]

#: Bytes of a file; compressed, so that its variables may be a thousand times larger, and are measured before reading.
LARGEST = 256 * 2**20


def read_variables(path: Path) -> dict[str, Variable]:
    """Arrays of numbers and words by name; those of a struct as "struct.field" or "struct(2).field".

    Raises
    ------
    InputError
        Damaged files, and variables that together are too large.
    """
    path = existing_file(path)
    size = path.stat().st_size
    if size > LARGEST:
        raise InputError(
            "too large for a file of spectra", found=f"{size / 2**20:.0f} MB", expected=f"at most {LARGEST // 2**20} MB"
        )
    kind, content = _answer(path)
    if kind == ANSWERS["refused"]:
        said = json.loads(content)
        if said["large"]:
            raise InputError(
                "a variable is too large",
                found=said["words"].partition(": ")[2],
                expected=f"at most {MOST_SAMPLES} numbers in all",
                hint="save the spectra alone",
            )
        raise _damaged(said["words"])
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as held:
            names = json.loads(held["names"].tobytes())
            return {
                name: np.asarray(held[f"a{index}"]) if words is None else words
                for index, (name, words) in enumerate(names)
            }
    except (BadZipFile, ValueError, KeyError, EOFError):
        raise _damaged("reading it ended before all was said") from None


class _Reader:
    """The process that reads, kept for the next file, and the one that started it; a fork of that starts its own."""

    process: subprocess.Popen[bytes] | None = None
    owner: int | None = None
    one_at_a_time = threading.Lock()


def _answer(path: Path) -> tuple[bytes, bytes]:
    """Return the letter and the content of what the process says of a file; twice asked where it was gone already.

    Raises
    ------
    InputError
        It takes longer than `PATIENCE`, or ends.
    """
    request = json.dumps([str(path.absolute()), MOST_SAMPLES]).encode() + b"\n"
    try:
        with _Reader.one_at_a_time:
            answer = _asked(request) or _asked(request)
    except OSError as reason:
        raise _damaged(f"{reason.strerror}, when starting the process that reads it") from None
    if answer is None:
        raise _damaged("the process that reads it ended")
    return answer


def _asked(request: bytes) -> tuple[bytes, bytes] | None:
    """Return the answer to a request, None where the process ended."""
    answers: list[tuple[bytes, bytes]] = []
    late = threading.Event()

    def give_up() -> None:
        late.set()
        _kill()

    limit = threading.Timer(PATIENCE, give_up)
    with clearing(lambda: answers or _kill()), suppress(BrokenPipeError):
        process = _running()
        assert process.stdin is not None and process.stdout is not None
        limit.start()
        process.stdin.write(request)
        process.stdin.flush()
        head = process.stdout.read(HEAD)
        length = int.from_bytes(head[1:], "little")
        content = process.stdout.read(length)
        if len(head) == HEAD and len(content) == length:
            answers.append((head[:1], content))
    limit.cancel()
    if not answers:
        _close()
    if late.is_set():
        raise _damaged(f"nothing after {PATIENCE} seconds")
    return answers[0] if answers else None


def _running() -> subprocess.Popen[bytes]:
    """Return the process that reads, started where there is none."""
    process = _Reader.process if _Reader.owner == os.getpid() else None
    if process is not None and process.poll() is None:
        return process
    _close()
    single = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "PYTHONFAULTHANDLER": ""}
    command = [sys.executable, "-m", f"{__package__}.mat_library"]
    with undisturbed():
        _Reader.process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, **single},
            start_new_session=True,
        )
        _Reader.owner = os.getpid()
    return _Reader.process


def _kill() -> None:
    """End the process that reads and what it forked."""
    if _Reader.process is not None and _Reader.owner == os.getpid():
        with suppress(OSError):
            if hasattr(os, "killpg"):
                os.killpg(_Reader.process.pid, signal.SIGKILL)
            else:
                _Reader.process.kill()


@atexit.register
def _close() -> None:
    """End the process that reads, if this one started it, and wait for it."""
    process = _Reader.process
    if process is not None and _Reader.owner == os.getpid():
        _kill()
        with suppress(OSError), process:
            pass
    _Reader.process = None


def _damaged(found: str) -> InputError:
    return InputError(
        "not a MATLAB file that can be read",
        found=" ".join(found.split()),
        expected="a .mat file of version 4, 5 or 7.3",
        hint="save it again, with save(..., '-v7')",
    )
