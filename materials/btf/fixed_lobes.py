"""Environment light under Gaussians fixed in the surface's frame, and a bent cosine.

Each point has terms (N,B,J); its amplitude under each light function is a sum of these with weights common to all
points.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from ...spectral.palette import Palette
from ..core.environment_form import BENDS, EnvironmentForm, Lobes
from ..core.points import Points
from .light_basis import LightFunctions
from .texels import TexelSummand

# Points per block.
_BLOCK = 1 << 11


@dataclass(frozen=True, eq=False)
class StandingForm(EnvironmentForm):
    """B terms per point, in the Gaussians and moments of `light_functions`; subclasses are frozen dataclasses."""

    uses_uv: ClassVar[bool] = True
    bent = BENDS

    texels: TexelSummand

    @property
    def palette(self) -> Palette:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Palette of the texels."""
        return self.texels.palette

    @property
    def key(self) -> tuple:
        """Key of the texels."""
        return self.texels.key

    @property
    def count(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Number of Gaussians that light is looked up under."""
        return len(self.functions.axes)

    @property
    @abc.abstractmethod
    def functions(self) -> LightFunctions:
        """Gaussians and moments."""

    @property
    @abc.abstractmethod
    def lights(self) -> Float[np.ndarray, "B F"]:
        """Weights of the light functions in each term."""

    @abc.abstractmethod
    def terms(
        self,
        uv: Float[np.ndarray, "N 2"],
        wo: Float[np.ndarray, "N 3"],
        footprint: Float[np.ndarray, "N 2 2"] | None = None,
    ) -> Float[np.ndarray, "N B J"]:
        """Compute the terms at points, averaged over the footprint if there is one."""

    def lobes(self, points: Points) -> Lobes:
        """Implement `EnvironmentForm.lobes`."""
        assert points.uv is not None
        count, rank = len(points), self.palette.rank
        terms = np.empty((count, len(self.lights), rank))
        for start in range(0, count, _BLOCK):
            rows = slice(start, start + _BLOCK)
            spanned = None if points.spans is None or points.footprint is None else points.footprint[rows]
            terms[rows] = self.terms(points.uv[rows], points.wo[rows], spanned)
        found = np.einsum("nbj,bf->nfj", terms, self.lights)
        axes = np.broadcast_to(self.functions.axes, (count, self.count, 3))
        sharpness = np.full((count, self.count), self.functions.sharpness)
        return Lobes(axes, sharpness, found[:, : self.count], np.pi * found[:, self.count :])

    def standing_textures(self, unit: float = 1.0) -> dict[str, np.ndarray]:
        """Make the textures for `fixed_lobes.glsl`, which receives terms in multiples of `unit`."""
        lights = (unit * self.lights).T.astype(np.float32)
        quads = -(-lights.shape[1] // 4)
        listed = np.zeros((len(lights), quads * 4), dtype=np.float32)
        listed[:, : lights.shape[1]] = lights
        axes = np.zeros((1, self.count, 4), dtype=np.float32)
        axes[0, :, :3], axes[0, :, 3] = self.functions.axes, 1.0 / self.functions.sharpness
        return {"taken": listed.reshape(len(lights), quads, 4), "axes": axes}
