"""One side of a comparison: a scene in the light that it is shown in, and how its picture is made."""

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

    illuminant : in place of the lights' own spectra; None is theirs. dimming : of all lights; the white stays.
    influence : the part whose light on all others is shown alone: what they would lack if it were black. None: all.
    made : "fast" is drawn; of others `still` is the picture, or none is there yet. Their scene is what they show.
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
        """XYZ, Y = 1, of the perfect diffuser in these lights."""
        return self.lit.adopted_white() if self.still is None else self.still.white_xyz

    @cached_property
    def lit(self) -> Scene:
        """The scene under its lights as they are shown, but for their dimming."""
        return self.scene if self.illuminant is None else self.scene.with_illuminant(self.illuminant)

    @cached_property
    def drawn(self) -> tuple[Scene, tuple[Spectrum, ...]]:
        """The scene that renderers draw, and the spectra in place of its lights' own, which where surfaces that
        fluoresce pass light on are its lights' own.
        """
        if self.illuminant is None or self.scene.bounces == 0:
            return self.scene, () if self.illuminant is None else (self.illuminant,)
        if fluoresces(self.surfaces[name] for name in self.scene.material_ids):
            return self.lit, ()
        return self.scene, (self.illuminant,)
