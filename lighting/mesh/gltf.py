"""glTF 2.0 scenes (Khronos 2021, section 3.5): nodes, transforms, poses and instances, as world-space triangles."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...materials.formats.gltf_container import GltfFile, open_gltf
from ...materials.formats.gltf_json import JsonNode
from .cost import MeshCost
from .gltf_accessors import Accessors, refuse_extension
from .gltf_primitives import PrimitiveGeometry, primitive_geometry
from .mesh import MeshPiece

_INSTANCES, _VISIBILITY = "EXT_mesh_gpu_instancing", "KHR_node_visibility"
# Extensions that a file may require, which do not affect triangles or are supported.
_READ = frozenset(
    (
        *("KHR_mesh_quantization", _INSTANCES, _VISIBILITY, "KHR_texture_transform", "KHR_texture_basisu"),
        *("EXT_texture_webp", "EXT_texture_avif", "MSFT_texture_dds", "KHR_lights_punctual", "EXT_lights_image_based"),
        *("EXT_lights_ies", "KHR_xmp", "KHR_xmp_json_ld", "KHR_animation_pointer", "KHR_techniques_webgl", "MSFT_lod"),
        *("AGI_articulations", "AGI_stk_metadata", "EXT_mesh_features", "EXT_structural_metadata", "FB_ngon_encoding"),
    )
)
_MATERIALS = "KHR_materials_"
_IDENTITY = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def gltf_pieces(path: Path) -> tuple[list[MeshPiece], list[str]]:
    """Read the triangles of a glTF or GLB file, one piece per primitive of a node, and notes on omissions.

    Raises InputError for damaged files, and for required extensions that are not supported, by name.
    """
    scene = _Scene(open_gltf(path))
    pieces = sorted(scene.pieces(), key=lambda piece: piece.name)
    return pieces, list(dict.fromkeys(scene.notes))


class _Scene:
    """Nodes of a file's scene with their world transforms."""

    def __init__(self, gltf: GltfFile) -> None:
        self.gltf = gltf
        self.notes: list[str] = []
        self._check_extensions()
        self.accessors = Accessors(gltf)
        root = gltf.root
        self.nodes = root.children("nodes")
        self.meshes, self.materials, self.skins = (root.children(kind) for kind in ("meshes", "materials", "skins"))
        self.names = _unique_names(self.nodes)
        self.worlds: dict[int, np.ndarray] = {}
        self.hidden: set[int] = set()
        self._place()
        if root.children("animations"):
            self.notes.append(f"{gltf.path.stem}: animations are not played: it is drawn as it stands")

    def _check_extensions(self) -> None:
        for name in _texts(self.gltf.root, "extensionsRequired"):
            if not _is_read(name):
                refuse_extension(self.gltf.root, "extensionsRequired", name)
        others = [name for name in _texts(self.gltf.root, "extensionsUsed") if not _is_read(name)]
        if others:
            self.notes.append(f"{self.gltf.path.stem}: extensions that are not read: {', '.join(others)}")

    def _place(self) -> None:
        """Compute the world transform of every node below the scene's roots."""
        waiting = [(node, np.eye(4), False) for node in self._roots()]
        while waiting:
            number, parent, hidden = waiting.pop()
            node = self.nodes[number]
            if number in self.worlds:
                node.refuse("children", "a node below two others, or below itself", self.names[number], "a tree")
            self.worlds[number] = parent @ _local(node)
            hidden = hidden or node.child("extensions").child(_VISIBILITY).values.get("visible", True) is False
            if hidden:
                self.hidden.add(number)
            children = _numbers(node, "children", len(self.nodes))
            waiting += [(child, self.worlds[number], hidden) for child in children]

    def _roots(self) -> list[int]:
        scenes = self.gltf.root.children("scenes")
        if not scenes:
            below = {child for node in self.nodes for child in _numbers(node, "children", len(self.nodes))}
            return [number for number in range(len(self.nodes)) if number not in below]
        chosen = self.gltf.root.whole("scene", 0, below=len(scenes))
        if len(scenes) > 1:
            name = scenes[chosen].text("name") or f"number {chosen}"
            self.notes.append(f"{self.gltf.path.stem}: of {len(scenes)} scenes only {name} is drawn")
        return _numbers(scenes[chosen], "nodes", len(self.nodes))

    def pieces(self) -> Iterator[MeshPiece]:
        """Yield every triangle primitive of every node, with its world transform."""
        for number in self.worlds:
            node, name = self.nodes[number], self.names[number]
            if not node.has("mesh"):
                continue
            if number in self.hidden:
                self.notes.append(f"{name}: left out, the file hides it")
                continue
            mesh = self.meshes[node.whole("mesh", below=len(self.meshes))]
            primitives = mesh.children("primitives")
            for count, primitive in enumerate(primitives, 1):
                called = f"{name}/{count}" if len(primitives) > 1 else name
                geometry = primitive_geometry(primitive, _weights(node, mesh), self.accessors, called, self.notes)
                if geometry is not None:
                    yield self._piece(called, number, primitive, geometry)

    def _piece(self, name: str, number: int, primitive: JsonNode, geometry: PrimitiveGeometry) -> MeshPiece:
        node, world = self.nodes[number], self.worlds[number]
        if node.has("skin"):
            geometry = geometry.posed(self._joints(node), name, primitive)
            # A skinned mesh is placed by its joints; its node's transform is ignored.
            world = np.eye(4)
            self.notes.append(f"{name}: bent as the joints of its skeleton stand in the file")
        instances = node.child("extensions").child(_INSTANCES)
        if instances.values:
            places = self._instances(instances.child("attributes"))
            MeshCost(len(places) * len(geometry.faces)).check_room(self.gltf.path)
            geometry = geometry.repeated(places)
        return MeshPiece(
            name, geometry.vertices, geometry.faces, geometry.normals, geometry.uv, self._material(primitive), world
        )

    def _material(self, primitive: JsonNode) -> str:
        if not primitive.has("material"):
            return ""
        material = self.materials[primitive.whole("material", below=len(self.materials))]
        name = material.text("name")
        for texture in _textures(material):
            if texture.child("extensions").has("KHR_texture_transform"):
                said = "the file moves or repeats textures (KHR_texture_transform); uv are those of the mesh"
            elif texture.whole("texCoord", 0):
                said = f"the file lays a texture by TEXCOORD_{texture.whole('texCoord')}; uv are those of TEXCOORD_0"
            else:
                continue
            self.notes.append(f"material {name or material.place}: {said}")
        return name

    def _joints(self, node: JsonNode) -> Float[np.ndarray, "J 4 4"]:
        """Return the matrices from mesh to world of the joints of a node's skin."""
        skin = self.skins[node.whole("skin", below=len(self.skins))]
        joints = _numbers(skin, "joints", len(self.nodes))
        missing = [joint for joint in joints if joint not in self.worlds]
        if missing or not joints:
            found = f"node {missing[0]}" if missing else "no joints"
            skin.refuse("joints", "a joint outside the scene", found, "nodes of the scene")
        carried = np.stack([self.worlds[joint] for joint in joints])
        if not skin.has("inverseBindMatrices"):
            return carried
        bound = self.accessors.vectors(skin, "inverseBindMatrices", (16,))
        if len(bound) < len(joints):
            found = f"{len(bound)} matrices"
            skin.refuse("inverseBindMatrices", "too few matrices", found, f"{len(joints)}, one a joint")
        # Matrices are stored in column-major order.
        return carried @ bound[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)

    def _instances(self, attributes: JsonNode) -> Float[np.ndarray, "I 4 4"]:
        """Return the transforms of a node's instances relative to the node."""
        defaults = {"TRANSLATION": (0.0, 0.0, 0.0), "ROTATION": (0.0, 0.0, 0.0, 1.0), "SCALE": (1.0, 1.0, 1.0)}
        there = {
            name: self.accessors.vectors(attributes, name, (len(default),))
            for name, default in defaults.items()
            if attributes.has(name)
        }
        counts = {len(values) for values in there.values()}
        if len(counts) != 1:
            found = ", ".join(f"{name} of {len(values)}" for name, values in there.items()) or "none of them"
            attributes.refuse("TRANSLATION", "instances of unlike counts", found, "as many of each")
        count = counts.pop()
        told = [there.get(name, np.tile(default, (count, 1))) for name, default in defaults.items()]
        return np.array([_of_parts(*parts) for parts in zip(*told, strict=True)]).reshape(-1, 4, 4)


