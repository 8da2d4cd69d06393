"""Writer of MaterialX 1.39: materials as OpenPBR surfaces in red, green and blue, their spectra in a table beside them.

Surfaces of Lambert and of Oren and Nayar, metals of GGX facets, and glTF's metal and roughness with its coat become
OpenPBR surfaces. The error of OpenPBR's formulas against the BRDF is measured for each under D65, and a material with
an average above `BAR` is refused. Gloss paints (`CoatedDiffuse`) are: facets of Beckmann's shape over a body that light
passes on its way in and out would be off by 1 to 6.7, whatever roughness is written.

Colours are linear Rec.709 (`lin_rec709`), the primaries of sRGB; if one is outside, all of that material are ACEScg
(`acescg`). None is clipped.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...runtime.files import written_whole
from ...spectral.formats.csv_writer import write_csv
from ...spectral.formats.registry import SpectralEntry
from ...spectral.spectrum import Spectrum
from ...spectral.upsampling import xyz_from_rgb
from ..analytic import CookTorrance, Lambert, MetallicRoughness, OrenNayar
from ..core.brdf import Brdf
from ..core.fit_error import FitError
from ..core.protocol import SphereProtocol, sphere_protocol
from ..core.surface import Surface
from .open_pbr import OpenPbr, dielectric_albedo, edge_reflectance, rough_body, schlick_at_edge
from .shown_colours import shown_colour

#: The mean of ΔE94, on a sphere under D65, by which a written surface may be off.
BAR = 1.0
VERSION = "1.39"
#: Attribute of a material that names its columns in the table of spectra, and of the file that names the table.
ATTRIBUTE = "metamer_spectra"
# Pixels across the sphere on which a surface is judged.
_JUDGED = 64
# Pixels across the sphere by which a roughness is found, and steps in which a colour is.
_FITTED, _HALVINGS = 32, 50
# Linear Rec.709 = M @ ACEScg, adapted from ACES white to D65 by Bradford, as MaterialX's library has it.
_REC709_FROM_ACESCG = np.array(
    [
        [1.705050992658, -0.621792120657, -0.083258872001],
        [-0.130256417507, 1.140804736575, -0.010548319068],
        [-0.024003356805, -0.128968976065, 1.152972332870],
    ]
)
# Colours this far outside are inside: what rounding does.
_NEAR = 1e-6
# Facets that reflect nothing are written as rough as there are: MaterialX's own renderer has light pass them as if they
# reflected some of it near grazing, and smooth ones most, which took ΔE94 0.8 (mean) from a Lambert surface.
_MATT = OpenPbr((0.0, 0.0, 0.0), specular_weight=0.0, specular_roughness=1.0)
_HINT = "export it as a table of its BRDF: --format mitsuba or merl"


@dataclass(frozen=True, eq=False)
class OpenPbrMaterial:
    """Material to be written.

    Attributes
    ----------
    name : id in the catalogue. surface : numbers, in the colour space `space`. spectrum : of `base_color`.
    error : of OpenPBR's formulas against the BRDF. about : its origin. more : notes on its numbers.
    """

    name: str
    surface: OpenPbr
    space: str
    spectrum: Spectrum
    error: FitError
    about: str = ""
    more: tuple[str, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on its error, its colour space and its numbers."""
        error = self.error
        said = [
            f"{self.name}: off by ΔE94 {error.mean:.2f} (mean), {error.p99:.2f} (p99), {error.maximum:.1f} (largest) "
            f"on a sphere of {_JUDGED} pixels under {error.light}, by OpenPBR's formulas"
        ]
        if self.space != "lin_rec709":
            said.append(f"{self.name}: a colour lies outside Rec.709, all of it are written in {self.space}")
        return (*said, *self.more)


def open_pbr(name: str, brdf: Surface, about: str = "") -> OpenPbrMaterial:
    """Convert a BRDF to an OpenPBR surface.

    Raises
    ------
    InputError : OpenPBR cannot represent it, its colours are outside ACEScg, or its error exceeds `BAR`.
    """
    if isinstance(brdf, Lambert):
        shaped, colours = _MATT, [brdf.reflectance.samples]
    elif isinstance(brdf, OrenNayar):
        shaped, colours = _rough(brdf)
    elif isinstance(brdf, CookTorrance):
        shaped, colours = _metal(brdf)
    elif isinstance(brdf, MetallicRoughness):
        shaped, colours = _metallic_roughness(brdf)
    else:
        raise _refused(
            "OpenPBR has no numbers for this surface",
            getattr(brdf, "NAME", type(brdf).__name__),
            "a Lambert or Oren-Nayar surface, a metal with facets of GGX, or metal and roughness",
        )
    grid = brdf.wavelengths_nm
    shown = np.stack([shown_colour(values, grid) for values in colours])
    space, shown = _in_a_space(shown)
    colour = tuple(map(float, shown[0]))
    tint, notes = (1.0, 1.0, 1.0), []
    if len(shown) > 1:
        asked = shown[1] / schlick_at_edge(shown[0])
        tint = tuple(map(float, np.minimum(asked, 1.0)))
        if asked.max() > 1.0 + _NEAR:
            notes.append(f"{name}: specular_color {asked.max():.4f} is written as 1, the most that OpenPBR has")
    surface = replace(shaped, base_color=colour, specular_color=tint)  # pyright: ignore[reportArgumentType]
    error = _error(brdf, surface, space)
    if error.mean > BAR:
        raise _refused(
            "as an OpenPBR surface it would look different",
            f"ΔE94 {error.mean:.2f} (mean), {error.p99:.2f} (p99) under {error.light}",
            f"{BAR:g} (mean) at most",
        )
    return OpenPbrMaterial(name, surface, space, Spectrum.sampled(grid, colours[0]), error, about, tuple(notes))


