"""Speed of importing a folder of materials, and of importing it again.

    python -m metamer.benchmarks.importing [--materials 200] [--jobs 2] [--json OUT.json]

The materials are generated: smooth reflectances in one CSV table, and descriptions that make diffuse, rough and glossy
surfaces of them. `peak` is the high-water mark of resident memory (VmHWM) of the command and of its largest worker.
Linux only: processes are found in /proc.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from ..materials.catalogue.catalogue import Catalogue
from . import timing

TABLES = """
[chart]
file = "chart.csv"
source = "Reflectances generated for a benchmark"
licence = "CC0 1.0"
geometry = "45:0"
"""
FAMILY = """
family = "{family}"
kind = "analytic"

[[material]]
each = "chart"
name = "{{column}}-{family}"
model = "{model}"
{parameters}
"""
SURFACES = {
    "matt": ("lambert", 'reflectance = { table = "chart", column = "{column}" }'),
    "rough": ("oren_nayar", 'reflectance = { table = "chart", column = "{column}" }\nsigma = 0.35'),
    "satin": (
        "ashikhmin_shirley",
        'diffuse = { table = "chart", column = "{column}" }\nspecular = { constant = 0.04 }\n'
        "exponent_u = 25.0\nexponent_v = 25.0",
    ),
}


def generated(folder: Path, materials: int, surfaces: tuple[str, ...] = tuple(SURFACES)) -> Path:
    """Return a source folder of at least `materials` materials, equal parts of each surface."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(7)
    nm = np.arange(380, 781, 10)
    columns = -(-materials // len(surfaces))
    steps = rng.uniform(-4, 4, (columns, 1)) * np.tanh((nm - rng.uniform(430, 680, (columns, 1))) / 60.0)
    values = 0.04 + 0.86 / (1 + np.exp(-steps - rng.uniform(-2, 2, (columns, 1))))
    rows = [",".join(["wavelength_nm", *(f"c{number:03}" for number in range(columns))])]
    rows += [
        ",".join([f"{wavelength}", *(f"{value:.5f}" for value in column)])
        for wavelength, column in zip(nm, values.T, strict=True)
    ]
    (folder / "chart.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    (folder / "sources.toml").write_text(TABLES, encoding="utf-8")
    for name in surfaces:
        model, parameters = SURFACES[name]
        text = FAMILY.format(family=name, model=model, parameters=parameters)
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    return folder


def import_command(source: Path, catalogue: Path, jobs: int, *more: str) -> list[str]:
    """Return the words of one import, in a Python of its own."""
    return [
        *(sys.executable, "-m", "metamer.cli.main", "catalogue", "import", str(source)),
        *("--into", str(catalogue), "--jobs", str(jobs), *more),
    ]


@contextmanager
def started(words: list[str]) -> Iterator[tuple[subprocess.Popen, Callable[[], str]]]:
    """The command at work, and what it has said: into a file, since a pipe that nobody reads would stop it."""
    with tempfile.TemporaryFile() as said:

        def text() -> str:
            said.seek(0)
            return said.read().decode()

        with subprocess.Popen(words, stdout=said, stderr=subprocess.STDOUT) as process:
            yield process, text


def processes_of(pid: int) -> list[int]:
    """Return a process and all that it started, directly or not."""
    found = [pid]
    for parent in found:
        try:
            for task in Path(f"/proc/{parent}/task").iterdir():
                found += [int(child) for child in (task / "children").read_text().split()]
        except OSError:
            continue
    return found


def peak_bytes(pid: int) -> int:
    """High-water mark of a process's resident memory; 0 where it is gone."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except OSError:
        return 0
    return next((int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM")), 0)


def timed_command(words: list[str]) -> dict:
    """Seconds of one command, and peak memory of it and of its largest worker."""
    begin = time.perf_counter()
    peaks: dict[int, int] = {}
    with started(words) as (process, text):
        while process.poll() is None:
            for pid in processes_of(process.pid):
                peaks[pid] = max(peaks.get(pid, 0), peak_bytes(pid))
            time.sleep(0.02)
        seconds, said = time.perf_counter() - begin, text()
    if process.returncode:
        raise RuntimeError(f"exit code {process.returncode}: {said}")
    own = peaks.pop(process.pid, 0)
    return {"seconds": seconds, "peak_command": own, "peak_worker": max(peaks.values(), default=0), "said": said}


def import_row(materials: int, jobs: int, folder: Path) -> dict:
    """One import of generated materials, and a second one with nothing to do."""
    source, catalogue = generated(folder / "source", materials), folder / "catalogue"
    first = timed_command(import_command(source, catalogue, jobs))
    count = len(Catalogue.open(catalogue).ids())
    again = min(
        (timed_command(import_command(source, catalogue, jobs)) for _ in range(3)), key=lambda run: run["seconds"]
    )
    assert f"{count} skipped" in again["said"], again["said"]
    return {
        "materials": count,
        "jobs": jobs,
        "seconds": first["seconds"],
        "materials_per_second": count / first["seconds"],
        "peak_command_mib": first["peak_command"] / 2**20,
        "peak_worker_mib": first["peak_worker"] / 2**20,
        "second_run_seconds": again["seconds"],
        "catalogue_mib": sum(path.stat().st_size for path in catalogue.rglob("*.h5")) / 2**20,
    }


def main(words: list[str] | None = None) -> int:
    """Measure, print and store."""
    parser = timing.command(__doc__)
    parser.add_argument("--materials", type=int, default=200)
    parser.add_argument("--jobs", type=int, default=2)
    args = parser.parse_args(words)
    with tempfile.TemporaryDirectory() as private:
        found: dict = import_row(args.materials, args.jobs, Path(private) / "speed")
        for name, value in found.items():
            print(f"{name:22} {value:.3f}" if isinstance(value, float) else f"{name:22} {value}")
    timing.write_json(args.json, found)
    return 0


if __name__ == "__main__":
    sys.exit(main())
