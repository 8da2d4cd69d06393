"""Error of an image against the reference of the same view: a coarse estimate first, then over all rows.

Rows are rendered in rounds: every sixteenth one, then those half-way between, and so on; each round yields the error of
the rows so far.
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

#: Distance of rows in the first round.
FIRST_STEP = 16


@dataclass(frozen=True, eq=False)
class AskedView:
    """Image to be measured.

    Parameters
    ----------
    scene : with the shown lights; its `bounces` is a number. camera : of the image.
    catalogue : folder of materials; those without a file are in `made`, by id.
    xyz, coverage : (H,W,3) and (H,W) float32, the image. dimming : factor applied to it.
    budget : error budget, ΔE94, that limits the reference's noise (`reference_images`).
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
    """ΔE94 of an image from its reference.

    statistics : over finished rows; None if nothing lit is visible in them. share : of finished rows.
    noise : of the reference, ΔE94, largest mean of a round; None without sampling.
    at : `time.time()` of the result. seconds : since the request.
    xyz : (H,W,3) float32, the complete reference, else None.
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
    """Thread-safe cache of the last scene's ray tracer."""

    def __init__(self) -> None:
        # One value, so that no thread reads the meshes of one scene and the tracer of another.
        self._kept: tuple[tuple[tuple[Mesh, Cutout | None], ...], Tracer] | None = None

    def of(self, scene: Scene) -> Tracer:
        """Return the ray tracer of a scene; the last one is cached."""
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
    """Yield the error of an image against its reference after each round, and None after each row, for cancellation.

    surfaces : the original ones by material id, for every id in the scene.

    Raises
    ------
    InputError, UnknownNameError : see `reference_images`.
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
    """Yield the rows of each round; each halves the distance between finished rows.

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
