"""Variables of MATLAB files: version 4 and 5 by scipy, version 7.3, which is HDF5, by h5py. Nothing in them is run."""

from __future__ import annotations

import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..files import existing_file
from .gathering import MOST_SAMPLES

#: Bytes of a file; compressed, so that its variables may be a thousand times larger, and are measured before reading.
LARGEST = 256 * 2**20

#: A variable: numbers (float64), or words.
Variable = np.ndarray | list[str]

_NUMBERS = ("double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "sparse")


def is_hdf5(head: bytes) -> bool:
    """Whether a MATLAB file is of version 7.3: HDF5 behind a block of 512 bytes."""
    return head[:10] == b"MATLAB 7.3" or head[:8] == b"\x89HDF\r\n\x1a\n" or head[512:520] == b"\x89HDF\r\n\x1a\n"


def read_variables(path: Path) -> dict[str, Variable]:
    """Arrays of numbers and words by name; those in a 1 x 1 struct as "struct.field".

    Raises
    ------
    InputError
        Damaged files, and variables that together are too large.
    """
    path = existing_file(path)
    try:
        size = path.stat().st_size
        if size > LARGEST:
            raise InputError(
                "too large for a file of spectra",
                file=path,
                found=f"{size / 2**20:.0f} MB",
                expected=f"at most {LARGEST // 2**20} MB",
            )
        with path.open("rb") as file:
            head = file.read(1024)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _hdf5(path) if is_hdf5(head) else _classic(path)
    except InputError:
        raise
    except Exception as reason:  # whatever the two libraries make of a damaged file
        raise InputError(
            "not a MATLAB file that can be read",
            file=path,
            found=f"{type(reason).__name__}: {str(reason)[:120]}",
            expected="a .mat file of version 4, 5 or 7.3",
            hint="save it again, with save(..., '-v7')",
        ) from None


def _too_large(path: Path, name: str, shape: tuple[int, ...]) -> InputError:
    return InputError(
        "a variable is too large",
        file=path,
        field=name,
        found=" x ".join(map(str, shape)),
        expected=f"at most {MOST_SAMPLES} numbers in all",
        hint="save the spectra alone",
    )


def _classic(path: Path) -> dict[str, Variable]:
    from scipy.io import loadmat, whosmat

    data = path.read_bytes()
    wanted, total = [], 0
    for name, shape, kind in whosmat(io.BytesIO(data)):
        count = int(np.prod([max(0, int(length)) for length in shape], dtype=object))
        total += count
        if total > MOST_SAMPLES:
            raise _too_large(path, name, tuple(shape))
        if kind in (*_NUMBERS, "char", "cell", "struct"):
            wanted.append(name)
    found: dict[str, Variable] = {}
    for name, value in loadmat(io.BytesIO(data), variable_names=wanted).items():
        if not name.startswith("__"):
            _keep(found, name, value)
    return found


def _keep(found: dict[str, Variable], name: str, value: Any, depth: int = 0) -> None:
    """Numbers, words, cells of words and the fields of a struct; anything else is passed over."""
    if hasattr(value, "toarray") and not isinstance(value, np.ndarray):
        if int(value.shape[0]) * int(value.shape[1]) <= MOST_SAMPLES:
            found[name] = np.asarray(value.toarray(), dtype=np.float64)
        return
    if not isinstance(value, np.ndarray):
        return
    if value.dtype.names and value.size == 1 and depth < 3:
        for field in value.dtype.names[:100]:
            _keep(found, f"{name}.{field}", value.ravel()[0][field], depth + 1)
    elif value.dtype.kind in "US":
        found[name] = [str(words).strip() for words in value.ravel()[:100_000]]
    elif value.dtype.kind in "fiub":
        found[name] = value.astype(np.float64)
    elif value.dtype.kind == "O":
        cells = [cell for cell in value.ravel()[:100_000] if isinstance(cell, np.ndarray)]
        if cells and all(cell.dtype.kind in "US" for cell in cells):
            found[name] = [str(cell.ravel()[0]).strip() if cell.size else "" for cell in cells]


def _hdf5(path: Path) -> dict[str, Variable]:
    import h5py

    found: dict[str, Variable] = {}
    with h5py.File(path, "r") as file:
        _group(file, file, "", found, path, [0], 0)
    return found


def _group(
    file: Any, group: Any, prefix: str, found: dict[str, Variable], path: Path, total: list[int], depth: int
) -> None:
    """Variables of a group; links that leave the file, and data that do, are not followed."""
    import h5py

    for name in list(group)[:1000]:
        if name.startswith("#") or not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        item = group[name]
        if isinstance(item, h5py.Group):
            if depth < 3:
                _group(file, item, f"{prefix}{name}.", found, path, total, depth + 1)
            continue
        if not isinstance(item, h5py.Dataset) or item.is_virtual or item.external:
            continue
        total[0] += int(item.size or 0)
        if total[0] > MOST_SAMPLES:
            raise _too_large(path, f"{prefix}{name}", tuple(item.shape))
        kind = item.attrs.get("MATLAB_class", b"")
        kind = kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)
        if kind == "char":
            found[prefix + name] = _words(item)
        elif kind == "cell" and item.dtype == h5py.ref_dtype:
            cells = [file[reference] for reference in np.ravel(item[()])[:100_000] if reference]
            if cells and all(
                isinstance(cell, h5py.Dataset) and cell.dtype.kind in "u" and (cell.size or 0) < 1000 for cell in cells
            ):
                found[prefix + name] = [(_words(cell) or [""])[0] for cell in cells]
        elif item.dtype.kind in "fiub" and item.shape is not None:
            # MATLAB writes columns first, HDF5 rows: the array comes out transposed.
            found[prefix + name] = np.asarray(item[()], dtype=np.float64).T


def _words(item: Any) -> list[str]:
    """Rows of a character array, which HDF5 holds as numbers, transposed."""
    codes = np.atleast_2d(np.asarray(item[()]).T)
    if codes.dtype.kind not in "ui" or codes.size > 1_000_000:
        return []
    return ["".join(chr(int(code)) for code in row if 0 < int(code) < 0x110000).strip() for row in codes]
