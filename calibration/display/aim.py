"""Aim of a display: its white, its luminance, and its black."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.adaptation import adaptation_matrix
from ...spectral.difference import delta_e_xyz
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from .inverse import Inverse
from .model import DisplayModel

#: White that pictures arrive with: CIE daylight of 6504 K by its rounded chromaticity, as IEC 61966-2-1 and OCIO have
#: it. The white computed from the D65 table differs from it by 3e-5, enough to miss (1, 1, 1).
PICTURE_WHITE_XYZ = np.array([0.3127 / 0.3290, 1.0, (1.0 - 0.3127 - 0.3290) / 0.3290])
Black = Literal["absolute", "bpc"]
# ΔE94 from the white asked for that still counts as shown, and halvings of the luminance: 24 in all, to a millionth,
# so many at once, since a search for several colours takes hardly longer than for one.
_SHOWN, _HALVINGS_AT_ONCE, _ROUNDS = 0.02, 4, 6
# A white that is to be as bright as can be may give up this share of it, in so many steps, for whole codes.
_GIVEN_UP, _STEPS = 0.01, 101


@dataclass(frozen=True)
class AimSettings:
    """Requested aim.

    white : by name, or a chromaticity (x, y). luminance : of white in cd/m2; None: the maximum. black : of the first
    view.
    """

    white: Literal["d65", "native"] | tuple[float, float] = "d65"
    luminance: float | None = None
    black: Black = "absolute"


@dataclass(frozen=True, eq=False)
class Aim:
    """White, luminance and black of pictures on one display.

    Parameters
    ----------
    white_xyz : (3,) cd/m2 of the picture's white on the display.
    adapted : (3,3) from XYZ-D65 of pictures, Y of white 1, to cd/m2.
    black_xyz : (3,) the display's black.
    words : description of the white.
    """

    white_xyz: Float[np.ndarray, "3"]
    adapted: Float[np.ndarray, "3 3"]
    black_xyz: Float[np.ndarray, "3"]
    words: str

    def xyz(self, xyz_d65: Float[np.ndarray, "*batch 3"], black: Black = "absolute") -> Float[np.ndarray, "*batch 3"]:
        """Compute the cd/m2 that the display should show for XYZ-D65.

        "absolute": as computed; colours darker than the display's black cannot be shown. "bpc": black of the picture is
        mapped to the display's, white stays, and colours between are scaled (ISO 18619).
        """
        found = np.asarray(xyz_d65, dtype=np.float64) @ self.adapted.T
        if black == "bpc":
            found = self.black_xyz + found * (1.0 - self.black_xyz / self.white_xyz)
        return found

    def compensation(self) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3"]]:
        """Compute matrix and offset that map XYZ-D65 for "bpc" to equivalent XYZ-D65 for "absolute"."""
        back = np.linalg.inv(self.adapted)
        return back @ np.diag(1.0 - self.black_xyz / self.white_xyz) @ self.adapted, back @ self.black_xyz


def d65_xyz(seen_by: str) -> Float[np.ndarray, "3"]:
    """Compute XYZ of D65 for an observer, Y = 1; for that of 1931 as in pictures."""
    who = observer(seen_by)
    return PICTURE_WHITE_XYZ if who.name == observer("1931_2").name else who.white(illuminant("D65"))


def aimed(
    model: DisplayModel,
    white: Literal["d65", "native"] | tuple[float, float] = "d65",
    luminance: float | None = None,
    absolute: bool = True,
    seen_by: str = "1931_2",
) -> Aim:
    """Return the aim of a white by name or chromaticity (x, y), adapted to by Bradford.

    luminance : cd/m2 of white; None: the largest that the display shows of this white, or up to 1 % less if codes of
    eight bits are closer to it. absolute : True if the model is in cd/m2; else a luminance cannot be requested. seen_by
    : the observer of the model, whose D65 it is.

    Raises
    ------
    InputError : the display cannot show this white, or not as brightly.
    """
    if luminance is not None and not absolute:
        raise InputError(
            "readings without a luminance",
            field="--luminance",
            found=f"{luminance:g} cd/m2 asked for, readings relative to white = 100",
            expected="readings in cd/m2",
            hint="leave --luminance out: white is then as bright as can be",
        )
    native = model.xyz(np.ones((1, 3)))[0]
    of_name = native if white == "native" else d65_xyz(seen_by)
    xy = of_name[:2] / of_name.sum() if isinstance(white, str) else white
    x, y = float(xy[0]), float(xy[1])
    if not (0.0 < x < 1.0 and 0.0 < y < 1.0 and x + y < 1.0):
        raise InputError(
            "not a chromaticity", field="--white", found=f"{x:g},{y:g}", expected="x,y such as 0.3127,0.329"
        )
    unit = np.array([x / y, 1.0, (1.0 - x - y) / y])
    most = float(native[1]) if white == "native" else largest_luminance(model, unit)
    unit_words = "cd/m2" if absolute else "of the display's white = 100"
    if luminance is not None and not 0.0 < luminance <= most * (1.0 + 1e-4):
        raise InputError(
            "the display cannot show this white as brightly",
            field="--luminance",
            found=f"{luminance:g} cd/m2",
            expected=f"at most {most:.1f} cd/m2 of a white of x {x:.4f}, y {y:.4f}",
            hint="ask for less, or leave --luminance out",
        )
    y_white = luminance or (most if white == "native" else _whole_codes(model, unit, most))
    if not y_white > 0.01 * native[1]:
        raise InputError(
            "the display cannot show this white",
            file=None,
            field="--white",
            found=f"x {x:.4f}, y {y:.4f}: {y_white:.2g} of {native[1]:.4g} {unit_words} at most",
            expected=f"a white nearer to its own, x {native[0] / native.sum():.4f}, y {native[1] / native.sum():.4f}",
            hint="--white native, or --white d65",
        )
    # The display's own white is aimed at as such, to the last digit: its codes are then exactly full.
    target = native * (y_white / native[1]) if white == "native" else unit * y_white
    return aimed_at(model, target, white, absolute)


def aimed_at(
    model: DisplayModel,
    white_xyz: Float[np.ndarray, "3"],
    white: Literal["d65", "native"] | tuple[float, float],
    absolute: bool = True,
) -> Aim:
    """Return the aim of a white in cd/m2 that the display shows. white : as requested, for the words."""
    name = {"d65": "D65", "native": "the display's own"}[white] if isinstance(white, str) else "as asked for"
    x, y = white_xyz[:2] / white_xyz.sum()
    unit = "cd/m2" if absolute else "of the display's white = 100"
    adapted = adaptation_matrix(PICTURE_WHITE_XYZ, white_xyz / white_xyz[1]) * white_xyz[1]
    words = f"{name}, x {x:.4f}, y {y:.4f}, {white_xyz[1]:.1f} {unit}"
    return Aim(white_xyz, adapted, model.xyz(np.zeros((1, 3)))[0], words)


def _whole_codes(model: DisplayModel, unit_xyz: Float[np.ndarray, "3"], most: float) -> float:
    """Find the luminance of a white that is closest to codes of eight bits, since rounding is most visible on white."""
    native = model.xyz(np.ones((1, 3)))[0]
    levels = most * (1.0 - np.linspace(0.0, _GIVEN_UP, _STEPS))
    whites = unit_xyz * levels[:, None]
    codes, _ = Inverse(model, native).codes(whites)
    rounded = model.xyz(np.round(codes * 255.0) / 255.0)
    return float(levels[np.argmin(delta_e_xyz(whites, rounded, native))])


def largest_luminance(model: DisplayModel, unit_xyz: Float[np.ndarray, "3"]) -> float:
    """Find the largest luminance at which the display shows a white of Y = 1, by bisection."""
    native = model.xyz(np.ones((1, 3)))[0]
    inverse = Inverse(model, native)
    ends = np.array([0.0, native[1] * 1.05])
    for _ in range(_ROUNDS):
        levels = ends
        for _ in range(_HALVINGS_AT_ONCE):
            levels = np.insert(levels, np.arange(1, len(levels)), 0.5 * (levels[1:] + levels[:-1]))
        shown = inverse.codes(unit_xyz * levels[1:-1, None])[1] <= _SHOWN
        low, high = 0, len(levels) - 1
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if shown[middle - 1] else (low, middle)
        ends = levels[[low, high]]
    return float(ends[0])
