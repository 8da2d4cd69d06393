"""Writes a Mitsuba 3 scene: a sphere of the material, lit and seen as the reference renderer would do it.

Models with a Mitsuba plugin are written as that plugin, exactly: Lambert's surface is `diffuse`, Cook and Torrance's
with Smith's masking is `roughconductor`, blended with `diffuse`. Any other BRDF is tabulated (`rgl_table`) for the
plugin `measured`, with light and viewer exchanged: Mitsuba asks for the table's light in the direction of the viewer,
so that a measurement that is not quite reciprocal would look otherwise there. Anisotropic measurements of the RGL data
base are written as they are.

Red, green and blue of the picture are linear sRGB in which the perfect diffuser that faces the light has Y = 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from ...runtime.files import written_whole
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.saturated_colours import spectra_of
from ..analytic import CookTorrance, Lambert
from ..core.brdf import Brdf
from ..core.protocol import sphere_protocol
from ..measured.rgl import RglBrdf
from ..measured.rgl_measurement import RglMeasurement
from ..measured.rgl_table import rgl_fields
from .rgl import write_tensors

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

#: The light shines from here, the camera looks along -z.
TO_LIGHT = (-0.45, 0.46, 0.766)
PIXELS, SAMPLES, HEIGHT = 256, 256, 2.2
SCENE, TABLE = "scene.xml", "material.bsdf"
# Wavelengths that Mitsuba integrates over; spectra are held to their ends there, as our renderer holds them.
_RANGE = (360.0, 830.0)
# Mitsuba divides the integral of radiance and y-bar by this (its CIE_Y_NORMALIZATION).
_LUMINOUS_INTEGRAL = 106.7502593994140625
# Least roughness that Mitsuba takes as given.
_SMOOTHEST = 1e-4
# Pixels across the sphere on which a table is judged.
_JUDGED = 64


def write_mitsuba(folder: Path, brdf: Brdf, comment: str = "") -> tuple[str, ...]:
    """Write `scene.xml`, and `material.bsdf` where the material is a table, into a folder; notes on how it was done.

    Raises
    ------
    InputError
        A fluorescent surface, for which Mitsuba has no plugin, one without mirror planes, or an unwritable folder.
    """
    bsdf = _plugin(brdf)
    if bsdf is not None:
        notes = (f"{type(brdf).__name__} is Mitsuba's {bsdf.get('type')}, exactly",)
    else:
        fields, notes = _table(brdf, comment)
        write_tensors(folder / TABLE, fields)
        bsdf = element("bsdf", element("string", name="filename", value=TABLE), type="measured")
    write_scene(folder, bsdf, comment, notes)
    return notes


def write_scene(folder: Path, bsdf: Element, comment: str, notes: tuple[str, ...]) -> None:
    """Write `scene.xml` with a sphere of that plugin, and the notes."""
    from xml.etree import ElementTree

    scene = _scene(bsdf)
    text = " ".join(f"{comment} + {' + '.join(notes)}".split()).replace("--", "-")
    scene.insert(0, ElementTree.Comment(f" {text} "))
    ElementTree.indent(scene)
    with written_whole(folder / SCENE) as beside:
        ElementTree.ElementTree(scene).write(beside, encoding="UTF-8", xml_declaration=True)


@dataclass(frozen=True, eq=False)
class _Exchanged(Brdf):
    """BRDF with light and viewer exchanged."""

    brdf: Brdf

    @property
    def isotropic(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.brdf.isotropic

    @property
    def wavelengths_nm(self) -> Float[np.ndarray, " L"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.brdf.wavelengths_nm

    def eval(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... L"]:
        return self.brdf.eval(wo, wi)


def _table(brdf: Brdf, comment: str) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Make the fields of the file for `measured`, and their error against the BRDF."""
    if isinstance(brdf, RglBrdf) and not brdf.isotropic:
        return _as_read(brdf)
    exchanged = brdf if brdf.bispectral else _Exchanged(brdf)
    sphere = sphere_protocol(_JUDGED, brdf.isotropic)
    fields = rgl_fields(exchanged, comment)
    error = sphere.compare(sphere.reference(exchanged), sphere.reference(RglBrdf(RglMeasurement("", fields))))
    return fields, (
        f"{type(brdf).__name__} is no plugin of Mitsuba's: written as a table, which is off by ΔE94 {error.mean:.2f} "
        f"(mean), {error.p99:.2f} (p99), {error.maximum:.1f} (largest) on a sphere of {_JUDGED} pixels under "
        f"{error.light}",
    )


