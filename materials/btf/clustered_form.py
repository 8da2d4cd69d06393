"""Clustered forms of BTFs: clusters of texels, each with a mean and components over views and lights."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int, Int8, UInt8

from ...spectral.basis import SpectralBasis
from .hemisphere import Hemisphere
from .mip_levels import TexelLevel


@runtime_checkable
class ClusteredForm(Protocol):
    """H x W texels, each the mean of its cluster plus weighted components; the storage is up to the implementation."""

    @property
    def views(self) -> Hemisphere:
        """V directions."""
        ...

    @property
    def lights(self) -> Hemisphere:
        """Lt directions."""
        ...

    @property
    def basis(self) -> SpectralBasis:
        """Basis of the J coefficients."""
        ...

    @property
    def number(self) -> UInt8[np.ndarray, "H W"]:
        """Index of each texel's cluster."""
        ...

    @property
    def weights(self) -> Int8[np.ndarray, "H W c"]:
        """Integer weights of the components of each texel's cluster."""
        ...

    def table(self) -> Float[np.ndarray, "k V Lt c1 J"]:
        """Return f_r cos(theta_i), 1/sr, of each cluster's mean and of its components at weight 1; float32."""
        ...

    def coarser(self) -> tuple[TexelLevel, ...]:
        """Return the coarser mip levels (`mip_levels.coarser`), computed on first use."""
        ...

    def stored(self) -> dict[str, Any]:
        """Return the stored fields, without the basis."""
        ...

    def decoded(self, texels: Int[np.ndarray, " n"]) -> Iterator[Float[np.ndarray, "V Lt J"]]:
        """Yield f_r cos(theta_i), 1/sr, for every view and light, of each texel; texels are row-major indices."""
        ...


def decoded(form: ClusteredForm, texels: Int[np.ndarray, " n"]) -> Iterator[Float[np.ndarray, "V Lt J"]]:
    """Implement `ClusteredForm.decoded`."""
    table, number = form.table(), form.number.ravel()
    weights = form.weights.reshape(len(number), -1).astype(np.float32)
    for texel in texels:
        mean, components = table[number[texel], ..., 0, :], table[number[texel], ..., 1:, :]
        yield mean + np.einsum("c,vlcj->vlj", weights[texel], components)
