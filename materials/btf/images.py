"""What a BTF is before any form is found for it: one image of the sample for each view and light."""

from __future__ import annotations

import abc
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...spectral.basis import SpectralBasis
from ...spectral.errors import InputError
from .hemisphere import Hemisphere


class BtfImages(abc.ABC):
    """A sample of H x W texels under L_t lights, from V views.

    Images are in the sample's plane, rectified: row 0 is at v = 1, as in every picture; x of the local frame is along u
    and y along v. They tile: what lies beyond an edge goes on from the other.

    Attributes
    ----------
    views, lights : V and L_t directions, local frame.
    height, width : texels H and W.
    basis : of the J coefficients that each texel has.
    texel_mm : what a texel is wide on the sample; None where nobody said.
    offset : texels h0 by which the sample's surface stands above the plane that images were rectified to (below
        it where negative): its texel (column, row) is seen from (theta, phi) at that less h0 tan(theta) (cos phi,
        -sin phi).
    """

    views: Hemisphere
    lights: Hemisphere
    height: int
    width: int
    basis: SpectralBasis
    texel_mm: float | None = None
    offset: float = 0.0

    @abc.abstractmethod
    def image(self, view: int, light: int) -> Float[np.ndarray, "H W J"]:
        """f_r cos(theta_i) of every texel as measured, 1/sr, coefficients in `basis`; float32, not registered."""

    def registered(self, view: int, light: int) -> Float[np.ndarray, "H W J"]:
        """The image moved back by what `offset` displaces it, to the nearest texel, so that nothing is blurred."""
        across, down = displaced(self.views.directions[view], self.offset)
        return np.roll(self.image(view, light), (-down, -across), axis=(0, 1))


def displaced(view: Float[np.ndarray, "3"], offset: float) -> tuple[int, int]:
    """Columns and rows, to the nearest whole one, by which a view shows the surface's texels beside where they are.

    Raises
    ------
    InputError : a displaced view from the horizon.
    """
    if offset == 0.0:
        return 0, 0
    if view[2] <= 0.0:
        found = view.round(6).tolist()
        raise InputError("a view from the horizon cannot be registered", field="views", found=found, expected="z > 0")
    # Half a texel goes the same way whatever rounding made of it.
    across, down = (int(np.floor(offset * sine / view[2] + 0.5 + 1e-9)) for sine in (view[0], -view[1]))
    return -across, -down


@dataclass(frozen=True, eq=False)
class HeldImages(BtfImages):
    """All images in memory.

    values : (V,Lt,H,W,J) f_r cos(theta_i), 1/sr.

    Raises
    ------
    InputError : the values are as many as views, lights and coefficients in no axis.
    """

    views: Hemisphere
    lights: Hemisphere
    values: Float[np.ndarray, "V Lt H W J"]
    basis: SpectralBasis
    texel_mm: float | None = None
    offset: float = 0.0

    def __post_init__(self) -> None:
        expected = (len(self.views), len(self.lights), self.basis.size)
        shape = self.values.shape
        if self.values.ndim != 5 or (shape[0], shape[1], shape[4]) != expected or not self.values.size:
            words = f"({expected[0]}, {expected[1]}, H, W, {expected[2]})"
            raise InputError("images do not fit their directions", field="values", found=shape, expected=words)

    @property
    def height(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """H."""
        return self.values.shape[2]

    @property
    def width(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """W."""
        return self.values.shape[3]

    def image(self, view: int, light: int) -> Float[np.ndarray, "H W J"]:
        """See `BtfImages.image`."""
        return np.asarray(self.values[view, light], dtype=np.float32)
