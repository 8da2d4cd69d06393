"""Generated shapes with exact normals: sphere, speed shape, draped cloth, row of patches, plane.

Derivatives are complex-step derivatives: Im f(x + ih) / h has no cancellation, so that h = 1e-100 gives the derivative
of an analytic f to the last digit (Squire and Trapp 1998).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ...runtime.errors import InputError
from ..vectors import Number, unit, welded
from .mesh import Mesh

STEP = 1e-100


def sphere(subdivisions: int = 6, radius: Number = 1.0, uv: bool = False) -> Mesh:
    """Return a sphere about the origin, from an icosahedron whose triangles are divided into four `subdivisions` times.

    By default the outline is within 1e-4 radii of a circle, a fortieth of a pixel at 512 pixels. With `uv`, u runs once
    around from the back (-z) via the left, v from the lower pole to the upper one.
    """
    directions, faces = _icosphere(subdivisions)
    return _with_uv(Mesh(directions * radius, directions, faces, name="sphere"), directions, uv)


def speed_shape(subdivisions: int = 6, uv: bool = False) -> Mesh:
    """Return a long doubly curved body for judging paint: nose, waist, tail, and a hollow along its back.

    A sphere under a smooth invertible map, hence closed and without creases: convex at both ends, saddle-shaped at the
    waist, concave along the hollow. Its length is 3.2 along x, its back faces +y, and its lowest point is at y = 0.
    With `uv` it has the sphere's texture coordinates.
    """

    def body(p: np.ndarray) -> np.ndarray:
        x, y, z = p
        girth = (1.0 - 0.18 * x) * (1.0 - 0.22 * np.exp(-(((x - 0.15) / 0.38) ** 2)))
        hollow = 0.24 * np.exp(-((z / 0.34) ** 2)) * np.exp(-(((x + 0.1) / 0.75) ** 2)) * (0.5 * (1.0 + y)) ** 2
        return np.stack([1.6 * x, 0.5 * girth * y + 0.14 * x * x - hollow, 0.78 * girth * z])

    directions, faces = _icosphere(subdivisions)
    points, normals = _mapped(body, directions)
    points = points - np.array([0.0, points[:, 1].min(), 0.0])
    return _with_uv(Mesh(points, normals, faces, name="speed_shape"), directions, uv)


def cloth(divisions: int = 160) -> Mesh:
    """Return a square cloth, 2 x 2, laid over a ball: a dome that falls into six smooth folds. Open; front side up,
    with uv.

    A height field y(x, z); its lowest point is y = 0.
    """

    def drape(p: np.ndarray) -> np.ndarray:
        x, z = p
        squared = x * x + z * z
        # The real part of (x + iz)^6 is r^6 cos(6 angle), so that folds vanish smoothly at the centre.
        sixfold = x**6 - 15.0 * x**4 * z**2 + 15.0 * x**2 * z**4 - z**6
        folds = 0.3 * sixfold / (0.32 + squared) ** 3
        fall = 0.75 * (1.0 - np.exp(-((squared / 0.55) ** 2)))
        return np.stack([x, folds - fall * 0.9 - 0.12 * squared, z])

    if not 1 <= divisions <= 2000:
        raise InputError("divisions out of range", field="divisions", found=divisions, expected="1 to 2000")
    xz, faces = _grid(divisions, divisions)
    points, normals = _patch(drape, 2.0 * xz - 1.0)
    points = points - np.array([0.0, points[:, 1].min(), 0.0])
    return Mesh(points, normals, faces, _uv_from_above(xz), name="cloth")


def plane(width: Number = 10.0, depth: Number = 10.0) -> Mesh:
    """Return a floor: a rectangle in y = 0 about the origin, facing +y, with uv."""
    for field, size in (("width", width), ("depth", depth)):
        if not 0.0 < size < np.inf:
            raise InputError("not the size of a plane", field=field, found=size, expected="a positive length")
    xz, faces = _grid(1, 1)
    points, normals = _patch(lambda p: np.stack([p[0] * width, 0.0 * p[0], p[1] * depth]), xz - 0.5)
    return Mesh(points, normals, faces, _uv_from_above(xz), name="plane")


def patches(count: int = 6, gap: Number = 0.08, tilt_deg: Number = 0.0) -> tuple[Mesh, ...]:
    """Return `count` flat square chips of side 1 in a row along x, facing +z, centred on the origin; one mesh each.

    `tilt_deg` tilts each chip about its own horizontal axis, top away from the viewer.
    """
    if count < 1:
        raise InputError("no patches", field="count", found=count, expected="at least 1")
    angle = np.deg2rad(tilt_deg)
    up = np.array([0.0, np.cos(angle), -np.sin(angle)])
    normal = np.array([0.0, np.sin(angle), np.cos(angle)])
    uv = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    chips = []
    for k in range(count):
        centre = np.array([(k - (count - 1) / 2.0) * (1.0 + gap), 0.0, 0.0])
        corners = centre + (uv[:, :1] - 0.5) * np.array([1.0, 0.0, 0.0]) + (uv[:, 1:] - 0.5) * up
        chips.append(Mesh(corners, np.tile(normal, (4, 1)), faces, uv, name=f"patch_{k + 1}"))
    return tuple(chips)


def triangles(shape: str, subdivisions: int = 6, divisions: int = 160, **_more: Any) -> int:
    """Count the triangles of a shape; 0 for settings out of range, which the shape itself refuses."""
    if shape in ("sphere", "speed_shape"):
        return 20 * 4**subdivisions if 0 <= subdivisions <= 9 else 0
    return 2 * divisions**2 if shape == "cloth" and divisions <= 2000 else 2


def _icosphere(subdivisions: int) -> tuple[Float[np.ndarray, "V 3"], Int[np.ndarray, "F 3"]]:
    """Return unit vectors and 20 * 4^subdivisions triangles, wound anticlockwise seen from outside."""
    if not 0 <= subdivisions <= 9:
        raise InputError("subdivisions out of range", field="subdivisions", found=subdivisions, expected="0 to 9")
    golden = (1.0 + np.sqrt(5.0)) / 2.0
    short = [[s, t * golden, 0.0] for s in (-1.0, 1.0) for t in (-1.0, 1.0)]
    points = unit(np.array([np.roll(corner, k) for k in range(3) for corner in short]))
    faces = _hull_faces(points)
    for _ in range(subdivisions):
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        # Each pair of vertices as one integer, which sorts much faster.
        pairs, number = np.unique(edges[:, 0] * len(points) + edges[:, 1], return_inverse=True)
        middle = len(points) + number.reshape(3, -1)
        points = np.concatenate([points, unit(points[pairs // len(points)] + points[pairs % len(points)])])
        (a, b, c), (ab, bc, ca) = faces.T, middle
        faces = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return points, faces


def _with_uv(mesh: Mesh, directions: Float[np.ndarray, "V 3"], wanted: bool) -> Mesh:
    """Add longitude and latitude as uv to a closed shape if `wanted`, with vertices split along the seam and at the
    poles.

    Triangles across the seam extend beyond u = 1; at a pole each triangle has the longitude of its centre.
    """
    if not wanted:
        return mesh
    x, y, z = directions.T
    u = (np.arctan2(x, z) / (2.0 * np.pi) + 0.5)[mesh.faces]
    v = (np.arcsin(np.clip(y, -1.0, 1.0)) / np.pi + 0.5)[mesh.faces]
    pole = (np.hypot(x, z) < 1e-9)[mesh.faces]
    largest = np.where(pole, -np.inf, u).max(axis=1, keepdims=True)
    u = np.where(largest - u > 0.5, u + 1.0, u)
    middle = np.where(pole, 0.0, u).sum(axis=1, keepdims=True) / (~pole).sum(axis=1, keepdims=True)
    u = np.where(pole, middle, u)
    corners, number = welded(np.stack([mesh.faces, u, v], axis=-1).reshape(-1, 3))
    old = corners[:, 0].astype(np.int64)
    return Mesh(mesh.vertices[old], mesh.normals[old], number.reshape(-1, 3), corners[:, 1:], name=mesh.name)


def _hull_faces(points: Float[np.ndarray, "12 3"]) -> Int[np.ndarray, "20 3"]:
    """Return the triangles of an icosahedron: its triples of mutual neighbours, facing outwards."""
    near = points @ points.T > 0.4
    triples = [
        (i, j, k)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if near[i, j] and near[j, k] and near[i, k]
    ]
    faces = np.array(triples)
    inward = np.linalg.det(points[faces]) < 0.0
    return np.where(inward[:, None], faces[:, ::-1], faces)


def _grid(rows: int, columns: int) -> tuple[Float[np.ndarray, "V 2"], Int[np.ndarray, "F 3"]]:
    """Return grid points (x, z) of [0, 1]^2 and triangles facing +y."""
    x, z = np.meshgrid(np.linspace(0.0, 1.0, columns + 1), np.linspace(0.0, 1.0, rows + 1))
    corner = np.arange(rows * (columns + 1)).reshape(rows, columns + 1)[:, :-1].reshape(-1)
    below = corner + columns + 1
    faces = np.concatenate(
        [np.stack([corner, below, corner + 1], axis=1), np.stack([corner + 1, below, below + 1], axis=1)]
    )
    return np.stack([x.reshape(-1), z.reshape(-1)], axis=1), faces


def _uv_from_above(xz: Float[np.ndarray, "V 2"]) -> Float[np.ndarray, "V 2"]:
    """Return u along x and v against z: an image facing up, with its lower edge nearest to the viewer."""
    return np.stack([xz[:, 0], 1.0 - xz[:, 1]], axis=1)


def _partials(surface: Callable[[np.ndarray], np.ndarray], p: np.ndarray) -> np.ndarray:
    """Differentiate `surface` (k, n) -> (3, n) with respect to its k parameters at `p` (n, k): (n, 3, k)."""
    columns = []
    for k in range(p.shape[1]):
        stepped = p.T.astype(np.complex128)
        stepped[k] += 1j * STEP
        columns.append(surface(stepped).imag / STEP)
    return np.stack(columns, axis=-1).transpose(1, 0, 2)


def _mapped(
    body: Callable[[np.ndarray], np.ndarray], directions: Float[np.ndarray, "V 3"]
) -> tuple[Float[np.ndarray, "V 3"], Float[np.ndarray, "V 3"]]:
    """Map a sphere by a map of space; normals are transformed by the inverse transpose of its derivative."""
    jacobian = _partials(body, directions)
    normals = np.linalg.solve(jacobian.transpose(0, 2, 1), directions[..., None])[..., 0]
    return body(directions.T).T, unit(normals)


def _patch(
    surface: Callable[[np.ndarray], np.ndarray], parameters: Float[np.ndarray, "V 2"]
) -> tuple[Float[np.ndarray, "V 3"], Float[np.ndarray, "V 3"]]:
    """Return points and normals of a surface parametrised by (x, z), facing +y."""
    partials = _partials(surface, parameters)
    return surface(parameters.T).T, unit(np.cross(partials[..., 1], partials[..., 0]))
