"""What a spectrum costs a pixel, as a table. `python benchmarks/shading.py [--size N] [--rank R] [--json FILE]`."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from metamer.viewer import shading_benchmark


def run(size: int = 1024, rank: int = 16, repeats: int = 21) -> dict:
    """Measure, and return what was measured."""
    return shading_benchmark.run(size, rank, repeats)


def report(measured: dict) -> str:
    """The tables as text."""
    lines = []
    for title, header, rows in shading_benchmark.tables(measured):
        widths = [max(len(row[k]) for row in (header, *rows)) for k in range(len(header))]
        lines.append(title)
        for row in (header, *rows):
            cells = [
                row[0].ljust(widths[0]),
                *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)),
            ]
            lines.append("  " + "  ".join(cells))
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> None:
    """Measure, print, and write JSON where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=int, default=1024, help="pixels along a side (default 1024: one megapixel)")
    parser.add_argument("--rank", type=int, default=16, help="terms of the factor pack (default 16)")
    parser.add_argument("--repeats", type=int, default=21, help="turns of each way; the median counts (default 21)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures here")
    options = parser.parse_args(arguments)
    measured = run(options.size, options.rank, options.repeats)
    print(report(measured))
    if options.json:
        options.json.write_text(json.dumps(measured, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
