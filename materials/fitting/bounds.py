"""The bounds that packs keep everywhere above the horizon: hardly below black, and not far above the original.

A sum of products follows the original where pictures look; elsewhere nothing holds its terms, which may cancel there
and leave light of any colour, or less than none. Places where packs leave the bounds are searched for over both
hemispheres, downhill from the worst pairs met, at every wavelength, and become guards of the fit
(`SeenSamples.guarded`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int

from ...spectral.projection import projection_matrix
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..brdf import Brdf
from ..directions import angles, io_angles, io_from_half_difference, spherical
from ..factors import FactorPack
from .seen import everywhere_angles

#: Packs shade to no less than this, where a white diffuser facing the light is 1.
LOWEST = -0.02
#: Packs shade to no more than so many times the original's largest value anywhere at the same wavelength.
LARGEST = 2.0
# A fit keeps within this share of both bounds: the rest is for rounding, half precision and what the search missed.
_KEPT = 0.6
# An original darker than this everywhere at a wavelength is taken for as bright.
_DARKEST = 0.02
# Pairs looked at, of an isotropic and of another surface, and those of them from which the search goes downhill.
_PAIRS, _PAIRS_TURNED, _DOWNHILL = 80_000, 200_000, 400
# First step downhill, radians, and how often it is halved.
_STEP, _HALVINGS = 0.04, 6
# Pairs closer than this in all angles are one place, radians; and the most places that are told.
_PLACE, _PLACES = 0.05, 300
_LOW, _HIGH = ("low",), ("high",)
_EDGE = 0.5 * np.pi - 1e-4


@dataclass(frozen=True)
class Extremes:
    """What packs shade to at most and at least: pi f_r cos(theta_i), at any wavelength, over both hemispheres.

    lowest : the lowest value, 0 where none is negative. ratio : the largest over the original's largest anywhere at the
    same wavelength.
    """

    lowest: float
    ratio: float

    @property
    def within(self) -> bool:
        """Whether both bounds are kept."""
        return self.lowest >= LOWEST and self.ratio <= LARGEST


@dataclass(frozen=True, eq=False)
class Broken:
    """Pairs where packs go beyond their share of the bounds.

    wavelength : where among the working wavelengths they do so most. low : whether it is the lower bound.
    """

    wi: Float[np.ndarray, "N 3"]
    wo: Float[np.ndarray, "N 3"]
    wavelength: Int[np.ndarray, " N"]
    low: Bool[np.ndarray, " N"]

    def __len__(self) -> int:
        return len(self.wi)


@dataclass(frozen=True, eq=False)
class Bounds:
    """largest (L,): of the original at each working wavelength, anywhere."""

    largest: Float[np.ndarray, " L"]
    isotropic: bool

    @classmethod
    def of(cls, brdf: Brdf) -> Bounds:
        """Looks for the original's largest values."""
        wi, wo = _pairs(_angles(_PAIRS // 8, brdf.isotropic))
        values = np.pi * working_spectra(brdf, wi, wo)
        return cls(np.maximum(values.max(axis=0), _DARKEST), brdf.isotropic)

    def extremes(self, packs: tuple[FactorPack, ...]) -> Extremes:
        """The lowest and the largest value that packs shade to."""
        low, high = (_shaded(packs, *_pairs(self._worst(packs, sides))) for sides in (_LOW, _HIGH))
        return Extremes(float(min(low.min(), 0.0)), float(np.max(high / self.largest)))

    def broken(self, packs: tuple[FactorPack, ...]) -> Broken:
        """Where packs go beyond the share of the bounds that a fit keeps, the worst pair of each place."""
        found = np.concatenate([self._worst(packs, sides) for sides in (_LOW, _HIGH)])
        wi, wo = _pairs(found)
        shaded = _shaded(packs, wi, wo)
        excess = self._excess(shaded, _LOW + _HIGH)
        worst = excess.max(axis=1)
        order = np.argsort(-worst, kind="stable")
        order = order[worst[order] > _KEPT]
        _, first = np.unique(np.round(found[order] / _PLACE), axis=0, return_index=True)
        kept = order[np.sort(first)[:_PLACES]]
        at = np.argmax(excess[kept], axis=1)
        return Broken(wi[kept], wo[kept], at, shaded[kept, at] < 0.0)

    def everywhere(self, count: int) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
        """wi and wo of about `count` pairs among those that are looked at."""
        found = _angles(_PAIRS if self.isotropic else _PAIRS_TURNED, self.isotropic)
        return _pairs(found[:: max(1, len(found) // count)])

    @property
    def limits(self) -> Float[np.ndarray, "2 L"]:
        """What a fit keeps between: the lowest and the largest pi f_r cos(theta_i) at each working wavelength.

        A little inside of what `broken` tells, so that a place which is mended is not found again.
        """
        inside = 0.8 * _KEPT
        return np.stack([np.full_like(self.largest, inside * LOWEST), inside * LARGEST * self.largest])

    def _worst(self, packs: tuple[FactorPack, ...], sides: tuple[str, ...]) -> Float[np.ndarray, "N A"]:
        """The worst pairs met, and where going downhill from them led."""
        angles = _angles(_PAIRS if self.isotropic else _PAIRS_TURNED, self.isotropic)
        excess = self._worst_excess(packs, angles, sides)
        angles = angles[np.argsort(-excess, kind="stable")[:_DOWNHILL]]
        excess = self._worst_excess(packs, angles, sides)
        step = _STEP
        for _ in range(_HALVINGS):
            for axis in range(angles.shape[1]):
                for sign in (step, -step):
                    moved = angles.copy()
                    moved[:, axis] += sign
                    moved[:, :2] = np.clip(moved[:, :2], 0.0, _EDGE)
                    found = self._worst_excess(packs, moved, sides)
                    better = found > excess
                    angles[better], excess[better] = moved[better], found[better]
            step *= 0.5
        return angles

    def _worst_excess(self, packs: tuple[FactorPack, ...], angles: np.ndarray, sides: tuple[str, ...]) -> np.ndarray:
        out = np.empty(len(angles))
        for start in range(0, len(angles), 8192):
            rows = slice(start, start + 8192)
            out[rows] = self._excess(_shaded(packs, *_pairs(angles[rows])), sides).max(axis=1)
        return out

    def _excess(self, shaded: Float[np.ndarray, "N L"], sides: tuple[str, ...]) -> Float[np.ndarray, "N L"]:
        """1 at the bounds of these sides."""
        beyond = {"low": LOWEST, "high": LARGEST * self.largest}
        return np.max([shaded / beyond[side] for side in sides], axis=0)


def working_spectra(brdf: Brdf, wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N L"]:
    """f_r cos(theta_i) on the working wavelengths, 1/sr."""
    values = brdf.eval(wi, wo) * wi[:, 2:]
    if np.array_equal(brdf.wavelengths_nm, WORKING_WAVELENGTHS_NM):
        return values
    return values @ projection_matrix(brdf.wavelengths_nm, WORKING_WAVELENGTHS_NM).T


def _shaded(packs: tuple[FactorPack, ...], wi: np.ndarray, wo: np.ndarray) -> Float[np.ndarray, "N L"]:
    """pi f_r cos(theta_i) at the working wavelengths."""
    spectra = [np.pi * pack.basis.reconstruct(pack.spectral) for pack in packs]
    return sum((pack.geometry(wi, wo) @ spectrum for pack, spectrum in zip(packs, spectra, strict=True)), np.zeros(1))


@lru_cache(maxsize=4)
def _angles(count: int, isotropic: bool) -> Float[np.ndarray, "N A"]:
    """theta_i, theta_o, phi_o - phi_i and, unless isotropic, phi_i."""
    everywhere = np.stack(everywhere_angles(count, 1, isotropic)[: 3 if isotropic else 4], axis=-1)
    # A highlight's own cells are far smaller than what lies between these: about the mirror direction at every scale.
    tilts, turns = np.concatenate([[0.0], np.geomspace(1e-5, 0.2, 40)]), np.linspace(0.0, np.pi, 5)
    around = [0.0] if isotropic else np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    grid = np.meshgrid(tilts, np.linspace(0.0, _EDGE, 64), turns, around, indexing="ij")
    wi, wo = (side.reshape(-1, 3) for side in io_from_half_difference(*grid))
    lit = (wi[:, 2] > 1e-4) & (wo[:, 2] > 1e-4)
    theta_i, theta_o, phi = io_angles(wi[lit], wo[lit])
    ridge = np.stack([theta_i, theta_o, phi, *(() if isotropic else (angles(wi[lit])[1],))], axis=-1)
    return np.concatenate([everywhere, ridge])


def _pairs(angles: Float[np.ndarray, "N A"]) -> tuple[np.ndarray, np.ndarray]:
    phi_i = angles[:, 3] if angles.shape[1] == 4 else np.zeros(len(angles))
    return spherical(angles[:, 0], phi_i), spherical(angles[:, 1], phi_i + angles[:, 2])
