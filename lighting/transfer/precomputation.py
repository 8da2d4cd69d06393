"""Precomputed geometry for relighting: rays, operators, frames and the sky texels that rays see."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from ..environment.cube import CubeMap
from ..mesh.tangents import seen_handedness
from ..scene import Scene
from ..vectors import LEAST_COSINE, dot, orthonormal_frame, unit
from ..visibility.occluders import Occluders
from ..visibility.sites import scaled_triangles
from .cells import HemisphereCells
from .edge_refinement import placed
from .glossy_rays import GlossyRays
from .hits import RAYS, Hits
from .operator import ByPart, irradiance_operator

#: Texels across a face of the sky, 2.8 degrees each at its centre.
SKY = 32
# Sites per block; number of cached sets of glossy parts.
_BLOCK, _KEPT = 2048, 4


@dataclass(frozen=True, eq=False)
class Precomputation:
    """Precomputed geometry of a scene, valid for all materials, lights and cameras.

    scene : with the triangles of the sites.
    """

    scene: Scene
    hits: Hits
    cells: HemisphereCells
    _glossy: dict[bytes, GlossyRays] = field(default_factory=dict, repr=False)

    @classmethod
    def of(
        cls,
        scene: Scene,
        rays: int = RAYS,
        longest_edge: float | None = None,
        progress: Callable[[int, int, str], None] = lambda done, total, what: None,
    ) -> Precomputation:
        """Place sites in a scene and trace their rays; see `PlacedSites.traced`."""
        bodies = placed(scene, longest_edge)
        return cls(bodies.scene, bodies.traced(rays, progress), HemisphereCells())

    @cached_property
    def operator(self) -> Any:
        """Irradiance operator G, see `irradiance_operator`."""
        return irradiance_operator(self.hits)

    @cached_property
    def by_part(self) -> ByPart:
        """`operator`, split by sending parts."""
        return ByPart.of(self.operator, self.hits.part_of_site)

    @cached_property
    def later(self) -> Any:
        """G from the first quarter of the rays, for light after two surfaces or more, which is nearly uniform; any
        prefix of the sequence is evenly distributed.
        """
        rays = max(1, self.hits.rays // 4)
        return irradiance_operator(
            replace(self.hits, triangle=self.hits.triangle[:, :rays], place=self.hits.place[:, :rays])
        )

    @cached_property
    def occluders(self) -> Occluders:
        """Occlusion queries against all triangles."""
        return Occluders(scaled_triangles(self.scene).astype(np.float32))

    @cached_property
    def sky(self) -> CubeMap:
        """Texels over which environment lights are averaged."""
        return CubeMap(SKY)

    @cached_property
    def escapes(self) -> Int[np.ndarray, "S N"]:
        """Texel of the sky that each ray sees; -1 if it hits a part."""
        found = np.full(self.hits.triangle.shape, -1, dtype=np.int16)
        for start in range(0, len(found), _BLOCK):
            rows = slice(start, start + _BLOCK)
            free = self.hits.triangle[rows] < 0
            found[rows][free] = self.sky.texel_of(self.hits.directions(rows)[free])
        return found

    @cached_property
    def sky_operator(self) -> Any:
        """Matrix (S, texels) from luminance of the sky, cd/m^2, to illuminance of sites, lux."""
        from scipy.sparse import csr_array

        row, ray = np.nonzero(self.escapes >= 0)
        value = np.full(len(row), np.pi / self.hits.rays, dtype=np.float32)
        places = row.astype(np.int32), self.escapes[row, ray].astype(np.int32)
        found = csr_array((value, places), shape=(len(self.escapes), len(self.sky)))
        found.sum_duplicates()
        return found

    @cached_property
    def frames(self) -> Float[np.ndarray, "S 3 3"]:
        """Rotations from the world to each site's frame, on its side."""
        hits, parts = self.hits, self.scene.parts
        tangents = np.concatenate([part.mesh.tangents.directions[part.mesh.tangents.faces] for part in parts])
        hand = np.concatenate([part.mesh.tangents.handedness for part in parts])
        has_uv = np.array([part.mesh.uv is not None for part in parts])[hits.part]
        along, side = np.zeros((len(hits.sites), 3)), np.ones(len(hits.sites))
        for corners, sign in ((hits.backs, -1.0), (hits.corners, 1.0)):
            there = corners >= 0
            along[corners[there]] = tangents[there]
            signed = np.broadcast_to(seen_handedness(hand, has_uv, np.full(len(hand), sign))[:, None], there.shape)
            side[corners[there]] = signed[there]
        return orthonormal_frame(hits.sites.normals, along, side)

    @cached_property
    def _faces(self) -> tuple[Float[np.ndarray, "F 3"], Float[np.ndarray, "F 3"]]:
        """First corner and normal of each triangle, world."""
        meshes = [part.mesh for part in self.scene.parts]
        corners = np.concatenate([mesh.vertices[mesh.faces[:, 0]] for mesh in meshes])
        return corners, np.concatenate([mesh.face_normals for mesh in meshes])

    def seen(self, towards: Callable[[Float[np.ndarray, "n 3"]], Float[np.ndarray, "n 3"]]) -> Bool[np.ndarray, " S"]:
        """Select the sites on the visible sides of triangles. towards : maps positions to directions towards the
        viewer.
        """
        corners, normals = self._faces
        cosine = dot(normals, unit(towards(corners)))
        found = np.zeros(len(self.hits.sites) + 1, dtype=bool)
        # An edge-on triangle counts on both sides. A dark side has no sites, -1.
        for sites, facing in ((self.hits.corners, cosine), (self.hits.backs, -cosine)):
            found[sites[facing > -LEAST_COSINE].ravel()] = True
        return found[:-1]

    def glossy_rays(self, glossy: Bool[np.ndarray, " P"]) -> GlossyRays:
        """Return the rays of and onto glossy parts; the last few sets are cached."""
        key = glossy.tobytes()
        if key not in self._glossy:
            while len(self._glossy) >= _KEPT:
                self._glossy.pop(next(iter(self._glossy)), None)
            self._glossy[key] = GlossyRays.of(self.hits, self.frames, self.escapes, glossy, self.cells)
        return self._glossy[key]

    @property
    def centre_and_radius(self) -> tuple[Float[np.ndarray, "3"], float]:
        """Centre and radius of the scene: world coordinates = those of sites times the radius, plus the centre."""
        low, high = self.scene.bounds
        return 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
