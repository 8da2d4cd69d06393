"""Footprints of samples in each angle, for averaging mip-mapped factors.

They are differences of the angles at the midpoints of a sample's four sides. The surface there is the unbounded plane
of the sample's own triangle: no other part, silhouette, crease or shadow affects them, and neighbouring samples need
not be visible. Where the plane's horizon is within the sample the other side is used twice.

A polar angle has a kink at its pole, where the differences of a highlight's theta_h across a pixel cancel. There the
span is that of the direction itself: the distance that one of the two directions moves relative to the other. Azimuths
change by up to half a turn, the shorter way. Spans of both image axes are added in squares, like the variances of two
boxes.

Twin of `footprint.glsl`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ...lighting.vectors import dot, unit
from ...materials.core.axes import Frame
from ...materials.core.directions import TAU, angles, azimuth_difference, half_difference
from .geometry import LightGeometry
from .raster import SUBSTEPS, WindowTriangles
from .surfaces import SurfaceSamples, interpolated
from .view import View

# Largest ratio of depth at a side of a sample to that at its centre for the side to be used.
DEEPEST = 10.0
# |l + v|^2 below which the half vector has no direction.
LEAST_HALF = 1e-12


@dataclass(frozen=True, eq=False)
class _Directions:
    """Angles and directions at K points.

    theta (K, 4) : theta_i, theta_o, theta_h, theta_d. azimuth (K, 4) : phi, phi_i, phi_d, phi_h.
    apart (K, 4, 3) : light, viewer and half vector minus the normal, and light minus half vector, all unit vectors.
    whole (K,) : see `surfaces.Interpolated`. met (K,) : mask of points whose half vector has a direction.
    """

    theta: Float[np.ndarray, "K 4"]
    azimuth: Float[np.ndarray, "K 4"]
    apart: Float[np.ndarray, "K 4 3"]
    whole: Float[np.ndarray, " K"]
    met: Bool[np.ndarray, " K"]


def footprints(
    view: View,
    light: LightGeometry,
    triangles: WindowTriangles,
    surface: SurfaceSamples,
    which: Int[np.ndarray, " K"],
) -> dict[Frame, Float[np.ndarray, "K 4"]]:
    """Compute the spans of samples `which` in each angle of `axes.AXIS_NAMES`, by frame, radians."""
    number, point = surface.number[which], surface.point[which]
    here = _directions(view, light, triangles, number, point)
    along, apart, around = np.zeros((3, len(which), 4))
    for axis in range(2):
        step = np.zeros(2, dtype=np.int64)
        step[axis] = SUBSTEPS // 2
        ends = [_directions(view, light, triangles, number, point + side * step) for side in (1, -1)]
        usable = [(DEEPEST * end.whole * here.whole > here.whole**2) & end.met for end in ends]
        # A single side counts twice; without any, the differences are zero.
        scale = np.where(usable[0] & usable[1], 1.0, 2.0)[:, None]

        def difference(name: str, ends: list = ends, usable: list = usable) -> np.ndarray:
            middle = getattr(here, name)
            shape = (-1,) + (1,) * (middle.ndim - 1)
            first, second = (
                np.where(good.reshape(shape), getattr(end, name), middle)
                for end, good in zip(ends, usable, strict=True)
            )
            return first - second

        along += (scale * difference("theta")) ** 2
        apart += 0.5 * scale**2 * np.sum(difference("apart") ** 2, axis=-1)
        turned = difference("azimuth")
        around += (scale * (turned - TAU * np.floor(turned / TAU + 0.5))) ** 2
    squared = here.theta**2
    total = squared + apart
    # Change of theta far from the pole, of the direction at the pole.
    share = np.divide(squared, total, out=np.ones_like(total), where=total > 0.0)
    polar = np.sqrt(share * along + (1.0 - share) * apart)
    azimuth = np.minimum(np.sqrt(around), TAU)
    return {
        "io": np.concatenate([polar[:, :2], azimuth[:, :2]], axis=1),
        "hd": np.concatenate([polar[:, 2:], azimuth[:, 2:]], axis=1),
    }


def _directions(
    view: View,
    light: LightGeometry,
    triangles: WindowTriangles,
    number: Int[np.ndarray, " K"],
    point: Int[np.ndarray, "K 2"],
) -> _Directions:
    at = interpolated(view, triangles, number, point)
    to_light = unit(light.towards(at.position))
    middle = to_light + at.to_viewer
    normal, half = at.frame[:, 2], unit(middle)
    wi, wo = (np.einsum("nij,nj->ni", at.frame, direction) for direction in (to_light, at.to_viewer))
    theta_i, phi_i = angles(wi)
    theta_h, theta_d, phi_d, phi_h = half_difference(wi, wo)
    return _Directions(
        np.stack([theta_i, angles(wo)[0], theta_h, theta_d], axis=1),
        np.stack([azimuth_difference(wi, wo), phi_i, phi_d, phi_h], axis=1),
        np.stack([to_light - normal, at.to_viewer - normal, half - normal, to_light - half], axis=1),
        at.whole,
        dot(middle, middle) > LEAST_HALF,
    )
