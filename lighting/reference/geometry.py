"""Visible geometry at each sample point of an image: ray traced once, valid for every material and light spectrum.

Conventions, shared by rasterisers: the geometric normal is the triangle's normal, flipped towards the viewer, so that
both sides of a surface scatter alike. The interpolated normal is flipped with it, and where it still faces away from
the viewer (at outlines) it is bent just enough (`vectors.facing_viewer`). A light reaches a point if it is above the
horizons of both normals and no triangle occludes it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from ...materials.core.surface import Cutout
from ..camera import Camera
from ..lights import DeltaLight
from ..mesh.ray_index import NumpyIndex, has_embree
from ..mesh.tangents import seen_handedness
from ..scene import Scene
from ..vectors import dot, facing_viewer, orthonormal_frame, unit

# Offset of shadow rays from the surface, in radii of the scene: well above float32 rounding in Embree, whose
# coordinates are scaled to the scene, and far below a pixel.
SHADOW_OFFSET = 1e-5
# Change of direction when retrying a ray that missed, since one aimed at a vertex may slip through in float32.
_NUDGE = np.array([1.1e-6, 0.7e-6, -0.9e-6])


@dataclass(frozen=True, eq=False)
class LitSamples:
    """Samples of `VisibleGeometry` lit by one light.

    sample (K,) : indices among the N visible samples. wi (K, 3) : local direction to the light, wi.z > 0.
    illuminance_lux (K,) : on a surface facing the light.
    """

    sample: Int[np.ndarray, " K"]
    wi: Float[np.ndarray, "K 3"]
    illuminance_lux: Float[np.ndarray, " K"]


@dataclass(frozen=True, eq=False)
class VisibleGeometry:
    """The N sample points of an image, or of some of its rows, that see a surface, in row order.

    width, rows : size of the image or rows, pixels; samples : sample points per pixel.
    pixel (N,) : row * width + column; part (N,) : index into `scene.parts`.
    position (N, 3) : world; wo (N, 3) : local direction to the viewer, x along the tangent, y along the bitangent and z
    along the shading normal (`tangents`: left-handed where a texture is mirrored).
    lit : one entry per delta light.
    uv (N, 2) : (0, 0) at the lower left corner of an image, u to the right, v upwards; not wrapped to [0, 1]. footprint
    (N, 2, 2) : see `uv_footprints`. Both are None if not requested or if no part has uv.
    has_uv : by part of the scene; uv and footprint are 0 on parts without uv.
    frame (N, 3, 3) : world to local; geometric (N, 3) : geometric normal towards the viewer. Both are None if not
    requested and without area or environment lights.
    cutouts : holes of each part, as traced; () without holes.
    """

    width: int
    rows: int
    samples: int
    pixel: Int[np.ndarray, " N"]
    part: Int[np.ndarray, " N"]
    position: Float[np.ndarray, "N 3"]
    wo: Float[np.ndarray, "N 3"]
    lit: tuple[LitSamples, ...]
    uv: Float[np.ndarray, "N 2"] | None = None
    footprint: Float[np.ndarray, "N 2 2"] | None = None
    has_uv: tuple[bool, ...] = ()
    frame: Float[np.ndarray, "N 3 3"] | None = None
    cutouts: tuple[Cutout | None, ...] = ()
    geometric: Float[np.ndarray, "N 3"] | None = None

    @property
    def coverage(self) -> Float[np.ndarray, "H W"]:
        """Share of each pixel's sample points that see a surface, (H, W)."""
        hits = np.bincount(self.pixel, minlength=self.rows * self.width)
        return hits.reshape(self.rows, self.width) / self.samples


@dataclass(frozen=True, eq=False)
class Met:
    """Hit points on surfaces, seen from given directions.

    position (n, 3) : world. part (n,) : of the scene. geometric (n, 3) : unit normal of the triangle on the visible
        side.
    frame (n, 3, 3) : world to local. wo (n, 3) : local direction to the viewer.
    """

    position: Float[np.ndarray, "n 3"]
    part: Int[np.ndarray, " n"]
    geometric: Float[np.ndarray, "n 3"]
    frame: Float[np.ndarray, "n 3 3"]
    wo: Float[np.ndarray, "n 3"]

    def chosen(self, which: Int[np.ndarray, " k"]) -> Met:
        """Select points by index."""
        return Met(*(one[which] for one in (self.position, self.part, self.geometric, self.frame, self.wo)))


