"""OFF (Geomview's Object File Format): vertices and polygons as text, with colours, normals or texture coordinates."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NoReturn

import numpy as np

from ...runtime.errors import InputError
from .mesh import MeshPiece, floats
from .polygons import triangulated

_AGAIN = "the file is damaged or cut short: export or copy it again"


def off_pieces(path: Path) -> tuple[list[MeshPiece], list[str]]:
    """Read the polygons of an OFF file as one piece, and notes on omissions.

    Raises InputError for a file that is not a three-dimensional text OFF, is truncated, or uses an undefined vertex.
    """
    rows, head = _rows(path)
    (vertex_count, face_count), rows = _counts(path, rows), rows[1:]
    if len(rows) != vertex_count + face_count:
        problem = "the mesh file is cut short" if len(rows) < vertex_count + face_count else "more than the header says"
        found, expected = f"{len(rows)} lines", f"{vertex_count + face_count} lines"
        raise InputError(problem, file=path, found=found, expected=expected, hint=_AGAIN)
    textured, normal = head.startswith("ST"), "N" in head
    least = 3 + 3 * normal + 2 * textured
    told = [_numbers(path, line, words, least) for line, words in rows[:vertex_count]]
    vertices = np.array([row[:3] for row in told]).reshape(-1, 3)
    corners, counts, few = [], [], 0
    for line, words in rows[vertex_count : vertex_count + face_count]:
        face = _face(path, line, words, vertex_count)
        few += len(face) < 3
        if len(face) >= 3:
            corners += face
            counts.append(len(face))
    indices = np.array(corners, dtype=np.int64)
    cut = triangulated(vertices[indices], np.array(counts, dtype=np.int64))
    used, faces = np.unique(indices[cut.corners.reshape(-1)], return_inverse=True)
    normals = np.array([row[3:6] for row in told])[used] if normal else None
    uv = np.array([row[-2:] for row in told])[used] if textured else None
    notes = [f"{path.stem}: left out, {few} faces with fewer than three corners"] if few else []
    notes += cut.notes(path.stem)
    return [MeshPiece(path.stem, vertices[used], faces.reshape(-1, 3), normals, uv)], notes


def _rows(path: Path) -> tuple[list[tuple[int, list[str]]], str]:
    """Return the non-empty lines with their numbers, and the prefix of the keyword OFF."""
    text = path.read_bytes().decode("latin-1")
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    rows = [(number, words) for number, line in enumerate(lines, 1) if (words := line.partition("#")[0].split())]
    head = re.match(r"((?:ST)?C?N?)(4?n?)OFF(.*)", rows[0][1][0]) if rows else None
    if head is None:
        _refuse(path, "not an OFF file", rows[0][0] if rows else 1, text[:12].strip() or "nothing", "OFF")
    if head[2] or "BINARY" in rows[0][1]:
        found = " ".join(rows[0][1])[:40]
        _refuse(path, "a kind of OFF that is not read", rows[0][0], found, "OFF, COFF, NOFF or STOFF as text")
    # Some programs write the counts after the keyword.
    behind = [word for word in (head[3], *rows[0][1][1:]) if word]
    return [(rows[0][0], behind), *rows[1:]] if behind else rows[1:], head[1]


def _counts(path: Path, rows: list[tuple[int, list[str]]]) -> tuple[int, int]:
    line, words = rows[0] if rows else (1, [])
    if len(words) < 2 or not all(word.isdecimal() for word in words[:2]):
        _refuse(path, "no counts", line, " ".join(words)[:40] or "nothing", "how many vertices, faces and edges")
    return int(words[0]), int(words[1])


def _numbers(path: Path, line: int, words: list[str], least: int) -> list[float]:
    try:
        numbers = floats(words).tolist()
    except ValueError:
        numbers = []
    if len(numbers) < least:
        _refuse(path, "not a vertex", line, " ".join(words)[:60], f"{least} numbers or more")
    return numbers


def _face(path: Path, line: int, words: list[str], count: int) -> list[int]:
    """Parse the corners of a face, which a colour may follow."""
    try:
        corners = int(words[0])
        face = [int(word) for word in words[1 : 1 + corners] if "_" not in word]
    except ValueError:
        corners, face = -1, []
    if corners < 0 or len(face) < corners:
        _refuse(path, "not a face", line, " ".join(words)[:60], "a count and as many indices of vertices")
    if face and not 0 <= min(face) <= max(face) < count:
        found = str(max(face) if max(face) >= count else min(face))
        _refuse(path, "a face uses a vertex that is not there", line, found, f"0 to {count - 1}")
    return face


def _refuse(path: Path, problem: str, line: int, found: str, expected: str) -> NoReturn:
    raise InputError(problem, file=path, field=f"line {line}", found=found, expected=expected, hint=_AGAIN)
