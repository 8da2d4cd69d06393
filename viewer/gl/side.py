"""One side of a comparison: a scene with its illuminant, and the method of its rendering."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Float

from ...calibration.regression.row import Pixels
from ...lighting.scene import Scene
from ...lighting.transfer.radiant import fluoresces
from ...materials.core.fast import Fast
from ...spectral.spectrum import Spectrum


@dataclass(frozen=True, eq=False)
class CanvasSide:
    """One side of a comparison.

    illuminant : replaces the lights' own spectra; None keeps them. dimming : factor on all lights, not on the white.
    influence : part of which only the light reflected onto all others is shown, the difference to it being black. None:
        all light.
    made : "fast" is rendered live; others show `still`, or nothing yet, and their scene is that of the image.
    """

    scene: Scene
    surfaces: Mapping[str, Fast]
    illuminant: Spectrum | None = None
    dimming: float = 1.0
    influence: str | None = None
    made: Literal["fast", "reference", "file"] = "fast"
    still: Pixels | None = None

    @cached_property
    def white(self) -> Float[np.ndarray, "3"]:
        """XYZ, Y = 1, of the perfect diffuser under this side's lights."""
        return self.lit.adopted_white() if self.still is None else self.still.white_xyz

    @cached_property
    def lit(self) -> Scene:
        """Scene with the illuminant, without dimming."""
        return self.scene if self.illuminant is None else self.scene.with_illuminant(self.illuminant)

    @cached_property
    def drawn(self) -> tuple[Scene, tuple[Spectrum, ...]]:
        """Scene to render, and the spectra that replace its lights' own; with fluorescent interreflection the scene's
        lights have them instead.
        """
        if self.illuminant is None or self.scene.bounces == 0:
            return self.scene, () if self.illuminant is None else (self.illuminant,)
        if fluoresces(self.surfaces[name] for name in self.scene.material_ids):
            return self.lit, ()
        return self.scene, (self.illuminant,)
