"""Mean of a BTF's texels, in the directions that were measured: its appearance from afar."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...spectral.basis import SpectralBasis
from ...spectral.palette import Palette
from ..core.brdf import Brdf, eval_lit
from ..core.points import Points
from .hemisphere import Hemisphere


@dataclass(frozen=True, eq=False)
class MeanBtf(Brdf):
    """BTF from afar: the means over all texels, interpolated among three views and three lights as in `MeasuredBtf`."""

    isotropic = False

    views: Hemisphere
    lights: Hemisphere
    means: Float[np.ndarray, "V Lt J"]
    basis: SpectralBasis

    @property
    def wavelengths_nm(self) -> Float[np.ndarray, " L"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """(L,) of the basis."""
        return self.basis.wavelengths_nm

    def eval(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... L"]:
        """Implement `Brdf.eval`."""
        return eval_lit(self._lit, len(self.wavelengths_nm), wi, wo)

    @property
    def spectra(self) -> Float[np.ndarray, "J L"]:
        """Spectra that `scalars` are multiplied with."""
        return self.basis.synthesis.T

    def scalars(self, points: Points) -> Float[np.ndarray, "N J"]:
        """Evaluate f_r in coefficients, 1/sr."""
        return eval_lit(self._coefficients, self.basis.size, points.wi, points.wo)

    def _lit(self, wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N L"]:
        return self.basis.reconstruct(self._coefficients(wi, wo))

    def _coefficients(self, wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N J"]:
        seen, from_views = self.views.shares(wo)
        shone, from_lights = self.lights.shares(wi, falling=True)
        found = np.einsum("nv,nl,nvlj->nj", from_views, from_lights, self.means[seen[:, :, None], shone[:, None, :]])
        return found / wi[:, 2:]


def basis_of(palette: Palette) -> SpectralBasis:
    """Return the basis whose spectra a palette of one entry holds."""
    spectra = palette.samples[0].T
    return SpectralBasis("btf", palette.wavelengths_nm, np.linalg.pinv(spectra).T, spectra)
