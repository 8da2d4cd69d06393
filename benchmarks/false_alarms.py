"""The shipped review rendered again and again where nothing has changed but what rounds: does `metamer report` say so?

The review of `examples/sphere.toml` is recorded once, by numpy, with one thread and the first kernel of OpenBLAS. Then
it is rendered anew by OpenGL and by numpy, with one thread of BLAS and with two, under two kernels, and compared with
what was recorded, as `metamer report run` does. Whatever moved there moved by rounding: a row that is called changed,
or that warns or fails, is a false alarm.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from ..calibration.report.text_tables import columns
from ..runtime.errors import InputError
from .timing import command, write_json

RENDERERS = ("gl", "software")
THREADS = (1, 2)
#: Kernels of OpenBLAS, of which the first two that run here are taken: of other processors the others do.
KERNELS = ("SkylakeX", "Haswell", "Prescott", "NEOVERSEN1", "ARMV8")
# The process ends by a signal where the processor lacks what the kernel takes.
_TRIED = (
    "import numpy as np; from metamer.runtime.blas import blas; "
    "a = np.ones((300, 300)); a = a @ a; print(blas().kernel)"
)
_SAME = ("same", "identical")


def kernels_here() -> tuple[str, ...]:
    """Return the first two of `KERNELS` that multiply on this processor; two names of one kernel are one."""
    found: dict[str, str] = {}
    for name in KERNELS:
        if len(found) == 2:
            break
        done = subprocess.run([sys.executable, "-c", _TRIED], env=_environment(name, 1), capture_output=True, text=True)
        if done.returncode == 0 and done.stdout.strip():
            found.setdefault(done.stdout.strip(), name)
    return tuple(found.values())


def run(
    catalogue: Path,
    pattern: str = "*",
    size: int = 64,
    repeats: int = 24,
    kernels: Sequence[str] | None = None,
    crossed: bool = True,
    say: Callable[[str], None] = lambda line: None,
) -> dict:
    """Render and compare.

    Parameters
    ----------
    repeats : at least so many, alike in every way of rounding.
    kernels : of OpenBLAS; None takes two that run here.
    crossed : each number of threads with each kernel; or, in half of the time, the first with the first and the last
        with the last.

    Returns
    -------
    dict for JSON: `size`, `kernels`, and `rows`, a row a repeat: `renderer`, `threads`, `kernel`, `rows` (how many were
    compared), `identical`, `same`, `alarms`; and `mean` with `floor_mean`, `max` with `floor_max`: of all layers those
    whose ΔE94 come nearest to what is stated that rounding may come to.

    Raises
    ------
    InputError : fewer than two kernels run here, or a process failed.
    """
    kernels = kernels_here() if kernels is None else tuple(kernels)
    if len(kernels) < 2:
        raise InputError(
            "one way of rounding is none to compare with",
            field="kernels",
            found=", ".join(kernels) or "no kernel of OpenBLAS that runs here",
            expected="two of OpenBLAS",
            hint="name two that this processor runs: --kernels Haswell,Prescott",
        )
    ways = [(kernel, threads) for kernel in kernels for threads in THREADS]
    ways = ways if crossed else [ways[0], ways[-1]]
    rounds = -(-repeats // (len(ways) * len(RENDERERS)))
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        words = ["--catalogue", str(catalogue.resolve()), "--materials", pattern, "--size", str(size)]
        _worker(["--record", folder, *words], kernels[0], THREADS[0])
        for number, (kernel, threads) in enumerate(ways):
            out = str(place / f"out{number}")
            said = _worker(["--against", folder, "--out", out, "--rounds", str(rounds), *words], kernel, threads)
            for line in said.splitlines():
                rows.append({"kernel": kernel, "threads": threads} | json.loads(line))
            say(f"{kernel}, threads {threads}: {rounds * len(RENDERERS)} repeats")
    return {"size": size, "kernels": list(kernels), "rows": rows}


def report(figures: dict) -> str:
    """Return the figures as a table, a line a way of rounding."""
    groups: dict[tuple, list[dict]] = {}
    for row in figures["rows"]:
        groups.setdefault((row["renderer"], str(row["threads"]), row["kernel"]), []).append(row)
    body = []
    for way, found in groups.items():
        counts = [str(sum(row[key] for row in found)) for key in ("rows", "identical", "same", "alarms")]
        mean, most = max(found, key=lambda row: row["mean"]), max(found, key=lambda row: row["max"])
        ends = [f"{one[key]:.2g} of {one[f'floor_{key}']:.2g}" for key, one in (("mean", mean), ("max", most))]
        body.append([*way, str(len(found)), *counts, *ends])
    headings = ["renderer", "threads", "kernel", "repeats", "rows", "identical", "same", "false alarms"]
    alarms = sum(row["alarms"] for row in figures["rows"])
    last = f"{len(figures['rows'])} repeats, {sum(row['rows'] for row in figures['rows'])} rows, {alarms} false alarms"
    return f"{columns([*headings, 'mean of floor', 'max of floor'], body, left=3)}\n{last}"


def _environment(kernel: str, threads: int) -> dict[str, str]:
    return {**os.environ, "OPENBLAS_CORETYPE": kernel, "OPENBLAS_NUM_THREADS": str(threads)}


def _worker(words: Sequence[str], kernel: str, threads: int) -> str:
    """Run a process of this module that rounds so, and return what it prints."""
    line = [sys.executable, "-m", "metamer.benchmarks.false_alarms", *words]
    done = subprocess.run(line, env=_environment(kernel, threads), capture_output=True, text=True, encoding="utf-8")
    if done.returncode:
        last = " ".join(done.stderr.split("\n")[-4:]).strip() or f"exit code {done.returncode}"
        raise InputError("a process of the benchmark failed", field=f"{kernel}, threads {threads}", found=last)
    return done.stdout


def _record(folder: Path, catalogue: Path, pattern: str, size: int) -> None:
    """The baseline that all are held against."""
    from ..calibration.regression.baseline import record
    from ..calibration.regression.suite import read_suite
    from ..materials.catalogue.catalogue import Catalogue
    from ..viewer.api import renderer_named
    from ..viewer.suite_run import environment, run_suite
    from .injected_changes import shipped_suite

    suite = read_suite(shipped_suite(folder / "suite", pattern, size))
    with renderer_named("software")[0] as renderer:
        side = run_suite(suite, Catalogue.open(catalogue), folder / "first", renderer)
    record(side, folder / "baseline", suite.said, environment())


def _against(folder: Path, catalogue: Path, out: Path, rounds: int) -> None:
    """Render and compare so many times by each renderer, and print a line of JSON each time."""
    from ..calibration.regression.baseline import as_recorded, baseline_side
    from ..calibration.regression.comparison import compare
    from ..calibration.regression.suite import read_suite
    from ..materials.catalogue.catalogue import Catalogue
    from ..viewer.api import renderer_named
    from ..viewer.gl.context import NoGL
    from ..viewer.suite_run import run_suite

    suite, before = read_suite(folder / "suite" / "suite.toml"), as_recorded(baseline_side(folder / "baseline"))
    for name in RENDERERS:
        try:
            renderer = renderer_named(name)[0]
        except NoGL:
            # Without a driver numpy is all that there is to round otherwise; the table shows it.
            continue
        with renderer:
            for _ in range(rounds):
                side = run_suite(suite, Catalogue.open(catalogue), out / name, renderer, again=True)
                found = compare(before, as_recorded(side), suite.criteria)
                states = Counter(row.state for row in found.rows)
                layers = [layer for row in found.rows for layer in row.layers.values()]
                mean = max(layers, key=lambda one: one.mean / max(one.floor_mean, 1e-12))
                most = max(layers, key=lambda one: one.max / max(one.floor_max, 1e-12))
                quiet = [row for row in found.rows if row.state in _SAME and row.tier == "pass"]
                figures = {
                    "renderer": name,
                    "rows": len(found.rows),
                    **{state: states[state] for state in _SAME},
                    "alarms": len(found.rows) - (len(quiet) if found.valid else 0),
                    "mean": mean.mean,
                    "floor_mean": mean.floor_mean,
                    "max": most.max,
                    "floor_max": most.floor_max,
                }
                print(json.dumps(figures), flush=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Return the command; 1 where there was a false alarm."""
    parser = command(__doc__)
    parser.add_argument("--catalogue", type=Path, metavar="CAT", help="default: as everywhere")
    parser.add_argument("--materials", default="*", metavar="PATTERN", help="default: all")
    parser.add_argument("--size", type=int, default=64, metavar="PX", help="width of the pictures (64)")
    parser.add_argument("--repeats", type=int, default=24, metavar="N", help="at least (24)")
    parser.add_argument(
        "--kernels", type=lambda text: text.split(","), metavar="A,B", help="default: two that run here"
    )
    # Arguments that the first process gives the others of this benchmark.
    for name, kind in (("--record", Path), ("--against", Path), ("--out", Path), ("--rounds", int)):
        parser.add_argument(name, type=kind, help="of its own processes")
    args = parser.parse_args(arguments)
    from ..materials.catalogue.catalogue import default_catalogue

    catalogue = args.catalogue or default_catalogue()
    if args.record is not None:
        _record(args.record, catalogue, args.materials, args.size)
        return 0
    if args.against is not None:
        _against(args.against, catalogue, args.out, args.rounds)
        return 0
    figures = run(catalogue, args.materials, args.size, args.repeats, args.kernels)
    print(report(figures))
    write_json(args.json, figures)
    return int(any(row["alarms"] for row in figures["rows"]))


if __name__ == "__main__":
    sys.exit(main())
