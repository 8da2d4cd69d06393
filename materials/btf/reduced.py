"""Reduction of BTFs of many wavelengths to a small spectral basis, before a fast form is fitted."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ...spectral.basis import SpectralBasis
from ...spectral.difference import delta_e_xyz
from .hemisphere import Hemisphere
from .images import BtfImages
from .metric import folding_of

# Lights that spectra are to be right under: daylight, tungsten, narrow bands, a blue LED with a phosphor, and sodium.
# Another sodium lamp, HP1, is among those that forms are judged under, and no fit sees it.
_LIGHTS = ("D65", "A", "FL11", "LED-B3", "HP2")
# Number of coefficients below which fewer gain nothing.
_FEW = 4
# ΔE94 that spectra may be off by at the 99th percentile, under each of those lights.
_OFF = 0.1
# Images, and texels of each, whose spectra the basis is found for.
_IMAGES, _TEXELS = 64, 64


@dataclass(frozen=True, eq=False)
class InBasis(BtfImages):
    """Images projected onto another basis."""

    images: BtfImages
    basis: SpectralBasis

    @property
    def views(self) -> Hemisphere:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Views of the images."""
        return self.images.views

    @property
    def lights(self) -> Hemisphere:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Lights of the images."""
        return self.images.lights

    @property
    def height(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """H."""
        return self.images.height

    @property
    def width(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """W."""
        return self.images.width

    @property
    def offset(self) -> float:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Offset of the images."""
        return self.images.offset

    @property
    def texel_mm(self) -> float | None:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Width of a texel of the images, mm."""
        return self.images.texel_mm

    @cached_property
    def _turned(self) -> Float[np.ndarray, "J K"]:
        return (self.images.basis.synthesis.T @ self.basis.analysis).astype(np.float32)

    def image(self, view: int, light: int) -> Float[np.ndarray, "H W K"]:
        """Implement `BtfImages.image`."""
        return np.asarray(self.images.image(view, light), dtype=np.float32) @ self._turned


def reduced(images: BtfImages, seed: int = 0, size: int | None = None) -> BtfImages:
    """Project images onto the smallest balanced basis that keeps spectra within ΔE94 0.1 under each of five lights.

    The bound is on the 99th percentile, over random texels of random images, each as bright as it is. Images are
    returned as they are if the basis saves nothing. size : number of coefficients, whatever their error; fewer if there
    are no more.
    """
    if size is None and images.basis.size <= _FEW:
        return images
    spectra, wavelengths = _drawn(images, seed), images.basis.wavelengths_nm
    weights = folding_of(_LIGHTS).weights(wavelengths)
    full = SpectralBasis.balanced(spectra, weights, wavelengths_nm=wavelengths)
    if size is not None:
        return InBasis(images, full.truncated(size))
    truth, whites = spectra @ weights, weights.sum(axis=0)
    for count in range(_FEW, min(full.size, images.basis.size)):
        basis = full.truncated(count)
        shown = spectra @ basis.analysis @ (basis.synthesis.T @ weights)
        each = (slice(start, start + 3) for start in range(0, len(whites), 3))
        off = [np.percentile(delta_e_xyz(truth[:, at], shown[:, at], whites[at]), 99) for at in each]
        if max(off) <= _OFF:
            return InBasis(images, basis)
    return images


def _drawn(images: BtfImages, seed: int) -> Float[np.ndarray, "n L"]:
    """Draw reflectances of random texels of random images."""
    draw = np.random.default_rng(seed)
    pairs = draw.permutation(len(images.views) * len(images.lights))[:_IMAGES]
    texels = draw.permutation(images.height * images.width)[:_TEXELS]
    found = [
        images.image(*divmod(int(pair), len(images.lights))).reshape(-1, images.basis.size)[texels] for pair in pairs
    ]
    return np.pi * images.basis.reconstruct(np.concatenate(found).astype(np.float64))
