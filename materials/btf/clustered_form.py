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
    """H x W texels, each a cluster's mean and weighted components; however these are kept."""

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
        """Cluster of each texel."""
        ...

    @property
    def weights(self) -> Int8[np.ndarray, "H W c"]:
        """Weights of its cluster's components, whole numbers."""
        ...

    def table(self) -> Float[np.ndarray, "k V Lt c1 J"]:
        """f_r cos(theta_i), 1/sr, of each cluster's mean, and of its components at a weight of 1; float32."""
        ...

    def coarser(self) -> tuple[TexelLevel, ...]:
        """Texels from farther and farther away (`mip_levels.coarser`); worked out when first asked for."""
        ...

    def stored(self) -> dict[str, Any]:
        """Return what a file stores, except the basis."""
        ...

    def decoded(self, texels: Int[np.ndarray, " n"]) -> Iterator[Float[np.ndarray, "V Lt J"]]:
        """Texels one after the other, by their numbers row by row: f_r cos(theta_i), 1/sr, of each view and light."""
        ...


def decoded(form: ClusteredForm, texels: Int[np.ndarray, " n"]) -> Iterator[Float[np.ndarray, "V Lt J"]]:
    """Implement `ClusteredForm.decoded`."""
    table, number = form.table(), form.number.ravel()
    weights = form.weights.reshape(len(number), -1).astype(np.float32)
    for texel in texels:
        mean, components = table[number[texel], ..., 0, :], table[number[texel], ..., 1:, :]
        yield mean + np.einsum("c,vlcj->vlj", weights[texel], components)