def write_materialx(path: Path, materials: Sequence[OpenPbrMaterial]) -> Path:
    """Write materials into one file, their spectra beside it into `NAME.spectra.csv`, which it names; returns that.

    Raises
    ------
    InputError : spectra of different wavelengths, or a folder that cannot be written to.
    """
    from xml.etree import ElementTree

    table = path.with_name(f"{path.stem}.spectra.csv")
    write_csv(table, [SpectralEntry(one.name, one.spectrum) for one in materials], ["base_color of each material"])
    root = ElementTree.Element("materialx", version=VERSION, colorspace="lin_rec709")
    for name, kind in ((ATTRIBUTE, "filename"), (f"{ATTRIBUTE}_column", "string")):
        what = {"name": f"AD_{name}", "attrname": name, "type": kind, "value": "", "elements": "surfacematerial"}
        ElementTree.SubElement(root, "attributedef", what)
    taken: set[str] = set()
    for one in materials:
        _write_material(root, one, _free_name(one.name, taken), table.name)
    ElementTree.indent(root)
    with written_whole(path) as beside:
        ElementTree.ElementTree(root).write(beside, encoding="UTF-8", xml_declaration=True)
    return table


def _write_material(root, one: OpenPbrMaterial, name: str, table: str) -> None:
    from xml.etree.ElementTree import SubElement

    shader = SubElement(root, "open_pbr_surface", name=f"{name}_surface", type="surfaceshader")
    for field in fields(one.surface):
        value = getattr(one.surface, field.name)
        if isinstance(value, tuple):
            text = ", ".join(f"{number:.9g}" for number in value)
            SubElement(shader, "input", name=field.name, type="color3", value=text, colorspace=one.space)
        else:
            SubElement(shader, "input", name=field.name, type="float", value=f"{value:.9g}")
    said = {
        "name": name,
        "type": "material",
        "uiname": one.name,
        "doc": " + ".join(filter(None, (one.about, *one.notes))),
    }
    said |= {ATTRIBUTE: table, f"{ATTRIBUTE}_column": one.name}
    material = SubElement(root, "surfacematerial", said)
    SubElement(material, "input", name="surfaceshader", type="surfaceshader", nodename=f"{name}_surface")


def _free_name(material_id: str, taken: set[str]) -> str:
    """Return a name of letters, digits and "_" that no other element has."""
    plain = re.sub(r"\W", "_", material_id, flags=re.ASCII)
    plain = plain if re.match("[A-Za-z_]", plain) else f"_{plain}"
    name, number = plain, 1
    while {name, f"{name}_surface"} & taken:
        number += 1
        name = f"{plain}_{number}"
    taken |= {name, f"{name}_surface"}
    return name


def _rough(brdf: OrenNayar) -> tuple[OpenPbr, list[np.ndarray]]:
    """Find the roughness of the most similar appearance, and the colour of the same reading at 45:0."""
    from scipy.optimize import minimize_scalar

    wi, wo = np.sqrt([[0.5, 0.0, 0.5]]), np.array([[0.0, 0.0, 1.0]])
    read, sphere = brdf.eval(wi, wo)[0], sphere_protocol(_FITTED, True)
    reference = sphere.reference(brdf)

    def with_roughness(rough: float) -> tuple[OpenPbr, np.ndarray]:
        low, high = np.zeros_like(read), np.ones_like(read)
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            darker = rough_body(wi, wo, middle, rough)[0] < read
            low, high = np.where(darker, middle, low), np.where(darker, high, middle)
        colour = shown_colour(high, brdf.wavelengths_nm)
        return replace(_MATT, base_color=tuple(colour), base_diffuse_roughness=rough), high  # pyright: ignore

    def error(rough: float) -> float:
        surface, _ = with_roughness(rough)
        return sphere.compare(reference, open_pbr_xyz(surface, "lin_rec709", sphere)).mean

    best: Any = minimize_scalar(error, bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-3})
    surface, colour = with_roughness(float(best.x))
    return surface, [colour]


