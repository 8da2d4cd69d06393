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
    """Sample of H x W texels under L_t lights, from V views.

    Images are in the sample's plane, rectified: row 0 is at v = 1, as in every picture; x of the local frame is along u
    and y along v. They tile: positions beyond an edge wrap around.

    Attributes
    ----------
    views, lights : V and L_t directions, local frame.
    height, width : texels H and W.
    basis : of the J coefficients of each texel.
    texel_mm : width of a texel on the sample; None if it is not stated.
    offset : height h0, in texels, of the sample's surface above the plane that images were rectified to (negative below
        it): its texel (column, row) is seen from (theta, phi) at that less h0 tan(theta) (cos phi, -sin phi).
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
        """Return f_r cos(theta_i) of every texel as measured, 1/sr, coefficients in `basis`; float32, unregistered."""

    def texels(self, images: Int[np.ndarray, " n"], places: Int[np.ndarray, "n k"]) -> Float[np.ndarray, "n k J"]:
        """Read k texels of each of n images; float32. Suited to repeated reads of the same images.

        images : view * L_t + light, equal ones together. places : row-major indices of texels.
        """
        found = np.empty((*places.shape, self.basis.size), dtype=np.float32)
        for pair, here in self._runs(images):
            found[here] = self.image(*pair).reshape(-1, self.basis.size)[places[here]]
        return found

    @cached_property
    def reading_order(self) -> Int[np.ndarray, " n"]:
        """Rank of each of the V L_t images, numbered as in `texels`, in the preferred order of reading."""
        return np.arange(len(self.views) * len(self.lights))

    def _runs(self, images: Int[np.ndarray, " n"]) -> Iterator[tuple[tuple[int, int], slice]]:
        """Yield the view, the light and the slice of each run of equal image numbers."""
        begins = np.flatnonzero(np.diff(images, prepend=-1))
        for first, last in pairwise([*begins.tolist(), len(images)]):
            yield divmod(int(images[first]), len(self.lights)), slice(first, last)

    def registered(self, view: int, light: int) -> Float[np.ndarray, "H W J"]:
        """Return the image shifted back by its displacement (`offset`), linear between texels."""
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
    """Compute the displacement of the surface's texels in each view, columns and rows.

    -h0 tan(theta) (cos phi, -sin phi), with cos(theta) at least that of 85 degrees.
    """
    upright = np.maximum(views[..., 2:], np.cos(np.radians(85.0)))
    return offset * views[..., :2] / upright * (-1.0, 1.0)


@dataclass(frozen=True, eq=False)
class HeldImages(BtfImages):
    """BTF images in memory.

    values : (V,Lt,H,W,J) f_r cos(theta_i), 1/sr.

    Raises
    ------
    InputError : values whose shape does not match the views, lights and coefficients.
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
