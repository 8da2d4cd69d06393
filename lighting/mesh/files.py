"""Reader of mesh files: OBJ, PLY, STL, OFF, glTF and GLB, checked, and cleaned with a note."""

from __future__ import annotations

import re
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np

from ...runtime.errors import InputError
from ..vectors import Number, dot, unit
from .creases import creased_normals
from .gltf import gltf_pieces
from .mesh import Mesh, MeshPiece, check_arrays, degenerate_faces
from .obj import obj_pieces
from .off import off_pieces
from .ply import ply_pieces

# Number of characters for detecting a text's encoding.
_SHORT_TEXT = 8
# Facet normal and corners in a text STL; and the cosine below which a normal is opposite to the winding.
_STL_NUMBERS = re.compile(
    rb"(?:\bfacet\s+normal|\bvertex)(?:\s+[-+]?(?:\d+\.?\d*|\.\d+|nan|inf)(?:e[-+]?\d+)?){3}(?=\s)"
)
_AGAINST = 0.1


def load_mesh(path: str | Path, crease_deg: Number = 40.0, mesh_part: str | None = None) -> Mesh:
    """Read a mesh file; parts of a scene graph are transformed to one coordinate system and keep their names.

    Vertices are split where their texture coordinates differ, whatever the format. v grows upwards as in OBJ and PLY;
    glTF's, which grows downwards, is flipped. Tangents are always computed, even if a glTF has some.

    Parameters
    ----------
    path : an OBJ, PLY, STL, OFF, glTF or GLB file.
    crease_deg : missing normals are computed, smooth across edges below this angle.
    mesh_part : name of the only part to read; it keeps its texture coordinates even if other parts have none.

    Returns
    -------
    Mesh : with `notes` on everything dropped, computed or flipped.

    Raises
    ------
    InputError : the file is missing, of another format, damaged, or without triangles; non-finite numbers.
    UnknownNameError : no part of this name.
    """
    path = Path(path)
    meshes, left_out = _pieces(path, crease_deg)
    mesh = joined([mesh for mesh, _ in meshes], path.stem)
    if mesh_part is not None:
        own = next((one for one, _ in meshes if one.name == mesh_part), mesh)
        alone = mesh.part(mesh_part)
        mesh = alone if own.uv is None else replace(alone, uv=own.uv[np.unique(own.faces)])
    return replace(mesh, notes=(*mesh.notes, *left_out))


def load_mesh_by_material(path: str | Path, crease_deg: Number = 40.0) -> dict[str, Mesh]:
    """Read the meshes of a file by the file's own materials: glTF's `materials`, OBJ's `usemtl`.

    Meshes without one, as all in STL, PLY and OFF, are under "". Parameters and errors: see `load_mesh`.
    """
    path = Path(path)
    meshes, left_out = _pieces(path, crease_deg)
    found: dict[str, list[Mesh]] = {}
    for mesh, material in meshes:
        found.setdefault(material, []).append(mesh)
    whole = {material: joined(several, material or path.stem) for material, several in found.items()}
    return {name: replace(mesh, notes=(*mesh.notes, *left_out)) for name, mesh in whole.items()}


def _pieces(path: Path, crease_deg: Number) -> tuple[list[tuple[Mesh, str]], list[str]]:
    """Read the meshes of a file by pieces, each with the name of its material in the file; and notes."""
    suffix = path.suffix.lower()
    if not path.is_file():
        raise InputError("no such mesh file", file=path, hint="paths in a scene file are relative to it")
    if suffix not in SUFFIXES:
        raise InputError("not a mesh format that is read", file=path, found=path.suffix, expected=", ".join(SUFFIXES))
    _check_encoding(path)
    pieces, notes = _READERS[suffix](path)
    pieces = [piece for piece in pieces if len(piece.faces)]
    if not pieces:
        found = "; ".join(("no triangles", *notes))
        raise InputError("the mesh is empty", file=path, field="faces", found=found, expected="at least one")

    meshes = []
    for piece in pieces:
        label = f"{path} ({piece.name})" if len(pieces) > 1 else str(path)
        arrays = (piece.vertices, piece.faces, piece.normals, piece.uv)
        cleaned = cleaned_mesh(*arrays, source=label, name=piece.name, crease_deg=crease_deg)
        meshes.append((cleaned.transformed(piece.world_from_piece), piece.material))
    return meshes, notes


