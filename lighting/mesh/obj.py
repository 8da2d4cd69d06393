"""Wavefront OBJ: polygons by `v`, `vt`, `vn` and `f`, with absolute or relative indices.

The format is Wavefront's "Object Files" (Advanced Visualizer 3.0, appendix B1): indices count from 1 over the whole
file, negative ones back from the last vertex, texture coordinate or normal above their own line, regardless of `o`, `g`
and `s`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import NoReturn

import numpy as np

from ...runtime.errors import InputError
from ...spectral.formats.shared.text import is_number, shortened
from .mesh import MeshPiece, floats
from .polygons import triangulated

_AGAIN = "export the mesh again from the program that made it"
# Count of numbers after each keyword; `v` may be followed by weights or colours, `vt` by a third coordinate.
_NUMBERS = {"v": 3, "vt": 2, "vn": 3}
_KINDS = {"v": "vertex", "vt": "texture coordinate", "vn": "normal"}
_NOT_DRAWN = {"l": "lines", "p": "points", "call": "files that it calls"}
_NOT_DRAWN |= dict.fromkeys(
    ("curv", "curv2", "surf", "bzp", "bsp", "cdc", "cdp", "res"), "free-form curves or surfaces"
)
# Statements that do not affect faces: groups, smoothing, material libraries, attributes of display and of curves.
_MOVES_NOTHING = re.compile(
    r"[ogs]|mg|mtllib|usemap|maplib|lod|shadow_obj|trace_obj|bevel|[cd]_interp|[cs]tech|cs(?:type|h)|deg|bmat|step|parm|"
    r"trim|hole|scrv|sp|end|con|vp"
)
# Lines that may be continued on the next.
_GOES_ON = re.compile(rf"\s*(?:{'|'.join(_NUMBERS)}|fo?)\s")
# Missing index, as that of vt in "1//1".
_ABSENT = np.iinfo(np.int64).max


def obj_pieces(path: Path) -> tuple[list[MeshPiece], list[str]]:
    """Read the polygons of an OBJ file, one piece per material, and notes on omissions.

    Raises InputError, with the line, for an index out of range and for words that are no index or number.
    """
    return _Obj(path).pieces()


class _Obj:
    """Parser of an OBJ file: numbers, and corners of faces by their words."""

    def __init__(self, path: Path) -> None:
        self.path = path
        # Words of all lines of a kind, in order, and their line numbers.
        self.rows: dict[str, list[str]] = {kind: [] for kind in _KINDS}
        self.row_lines: dict[str, list[int]] = {kind: [] for kind in _KINDS}
        # Index of each word, as "1/2/3"; word index of each corner.
        self.words: dict[str, int] = {}
        self.corners: list[int] = []
        # Number of values of each kind above a run of faces.
        self.above: list[tuple[int, ...]] = [(0, 0, 0)]
        # Four numbers per face: number of corners, line, index into `above`, index of the material.
        self.faces: list[int] = []
        self.materials: dict[str, int] = {"": 0}
        self.left_out: dict[str, int] = {}
        self.unknown: dict[str, int] = {}
        self._read()

    def _read(self) -> None:
        material = 0
        rows, row_lines, words, append = self.rows, self.row_lines, self.words, self.corners.append
        for number, line in _lines(self.path.read_bytes()):
            said = line.split()
            if not said:
                continue
            kind = said[0]
            if kind in _NUMBERS:
                width = _NUMBERS[kind]
                if len(said) <= width:
                    if kind != "vt" or len(said) < 2:
                        self._refuse("not a row of numbers", number, line.strip(), f"{kind} and {width} numbers")
                    said.append("0")  # v defaults to 0
                rows[kind] += said[1 : 1 + width]
                row_lines[kind].append(number)
            elif kind in ("f", "fo"):
                corners = said[1:] if "#" not in line else line.partition("#")[0].split()[1:]
                if len(corners) < 3:
                    self._leave_out("faces with fewer than three corners")
                    continue
                now = (len(row_lines["v"]), len(row_lines["vt"]), len(row_lines["vn"]))
                if now != self.above[-1]:
                    self.above.append(now)
                for word in corners:
                    append(words.setdefault(word, len(words)))
                self.faces += (len(corners), number, len(self.above) - 1, material)
            elif kind == "usemtl":
                material = self.materials.setdefault(line.strip()[6:].strip(), len(self.materials))
            elif kind in _NOT_DRAWN:
                self._leave_out(_NOT_DRAWN[kind])
            elif kind[0].isalpha() and not _MOVES_NOTHING.fullmatch(kind):
                self.unknown[kind] = self.unknown.get(kind, 0) + 1

    def _leave_out(self, what: str) -> None:
        self.left_out[what] = self.left_out.get(what, 0) + 1

    def pieces(self) -> tuple[list[MeshPiece], list[str]]:
        """Return triangles by material, and notes."""
        notes = [f"{self.path.stem}: left out, {count} {what}" for what, count in self.left_out.items()]
        if self.unknown:
            kinds, count = (
                ", ".join(f"{shortened(kind, 20)!r}" for kind in [*self.unknown][:4]),
                sum(self.unknown.values()),
            )
            notes.append(f"{self.path.stem}: left out, {count} lines of kinds that OBJ does not have: {kinds}")
        if not self.faces:
            return [], notes
        counts, lines, above, worn = np.array(self.faces).reshape(-1, 4).T
        corners = self._indices(counts, lines, above)
        values = [self._values(kind) for kind in _KINDS]
        cut = triangulated(values[0][corners[:, 0]], counts)
        notes += cut.notes(self.path.stem)
        worn = worn[cut.polygon]
        used = [(name, worn == number) for name, number in self.materials.items() if (worn == number).any()]
        pieces = []
        for material, own in used:
            name = self.path.stem if len(used) == 1 else material or self.path.name
            pieces.append(_piece(name, material, values, corners[cut.corners[own]], notes))
        return sorted(pieces, key=lambda piece: piece.name), notes

    def _values(self, kind: str) -> np.ndarray:
        """Return the numbers of a kind of line, (n, 3) or (n, 2)."""
        width = _NUMBERS[kind]
        words = self.rows[kind]
        try:
            return floats(words).reshape(-1, width)
        except ValueError:
            at = next(at for at, word in enumerate(words) if "_" in word or not is_number(word))
            self._refuse("not a number", self.row_lines[kind][at // width], words[at], f"{kind} and {width} numbers")

    def _indices(self, counts: np.ndarray, lines: np.ndarray, above: np.ndarray) -> np.ndarray:
        """Return (corners, 3) indices from 0 into v, vt and vn; `_ABSENT` for none."""
        parsed = np.full((len(self.words), 3), _ABSENT, dtype=np.int64)
        try:
            for word, number in self.words.items():
                for k, index in enumerate(word.split("/")):
                    if index or k == 0:
                        parsed[number, k] = _whole(index)
        except (ValueError, IndexError, OverflowError):
            self._check_words()
        corners = parsed[np.array(self.corners)]
        face = np.repeat(np.arange(len(counts)), counts)
        stands = np.array(self.above)[above]
        for k, kind in enumerate(_KINDS):
            index, total = corners[:, k], len(self.row_lines[kind])
            before = stands[face, k]
            there = index != _ABSENT
            low, high = np.where(index < 0, -before, 1), np.where(index < 0, -1, total)
            bad = there & ((index < low) | (index > high))
            if bad.any():
                first = int(np.argmax(bad))
                expected = f"1 to {total}, or -1 to -{before[first]}" if total else f"no index: the file has no {kind}"
                problem = f"a face uses a {_KINDS[kind]} that is not there"
                self._refuse(problem, int(lines[face[first]]), f"index {index[first]}", expected)
            corners[:, k] = np.where(there, np.where(index < 0, index + before, index - 1), _ABSENT)
        return corners

    def _check_words(self) -> None:
        """Raise `InputError` for the first corner of a face that is no index."""
        names, corners = list(self.words), iter(self.corners)
        for count, line in zip(self.faces[::4], self.faces[1::4], strict=True):
            for word in (names[next(corners)] for _ in range(count)):
                parts = word.split("/")
                if len(parts) > 3 or not all(_is_whole(part) or (k and not part) for k, part in enumerate(parts)):
                    self._refuse("not a corner of a face", line, word, "v, v/vt, v//vn or v/vt/vn")

    def _refuse(self, problem: str, line: int, found: str, expected: str) -> NoReturn:
        raise InputError(problem, file=self.path, field=f"line {line}", found=found, expected=expected, hint=_AGAIN)


def _piece(name: str, material: str, values: list[np.ndarray], corners: np.ndarray, notes: list[str]) -> MeshPiece:
    """Build a piece from triangles (F, 3, 3) of indices into v, vt and vn: one vertex per distinct triple."""
    indices = corners.reshape(-1, 3).copy()
    missing = (indices == _ABSENT).any(axis=0)
    for k, words in ((1, "texture coordinates; they are"), (2, "a normal; those that are there are")):
        if missing[k] and not (indices[:, k] == _ABSENT).all():
            notes.append(f"{name}: not every corner has {words} left out")
    indices[:, missing] = 0
    _, first, faces = np.unique(
        (indices[:, 0] * (len(values[1]) + 1) + indices[:, 1]) * (len(values[2]) + 1) + indices[:, 2],
        return_index=True,
        return_inverse=True,
    )
    rows = indices[first]
    uv = None if missing[1] else values[1][rows[:, 1]]
    normals = None if missing[2] else values[2][rows[:, 2]]
    return MeshPiece(name, values[0][rows[:, 0]], faces.reshape(-1, 3), normals, uv, material)


def _lines(data: bytes) -> Iterable[tuple[int, str]]:
    """Return the lines of a file with their numbers; numbers and faces that end in a backslash are joined with the next
    line. Comments and file names may end in one without continuation.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if "\\" not in text:
        return enumerate(lines, 1)
    joined: list[tuple[int, str]] = []
    pending, start = "", 0
    for number, line in enumerate(lines, 1):
        start = start or number
        if line.rstrip().endswith("\\") and (pending or _GOES_ON.match(line)) and "#" not in line:
            pending += line.rstrip()[:-1] + " "
            continue
        joined.append((start, pending + line))
        pending, start = "", 0
    return [*joined, (start or 1, pending)]


def _whole(word: str) -> int:
    """Parse an index; raises for underscores between digits, which Python would accept."""
    if "_" in word:
        raise ValueError(word)
    return int(word)


def _is_whole(word: str) -> bool:
    try:
        return abs(_whole(word)) < _ABSENT
    except ValueError:
        return False
