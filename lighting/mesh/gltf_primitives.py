"""Primitives of glTF meshes (Khronos 2021, section 3.7): triangles of lists, strips and fans, morphed and skinned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ...materials.formats.gltf_json import JsonNode
from .gltf_accessors import Accessors, refuse_extension

_DRACO = "KHR_draco_mesh_compression"
_TRIANGLES, _STRIP, _FAN = 4, 5, 6


@dataclass(frozen=True, eq=False)
class PrimitiveGeometry:
    """Triangles of a primitive without unused vertices; `skin` is joints (V, S) and weights (V, S), if any."""

    vertices: Float[np.ndarray, "V 3"]
    faces: Int[np.ndarray, "F 3"]
    normals: np.ndarray | None
    uv: np.ndarray | None
    skin: tuple[np.ndarray, np.ndarray] | None

    def posed(self, joints: Float[np.ndarray, "J 4 4"], name: str, primitive: JsonNode) -> PrimitiveGeometry:
        """Pose the triangles by linear blend skinning; the winding is reversed where joints mirror."""
        if self.skin is None:
            primitive.refuse("attributes", "a skin without joints", name, "JOINTS_0 and WEIGHTS_0")
        which, weights = self.skin
        if which.max(initial=0) >= len(joints):
            found = f"joint {which.max()}"
            primitive.refuse("attributes", "a joint that is not there", found, f"0 to {len(joints) - 1}")
        # Weights must sum to one; normalisation undoes rounding to 8 bits.
        total = weights.sum(axis=1, keepdims=True)
        if not (total > 0.0).all():
            found = f"{int((total <= 0.0).sum())} vertices without weights"
            primitive.refuse("attributes", "a skin that some vertices are not on", found, "weights that add up to 1")
        carried = np.zeros((len(self.vertices), 4, 4))
        for column in range(which.shape[1]):
            carried += (weights[:, column] / total[:, 0])[:, None, None] * joints[which[:, column]]
        turns = carried[:, :3, :3]
        vertices = np.einsum("vij,vj->vi", turns, self.vertices) + carried[:, :3, 3]
        sides = np.where(np.linalg.det(turns) < 0.0, -1.0, 1.0)
        mirrored = sides[self.faces].sum(axis=1) < 0.0
        faces = np.where(mirrored[:, None], self.faces[:, ::-1], self.faces)
        if self.normals is None:
            return PrimitiveGeometry(vertices, faces, None, self.uv, None)
        normals = np.einsum("vij,vj->vi", sides[:, None, None] * _cofactors(turns), self.normals)
        return PrimitiveGeometry(vertices, faces, normals, self.uv, None)

    def repeated(self, places: Float[np.ndarray, "I 4 4"]) -> PrimitiveGeometry:
        """Instantiate the triangles with several transforms; the winding is reversed for mirroring ones."""
        count, turns = len(places), places[:, :3, :3]
        vertices = np.einsum("nij,vj->nvi", turns, self.vertices) + places[:, None, :3, 3]
        mirrored = np.linalg.det(turns) < 0.0
        faces = np.where(mirrored[:, None, None], self.faces[:, ::-1], self.faces)
        faces = faces + (np.arange(count) * len(self.vertices))[:, None, None]
        normals = None
        if self.normals is not None:
            # The cofactors of a mirroring transform flip normals.
            sides = np.where(mirrored, -1.0, 1.0)[:, None, None]
            normals = np.einsum("nij,vj->nvi", sides * _cofactors(turns), self.normals).reshape(-1, 3)
        uv = None if self.uv is None else np.tile(self.uv, (count, 1))
        return PrimitiveGeometry(vertices.reshape(-1, 3), faces.reshape(-1, 3), normals, uv, None)


def primitive_geometry(
    primitive: JsonNode, weights: list[float], accessors: Accessors, name: str, notes: list[str]
) -> PrimitiveGeometry | None:
    """Read the triangles of a primitive with weighted morph targets; None if it has no triangles.

    Other kinds of primitives are listed in `notes`, with the `name` of the node.
    """
    mode = primitive.whole("mode", _TRIANGLES)
    if mode > _FAN:
        primitive.refuse("mode", "an unknown kind of primitive", mode, "0 to 6")
    attributes = primitive.child("attributes")
    if mode < _TRIANGLES:
        notes.append(f"{name}: left out, it holds lines or points and no triangles")
        return None
    packed = primitive.child("extensions").has(_DRACO)
    if packed and (_empty(attributes, accessors) or _empty(primitive, accessors, ("indices",))):
        refuse_extension(primitive, "extensions", _DRACO)
    if not attributes.has("POSITION"):
        notes.append(f"{name}: left out, it has no positions")
        return None
    weights = weights if any(weights) else []
    if weights and len(weights) != len(primitive.children("targets")):
        expected = f"{len(primitive.children('targets'))}, one a target"
        primitive.refuse("targets", "weights of another count than morph targets", len(weights), expected)
    arrays = {
        kind: _morphed(primitive, kind, widths, weights, accessors)
        for kind, widths in (("POSITION", (3,)), ("NORMAL", (3,)), ("TEXCOORD_0", (2,)))
        if attributes.has(kind)
    }
    if weights:
        told = ", ".join(f"{weight:g}" for weight in weights)
        notes.append(f"{name}: morphed by the weights of the file, {told}")
    if "TEXCOORD_0" not in arrays and any(kind.startswith("TEXCOORD_") for kind in attributes.values):
        notes.append(f"{name}: texture coordinates other than TEXCOORD_0 are left out")
    vertices = arrays["POSITION"]
    faces = _faces(primitive, mode, len(vertices), accessors)
    skin = _skin(attributes, accessors)
    for kind, values in (*arrays.items(), *((("JOINTS_0", skin[0]),) if skin else ())):
        if len(values) != len(vertices):
            attributes.refuse(kind, "not one a vertex", len(values), f"{len(vertices)}, one a vertex")
    used, faces = np.unique(faces, return_inverse=True)
    normals, uv = arrays.get("NORMAL"), arrays.get("TEXCOORD_0")
    return PrimitiveGeometry(
        vertices[used],
        faces.reshape(-1, 3),
        None if normals is None else normals[used],
        # v grows downwards in glTF.
        None if uv is None else uv[used] * [1.0, -1.0] + [0.0, 1.0],
        None if skin is None else (skin[0][used], skin[1][used]),
    )


def _empty(owner: JsonNode, accessors: Accessors, names: tuple[str, ...] | None = None) -> bool:
    return any(owner.has(name) and accessors.empty(owner, name) for name in names or tuple(owner.values))


def _morphed(primitive: JsonNode, kind: str, widths: tuple[int, ...], weights: list[float], accessors: Accessors):
    """Return an attribute with its morph targets added."""
    values = accessors.vectors(primitive.child("attributes"), kind, widths)
    for weight, target in zip(weights, primitive.children("targets"), strict=False):
        if weight and target.has(kind):
            moved = accessors.vectors(target, kind, widths)
            if moved.shape != values.shape:
                target.refuse(kind, "not one a vertex", len(moved), f"{len(values)}, one a vertex")
            values = values + weight * moved
    return values


def _faces(primitive: JsonNode, mode: int, count: int, accessors: Accessors) -> Int[np.ndarray, "F 3"]:
    """Return triangles as vertex indices, in the order and winding of the specification (section 3.7.2.1)."""
    order = accessors.indices(primitive, "indices") if primitive.has("indices") else np.arange(count)
    if len(order) and order.max() >= count:
        primitive.refuse("indices", "a triangle uses a vertex that is not there", order.max(), f"0 to {count - 1}")
    if mode == _TRIANGLES:
        if len(order) % 3:
            primitive.refuse("indices", "not whole triangles", f"{len(order)} corners", "a multiple of 3")
        return order.reshape(-1, 3)
    first = np.arange(max(len(order) - 2, 0))
    if mode == _FAN:
        return np.stack([order[first + 1], order[first + 2], order[np.zeros_like(first)]], axis=1)
    odd = first % 2
    faces = np.stack([order[first], order[first + 1 + odd], order[first + 2 - odd]], axis=1)
    # Degenerate triangles that join strips are dropped.
    return faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]


def _skin(attributes: JsonNode, accessors: Accessors) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the joints and weights of all sets, concatenated."""
    sets = [k for k in range(len(attributes.values)) if attributes.has(f"JOINTS_{k}")]
    if not sets:
        return None
    joints = [accessors.vectors(attributes, f"JOINTS_{k}", (4,)) for k in sets]
    weights = [accessors.vectors(attributes, f"WEIGHTS_{k}", (4,)) for k in sets]
    if len({len(values) for values in (*joints, *weights)}) > 1:
        attributes.refuse("WEIGHTS_0", "joints and weights of unlike counts", len(weights[0]), "one a vertex of each")
    return np.concatenate(joints, axis=1).astype(np.int64), np.concatenate(weights, axis=1)


def _cofactors(matrices: Float[np.ndarray, "n 3 3"]) -> Float[np.ndarray, "n 3 3"]:
    """Return cofactor matrices, which transform normals up to length: the inverse transpose times the determinant."""
    a, b, c = matrices[:, :, 0], matrices[:, :, 1], matrices[:, :, 2]
    return np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=2)
