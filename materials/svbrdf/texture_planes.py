"""The summand of matt textures: planes of coefficients, looked up at every point, times a few spectra."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.palette import Palette
from ..core.axes import Frame
from ..core.fast import Summand, TermShader
from ..core.points import Points
from ..core.terms import Terms
from .texels import filtered, levels_of, look_up, packed


@dataclass(frozen=True, eq=False)
class TexturePlanes(Summand):
    """Coefficients of every texel: term r is plane r at the point, times the cosine.

    planes : (H,W,R), in float16 where `precision` is "half". palette : one entry of R spectra, 1/sr.
    """

    uses_uv: ClassVar[bool] = True

    planes: np.ndarray
    palette: Palette
    precision: Literal["single", "half"] = "single"
    frame: Frame = "hd"

    def __post_init__(self) -> None:
        expected = (self.palette.entries, self.palette.rank)
        if self.planes.ndim != 3 or not self.planes.size or (1, self.planes.shape[2]) != expected:
            words = f"(H, W, {self.palette.rank}), one entry"
            raise InputError("planes do not fit", field="planes", found=self.planes.shape, expected=words)

    @cached_property
    def levels(self) -> list[np.ndarray]:
        """Make the levels by `texels.levels_of`."""
        return levels_of(self.planes)

    def terms(self, points: Points) -> Terms:
        """Implement `Summand.terms`; where points say what they span, each plane is its mean over that."""
        return Terms(self.coefficients(points) * points.angles(self.frame).scale[:, None])

    def coefficients(self, points: Points) -> Float[np.ndarray, "N R"]:
        """Return each plane at each point, or its mean over what the point spans."""
        assert points.uv is not None
        if points.spans is None or points.footprint is None:
            return look_up(self.planes, points.uv)
        return filtered(self.levels, points.uv, points.footprint)

    def shader(self, filtered: bool = False) -> TermShader:
        """Make the shader by `texels.packed`."""
        levels = self.levels if filtered else [self.planes]
        # Means of halves are no halves.
        texels, sizes, places = packed(levels, self.planes.dtype == np.float16 and not filtered)
        return TermShader(Path(__file__).with_name("texture.glsl"), sizes, {"planes": texels}, {"levels": places})

    @property
    def key(self) -> tuple:
        """Identity of the planes."""
        return "texture", id(self.planes)

    @property
    def nbytes(self) -> int:
        """Bytes of planes and spectra."""
        return self.planes.nbytes + self.palette.values.nbytes

    @property
    def grid(self) -> str:
        """Texels across and down."""
        return f"{self.planes.shape[1]} x {self.planes.shape[0]} texels"
