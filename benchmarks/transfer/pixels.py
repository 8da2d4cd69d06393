"""Pixels from colours at sites, and their error there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int

from ...lighting.reference.geometry import Tracer
from ...lighting.reference.reference import ReferencePictures, reference_images
from ...lighting.scene import Scene
from ...lighting.transfer.hits import Hits
from ...lighting.vectors import dot
from ...spectral.difference import delta_e_xyz
from .scenes import TransferScene

#: ΔE94 that the truth's budget is, of which its noise is a tenth: of whole pictures and direct light, and of others.
FINE, BUDGET = 1.5, 3.0
#: Surfaces of the longest paths that stand for all there are: what is left is far below their noise.
ALL = 16


@dataclass(frozen=True, eq=False)
class Seen:
    """The sites about the middle of each pixel, where it shows a surface.

    pixel (n,) : number in the picture. sites, shares (n,3) : of the triangle there.
    """

    pixel: Int[np.ndarray, " n"]
    sites: Int[np.ndarray, "n 3"]
    shares: Float[np.ndarray, "n 3"]

    def picture(self, values: Float[np.ndarray, "S 3"]) -> Float[np.ndarray, "n 3"]:
        """Interpolate what lies between sites, linear on triangles."""
        return np.einsum("nk,nkc->nc", self.shares, values[self.sites])


def seen_sites(fine: Scene, hits: Hits) -> Seen:
    """Find what the first camera of a scene sees, one sample a pixel. fine : with the triangles that sites are of."""
    camera = fine.camera()
    tracer = Tracer(fine)
    origins, to = (np.ascontiguousarray(each.reshape(-1, 3)) for each in camera.rays())
    face = tracer.first(origins, to)
    there = np.flatnonzero(face >= 0)
    _, shares = tracer.on_triangle(face[there], origins[there], to[there])
    back = dot(to[there], tracer.face_normals[face[there]]) > 0.0
    sites = np.where(back[:, None], hits.backs[face[there]], hits.corners[face[there]])
    lit = np.flatnonzero((sites >= 0).all(axis=1))
    return Seen(there[lit], sites[lit], hits.open_shares(sites[lit], shares[lit]))


def truth_of(case: TransferScene, bounces: int, progress: Callable[[str], None]) -> ReferencePictures:
    """Paths of so many bounces, at every wavelength."""
    progress(f"{case.name}, {case.light}: paths of {bounces} bounces")
    budget = FINE if bounces in (0, ALL) else BUDGET
    return reference_images(case.scene, None, case.materials, budget=budget, bounces=bounces)


@dataclass(frozen=True, eq=False)
class Truths:
    """Paths of a scene under its light, traced when they are first asked for."""

    case: TransferScene
    progress: Callable[[str], None] = lambda line: None
    _pictures: dict[int, ReferencePictures] = field(default_factory=dict)
    _sites: dict[tuple[int, bytes], np.ndarray] = field(default_factory=dict)

    def picture(self, bounces: int) -> ReferencePictures:
        """`truth_of`."""
        if bounces not in self._pictures:
            self._pictures[bounces] = truth_of(self.case, bounces, self.progress)
        return self._pictures[bounces]

    def from_sites(
        self, bounces: int, sites: Int[np.ndarray, " n"], trace: Callable[[], Float[np.ndarray, "2 n 3"]]
    ) -> Float[np.ndarray, "2 n 3"]:
        """Return what `trace` gives of these sites, once."""
        key = bounces, sites.tobytes()
        if key not in self._sites:
            self.progress(f"{self.case.name}, {self.case.light}: paths from sites, {bounces} bounces")
            self._sites[key] = trace()
        return self._sites[key]


def pixel_differences(
    case: TransferScene, truth: ReferencePictures, seen: Seen, values: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, " n"]:
    """ΔE94 of all pixels that show a surface, of which `values` are the colours; those below 0 count as black."""
    covered = truth.coverage.ravel()[seen.pixel] == 1.0
    want = truth.xyz[0].reshape(-1, 3)[seen.pixel[covered]]
    return delta_e_xyz(want, np.maximum(values[covered], 0.0), case.scene.adopted_white())


def figures_of(off: Float[np.ndarray, " n"]) -> dict[str, float]:
    """Summarise differences as rows have them; 0 of none."""
    p95, p99 = np.percentile(off, (95.0, 99.0)) if len(off) else (0.0, 0.0)
    return {"mean": float(off.mean()) if len(off) else 0.0, "p95": float(p95), "p99": float(p99)}
