"""The environment form of matt textures: a cosine alone, times the planes' coefficients at each point."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from ...spectral.palette import Palette
from ..core.environment_form import EnvironmentForm, Lobes
from ..core.points import Points
from ..core.term_shader import TermShader
from .texture_planes import TexturePlanes


@dataclass(frozen=True, eq=False)
class MattTexture(EnvironmentForm):
    """No Gaussians; the integral of a coefficient over the cosine is pi times it."""

    uses_uv: ClassVar[bool] = True
    count = 0

    texture: TexturePlanes

    @property
    def palette(self) -> Palette:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The texture's."""
        return self.texture.palette

    def lobes(self, points: Points) -> Lobes:
        """Implement `EnvironmentForm.lobes`."""
        matt = np.pi * self.texture.coefficients(points)
        count, rank = matt.shape
        return Lobes(np.zeros((count, 0, 3)), np.zeros((count, 0)), np.zeros((count, 0, rank)), matt[:, None])

    def shader(self, filtered: bool = False) -> TermShader:
        """Return the texture's own look-up, with a cosine in place of its term."""
        return replace(self.texture.shader(filtered), file=Path(__file__).with_name("matt_texture.glsl"))

    @property
    def key(self) -> tuple:
        """The texture's."""
        return self.texture.key
