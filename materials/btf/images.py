"""Images of a BTF: one image of the sample for each view and light."""

from __future__ import annotations

import abc
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from ...runtime.errors import InputError
from ...spectral.basis import SpectralBasis
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

    def texels(self, images: Int[np.ndarray, " n"], places: Int[np.ndarray, "n k"]) -> Float[np.ndarray, "n k J"]:
        """K texels, counted row by row, of each of n images, numbered view * L_t + light, equal ones together; float32.

        For who comes back to the same images with others.
        """
        found = np.empty((*places.shape, self.basis.size), dtype=np.float32)
        for pair, here in self._runs(images):
            found[here] = self.image(*pair).reshape(-1, self.basis.size)[places[here]]
        return found

    @cached_property
    def reading_order(self) -> Int[np.ndarray, " n"]:
        """Place of each of the V L_t images in the order that they are best read in, numbered as of `texels`."""
        return np.arange(len(self.views) * len(self.lights))

    def _runs(self, images: Int[np.ndarray, " n"]) -> Iterator[tuple[tuple[int, int], slice]]:
        """Yield the view and light of equal numbers that stand together, and where."""
        begins = np.flatnonzero(np.diff(images, prepend=-1))
        for first, last in pairwise([*begins.tolist(), len(images)]):
            yield divmod(int(images[first]), len(self.lights)), slice(first, last)

    def registered(self, view: int, light: int) -> Float[np.ndarray, "H W J"]:
        """Return the image moved back by what `offset` displaces it, linear between texels."""
        image = self.image(view, light)
        if self.offset == 0.0:
            return image
        across, down = displacement(self.views.directions[view], self.offset)
        column, row = int(np.floor(across)), int(np.floor(down))
        right, below = np.float32(across - column), np.float32(down - row)
        found = np.roll(image, (-row, -column), axis=(0, 1))
        if right:
            found = found + right * (np.roll(found, -1, axis=1) - found)
        return found + below * (np.roll(found, -1, axis=0) - found) if below else found


def displacement(views: Float[np.ndarray, "*n 3"], offset: float) -> Float[np.ndarray, "*n 2"]:
    """Columns and rows by which views show the surface's texels beside where they are.

    -h0 tan(theta) (cos phi, -sin phi); a view at the horizon is taken as at 85 degrees.
    """
    upright = np.maximum(views[..., 2:], np.cos(np.radians(85.0)))
    return offset * views[..., :2] / upright * (-1.0, 1.0)


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
        """Implement `BtfImages.image`."""
        return np.asarray(self.values[view, light], dtype=np.float32)
