"""Error of a picture against the reference of the same view: a coarse figure first, then all of it.

Rows are followed in rounds: every sixteenth one, then those half-way between, and so on; each round says what the rows
so far come to.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from ...calibration.report.statistics import DeltaEStatistics, delta_e_map, delta_e_statistics
from ...lighting.camera import Camera
from ...lighting.mesh.mesh import Mesh
from ...lighting.reference.geometry import Tracer, visible_geometry
from ...lighting.reference.reference import reference_images
from ...lighting.scene import Scene
from ...materials.core.surface import Cutout, Surface

#: Rows are this far apart in the first round.
FIRST_STEP = 16


@dataclass(frozen=True, eq=False)
class AskedView:
    """A picture that is to be measured.

    Parameters
    ----------
    scene : under its lights as they are shown; its `bounces` are a number. camera : that of the picture.
    catalogue : the folder that materials are loaded from; what is in no file is in `made`, by id.
    xyz, coverage : (H,W,3) and (H,W) float32, the picture. dimming : that it has been multiplied by.
    budget : ΔE94 that the reference's noise is kept small beside (`reference_images`).
    """

    scene: Scene
    camera: Camera
    catalogue: str
    xyz: Float[np.ndarray, "H W 3"]
    coverage: Float[np.ndarray, "H W"]
    dimming: float = 1.0
    budget: float = 1.0
    made: Mapping[str, Surface] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class ViewError:
    """ΔE94 of a picture from its reference.

    statistics : over the rows that are done; None where none of them shows anything that is lit. share : of all rows.
    noise : ΔE94 of the reference by chance, the worst mean of a round; None where nothing is left to chance.
    at : `time.time()` when it was found. seconds : since it was asked for.
    xyz : (H,W,3) float32, the reference itself, once it is whole.
    """

    statistics: DeltaEStatistics | None
    share: float
    noise: float | None
    at: float
    seconds: float
    xyz: Float[np.ndarray, "H W 3"] | None = None

    def words(self, now: float) -> str:
        """Describe the error, with its age."""
        age = max(now - self.at, 0.0)
        rows = "" if self.share == 1.0 else f" in {self.share:.0%} of the rows"
        if self.statistics is None:
            return f"nothing lit{rows}"
        old = f"{age:.0f} s" if age < 120 else f"{age / 60:.0f} min"
        noise = "" if self.noise is None else f", of which noise {self.noise:.2g}"
        return f"ΔE94 p95 {self.statistics.p95:.2f}{noise}{rows}, {old} ago"


class Tracers:
    """The rays of the last meshes: what is asked next has mostly the same. Several threads may ask."""

    def __init__(self) -> None:
        # One value, so that no thread reads the meshes of one scene and the rays of another.
        self._kept: tuple[tuple[tuple[Mesh, Cutout | None], ...], Tracer] | None = None

    def of(self, scene: Scene) -> Tracer:
        """Return the tracer of a scene; that of the last one is kept."""
        parts, kept = tuple((part.mesh, part.cutout) for part in scene.parts), self._kept
        if kept is not None and len(parts) == len(kept[0]) and all(
            one is mesh and hole is cutout for (one, hole), (mesh, cutout) in zip(parts, kept[0], strict=True)
        ):  # fmt: skip
            return kept[1]
        tracer = Tracer(scene)
        self._kept = parts, tracer
        return tracer


def view_errors(
    asked: AskedView, surfaces: Mapping[str, Surface], tracers: Tracers | None = None
) -> Iterator[ViewError | None]:
    """Yield the error of a picture against its reference, round by round, and None after each row, to break off there.

    surfaces : the original ones by material id, for every id in the scene.

    Raises
    ------
    InputError, UnknownNameError : as of `reference_images`.
    """
    begun = time.monotonic()
    scene = asked.scene.cut(surfaces)
    rays = (tracers or Tracers()).of(scene)
    with_uv, height = scene.needs_uv(surfaces), asked.camera.height_px
    truth = np.zeros(asked.xyz.shape)
    coverage, done = np.zeros(asked.coverage.shape), np.zeros(height, dtype=bool)
    white, noise = scene.adopted_white(), None
    bounces = int(scene.bounces)
    for rows in rounds(height):
        for row in rows:
            line = asked.camera.cropped(slice(row, row + 1), slice(None))
            seen = visible_geometry(scene, line, tracer=rays, with_uv=with_uv, with_frames=bounces > 0)
            found = reference_images(
                scene, line, surfaces, geometry=seen, tracer=rays, budget=asked.budget, seed=row, bounces=bounces
            )
            truth[row], coverage[row] = asked.dimming * found.xyz[0, 0], found.coverage[0]
            if found.noise is not None:
                noise = max(noise or 0.0, *found.noise.mean)
            done[row] = True
            yield None
        both = np.minimum(coverage, asked.coverage)[done]
        share = float(done.mean())
        statistics = None
        if both.any():
            off = delta_e_map(truth[done], asked.xyz[done].astype(np.float64), white, both)
            statistics = delta_e_statistics(off) if not np.isnan(off).all() else None
        xyz = truth.astype(np.float32) if done.all() else None
        yield ViewError(statistics, share, noise, time.time(), time.monotonic() - begun, xyz)


def rounds(height: int) -> Iterator[list[int]]:
    """Rows in the order in which they are followed: each round halves the distance between those that are done.

    >>> [len(rows) for rows in rounds(32)]
    [2, 2, 4, 8, 16]
    """
    first = min(FIRST_STEP, height) // 2
    done: set[int] = set()
    step = FIRST_STEP
    while len(done) < height:
        rows = [row for row in range(first % step, height, step) if row not in done]
        if rows:
            yield rows
        done.update(rows)
        step //= 2
        first %= max(step, 1)
