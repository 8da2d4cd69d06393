"""The textures that a glTF material uses: found by name, in the core and in any extension, as pictures."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from ...runtime.errors import InputError
from ..svbrdf.map_set import Placement
from ..svbrdf.texels import Wrap
from ..svbrdf.textures import Texture
from .gltf_container import GltfFile, named_by_backslashes
from .gltf_json import JsonNode
from .pictures.drawn import NotDrawn

# Textures of colours are in sRGB; all others hold numbers.
_SRGB = ("baseColorTexture", "emissiveTexture", "diffuseTexture", "specularGlossinessTexture")
_OTHER_PICTURES = ("EXT_texture_webp", "EXT_texture_avif", "KHR_texture_basisu", "MSFT_texture_dds")
#: OpenGL's numbers, which samplers have.
WRAPS: dict[int, Wrap] = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
_KTX2 = b"\xabKTX 20\xbb"
#: Extensions of a material: what to call those that are kept and not rendered; "" for those that are rendered.
KEPT_EXTENSIONS = {
    "KHR_materials_specular": "",
    "KHR_materials_ior": "",
    "KHR_materials_clearcoat": "",
    "KHR_materials_unlit": "",
    "KHR_materials_emissive_strength": "",
    "KHR_materials_pbrSpecularGlossiness": "",
    "KHR_materials_sheen": "sheen",
    "KHR_materials_anisotropy": "stretched highlights (anisotropy)",
    "KHR_materials_transmission": "transmission",
    "KHR_materials_volume": "absorption in the volume",
    "KHR_materials_iridescence": "iridescence",
    "KHR_materials_dispersion": "dispersion",
    "KHR_materials_diffuse_transmission": "diffuse transmission",
}


class TextureReader:
    """Textures of one material; each picture is read once."""

    def __init__(self, gltf: GltfFile, material: JsonNode) -> None:
        self.gltf, self.material = gltf, material
        self._read: dict[str, Texture] = {}

    def of(self, holder: JsonNode, name: str) -> Texture | None:
        """Return the texture under that name in `holder`, None if there is none.

        Raises
        ------
        InputError
            A dangling reference; a picture that is missing, damaged, too large or of a type that is not decoded.
        """
        if not holder.has(name):
            return None
        place = holder._at(name)
        if place not in self._read:
            _, image = self._image(holder, name)
            picture = self.gltf.picture(image)
            encoding = "sRGB" if name in _SRGB or "Color" in name else "linear"
            self._read[place] = Texture(
                self._slot(place), picture.data, encoding, self.gltf.path, f"{place} ({picture.field})"
            )
        texture = self._read[place]
        if texture.data.startswith(_KTX2):
            hint = "export the textures as PNG or JPEG"
            holder.refuse(name, "not decoded", "a KTX2 texture", "PNG, JPEG, WebP or AVIF", hint)
        _ = texture.mime
        return texture

    def placement(self, holder: JsonNode, name: str, turned: bool = False) -> Placement:
        """Return the placement of a texture on the mesh, (u, v) growing upwards; `turned`: its values are directions.

        Raises
        ------
        NotDrawn : another set of coordinates than the first, or rotated (KHR_texture_transform's formula turns against
            its words), or mirrored if its values are directions.
        InputError : a number or a word that the specification does not have.
        """
        information = holder.child(name)
        transform = information.child("extensions").child("KHR_texture_transform")
        coordinates = transform if transform.has("texCoord") else information
        if coordinates.whole("texCoord", 0):
            raise NotDrawn("coordinates of another set than the first")
        if transform.number("rotation", 0.0, low=-math.inf):
            raise NotDrawn("a texture that is rotated on the mesh, where the specification contradicts itself")
        across, down = transform.numbers("scale", (1.0, 1.0), low=-math.inf)
        left, top = transform.numbers("offset", (0.0, 0.0), low=-math.inf)
        if turned and min(across, down) <= 0.0:
            raise NotDrawn("directions in a texture that is mirrored on the mesh")
        texture, _ = self._image(holder, name)
        samplers = self.gltf.root.children("samplers")
        if not texture.has("sampler"):
            return Placement((across, down), (left, 1.0 - top - down))
        sampler = samplers[texture.whole("sampler", below=len(samplers))]
        wrap = []
        for key in ("wrapS", "wrapT"):
            code = sampler.whole(key, 10497)
            if code not in WRAPS:
                expected = ", ".join(f"{known} ({word})" for known, word in WRAPS.items())
                sampler.refuse(key, "unknown way to go on beyond a texture", code, expected)
            wrap.append(WRAPS[code])
        return Placement((across, down), (left, 1.0 - top - down), (wrap[0], wrap[1]))

    def all(self) -> tuple[list[Texture], list[str]]:
        """Return every texture whose bytes exist, rendered or not, and notes on them."""
        notes: list[str] = []
        for holder, name in self._holders(self.material):
            try:
                texture = self.of(holder, name)
                notes += texture.notes if texture else ()
                if named_by_backslashes(self._image(holder, name)[1], self.gltf.path.parent):
                    notes.append("backslashes in the names of pictures are read as separators of folders")
            except InputError as reason:
                notes.append(f"{self._slot(holder._at(name))}: {reason.problem} ({reason.found})")
        return list(self._read.values()), notes

    def used(self) -> dict[str, Any]:
        """Return the file's own entries of each texture: slot to texture, sampler and image, without their content."""
        described: dict[str, Any] = {}
        samplers = self.gltf.root.children("samplers")
        for holder, name in self._holders(self.material):
            try:
                texture, image = self._image(holder, name)
                words = {"texture": texture.values, "image": _without_content(image)}
                if texture.has("sampler"):
                    words["sampler"] = samplers[texture.whole("sampler", below=len(samplers))].values
            except InputError:
                continue
            described[self._slot(holder._at(name))] = words
        return described

    def _slot(self, place: str) -> str:
        """materials[2].pbrMetallicRoughness.baseColorTexture -> pbrMetallicRoughness.baseColorTexture"""
        return place.removeprefix(self.material.place).removeprefix(".extensions").lstrip(".")

    def _holders(self, node: JsonNode) -> Iterator[tuple[JsonNode, str]]:
        """Yield every (object, key) of the material that names a texture."""
        for name, value in node.values.items():
            if name == "extras" or not isinstance(value, dict):
                continue
            if name.endswith("Texture") and "index" in value:
                yield node, name
            else:
                yield from self._holders(node.child(name))

    def _image(self, holder: JsonNode, name: str) -> tuple[JsonNode, JsonNode]:
        textures, images = self.gltf.root.children("textures"), self.gltf.root.children("images")
        texture = textures[holder.child(name).whole("index", below=len(textures))]
        source = texture
        if not texture.has("source"):
            others = [texture.child("extensions").child(each) for each in _OTHER_PICTURES]
            source = next((other for other in others if other.has("source")), texture)
        return texture, images[source.whole("source", below=len(images))]


def _without_content(image: JsonNode) -> dict[str, Any]:
    uri = image.values.get("uri")
    inside = isinstance(uri, str) and uri.startswith("data:")
    return {name: value for name, value in image.values.items() if not (inside and name == "uri")}
