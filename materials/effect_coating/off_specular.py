"""Effect coatings and metals: colours that change with the angle from the mirror direction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.angles import flop_weights
from ...spectral.measurement import Geometry
from ..core.brdf import Brdf
from ..core.directions import spherical

#: Degrees from the mirror direction towards the light at which such surfaces are read, lit at 45 degrees: near it, away
#: from it, and far from it (ASTM E2194).
ANGLES = (15.0, 45.0, 110.0)
#: Least ratio of an effect coating's brightness at 45 degrees from the mirror direction to that at 75; satin black has
#: 1.6, metals and metallic paints some 3. A coating whose hue alone changes is not recognised.
FLOPS = 1.8
_TOLD_BY = (45.0, 75.0)


def towards(angles: Sequence[float]) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Compute directions to the light, at 45 degrees, and to viewers at aspecular `angles`, degrees, towards it."""
    wo = spherical(np.radians(np.asarray(angles) - 45.0), 0.0)
    return np.broadcast_to(spherical(np.pi / 4.0, 0.0), wo.shape), wo


def light_and_detector(
    geometries: Sequence[Geometry],
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Compute directions to the light and to the detector of geometries of a multi-angle instrument.

    The detector is rotated about the mirror direction s: wo = cos(as) s + sin(as) (cos(az) e + sin(az) y), with e the
    direction in which s leans away from the normal, and y that of the plane's normal.

    Raises
    ------
    InputError : the light's angle is not stated, or one of the two is not above the surface.
    """
    light, away, turned = (
        np.radians([float(getattr(one, part) or 0.0) for one in geometries])[:, None]
        for part in ("first", "second", "azimuth")
    )
    zero, one = np.zeros_like(light), np.ones_like(light)
    wi = np.hstack([np.sin(light), zero, np.cos(light)])
    mirror, beyond = wi * (-1.0, 1.0, 1.0), np.hstack([-np.cos(light), zero, -np.sin(light)])
    side = np.hstack([zero, one, zero])
    wo = np.cos(away) * mirror + np.sin(away) * (np.cos(turned) * beyond + np.sin(turned) * side)
    for geometry, above in zip(geometries, (wi[:, 2] > 0.0) & (wo[:, 2] > 0.0), strict=True):
        if geometry.first is None or not above:
            raise InputError(
                "no light and detector above the surface",
                field="geometry",
                found=geometry.notation,
                expected="angles of both, such as 45as15",
            )
    return wi, wo


def effect_of(brdf: Brdf) -> str:
    """Describe why a surface is an effect coating; "" if it is none.

    The criterion is that of multi-angle instruments: how much it darkens away from the mirror direction, lit at 45
    degrees, under D65 for 10 degrees.
    """
    if brdf.bispectral:
        return ""
    wi, wo = towards(_TOLD_BY)
    luminous = flop_weights(brdf.wavelengths_nm)[1]
    face, flank = np.asarray(brdf.eval(wi, wo), dtype=np.float64) @ luminous
    if not face > FLOPS * max(flank, 0.0):
        return ""
    return f"a metal or an effect coating, {face / flank:.1f} times as bright at 45 degrees from the mirror as at 75"
