"""Pictures and curves of the factorisation benchmark: what the page shows beside the figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float

from ...calibration.report import plots
from ...materials.analytic.fluorescent import FluorescentLambert
from ...materials.core.brdf import Brdf
from ...materials.core.directions import spherical
from ...materials.core.protocol import SphereProtocol
from ...materials.factored.pack import FactoredBrdf, FactorPack
from ...spectral.difference import delta_e_xyz
from ...spectral.illuminants import illuminant
from ...spectral.image import ColourImage
from ...spectral.observers import observer
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ...viewer.display.png import quantise
from ...viewer.display.transform import DisplayTransform
from .fluorescence import Drawn, row_lights
from .scenes import lit_pixels

if TYPE_CHECKING:
    from .case import Case

#: Lights of the pictures, degrees from the view: one that shows the highlight, one that grazes.
PICTURE_LIGHTS_DEG = (35.0, 80.0)
#: ΔE94 at which the maps' scale turns from "hardly seen" to more; it ends at three times this.
SCALE_DELTA_E = 2.0
INCIDENCE_DEG = (0.0, 30.0, 60.0)
POLAR_NM = 550.0
_BACKGROUND = 0.12


def case_figures(
    case: Case,
    brdf: Brdf,
    packs: tuple[FactorPack, ...],
    distribution: Brdf,
    lights: Sequence[str],
    pixels: int,
) -> dict:
    """Data URIs of the pictures and maps under every light, and the curves in the plane of incidence."""
    protocol, places = _spheres(pixels)
    reference, other = (protocol.references(it, lights) for it in (brdf, distribution))
    sample = protocol.samples(FactoredBrdf(packs), lights)
    shown = []
    for index, light in enumerate(lights):
        easel = _Easel(places, protocol.under(light).weights(WORKING_WAVELENGTHS_NM).sum(axis=0), reference[index])
        shots = [
            ("ΔE94 of the D-BRDF", easel.map_of(other[index])),
            ("D-BRDF", easel.picture(other[index])),
            ("Reference", easel.picture(reference[index])),
            ("Factor packs", easel.picture(sample[index])),
            ("ΔE94 of the packs", easel.map_of(sample[index])),
        ]
        shown.append({"light": light, "shots": shots})
    curves = {
        "reference": polar_radii(brdf),
        "packs": polar_radii(FactoredBrdf(packs)),
        "dbrdf": polar_radii(distribution),
    }
    names = {"reference": "reference", "packs": "factor packs", "dbrdf": "D-BRDF"}
    what = f"fᵣ cos θᵢ at {POLAR_NM:g} nm, 1/sr"
    return {**_card(case, places, shown), "polar": _polar(curves, names, what), "packs_2010": case.packs_2010}


def fluorescent_figures(case: Case, brdf: FluorescentLambert, drawn: Drawn, pixels: int) -> dict:
    """Return the same card for a fluorescent surface: what the renderer drew, and what leaving fluorescence out looks
    like.
    """
    lit = lit_pixels(pixels, PICTURE_LIGHTS_DEG)
    places = np.concatenate(list(lit), axis=1)

    def side_by_side(pictures: np.ndarray) -> np.ndarray:
        return np.concatenate(list(pictures), axis=1)[places]

    shown = []
    for index, (name, light) in enumerate(row_lights().items()):
        reference = side_by_side(drawn.reference[index])
        easel = _Easel(places, observer("1931_2").white(light), reference)
        own, plain = side_by_side(drawn.packs[index]), side_by_side(drawn.without["reflectance"][index])
        shots = [
            ("ΔE94 of the reflectance under D65", easel.map_of(plain)),
            ("That reflectance", easel.picture(plain)),
            ("Reference, full matrix", easel.picture(reference)),
            ("Rendered", easel.picture(own)),
            ("ΔE94, rendered", easel.map_of(own)),
            ("ΔE94 of the diagonal alone", easel.map_of(side_by_side(drawn.without["diagonal"][index]))),
            ("ΔE94 of RGB", easel.map_of(side_by_side(drawn.without["rgb"][index]))),
        ]
        shown.append({"light": name, "shots": shots})
    nm = float(brdf.wavelengths_nm[np.argmax(_excess(brdf))])
    curves = {
        "reference": _matt_radii(float(_sent(brdf, nm))),
        "packs": _rendered_radii(brdf, nm),
        "diagonal": polar_radii(brdf, nm),
    }
    names = {"reference": "full matrix", "packs": "factor packs", "diagonal": "diagonal alone"}
    what = f"radiance at {nm:g} nm under D65 over irradiance there, 1/sr"
    return {**_card(case, places, shown), "polar": _polar(curves, names, what), "packs_2010": None}


@dataclass(frozen=True, eq=False)
class _Easel:
    """Turns XYZ (N,3) at `places` of a picture into pictures and maps under a light of this white."""

    places: Bool[np.ndarray, "h w"]
    white: Float[np.ndarray, "3"]
    reference: Float[np.ndarray, "N 3"]

    def picture(self, xyz: Float[np.ndarray, "N 3"]) -> str:
        image = np.tile(_BACKGROUND * self.white, (*self.places.shape, 1))
        image[self.places] = xyz
        rgb, _ = DisplayTransform().encode(ColourImage(image.astype(np.float32), "xyz", self.white))
        return plots.data_uri(plots.lossless(quantise(rgb).astype(np.uint8)))

    def map_of(self, xyz: Float[np.ndarray, "N 3"]) -> str:
        image = np.full(self.places.shape, np.nan)
        image[self.places] = delta_e_xyz(self.reference, xyz, self.white)
        return plots.data_uri(plots.lossless(plots.delta_e_picture(image, SCALE_DELTA_E)))


def _card(case: Case, places: np.ndarray, shown: list[dict]) -> dict:
    height, width = map(int, places.shape)
    return {"case": case.name, "title": case.title, "width": width, "height": height, "pictures": shown}


def _polar(curves: dict[str, list[list[float]]], names: dict[str, str], what: str) -> dict:
    return {
        "angles_deg": polar_angles_deg().tolist(),
        "incidence_deg": list(INCIDENCE_DEG),
        "radii": curves,
        "names": names,
        "what": what,
    }


def polar_angles_deg() -> Float[np.ndarray, " A"]:
    """Angles of reflection in the plane of incidence; the light comes from the positive side."""
    return np.linspace(-89.5, 89.5, 359)


def polar_radii(brdf: Brdf, nm: float = POLAR_NM) -> list[list[float]]:
    """sqrt(f_r cos theta_i) at one wavelength for each incidence, as in figure 5 of Schwenk 2010; 0 where negative."""
    near = int(np.argmin(np.abs(brdf.wavelengths_nm - nm)))
    angles = np.radians(polar_angles_deg())
    wo = spherical(np.abs(angles), np.where(angles < 0, np.pi, 0.0))
    radii = []
    for incidence in np.radians(INCIDENCE_DEG):
        wi = spherical(incidence, 0.0)
        shaded = brdf.eval(wi, wo)[:, near] * wi[2]
        radii.append(_rooted(shaded))
    return radii


def _rooted(shaded: np.ndarray) -> list[float]:
    return np.round(np.sqrt(np.maximum(shaded, 0.0)), 5).tolist()


def _sent(brdf: FluorescentLambert, nm: float) -> float:
    """pi f_r of all that leaves at one wavelength under D65, over the light there: 1 is the perfect diffuser."""
    light, at = illuminant("D65"), np.array([nm])
    return float(brdf.bispectral.radiance(light, at)[0] / light.averaged(at).samples[0])


def _excess(brdf: FluorescentLambert) -> Float[np.ndarray, " L"]:
    """Re-radiated power under D65 at the surface's wavelengths."""
    return brdf.bispectral.emission(illuminant("D65"), brdf.wavelengths_nm)


