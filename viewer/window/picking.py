"""Picking: the surface point of a pixel, and the pixel of a pinned point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...lighting.camera import Camera
from ...lighting.reference.geometry import Tracer
from ...lighting.scene import Scene
from .places import Pin

# Distance from a pin, in radii of the scene, within which a hit is the pinned point.
_NEAR = 1e-4


@dataclass(frozen=True)
class Sight:
    """Visibility and position of a pinned point in an image.

    pixel : column and row; None if it is not visible. why : the reason in that case.
    """

    pixel: tuple[int, int] | None
    why: str = ""


class Picker:
    """Ray picker of a scene; scenes with the same meshes may share one."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self._tracer = scene, Tracer(scene)
        self._first = np.cumsum([0, *(len(part.mesh.faces) for part in scene.parts)])

    def pin(self, camera: Camera, column: float, row: float, name: str) -> Pin | None:
        """Return the surface point at an image position, in pixels from the upper left corner; None without a
        surface.
        """
        one = camera.cropped(slice(int(row), int(row) + 1), slice(int(column), int(column) + 1))
        # Centre of the nearest sample, the resolution of the image.
        origins, directions = one.rays()
        side = one.samples
        line, across = (min(int((value - int(value)) * side), side - 1) for value in (row, column))
        origin, direction = origins[line, across][None], np.ascontiguousarray(directions[line, across][None])
        face = self._tracer.first(origin, direction)
        if face[0] < 0:
            return None
        _, weights = self._tracer.on_triangle(face, origin, direction)
        part = int(self._tracer.part[face[0]])
        first, second, third = (float(one) for one in weights[0])
        return Pin(name, self.scene.parts[part].name, int(face[0] - self._first[part]), (first, second, third))

    def sight(self, camera: Camera, pin: Pin) -> Sight:
        """Locate a pin in an image.

        Raises
        ------
        UnknownNameError, InputError : see `Pin.mesh`.
        """
        place = pin.position(self.scene)
        clip = camera.clip_from_world() @ np.append(place, 1.0)
        if clip[3] <= 0.0:
            return Sight(None, "behind the camera")
        across, up = clip[:2] / clip[3]
        if not (-1.0 <= across < 1.0 and -1.0 < up <= 1.0):
            return Sight(None, "outside of the picture")
        pixel = int(0.5 * (across + 1.0) * camera.width), int(0.5 * (1.0 - up) * camera.height_px)
        viewer = camera.position
        if camera.projection == "orthographic":
            # From outside the scene, along the view.
            viewer = place + 4.0 * self._tracer.radius * camera.axes[2]
        hidden = self._hidden_by(viewer, place)
        return Sight(None, f"hidden by {hidden}") if hidden else Sight(pixel)

    def _hidden_by(self, start: np.ndarray, place: np.ndarray) -> str:
        """Return the name of the part that occludes a point; "" for none."""
        off = place - start
        length = float(np.linalg.norm(off))
        direction = (off / length)[None]
        face = self._tracer.first(start[None], np.ascontiguousarray(direction))
        if face[0] < 0:
            return ""
        met, _ = self._tracer.on_triangle(face, start[None], direction)
        if met[0] >= length - _NEAR * self._tracer.radius:
            return ""
        return self.scene.parts[int(self._tracer.part[face[0]])].name
