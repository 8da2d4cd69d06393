"""Read-back of images on the GPU: of a pixel, a region or all, on the window's thread."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, UInt8

from ...spectral.adaptation import adaptation_matrix
from ...spectral.difference import lab_from_xyz
from ...spectral.image_difference import ImageFormula, image_delta_e
from .displayed_value import Displayed, displayed
from .frame import Frame
from .image_frame import ImageFrame
from .state import FORMULAS, Session

if TYPE_CHECKING:
    import moderngl


@dataclass(frozen=True, eq=False)
class CanvasValues:
    """Values of a pixel or region of a side: mean XYZ and coverage, white, and the display value."""

    xyz: Float[np.ndarray, "3"]
    coverage: float
    white: Float[np.ndarray, "3"]
    shown: Displayed

    @property
    def lab(self) -> Float[np.ndarray, "3"]:
        """CIELAB relative to the white."""
        return lab_from_xyz(self.xyz, self.white)

    @property
    def lch(self) -> Float[np.ndarray, "3"]:
        """L*, C*ab, h_ab in degrees."""
        lightness, a, b = self.lab
        return np.array([lightness, np.hypot(a, b), np.degrees(np.arctan2(b, a)) % 360.0])

    @property
    def xy(self) -> tuple[float, float] | None:
        """Chromaticity; None for black."""
        total = float(self.xyz.sum())
        return (float(self.xyz[0]) / total, float(self.xyz[1]) / total) if total > 0.0 else None


def values_of(
    frame: Frame | ImageFrame, session: Session, rows: slice, columns: slice
) -> tuple[CanvasValues, CanvasValues]:
    """Return the mean over a rectangle of both sides' images."""
    both = []
    for canvas, white in zip(frame.canvases, frame.whites, strict=True):
        found = read_box(canvas, rows, columns).reshape(-1, 4).mean(axis=0, dtype=np.float64)
        xyz, coverage = found[:3], float(found[3])
        shown = displayed(xyz, white, frame.display, session.adaptation, session.exposure, session.surround, coverage)
        both.append(CanvasValues(xyz, coverage, white, shown))
    return both[0], both[1]


def canvas_differences(first: CanvasValues, second: CanvasValues) -> dict[ImageFormula, float]:
    """Compute ΔE by every formula of the maps with A as the reference; B is adapted to the white of A, as in the
    maps.
    """
    sample = second.xyz
    if not np.array_equal(first.white, second.white):
        sample = adaptation_matrix(second.white, first.white) @ sample
    reference, other = (lab_from_xyz(one, first.white)[None] for one in (first.xyz, sample))
    return {name: float(image_delta_e(reference, other, name, 1, first.white)[0]) for name in FORMULAS}


def read_box(texture: moderngl.Texture, rows: slice, columns: slice) -> Float[np.ndarray, "h w 4"]:
    """Return a rectangle of a canvas."""
    target = texture.ctx.framebuffer([texture])
    try:
        box = columns.start, rows.start, columns.stop - columns.start, rows.stop - rows.start
        data = target.read(viewport=box, components=4, dtype="f4")
    finally:
        target.release()
    return np.frombuffer(data, dtype=np.float32).reshape(box[3], box[2], 4)


def read_codes(texture: moderngl.Texture) -> UInt8[np.ndarray, "h w 3"]:
    """Read the display's code values: (H,W,3), 8 bits."""
    width, height = texture.size
    return np.frombuffer(texture.read(), dtype=np.uint8).reshape(height, width, 4)[..., :3]
