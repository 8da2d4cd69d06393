"""Cost of reading and fitting a material, estimated in advance; work beyond the memory is refused with figures.

Figures are measured, per byte of a file or per sample in its header, with a margin of a third.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ...runtime.errors import InputError
from ...runtime.memory import available_bytes, gigabytes
from ...runtime.worker_pool import usable_cores
from ..formats.registry import Format, ReadingCost, reading_cost

# A process that fits, without what it is given: measured, benchmarks/importing.py.
_WORKER_BYTES = 600 << 20
# Memory of a fit beside that, relative to its material's size.
_COPIES = 6
# Estimate up to which a system always finds room.
_HARMLESS_BYTES = 256 << 20
# Longest reading, seconds, that is not announced.
TOLD_S = 1.0


@dataclass(frozen=True)
class Jobs:
    """Number of processes for some fits, and the reason if there are fewer than requested, else ""."""

    count: int
    why: str = ""


def reading_too_large(reader: Format, path: Path, name: str) -> tuple[ReadingCost, InputError | None]:
    """Estimate the cost of reading a file, and return the error if memory is too small; `name` is for users."""
    cost = reading_cost(reader, path)
    return cost, _refusal(cost.bytes, "reading it takes more memory than there is", name, None)


def fit_too_large(size: int, name: str, material_id: str) -> InputError | None:
    """Return the error for a material of `size` bytes whose fit exceeds the memory."""
    if _COPIES * size <= _HARMLESS_BYTES:
        return None
    return _refusal(_WORKER_BYTES + _COPIES * size, "its fit takes more memory than there is", name, material_id)


def jobs_for(sizes: Sequence[int], wanted: int | None) -> Jobs:
    """Choose the number of processes: `wanted`, else one per core, limited by memory for the largest of `sizes`."""
    if not sizes:
        return Jobs(0)
    most = min(wanted or usable_cores(), len(sizes))
    free, each = available_bytes(), _WORKER_BYTES + _COPIES * max(sizes)
    if wanted is not None or free is None or most * each <= free:
        return Jobs(most)
    count = max(1, free // each)
    if count == most:
        return Jobs(most)
    why = f"{count} at a time instead of {most}: a fit takes up to {gigabytes(each)}, and {gigabytes(free)} are free"
    return Jobs(count, why)


def _refusal(needed: int, problem: str, name: str, field: str | None) -> InputError | None:
    free = available_bytes()
    if free is None or needed <= max(free, _HARMLESS_BYTES):
        return None
    return InputError(
        problem,
        file=name,
        field=field,
        found=f"about {gigabytes(needed)}",
        expected=f"at most the {gigabytes(free)} that are free",
        hint="close what else is running, use a machine with more memory, or split the file",
    )
