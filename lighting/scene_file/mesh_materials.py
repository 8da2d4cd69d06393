"""Several materials on one mesh: mapping from the mesh file's materials to the catalogue's."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ...runtime.errors import InputError, UnknownNameError
from ..mesh.files import load_mesh_by_material
from ..mesh.mesh import Mesh
from ..vectors import Number
from .keys import WORN, taken


def worn_meshes(
    file: Path, worn: Mapping[str, Any], rest: str | None, crease_deg: Number, path: Path, where: str
) -> Iterator[tuple[str, Mesh, str, dict[str, Any]]]:
    """Yield the pieces of a mesh file by the file's own materials: name, mesh, material id, and texture keys.

    Parameters
    ----------
    worn : maps material names of the file to ids of the catalogue, or to tables with `material`, `uv_scale`,
        `uv_rotate_deg`, `uv_size_mm`.
    rest : material id of pieces that are not in `worn`; None requires all to be.
    path, where : scene file and table, for messages.

    Raises
    ------
    InputError : a file without materials, or pieces without a mapping; see `load_mesh`.
    UnknownNameError : a name that is not in the file.
    """
    pieces = load_mesh_by_material(file, crease_deg)
    known = [name for name in pieces if name]
    if not known:
        raise InputError(
            "the mesh file names no materials",
            file=file,
            field=where,
            found=f"{file.suffix} without any",
            expected="a glTF or OBJ whose faces have materials",
            hint="name one `material` for all of it, or give the faces materials in the program that made it",
        )
    for name in worn:
        if name not in known:
            raise UnknownNameError("material of the mesh", name, known, file=path, field=where)
    others = [name for name in pieces if name not in worn]
    if others and rest is None:
        raise InputError(
            "a mesh whose materials are not all named",
            file=path,
            field=where,
            found=f"nothing for {', '.join(repr(name) if name else 'faces without a material' for name in others)}",
            expected="an id for each material of the file, or `material` for the rest",
        )
    for name, said in worn.items():
        got = taken({"material": said} if isinstance(said, str) else said, WORN, path, f"{where}.{name}")
        if "material" not in got:
            raise InputError("no material", file=path, field=f"{where}.{name}", expected="material, an id")
        yield name, pieces[name], got.pop("material"), got
    for name in others:
        assert rest is not None
        yield name, pieces[name], rest, {}
