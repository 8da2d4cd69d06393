"""A small basis of radiances for light between surfaces of which some fluoresce, by balanced truncation."""

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

#: Surfaces on paths that a basis is made from: what further ones do lies among what these do.
BOUNCES = 3
# Surfaces that it is tried with.
_TRIED = 12
# Steps of its wavelengths, nm: lights have lines, and what excites a dye may end steeply.
_STEP_NM = 1.0


def basis_for(
    surfaces: Sequence[Bispectral],
    lights: Sequence[Spectrum],
    observer: Observer,
    size: int | None = None,
) -> SpectralBasis:
    """Return the basis of radiances that some surfaces make of some lights: see `radiance_basis`."""
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
    """Return the smallest of `basis_for` in which light over two surfaces is seen over a third one within ΔE94 0.1, and
    light over one over a second; of many surfaces some, at random. before : a basis that is kept if it does so.
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
    # As far as the observer sees: what was not measured there counts as what is next to it, as everywhere.
    common = common_wavelengths([*grids, observer.wavelengths_nm])
    return np.arange(common[0], common[-1] + 0.5 * _STEP_NM, _STEP_NM)


@dataclass(frozen=True, eq=False)
class _Tried:
    """Surfaces that a basis is tried with, what observers see over them, and what there is after one of them, with the
    white, of each light.
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
        """Return the largest ΔE94."""
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
    """Return the Donaldson matrix of a matt surface that fluoresces, original or fast form; None of any other."""
    if surface.bispectral is None and isinstance(surface, FactoredBrdf):
        (palette, *_) = (pack.palette for pack in surface.packs)
        return palette.bispectral if isinstance(palette, DonaldsonPalette) else None
    return surface.bispectral


def fluoresces(surfaces: Iterable[Surface]) -> bool:
    """Return whether any does."""
    return any(donaldson(one) is not None for one in surfaces)
