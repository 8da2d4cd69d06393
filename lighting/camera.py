"""Pinhole and orthographic cameras, for ray tracing and rasterisation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from jaxtyping import Float

from ..runtime.errors import InputError
from .vectors import Number, VectorLike, finite_vector

PROJECTIONS = ("perspective", "orthographic")


@dataclass(frozen=True, eq=False)
class Camera:
    """Camera with a regular grid of `samples` x `samples` points per pixel, averaged (box filter).

    Parameters
    ----------
    position, target, up : (3,) world; the camera looks from `position` to `target`.
    projection : "perspective" or "orthographic".
    vertical_fov_deg : full vertical angle of view of a perspective camera, in (0, 180).
    height : of the view of an orthographic camera, world units, > 0.
    width, height_px : size of the picture in pixels. Pixels are square.
    samples : sample points along one side of a pixel.
    near, far : distances of the clip planes along the viewing direction; by default estimated from the distance to the
        target. `fitted` sets them to a box. They scale the depth of `clip_from_world` and clip nothing from an image.
    part_of : (left, top, width, height) of a crop (`cropped`): its first column and row in the whole image, and the
        size of the whole, to which `vertical_fov_deg` or `height` refers.

    Raises
    ------
    InputError : a direction of length 0, `up` along the view, sizes or angles out of range.
    """

    name: str = "camera"
    position: VectorLike = (0.0, 0.0, 4.0)
    target: VectorLike = (0.0, 0.0, 0.0)
    up: VectorLike = (0.0, 1.0, 0.0)
    projection: str = "perspective"
    vertical_fov_deg: Number | None = None
    height: Number | None = None
    width: int = 256
    height_px: int = 256
    samples: int = 3
    near: Number | None = None
    far: Number | None = None
    part_of: tuple[int, int, int, int] | None = None

    def __post_init__(self) -> None:
        put = partial(object.__setattr__, self)
        if self.projection not in PROJECTIONS:
            expected = " or ".join(PROJECTIONS)
            raise InputError("unknown projection", field="projection", found=self.projection, expected=expected)
        perspective = self.projection == "perspective"
        if perspective and self.height is not None:
            raise InputError("a perspective camera has no view height", field="height", expected="vertical_fov_deg")
        if not perspective and self.vertical_fov_deg is not None:
            raise InputError("an orthographic camera has no angle of view", field="vertical_fov_deg", expected="height")
        if perspective:
            fov = 30.0 if self.vertical_fov_deg is None else float(self.vertical_fov_deg)
            if not 0.0 < fov < 180.0:
                raise InputError("angle out of range", field="vertical_fov_deg", found=fov, expected="0 to 180 degrees")
            put("vertical_fov_deg", fov)
        else:
            height = 2.2 if self.height is None else float(self.height)
            if not 0.0 < height < np.inf:
                raise InputError("view height out of range", field="height", found=height, expected="a positive length")
            put("height", height)
        for field, most in (("width", 16384), ("height_px", 16384), ("samples", 64)):
            value = getattr(self, field)
            if isinstance(value, bool) or value != int(value) or not 1 <= value <= most:
                raise InputError("not a usable count", field=field, found=value, expected=f"a number, 1 to {most}")
            put(field, int(value))
        left, top, whole_width, whole_height = self.part_of or (0, 0, self.width, self.height_px)
        if min(left, top) < 0 or left + self.width > whole_width or top + self.height_px > whole_height:
            found = f"{self.width} x {self.height_px} pixels at {left}, {top}"
            expected = f"within {whole_width} x {whole_height}"
            raise InputError("beyond the picture", field="part_of", found=found, expected=expected)
        for field in ("near", "far"):
            if getattr(self, field) is not None:
                put(field, float(getattr(self, field)))
        if self.near is not None and self.far is not None and not self.near < self.far:
            raise InputError("clip planes out of order", field="near", found=self.near, expected=f"below {self.far}")
        if perspective and self.near is not None and self.near <= 0.0:
            raise InputError("near plane behind a perspective camera", field="near", found=self.near, expected="> 0")
        for field in ("position", "target", "up"):
            put(field, finite_vector(getattr(self, field), field))
        view = self.target - self.position
        if not view.any():
            found = self.target.tolist()
            expected = "a point apart from the position"
            raise InputError("target is where the camera stands", field="target", found=found, expected=expected)
        if np.linalg.norm(np.cross(view, self.up)) <= 1e-9 * np.linalg.norm(view) * np.linalg.norm(self.up):
            raise InputError(
                "up lies along the viewing direction",
                field="up",
                found=self.up.tolist(),
                expected="a direction across the view, such as [0, 0, -1] where the camera looks straight down",
            )

    @cached_property
    def axes(self) -> Float[np.ndarray, "3 3"]:
        """Rows: right, up and backward (against the view) in world coordinates, orthonormal and right-handed."""
        back = self.position - self.target
        back = back / np.linalg.norm(back)
        right = np.cross(self.up, back)
        right = right / np.linalg.norm(right)
        return np.stack([right, np.cross(back, right), back])

    @property
    def half_extent(self) -> tuple[float, float]:
        """Half the width and height of the whole view: at unit distance (perspective) or in world units
        (orthographic).
        """
        if self.projection == "perspective":
            half = float(np.tan(np.deg2rad(self.vertical_fov_deg or 0.0) / 2))
        else:
            half = (self.height or 0.0) / 2
        _, _, width, height = self._place
        return half * width / height, half

    @property
    def sample_size(self) -> tuple[float, float]:
        """Width and height of a sample, in the units of `half_extent`."""
        (half_width, half_height), (_, _, width, height) = self.half_extent, self._place
        return 2.0 * half_width / (width * self.samples), 2.0 * half_height / (height * self.samples)

    @property
    def _place(self) -> tuple[int, int, int, int]:
        return self.part_of or (0, 0, self.width, self.height_px)

    def sized(self, longest: int) -> Camera:
        """Return the same view in an image with `longest` pixels along its longer side.

        Raises
        ------
        InputError : a crop, whose size is that of the whole image.
        """
        if self.part_of is not None:
            raise InputError("a part of a picture has no size of its own", field=self.name, expected="a whole picture")
        scale = longest / max(self.width, self.height_px)
        width, height = (max(1, round(scale * side)) for side in (self.width, self.height_px))
        return replace(self, width=width, height_px=height)

    def cropped(self, rows: slice, columns: slice) -> Camera:
        """Return the camera of a crop, with pixels identical to those of the whole image.

        Raises
        ------
        InputError : no pixel, or pixels outside the image.
        """
        (top, bottom, _), (left, right, _) = rows.indices(self.height_px), columns.indices(self.width)
        if not (top < bottom and left < right):
            found = f"rows {top} to {bottom}, columns {left} to {right}"
            expected = f"some of {self.width} x {self.height_px} pixels"
            raise InputError("no pixel of the picture", field="rows, columns", found=found, expected=expected)
        over, above, *whole = self._place
        part_of = (over + left, above + top, whole[0], whole[1])
        return replace(self, width=right - left, height_px=bottom - top, part_of=part_of)

    @property
    def clip_planes(self) -> tuple[float, float]:
        """Distances of the near and far plane along the viewing direction."""
        distance = float(np.linalg.norm(self.target - self.position))
        near = self.near if self.near is not None else 0.01 * distance
        far = self.far if self.far is not None else max(100.0 * distance, 2.0 * near)
        return near, far

    def fitted(self, low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"]) -> Camera:
        """Return this camera with clip planes just around the box from `low` to `high`; given planes stay."""
        corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
        depth = (self.position - corners) @ self.axes[2]
        margin = 0.01 * max(float(depth.max() - depth.min()), 1e-6 * float(np.abs(depth).max()), 1e-12)
        near, far = float(depth.min()) - margin, float(depth.max()) + margin
        if self.projection == "perspective":
            # A camera inside the box keeps a near plane in front of it, at a ratio suited to a float depth buffer.
            far = max(far, 1e-6)
            near = max(near, 1e-3 * far)
        # A given plane beyond the box moves the other one with it.
        if self.near is not None:
            near, far = self.near, max(far, self.near + margin)
        if self.far is not None:
            near, far = near if self.near is not None else min(near, self.far - 0.5 * abs(self.far) - margin), self.far
        return replace(self, near=near, far=far)

    def view_from_world(self) -> Float[np.ndarray, "4 4"]:
        """World to camera coordinates (x right, y up, looking along -z)."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.axes
        matrix[:3, 3] = -self.axes @ self.position
        return matrix

    def clip_from_world(self) -> Float[np.ndarray, "4 4"]:
        """World to OpenGL clip space: column vectors, x right, y up, z/w in [-1, 1] from near to far."""
        near, far = self.clip_planes
        half_width, half_height = self.half_extent
        clip_from_view = np.zeros((4, 4))
        clip_from_view[0, 0], clip_from_view[1, 1] = 1.0 / half_width, 1.0 / half_height
        part = np.eye(4)
        if self.part_of is not None:
            left, top, width, height = self.part_of
            part[0, 0], part[1, 1] = width / self.width, height / self.height_px
            part[0, 3] = (width - 2.0 * left) / self.width - 1.0
            part[1, 3] = 1.0 - (height - 2.0 * top) / self.height_px
        if self.projection == "perspective":
            clip_from_view[2, 2] = (far + near) / (near - far)
            clip_from_view[2, 3] = 2.0 * far * near / (near - far)
            clip_from_view[3, 2] = -1.0
        else:
            clip_from_view[2, 2] = 2.0 / (near - far)
            clip_from_view[2, 3] = (far + near) / (near - far)
            clip_from_view[3, 3] = 1.0
        return part @ clip_from_view @ self.view_from_world()

    def rays(
        self, rows: slice = slice(None)
    ) -> tuple[Float[np.ndarray, "rows columns 3"], Float[np.ndarray, "rows columns 3"]]:
        """Generate origins and unit directions through every sample point, row 0 on top.

        The grid has `height_px * samples` rows and `width * samples` columns; `rows` selects *pixel* rows, so that a
        large image can be rendered in bands.
        """
        s = self.samples
        first, last, step = rows.indices(self.height_px)
        if step != 1:
            raise InputError("bands of rows are contiguous", field="rows", found=rows, expected="a slice with step 1")
        half_width, half_height = self.half_extent
        left, top, width, height = self._place
        x = (2.0 * (np.arange(left * s, (left + self.width) * s) + 0.5) / (width * s) - 1.0) * half_width
        line = np.arange((top + first) * s, (top + max(last, first)) * s)
        y = (1.0 - 2.0 * (line + 0.5) / (height * s)) * half_height
        right, up, back = self.axes
        plane = x[None, :, None] * right + y[:, None, None] * up
        if self.projection == "perspective":
            directions = plane - back
            directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
            return np.broadcast_to(self.position, directions.shape), directions
        return self.position + plane, np.broadcast_to(-back, plane.shape)

    def to_viewer(self, points: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
        """Return unit directions from `points` to the viewer: to the pinhole, or against the viewing direction."""
        if self.projection == "orthographic":
            return np.broadcast_to(self.axes[2], points.shape)
        offset = self.position - points
        return offset / np.linalg.norm(offset, axis=-1, keepdims=True)
