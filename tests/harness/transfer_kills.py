"""Does SIGKILL do a build of rays any harm?

    python tests/harness/transfer_kills.py [--rounds 5] [--kills 20] [--jobs 2] [--json OUT.json]

A round is one folder: `metamer transfer build` is killed so many times, some times one of its workers first, most
times shortly after it has kept another block, else before it has; after each kill every block that is there must be one
of an undisturbed build, bit for bit; in the end the same command must finish, leave nothing half-written, and have the
bytes of the undisturbed build. Linux only: processes are found in /proc.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from kills import contents, gone_within
from metamer.benchmarks import timing
from metamer.benchmarks.importing import processes_of, started, timed_command
from metamer.materials.intake.importing import import_sources
from metamer.runtime.files import half_written
from patience import patient

SCENE = """
[[part]]
shape = "plane"
scale = 3
material = "grey/n1"
"""
FAMILY = """family = "grey"
kind = "analytic"
[[material]]
name = "n1"
model = "lambert"
reflectance = { constant = 0.5 }
"""
BALL = """
[[part]]
name = "ball {n}"
shape = "sphere"
subdivisions = 5
scale = 0.45
translate = [{x}, 0.5, {z}]
material = "grey/n1"
"""


def scene_file(folder: Path, balls: int) -> Path:
    """A floor with balls of some 10,000 vertices each, and a catalogue of its one material."""
    (folder / "grey.toml").write_text(FAMILY, encoding="utf-8")
    import_sources([folder / "grey.toml"], folder / "catalogue", jobs=1)
    text = SCENE + "".join(BALL.format(n=n, x=n % 3 - 1.0, z=n // 3 - 1.0) for n in range(balls))
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    return folder / "scene.toml"


def command(scene: Path, folder: Path, jobs: int, rays: int) -> list[str]:
    """The words of one build, in a Python of its own."""
    words = ["transfer", "build", str(scene), "--into", str(folder), "--rays", str(rays), "--processes", str(jobs)]
    return [sys.executable, "-m", "metamer.cli.main", *words, "--catalogue", str(scene.parent / "catalogue")]


def killed_round(
    folder: Path, scene: Path, expected: dict[str, str], seconds: float, kills: int, jobs: int, rays: int, seed: int
) -> dict:
    """Kill a build so often, then finish it; raises where anything but a whole block is there, or another byte."""
    rng, hits, there = random.Random(seed), {"command": 0, "worker": 0, "nothing": 0}, []
    for _ in range(kills):
        with started(command(scene, folder, jobs, rays)) as (process, _):
            # Some times before there is any block more.
            _another_block(process, folder, rng.uniform(0.0, seconds) if rng.random() < 0.2 else 600.0)
            time.sleep(rng.uniform(0.0, 0.03))
            living = processes_of(process.pid)
            if len(living) > 1 and rng.random() < 0.3:
                # The command goes on without it, until it is hit as well.
                _kill(rng.choice(living[1:]))
                hits["worker"] += 1
                _another_block(process, folder)
                living = processes_of(process.pid)
            hits["command" if process.poll() is None else "nothing"] += 1
            _kill(process.pid)
            process.wait(timeout=patient(600))
        for pid in living[1:]:
            gone_within(pid, 10.0)
        whole = {name: held for name, held in contents(folder).items() if not name.startswith(".")}
        if not whole.items() <= expected.items():
            raise RuntimeError(f"a block that no undisturbed build has: {sorted(set(whole) - set(expected))}")
        there.append(len(whole))
    timed_command(command(scene, folder, jobs, rays))
    if half_written(folder) or contents(folder) != expected:
        raise RuntimeError("other bytes than an undisturbed build")
    return {**hits, "blocks": there}


def _another_block(process: subprocess.Popen, folder: Path, patience: float = 600.0) -> None:
    """Wait until there is a block more, or the process is done, or for so many seconds."""

    def blocks() -> int:
        return len(list(folder.glob("[!.]*")))

    before, begun = blocks(), time.monotonic()
    while process.poll() is None and blocks() == before and time.monotonic() - begun < patience:
        time.sleep(0.001)


def _kill(pid: int) -> None:
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)


def rounds(
    folder: Path,
    count: int,
    kills: int,
    jobs: int,
    balls: int = 6,
    rays: int = 256,
    tell: Callable[[str], None] = lambda line: None,
) -> list[dict]:
    """Run so many rounds; raise where one ends with other bytes, or two undisturbed builds differ."""
    scene, whole = scene_file(folder, balls), folder / "undisturbed"
    timed_command(command(scene, whole, 1, rays))
    expected = contents(whole)
    shutil.rmtree(whole)
    seconds = timed_command(command(scene, whole, jobs, rays))["seconds"]
    if contents(whole) != expected:
        raise RuntimeError("two builds that nobody disturbed differ")
    found = []
    for number in range(count):
        folder_ = folder / f"round {number}"
        found.append(killed_round(folder_, scene, expected, seconds, kills, jobs, rays, number))
        tell(f"{number + 1}/{count}: {found[-1]}, of {len(expected)} blocks")
    return found


def main(words: list[str] | None = None) -> int:
    """Kill, finish, compare, tell."""
    parser = timing.command(__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--jobs", type=int, default=2)
    args = parser.parse_args(words)
    with tempfile.TemporaryDirectory() as private:
        rows = rounds(Path(private), args.rounds, args.kills, args.jobs, tell=lambda line: print(line, flush=True))
    killed = {what: sum(row[what] for row in rows) for what in ("command", "worker", "nothing")}
    print(f"{killed['command']} kills of the command, {killed['worker']} of a worker, {killed['nothing']} too late;")
    print("all blocks were whole, and all builds ended with the same bytes")
    timing.write_json(args.json, rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
