"""Materials of glTF 2.0 files (.gltf, .glb; Khronos 2021, section 3.9): colours in RGB, with made-up spectra.

Metallic and roughness, specular, refractive index, clearcoat, specular and glossiness, and unlit are rendered; of maps
also bumps, anisotropic highlights and masks, texel by texel. Further properties (transmission, sheen, ...) are stored
in the record, with all maps, and named in the notes. Maps with different placements on the mesh, and a second set of
coordinates are rendered by the mean of the maps. An emissive material has a second record, its emission.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...runtime.errors import InputError
from ...spectral.formats.import_options import NO_ANSWER, ImportOptions
from ...spectral.illuminants import illuminant
from ...spectral.observers import EFFICACY, observer
from ...spectral.upsampling import upsampling
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..records.material import Provenance
from ..records.source import MaterialSource, Rejected
from ..svbrdf.map_set import Placement
from ..svbrdf.textures import Texture, blocks
from . import gltf_container
from .gltf_container import GltfFile, open_gltf
from .gltf_json import JsonNode, compact
from .gltf_textures import KEPT_EXTENSIONS, TextureReader
from .measured_source import placed, sha256_of
from .naming import id_word, printable
from .pictures.drawn import MoreMaps, NotDrawn, drawn_maps
from .pictures.map_record import kept_maps
from .pictures.stand_in import DIELECTRIC_F0, Colour, Number, SurfaceMaps, model_of

NAME = "glTF materials"
#: It asks how maps are drawn.
ASKS_MORE = True
SUFFIXES = (".gltf", ".glb")
# Text beyond this does not fit into an attribute of HDF5.
_LONGEST_TEXT = 32000
_UNLIT = "unlit in the file: taken to be perfectly diffuse"
_EMISSION_UNITS = "W.m^-2.sr^-1.nm^-1"


def recognises(path: Path, head: bytes) -> bool:
    """Return True for a .glb by its first bytes, for a .gltf by its name or its first key."""
    if head.startswith(gltf_container.MAGIC) or path.suffix.lower() in SUFFIXES:
        return True
    return head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{") and b'"asset"' in head and b'"version"' in head


def companions(path: Path) -> Iterable[Path]:
    """Buffers and pictures beside the file, which are no sources of their own."""
    return tuple(gltf_container.companions(path))


def read_sources(path: Path, uplift: str, answer: ImportOptions = NO_ANSWER) -> Iterator[MaterialSource | Rejected]:
    """Yield one record per material, "FILE/MATERIAL", and "FILE/MATERIAL-emission" if it is emissive.

    Raises `InputError` if the file as a whole cannot be used; an unusable material is a `Rejected`.
    """
    gltf = open_gltf(path)
    materials = gltf.root.children("materials")
    if not materials:
        raise InputError(
            "no materials",
            file=path,
            field="materials",
            found="a glTF of shapes alone",
            expected="one material or more",
            hint="a scene file can name it as a mesh; export it again with its materials",
        )
    content = sha256_of(path)
    primitives = (part for mesh in gltf.root.children("meshes") for part in mesh.children("primitives"))
    primitives = (part for part in primitives if part.has("material") and part.child("attributes").has("COLOR_0"))
    coloured = {part.whole("material") for part in primitives}
    taken: set[str] = set()
    for number, material in enumerate(materials):
        try:
            label = printable(material.text("name")) or f"material {number + 1}"
            name = _unique(id_word(label), taken)
            with placed(path, material.place):
                material_id = f"{id_word(path.stem)}/{name}"
                one = _Material(gltf, material, label, material_id, content, number in coloured)
                yield from one.sources(uplift, answer)
        except InputError as reason:
            yield Rejected(f"{path.name}: {material.place}", reason)


def _unique(name: str, taken: set[str]) -> str:
    """Make a name unique by a number if necessary; the name of its emission is reserved with it."""
    number, candidate = 1, name
    while {candidate, f"{candidate}-emission"} & taken:
        number += 1
        candidate = f"{name}-{number}"
    taken |= {candidate, f"{candidate}-emission"}
    return candidate


class _Material:
    """Material of a file, parsed."""

    def __init__(
        self, gltf: GltfFile, node: JsonNode, label: str, material_id: str, content: str, coloured: bool
    ) -> None:
        self.gltf, self.node, self.label, self.id, self.content = gltf, node, label, material_id, content
        self.coloured = coloured
        self.placed: list[tuple[JsonNode, str]] = []
        self.bumps = self.stretched = self.coat_bumps = False
        self.textures = TextureReader(gltf, node)
        self.extensions = node.child("extensions")

    def sources(self, uplift: str, answer: ImportOptions) -> Iterator[MaterialSource]:
        maps = self._maps()
        model, parameters, notes = self._surface(maps, uplift, answer)
        kept, left_out = self.textures.all()
        notes += [*left_out, *self._unrendered()]
        original = {**self._description(), **kept_maps(kept, uplift)}
        yield self._source(self.id, model, parameters, notes, original, uplift)
        emitted = self._emitted()
        if emitted is not None:
            spectrum, note = emission_of(emitted, uplift)
            if not spectrum["values"].any():
                return  # a black map switches it off
            original = {**self._description(), **spectrum, "surface": self.id}
            yield self._source(f"{self.id}-emission", "emission", {}, [note], original, uplift)

    def _surface(self, maps: SurfaceMaps, uplift: str, answer: ImportOptions) -> tuple[str, dict[str, Any], list[str]]:
        why: list[str] = []
        if answer.maps != "mean":
            try:
                more = self._more(answer)
                surface, said = drawn_maps(_unlit(maps) if more.matt else maps, more, uplift)
                if surface is not None:
                    self.bumps, self.stretched = more.normal is not None, more.strength.scale > 0.0
                    self.coat_bumps = more.coat_normal is not None
                    return "maps", surface.parameters(), [*said, *([_UNLIT] if more.matt else [])]
            except NotDrawn as reason:
                why = [f"not drawn texel by texel: {reason}"]
        model, parameters, notes = self._mean(maps, uplift)
        return model, parameters, why + notes

    def _mean(self, maps: SurfaceMaps, uplift: str) -> tuple[str, dict[str, Any], list[str]]:
        if not self.extensions.has("KHR_materials_unlit"):
            parameters, notes = model_of(maps, uplift)
            return "metallic_roughness", dict(parameters), notes
        parameters, notes = model_of(_unlit(maps), uplift)
        lambert = {"wavelengths_nm": parameters["wavelengths_nm"], "reflectance": parameters["diffuse"]}
        return "lambert", lambert, [*notes, _UNLIT]

    def _maps(self) -> SurfaceMaps:
        coverage, cutoff = self._coverage()
        coat = self.extensions.child("KHR_materials_clearcoat")
        shared: dict[str, Any] = {
            "coverage": coverage,
            "cutoff": cutoff,
            "coat": Number(self._texture(coat, "clearcoatTexture"), 0, coat.number("clearcoatFactor", 0, high=1)),
            "coat_roughness": Number(
                self._texture(coat, "clearcoatRoughnessTexture"),
                1,
                coat.number("clearcoatRoughnessFactor", 0, high=1),
            ),
        }
        if self.extensions.has("KHR_materials_pbrSpecularGlossiness"):
            return self._specular_glossiness(self.extensions.child("KHR_materials_pbrSpecularGlossiness"), shared)
        pbr = self.node.child("pbrMetallicRoughness")
        special = self.extensions.child("KHR_materials_specular")
        tint = special.numbers("specularColorFactor", (1.0, 1.0, 1.0))
        packed = self._texture(pbr, "metallicRoughnessTexture")
        at_normal = self._dielectric()
        return SurfaceMaps(
            base=Colour(self._texture(pbr, "baseColorTexture"), tuple(_factor(pbr, "baseColorFactor")[:3])),
            metallic=Number(packed, 2, pbr.number("metallicFactor", 1, high=1)),
            roughness=Number(packed, 1, pbr.number("roughnessFactor", 1, high=1)),
            reflected=Colour(
                self._texture(special, "specularColorTexture"), tuple(at_normal * value for value in tint)
            ),
            weight=Number(self._texture(special, "specularTexture"), 3, special.number("specularFactor", 1, high=1)),
            **shared,
        )

    def _texture(self, holder: JsonNode, name: str) -> Texture | None:
        """Return a texture of the surface; placements of all textures are read together."""
        if holder.has(name):
            self.placed.append((holder, name))
        return self.textures.of(holder, name)

    def _more(self, answer: ImportOptions) -> MoreMaps:
        """Read the properties that are rendered only by texel. Bumps are OpenGL's, as in the specification."""
        matt, stretch = self.extensions.has("KHR_materials_unlit"), self.extensions.child("KHR_materials_anisotropy")
        coat = self.extensions.child("KHR_materials_clearcoat")
        try:
            normal, direction = self._texture(self.node, "normalTexture"), self._texture(stretch, "anisotropyTexture")
            over = self._texture(coat, "clearcoatNormalTexture") if coat.number("clearcoatFactor", 0, high=1) else None
            _ = [texture.values for texture in (normal, direction, over) if texture]
        except InputError as reason:
            raise NotDrawn(f"a map of directions: {reason.problem} ({reason.found})") from None
        strength = Number(direction, 2, stretch.number("anisotropyStrength", 0, high=1))
        turned = (normal is not None or over is not None or strength.scale > 0.0) and not matt
        places = {self.textures.placement(holder, name, turned) for holder, name in self.placed}
        if len(places) > 1:
            raise NotDrawn("its maps lie apart on the mesh")
        return MoreMaps(
            normal=None if matt else normal,
            green="opengl",
            normal_scale=self.node.child("normalTexture").number("scale", 1, low=-math.inf),
            coat_normal=over,
            coat_normal_scale=coat.child("clearcoatNormalTexture").number("scale", 1, low=-math.inf),
            strength=Number(scale=0.0) if matt else strength,
            direction=direction,
            turn=stretch.number("anisotropyRotation", 0, low=-math.inf),
            placement=places.pop() if places else Placement(),
            matt=matt,
            mends=answer.maps == "mended",
        )

    def _specular_glossiness(self, gloss: JsonNode, shared: dict[str, Any]) -> SurfaceMaps:
        packed = self._texture(gloss, "specularGlossinessTexture")
        return SurfaceMaps(
            base=Colour(self._texture(gloss, "diffuseTexture"), tuple(_factor(gloss, "diffuseFactor")[:3])),
            reflected=Colour(packed, tuple(gloss.numbers("specularFactor", (1.0, 1.0, 1.0), high=1))),
            roughness=Number(packed, 3, gloss.number("glossinessFactor", 1, high=1), inverted=True),
            glossy=True,
            **shared,
        )

    def _dielectric(self) -> float:
        """Fresnel reflectance at the normal, ((n - 1)/(n + 1))^2; an index of 0 means a perfect one."""
        extension = self.extensions.child("KHR_materials_ior")
        if not extension.has("ior"):
            return DIELECTRIC_F0
        index = extension.number("ior", 1.5)
        if 0 < index < 1:
            extension.refuse("ior", "out of its domain", index, "0, or 1 and more", "correct the refractive index")
        return ((index - 1.0) / (index + 1.0)) ** 2 if index else 1.0

    def _coverage(self) -> tuple[Number, float | None]:
        mode = self.node.text("alphaMode", "OPAQUE")
        if mode not in ("OPAQUE", "MASK", "BLEND"):
            self.node.refuse("alphaMode", "unknown word", repr(mode), "OPAQUE, MASK or BLEND")
        if mode == "OPAQUE":
            return Number(), None
        if self.extensions.has("KHR_materials_pbrSpecularGlossiness"):
            gloss = self.extensions.child("KHR_materials_pbrSpecularGlossiness")
            opacity = Number(self._texture(gloss, "diffuseTexture"), 3, _factor(gloss, "diffuseFactor")[3])
        else:
            pbr = self.node.child("pbrMetallicRoughness")
            opacity = Number(self._texture(pbr, "baseColorTexture"), 3, _factor(pbr, "baseColorFactor")[3])
        return opacity, self.node.number("alphaCutoff", 0.5) if mode == "MASK" else None

    def _emitted(self) -> Colour | None:
        factor = self.node.numbers("emissiveFactor", (0.0, 0.0, 0.0))
        strength = self.extensions.child("KHR_materials_emissive_strength").number("emissiveStrength", 1)
        if not any(factor) or strength == 0:
            return None
        return Colour(self.textures.of(self.node, "emissiveTexture"), tuple(strength * value for value in factor))

    def _unrendered(self) -> list[str]:
        """List the properties that none of our models renders."""
        kept = [name for name in self.extensions.values if not (self.stretched and name == "KHR_materials_anisotropy")]
        names = [KEPT_EXTENSIONS.get(name, name) for name in kept]
        names += ["bumps of the normal map"] if self.node.has("normalTexture") and not self.bumps else []
        over = self.extensions.child("KHR_materials_clearcoat").has("clearcoatNormalTexture")
        names += ["bumps of the clear coat"] if over and not self.coat_bumps else []
        names += ["occlusion"] if self.node.has("occlusionTexture") else []
        names = [name for name in names if name]
        notes = [f"kept in the record and not rendered: {', '.join(names)}"] if names else []
        return notes + (["colours of the mesh's vertices are not applied"] if self.coloured else [])

    def _description(self) -> dict[str, Any]:
        """Return the material, its textures and the file's own header, word for word."""
        asset = self.gltf.root.child("asset")
        details = {"gltf.asset": asset.values, "gltf.material": self.node.values, "gltf.textures": self.textures.used()}
        kept: dict[str, Any] = {"file": printable(self.gltf.path.name), "gltf.name": self.label}
        for name, value in details.items():
            text = compact(value)
            kept[name] = text if len(text) < _LONGEST_TEXT else np.frombuffer(text.encode(), np.uint8)
        return kept

    def _source(
        self, material_id: str, model: str, parameters: dict[str, Any], notes: list[str], original: dict, uplift: str
    ) -> MaterialSource:
        asset = self.gltf.root.child("asset")
        path = self.gltf.path
        made_by = f", by {asset.text('generator')}" if asset.text("generator") else ""
        notes = [*notes, f"spectra by {uplift}, of linear sRGB", f"{printable(path.name)}: SHA-256 {self.content}"]
        provenance = Provenance(
            source=printable(f"{path.name}, material {self.label} of a glTF file{made_by}"),
            licence=_licence(asset) or "not stated in the file",
            kind=upsampling(uplift).provenance,
            notes=" + ".join(dict.fromkeys(notes)),
        )
        family = self.id.partition("/")[0]
        return MaterialSource(material_id, family, model, parameters, provenance, path, original)


