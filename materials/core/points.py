"""Shading points of surfaces: directions of light and view, and places on the texture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from .axes import Frame, FrameAngles, frame_angles


@dataclass(frozen=True, eq=False)
class Points:
    """N shading points of one surface.

    Parameters
    ----------
    wi, wo : (N,3) unit vectors to the light and to the viewer, in the local frame: x along u if there are texture
        coordinates, z along the normal.
    uv : (N,2) texture coordinates; None if the mesh has none or they are not needed.
    footprint : (N,2,2) footprint of a picture's sample on the texture: in rows, the steps of (u, v) to the next column
        of samples, and to the next row, downwards; None without uv.
    arriving : (N,) incident light on a surface that faces it, a factor of the terms; None is 1.
    spans : radians of each angle of a frame that a sample covers, (N,4) in the order of its axes; None to evaluate
        terms at the very point.
    """

    wi: Float[np.ndarray, "N 3"]
    wo: Float[np.ndarray, "N 3"]
    uv: Float[np.ndarray, "N 2"] | None = None
    footprint: Float[np.ndarray, "N 2 2"] | None = None
    arriving: Float[np.ndarray, " N"] | None = None
    spans: Mapping[Frame, Float[np.ndarray, "N 4"]] | None = None
    _angles: dict[tuple[Frame, bool], FrameAngles] = field(default_factory=dict, repr=False)

    def __len__(self) -> int:
        return len(self.wi)

    def angles(self, frame: Frame, anisotropic: bool = False) -> FrameAngles:
        """Compute the angles of a frame at every point, cached; `scale` includes the incident light."""
        key = (frame, anisotropic)
        if key not in self._angles:
            at = frame_angles(frame, self.wi, self.wo, anisotropic)
            self._angles[key] = at if self.arriving is None else replace(at, scale=at.scale * self.arriving)
        return self._angles[key]

    def chosen(self, which: Int[np.ndarray, " K"] | Bool[np.ndarray, " N"] | slice) -> Points:
        """Select some of the points."""

        def of(values: np.ndarray | None) -> np.ndarray | None:
            return None if values is None else values[which]

        spans: dict[Frame, np.ndarray] | None = None
        if self.spans is not None:
            spans = {frame: values[which] for frame, values in self.spans.items()}
        return Points(self.wi[which], self.wo[which], of(self.uv), of(self.footprint), of(self.arriving), spans)
