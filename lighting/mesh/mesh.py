"""Triangle meshes with normals: what is drawn and what rays meet."""

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

# A triangle thinner than this, as height over longest side, has no direction that float64 can tell.
THINNEST = 1e-10


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with a unit shading normal at each vertex.

    Parameters
    ----------
    vertices : (V, 3) world coordinates.
    normals : (V, 3) unit vectors on the side from which the triangles wind anticlockwise.
    faces : (F, 3) indices of vertices.
    uv : (V, 2) texture coordinates, or None: (0, 0) is the lower left corner of a picture, v grows upwards. They decide
        the tangent of anisotropic materials.
    part_names, face_part : names of the parts inside the file, and which of them each triangle belongs to.
    notes : what was dropped, computed or turned on the way in; for people, in plain words.

    Raises
    ------
    InputError : wrong shapes, indices out of range, numbers that are not finite, no triangle, a triangle without area.
        `cleaned_mesh` makes a mesh of rougher data and notes what it did.
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
        """Lowest and highest corner of the box around the vertices that triangles use."""
        used = self.vertices[np.unique(self.faces)]
        return used.min(axis=0), used.max(axis=0)

    def transformed(self, matrix: Float[np.ndarray, "4 4"]) -> Mesh:
        """Return the mesh under an affine `matrix`; normals go by the inverse transpose, a mirror turns the winding."""
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
        """Return the mesh scaled, then turned about x, y and z in this order, then moved: the keys of a part of a scene
        file.

        uv_rotate_deg turns textures anticlockwise about (u, v) = (0, 0), then uv_scale repeats them so many times as
        often: one number, or one for u and one for v; a negative one mirrors. What lies along u, as the grain of an
        anisotropic material, turns with it. uv_size_mm, in place of uv_scale, is how wide and high a texture is on
        the placed mesh, whose unit is a metre: on average, where it is laid out unevenly (`notes` say so).

        Raises
        ------
        InputError : scales flatten the mesh; textures are to be turned of a mesh without texture coordinates; a size
        of a texture beside uv_scale, or one that is not above 0.

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
        """Only the triangles of the part called `name`."""
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
    """(F,) True where a triangle has no area: repeated corners, or thinner than `THINNEST` of its longest side."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    longest = np.max([dot(b - a, b - a), dot(c - b, c - b), dot(a - c, a - c)], axis=0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) <= THINNEST * longest


def floats(words: Sequence[str]) -> Float[np.ndarray, " n"]:
    """Return the numbers of the words of a file.

    Raises
    ------
    ValueError : a word that is none; digits with an underscore between them are one to Python, and to no mesh.
    """
    for word in words:
        if "_" in word:
            raise ValueError(f"not a number: {word!r}")
    return np.array(list(map(float, words)), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class MeshPiece:
    """Triangles of one material at one place.

    Parameters
    ----------
    name, material : as the file has them; no material is "".
    vertices, normals, uv : (V, 3), (V, 3) or None, (V, 2) or None with v upwards; rough, as the file has them.
    faces : (F, 3) indices of vertices.
    world_from_piece : (4, 4) the place in the file's own world.
    """

    name: str
    vertices: Float[np.ndarray, "V 3"]
    faces: Int[np.ndarray, "F 3"]
    normals: np.ndarray | None = None
    uv: np.ndarray | None = None
    material: str = ""
    world_from_piece: Float[np.ndarray, "4 4"] = field(default_factory=lambda: np.eye(4))
