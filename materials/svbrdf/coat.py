"""A clear coat over a surface of maps: facets of glass about a normal of their own; what lies below gets the rest.

    f_r = (1 - w Fc) f_r below + w Fc D G / (4 cos cos),   Fc = 0.04 + 0.96 (1 - h.wi)^5

as KHR_materials_clearcoat has it, but for Fc at the half vector, where it is reciprocal (`metallic_roughness`).
The coat's normal is the mesh's, or a map's: bumps below do not bend it.

In light from all around (`mapped_slices`) the coat has Gaussians of its own. Beside sums over every texel of a sky,
ΔE94 is at the mean 0.03 (paint) to 0.08 (metal) and 0.26 at the most; over bumps of up to 30 degrees it is 0.2
at the mean and 0.7 at the most: there the coat's cosine is taken to lie as that of what is below.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ..core.points import Points
from .facets import facets, turned_to
from .map_levels import facets_apart

#: Fc at the normal, of a refractive index of 1.5.
COAT_F0 = 0.04


def alike(spread: Float[np.ndarray, " N"]) -> Float[np.ndarray, "N 3"]:
    """S (`facets`) of alpha^2 that is alike in all directions."""
    return np.stack([spread, np.zeros_like(spread), spread], axis=1)


def coat_over(
    points: Points,
    fall: Float[np.ndarray, " N"],
    coat: Float[np.ndarray, " N"],
    normal: Float[np.ndarray, "N 3"],
    spread: Float[np.ndarray, "N 3"],
    differ: Float[np.ndarray, "N 3"] | None = None,
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"]]:
    """Compute the transmission of the coat, 1 - w Fc, and its own f_r cos(theta_i), 1/sr.

    fall : (1 - h.wi)^5. coat : w. normal : unit. spread : S of its facets. differ : see `map_levels.facets_apart`; None
    where normals do not differ.
    """
    reflected = coat * (COAT_F0 + (1.0 - COAT_F0) * fall)
    wi, wo = turned_to(normal, points.wi, points.wo)
    above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    wi, wo = (np.where(above[:, None], w, (0.0, 0.0, 1.0)) for w in (wi, wo))
    shine = facets(wi, wo, spread) * wi[:, 2] if differ is None else facets_apart(wi, wo, spread, differ)
    return 1.0 - reflected, above * reflected * shine
