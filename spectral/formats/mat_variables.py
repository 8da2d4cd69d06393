"""Variables of MATLAB files of version 4, 5 and 7.3, read by a process of their own that a damaged file may end."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from ...runtime.errors import InputError
from ...runtime.files import existing_file
from ...runtime.shutdown import clearing, undisturbed
from .mat_library import Variable, is_hdf5
from .shared.entry_rules import MOST_SAMPLES

__all__ = ["LARGEST", "Variable", "is_hdf5", "read_variables"]

#: Bytes of a file; compressed, so that its variables may be a thousand times larger, and are measured before reading.
LARGEST = 256 * 2**20

# Seconds that reading may take; a file of the largest size takes a tenth of it.
_PATIENCE = 60.0


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
    command = [sys.executable, "-m", f"{__package__}.mat_library", str(path.absolute()), str(MOST_SAMPLES)]
    single = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "PYTHONFAULTHANDLER": ""}
    try:
        done = _run(command, {**os.environ, **single})
    except subprocess.TimeoutExpired:
        raise _damaged(f"nothing after {_PATIENCE:g} seconds") from None
    except OSError as reason:
        raise _damaged(f"{reason.strerror}, when starting the process that reads it") from None
    if done.returncode == 3:
        said = json.loads(done.stdout)
        if said["large"]:
            raise InputError(
                "a variable is too large",
                found=said["words"],
                expected=f"at most {MOST_SAMPLES} numbers in all",
                hint="save the spectra alone",
            )
        raise _damaged(f"{said['kind']}: {said['words']}")
    if done.returncode:
        raise _damaged(f"reading it ended with {done.returncode} {done.stderr[-200:].decode(errors='replace')}")
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as held:
        names = json.loads(held["names"].tobytes())
        return {
            name: np.asarray(held[f"a{index}"]) if words is None else words for index, (name, words) in enumerate(names)
        }


def _run(command: list[str], env: dict[str, str]) -> subprocess.CompletedProcess[bytes]:
    """`subprocess.run`, whose process does not outlive this one where a signal ends it."""
    started: list[subprocess.Popen[bytes]] = []

    def kill() -> None:
        for process in started:
            process.kill()

    with clearing(kill):
        with undisturbed():
            pipe = subprocess.PIPE
            started.append(subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=pipe, stderr=pipe, env=env))
        with started[0] as process:
            try:
                out, err = process.communicate(timeout=_PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()
                raise
        return subprocess.CompletedProcess(command, process.returncode, out, err)


def _damaged(found: str) -> InputError:
    return InputError(
        "not a MATLAB file that can be read",
        found=" ".join(found.split()),
        expected="a .mat file of version 4, 5 or 7.3",
        hint="save it again, with save(..., '-v7')",
    )
