"""Available memory, checked before work starts: work that cannot fit is refused with figures."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

from .errors import InputError

_GIGA = 1e9
_GROUP = Path("/sys/fs/cgroup")


def available_bytes() -> int | None:
    """Return the bytes that this process may still allocate without swapping others out; None if unknown.

    The minimum of the system's available memory, the remainder of the control group (containers), and that of the
    process's own address space.
    """
    found = [_system(), _control_group(), _address_space()]
    known = [number for number in found if number is not None]
    return min(known) if known else None


def gigabytes(number: int | float) -> str:
    """Format bytes for messages.

    >>> gigabytes(19_500_000_000), gigabytes(40_000_000)
    ('19.5 GB', '0.04 GB')
    """
    return f"{number / _GIGA:.3g} GB" if number >= 0.1 * _GIGA else f"{number / _GIGA:.1g} GB"


def check_room(needed: int, problem: str, found: str, hint: str, **place: Any) -> None:
    """Raise `InputError` if `needed` bytes are not free here; nothing is refused if that is unknown.

    `problem`, `found` and `hint` are its words, `place` its file and field.
    """
    free = available_bytes()
    if free is not None and needed > free:
        expected = f"at most {gigabytes(free)}, what is free here"
        raise InputError(problem, found=found, expected=expected, hint=hint, **place)


def _system() -> int | None:
    import psutil

    with suppress(OSError, psutil.Error):
        return psutil.virtual_memory().available
    return None


def _control_group() -> int | None:
    """Return the remaining bytes of the control group's limit; reclaimable pages of files count as free."""
    for limit, used, files in (
        ("memory.max", "memory.current", "inactive_file"),
        ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes", "total_inactive_file"),
    ):
        with suppress(OSError, ValueError):
            most = int((_GROUP / limit).read_text())
            taken = int((_GROUP / used).read_text())
            stated = dict(line.split() for line in (_GROUP / limit).with_name("memory.stat").read_text().splitlines())
            return max(0, most - taken + int(stated.get(files, 0)))
    return None


def _address_space() -> int | None:
    """Return the remainder of the limit on the process's address space; Windows and macOS have none."""
    import psutil

    with suppress(ImportError, OSError, ValueError, psutil.Error):
        import resource

        most = resource.getrlimit(resource.RLIMIT_AS)[0]
        if most != resource.RLIM_INFINITY:
            return max(0, most - psutil.Process().memory_info().vms)
    return None
