"""Writes arrays as a `tensor_file` container (.bsdf), the layout of the RGL data base, which Mitsuba 3 reads too."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ...runtime.errors import InputError
from ...runtime.files import written_whole
from .rgl import MAGIC

_KINDS = ("|u1", "|i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8")
_TYPES = {kind: number for number, kind in enumerate(_KINDS, 1)}


def write_tensors(path: str | Path, fields: Mapping[str, np.ndarray]) -> None:
    """Write arrays of numbers as a `tensor_file` container, as `read_tensors` reads it."""
    arrays = {name: np.ascontiguousarray(field) for name, field in fields.items()}
    for name, array in arrays.items():
        if array.dtype.newbyteorder("<").str not in _TYPES:
            raise InputError("cannot be stored", file=path, field=name, found=array.dtype, expected="numbers")
    names = {name: name.encode() for name in arrays}
    offset = len(MAGIC) + 6 + sum(13 + len(names[name]) + 8 * array.ndim for name, array in arrays.items())
    header = MAGIC + struct.pack("<BBI", 1, 0, len(arrays))
    body = []
    for name, array in arrays.items():
        gap = -offset % 8
        body.append(b"\0" * gap)
        offset += gap
        kind = _TYPES[array.dtype.newbyteorder("<").str]
        header += struct.pack("<H", len(names[name])) + names[name] + struct.pack("<HBQ", array.ndim, kind, offset)
        header += struct.pack(f"<{array.ndim}Q", *array.shape)
        body.append(array.astype(array.dtype.newbyteorder("<"), copy=False).tobytes())
        offset += array.nbytes
    with written_whole(path) as beside, beside.open("wb") as file:
        file.write(header)
        file.writelines(body)