def _is_read(name: str) -> bool:
    return name in _READ or name.startswith(_MATERIALS)


def _weights(node: JsonNode, mesh: JsonNode) -> list[float]:
    """Return the weights of morph targets: the node's, else the mesh's."""
    owner = node if node.values.get("weights") else mesh
    given = owner.values.get("weights", [])
    count = len(given) if isinstance(given, list) else 1
    return owner.numbers("weights", (0.0,) * count, low=-np.inf)


def _local(node: JsonNode) -> Float[np.ndarray, "4 4"]:
    """Return the transform from a node to its parent."""
    parts = _of_parts(
        node.numbers("translation", (0.0, 0.0, 0.0), low=-np.inf),
        node.numbers("rotation", (0.0, 0.0, 0.0, 1.0), low=-np.inf),
        node.numbers("scale", (1.0, 1.0, 1.0), low=-np.inf),
    )
    if node.has("matrix"):
        matrix = np.array(node.numbers("matrix", _IDENTITY, low=-np.inf)).reshape(4, 4).T
        if (matrix[3] != _IDENTITY[-4:]).any():
            node.refuse(
                "matrix", "a transform that makes distant things smaller", matrix[3].tolist(), "0, 0, 0, 1 last"
            )
        told = [name for name in ("translation", "rotation", "scale") if node.has(name)]
        if told and not np.allclose(matrix, parts, rtol=1e-4, atol=1e-4 * np.abs(matrix).max()):
            node.refuse("matrix", "two places of one node", f"matrix and {', '.join(told)}", "one of the two")
        return matrix
    return parts