def _as_read(brdf: RglBrdf) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    fields = dict(brdf.measurement.fields)
    notes = [
        "the measurement as it was read; Mitsuba exchanges light and viewer, which shows where it is not reciprocal"
    ]
    if not brdf.spectral:
        fields["spectra"] = _uplifted(fields["rgb"], brdf.method)
        fields["wavelengths"] = brdf.wavelengths_nm.astype(np.float32)
        notes.append(f"spectra are made up from its red, green and blue by {brdf.method}")
    return fields, tuple(notes)


def _uplifted(rgb: np.ndarray, method: str) -> Float[np.ndarray, "P T L H W"]:
    """Spectra of (P, T, 3, H, W)."""
    spectra = spectra_of(np.moveaxis(rgb.astype(np.float64), 2, -1), method)
    return np.ascontiguousarray(np.moveaxis(spectra, -1, 2), dtype=np.float32)


def _plugin(brdf: Brdf) -> Element | None:
    """Return the plugin equal to this BRDF, None if there is none."""
    if isinstance(brdf, Lambert):
        return _diffuse(brdf.wavelengths_nm, brdf.reflectance.samples)
    if not isinstance(brdf, CookTorrance) or brdf.masking != "smith" or brdf.roughness < _SMOOTHEST:
        return None
    facets = element(
        "bsdf",
        element("string", name="distribution", value=brdf.distribution),
        element("float", name="alpha", value=repr(float(brdf.roughness))),
        _spectrum("eta", brdf.wavelengths_nm, brdf.eta),
        _spectrum("k", brdf.wavelengths_nm, brdf.k),
        type="roughconductor",
    )
    if brdf.specular_weight == 1.0:
        return facets
    weight = element("float", name="weight", value=repr(float(brdf.specular_weight)))
    return element("bsdf", weight, _diffuse(brdf.wavelengths_nm, brdf.diffuse.samples), facets, type="blendbsdf")


def _diffuse(wavelengths_nm: np.ndarray, reflectance: np.ndarray) -> Element:
    return element("bsdf", _spectrum("reflectance", wavelengths_nm, reflectance), type="diffuse")


def _spectrum(name: str, wavelengths_nm: np.ndarray, values: np.ndarray) -> Element:
    """Format a spectrum, linear between samples, clamped to the ends of Mitsuba's range; uniform if constant."""
    if not (values != values[0]).any():
        value = element("float", name="value", value=f"{values[0]:.9g}")
        return element("spectrum", value, type="uniform", name=name)
    inside = wavelengths_nm[(wavelengths_nm > _RANGE[0]) & (wavelengths_nm < _RANGE[1])]
    nodes = np.concatenate([[_RANGE[0]], inside, [_RANGE[1]]])
    listed = (
        element("string", name=label, value=", ".join(f"{number:.9g}" for number in numbers))
        for label, numbers in (("wavelengths", nodes), ("values", np.interp(nodes, wavelengths_nm, values)))
    )
    return element("spectrum", *listed, type="irregular", name=name)


def _scene(bsdf: Element) -> Element:
    """`mitsuba_scene.xml` with the surface and the light in it."""
    from xml.etree import ElementTree

    text = Path(__file__).with_name("mitsuba_scene.xml").read_text(encoding="utf-8")
    direction = ", ".join(repr(-float(x)) for x in TO_LIGHT)
    scene = ElementTree.fromstring(
        text.format(samples=SAMPLES, pixels=PIXELS, scale=repr(HEIGHT / 2), direction=direction)
    )
    for place, element in (("emitter", _spectrum("irradiance", *_irradiance())), ("shape", bsdf)):
        next(scene.iter(place)).append(element)
    return scene


def _irradiance() -> tuple[np.ndarray, np.ndarray]:
    """D65 with which Mitsuba gives the perfect diffuser that faces the light Y = 1."""
    light, eye = illuminant("D65"), observer("1931_2")
    nm = eye.wavelengths_nm
    power = np.interp(nm, light.wavelengths_nm, light.samples)
    luminous = np.trapezoid(power * eye.cmfs[:, 1], nm)
    return light.wavelengths_nm, light.samples * np.pi * _LUMINOUS_INTEGRAL / luminous


def element(tag: str, *children: Element, **attributes: str) -> Element:
    """Return an XML element with its content."""
    from xml.etree.ElementTree import Element

    element = Element(tag, attributes)
    element.extend(children)
    return element
