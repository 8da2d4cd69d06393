"""The process that lets scipy and h5py loose on MATLAB files: `python -m metamer.spectral.formats.mat_library`.

A single wrong byte in a file of version 5 can end scipy's reader by a signal, and the process with it. So each file is
read by a fork of this process, which has imported the libraries once; it writes what it read to the output, as an
`.npz` of arrays with a list of names in JSON, and holds nothing that anybody would miss. Where there is no fork, this
process reads one file itself and ends. Nothing in a file is run: objects, function handles and links to other files are
passed over.

A request is a line of JSON with a path and how many numbers it may hold; an answer is a letter of `ANSWERS`, its length
in 8 bytes, and its content.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import json
import os
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np

#: Bytes that the process may ask for, and seconds that reading may take; the largest file takes a tenth of them.
MEMORY, PATIENCE = 6 * 2**30, 60
#: Kinds of answers: variables, or the reason why there are none, in JSON.
ANSWERS = {"variables": b"v", "refused": b"r"}
#: Bytes of the letter and the length before an answer.
HEAD = 9

#: A variable: numbers (float64), or words.
Variable = np.ndarray | list[str]

_KINDS = ("double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64")
_CELLS = 100_000
_STRUCTS = 2000


class TooLarge(Exception):
    """More numbers than the caller wants."""


def is_hdf5(head: bytes) -> bool:
    """Return whether a MATLAB file is of version 7.3: HDF5 behind a block of 512 bytes."""
    return head[:10] == b"MATLAB 7.3" or head[:8] == b"\x89HDF\r\n\x1a\n" or head[512:520] == b"\x89HDF\r\n\x1a\n"


def variables(path: Path, most: int) -> dict[str, Variable]:
    """Arrays of numbers and words by name; those of a struct as "struct.field" or "struct(2).field"."""
    with path.open("rb") as file:
        head = file.read(1024)
    return _hdf5(path, most) if is_hdf5(head) else _classic(path, most)


def _classic(path: Path, most: int) -> dict[str, Variable]:
    from scipy.io import loadmat, whosmat

    data = path.read_bytes()
    wanted, total = [], 0
    for name, shape, kind in whosmat(io.BytesIO(data)):
        total += int(np.prod([max(0, int(length)) for length in shape], dtype=object))
        if total > most:
            raise TooLarge(f"{name}: {' x '.join(map(str, shape))}")
        if kind in (*_KINDS, "char", "cell", "struct"):
            wanted.append(name)
    found: dict[str, Variable] = {}
    for name, value in loadmat(io.BytesIO(data), variable_names=wanted).items():
        if not name.startswith("__"):
            _keep(found, name, value)
    return found


def _keep(found: dict[str, Variable], name: str, value: Any, depth: int = 0) -> None:
    """Numbers, words, cells of words and the fields of a struct; anything else is passed over."""
    if not isinstance(value, np.ndarray):
        return
    if value.dtype.names and value.size <= _STRUCTS and depth < 3:
        for number, struct in enumerate(value.ravel(), 1):
            place = name if value.size == 1 else f"{name}({number})"
            for field in value.dtype.names[:100]:
                _keep(found, f"{place}.{field}", struct[field], depth + 1)
    elif value.dtype.kind in "US":
        found[name] = [str(words).strip() for words in value.ravel()[:_CELLS]]
    elif value.dtype.kind in "fiub":
        found[name] = value.astype(np.float64)
    elif value.dtype.kind == "O":
        cells = [cell for cell in value.ravel()[:_CELLS] if isinstance(cell, np.ndarray)]
        if cells and all(cell.dtype.kind in "US" for cell in cells):
            found[name] = [str(cell.ravel()[0]).strip() if cell.size else "" for cell in cells]


def _hdf5(path: Path, most: int) -> dict[str, Variable]:
    import h5py

    found: dict[str, Variable] = {}
    with h5py.File(path, "r") as file:
        _group(file, file, "", found, [most], 0)
    return found


def _group(file: Any, group: Any, prefix: str, found: dict[str, Variable], left: list[int], depth: int) -> None:
    """Variables of a group; links that leave the file, and data that do, are not followed."""
    import h5py

    for name in list(group)[:1000]:
        if name.startswith("#") or not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        item = group[name]
        if isinstance(item, h5py.Group):
            if depth < 3:
                _group(file, item, f"{prefix}{name}.", found, left, depth + 1)
            continue
        if not isinstance(item, h5py.Dataset) or item.is_virtual or item.external or item.shape is None:
            continue
        left[0] -= int(item.size or 0)
        if left[0] < 0:
            raise TooLarge(f"{prefix}{name}: {' x '.join(map(str, item.shape))}")
        kind = item.attrs.get("MATLAB_class", b"")
        if kind in (b"char", "char"):
            found[prefix + name] = _words(item)
        elif kind in (b"cell", "cell") and item.dtype == h5py.ref_dtype:
            cells = [file[reference] for reference in np.ravel(item[()])[:_CELLS] if reference]
            if cells and all(isinstance(cell, h5py.Dataset) and (cell.size or 0) < 1000 for cell in cells):
                found[prefix + name] = [(_words(cell) or [""])[0] for cell in cells]
        elif item.dtype.kind in "fiub":
            # MATLAB writes columns first, HDF5 rows: the array comes out transposed.
            found[prefix + name] = np.asarray(item[()], dtype=np.float64).T


def _words(item: Any) -> list[str]:
    """Rows of a character array, which HDF5 holds as numbers, transposed."""
    codes = np.atleast_2d(np.asarray(item[()]).T)
    if codes.dtype.kind not in "ui" or codes.size > 1_000_000:
        return []
    return ["".join(chr(int(code)) for code in row if 0 < int(code) < 0xD800).strip() for row in codes]


def _answer(path: str, most: int) -> None:
    """Write the variables of a file to the output, or what the libraries make of a damaged one."""
    try:
        found = variables(Path(path), most)
        arrays = {f"a{index}": value for index, value in enumerate(found.values()) if isinstance(value, np.ndarray)}
        words = [[name, None if isinstance(value, np.ndarray) else value] for name, value in found.items()]
        arrays["names"] = np.frombuffer(json.dumps(words).encode(), dtype=np.uint8)
        held = io.BytesIO()
        np.savez(held, allow_pickle=False, **arrays)
    except Exception as reason:
        _refuse(f"{type(reason).__name__}: {str(reason)[:200]}", isinstance(reason, TooLarge))
    else:
        _write("variables", held.getbuffer())


def _refuse(words: str, large: bool = False) -> None:
    _write("refused", json.dumps({"words": words, "large": large}).encode())


def _write(what: str, content: bytes | memoryview) -> None:
    sys.stdout.buffer.write(ANSWERS[what] + len(content).to_bytes(HEAD - 1, "little"))
    sys.stdout.buffer.write(content)
    sys.stdout.buffer.flush()


def _answer_in_fork(path: str, most: int) -> None:
    """Answer in a fork, and for it where the file ends it."""
    import resource

    child = os.fork()
    if not child:
        code = 1
        try:
            resource.setrlimit(resource.RLIMIT_CPU, (PATIENCE, PATIENCE))
            _answer(path, most)
            code = 0
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    if status:
        _refuse(f"reading it ended with {os.waitstatus_to_exitcode(status)}")


def _import_library(path: str) -> None:
    """Import what reads a file, for all forks to come; it does not look at the file."""
    with contextlib.suppress(OSError), Path(path).open("rb") as file:
        importlib.import_module("h5py" if is_hdf5(file.read(1024)) else "scipy.io")


def main() -> int:
    """Answer requests from the input until it ends."""
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    warnings.simplefilter("ignore")
    for line in sys.stdin:
        path, most = json.loads(line)
        if not hasattr(os, "fork"):
            _answer(path, most)
            return 0
        _import_library(path)
        _answer_in_fork(path, most)
    return 0


if __name__ == "__main__":
    sys.exit(main())
