"""What fluorescence does to colour, and how few numbers carry it from surface to surface.

    python -m benchmarks.fluorescence [FILE.exr] [--json OUT.json]

FILE.exr is a bispectral image (every distinct pixel is a surface); without it two dyes made up for the purpose are
taken. What is computed stands in `metamer.calibration.fluorescence_benchmark`; `metamer bench factor` draws the same
surfaces.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from metamer.calibration.fluorescence_benchmark import direct, made_up, report, surfaces_of, two_surfaces


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", nargs="?", type=Path)
    parser.add_argument("--json", type=Path)
    chosen = parser.parse_args(arguments)
    surfaces = surfaces_of(chosen.file) if chosen.file else made_up()
    figures = {"direct": direct(surfaces), "two_surfaces": two_surfaces(surfaces)}
    print(report(figures))
    if chosen.json:
        chosen.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
