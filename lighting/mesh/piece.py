"""Triangles of a mesh file as its reader hands them over, before they are checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int


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