def _check_encoding(path: Path) -> None:
    """Raise `InputError` for text with two bytes per character, which no format allows."""
    with path.open("rb") as file:
        head = file.read(64)
    for encoding in ("utf-16-le", "utf-16-be"):
        start = head[: len(head) // 2 * 2].decode(encoding, "replace").lstrip("\ufeff")
        if len(start) >= _SHORT_TEXT and start.isascii() and start.translate({9: 32, 10: 32, 13: 32}).isprintable():
            raise InputError(
                "a text in UTF-16",
                file=path,
                field="line 1",
                found=" ".join(start.split())[:40],
                expected="UTF-8 or ASCII, one byte a character",
                hint="save it as UTF-8 in a text editor, or export the mesh again (PowerShell's > writes UTF-16)",
            )


def _stl_pieces(path: Path) -> tuple[list[MeshPiece], list[str]]:
    """Read the solids of an STL file, by trimesh."""
    import trimesh

    data = path.read_bytes()
    _check_stl_facets(path, data)
    try:
        loaded = trimesh.load(BytesIO(data), file_type="stl", process=False)
    except Exception as reason:  # trimesh's readers let any exception out when a file ends early
        raise InputError(
            "the mesh cannot be read; it may be cut short",
            file=path,
            found=f"{type(reason).__name__}: {reason}",
            hint="save or copy it again, and see whether another program opens it",
        ) from reason
    meshes = loaded.geometry if isinstance(loaded, trimesh.Scene) else {path.stem: loaded}
    solids = ((name, mesh) for name, mesh in sorted(meshes.items()) if isinstance(mesh, trimesh.Trimesh))
    return [MeshPiece(name, mesh.vertices, mesh.faces) for name, mesh in solids], _windings_noted(path.stem, data)


def _windings_noted(name: str, data: bytes) -> list[str]:
    """Return a note on facets of an STL file whose normals contradict the winding, which takes precedence."""
    if len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"):
        facets = np.frombuffer(data, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("", "<u2")], offset=84)
        normals, corners = facets["normal"].astype(np.float64), facets["corners"].astype(np.float64)
    else:
        said = re.findall(_STL_NUMBERS, data.lower())
        rows = np.array([row.split()[-3:] for row in said], dtype=np.float64).reshape(-1, 3)
        kinds = [row[0] for row in said]
        if kinds != [*b"fvvv"] * (len(said) // 4):
            return []
        normals, corners = rows[::4], rows.reshape(-1, 4, 3)[:, 1:]
    with np.errstate(all="ignore"):
        wound = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        least = _AGAINST * np.linalg.norm(wound, axis=1) * np.linalg.norm(normals, axis=1)
        count = int((np.einsum("fk,fk->f", wound, normals) < -least).sum())
    sentence = f"{count} of {len(normals)} facets have normals against the order of their corners, which is followed"
    return [f"{name}: {sentence}"] if count else []


def cleaned_mesh(
    vertices, faces, normals=None, uv=None, *, source: str | Path = "mesh", name: str = "mesh", crease_deg: Number = 40
) -> Mesh:
    """Build a mesh from raw arrays: degenerate triangles are dropped, missing normals computed, each with a note.

    Raises InputError (naming `source`) for non-finite vertices, indices out of range, a wrong number of normals, or no
    triangle left.
    """
    vertices = np.asarray(vertices, dtype=np.float64)
    faces = np.asarray(faces, dtype=np.int64)
    check_arrays(vertices, faces, source)
    notes: list[str] = []
    thin = degenerate_faces(vertices, faces)
    if thin.all():
        raise InputError(
            "every triangle is degenerate",
            file=source,
            field="faces",
            found=f"{len(faces)} triangles without area",
            expected="at least one with area",
        )
    if thin.any():
        notes.append(f"{name}: dropped {int(thin.sum())} of {len(faces)} triangles, which have no area")
        faces = faces[~thin]

    if uv is not None and (np.shape(uv) != (len(vertices), 2) or not np.isfinite(uv).all()):
        notes.append(f"{name}: texture coordinates do not fit the vertices and are left out")
        uv = None
    if normals is not None:
        normals = np.asarray(normals, dtype=np.float64)
        if normals.shape != vertices.shape:
            raise InputError(
                "normals do not fit the vertices",
                file=source,
                field="normals",
                found=normals.shape,
                expected=str(vertices.shape),
            )
        usable = np.isfinite(normals).all(axis=1) & (np.linalg.norm(normals, axis=1) > 1e-6)
        if not usable[faces].all():
            notes.append(f"{name}: {int((~usable).sum())} normals are zero or not finite; all are computed anew")
            normals = None
    if normals is None:
        if not notes or "computed anew" not in notes[-1]:
            notes.append(f"{name}: no normals in the file; computed, creased at {crease_deg:g} degrees")
        kept, normals, faces = creased_normals(vertices, faces, crease_deg)
        vertices, uv = vertices[kept], None if uv is None else np.asarray(uv)[kept]
    else:
        used = np.unique(faces)
        safe = np.tile([0.0, 0.0, 1.0], (len(vertices), 1))
        safe[used] = unit(normals[used])
        normals = safe
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        against = dot(np.cross(b - a, c - a), normals[faces].sum(axis=1)) < 0.0
        if against.any():
            notes.append(f"{name}: turned {int(against.sum())} triangles that wind against their normals")
            faces = np.where(against[:, None], faces[:, ::-1], faces)
    return Mesh(
        vertices, normals, faces, uv, (name,), np.zeros(len(faces), dtype=np.int64), tuple(notes), name=str(name)
    )


def joined(meshes: list[Mesh], name: str) -> Mesh:
    """Merge meshes; parts keep their names. Texture coordinates are kept only if every part has them."""
    if len(meshes) == 1:
        return meshes[0]
    offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    uv = [mesh.uv for mesh in meshes if mesh.uv is not None]
    notes = tuple(note for mesh in meshes for note in mesh.notes)
    if uv and len(uv) < len(meshes):
        notes += (f"{name}: some parts have texture coordinates and some have none; they are left out",)
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=False)]),
        np.concatenate(uv) if len(uv) == len(meshes) else None,
        tuple(mesh.name for mesh in meshes),
        np.concatenate([np.full(len(mesh.faces), k, dtype=np.int64) for k, mesh in enumerate(meshes)]),
        notes,
        name=name,
    )


