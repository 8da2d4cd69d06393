"""OpenEXR pictures opened with care: the header before the pixels, so that a damaged or huge one costs nothing."""

from __future__ import annotations

import io
import os
import threading
import warnings
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...runtime.errors import InputError
from ...runtime.files import existing_file, written_whole

MAGIC = b"\x76\x2f\x31\x01"
#: Samples over all channels that `read_exr` takes, 2 GB as float32: 4096 x 2048 pixels of 60 wavelengths.
MOST_SAMPLES = 2**29
_DAMAGE = (OSError, RuntimeError, ValueError, TypeError, KeyError, IndexError)
_ONE_AT_A_TIME = threading.Lock()
_AGAIN = "the picture is damaged or cut short: save or copy it again"


@dataclass(frozen=True)
class ExrPicture:
    """All channels (H,W) as stored, float16, float32 or uint32, by name; and the header's attributes.

    Channels of a second part, and on, have the part's name before their own.
    """

    attributes: Mapping[str, Any]
    channels: Mapping[str, np.ndarray]


def channel_names(path: Path, head: bytes) -> tuple[str, ...]:
    """Names of all channels of all parts; none where the file is no OpenEXR, or its header cannot be read."""
    if not head.startswith(MAGIC):
        return ()
    try:
        return tuple(name for header in _headers(path) for name in header.names)
    except InputError:
        return ()


def read_picture(path: Path, most: int) -> ExrPicture:
    """Return every pixel of every part.

    Parameters
    ----------
    most : samples, over all channels, above which the picture is refused before any is read.

    Raises
    ------
    InputError
        Not OpenEXR, cut short, damaged, or too large.
    """
    import OpenEXR

    headers = check_size(path, most)
    channels: dict[str, np.ndarray] = {}
    try:
        with _unheard(), OpenEXR.File(str(path), separate_channels=True) as file:
            for number, part in enumerate(file.parts):
                label = f"{part.header.get('name') or number}." if number else ""
                channels |= {label + name: np.asarray(at.pixels) for name, at in part.channels.items()}
    except _DAMAGE as reason:
        raise _unreadable(path, str(reason)) from None
    expected = sum(len(header.names) for header in headers)
    # A part that cannot be decompressed is left out without an error.
    if len(channels) != expected or any(pixels.ndim != 2 for pixels in channels.values()):
        raise _unreadable(path, f"{len(channels)} channels of {expected}")
    return ExrPicture(headers[0].attributes, channels)


def read_exr(path: str | Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Header attributes of the first part, and all channels (H,W) as float32 by name.

    Raises
    ------
    InputError
        As `read_picture`, for more than `MOST_SAMPLES`.
    """
    picture = read_picture(Path(path), MOST_SAMPLES)
    return dict(picture.attributes), {name: at.astype(np.float32) for name, at in picture.channels.items()}


def write_exr(path: str | Path, attributes: dict, channels: dict[str, np.ndarray]) -> None:
    """Write (H,W) channels, ZIP-compressed, beside the name and then in its place: float16 as it is, others as float32.

    Raises
    ------
    InputError
        The folder cannot be written to, or has no room.
    """
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **attributes}
    pixels = {
        name: np.ascontiguousarray(values, dtype=np.float16 if values.dtype == np.float16 else np.float32)
        for name, values in channels.items()
    }
    with written_whole(path) as beside, warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            OpenEXR.File(header, pixels).write(str(beside))
        except (RuntimeError, OSError) as reason:
            raise InputError(
                "the OpenEXR picture cannot be written",
                file=path,
                found=str(reason).strip().split("\n")[0].rpartition('". ')[2],
                expected="room on its disk; what was there before is still there",
                hint="make room, or name a folder on another disk; then give the same command again",
            ) from None


def samples_in(path: Path) -> int:
    """Numbers in all channels of all parts, as the header says; 0 where it cannot be read."""
    try:
        return sum(header.area * len(header.names) for header in _headers(path))
    except InputError:
        return 0


def check_size(path: Path, most: int) -> list[_Header]:
    """Return the headers of all parts; raises `InputError` where they cannot be read, or name more than `most`
    samples."""
    headers = _headers(existing_file(path))
    samples = sum(header.area * len(header.names) for header in headers)
    if samples > most:
        raise InputError(
            "too large a picture",
            file=path,
            field="dataWindow",
            found=f"{samples} samples",
            expected=f"at most {most}",
            hint="cut out a part, save it smaller, or with fewer wavelengths",
        )
    return headers


@dataclass(frozen=True)
class _Header:
    """One part: its attributes, the names of its channels, and its area in pixels."""

    attributes: dict[str, Any]
    names: tuple[str, ...]
    area: int

    @classmethod
    def of(cls, header: Mapping[str, Any]) -> _Header:
        low, high = header["dataWindow"]
        width, height = (max(0, int(high[axis]) - int(low[axis]) + 1) for axis in (0, 1))
        names = tuple(str(channel.name) for channel in header.get("channels", ()))
        return cls({name: value for name, value in header.items() if name != "channels"}, names, width * height)


def _headers(path: Path) -> list[_Header]:
    import OpenEXR

    try:
        with path.open("rb") as file:
            head = file.read(len(MAGIC))
        if head != MAGIC:
            raise InputError(
                "not an OpenEXR file",
                file=path,
                field="header",
                found=f"first bytes {head!r}" if head else "an empty file",
                expected=f"a picture that begins with {MAGIC!r}",
                hint=_AGAIN,
            )
        with _unheard(), OpenEXR.File(str(path), separate_channels=True, header_only=True) as file:
            headers = [_Header.of(part.header) for part in file.parts]
    except _DAMAGE as reason:
        raise _unreadable(path, str(reason)) from None
    if not headers or not all(header.names for header in headers):
        raise _unreadable(path, "no channels")
    return headers


@contextmanager
def _unheard() -> Iterator[None]:
    """Discard what the library itself writes to the terminal, a line a scanline of a damaged file: the refusal says it
    once."""
    with _ONE_AT_A_TIME, ExitStack() as stack:
        # Its Python part prints on standard output, its C part writes to the second file descriptor.
        stack.enter_context(redirect_stdout(io.StringIO()))
        # A stream that is closed is silent already.
        with suppress(OSError):
            kept = os.dup(2)
            stack.callback(os.close, kept)
            nowhere = os.open(os.devnull, os.O_WRONLY)
            stack.callback(os.close, nowhere)
            stack.callback(os.dup2, kept, 2)
            os.dup2(nowhere, 2)
        yield


def _unreadable(path: Path, reason: str) -> InputError:
    return InputError(
        "the OpenEXR file cannot be read",
        file=path,
        field="pixels" if "channels of" in reason else "header",
        # It may be a copy with a name that nobody gave.
        found=reason.replace(f" '{path}'", "").strip().split("\n")[0][:160],
        expected="a whole OpenEXR picture",
        hint=_AGAIN,
    )