def _licence(asset: JsonNode) -> str:
    """Return the licence stated by the file: the specification's `copyright`, or the `license` of libraries."""
    extras = asset.values.get("extras")
    added = extras.get("license") if isinstance(extras, dict) else None
    said = (asset.text("copyright"), added if isinstance(added, str) else "")
    return "; ".join(printable(text.strip()) for text in said if text.strip())


def _unlit(maps: SurfaceMaps) -> SurfaceMaps:
    """Return the body alone."""
    return SurfaceMaps(base=maps.base, coverage=maps.coverage, cutoff=maps.cutoff)


def _factor(node: JsonNode, name: str) -> list[float]:
    return node.numbers(name, (1.0, 1.0, 1.0, 1.0), high=1)


def emission_of(colour: Colour, uplift: str) -> tuple[dict[str, Any], str]:
    """Make entries of `original` for the mean of `colour`, whose 1, 1, 1 is 1 cd/m^2 of D65; and a note.

    The spectrum is that of a reflectance of this colour under D65, so that its colour is exact.
    """
    size = colour.texture.size if colour.texture else (1, 1)
    total = sum(np.atleast_3d(colour.at(rows, size)).reshape(-1, 3).sum(axis=0) for rows in blocks(*size))
    texels = size[0] * size[1] if colour.texture else 1
    mean = np.asarray(total, dtype=np.float64) / texels
    light, eye = illuminant("D65"), observer("1931_2")
    white = light.resampled(WORKING_WAVELENGTHS_NM).samples / (EFFICACY * eye.luminous(light))
    values = upsampling(uplift).spectra(mean) * white
    spectrum = {
        "wavelengths_nm": WORKING_WAVELENGTHS_NM,
        "values": values,
        "quantity": "emission",
        "details.units": _EMISSION_UNITS,
        "linear_rgb": mean,
    }
    return spectrum, "linear sRGB in cd/m^2, in the light of D65" + ("; the mean of a map" if colour.texture else "")
