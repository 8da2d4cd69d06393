"""Cost of reading a file, by its size or by its header: measured, with a margin of a third."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ...spectral.formats.exr import samples_in

# A text of numbers: its bytes, its words, the words as numbers.
_BYTES_A_BYTE, _SECONDS_A_BYTE = 13.0, 1.2e-6
# A pixel's channel: as stored, as float32 and float64, and while colours are counted.
_BYTES_A_SAMPLE, _SECONDS_A_SAMPLE = 42.0, 0.6e-6


@dataclass(frozen=True)
class ReadingCost:
    """Peak memory, and seconds of one core."""

    bytes: int
    seconds: float


def cost_of_bytes(path: Path, memory: float = _BYTES_A_BYTE, seconds: float = _SECONDS_A_BYTE) -> ReadingCost:
    """Estimate memory and seconds per byte of a file."""
    try:
        size = path.stat().st_size
    except OSError:
        size = 0
    return ReadingCost(round(memory * size), seconds * size)


def cost_of_picture(path: Path) -> ReadingCost:
    """Estimate the cost of an OpenEXR picture; compressed, a small file may expand to a large one."""
    samples = samples_in(path)
    return ReadingCost(round(_BYTES_A_SAMPLE * samples), _SECONDS_A_SAMPLE * samples)
