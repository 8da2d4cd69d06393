"""Small basis of radiances for interreflection with fluorescence, by balanced truncation."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...materials.core.surface import Surface
from ...materials.factored.pack import FactoredBrdf
from ...spectral.basis import SpectralBasis
from ...spectral.bispectral import Bispectral
from ...spectral.difference import delta_e_xyz
from ...spectral.observers import Observer
from ...spectral.palette import DonaldsonPalette
from ...spectral.radiance_basis import radiance_basis, sent_by
from ...spectral.spectrum import Spectrum
from ...spectral.wavelengths import common_wavelengths
from ..plan import SPECTRAL_SHARE

#: Number of surfaces on the paths that a basis is made from; further ones stay in the same space.
BOUNCES = 3
# Number of surfaces for testing a basis.
_TRIED = 12
# Wavelength step, nm, for line spectra and steep excitation spectra.
_STEP_NM = 1.0


def basis_for(
    surfaces: Sequence[Bispectral],
    lights: Sequence[Spectrum],
    observer: Observer,
    size: int | None = None,
) -> SpectralBasis:
    """Return the basis of radiances that surfaces reflect or emit under lights: see `radiance_basis`."""
    nm = _wavelengths(surfaces, observer)
    matrices = [surface.narrow(nm) for surface in surfaces]
    powers = np.stack([light.averaged(nm).samples for light in lights])
    return radiance_basis(matrices, powers, observer.sensitivity(nm), nm, bounces=BOUNCES, size=size)


def planned_basis(
    surfaces: Sequence[Bispectral],
    lights: Sequence[Spectrum],
    observer: Observer,
    before: SpectralBasis | None = None,
) -> SpectralBasis:
    """Return the smallest truncation of `basis_for` that reproduces light after one and after two surfaces, seen
    directly and over one more, within ΔE94 0.1; of many surfaces a random subset is tested. before : basis that is
    returned if it does.
    """
    nm = _wavelengths(surfaces, observer)
    tried = _Tried.of(surfaces, lights, observer, nm)
    if before is not None and np.array_equal(before.wavelengths_nm, nm) and tried.error(before) <= SPECTRAL_SHARE:
        return before
    full = basis_for(surfaces, lights, observer)
    for size in range(1, full.size):
        basis = full.truncated(size)
        if tried.error(basis) <= SPECTRAL_SHARE:
            return basis
    return full


def _wavelengths(surfaces: Sequence[Bispectral], observer: Observer) -> Float[np.ndarray, " L"]:
    grids = [grid for one in surfaces for grid in (one.wavelengths_in_nm, one.wavelengths_out_nm)]
    # Range of the observer; spectra are extended by their end values there, as everywhere.
    common = common_wavelengths([*grids, observer.wavelengths_nm])
    return np.arange(common[0], common[-1] + 0.5 * _STEP_NM, _STEP_NM)


@dataclass(frozen=True, eq=False)
class _Tried:
    """Test cases of a basis: surfaces, sensitivities over each of them, and for each light the radiances after one
    surface, with the white.
    """

    matrices: list[np.ndarray]
    receivers: Float[np.ndarray, "r c L"]
    cases: list[tuple[Float[np.ndarray, "n L"], Float[np.ndarray, "3"]]]

    @classmethod
    def of(
        cls,
        surfaces: Sequence[Bispectral],
        lights: Sequence[Spectrum],
        observer: Observer,
        wavelengths_nm: Float[np.ndarray, " L"],
    ) -> _Tried:
        order = np.random.default_rng(2).permutation(len(surfaces)).tolist()
        # Fluorescent surfaces first.
        chosen = sorted(sorted(order, key=lambda number: surfaces[number].keeps_wavelengths)[:_TRIED])
        matrices = [surfaces[number].narrow(wavelengths_nm) for number in chosen]
        seen = observer.sensitivity(wavelengths_nm)
        receivers = np.stack([seen, *(sent_by(matrix.T, seen) for matrix in matrices)])
        cases = []
        for light in lights:
            power = light.averaged(wavelengths_nm).samples
            once = [
                matrix * power if matrix.ndim == 1 else surfaces[number].radiance(light, wavelengths_nm)
                for number, matrix in zip(chosen, matrices, strict=True)
            ]
            cases.append((np.stack(once) / observer.luminous(light), observer.white(light)))
        return cls(matrices, receivers, cases)

    def error(self, basis: SpectralBasis) -> float:
        """Return the largest ΔE94 of a basis over all cases."""
        worst = 0.0
        for once, white in self.cases:
            twice = self._after(once)
            kept = basis.reconstruct(basis.project(once))
            again = basis.reconstruct(basis.project(self._after(kept)))
            for truth, shown in ((once, kept), (twice, again)):
                worst = max(worst, float(delta_e_xyz(self._colours(truth), self._colours(shown), white).max()))
        return worst

    def _after(self, radiances: Float[np.ndarray, "m L"]) -> Float[np.ndarray, "nm L"]:
        return np.concatenate([sent_by(matrix, radiances) for matrix in self.matrices])

    def _colours(self, radiances: Float[np.ndarray, "k L"]) -> Float[np.ndarray, "k r c"]:
        return np.einsum("rcl,kl->krc", self.receivers, radiances, optimize=True)


def donaldson(surface: Surface) -> Bispectral | None:
    """Return the Donaldson matrix of a fluorescent diffuse surface, original or fast form; None for any other."""
    if surface.bispectral is None and isinstance(surface, FactoredBrdf):
        (palette, *_) = (pack.palette for pack in surface.packs)
        return palette.bispectral if isinstance(palette, DonaldsonPalette) else None
    return surface.bispectral


def fluoresces(surfaces: Iterable[Surface]) -> bool:
    """Return whether any surface fluoresces."""
    return any(donaldson(one) is not None for one in surfaces)
