"""What a 45:0 instrument reads of a material's original data under the lights of a scene: curve, XYZ, Lab, swatch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..lighting.scene import Scene
from ..materials.brdf import Brdf
from ..materials.fluorescent import FluorescentBrdf
from ..materials.records.record_colour import annular_45_0, radiance_factor_45_0
from ..spectral.bispectral import Bispectral
from ..spectral.image import ColourImage
from .display import DisplayTransform
from .png import quantise

#: How the reading is taken: lit at 45 degrees all around, seen along the normal.
GEOMETRY = "45a:0"


@dataclass(frozen=True, eq=False)
class Reading:
    """A material as an annular 45:0 instrument meets it.

    Parameters
    ----------
    wavelengths_nm, factor : (L,) radiance factor of what keeps its wavelength, at the data's own wavelengths.
    surface, spread : of a fluorescent material, its Donaldson matrix and pi times its emission factor; else None, 0.
    """

    wavelengths_nm: Float[np.ndarray, " L"]
    factor: Float[np.ndarray, " L"]
    surface: Bispectral | None = None
    spread: float = 0.0

    @classmethod
    def of(cls, brdf: Brdf) -> Reading:
        """The reading of a material's original data."""
        factor = radiance_factor_45_0(brdf)
        if not isinstance(brdf, FluorescentBrdf):
            return cls(brdf.wavelengths_nm, factor)
        spread = float(np.pi * brdf.emission_factor(*annular_45_0()).mean())
        return cls(brdf.wavelengths_nm, factor, brdf.bispectral, spread)

    def xyz(self, scene: Scene) -> Float[np.ndarray, "3"]:
        """XYZ in the mixture of the scene's lights that its `adopted_white` is the white of; the diffuser has Y = 1."""
        eye, under_each = scene.observer, []
        for light in scene.lights:
            xyz = eye.weights(light.spectrum, self.wavelengths_nm) @ self.factor
            if self.surface is not None:
                xyz = xyz + self.spread * self.surface.fold_emission(light.spectrum, eye)
            under_each.append(xyz)
        return scene.mixed(np.stack(under_each))


def swatch(
    display: DisplayTransform, xyz: Float[np.ndarray, "3"], white: Float[np.ndarray, "3"]
) -> tuple[int, int, int]:
    """XYZ as a colour of the display, 8 bits a channel."""
    rgb, _ = display.encode(ColourImage(xyz[None, None], "xyz", white))
    red, green, blue = (int(code) for code in quantise(rgb)[0, 0])
    return red, green, blue
