"""Rendered pictures in OpenEXR: XYZ as it was computed, or linear red, green and blue for other programs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float

from ..adaptation import Method, adaptation_matrix
from ..image import ColourImage
from .exr import write_exr

# Chromaticities of the axes of XYZ itself, white E, in OpenEXR's order: red, green, blue, white (x, y).
_XYZ_CHROMATICITIES = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)


@dataclass(frozen=True)
class LinearSpace:
    """Linear RGB by the chromaticities (x, y) of red, green, blue and white.

    interop_id : by the Color Interop Forum's recommendation for OpenEXR's attribute `colorInteropID`.
    """

    name: str
    chromaticities: tuple[float, ...]
    interop_id: str

    @property
    def white_xyz(self) -> Float[np.ndarray, "3"]:
        """XYZ of white, Y = 1."""
        return _xyz_of(self.chromaticities[6:])

    @property
    def rgb_from_xyz(self) -> Float[np.ndarray, "3 3"]:
        """Matrix from XYZ under `white_xyz` (SMPTE RP 177)."""
        columns = np.stack([_xyz_of(self.chromaticities[at : at + 2]) for at in (0, 2, 4)], axis=1)
        return np.linalg.inv(columns * np.linalg.solve(columns, self.white_xyz))


SpaceName = Literal["acescg", "rec709", "rec2020"]
#: Spaces by the words of `--space`: ACES AP1 (SMPTE ST 2065-1 and S-2014-004), ITU-R BT.709, BT.2020.
LINEAR_SPACES: dict[SpaceName, LinearSpace] = {
    "acescg": LinearSpace("ACEScg", (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767), "lin_ap1_scene"),
    "rec709": LinearSpace("linear Rec.709", (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329), "lin_rec709_scene"),
    "rec2020": LinearSpace(
        "linear Rec.2020", (0.708, 0.292, 0.17, 0.797, 0.131, 0.046, 0.3127, 0.329), "lin_rec2020_scene"
    ),
}


def write_xyz_exr(
    path: str | Path,
    image: ColourImage,
    coverage: Float[np.ndarray, "H W"] | None = None,
    notes: dict[str, str] | None = None,
    illuminance_lux: float | None = None,
) -> None:
    """Write channels X, Y, Z (Y = 1 for the perfect diffuser facing the light) and coverage as A.

    The white goes into the attributes `whiteXYZ` and `adoptedNeutral`, the space into `colourSpace`, what X, Y, Z are
    into `comments`, `notes` into string attributes.

    illuminance_lux : that gives Y = 1 to the perfect diffuser; its luminance becomes `whiteLuminance`.
    """
    adapted = "adapted to D65" if image.space == "xyz_d65" else "not adapted: the white is that of the lights"
    attributes = {
        "chromaticities": _XYZ_CHROMATICITIES,
        "colourSpace": image.space,
        "comments": f"X, Y, Z are CIE tristimulus values of the observer named here, linear, {adapted} (whiteXYZ). "
        f"{_SCALE}",
        **_whites(image.white_xyz, illuminance_lux),
        "whiteXYZ": np.asarray(image.white_xyz, dtype=np.float32),
        **(notes or {}),
    }
    channels = {name: image.values[..., index] for index, name in enumerate("XYZ")}
    write_exr(path, attributes, channels if coverage is None else {**channels, "A": coverage})


def write_rgb_exr(
    path: str | Path,
    image: ColourImage,
    space: SpaceName,
    coverage: Float[np.ndarray, "H W"] | None = None,
    notes: dict[str, str] | None = None,
    illuminance_lux: float | None = None,
    adaptation: Method = "Bradford",
) -> tuple[str, ...]:
    """Write channels R, G, B of a linear space, and coverage as A; returns what has to be said of it.

    XYZ under the white of the lights is adapted once, to the white of the space. Nothing is clipped: colours out of
    gamut have negative values. Attributes are those of `write_xyz_exr`, and `colorInteropID`.
    """
    target = LINEAR_SPACES[space]
    source = np.asarray(image.white_xyz, dtype=np.float64)
    matrix = target.rgb_from_xyz @ adaptation_matrix(source, target.white_xyz, adaptation)
    rgb = np.asarray(image.values, dtype=np.float64) @ matrix.T
    (x, y), (to_x, to_y) = source[:2] / source.sum(), target.chromaticities[6:]
    adapted = f"adapted once, by {adaptation}, from white x {x:.4f}, y {y:.4f} to x {to_x:.4f}, y {to_y:.4f}"
    attributes = {
        "chromaticities": tuple(target.chromaticities),
        "colorInteropID": target.interop_id,
        "comments": f"R, G, B are {target.name}, {adapted}. {_SCALE} Nothing is clipped: colours out of gamut have "
        "negative values.",
        **_whites(target.white_xyz, illuminance_lux),
        **(notes or {}),
    }
    channels = {name: rgb[..., index].astype(np.float32) for index, name in enumerate("RGB")}
    write_exr(path, attributes, channels if coverage is None else {**channels, "A": coverage})
    said = [f"{target.name}, {adapted}."]
    # Rounding of matrices is not a colour out of gamut.
    beyond = int(np.count_nonzero((rgb < -1e-6).any(axis=-1)))
    if beyond:
        share = beyond / rgb[..., 0].size
        said.append(f"{beyond} pixels ({share:.2%}) are out of the gamut of {target.name}: their negative values stay.")
    return tuple(said)


_SCALE = (
    "Y = 1 is the perfect diffuser that faces the light. A is the share of a pixel that shows a surface, by which the "
    "others are multiplied."
)


def _whites(white_xyz: Float[np.ndarray, "3"], illuminance_lux: float | None) -> dict[str, object]:
    """Attributes of OpenEXR for the white: where it is, and its luminance in cd/m2."""
    white = np.asarray(white_xyz, dtype=np.float64)
    found: dict[str, object] = {"adoptedNeutral": (white[:2] / white.sum()).astype(np.float32)}
    if illuminance_lux is not None:
        # A perfect diffuser sends E / pi in every direction.
        found["whiteLuminance"] = float(illuminance_lux / math.pi)
    return found


def _xyz_of(xy: tuple[float, ...]) -> Float[np.ndarray, "3"]:
    x, y = xy
    return np.array([x / y, 1.0, (1.0 - x - y) / y])
