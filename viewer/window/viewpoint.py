"""Viewpoints, with orbit, pan, zoom and frame as functions of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ...lighting.camera import PROJECTIONS, Camera
from ...lighting.scene import framing_camera
from ...lighting.vectors import unit
from .checks import Vector, check_known, check_positive, check_text, check_vector, check_within

#: Least angle between the view and `up`, degrees, where the orientation of the image would be undefined.
LEAST_POLE_DEG = 0.5
#: Limits of the distance to the target when zooming, world units.
NEAREST, FARTHEST = 1e-6, 1e9


@dataclass(frozen=True)
class Viewpoint:
    """Camera without an image size.

    Parameters
    ----------
    name : of the original camera.
    position, target, up : world coordinates, see `Camera`.
    projection : "perspective" or "orthographic".
    extent : vertical angle of view in degrees (perspective), or height of the view in world units.
    aspect : width over height of the image to which `extent` refers; 0 is any. A narrower image shows more above and
        below, so that nothing is cropped at its sides.

    Raises
    ------
    InputError, UnknownNameError : see `Camera`.
    """

    name: str = "camera"
    position: Vector = (0.0, 0.0, 4.0)
    target: Vector = (0.0, 0.0, 0.0)
    up: Vector = (0.0, 1.0, 0.0)
    projection: str = "perspective"
    extent: float = 30.0
    aspect: float = 0.0

    def __post_init__(self) -> None:
        check_text(self.name, "name")
        for field in ("position", "target", "up"):
            check_vector(getattr(self, field), field)
        check_known(self.projection, PROJECTIONS, "projection", "projection")
        if self.projection == "perspective":
            check_within(self.extent, 1e-3, 179.0, "extent", "degrees")
        else:
            check_positive(self.extent, "extent")
        check_within(self.aspect, 0.0, 1e4, "aspect")
        self.camera(1, 1)

    @classmethod
    def of(cls, camera: Camera) -> Viewpoint:
        """Return the viewpoint of a camera."""
        extent = camera.vertical_fov_deg if camera.projection == "perspective" else camera.height
        assert extent is not None
        position, target, up = (_vector(one) for one in (camera.position, camera.target, camera.up))
        aspect = camera.width / camera.height_px
        return cls(camera.name, position, target, up, camera.projection, float(extent), aspect)

    def camera(self, width: int, height_px: int, samples: int = 1) -> Camera:
        """Return the camera for an image size."""
        extent = self.extent_of(width / height_px)
        fov, height = (extent, None) if self.projection == "perspective" else (None, extent)
        return Camera(
            self.name, self.position, self.target, self.up, self.projection, fov, height, width, height_px, samples
        )

    def extent_of(self, aspect: float) -> float:
        """Return the extent for an image's width over height: its own, or more for a narrower image."""
        more = self.aspect / aspect
        if more <= 1.0:
            return self.extent
        if self.projection == "orthographic":
            return more * self.extent
        return min(179.0, float(np.degrees(2.0 * np.arctan(more * np.tan(np.radians(self.extent) / 2.0)))))

    @property
    def distance(self) -> float:
        """Distance from the position to the target."""
        return float(np.linalg.norm(np.subtract(self.position, self.target)))

    @property
    def height_at_target(self) -> float:
        """World height of the view at the target."""
        if self.projection == "orthographic":
            return self.extent
        return 2.0 * self.distance * float(np.tan(np.radians(self.extent) / 2.0))


def orbited(view: Viewpoint, right_deg: float, up_deg: float = 0.0) -> Viewpoint:
    """Orbit the target to the right, about `up`, and upwards, stopping short of the pole."""
    axis = unit(np.array(view.up))
    off = np.subtract(view.position, view.target)
    length = float(np.linalg.norm(off))
    off = _turned(off, axis, right_deg)
    polar = float(np.degrees(np.arccos(np.clip(off @ axis / length, -1.0, 1.0))))
    # A view already nearer to the pole is not moved away from it.
    low, high = min(polar, LEAST_POLE_DEG), max(polar, 180.0 - LEAST_POLE_DEG)
    wanted = float(np.clip(polar - up_deg, low, high))
    off = _turned(off, unit(np.cross(axis, off)), wanted - polar)
    return replace(view, position=_vector(view.target + off * (length / float(np.linalg.norm(off)))))


def panned(view: Viewpoint, right: float, up: float) -> Viewpoint:
    """Move across the view, in image heights at the target; objects at the target move the other way."""
    sideways, upwards, _ = view.camera(1, 1).axes
    step = view.height_at_target * (right * sideways + up * upwards)
    return replace(view, position=_vector(view.position + step), target=_vector(view.target + step))


def zoomed(view: Viewpoint, factor: float) -> Viewpoint:
    """Magnify the target by `factor`: a perspective camera moves nearer, a parallel view gets narrower."""
    check_positive(factor, "factor")
    if view.projection == "orthographic":
        return replace(view, extent=float(np.clip(view.extent / factor, NEAREST, FARTHEST)))
    distance = float(np.clip(view.distance / factor, min(NEAREST, view.distance), max(FARTHEST, view.distance)))
    off = np.subtract(view.position, view.target) * (distance / view.distance)
    return replace(view, position=_vector(view.target + off))


def framed(view: Viewpoint, low: Vector, high: Vector, aspect: float = 1.0) -> Viewpoint:
    """Frame the box from `low` to `high` in the same viewing direction.

    aspect : width over height of the image.
    """
    check_positive(aspect, "aspect")
    middle, half = np.add(low, high) / 2.0, np.maximum(np.subtract(high, low) / 2.0, 1e-9)
    back = view.camera(1, 1).axes
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half @ back.T
    reach = np.abs(corners).max(axis=0)
    # `framing_camera` frames a box along z: the bounding box of the corners in view axes.
    extent = {"vertical_fov_deg": view.extent} if view.projection == "perspective" else {}
    size = {"width": max(1, round(1000 * aspect)), "height_px": 1000}
    size = size if size["width"] <= 16384 else {"width": 16384, "height_px": max(1, round(16384 / aspect))}
    found = framing_camera(-reach, reach, projection=view.projection, **extent, **size)
    position = _vector(middle + back.T @ found.position)
    extent_now = view.extent if view.projection == "perspective" else float(found.height or view.extent)
    return replace(view, position=position, target=_vector(middle), extent=extent_now, aspect=aspect)


def _turned(vector: Float[np.ndarray, "3"], axis: Float[np.ndarray, "3"], degrees: float) -> Float[np.ndarray, "3"]:
    """Rotate a vector right-handed about a unit axis (Rodrigues)."""
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    along = (vector @ axis) * axis
    return along + cosine * (vector - along) + sine * np.cross(axis, vector)


def _vector(values: Float[np.ndarray, "3"]) -> Vector:
    x, y, z = (float(one) for one in values)
    return x, y, z
