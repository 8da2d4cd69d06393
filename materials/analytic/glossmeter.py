"""Gloss in gloss units and in stops: the image of a lamp relative to the diffuse colour around it.

A glossmeter (ISO 2813:2014) sends a beam at 60 degrees and measures the light in a window of 4.4 degrees in the plane
of incidence and 11.7 across, about the mirror direction; black glass of n = 1.567 has 100 gloss units. The same number
states the brightness of a lamp of that size, reflected in the surface. Gloss units are not perceptually uniform: 5 and
10 are far apart, 90 and 95 are not. Brightness is perceived by ratios (Fechner), so that gloss is compared in stops,
each of which doubles the image of the lamp:

    gloss = log2(1 + (Y in the window - Y at 45:0))         Y as of a diffuser: pi f_r, in the window its mean

A matt surface reflects only its body into the window, which is subtracted: matt white and matt black have 0. The
shipped satin paints have 3.7, gloss paints 5.1, black glass 5.4, polished silver 8.6.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float

from ...spectral.folding import Folding
from ..core.directions import spherical
from ..core.points import Points
from ..core.surface import Surface
from .cook_torrance import fresnel

INCIDENCE = np.radians(60.0)
#: Half of the window's sides, in the plane of incidence and across.
WINDOW = np.radians((4.4, 11.7)) / 2
_BLACK_GLASS = 1.567
_NODES = 48
_SIDES = 8


@dataclass(frozen=True)
class Gloss:
    """Gloss of a surface.

    units : at 60 degrees, by ISO 2813. stops : as defined above; 0 without any excess over the body.
    """

    units: float
    stops: float


def gloss_of(surface: Surface, folding: Folding, body: float) -> Gloss:
    """Compute the gloss of a uniform surface; of an anisotropic one, from the mean of eight sides.

    The beam is parallel and the detector an eye; the standard's beam is 0.75 x 2.5 degrees wide.

    Parameters
    ----------
    folding : of one light.
    body : Y at 45:0, where no highlight is visible; 1 is the perfect diffuser.
    """
    azimuths = (0.0,) if surface.isotropic else tuple(np.arange(_SIDES) * np.pi / 4)
    share = float(np.mean([_into_window(surface, folding, float(azimuth)) for azimuth in azimuths]))
    size = float(_window(0.0)[2].sum())
    standing_out = max(np.pi * share / size - body, 0.0)
    return Gloss(100.0 * share / _black_glass(), float(np.log2(1.0 + standing_out)))


def _into_window(surface: Surface, folding: Folding, azimuth: float) -> float:
    """Compute Y of the light reflected into the window, as a fraction of the beam."""
    wi, wo, solid = _window(azimuth)
    return float(solid @ surface.xyz(Points(wi, wo), folding)[:, 1])


@cache
def _window(azimuth: float) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 3"], Float[np.ndarray, " N"]]:
    """Compute directions to the light and into the window, and their weights cos(theta) dw.

    Nodes are denser towards the middle, as cubes: highlights of a tenth of the window are resolved as well as wide
    ones.
    """
    at, share = np.polynomial.legendre.leggauss(_NODES)
    across, width = at**3, 3.0 * at**2 * share
    tilt, turn = np.meshgrid(WINDOW[0] * across, WINDOW[1] * across, indexing="ij")
    # Within the plane of incidence, then out of it: the window is square to the mirror's direction, and
    # dw = cos(turn) d(tilt) d(turn).
    plane = spherical(INCIDENCE + tilt, np.full(tilt.shape, azimuth + np.pi))
    out = spherical(np.pi / 2, azimuth + np.pi / 2)
    wo = np.cos(turn)[..., None] * plane + np.sin(turn)[..., None] * out
    solid = np.multiply.outer(WINDOW[0] * width, WINDOW[1] * width) * np.cos(turn) * wo[..., 2]
    wi = np.broadcast_to(spherical(INCIDENCE, azimuth), wo.shape)
    return wi.reshape(-1, 3), wo.reshape(-1, 3), solid.ravel()


@cache
def _black_glass() -> float:
    """Compute the reflectance of polished black glass for the beam."""
    cos2 = np.cos(INCIDENCE) ** 2
    return float(fresnel(np.array([cos2]), np.array([1.0 - cos2]), np.array([_BLACK_GLASS]), np.zeros(1))[0, 0])
