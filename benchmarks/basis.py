"""Bases and grids: error in ΔE94 and time, printed as tables. `python benchmarks/basis.py [--json FILE]`."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from metamer.calibration import basis_benchmark


def run(sizes: tuple[int, ...] = basis_benchmark.SIZES, spectra: int = 100_000) -> dict:
    """Measure, and return what was measured."""
    return basis_benchmark.run(sizes, spectra)


def main(arguments: list[str] | None = None) -> None:
    """Measure, print, and write JSON where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures here")
    options = parser.parse_args(arguments)
    measured = run()
    print(basis_benchmark.report(measured))
    if options.json:
        options.json.write_text(json.dumps(measured, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
