"""Probed places: points fixed to surfaces, independent of camera and light, and regions of the image."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...lighting.mesh.mesh import Mesh
from ...lighting.scene import Scene
from ...runtime.errors import InputError
from .checks import Vector, check_text, check_within


@dataclass(frozen=True)
class Pin:
    """Pinned point of a surface.

    name : its name. part : of the scene. triangle : of the part's mesh. weights : barycentric, not negative, with sum
    1.
    """

    name: str
    part: str
    triangle: int
    weights: Vector

    def __post_init__(self) -> None:
        check_text(self.name, "name")
        check_text(self.part, "part")
        if self.triangle < 0:
            raise InputError("not a triangle", field="triangle", found=self.triangle, expected="0 or more")
        total = sum(self.weights)
        if not (len(self.weights) == 3 and all(one >= 0.0 for one in self.weights) and abs(total - 1.0) < 1e-6):
            raise InputError(
                "not a point of a triangle",
                field="weights",
                found=self.weights,
                expected="three numbers from 0, 1 together",
            )

    def mesh(self, scene: Scene) -> Mesh:
        """Return the mesh of the point.

        Raises
        ------
        UnknownNameError, InputError : the scene no longer has this part, or the part this triangle.
        """
        mesh = scene.part(self.part).mesh
        if self.triangle >= len(mesh.faces):
            expected = f"one of the {len(mesh.faces):,} that “{self.part}” has now"
            hint = "the mesh has changed: unpin it, and pin it again"
            raise InputError("no such triangle", field=self.name, found=self.triangle, expected=expected, hint=hint)
        return mesh

    def position(self, scene: Scene) -> Float[np.ndarray, "3"]:
        """Return the position, world."""
        mesh = self.mesh(scene)
        return np.array(self.weights) @ mesh.vertices[mesh.faces[self.triangle]]


@dataclass(frozen=True)
class Region:
    """Rectangle of the image, as shares of its width and height from the upper left."""

    name: str
    left: float
    top: float
    right: float
    bottom: float

    def __post_init__(self) -> None:
        check_text(self.name, "name")
        for field in ("left", "top", "right", "bottom"):
            check_within(getattr(self, field), 0.0, 1.0, field)
        for low, high in (("left", "right"), ("top", "bottom")):
            if not getattr(self, low) < getattr(self, high):
                expected = f"above {getattr(self, low):g}, its {low}"
                raise InputError("a region of no size", field=high, found=getattr(self, high), expected=expected)

    def pixels(self, width: int, height: int) -> tuple[slice, slice]:
        """Return the rows and columns of an image of this size with their centres inside; at least one each."""
        rows = _whole(self.top, self.bottom, height)
        return rows, _whole(self.left, self.right, width)


def _whole(low: float, high: float, count: int) -> slice:
    start = min(max(math.ceil(low * count - 0.5), 0), count - 1)
    return slice(start, min(max(math.ceil(high * count - 0.5), start + 1), count))


def free_name(stem: str, taken: Sequence[Pin | Region]) -> str:
    """Return an unused name: "pin 1", "pin 2" and so on."""
    names = {one.name for one in taken}
    return next(f"{stem} {number}" for number in range(1, len(names) + 2) if f"{stem} {number}" not in names)
