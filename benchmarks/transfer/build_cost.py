"""Time and size of the rays between parts, as a scene grows; and reading them again.

    python -m metamer.benchmarks.transfer.build_cost [--rays 256] [--most 62000] [--times 3] [--json OUT.json]

Balls above a floor, from three on twice as many each time, up to `--most` vertices of their meshes; edges are cut only
where light between parts is not linear.
Each size is built anew `--times` times and read again; the least CPU time counts, since other work on the machine only
adds to it. `beside the first` are seconds and bytes a vertex beside those of the smallest size: 1 is linear.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from ...lighting.lights import DirectionalLight
from ...lighting.mesh.shapes import plane, sphere
from ...lighting.scene import Part, Scene, bounds_of, framing_camera
from ...lighting.transfer.ray_cache import build_rays, kept_hits
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from .. import timing

# Subdivisions of a ball, and its radius; balls are 1 apart. Of that many vertices each.
_LEVEL, _RADIUS, _VERTICES = 3, 0.45, 642
# Radii of the scene: no edge is longer.
_UNDIVIDED = 10.0


def balls(count: int) -> Scene:
    """Make a scene of so many balls in rows above a floor."""
    across = int(np.ceil(np.sqrt(count)))
    ball = sphere(_LEVEL, _RADIUS)
    places = [(float(n % across), 0.5, float(n // across)) for n in range(count)]
    floor = plane(across + 1.0, across + 1.0).placed(translate=(0.5 * (across - 1), 0.0, 0.5 * (across - 1)))
    meshes = [floor, *(ball.placed(translate=place) for place in places)]
    parts = tuple(Part(str(number), mesh, "matt") for number, mesh in enumerate(meshes))
    light = DirectionalLight((0.3, 1.0, 0.2), illuminant("D65"))
    return Scene(parts, (light,), (framing_camera(*bounds_of(meshes)),), observer("1931_2"))


def measured(count: int, rays: int, times: int) -> dict:
    """One size, in this process, built into a folder of its own each time."""
    scene = balls(count)
    build, read, sites, size = [], [], 0, 0
    for _ in range(times):
        with tempfile.TemporaryDirectory() as private:
            begin = time.process_time()
            built = build_rays(scene, Path(private), rays, longest_edge=_UNDIVIDED)
            between = time.process_time()
            kept_hits(scene, Path(private), rays, longest_edge=_UNDIVIDED)
            build.append(between - begin)
            read.append(time.process_time() - between)
            sites, size = built.sites, built.nbytes
    return {
        "vertices": sites,
        "triangles": sum(len(part.mesh.faces) for part in scene.parts),
        "rays": rays,
        "build_cpu_seconds": min(build),
        "read_cpu_seconds": min(read),
        "bytes": size,
    }


def main(words: list[str] | None = None) -> int:
    """Measure, print and store."""
    parser = timing.command(__doc__)
    parser.add_argument("--rays", type=int, default=256)
    parser.add_argument("--most", type=int, default=62_000)
    parser.add_argument("--times", type=int, default=3)
    args = parser.parse_args(words)
    rows: list[dict] = []
    measured(1, 16, 1)  # what is only done once, such as loading Embree
    count = 3
    while count * _VERTICES <= args.most:
        row = measured(count, args.rays, args.times)
        rows.append(row)
        said = []
        for what in ("build_cpu_seconds", "bytes"):
            row[f"{what}_beside_first"] = row[what] / row["vertices"] / (rows[0][what] / rows[0]["vertices"])
            said.append(f"{row[f'{what}_beside_first']:.2f}")
        micro, size = 1e6 * row["build_cpu_seconds"] / row["vertices"], row["bytes"] / row["vertices"]
        print(
            f"{row['vertices']:7,} vertices: built in {row['build_cpu_seconds']:.2f} s, read in "
            f"{row['read_cpu_seconds']:.2f} s; {micro:.0f} us and {size:.0f} bytes a vertex, beside the first "
            f"{' and '.join(said)}",
            flush=True,
        )
        count *= 2
    timing.write_json(args.json, rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