class Tracer:
    """Ray tracer for all parts of a scene: a BVH finds the triangle, the hit point on it is computed in float64. Rays
    continue through holes (`Scene.cut`).
    """

    def __init__(self, scene: Scene) -> None:
        self._meshes = meshes = [part.mesh for part in scene.parts]
        offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
        self.vertices = np.concatenate([mesh.vertices for mesh in meshes])
        self.normals = np.concatenate([mesh.normals for mesh in meshes])
        self.faces = np.concatenate([mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=False)])
        known = [mesh.tangents for mesh in meshes]
        offsets = np.cumsum([0, *(len(one.directions) for one in known)])
        self.tangents = np.concatenate([one.directions for one in known])
        self.tangent_faces = np.concatenate([one.faces + offset for one, offset in zip(known, offsets, strict=False)])
        self.handedness = np.concatenate([one.handedness for one in known])
        self.face_normals = np.concatenate([mesh.face_normals for mesh in meshes])
        self.part = np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes])
        self.has_uv = tuple(mesh.uv is not None for mesh in meshes)
        self._cutouts = scene.cutouts
        self._has_holes = np.array([cutout is not None for cutout in self._cutouts])
        low, high = scene.bounds
        self.centre, self.radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
        self._first_met = _first_met((self.vertices - self.centre) / self.radius, self.faces)

    @cached_property
    def uv(self) -> Float[np.ndarray, "V 2"]:
        """Texture coordinates of all vertices, 0 for parts without."""
        return np.concatenate(
            [mesh.uv if mesh.uv is not None else np.zeros((len(mesh.vertices), 2)) for mesh in self._meshes]
        )

    @cached_property
    def uv_gradients(self) -> Float[np.ndarray, "F 2 3"]:
        """Gradients of u and v on each triangle (`uv_gradients`)."""
        return uv_gradients(self.vertices[self.faces], self.uv[self.faces])

    def first(
        self, origins: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"], again: bool = True
    ) -> Int[np.ndarray, " n"]:
        """Return the first triangle hit by each ray (unit directions), or -1; `again` retries misses."""
        face = self._met(origins, directions, again)
        if not self._has_holes.any():
            return face
        waiting, reached = np.flatnonzero(face >= 0), np.zeros(len(face))
        while True:
            waiting = waiting[self._has_holes[self.part[face[waiting]]]]
            distance, weights = self.on_triangle(face[waiting], origins[waiting], directions[waiting])
            hole = self.in_holes(face[waiting], weights)
            waiting = waiting[hole]
            if not len(waiting):
                return face
            # Each step advances, even if Embree hits the same triangle again from the new origin.
            reached[waiting] = np.maximum(distance[hole], reached[waiting]) + SHADOW_OFFSET * self.radius
            begin = origins[waiting] + reached[waiting, None] * directions[waiting]
            face[waiting] = self._met(begin, directions[waiting], again)
            waiting = waiting[face[waiting] >= 0]

    def in_holes(self, face: Int[np.ndarray, " n"], weights: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
        """Return a mask of points on triangles that are in holes."""
        found, part = np.zeros(len(face), dtype=bool), self.part[face]
        for number, cutout in enumerate(self._cutouts):
            mine = np.flatnonzero(part == number)
            if cutout is not None and len(mine):
                found[mine] = cutout.holes(self.uv_at(face[mine], weights[mine]))
        return found

    def _met(
        self, origins: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"], again: bool
    ) -> Int[np.ndarray, " n"]:
        """Return `first`, ignoring holes."""
        # Start on the scene's bounding sphere, since float32 is too coarse for a distant camera.
        start = (origins - self.centre) / self.radius
        along = dot(start, directions)
        inside = dot(start, start) - 1.02**2
        ahead = -along - np.sqrt(np.maximum(along * along - inside, 0.0))
        start = start + np.where(inside > 0.0, np.maximum(ahead, 0.0), 0.0)[:, None] * directions
        face = np.asarray(self._first_met(start, directions), dtype=np.int64)
        missed = np.flatnonzero((face < 0) & (along * along >= inside)) if again else []
        if len(missed):
            face[missed] = self._first_met(start[missed], directions[missed] + _NUDGE)
        return face

    def on_triangle(
        self, face: Int[np.ndarray, " n"], origins: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]
    ) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, "n 3"]]:
        """Compute the distance (n,) along each ray to its triangle and non-negative barycentric weights (n, 3), in
        float64.
        """
        a, b, c = (self.vertices[self.faces[face, k]] for k in range(3))
        ab, ac, from_a = b - a, c - a, origins - a
        p, q = np.cross(directions, ac), np.cross(from_a, ab)
        scale = 1.0 / dot(ab, p)  # Moeller and Trumbore 1997, eq. 6
        v, w = dot(from_a, p) * scale, dot(directions, q) * scale
        weights = np.clip(np.stack([1.0 - v - w, v, w], axis=1), 0.0, None)
        return dot(ac, q) * scale, weights / weights.sum(axis=1, keepdims=True)

    def uv_at(self, face: Int[np.ndarray, " n"], weights: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2"]:
        """Interpolate texture coordinates at points on triangles."""
        return np.einsum("nk,nki->ni", weights, self.uv[self.faces[face]])

    def seen(
        self,
        face: Int[np.ndarray, " n"],
        weights: Float[np.ndarray, "n 3"],
        position: Float[np.ndarray, "n 3"],
        to_viewer: Float[np.ndarray, "n 3"],
    ) -> Met:
        """Return points on triangles, seen from unit directions."""
        geometric = self.face_normals[face]
        side = np.where(dot(geometric, to_viewer) < 0.0, -1.0, 1.0)
        towards = side[:, None]
        shading = unit(np.einsum("nk,nki->ni", weights, self.normals[self.faces[face]])) * towards
        shading = facing_viewer(shading, to_viewer)
        tangent = np.einsum("nk,nki->ni", weights, self.tangents[self.tangent_faces[face]])
        part = self.part[face]
        handedness = seen_handedness(self.handedness[face], np.array(self.has_uv)[part], side)
        frame = orthonormal_frame(shading, tangent, handedness)
        return Met(position, part, geometric * towards, frame, np.einsum("nij,nj->ni", frame, to_viewer))

    def reaches(
        self,
        light: DeltaLight,
        points: Float[np.ndarray, "n 3"],
        normals: Float[np.ndarray, "n 3"],
    ) -> Bool[np.ndarray, " n"]:
        """Return whether each point, with its geometric normal towards the light, sees the light."""
        start = self.lifted(points, normals)
        arriving = light.arrivals(start)
        return self.free(start, np.ascontiguousarray(arriving.directions), arriving.distance)

    def lifted(self, points: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Return the origins of shadow rays: points offset by `SHADOW_OFFSET` along their geometric normals."""
        return points + SHADOW_OFFSET * self.radius * normals

    def free(
        self, start: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"], distance: Float[np.ndarray, " n"]
    ) -> Bool[np.ndarray, " n"]:
        """Return whether rays (unit directions) are unoccluded up to a distance."""
        face = self.first(start, directions, again=False)
        free = face < 0
        near = np.flatnonzero(~free & np.isfinite(distance))
        where, _ = self.on_triangle(face[near], start[near], directions[near])
        free[near] = where >= distance[near]
        return free


def _first_met(
    vertices: Float[np.ndarray, "V 3"], faces: Int[np.ndarray, "F 3"]
) -> Callable[[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]], Int[np.ndarray, " n"]]:
    """Return a function of origins and directions that finds the first triangle hit by each ray, -1 for none."""
    if not has_embree():
        return NumpyIndex(vertices[faces]).run
    import trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    mesh = trimesh.Trimesh(vertices, faces, process=False, validate=False)
    return RayMeshIntersector(mesh).intersects_first


def visible_geometry(
    scene: Scene,
    camera: Camera | None = None,
    rows: slice = slice(None),
    tracer: Tracer | None = None,
    with_uv: bool = False,
    with_frames: bool = False,
) -> VisibleGeometry:
    """Trace the sample points of pixel `rows` of the image of `camera` (default: the first).

    Only meshes, their holes and the positions and strengths of lights matter: the result is valid for every material
    with the same holes and for every light spectrum. `with_uv` adds texture coordinates, for materials that use them.
    `with_frames` adds frames and geometric normals, which area and environment lights always need. Memory: about 200
    bytes per visible sample and light, 48 per sample with uv, 96 with frames.
    """
    camera = scene.camera() if camera is None else camera
    tracer = Tracer(scene) if tracer is None else tracer
    with_frames = with_frames or bool(scene.spread_lights)
    origins, directions = camera.rays(rows)
    height, columns = directions.shape[0] // camera.samples, directions.shape[1]
    origins, directions = origins.reshape(-1, 3), np.ascontiguousarray(directions.reshape(-1, 3))
    face = tracer.first(origins, directions)
    seen = np.flatnonzero(face >= 0)
    face, origins, to_viewer = face[seen], origins[seen], -directions[seen]
    distance, weights = tracer.on_triangle(face, origins, -to_viewer)
    position = origins - distance[:, None] * to_viewer

    met = tracer.seen(face, weights, position, to_viewer)
    geometric, shading, frame, part = met.geometric, met.frame[:, 2], met.frame, met.part

    lit = []
    for light in scene.delta_lights:
        arriving = light.arrivals(position)
        to_light, illuminance = arriving.directions, arriving.illuminance_lux
        above = np.flatnonzero((dot(geometric, to_light) > 0.0) & (dot(shading, to_light) > 0.0))
        free = tracer.reaches(light, position[above], geometric[above])
        which = above[free]
        lit.append(
            LitSamples(which, np.einsum("nij,nj->ni", frame[which], to_light[which]), np.array(illuminance[which]))
        )
    row, column = np.divmod(seen, columns)
    uv, footprint = None, None
    if with_uv and any(tracer.has_uv):
        uv = tracer.uv_at(face, weights)
        footprint = uv_footprints(camera, -to_viewer, distance, geometric, tracer.uv_gradients[face])
    return VisibleGeometry(
        width=camera.width,
        rows=height,
        samples=camera.samples**2,
        pixel=(row // camera.samples) * camera.width + column // camera.samples,
        part=part,
        position=position,
        wo=met.wo,
        lit=tuple(lit),
        uv=uv,
        footprint=footprint,
        has_uv=tracer.has_uv if with_uv else (),
        frame=frame if with_frames else None,
        geometric=geometric if with_frames else None,
        cutouts=scene.cutouts if any(scene.cutouts) else (),
    )


def uv_gradients(corners: Float[np.ndarray, "F 3 3"], uv: Float[np.ndarray, "F 3 2"]) -> Float[np.ndarray, "F 2 3"]:
    """Compute the spatial gradients of u and v in the planes of triangles."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(first, second)
    # Directions along which only one corner's weight grows, and the rate.
    by_first, by_second = np.cross(second, normal), np.cross(normal, first)
    by_uv = np.einsum("nc,ni->nci", uv[:, 1] - uv[:, 0], by_first) + np.einsum(
        "nc,ni->nci", uv[:, 2] - uv[:, 0], by_second
    )
    return by_uv / dot(normal, normal)[:, None, None]


def uv_footprints(
    camera: Camera,
    directions: Float[np.ndarray, "N 3"],
    distance: Float[np.ndarray, " N"],
    normals: Float[np.ndarray, "N 3"],
    gradients: Float[np.ndarray, "N 2 3"],
) -> Float[np.ndarray, "N 2 2"]:
    """Compute footprints of samples whose rays, with unit `directions`, hit triangles with these normals and
    `uv_gradients` at `distance`: rows are the changes of (u, v) to the next column (to the right) and to the next row
    (downwards) of samples; the area of a sample in uv is |det|.

    They are ray differentials at the sample, on the unbounded plane of its triangle, independent of other parts,
    silhouettes and creases (Igehy 1999, Tracing ray differentials, section 3.1.2). The rasterisers' twin is in
    `viewer.render.surfaces`.
    """
    width, height = camera.sample_size
    right, up, back = camera.axes
    steps = width * right, -height * up
    # Step of the ray's direction at unit depth; in a parallel view, step of its origin.
    scale = -distance * (directions @ back) if camera.projection == "perspective" else np.ones_like(distance)
    # The step leaves the plane and is projected back along the ray.
    along = np.einsum("nci,ni->nc", gradients, directions) / dot(normals, directions)[:, None]
    rows = [scale[:, None] * (gradients @ step - along * (normals @ step)[:, None]) for step in steps]
    return np.stack(rows, axis=1)
