"""Reader of measured BRDFs in the `tensor_file` container (.bsdf) of the RGL material data base (Dupuy and Jakob 2018).

    "tensor_file\\0", two bytes of version (1, 0), uint32 count of fields; then for each field
    uint16 length and name, uint16 rank, uint8 type, uint64 offset into the file, rank x uint64 shape

Little-endian throughout. A BRDF has these fields, the last axis running fastest:

    phi_i (P,), theta_i (T,)        directions to the light at which the rest is tabulated, radians
    ndf, sigma (A, B)               distribution of normals and its projected area, over azimuth and polar angle
    vndf (P, T, A, B)               distribution of the normals that the light sees, not normalised
    luminance (P, T, H, W)          over the warped unit square, for importance sampling
    spectra (P, T, L, H, W) with wavelengths (L,) in nm, or rgb (P, T, 3, H, W)
    jacobian (1,)                   1: values are to be multiplied by ndf / (4 sigma)
    description                     text, as bytes

Values include the cosine of the viewer's polar angle. Fields that are not listed here are kept as they are.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from ...runtime.errors import InputError
from ...runtime.files import existing_file, read_bytes, written_whole
from ...spectral.upsampling import upsampling
from ..measured.rgl import RglBrdf
from ..measured.rgl_measurement import RglMeasurement
from ..records.source import MaterialSource, Rejected
from .measured_source import measured_source, placed
from .naming import printable
from .reading_cost import ReadingCost, cost_of_bytes

NAME = "RGL measurement"
SUFFIXES = (".bsdf",)
MAGIC = b"tensor_file\0"
_VERSION = (1, 0)
_TYPES = ("", "|u1", "|i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8")
_LONGEST_RANK = 16
# A head of more bytes than this has the name of a field in it.
_FIRST_FIELD = 64
_OURS = re.compile(rb"phi_i|theta_i|ndf|sigma|luminance|spectra|rgb|jacobian|wavelengths|description")
_AGAIN = "the file is damaged or cut short: download or copy it again"


def recognises(path: Path, head: bytes) -> bool:
    """Return True if the file begins as this container, whatever its name, or has the name of one."""
    return not is_other_tensor(head) and (head.startswith(MAGIC) or path.suffix.lower() in SUFFIXES)


def is_other_tensor(head: bytes) -> bool:
    """Return True for the container with other fields: Mueller matrices, a model of the sky."""
    return head.startswith(MAGIC) and (b"wvls" in head or (len(head) > _FIRST_FIELD and _OURS.search(head) is None))


def reading_cost(path: Path) -> ReadingCost:
    """Return the file, and its fields as a record keeps them."""
    return cost_of_bytes(path, 5.0, 0.05e-6)


def read_sources(path: Path, uplift: str) -> Iterator[MaterialSource | Rejected]:
    """Yield the file's one material; a file in RGB gets spectra by `uplift`. Raises `InputError` as `read_rgl` does."""
    with placed(path, hint="measure or tabulate it over a whole, a half or a quarter turn"):
        brdf = RglBrdf.from_measurement(read_rgl(path), uplift)
    measurement, count = (
        brdf.measurement,
        len(brdf.measurement.fields["theta_i"]) * len(brdf.measurement.fields["phi_i"]),
    )
    channels = f"at {brdf.channels} wavelengths" if brdf.spectral else "in red, green and blue"
    turned = "isotropic" if brdf.isotropic else "anisotropic"
    yield measured_source(
        path,
        brdf,
        source=". ".join(text for text in (measurement.description, path.name) if text),
        kind="measured" if brdf.spectral else upsampling(uplift).provenance,
        geometry=f"{turned}, {count} directions of the light, {channels}",
        original={
            "file": printable(path.name),
            "units": "1/sr, times the cosine of theta_o",
            "description": printable(measurement.description),
        },
    )


def read_rgl(path: str | Path) -> RglMeasurement:
    """Read one file; see the text of this module for the layout.

    Raises
    ------
    InputError
        The file is missing, is something else, of another version, ends early; a field is missing, of another shape
        than its axes have, or holds NaN, infinity or a density that is negative or nowhere positive.
    """
    path = existing_file(path)
    with placed(path, hint=_AGAIN):
        return RglMeasurement(path.stem, read_tensors(path))


def read_tensors(path: Path) -> dict[str, np.ndarray]:
    """Return every array of a container, in the file's order; raises `InputError` (which does not name the file)."""
    raw = read_bytes(path, "a readable binary file")
    if not raw.startswith(MAGIC):
        found = f"{raw[: len(MAGIC)]!r} ..." if raw else "an empty file"
        hint = _AGAIN if len(raw) < len(MAGIC) else "a .bsdf of another program: export it as RGL, MERL or plain text"
        raise InputError(
            "not a tensor_file container", field="header", found=found, expected=f"{MAGIC!r} ...", hint=hint
        )
    try:
        return _tensors(raw)
    except struct.error:
        expected = "the names, types and shapes of all fields"
        raise InputError("the file ends early", field="header", found=f"{len(raw)} bytes", expected=expected) from None


def _tensors(raw: bytes) -> dict[str, np.ndarray]:
    place = len(MAGIC)

    def take(layout: str) -> tuple:
        nonlocal place
        values = struct.unpack_from("<" + layout, raw, place)
        place += struct.calcsize("<" + layout)
        return values

    version = take("BB")
    if version != _VERSION:
        hint = "save it again as version 1.0"
        raise InputError(
            "unknown version of the container", field="version", found=version, expected=str(_VERSION), hint=hint
        )
    (count,) = take("I")
    fields: dict[str, np.ndarray] = {}
    for _ in range(count):
        (length,) = take("H")
        (text,) = take(f"{length}s")
        name = text.decode("utf-8", "replace")
        rank, kind, offset = take("HBQ")
        if not 0 < kind < len(_TYPES):
            raise InputError("unknown type of numbers", field=name, found=kind, expected=f"1 to {len(_TYPES) - 1}")
        if rank > _LONGEST_RANK:
            raise InputError("too many axes", field=name, found=rank, expected=f"{_LONGEST_RANK} at most")
        shape = take(f"{rank}Q")
        if name in fields:
            raise InputError("a field comes twice", field=name, found="the same name again", expected="unique names")
        dtype = np.dtype(_TYPES[kind])
        size = math.prod(shape)
        if offset + size * dtype.itemsize > len(raw):
            expected = f"{offset + size * dtype.itemsize} bytes for {shape}"
            raise InputError("the file ends early", field=name, found=f"{len(raw)} bytes", expected=expected)
        try:
            fields[name] = np.frombuffer(raw, dtype, size, offset).reshape(shape)
        except ValueError:
            # An axis of nothing beside one without end: no values, and yet no array.
            expected = "axes that go together"
            raise InputError("no array has this shape", field=name, found=shape, expected=expected) from None
    return fields


def write_tensors(path: str | Path, fields: Mapping[str, np.ndarray]) -> None:
    """Write arrays of numbers as a `tensor_file` container, as `read_tensors` and Mitsuba 3 read it."""
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
        kind = _TYPES.index(array.dtype.newbyteorder("<").str)
        header += struct.pack("<H", len(names[name])) + names[name] + struct.pack("<HBQ", array.ndim, kind, offset)
        header += struct.pack(f"<{array.ndim}Q", *array.shape)
        body.append(array.astype(array.dtype.newbyteorder("<"), copy=False).tobytes())
        offset += array.nbytes
    with written_whole(path) as beside, beside.open("wb") as file:
        file.write(header)
        file.writelines(body)