def _of_parts(translation, rotation, scale) -> Float[np.ndarray, "4 4"]:
    """Compose translation x rotation x scale; the quaternion (x, y, z, w) is normalised, and 0 is the identity."""
    x, y, z, w = np.asarray(rotation, dtype=np.float64)
    s = x * x + y * y + z * z + w * w
    s = 2.0 / s if s > 0.0 else 0.0
    turn = np.array(
        [
            [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
            [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
            [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.asarray(scale)
    matrix[:3, 3] = translation
    return matrix


def _unique_names(nodes: list[JsonNode]) -> list[str]:
    """Return a unique name for each node: its own, numbered if others share it."""
    taken: set[str] = set()
    names = []
    for number, node in enumerate(nodes):
        own = node.text("name") or str(number)
        name, more = own, 0
        while name in taken:
            more += 1
            name = f"{own}_{more}"
        taken.add(name)
        names.append(name)
    return names


def _numbers(owner: JsonNode, name: str, below: int) -> list[int]:
    """Return a checked list of indices."""
    values = owner.values.get(name, [])
    if not isinstance(values, list) or not all(type(value) is int and 0 <= value < below for value in values):
        owner.refuse(name, "not a list of indices", repr(values)[:80], f"whole numbers below {below}")
    return values


def _texts(owner: JsonNode, name: str) -> list[str]:
    values = owner.values.get(name, [])
    if not isinstance(values, list) or not all(isinstance(value, str) for value in values):
        owner.refuse(name, "not a list of names", repr(values)[:80], "names in quotes")
    return values


def _textures(material: JsonNode) -> Iterator[JsonNode]:
    """Yield all texture references of a material."""
    for name, value in material.values.items():
        if isinstance(value, dict):
            child = material.child(name)
            if name.endswith("Texture"):
                yield child
            yield from _textures(child)
