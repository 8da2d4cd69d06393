"""Does SIGKILL do an import any harm?

    python tests/harness/kills.py [--kills 50] [--jobs 2] [--json OUT.json]

A kill is SIGKILL to a process of the command, drawn at random (the command itself or a worker), at a random moment;
then the catalogue must open and verify, and the same command must end with the bytes of an import that nobody
disturbed. Linux only: processes are found in /proc.
"""

from __future__ import annotations

import hashlib
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from metamer.benchmarks import timing
from metamer.benchmarks.importing import generated, import_command, processes_of, started, timed_command
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.intake import import_history
from metamer.materials.records.record import MARKER
from metamer.runtime.files import half_written
from patience import patient


def contents(catalogue: Path) -> dict[str, str]:
    """SHA-256 of every file of a catalogue, hidden ones too; not of what it knows of files, which holds their times."""
    return {
        path.relative_to(catalogue).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(catalogue.rglob("*"))
        if path.is_file() and path.name != import_history.FILE
    }


def killed_import(source: Path, catalogue: Path, jobs: int, seconds: float, rng: random.Random) -> dict:
    """Kill one process of an import within `seconds`; what was hit and what was left. Raises where that is damaged."""
    with started(import_command(source, catalogue, jobs)) as (process, text):
        moment = rng.uniform(0.0, seconds)
        time.sleep(moment)
        there = processes_of(process.pid)
        # Every other time the command itself: it is one process among several.
        victim = process.pid if rng.random() < 0.5 else rng.choice(there)
        hit = process.poll() is None
        if hit:
            try:
                os.kill(victim, signal.SIGKILL)
            except ProcessLookupError:
                hit = False
        process.wait(timeout=patient(600))
        said = text()
    for pid in there[1:]:
        gone_within(pid, 10.0)
    left, done = [], 0
    if (catalogue / MARKER).exists():
        opened = Catalogue.open(catalogue)
        damaged = {name: str(reason) for name, reason in opened.verify().items() if reason is not None}
        if damaged:
            raise RuntimeError(f"damaged after a kill at {moment:.3f} s: {damaged}")
        left, done = [path.name for path in half_written(catalogue)], len(opened.ids())
    return {
        "moment": moment,
        "hit": ("command" if victim == process.pid else "worker") if hit else "nothing",
        "code": process.returncode,
        "materials": done,
        "leftovers": len(left),
        "said": said,
    }


def gone_within(pid: int, seconds: float) -> None:
    """Raises where a process still lives after that time."""
    deadline = time.monotonic() + patient(seconds)
    while Path(f"/proc/{pid}").exists() and "Z (zombie)" not in _status(pid):
        if time.monotonic() > deadline:
            raise RuntimeError(f"process {pid} outlived the import")
        time.sleep(0.02)


def _status(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return "Z (zombie)"


def kills(
    folder: Path, source: Path, jobs: int, count: int, seed: int = 1, tell: Callable[[str], None] = lambda line: None
) -> list[dict]:
    """`count` imports that are killed once each, then completed; raises where one ends with other bytes."""
    whole = folder / "undisturbed"
    seconds = timed_command(import_command(source, whole, jobs))["seconds"]
    expected, rng, found = contents(whole), random.Random(seed), []
    for number in range(count):
        catalogue = folder / "killed"
        shutil.rmtree(catalogue, ignore_errors=True)
        row = killed_import(source, catalogue, jobs, seconds, rng)
        timed_command(import_command(source, catalogue, jobs))
        if (after := contents(catalogue)) != expected:
            differing = sorted(set(after.items()) ^ set(expected.items()))
            raise RuntimeError(f"other bytes after {row}: {differing}")
        found.append(row)
        tell(f"{number + 1}/{count}: {row['hit']} killed at {row['moment']:.2f} s, {row['materials']} materials there")
    return found


def main(words: list[str] | None = None) -> int:
    """Kill, complete, compare, tell."""
    parser = timing.command(__doc__)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--jobs", type=int, default=2)
    args = parser.parse_args(words)
    with tempfile.TemporaryDirectory() as private:
        source = generated(Path(private) / "few", 12)
        rows = kills(Path(private), source, args.jobs, args.kills, tell=lambda line: print(line, flush=True))
    hits = [row["hit"] for row in rows]
    print(
        f"{len(rows)} kills: {hits.count('command')} of the command, {hits.count('worker')} of a worker, "
        f"{hits.count('nothing')} too late; leftovers cleared {sum(row['leftovers'] for row in rows)}; "
        "all catalogues opened, verified and ended with the same bytes"
    )
    timing.write_json(args.json, [{key: value for key, value in row.items() if key != "said"} for row in rows])
    return 0


if __name__ == "__main__":
    sys.exit(main())
