"""The container of glTF 2.0 (Khronos 2021, sections 3.6 and 4): JSON, its buffers and its pictures, in bounds.

A .glb is three uint32 (magic "glTF", version, length), then chunks: uint32 length, uint32 type, content; the first is
the JSON, the second the binary buffer. A .gltf is the JSON alone; buffers and pictures are beside it, or embedded in
base64.
"""

from __future__ import annotations

import base64
import binascii
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn
from urllib.parse import unquote

from ...runtime.errors import InputError
from ...runtime.files import existing_file
from .gltf_json import JsonNode, parsed

MAGIC = b"glTF"
MOST_JSON = 128 << 20
MOST_PICTURE = 256 << 20
_AGAIN = "the file is damaged or cut short: export or copy it again"
_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")
_COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
# Components of an element and, of matrices, columns: each column starts at a multiple of four bytes.
_COMPONENTS = {"SCALAR": (1, 1), "VEC2": (2, 1), "VEC3": (3, 1), "VEC4": (4, 1), "MAT2": (2, 2), "MAT3": (3, 3)}
_COMPONENTS["MAT4"] = (4, 4)


@dataclass(frozen=True)
class EncodedPicture:
    """Picture as stored: its bytes, and its type according to the file."""

    name: str
    data: bytes
    field: str


@dataclass(frozen=True)
class GltfFile:
    """A glTF with checked bounds of buffers, views and accessors. Make one with `open_gltf`.

    root : the JSON; binary : offset and length in the file of the GLB's own buffer, if any.
    """

    path: Path
    root: JsonNode
    binary: tuple[int, int] | None

    def picture(self, image: JsonNode) -> EncodedPicture:
        """Return the bytes of one of `images`; raises `InputError` if they are missing, misplaced or too many."""
        name = image.text("name")
        if image.has("uri"):
            uri = image.text("uri")
            beside = None if uri.startswith("data:") else local_path(image, self.path.parent)
            data = _inlined(image) if beside is None else _slice(beside, 0, None, image, "uri")
            return EncodedPicture(name or (beside.name if beside else image.place), data, image.place)
        views = self.root.children("bufferViews")
        view = views[image.whole("bufferView", below=len(views))]
        buffers = self.root.children("buffers")
        number = view.whole("buffer", below=len(buffers))
        offset, length = view.whole("byteOffset", 0), view.whole("byteLength")
        return EncodedPicture(name or image.place, self._bytes(buffers[number], number, offset, length), image.place)

    def has_buffer(self, number: int) -> bool:
        """Return whether one of `buffers` has bytes; those of an extension may have none."""
        buffer = self.root.children("buffers")[number]
        return buffer.has("uri") or (self.binary is not None and number == 0)

    def buffer(self, number: int) -> bytes:
        """Return all bytes of one of `buffers`, however many; raises `InputError` if they are missing or misplaced."""
        buffer = self.root.children("buffers")[number]
        return self._bytes(buffer, number, 0, buffer.whole("byteLength"), most=None)

    def _bytes(self, buffer: JsonNode, number: int, offset: int, length: int, most: int | None = MOST_PICTURE) -> bytes:
        if buffer.has("uri"):
            if buffer.text("uri").startswith("data:"):
                return _inlined(buffer)[offset : offset + length]
            return _slice(local_path(buffer, self.path.parent), offset, length, buffer, "uri", most)
        if self.binary is None or number:
            buffer.refuse("uri", "a buffer without content", "no uri", "a uri, or the binary chunk of a .glb", _AGAIN)
        return _slice(self.path, self.binary[0] + offset, length, buffer, "byteLength", most)


def open_gltf(path: Path) -> GltfFile:
    """Open and check the container in `path`; pictures are read on request.

    Raises
    ------
    InputError
        Not glTF, of version 1.0, truncated, too large; a buffer, view or accessor beyond its container.
    """
    raw, binary = _json_of(existing_file(path))
    root = parsed(raw, path)
    version = root.child("asset").text("version")
    if not re.fullmatch(r"2\.\d+", version):
        hint = "export it as glTF 2.0; in Blender: File, Export, glTF 2.0" if version else "a JSON file of another kind"
        root.child("asset").refuse("version", "not glTF 2.0", repr(version) if version else "nothing", "2.0", hint)
    least = root.child("asset").text("minVersion") or "2.0"
    if least != "2.0":
        root.child("asset").refuse("minVersion", "a later glTF than is read here", repr(least), "2.0")
    gltf = GltfFile(path, root, binary)
    _check_bounds(gltf)
    return gltf


