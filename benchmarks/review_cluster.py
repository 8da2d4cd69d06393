"""Speed of a review on a cluster: measured with one and two local workers, and simulated for many from measured costs.

    python -m metamer.benchmarks.review_cluster [--materials 24] [--json OUT.json]

The tasks of a review are its materials, independent of one another; the client starts, lays each result down, and
writes the page. In the simulation each worker takes the next task when it is free, the client takes results one by one,
and the first task of a shape costs each worker what it costs one process: sums that later tasks find ready.
"""

from __future__ import annotations

import heapq
import statistics
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..lighting.scene_file.files import load_scene, shipped_scene
from ..materials.catalogue.catalogue import Catalogue
from ..materials.intake.importing import import_sources
from ..viewer.review.review import review
from ..viewer.software.backend import software_session
from .importing import generated
from .timing import command, write_json

_LIGHTS = ("D65", "A", "FL11")
_PIXELS = 64


def scheduled(tasks: Sequence[float], workers: int, first: float = 0.0, client: float = 0.0) -> float:
    """Return the seconds until the last of the tasks is done and taken.

    first : more that each worker needs before its first task. client : of the client, for each result.

    >>> scheduled([2.0, 2.0, 2.0], 2), scheduled([2.0, 2.0], 2, first=1.0), scheduled([1.0] * 4, 4, client=0.5)
    (4.0, 3.0, 3.0)
    """
    free = [first] * workers
    done = []
    for seconds in tasks:
        end = heapq.heappop(free) + seconds
        done.append(end)
        heapq.heappush(free, end)
    taken = 0.0
    for end in sorted(done):
        taken = max(taken, end) + client
    return taken


def run(materials: int = 24) -> dict[str, Any]:
    """Review generated materials here, and on clusters of one and two processes; then simulate."""
    from distributed.deploy.subprocess import SubprocessCluster

    with tempfile.TemporaryDirectory() as private:
        folder = Path(private)
        import_sources([generated(folder / "source", materials, ("matt", "satin"))], folder / "catalogue")
        catalogue = Catalogue.open(folder / "catalogue")
        own = [_reviewed(catalogue, folder / "here", None)]
        # Seconds of all rows of a material, in the order of the report.
        costs = [sum(sum(row.seconds.values()) for row in rows) for rows in own[0][1]]
        few, busy = catalogue.ids()[: max(1, len(costs) // 4)], 0.0
        for workers in (1, 2):
            here = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0", "silence_logs": 50}
            # A scheduler in this process would count as the client's work, also while it waits.
            with SubprocessCluster(n_workers=workers, threads_per_worker=1, **here) as cluster:
                own.append(_reviewed(catalogue, folder / f"on {workers}", cluster.scheduler_address))
                if workers == 1:
                    busy = _reviewed(catalogue, folder / "part", cluster.scheduler_address, few)[2]
    usual = statistics.median(costs)
    first = sum(max(0.0, cost - 2.0 * usual) for cost in costs)
    # Work of the client beside waiting, by how its processor time grows with the materials.
    client = (own[1][2] - busy) / (len(costs) - len(few))
    return {
        "materials": len(costs),
        "rows": len(costs) * len(_LIGHTS),
        "one_process_s": own[0][0],
        "one_worker_s": own[1][0],
        "two_workers_s": own[2][0],
        "material_s": usual,
        "first_s": first,
        "client_s": client,
    }


def simulated(figures: dict[str, Any], materials: int, workers: int) -> float:
    """Return how many times as fast as one worker so many are, by the costs of `run`."""
    tasks = [figures["material_s"]] * materials
    costs = {"first": figures["first_s"], "client": figures["client_s"]}
    return scheduled(tasks, 1, **costs) / scheduled(tasks, workers, **costs)


def _reviewed(
    catalogue: Catalogue, out: Path, scheduler: str | None, materials: Sequence[str] = ("*",)
) -> tuple[float, list[list[Any]], float]:
    """Return seconds of the clock, rows by material, and processor seconds of this process."""
    begun, busy = time.perf_counter(), time.process_time()
    with software_session() as renderer:
        scene = load_scene(shipped_scene("thumbnail"))
        options = {"illuminants": _LIGHTS, "size": _PIXELS, "version": "bench", "scheduler": scheduler}
        found = review(scene, catalogue, out, materials=materials, renderer=renderer, **options)
    by_material: dict[str, list[Any]] = {}
    for row in found.rows:
        by_material.setdefault(row.material, []).append(row)
    return time.perf_counter() - begun, list(by_material.values()), time.process_time() - busy


def report(figures: dict[str, Any]) -> str:
    """Put the figures in words."""
    lines = [
        f"{figures['rows']} rows: {figures['one_process_s']:.1f} s in one process, "
        f"{figures['one_worker_s']:.1f} s on one worker, {figures['two_workers_s']:.1f} s on two",
        f"a material {figures['material_s']:.3f} s, a worker's first {figures['first_s']:.1f} s more, "
        f"the client {figures['client_s']:.3f} s a material",
    ]
    for materials in (1000, 10_000):
        speeds = ", ".join(f"{workers}: {simulated(figures, materials, workers):.1f}" for workers in (2, 10, 100))
        lines.append(f"simulated speed-up of {materials} materials by workers: {speeds}")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = command(__doc__)
    parser.add_argument("--materials", type=int, default=24, metavar="N", help="of the review (24)")
    args = parser.parse_args(arguments)
    figures = run(args.materials)
    print(report(figures))
    write_json(args.json, figures)


if __name__ == "__main__":
    main()
