"""Reading of a material by a 45:0 instrument, in the light of a scene and on its display."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ..lighting.scene import Scene
from ..materials.catalogue.instrument_reading import InstrumentReading
from ..materials.effect_coating.off_specular import ANGLES
from ..spectral.image import ColourImage
from .display.png import quantise
from .display.transform import DisplayTransform


def xyz_in(scene: Scene, reading: InstrumentReading) -> Float[np.ndarray, "3"]:
    """XYZ in the mixture of the scene's lights that its `adopted_white` is the white of; the diffuser has Y = 1."""
    return scene.mixed(np.stack([reading.xyz(light.spectrum, scene.observer) for light in scene.lights]))


def colours_around(scene: Scene, reading: InstrumentReading) -> tuple[tuple[float, Float[np.ndarray, "3"]], ...]:
    """Compute `xyz_in` by degrees from the mirror direction, of metals and effect coatings; none of others."""
    mixed = scene.mixed(np.stack([reading.xyz_around(light.spectrum, scene.observer) for light in scene.lights]))
    return tuple(zip(ANGLES, mixed, strict=False))


def swatch(
    display: DisplayTransform, xyz: Float[np.ndarray, "3"], white: Float[np.ndarray, "3"]
) -> tuple[int, int, int]:
    """XYZ as a colour of the display, 8 bits a channel."""
    rgb, _ = display.encode(ColourImage(xyz[None, None], "xyz", white))
    red, green, blue = (int(code) for code in quantise(rgb)[0, 0])
    return red, green, blue
