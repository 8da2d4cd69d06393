"""Parts that the benchmarks share: seconds and bytes of a call, the words of a command, and its figures as a file."""

from __future__ import annotations

import argparse
import json
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

Found = TypeVar("Found")


def timed(call: Callable[[], Found]) -> tuple[Found, float]:
    """Return what a call gives, and its seconds."""
    start = time.perf_counter()
    found = call()
    return found, time.perf_counter() - start


def best_ms(call: Callable[[], object], times: int = 5) -> float:
    """Return the least milliseconds of some calls: other work on the machine only adds to them."""
    return 1000.0 * min(timed(call)[1] for _ in range(times))


def peak_bytes(call: Callable[[], object]) -> int:
    """Return the most bytes that Python allocated at one time during a call, which this makes slower."""
    tracemalloc.start()
    try:
        call()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def command(text: str | None) -> argparse.ArgumentParser:
    """Return the words of a benchmark that is run by its module, whose `text` is the help; with `--json`."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, metavar="F", help="also write the figures to F")
    return parser


def write_json(path: Path | None, figures: object) -> None:
    """Write figures to a file, if one was asked for."""
    if path is not None:
        path.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
