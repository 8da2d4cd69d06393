"""Pictures and curves of the factorisation benchmark: what the page shows beside the figures."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float

from ..calibration import plots
from ..materials.brdf import Brdf
from ..materials.directions import spherical
from ..materials.factors import FactoredBrdf, FactorPack
from ..materials.protocol import SphereProtocol
from ..spectral.difference import delta_e_xyz
from ..spectral.image import ColourImage
from ..spectral.wavelengths import WORKING_WAVELENGTHS_NM
from .display import DisplayTransform
from .factor_sphere import brdf_xyz, pack_xyz, under
from .png import quantise

if TYPE_CHECKING:
    from .factor_cases import Case

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
    reference, other = (brdf_xyz(it, protocol, lights) for it in (brdf, distribution))
    sample = pack_xyz(packs, protocol, lights)
    shown = []
    for index, light in enumerate(lights):
        white = under(protocol, light).weights(WORKING_WAVELENGTHS_NM).sum(axis=0)

        def picture(xyz: np.ndarray, white: np.ndarray = white) -> str:
            image = np.tile(_BACKGROUND * white, (*places.shape, 1))
            image[places] = xyz
            rgb, _ = DisplayTransform().encode(ColourImage(image.astype(np.float32), "xyz", white))
            return plots.data_uri(plots.lossless(quantise(rgb).astype(np.uint8)))

        def map_of(xyz: np.ndarray, index: int = index, white: np.ndarray = white) -> str:
            image = np.full(places.shape, np.nan)
            image[places] = delta_e_xyz(reference[index], xyz, white)
            return plots.data_uri(plots.lossless(plots.delta_e_picture(image, SCALE_DELTA_E)))

        shown.append(
            {
                "light": light,
                "reference": picture(reference[index]),
                "packs": picture(sample[index]),
                "dbrdf": picture(other[index]),
                "packs_map": map_of(sample[index]),
                "dbrdf_map": map_of(other[index]),
            }
        )
    curves = {
        "reference": polar_radii(brdf),
        "packs": polar_radii(FactoredBrdf(packs)),
        "dbrdf": polar_radii(distribution),
    }
    return {
        "case": case.name,
        "title": case.title,
        "packs_2010": case.packs_2010,
        "width": int(places.shape[1]),
        "height": int(places.shape[0]),
        "pictures": shown,
        "polar": {"angles_deg": polar_angles_deg().tolist(), "incidence_deg": list(INCIDENCE_DEG), "radii": curves},
    }


def polar_angles_deg() -> Float[np.ndarray, " A"]:
    """Angles of reflection in the plane of incidence; the light comes from the positive side."""
    return np.linspace(-89.5, 89.5, 359)


def polar_radii(brdf: Brdf) -> list[list[float]]:
    """sqrt(f_r cos theta_i) at 550 nm for each incidence, as Schwenk 2010 plots it in figure 5; 0 where negative."""
    near = int(np.argmin(np.abs(brdf.wavelengths_nm - POLAR_NM)))
    angles = np.radians(polar_angles_deg())
    wo = spherical(np.abs(angles), np.where(angles < 0, np.pi, 0.0))
    radii = []
    for incidence in np.radians(INCIDENCE_DEG):
        wi = spherical(incidence, 0.0)
        shaded = brdf.eval(wi, wo)[:, near] * wi[2]
        radii.append(np.round(np.sqrt(np.maximum(shaded, 0.0)), 5).tolist())
    return radii


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