def _check_stl_facets(path: Path, data: bytes) -> None:
    """Check that facets of a text STL have three vertices, and that solids end, which trimesh does not."""
    if len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"):
        return
    if data.lstrip()[:5].lower() != b"solid" or b"\0" in data[:84]:
        triangles = int.from_bytes(data[80:84], "little")
        found, expected = f"{len(data)} bytes", f"{84 + 50 * triangles}, for {triangles} triangles"
        hint = "export or copy it again"
        raise InputError(
            "an STL file of another length than it says", file=path, found=found, expected=expected, hint=hint
        )
    data = data.lower()
    # A solid may have any name; vertex lines have a number after the word.
    vertices, facets = (len(re.findall(word, data)) for word in (rb"\bvertex\s+[-+.\dni]", rb"\bouter\s+loop\b"))
    solids, ends = (len(re.findall(rb"(?m)^[ \t]*" + word + rb"\b", data)) for word in (rb"solid", rb"endsolid"))
    if solids != ends and facets:
        found, expected = f"{solids} solid, {ends} endsolid", "an end for each"
        hint = "export or copy it again"
        raise InputError("the mesh file is cut short", file=path, found=found, expected=expected, hint=hint)
    if vertices != 3 * facets:
        found = f"{vertices} vertices in {facets} facets"
        hint = "export it as OBJ, PLY or glTF, or with triangles"
        raise InputError("facets that are not triangles", file=path, found=found, expected="three a facet", hint=hint)


_READERS = {
    ".obj": obj_pieces,
    ".ply": ply_pieces,
    ".stl": _stl_pieces,
    ".off": off_pieces,
    ".gltf": gltf_pieces,
    ".glb": gltf_pieces,
}
SUFFIXES = tuple(_READERS)