def _metal(brdf: CookTorrance) -> tuple[OpenPbr, list[np.ndarray]]:
    if brdf.specular_weight != 1.0:
        raise _refused(
            "OpenPBR shares light otherwise between facets and body",
            f"specular_weight {brdf.specular_weight:g}",
            "1, a bare metal",
        )
    if brdf.distribution != "ggx":
        raise _refused("OpenPBR has facets of GGX alone", brdf.distribution, "ggx")
    normal, edge = edge_reflectance(brdf.eta, brdf.k)
    shaped = OpenPbr((0, 0, 0), base_metalness=1.0, specular_roughness=float(np.sqrt(brdf.roughness)))
    return shaped, [normal, edge]


def _metallic_roughness(brdf: MetallicRoughness) -> tuple[OpenPbr, list[np.ndarray]]:
    body, shine = brdf.diffuse.samples, brdf.specular.samples
    rough = _under_the_coat(brdf)
    coat_rough = float(np.sqrt(brdf.coat_alpha)) if brdf.coat else 0.0
    plain = OpenPbr((0, 0, 0), specular_roughness=rough, coat_weight=brdf.coat, coat_roughness=coat_rough)
    if not body.any() and brdf.edge == 1.0:
        return replace(plain, base_metalness=1.0), [shine]
    if not shine.any() and not brdf.edge:
        return replace(plain, specular_weight=0.0, specular_roughness=_MATT.specular_roughness), [body]
    if brdf.edge != 1.0 or np.ptp(shine) > _NEAR or brdf.coat:
        raise _refused(
            "OpenPBR has no numbers for these facets over a body",
            f"edge {brdf.edge:g}, specular {shine.min():g} to {shine.max():g}, coat {brdf.coat:g}",
            "edge 1, specular alike at every wavelength, and no coat; or a metal, whose diffuse is 0",
        )
    root = float(np.sqrt(shine[0]))
    shaped = replace(plain, specular_ior=(1.0 + root) / (1.0 - root))
    kept = (1.0 - shine[0]) / (1.0 - dielectric_albedo(np.ones(1), shaped.specular_ior, brdf.alpha)[0])
    return shaped, [body * kept]


def _under_the_coat(brdf: MetallicRoughness) -> float:
    """Find the roughness which, widened by the coat, is that of the base."""
    if not brdf.coat:
        return float(np.sqrt(brdf.alpha))

    def spread(rough: float) -> float:
        whole = min(1.0, rough**4 + 2.0 * brdf.coat_alpha**2) ** 0.25
        return (1.0 - brdf.coat) * rough + brdf.coat * whole

    wanted = float(np.sqrt(brdf.alpha))
    if spread(0.0) > wanted:
        raise _refused(
            "OpenPBR's coat would make what is below rougher than it is",
            f"alpha {brdf.alpha:g} under a coat of {brdf.coat_alpha:g}",
            "a coat that is much smoother than the metal",
        )
    low, high = 0.0, wanted
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if spread(middle) < wanted else (low, middle)
    return high


def _in_a_space(shown: Float[np.ndarray, "C 3"]) -> tuple[str, Float[np.ndarray, "C 3"]]:
    """Return a colour space that contains all of these linear Rec.709 colours, and the colours in it."""
    wide = shown @ np.linalg.inv(_REC709_FROM_ACESCG).T
    for space, values in (("lin_rec709", shown), ("acescg", wide)):
        if (values >= -_NEAR).all() and (values <= 1.0 + _NEAR).all():
            return space, np.clip(values, 0.0, 1.0)
    raise _refused(
        "a colour lies outside ACEScg", np.array2string(wide, precision=4), "0 to 1 in red, green and blue of ACEScg"
    )


def _error(brdf: Brdf, surface: OpenPbr, space: str) -> FitError:
    sphere = sphere_protocol(_JUDGED, True)
    return sphere.compare(sphere.reference(brdf), open_pbr_xyz(surface, space, sphere))


def open_pbr_xyz(surface: OpenPbr, space: str, sphere: SphereProtocol) -> Float[np.ndarray, "N 3"]:
    """Return XYZ of every sample of the protocol under D65, by OpenPBR's formulas."""
    to_xyz = xyz_from_rgb() if space == "lin_rec709" else xyz_from_rgb() @ _REC709_FROM_ACESCG
    return np.pi * (surface.eval(sphere.wi, sphere.wo) @ to_xyz.T) * sphere.wi[:, 2:]


def _refused(problem: str, found: object, expected: str) -> InputError:
    return InputError(problem, found=found, expected=expected, hint=_HINT)