def _matt_radii(factor: float) -> list[list[float]]:
    """Half circles of a perfectly diffuse surface that sends out `factor` of what arrives."""
    count = len(polar_angles_deg())
    return [_rooted(np.full(count, factor / np.pi * np.cos(angle))) for angle in np.radians(INCIDENCE_DEG)]


def _rendered_radii(brdf: FluorescentLambert, nm: float) -> list[list[float]]:
    """Return the same from the factors, as a renderer looks them up."""
    (pack,) = brdf.own_form().packs
    light, at = illuminant("D65"), np.array([nm])
    sent = pack.palette.radiance(light, at)[0] / light.averaged(at).samples
    angles = np.radians(polar_angles_deg())
    wo = spherical(np.abs(angles), np.where(angles < 0, np.pi, 0.0))
    return [
        _rooted((pack.values(spherical(incidence, 0.0), wo) @ sent)[:, 0]) for incidence in np.radians(INCIDENCE_DEG)
    ]


@cache
def _spheres(pixels: int) -> tuple[SphereProtocol, Bool[np.ndarray, "h w"]]:
    """Pairs of spheres side by side, one a light, row 0 on top, and the pixels that they are the values of."""
    centres = (np.arange(pixels) + 0.5) / pixels * 2.0 - 1.0
    x, y = np.meshgrid(centres, -centres)
    z = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    normal = np.stack([x, y, z], axis=-1)
    tangent = np.stack([z, np.zeros_like(x), -x], axis=-1)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=-1, keepdims=True), 1e-12)
    frame = np.stack([tangent, np.cross(normal, tangent), normal], axis=-2)
    lights = [np.array([np.sin(angle), 0.0, np.cos(angle)]) for angle in np.radians(PICTURE_LIGHTS_DEG)]
    wi = np.concatenate([frame @ light for light in lights], axis=1)
    wo = np.concatenate([frame @ np.array([0.0, 0.0, 1.0])] * len(lights), axis=1)
    seen = np.concatenate([x * x + y * y < 1.0] * len(lights), axis=1) & (wi[..., 2] > 0.01)
    return SphereProtocol(pixels, PICTURE_LIGHTS_DEG, wi[seen], wo[seen]), seen
