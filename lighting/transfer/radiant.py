"""Matt sites of which some fluoresce: light from site to site as coefficients of radiance (`spectral.radiance_basis`).

Relative to a light, as `bounces.Regions` has them, coefficients cannot follow what changes its wavelength. Here every
light keeps its own, but they are of spectral power, Y = 1 of the perfect diffuser: c_0 = E_0 A^T D s, with the light
at its own resolution, and c_(k+1) = A^T D B G c_k, with D the Donaldson matrix of a region; what is seen is
cmf^T B c, the same for all lights.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from ...materials.factored.pack import FactoredBrdf
from ...materials.surface import Surface
from ...spectral.basis import SpectralBasis
from ...spectral.bispectral import Bispectral
from ...spectral.difference import delta_e_xyz
from ...spectral.errors import InputError
from ...spectral.observers import Observer
from ...spectral.palette import DonaldsonPalette
from ...spectral.radiance_basis import radiance_basis, radiance_operators
from ...spectral.spectrum import Spectrum
from ...spectral.wavelengths import common_wavelengths
from ..plan import SPECTRAL_SHARE

#: Surfaces on paths that a basis is made from: what further ones do lies among what these do.
BOUNCES = 3
# Surfaces that it is tried with.
_TRIED = 12
# Steps of its wavelengths, nm: lights have lines, and what excites a dye may end steeply.
_STEP_NM = 1.0


@dataclass(frozen=True, eq=False)
class RadiantRegions:
    """What matt sites send out of what they receive, at any wavelength.

    region (S,) : of each site, of R. surfaces : of each region; an ordinary one is `Bispectral.diagonal`.
    lights : K. basis : of radiances, such as `basis_for` makes it.

    Raises
    ------
    InputError : a surface from which, in some band, as much power leaves as arrives: light would never end.
    """

    region: Int[np.ndarray, " S"]
    surfaces: tuple[Bispectral, ...]
    lights: tuple[Spectrum, ...]
    observer: Observer
    basis: SpectralBasis

    def __post_init__(self) -> None:
        if not self.largest < 1.0:
            found, words = f"{self.largest:.3g} of the power of a band", "below 1 at every wavelength"
            raise InputError("surfaces that send out what they cannot", field="surfaces", found=found, expected=words)

    @property
    def largest(self) -> float:
        """The most of its power that any light keeps at a site."""
        return max((float(surface.power_yield.max()) for surface in self.surfaces), default=0.0)

    @cached_property
    def _first(self) -> Float[np.ndarray, "R K J"]:
        """Of each region under each light, 1 lux."""
        nm, seen_by = self.basis.wavelengths_nm, self.observer
        each = [[one.radiance(light, nm) / seen_by.luminous(light) for light in self.lights] for one in self.surfaces]
        return self.basis.project(np.array(each))

    @cached_property
    def _operators(self) -> Float[np.ndarray, "R J J"]:
        matrices = np.stack([surface.on(self.basis.wavelengths_nm) for surface in self.surfaces])
        return matrices if self.basis.is_sampled else radiance_operators(self.basis, matrices)

    def first(self, lux: Float[np.ndarray, "S K"]) -> Float[np.ndarray, "S K J"]:
        """c_0 of an illuminance of each of the K lights."""
        return lux[:, :, None] * self._first[self.region]

    def reflected(self, arriving: Float[np.ndarray, "S K J"]) -> Float[np.ndarray, "S K J"]:
        """What each site sends out of what arrives."""
        found = np.empty_like(arriving)
        for number, operator in enumerate(self._operators):
            mine = np.flatnonzero(self.region == number)
            found[mine] = arriving[mine] @ operator.T
        return found

    def folds(self) -> list[Float[np.ndarray, "3 J"]]:
        """From coefficients to XYZ, one for each light, all alike."""
        seen = self.observer.sensitivity(self.basis.wavelengths_nm)
        fold = seen if self.basis.is_sampled else seen @ self.basis.synthesis
        return [fold] * len(self.lights)

    def most_y(
        self, coefficients: Float[np.ndarray, "S K J"], seen_y: Float[np.ndarray, " S"], reference_lux: float
    ) -> Float[np.ndarray, " S"]:
        """Y that this light could have if all of its power went where eyes see best: a dye may bring it there."""
        nm = self.basis.wavelengths_nm
        widths = np.gradient(nm)
        power = widths if self.basis.is_sampled else widths @ self.basis.synthesis
        best = float((self.observer.sensitivity(nm)[1] / widths).max())
        return best / reference_lux * (coefficients.sum(axis=1) @ power)


def basis_for(
    surfaces: Sequence[Bispectral],
    lights: Sequence[Spectrum],
    observer: Observer,
    size: int | None = None,
    bounces: int = BOUNCES,
) -> SpectralBasis:
    """The basis of radiances that some surfaces make of some lights: see `radiance_basis`."""
    grids = [grid for one in surfaces for grid in (one.wavelengths_in_nm, one.wavelengths_out_nm)]
    # As far as the observer sees: what was not measured there counts as what is next to it, as everywhere.
    common = common_wavelengths([*grids, observer.wavelengths_nm])
    nm = np.arange(common[0], common[-1] + 0.5 * _STEP_NM, _STEP_NM)
    matrices = np.stack([surface.on(nm) for surface in surfaces])
    powers = np.stack([light.averaged(nm).samples for light in lights])
    return radiance_basis(matrices, powers, observer.sensitivity(nm), nm, bounces=bounces, size=size)


def planned_basis(surfaces: Sequence[Bispectral], lights: Sequence[Spectrum], observer: Observer) -> SpectralBasis:
    """The smallest of `basis_for` in which light over two surfaces is seen over a third one within ΔE94 0.1, and light
    over one over a second; of many surfaces some, at random.
    """
    full = basis_for(surfaces, lights, observer)
    nm, seen = full.wavelengths_nm, observer.sensitivity(full.wavelengths_nm)
    chosen = np.random.default_rng(2).permutation(len(surfaces))[:_TRIED]
    matrices = np.stack([surfaces[number].on(nm) for number in np.sort(chosen)])
    receivers = np.concatenate([seen[None], seen @ matrices])
    cases = []
    for light in lights:
        unit = observer.luminous(light)
        once = np.array([one.radiance(light, nm) for one in surfaces])[np.sort(chosen)] / unit
        cases.append((once, observer.white(light)))

    def colours(radiances: np.ndarray) -> np.ndarray:
        return np.einsum("rcl,...l->...rc", receivers, radiances, optimize=True)

    truths = [(colours(once), colours(np.einsum("nol,ml->nmo", matrices, once, optimize=True))) for once, _ in cases]
    for size in range(1, full.size):
        basis = full.truncated(size)
        worst = 0.0
        for (once, white), (first, second) in zip(cases, truths, strict=True):
            kept = basis.reconstruct(basis.project(once))
            twice = basis.reconstruct(basis.project(np.einsum("nol,ml->nmo", matrices, kept, optimize=True)))
            for truth, shown in ((first, kept), (second, twice)):
                worst = max(worst, float(delta_e_xyz(truth, colours(shown), white).max()))
        if worst <= SPECTRAL_SHARE:
            return basis
    return full


def donaldson(surface: Surface) -> Bispectral | None:
    """The Donaldson matrix of a matt surface that fluoresces, original or fast form; None of any other."""
    if surface.bispectral is None and isinstance(surface, FactoredBrdf):
        (palette, *_) = (pack.palette for pack in surface.packs)
        return palette.bispectral if isinstance(palette, DonaldsonPalette) else None
    return surface.bispectral


def fluoresces(surfaces: Iterable[Surface]) -> bool:
    """Whether any does."""
    return any(donaldson(one) is not None for one in surfaces)