def companions(path: Path) -> Iterator[Path]:
    """Yield the files beside `path` that belong to it: buffers and pictures; none if it cannot be read."""
    try:
        root = parsed(_json_of(path)[0], path)
        named = [node for kind in ("buffers", "images") for node in root.children(kind)]
    except (InputError, OSError):
        return
    for node in named:
        try:
            if node.has("uri") and not node.text("uri").startswith("data:"):
                yield local_path(node, path.parent)
        except InputError:
            continue


def local_path(node: JsonNode, folder: Path) -> Path:
    """Return the file that a `uri` names; it must be relative, and in the folder of the glTF or below.

    Backslashes separate folders unless a file's name contains them: programs on Windows write them, against the rule.
    """
    uri = node.text("uri")
    name = unquote(uri)
    outside = _SCHEME.match(name) or name.startswith(("/", "\\")) or ".." in re.split(r"[/\\]", name)
    expected, hint = "a relative path inside the folder of the file", "put the file beside the glTF and export it again"
    if not name or "\0" in name or outside:
        node.refuse("uri", "a file that is not fetched", repr(uri)[:120], expected, hint)
    path = folder / name
    if "\\" in name and not _is_file(path):
        path = folder / name.replace("\\", "/")
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError):
        inside = False
    if not _is_file(path):
        node.refuse(
            "uri", "no such file", repr(uri)[:120], expected, "copy the file beside the glTF, and import the folder"
        )
    if not inside:
        node.refuse("uri", "a link that leads out of the folder", repr(uri)[:120], expected, hint)
    return path


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def named_by_backslashes(node: JsonNode, folder: Path) -> bool:
    """Return whether the file of a `uri` is found only with backslashes as separators."""
    uri = node.text("uri")
    return not uri.startswith("data:") and "\\" in unquote(uri) and "\\" not in local_path(node, folder).name


