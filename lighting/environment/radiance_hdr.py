"""Radiance images (.hdr, .pic): four bytes a pixel, three mantissas and one exponent, plain or run-length encoded.

Decoded as in Radiance's own library (Ward, "Real Pixels", Graphics Gems II, 1991; `ray/src/common/color.c`): a channel
is (mantissa + 1/2) 2^(exponent - 136), since writers cut mantissas off, and black where the exponent is 0.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import numpy as np
from jaxtyping import Float, UInt8

from ...runtime.errors import InputError
from ...runtime.files import existing_file

SUFFIXES = (".hdr", ".pic", ".rgbe")
_SIZE = re.compile(rb"^([+-])([XY]) +(\d+) +([+-])([XY]) +(\d+)\s*$")
# Largest length of a header, which is usually a few hundred bytes.
_LONGEST_HEADER = 1 << 16
# Widths for which the newer run-length encoding is used.
_SHORTEST_RUN, _LONGEST_RUN = 8, 0x7FFF
_AGAIN = "the picture is damaged or cut short: save or copy it again"


@dataclass(frozen=True)
class RadianceHeader:
    """Header of a Radiance image.

    `height`, `width` are those of the upright image; `resolution` is the line that states the order of its pixels.
    `chromaticities` are the eight numbers of PRIMARIES, red, green, blue, white, or None. `correction` holds the factor
    that each channel was multiplied by.
    """

    height: int
    width: int
    resolution: tuple[str, str, int, str, str, int]
    is_xyz: bool
    chromaticities: tuple[float, ...] | None
    correction: tuple[float, ...]
    start: int


def read_header(path: Path) -> RadianceHeader:
    """Read the header of a file; raises `InputError` if it is not a Radiance header."""
    with existing_file(path).open("rb") as file:
        head = file.read(_LONGEST_HEADER)
    if not head.startswith((b"#?RADIANCE", b"#?RGBE", b"#?")):
        _refuse(path, "header", "not a Radiance picture", repr(head[:10]), "a file that begins with #?RADIANCE")
    is_xyz, chromaticities, correction = False, None, np.ones(3)
    start = 0
    while True:
        end = head.find(b"\n", start)
        if end < 0:
            _refuse(path, "header", "a header without an end", f"{len(head)} bytes", "a line such as -Y 512 +X 1024")
        line, start = head[start:end].strip(), end + 1
        if not line:
            continue
        if size := _SIZE.match(line):
            break
        name, _, value = line.partition(b"=")
        if name == b"FORMAT":
            if value.strip() not in (b"32-bit_rle_rgbe", b"32-bit_rle_xyze"):
                _refuse(path, "FORMAT", "unknown pixels", repr(value[:40]), "32-bit_rle_rgbe or 32-bit_rle_xyze")
            is_xyz = value.strip().endswith(b"xyze")
        elif name == b"PRIMARIES":
            chromaticities = tuple(_numbers(path, "PRIMARIES", value, 8))
        elif name == b"COLORCORR":
            correction = correction * _numbers(path, "COLORCORR", value, 3)
    first, second = size[2].decode(), size[5].decode()
    if first == second:
        _refuse(path, "resolution", "no picture of two sides", line.decode(), "a line such as -Y 512 +X 1024")
    counts = {first: int(size[3]), second: int(size[6])}
    order = (size[1].decode(), first, int(size[3]), size[4].decode(), second, int(size[6]))
    if not min(counts.values()):
        _refuse(path, "resolution", "a picture without pixels", line.decode(), "sides of one pixel or more")
    return RadianceHeader(counts["Y"], counts["X"], order, is_xyz, chromaticities, tuple(correction.tolist()), start)


def read_pixels(path: Path, header: RadianceHeader) -> Float[np.ndarray, "H W 3"]:
    """Read the upright image, row 0 at the top, float32; raises `InputError` if it is truncated or damaged."""
    data = np.frombuffer(path.read_bytes(), dtype=np.uint8)[header.start :]
    sign_of_lines, lines_along, lines, sign_within, _, within = header.resolution
    if lines * within > 4096 * max(data.size, 1):
        _refuse(path, "pixels", "cut short", f"{data.size} bytes", f"{within} x {lines} pixels")
    found = np.empty((lines, within, 4), dtype=np.uint8)
    at = 0
    for line in range(lines):
        at = _scanline(path, data, at, found[line], line)
    scale = np.where(found[..., 3:] > 0, np.ldexp(np.float32(1.0), found[..., 3:].astype(np.int32) - 136), 0.0)
    values = (found[..., :3] + np.float32(0.5)) * scale.astype(np.float32)
    values /= np.asarray(header.correction, dtype=np.float32)
    if lines_along == "X":
        values = values.transpose(1, 0, 2)
    up, right = (sign_of_lines, sign_within) if lines_along == "Y" else (sign_within, sign_of_lines)
    # -Y runs downwards, +X to the right.
    return np.ascontiguousarray(values[:: 1 if up == "-" else -1, :: 1 if right == "+" else -1])


def _scanline(path: Path, data: np.ndarray, at: int, into: UInt8[np.ndarray, "W 4"], line: int) -> int:
    """Decode one scanline from offset `at`; return the offset of the next."""
    width = len(into)
    head = data[at : at + 4]
    if head.size < 4:
        _cut(path, line)
    marked = head[0] == 2 and head[1] == 2 and head[2] < 128
    if _SHORTEST_RUN <= width <= _LONGEST_RUN and marked:
        if (int(head[2]) << 8 | int(head[3])) != width:
            found = f"{int(head[2]) << 8 | int(head[3])} pixels"
            _refuse(path, f"line {line}", "a line of another length", found, f"{width} pixels")
        at += 4
        for channel in range(4):
            at = _runs(path, data, at, into[:, channel], line)
        return at
    return _plain(path, data, at, into, line)


def _runs(path: Path, data: np.ndarray, at: int, into: UInt8[np.ndarray, " W"], line: int) -> int:
    """Decode the runs of one channel: a count above 128 repeats the next byte, any other is followed by that many
    bytes.
    """
    filled, width = 0, len(into)
    while filled < width:
        if at + 1 >= data.size:
            _cut(path, line)
        count = int(data[at])
        repeats = count > 128
        count -= 128 if repeats else 0
        if not 0 < count <= width - filled:
            _refuse(path, f"line {line}", "a run that is longer than its line", f"{count} pixels", "a whole picture")
        if repeats:
            into[filled : filled + count] = data[at + 1]
            at += 2
        else:
            piece = data[at + 1 : at + 1 + count]
            if piece.size < count:
                _cut(path, line)
            into[filled : filled + count] = piece
            at += 1 + count
        filled += count
    return at


def _plain(path: Path, data: np.ndarray, at: int, into: UInt8[np.ndarray, "W 4"], line: int) -> int:
    """Decode pixels in the old format: 1, 1, 1, n repeats the last pixel n times; consecutive such n have weights 1,
    256, ...
    """
    width = len(into)
    whole = data[at : at + 4 * width]
    if whole.size == 4 * width:
        pixels = whole.reshape(width, 4)
        if not (pixels[:, :3] == 1).all(axis=1).any():
            into[:] = pixels
            return at + 4 * width
    filled, shift = 0, 0
    while filled < width:
        pixel = data[at : at + 4]
        if pixel.size < 4:
            _cut(path, line)
        at += 4
        if (pixel[:3] == 1).all():
            count = int(pixel[3]) << shift
            if not filled or count > width - filled:
                _refuse(path, f"line {line}", "a run that fits nowhere", f"{count} pixels", "a whole picture")
            into[filled : filled + count] = into[filled - 1]
            filled, shift = filled + count, shift + 8
        else:
            into[filled] = pixel
            filled, shift = filled + 1, 0
    return at


def _numbers(path: Path, field: str, value: bytes, count: int) -> Float[np.ndarray, " n"]:
    try:
        numbers = np.array([float(word) for word in value.split()])
    except ValueError:
        numbers = np.empty(0)
    if numbers.size != count or not np.isfinite(numbers).all() or (field == "COLORCORR" and (numbers <= 0.0).any()):
        _refuse(path, field, "not what this line should hold", repr(value[:60]), f"{count} numbers")
    return numbers


def _cut(path: Path, line: int) -> NoReturn:
    _refuse(path, f"line {line}", "cut short", "the end of the file", "a whole picture")


def _refuse(path: Path, field: str, problem: str, found: str, expected: str) -> NoReturn:
    raise InputError(problem, file=path, field=field, found=found, expected=expected, hint=_AGAIN)
