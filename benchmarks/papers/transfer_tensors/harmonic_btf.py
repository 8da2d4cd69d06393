"""BTFs in light that is told in spherical harmonics of each point's own frame (Mueller, Meseth and Klein 2004, eq. 2).

Each view of each mean and component of a BTF's clusters has harmonics of its own; what a texel makes of light is a dot
product of both, and of the spectra: those of the BTF, those that light has met on its way, and the light's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ....materials.btf.gathering import BtfGathering
from ....materials.btf.hemisphere import Hemisphere
from ....materials.btf.light_basis import hats_at, spread
from ....spectral.basis import SpectralBasis
from ....spectral.observers import Observer
from ....spectral.spectrum import Spectrum
from ....spectral.wavelengths import interpolation_matrix
from ..harmonics import harmonics

# Directions that hats are written in harmonics by; points at once.
_DIRECTIONS, _BLOCK = 20000, 2048


@dataclass(frozen=True, eq=False)
class HarmonicBtf(BtfGathering):
    """A BTF whose light basis are 25 harmonics."""

    @cached_property
    def analysis(self) -> Float[np.ndarray, "Lt B"]:
        """Weight of each measured light in each harmonic."""
        return harmonic_weights(self.texels.form.lights)

    def xyz(
        self,
        uv: Float[np.ndarray, "N 2"],
        wo: Float[np.ndarray, "N 3"],
        arriving: Float[np.ndarray, "N K J B"],
        product: Float[np.ndarray, "K P J 3"],
    ) -> Float[np.ndarray, "N 3"]:
        """Compute the XYZ that points send to a viewer.

        uv, wo : on the texture, and to the viewer in the frames that `arriving` is told in (`HarmonicTransfer.lit`).
        product : of `products`.
        """
        found = np.empty((len(uv), 3))
        for start in range(0, len(uv), _BLOCK):
            rows = slice(start, start + _BLOCK)
            met = np.einsum("nbp,nkjb->nkpj", self.terms(uv[rows], wo[rows]), arriving[rows], optimize=True)
            found[rows] = np.einsum("nkpj,kpjc->nc", met, product, optimize=True)
        return found


def harmonic_weights(lights: Hemisphere) -> Float[np.ndarray, "Lt B"]:
    """Project each measured light's hat onto 25 harmonics; nothing from below the horizon."""
    around = spread(_DIRECTIONS, -1.0)
    return hats_at(lights, around).T @ harmonics(around) * (4.0 * np.pi / len(around))


def products(
    of_btf: SpectralBasis,
    of_light: SpectralBasis,
    spectra: Sequence[Spectrum],
    observer: Observer,
    scale: float,
) -> Float[np.ndarray, "K P J 3"]:
    """XYZ of each coefficient of a BTF times each of light on its way, under each light's spectrum, times `scale`."""
    nm = of_btf.wavelengths_nm
    on_btf = of_btf.reconstruct(np.eye(of_btf.size))
    on_light = of_light.reconstruct(np.eye(of_light.size))
    if not np.array_equal(of_light.wavelengths_nm, nm):
        on_light = on_light @ interpolation_matrix(of_light.wavelengths_nm, nm).T
    weights = np.stack([observer.weights(spectrum, nm) for spectrum in spectra])
    return scale * np.einsum("pl,jl,kcl->kpjc", on_btf, on_light, weights, optimize=True)
