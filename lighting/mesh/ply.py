"""PLY (Turk 1994): elements with properties and lists, as text or binary of either byte order; polygonal faces."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import numpy as np

from ...runtime.errors import InputError
from ..vectors import welded
from .mesh import MeshPiece, floats
from .polygons import triangulated

_AGAIN = "the file is damaged or cut short: export or copy it again"
_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4"}
_TYPES |= {"double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"}
_TYPES |= {"float32": "f4", "float64": "f8"}
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_INDICES = ("vertex_indices", "vertex_index")
_UV = (("texture_u", "texture_v"), ("u", "v"), ("s", "t"))


def ply_pieces(path: Path) -> tuple[list[MeshPiece], list[str]]:
    """Read the faces and strips of a PLY file as one piece, and notes on omissions.

    Raises InputError for a file that is no PLY, is truncated, or uses an undefined vertex.
    """
    ply = _Ply(path)
    vertices, corners, counts, corner_uv, notes = ply.mesh()
    cut = triangulated(vertices[corners], counts)
    notes += cut.notes(path.stem)
    chosen = cut.corners.reshape(-1)
    if corner_uv is None:
        used, faces = np.unique(corners[chosen], return_inverse=True)
        uv = next((found[used] for names in _UV if (found := ply.columns(*names)) is not None), None)
    else:
        # Corners of a vertex are split where their texture coordinates differ.
        rows, faces = welded(np.column_stack([corners[chosen], corner_uv[chosen]]))
        used, uv = rows[:, 0].astype(np.int64), rows[:, 1:]
    normals = ply.columns("nx", "ny", "nz")
    normals = None if normals is None else normals[used]
    return [MeshPiece(path.stem, vertices[used], faces.reshape(-1, 3), normals, uv)], notes


@dataclass(frozen=True)
class _Property:
    """Property of an element: a number, or a list if `counted` names the type of its length."""

    name: str
    kind: str
    counted: str = ""


@dataclass
class _Element:
    """Element: rows of the same properties, with the offset of each in bytes or words, and offsets and lengths of
    lists.
    """

    name: str
    count: int
    properties: list[_Property]

    def __post_init__(self) -> None:
        self.starts: dict[str, np.ndarray] = {}
        self.lengths: dict[str, np.ndarray] = {}

    def named(self, name: str) -> _Property | None:
        """Return the property of that name."""
        return next((one for one in self.properties if one.name == name), None)

    @property
    def has_indices_of_no_face(self) -> bool:
        """True for polygons under a non-standard name, and for range grids."""
        return self.name not in ("face", "tristrips") and any(one.name in _INDICES for one in self.properties)


class _Ply:
    """Parsed PLY file: its header and data, raw bytes or the words of a text as floats."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.elements: list[_Element] = []
        data = path.read_bytes()
        body = self._header(data)
        if self.order:
            self.raw = data[body:]
            self.body = np.frombuffer(self.raw, np.uint8)
        else:
            self._check_lines(data[body:])
            try:
                self.body = floats(data[body:].decode("latin-1").split())
            except ValueError as reason:
                self._refuse("not numbers", "body", str(reason), "numbers with blanks between them")
        end = 0
        for element in self.elements:
            end = self._scan(element, end)
        rest = bytes(self.body[end:]) if self.order else b"x" * (len(self.body) - end)
        if rest.strip():
            self._refuse("more than the header says", "body", f"{len(rest)} too many", "what the header counts", _AGAIN)

    def _header(self, data: bytes) -> int:
        """Parse the elements; return the offset of the data."""
        first = re.match(rb"ply[ \t]*(\r\n|\n|\r)", data)
        if not first:
            self._refuse("not a PLY file", "line 1", repr(data[:12]), "ply")
        line_end = b"\r" if first[1] == b"\r" else b"\n"
        end = re.search(rb"(?<=[\r\n])end_header[ \t]*" + (rb"\r?\n" if line_end == b"\n" else line_end), data)
        if not end:
            self._refuse("the header does not end", "header", "no end_header", "end_header", _AGAIN)
        self.order = ""
        lines = data[: end.start()].decode("latin-1").split(line_end.decode())
        said = False
        for number, line in enumerate(lines[1:], 2):
            words = line.split()
            if not words or words[0] in ("comment", "obj_info"):
                continue
            match words:
                case ["format", kind, _] if kind in _FORMATS:
                    self.order, said = _FORMATS[kind], True
                case ["element", name, count] if count.isdecimal():
                    self.elements.append(_Element(name, int(count), []))
                case ["property", "list", counted, kind, name] if self.elements and _is_list(counted, kind):
                    self.elements[-1].properties.append(_Property(name, _TYPES[kind], _TYPES[counted]))
                case ["property", kind, name] if self.elements and kind in _TYPES:
                    self.elements[-1].properties.append(_Property(name, _TYPES[kind]))
                case _:
                    expected = "format, element NAME COUNT, property TYPE NAME or property list TYPE TYPE NAME"
                    self._refuse("not a line of a header", f"line {number}", line.strip()[:60], expected)
        if not said:
            self._refuse("no format", "header", "nothing", f"format {', '.join(_FORMATS)}")
        return end.end()

    def _check_lines(self, body: bytes) -> None:
        """Check the number of lines of a text: each row has one."""
        declared = sum(element.count for element in self.elements)
        lines = sum(1 for line in body.splitlines() if line.strip())
        if lines < declared:
            self._short(f"{lines} lines", f"{declared} lines")

    def _size(self, kind: str) -> int:
        return int(kind[1:]) if self.order else 1

    def _scan(self, element: _Element, start: int) -> int:
        """Locate the properties of all rows; return the offset of the element's end."""
        if not element.count or not element.properties:
            return start
        if not self._even(element, start):
            self._uneven(element, start)
        last = element.properties[-1]
        width = self._size(last.kind)
        end = int(element.starts[last.name][-1]) + width * int(element.lengths.get(last.name, [1])[-1])
        if end > len(self.body):
            self._short(f"{len(self.body)} {self._units}", f"at least {end} {self._units}, by {element.name}")
        return end

    @property
    def _units(self) -> str:
        return "bytes of numbers" if self.order else "numbers"

    def _even(self, element: _Element, start: int) -> bool:
        """Locate rows under the assumption that all are as long as the first; return whether that holds."""
        at, places, lengths = start, {}, {}
        for one in element.properties:
            if one.counted:
                lengths[one.name] = self._count(at, one, element)
                at += self._size(one.counted)
            places[one.name] = at
            at += self._size(one.kind) * lengths.get(one.name, 1)
        if start + element.count * (at - start) > len(self.body):
            if lengths:
                return False
            self._short(f"{len(self.body)} {self._units}", f"at least {start + element.count * (at - start)}")
        rows = (at - start) * np.arange(element.count)
        for one in element.properties:
            if one.counted:
                counts = self._numbers(places[one.name] - self._size(one.counted) + rows, one.counted)
                if (counts != lengths[one.name]).any():
                    return False
        element.starts = {name: place + rows for name, place in places.items()}
        element.lengths = {name: np.full(element.count, length) for name, length in lengths.items()}
        return True

    def _uneven(self, element: _Element, at: int) -> None:
        """Locate rows with lists of different lengths, one by one."""
        starts: dict[str, list[int]] = {one.name: [] for one in element.properties}
        lengths: dict[str, list[int]] = {one.name: [] for one in element.properties if one.counted}
        steps = [
            (starts[one.name], lengths.get(one.name), one, self._size(one.counted or "u1"), self._size(one.kind))
            for one in element.properties
        ]
        for _ in range(element.count):
            for places, counts, one, ahead, width in steps:
                if counts is None:
                    places.append(at)
                    at += width
                else:
                    count = self._count(at, one, element)
                    places.append(at + ahead)
                    counts.append(count)
                    at += ahead + width * count
        element.starts = {name: np.array(places) for name, places in starts.items()}
        element.lengths = {name: np.array(counts) for name, counts in lengths.items()}

    def _count(self, at: int, one: _Property, element: _Element) -> int:
        """Return the length of a list, which must end inside the file."""
        if at + self._size(one.counted) > len(self.body):
            self._short(f"{len(self.body)} {self._units}", f"more, of {element.name}")
        if self.order:
            raw, kind = self.raw[at : at + self._size(one.counted)], one.counted[0]
            count = int.from_bytes(raw, "little" if self.order == "<" else "big", signed=kind == "i")
        else:
            count = self.body[at]
        if not 0 <= count <= len(self.body) or count != int(count):
            self._refuse("not a length of a list", f"{element.name}.{one.name}", count, "0, 1, 2, ...", _AGAIN)
        return int(count)

    def _numbers(self, places: np.ndarray, kind: str) -> np.ndarray:
        """Return the numbers of a type at given offsets."""
        if not self.order:
            return self.body[places]
        dtype = np.dtype(self.order + kind)
        return self.body[places[:, None] + np.arange(dtype.itemsize)].reshape(-1).view(dtype)

    def columns(self, *names: str, of: str = "vertex") -> np.ndarray | None:
        """Return scalar properties as floats (rows, names); None if any is missing."""
        element = next((one for one in self.elements if one.name == of), None)
        if element is None or any((p := element.named(name)) is None or p.counted for name in names):
            return None
        kinds = {one.name: one.kind for one in element.properties}
        empty = np.empty(0, np.int64)
        return np.column_stack(
            [self._numbers(element.starts.get(name, empty), kinds[name]).astype(np.float64) for name in names]
        )

    def _lists(self, element: _Element, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return all numbers of a list property, row after row, and the length of each row's list."""
        one = element.named(name)
        assert one is not None
        starts, lengths = element.starts.get(name, np.empty(0, int)), element.lengths.get(name, np.empty(0, int))
        within = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
        return self._numbers(np.repeat(starts, lengths) + self._size(one.kind) * within, one.kind), lengths

    def mesh(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None, list[str]]:
        """Return vertices, corners of all polygons, the number of corners of each, uv by corner or None, and notes."""
        vertices = self.columns("x", "y", "z")
        if vertices is None:
            self._refuse("no vertices", "header", "no element vertex with x, y and z", "properties x, y, z of vertex")
        notes = [
            f"{self.path.stem}: left out, {element.count} rows of {element.name}"
            for element in self.elements
            if element.count and (element.name == "edge" or element.has_indices_of_no_face)
        ]
        uv = None
        corners, counts = np.empty(0, np.int64), np.empty(0, np.int64)
        for element in self.elements:
            if element.name not in ("face", "tristrips") or not element.count:
                continue
            name = self._index_name(element)
            indices, lengths = self._lists(element, name)
            if element.name == "tristrips":
                triangles = _strips(self._checked(indices, len(vertices), element, -1), lengths)
                corners = np.concatenate([corners, triangles.reshape(-1)])
                counts = np.concatenate([counts, np.full(len(triangles), 3)])
                continue
            indices = self._checked(indices, len(vertices), element, 0)
            kept = lengths >= 3
            if not kept.all():
                notes.append(f"{self.path.stem}: left out, {int((~kept).sum())} faces with fewer than three corners")
            own = element.named("texcoord")
            if own is not None and own.counted:
                told, several = self._lists(element, "texcoord")
                if (several == 2 * lengths).all():
                    uv = told.astype(np.float64).reshape(-1, 2)[np.repeat(kept, lengths)]
                else:
                    notes.append(f"{self.path.stem}: not every corner has texture coordinates; they are left out")
            corners = np.concatenate([indices[np.repeat(kept, lengths)], corners])
            counts = np.concatenate([lengths[kept], counts])
        if uv is not None and len(uv) != len(corners):
            notes.append(f"{self.path.stem}: not every corner has texture coordinates; they are left out")
            uv = None
        return vertices, corners, counts, uv, notes

    def _index_name(self, element: _Element) -> str:
        lists = [one.name for one in element.properties if one.counted]
        name = next((name for name in _INDICES if name in lists), lists[0] if len(lists) == 1 else None)
        if name is None or name == "texcoord":
            found = ", ".join(one.name for one in element.properties) or "no properties"
            self._refuse("no indices of vertices", element.name, found, " or ".join(_INDICES))
        return name

    def _checked(self, indices: np.ndarray, count: int, element: _Element, low: int) -> np.ndarray:
        """Return indices as integers, checked to be of existing vertices."""
        bad = ~((indices >= low) & (indices < count) & (indices == np.floor(indices)))
        if bad.any():
            found = f"{indices[int(np.argmax(bad))]:g}"
            expected = f"{low} to {count - 1}"
            self._refuse("a triangle uses a vertex that is not there", element.name, found, expected, _AGAIN)
        return indices.astype(np.int64)

    def _short(self, found: str, expected: str) -> NoReturn:
        raise InputError("the mesh file is cut short", file=self.path, found=found, expected=expected, hint=_AGAIN)

    def _refuse(self, problem: str, field: str, found: object, expected: str, hint: str | None = None) -> NoReturn:
        raise InputError(problem, file=self.path, field=field, found=found, expected=expected, hint=hint)


def _is_list(counted: str, kind: str) -> bool:
    return counted in _TYPES and kind in _TYPES and _TYPES[counted][0] != "f"


def _strips(indices: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Return the triangles (T, 3) of strips separated by -1, with the winding of every second one reversed."""
    ends = np.cumsum(lengths)
    # Each row ends a strip.
    order = np.insert(indices, ends, -1)
    place = np.arange(len(order))
    since = place - np.maximum.accumulate(np.where(order < 0, place, -1)) - 1
    whole = np.flatnonzero(since[2:] >= 2)
    odd = since[2:][whole] % 2
    triangles = np.stack([order[whole], order[whole + 1 + odd], order[whole + 2 - odd]], axis=1)
    return triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]