def _json_of(path: Path) -> tuple[bytes, tuple[int, int] | None]:
    """Return the JSON, and offset and length of a GLB's binary chunk."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(12)
        if head[:4] != MAGIC:
            if size > MOST_JSON:
                _fail("too large", path, "JSON", f"{size} bytes", f"at most {MOST_JSON}", "save it as .glb")
            return head + file.read(), None
        if len(head) < 12:
            _fail("the file ends early", path, "header", f"{size} bytes", "at least 12", _AGAIN)
        version, length = struct.unpack("<II", head[4:])
        if version != 2:
            hint = "export it as glTF 2.0; in Blender: File, Export, glTF 2.0"
            _fail("not glTF 2.0", path, "version", version, "2", hint)
        if length > size:
            _fail("the file ends early", path, "length", f"{size} bytes", f"{length} bytes", _AGAIN)
        chunks: list[tuple[bytes, int, int]] = []
        while len(chunks) < 2 and file.tell() + 8 <= length:
            count, kind = struct.unpack("<I4s", file.read(8))
            place = file.tell()
            if place + count > length:
                found, expected = f"{count} bytes from {place}", f"chunks that end by {length}"
                _fail("a chunk reaches beyond the file", path, f"chunk {len(chunks)}", found, expected, _AGAIN)
            chunks.append((kind, place, count))
            file.seek(place + count)
        if not chunks or chunks[0][0] != b"JSON":
            found = repr(chunks[0][0]) if chunks else "no chunk"
            _fail("the first chunk is not JSON", path, "chunk 0", found, "b'JSON'", _AGAIN)
        _, place, count = chunks[0]
        if count > MOST_JSON:
            _fail("too large", path, "chunk 0", f"{count} bytes", f"at most {MOST_JSON}", "export fewer objects")
        file.seek(place)
        raw = file.read(count)
    binary = chunks[1][1:] if len(chunks) > 1 and chunks[1][0] == b"BIN\0" else None
    return raw, binary


def _check_bounds(gltf: GltfFile) -> None:
    """Check that every buffer is complete, every view within its buffer and every accessor within its view."""
    buffers, views = gltf.root.children("buffers"), gltf.root.children("bufferViews")
    sizes = [_buffer_size(gltf, number, buffer) for number, buffer in enumerate(buffers)]
    for view in views:
        size = sizes[view.whole("buffer", below=len(buffers))]
        end = view.whole("byteOffset", 0) + view.whole("byteLength")
        if end > size:
            view.refuse("byteLength", "a view reaches beyond its buffer", f"to byte {end}", f"at most {size}", _AGAIN)
    for accessor in gltf.root.children("accessors"):
        if not accessor.has("bufferView") or accessor.child("extensions").values:
            continue
        view = views[accessor.whole("bufferView", below=len(views))]
        if view.child("extensions").values:
            continue  # compressed: what it holds is not its length
        end = accessor.whole("byteOffset", 0) + _span(accessor, view.whole("byteStride", 0))
        if end > view.whole("byteLength"):
            length = view.whole("byteLength")
            accessor.refuse("count", "values beyond their view", f"to byte {end}", f"at most {length}", _AGAIN)


def _span(accessor: JsonNode, stride: int) -> int:
    """Compute the bytes from the first value of an accessor to the end of its last."""
    kind, component, count = accessor.text("type"), accessor.whole("componentType"), accessor.whole("count")
    if kind not in _COMPONENTS or component not in _COMPONENT_BYTES:
        expected = f"{', '.join(_COMPONENTS)} of {', '.join(map(str, _COMPONENT_BYTES))}"
        accessor.refuse("type", "unknown type of values", f"{kind} of {component}", expected)
    rows, columns = _COMPONENTS[kind]
    width = rows * _COMPONENT_BYTES[component]
    last = width * columns if columns == 1 else (columns - 1) * (-(-width // 4) * 4) + width
    whole = last if columns == 1 else columns * (-(-width // 4) * 4)
    return 0 if count == 0 else (count - 1) * (stride or whole) + last


def _buffer_size(gltf: GltfFile, number: int, buffer: JsonNode) -> int:
    declared = buffer.whole("byteLength")
    if not buffer.has("uri"):
        if gltf.binary is None or number:
            # An extension may allow it: it is refused where a picture is read from it.
            return declared
        there = gltf.binary[1]
    elif buffer.text("uri").startswith("data:"):
        there = len(_inlined(buffer))
    else:
        there = local_path(buffer, gltf.path.parent).stat().st_size
    if there < declared:
        buffer.refuse("byteLength", "a buffer is cut short", f"{there} bytes", f"{declared} bytes", _AGAIN)
    return declared


def _inlined(node: JsonNode) -> bytes:
    """Return the content of a data: URI in base64."""
    head, comma, body = node.text("uri").partition(",")
    if not comma or not head.endswith(";base64"):
        node.refuse("uri", "unknown encoding", repr(head[:60]), "data:TYPE;base64,...")
    try:
        return base64.b64decode(unquote(body) if "%" in body else body, validate=True)
    except (binascii.Error, ValueError) as reason:
        node.refuse("uri", "not valid base64", str(reason), "base64", _AGAIN)


def _slice(
    path: Path, offset: int, length: int | None, node: JsonNode, name: str, most: int | None = MOST_PICTURE
) -> bytes:
    try:
        length = path.stat().st_size if length is None else length
        if most is not None and length > most:
            hint = "save the picture smaller, or compressed"
            node.refuse(name, "too large a picture", f"{length} bytes", f"at most {most}", hint)
        with path.open("rb") as file:
            file.seek(offset)
            return file.read(length)
    except OSError as reason:
        node.refuse(name, "cannot be read", reason.strerror or str(reason), "a readable file")


def _fail(problem: str, path: Path, field: str, found: object, expected: str, hint: str) -> NoReturn:
    raise InputError(problem, file=path, field=field, found=found, expected=expected, hint=hint)
