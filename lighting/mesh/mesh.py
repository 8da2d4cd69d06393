"""Triangle meshes with normals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from ...runtime.errors import InputError, UnknownNameError
from ..vectors import Number, VectorLike, dot, unit
from .tangents import Tangents, horizontal_tangents, uv_tangents
from .true_size import uv_lengths

# Ratio of height to longest side below which a triangle has no normal in float64.
THINNEST = 1e-10


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with a unit shading normal at each vertex.

    Parameters
    ----------
    vertices : (V, 3) world coordinates.
    normals : (V, 3) unit vectors on the side from which the triangles wind anticlockwise.
    faces : (F, 3) indices of vertices.
    uv : (V, 2) texture coordinates, or None: (0, 0) is the lower left corner of an image, v grows upwards. They
        determine the tangents of anisotropic materials.
    part_names, face_part : names of the parts in the file, and the part of each triangle.
    notes : on everything dropped, computed or flipped while reading.

    Raises
    ------
    InputError : wrong shapes, indices out of range, non-finite numbers, no triangle, a degenerate triangle.
        `cleaned_mesh` accepts such data where possible, and notes its changes.
    """

    vertices: Float[np.ndarray, "V 3"]
    normals: Float[np.ndarray, "V 3"]
    faces: Int[np.ndarray, "F 3"]
    uv: Float[np.ndarray, "V 2"] | None = None
    part_names: tuple[str, ...] = ()
    face_part: Int[np.ndarray, " F"] | None = None
    notes: tuple[str, ...] = ()
    name: str = field(default="mesh")

    def __post_init__(self) -> None:
        for name, dtype in (("vertices", np.float64), ("normals", np.float64), ("faces", np.int64), ("uv", np.float64)):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, np.ascontiguousarray(value, dtype=dtype))
        check_arrays(self.vertices, self.faces, self.name)
        if self.normals.shape != self.vertices.shape:
            raise InputError(
                "one normal a vertex is needed",
                file=self.name,
                field="normals",
                found=self.normals.shape,
                expected=str(self.vertices.shape),
            )
        off = np.abs(np.linalg.norm(self.normals, axis=1) - 1.0)
        if not (off < 1e-6).all():
            raise InputError(
                "normals are not unit vectors",
                file=self.name,
                field="normals",
                found=f"worst length off by {off.max():g}",
                expected="length 1 to within 1e-6",
            )
        if self.uv is not None and (self.uv.shape != (len(self.vertices), 2) or not np.isfinite(self.uv).all()):
            raise InputError(
                "texture coordinates do not fit",
                file=self.name,
                field="uv",
                found=self.uv.shape,
                expected=f"{(len(self.vertices), 2)}, finite numbers",
            )
        if self.face_part is not None and len(self.face_part) != len(self.faces):
            raise InputError(
                "one part number a triangle is needed",
                file=self.name,
                field="face_part",
                found=len(self.face_part),
                expected=str(len(self.faces)),
            )
        thin = degenerate_faces(self.vertices, self.faces)
        if thin.any():
            raise InputError(
                f"{int(thin.sum())} triangles without area",
                file=self.name,
                field="faces",
                found=f"first: number {int(np.argmax(thin))}",
                hint="cleaned_mesh drops them",
            )

    @cached_property
    def face_normals(self) -> Float[np.ndarray, "F 3"]:
        """Unit normals of the flat triangles, on the anticlockwise side."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        return unit(np.cross(b - a, c - a))

    @cached_property
    def tangents(self) -> Tangents:
        """Tangents by corner, and handedness by triangle: along increasing u by MikkTSpace's convention (`tangents`)
        where there are texture coordinates, else horizontal (`stated_tangents`) and unmirrored.
        """
        if self.uv is None:
            return horizontal_tangents(self.normals, self.faces)
        return uv_tangents(self.vertices, self.normals, self.faces, self.uv)

    @cached_property
    def bounds(self) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
        """Lowest and highest corner of the bounding box of used vertices."""
        used = self.vertices[np.unique(self.faces)]
        return used.min(axis=0), used.max(axis=0)

    def transformed(self, matrix: Float[np.ndarray, "4 4"]) -> Mesh:
        """Transform by an affine `matrix`; normals by its inverse transpose, and a mirroring matrix reverses the
        winding.
        """
        matrix = np.asarray(matrix, dtype=np.float64)
        linear = matrix[:3, :3]
        determinant = np.linalg.det(linear)
        if not np.isfinite(matrix).all() or determinant == 0.0:
            raise InputError(
                "transform flattens the mesh",
                file=self.name,
                field="transform",
                found=matrix.tolist(),
                expected="finite numbers, with a determinant other than 0",
            )
        normals = unit(self.normals @ np.linalg.inv(linear))
        faces = self.faces if determinant > 0.0 else self.faces[:, ::-1]
        return replace(self, vertices=self.vertices @ linear.T + matrix[:3, 3], normals=normals, faces=faces)

    def placed(
        self,
        scale: Number | Sequence[Number] = 1.0,
        rotate_deg: VectorLike = (0.0, 0.0, 0.0),
        translate: VectorLike = (0.0, 0.0, 0.0),
        uv_scale: Number | Sequence[Number] = 1.0,
        uv_rotate_deg: Number = 0.0,
        uv_size_mm: Number | Sequence[Number] | None = None,
    ) -> Mesh:
        """Scale, then rotate about x, y and z in this order, then translate: the keys of a part in scene files.

        uv_rotate_deg rotates textures anticlockwise about (u, v) = (0, 0), then uv_scale repeats them by a factor: one
        number, or one each for u and v; negative ones mirror. Directions along u, as the grain of an anisotropic
        material, rotate too. uv_size_mm, instead of uv_scale, is the width and height of a texture on the placed mesh,
        whose unit is a metre; the mean if the mapping is uneven (with a note).

        Raises
        ------
        InputError : a scale of 0; uv parameters for a mesh without texture coordinates; uv_size_mm together with
        uv_scale, or not positive.

        >>> from metamer.lighting.mesh.shapes import plane
        >>> plane(2.0, 2.0).placed(scale=0.5, rotate_deg=(90, 0, 0), translate=(0, 0, 3)).bounds[1].round(6).tolist()
        [0.5, 0.5, 3.0]
        """
        repeats = np.broadcast_to(np.asarray(uv_scale, dtype=np.float64), 2)
        stated = bool((repeats != 1.0).any() or uv_rotate_deg or uv_size_mm is not None)
        if stated and self.uv is None:
            hint = "unwrap it in the program that made it and export it again"
            raise InputError("the mesh has no texture coordinates", field="uv_scale", found=self.name, hint=hint)
        matrix = np.eye(4)
        matrix[:3, :3] = np.diag(np.broadcast_to(np.asarray(scale, dtype=np.float64), 3))
        for axis, angle in enumerate(np.deg2rad(rotate_deg)):
            turn = np.eye(3)
            a, b = (axis + 1) % 3, (axis + 2) % 3
            turn[a, a] = turn[b, b] = np.cos(angle)
            turn[b, a], turn[a, b] = np.sin(angle), -np.sin(angle)
            matrix[:3, :3] = turn @ matrix[:3, :3]
        matrix[:3, 3] = translate
        placed = self.transformed(matrix)
        if not stated or placed.uv is None:
            return placed
        angle = np.deg2rad(uv_rotate_deg)
        u, v = placed.uv.T
        turned = np.stack([np.cos(angle) * u + np.sin(angle) * v, np.cos(angle) * v - np.sin(angle) * u], axis=1)
        if uv_size_mm is None:
            return replace(placed, uv=turned * repeats)
        size = np.broadcast_to(np.asarray(uv_size_mm, dtype=np.float64), 2)
        if (repeats != 1.0).any() or not (np.isfinite(size) & (size > 0.0)).all():
            expected = "millimetres, more than 0, and no uv_scale beside it"
            raise InputError("not a size of a texture", field="uv_size_mm", found=uv_size_mm, expected=expected)
        lengths = uv_lengths(placed.vertices[placed.faces], turned[placed.faces], placed.name)
        said = () if lengths.words is None else (f"{placed.name}: {lengths.words}",)
        return replace(placed, uv=turned * (1000.0 * lengths.mean / size), notes=(*placed.notes, *said))

    def part(self, name: str) -> Mesh:
        """Return only the triangles of the part called `name`."""
        if name not in self.part_names or self.face_part is None:
            raise UnknownNameError("part of the mesh", name, self.part_names, file=self.name)
        faces = self.faces[self.face_part == self.part_names.index(name)]
        used, packed = np.unique(faces, return_inverse=True)
        return Mesh(
            self.vertices[used],
            self.normals[used],
            packed.reshape(-1, 3),
            None if self.uv is None else self.uv[used],
            (name,),
            np.zeros(len(faces), np.int64),
            self.notes,
            self.name,
        )


def check_arrays(vertices: np.ndarray, faces: np.ndarray, source: str | Path) -> None:
    """Raise InputError, naming `source`, unless these are triangles over finite points."""
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        found = vertices.shape
        raise InputError("vertices are not points", file=source, field="vertices", found=found, expected="(V, 3)")
    if faces.ndim != 2 or faces.shape[1] != 3:
        raise InputError("faces are not triangles", file=source, field="faces", found=faces.shape, expected="(F, 3)")
    if len(faces) == 0 or len(vertices) == 0:
        raise InputError("the mesh is empty", file=source, field="faces", found="no triangles", expected="at least one")
    if faces.min() < 0 or faces.max() >= len(vertices):
        found = int(faces.max()) if faces.max() >= len(vertices) else int(faces.min())
        raise InputError(
            "a triangle uses a vertex that is not there",
            file=source,
            field="faces",
            found=found,
            expected=f"0 to {len(vertices) - 1}",
        )
    bad = ~np.isfinite(vertices).all(axis=1)
    if bad.any():
        first = int(np.argmax(bad))
        raise InputError(
            f"{int(bad.sum())} vertices are not finite numbers",
            file=source,
            field=f"vertex {first}",
            found=vertices[first].tolist(),
            expected="three finite numbers",
            hint="export the mesh again from the program that made it",
        )


def degenerate_faces(vertices: Float[np.ndarray, "V 3"], faces: Int[np.ndarray, "F 3"]) -> np.ndarray:
    """Return a mask (F,) of degenerate triangles: repeated corners, or a height below `THINNEST` times the longest
    side.
    """
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    longest = np.max([dot(b - a, b - a), dot(c - b, c - b), dot(a - c, a - c)], axis=0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) <= THINNEST * longest


def floats(words: Sequence[str]) -> Float[np.ndarray, " n"]:
    """Parse the words of a file as numbers.

    Raises
    ------
    ValueError : a word that is no number, also one with underscores between digits, which Python would accept.
    """
    for word in words:
        if "_" in word:
            raise ValueError(f"not a number: {word!r}")
    return np.array(list(map(float, words)), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class MeshPiece:
    """Triangles with one material and one transform.

    Parameters
    ----------
    name, material : as in the file; "" for no material.
    vertices, normals, uv : (V, 3), (V, 3) or None, (V, 2) or None with v upwards; unchecked, as in the file.
    faces : (F, 3) indices of vertices.
    world_from_piece : (4, 4) transform to the file's world.
    """

    name: str
    vertices: Float[np.ndarray, "V 3"]
    faces: Int[np.ndarray, "F 3"]
    normals: np.ndarray | None = None
    uv: np.ndarray | None = None
    material: str = ""
    world_from_piece: Float[np.ndarray, "4 4"] = field(default_factory=lambda: np.eye(4))
