"""Texture coordinates of glTF files: what trimesh would leave out, or read wrongly, put right before it reads them."""

from __future__ import annotations

import io
import json
import struct
from pathlib import Path
from typing import Any

# componentType of a float32 accessor.
_FLOAT = 5126


def readable_gltf(path: Path) -> tuple[io.BytesIO | None, tuple[str, ...]]:
    """A glTF or GLB file as trimesh should be given it, None where that is as it stands; and notes for people.

    trimesh reads texture coordinates of primitives with a material alone: the others get one that says nothing. It
    takes whole numbers that stand for fractions for what they are: those are left out, with a note. A file that is
    damaged stays as it is; trimesh says so.
    """
    data = path.read_bytes()
    binary = data[:4] == b"glTF"
    length = int.from_bytes(data[12:16], "little") if binary else 0
    try:
        document = json.loads(data[20 : 20 + length] if binary else data)
        changed, notes = _mended(document)
    except (ValueError, LookupError, TypeError, AttributeError):
        return None, ()
    if not changed:
        return None, ()
    text = json.dumps(document).encode()
    if binary:
        text += b" " * (-len(text) % 4)
        rest = data[20 + length :]
        head = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON")
        text = head + text + rest
    return io.BytesIO(text), notes


def _mended(document: dict[str, Any]) -> tuple[bool, tuple[str, ...]]:
    """Whether a glTF document was changed, and what there is to say of it."""
    changed, left_out = False, 0
    for mesh in document.get("meshes", ()):
        for primitive in mesh["primitives"]:
            attributes = primitive["attributes"]
            if "TEXCOORD_0" not in attributes:
                continue
            if document["accessors"][attributes["TEXCOORD_0"]]["componentType"] != _FLOAT:
                del attributes["TEXCOORD_0"]
                changed, left_out = True, left_out + 1
            elif "material" not in primitive:
                materials = document.setdefault("materials", [])
                primitive["material"] = len(materials)
                materials.append({})
                changed = True
    said = f"texture coordinates of {left_out} primitives are whole numbers, which are not read, and are left out"
    return changed, (said,) if left_out else ()
