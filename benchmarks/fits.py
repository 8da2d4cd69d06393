"""Fits under different rounding: terms, error, bounds and CPU time of materials under several kernels of OpenBLAS.

    python -m metamer.benchmarks.fits [FILE ...] [--kernels Haswell,SkylakeX,Zen,Prescott] [--budget 0.5] [--json F]

FILE is whatever an import takes (folders, zip files, measurements); without one, the materials that are shipped. Each
kernel works in a process of its own, one thread, one after the other: kernels add up in different orders, so that paths
of a fit part in the last digit. What must hold under all of them: the bounds of shading (`lowest` >= -0.02 of white,
`largest` <= 2 times the original's). `p99` is ΔE94 under the worst of the lights that a fit is judged by, on the sphere
protocol, reference = original at every wavelength; `highlight` that of the highlight's own pixels. Seconds are of the
CPU.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

from ..runtime.worker_pool import one_thread
from .timing import command, write_json

KERNELS = ("Haswell", "SkylakeX", "Zen", "Prescott")


def fitted(sources: Sequence[Path], budget: float) -> Iterator[dict]:
    """Yield a row for each material of `sources` that has a surface."""
    from ..materials.core.brdf import Brdf
    from ..materials.fitting.fit import fit
    from ..materials.intake.sources import read_sources
    from ..materials.records.models import SPECTRA, rebuild
    from ..materials.records.source import MaterialSource

    for source in sources:
        for material in read_sources(source):
            if not isinstance(material, MaterialSource) or material.model in SPECTRA:
                continue
            brdf = rebuild(material.model, material.parameters)
            if brdf.own_form() is not None or not isinstance(brdf, Brdf):
                continue
            begun = time.process_time()
            found = fit(brdf, budget=budget)
            yield {
                "material": material.id,
                "terms": found.rank,
                "p99": found.error.p99,
                "light": found.error.light,
                "highlight": found.error.highlight,
                "lowest": found.error.most_negative,
                "largest": found.error.largest,
                "seconds": time.process_time() - begun,
            }


def under(kernel: str, sources: Sequence[Path], budget: float) -> Iterator[dict]:
    """Yield the rows of `fitted` from a process that adds up as `kernel` does."""
    words = [sys.executable, "-m", "metamer.benchmarks.fits", *map(str, sources), "--budget", str(budget), "--worker"]
    environment = {**os.environ, "OPENBLAS_CORETYPE": kernel}
    with subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            yield {"kernel": kernel, **json.loads(line)}
    if process.returncode:
        raise SystemExit(f"the fits under {kernel} ended with {process.returncode}")


def kernel_table(rows: Sequence[dict]) -> str:
    """Return a line a material: the least and the most of everything under all kernels."""
    groups: dict[str, list[dict]] = defaultdict(list)
    for row in rows:
        groups[row["material"]].append(row)
    width = max(len(name) for name in groups)
    lines = [f"{'':{width}s}  {'terms':>7}  {'p99':>13}  {'lowest':>8}  {'largest':>7}  {'seconds':>7}"]
    for name, found in groups.items():
        terms, p99 = ([row[key] for row in found] for key in ("terms", "p99"))
        lowest, largest = min(row["lowest"] for row in found), max(row["largest"] or 0.0 for row in found)
        seconds = max(row["seconds"] for row in found)
        ends = f"{lowest:8.4f}  {largest:7.2f}  {seconds:7.1f}"
        lines.append(f"{name:{width}s}  {_span(terms, 'd'):>7}  {_span(p99, '.3f'):>13}  {ends}")
    return "\n".join(lines)


def _span(values: list, form: str) -> str:
    low, high = format(min(values), form), format(max(values), form)
    return low if low == high else f"{low} {high}"


def main(words: Sequence[str] | None = None) -> int:
    """Measure, print, write; 1 where a bound was broken."""
    parser = command(__doc__)
    parser.add_argument("sources", nargs="*", type=Path, metavar="FILE")
    parser.add_argument("--kernels", type=lambda text: text.split(","), default=list(KERNELS))
    parser.add_argument("--budget", type=float, default=0.5)
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    args = parser.parse_args(words)
    if args.worker:
        one_thread()
        for row in fitted(args.sources, args.budget):
            print(json.dumps(row), flush=True)
        return 0
    from ..materials.catalogue.shipped import shipped_sources
    from ..materials.fitting.bounds import Extremes

    rows = []
    for kernel in args.kernels:
        for row in under(kernel, args.sources or [shipped_sources()], args.budget):
            rows.append(row)
            print(
                f"{kernel}: {row['material']}, {row['terms']} terms, p99 {row['p99']:.3f}", file=sys.stderr, flush=True
            )
    if not rows:
        raise SystemExit("none of these files holds a surface that is fitted")
    print(kernel_table(rows))
    write_json(args.json, rows)
    return int(not all(Extremes(row["lowest"], row["largest"] or 0.0).within for row in rows))


if __name__ == "__main__":
    sys.exit(main())
