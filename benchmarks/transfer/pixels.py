"""From colours at sites to pixels, and how far they are off the truth there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ...lighting.geometry import Tracer
from ...lighting.reference import ReferencePictures, reference_images
from ...lighting.scene import Scene
from ...lighting.transfer.hits import Hits
from ...lighting.vectors import dot
from ...lighting.visibility.refinement import refined
from ...spectral.difference import delta_e_xyz
from .scenes import TransferScene

#: ΔE94 that the truth's budget is: its noise is a tenth.
BUDGET = 3.0


@dataclass(frozen=True, eq=False)
class Seen:
    """The sites about the middle of each pixel, where it shows a surface.

    pixel (n,) : number in the picture. sites, shares (n,3) : of the triangle there.
    """

    pixel: Int[np.ndarray, " n"]
    sites: Int[np.ndarray, "n 3"]
    shares: Float[np.ndarray, "n 3"]

    def picture(self, values: Float[np.ndarray, "S 3"]) -> Float[np.ndarray, "n 3"]:
        """What lies between sites, linear on triangles."""
        return np.einsum("nk,nkc->nc", self.shares, values[self.sites])


def seen_sites(scene: Scene, hits: Hits, longest_edge: float) -> Seen:
    """Of the scene's first camera, which has one sample a pixel."""
    camera, fine = scene.camera(), refined(scene, longest_edge)[0]
    tracer = Tracer(fine)
    origins, to = (np.ascontiguousarray(each.reshape(-1, 3)) for each in camera.rays())
    face = tracer.first(origins, to)
    there = np.flatnonzero(face >= 0)
    _, shares = tracer.on_triangle(face[there], origins[there], to[there])
    back = dot(to[there], tracer.face_normals[face[there]]) > 0.0
    sites = np.where(back[:, None], hits.backs[face[there]], hits.corners[face[there]])
    lit = np.flatnonzero((sites >= 0).all(axis=1))
    return Seen(there[lit], sites[lit], shares[lit])


def truth_of(case: TransferScene, bounces: int, progress: Callable[[str], None]) -> ReferencePictures:
    """Paths of so many bounces, at every wavelength."""
    progress(f"{case.name}, {case.light}: paths of {bounces} bounces")
    return reference_images(case.scene, None, case.materials, budget=BUDGET, bounces=bounces)


def difference(
    case: TransferScene,
    truth: ReferencePictures,
    seen: Seen,
    values: Float[np.ndarray, "S 3"],
    beside: Float[np.ndarray, "n 3"] | None = None,
) -> Float[np.ndarray, " n"]:
    """ΔE94 of all pixels that show a surface; colours below 0 count as black. beside : of pixels, what comes to it."""
    covered = truth.coverage.ravel()[seen.pixel] == 1.0
    want = truth.xyz[0].reshape(-1, 3)[seen.pixel[covered]]
    found = seen.picture(values) + (0.0 if beside is None else beside)
    return delta_e_xyz(want, np.maximum(found[covered], 0.0), case.scene.adopted_white())
