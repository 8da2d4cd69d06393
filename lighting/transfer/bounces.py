"""Interreflection by Neumann series: coefficients of light, bounce by bounce, until the remainder is invisible.

With radiosity B (S sites, J coefficients relative to a light's spectrum), c_0 = rho E_0 and c_(k+1) = O G c_k, where G
is the irradiance operator (`operator`) and O = A^T diag(rho) B the reflectance of a region in the basis
(`SpectralBasis.operator`). The interreflection of Sun et al. 2007 (eq. 4 and on) stops after two bounces, the second of
which is diffuse. Here bounces are added while the remainder exceeds a tolerance in ΔE94.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.difference import delta_e_xyz
from .regions import RadiantRegions, Regions

#: Largest ΔE94 of any site that omitted bounces may cause.
ENOUGH = 0.1
#: Limit on the number of bounces; a closed box of reflectance 0.99 takes some 600.
MOST = 2000
# Stride of the sites that are tested first.
_FEW = 16


@dataclass(frozen=True, eq=False)
class Interreflection:
    """Radiosity of S sites.

    bounces : number of bounces. first, all (S,K,J) : radiosity before any bounce, and after all of them: illuminance,
        lux, of each light's spectrum that gives a perfect diffuser the same radiosity.
    left : estimate of the largest ΔE94 of any site by further bounces; bound : upper bound of the Y that they add,
        relative to the reference illuminance.
    """

    bounces: int
    first: Float[np.ndarray, "S K J"]
    all: Float[np.ndarray, "S K J"]
    left: float
    bound: float

    @property
    def indirect(self) -> Float[np.ndarray, "S K J"]:
        """Radiosity added by bounces."""
        return self.all - self.first


def interreflected(
    operator: Any,
    regions: Regions | RadiantRegions,
    lux: Float[np.ndarray, "S K"],
    folds: Sequence[Float[np.ndarray, "3 J"]],
    white: Float[np.ndarray, "3"],
    reference_lux: float,
    enough: float = ENOUGH,
    most: int = MOST,
    sends: Float[np.ndarray, " S"] | None = None,
    exactly: int | None = None,
) -> Interreflection:
    """Solve for interreflection until no further bounce changes the colour of any site by more than ΔE94 `enough`.

    Parameters
    ----------
    operator : G (S,S) of `irradiance_operator`. lux : direct illuminance by each of K spectra.
    folds : for each spectrum the matrix from coefficients to XYZ, with Y = 1 for the perfect diffuser
        (`SpectralBasis.fold`, `RadiantRegions.folds`).
    white : XYZ of the white for ΔE94, Y = 1. reference_lux : illuminance at which a perfect diffuser has Y = 1.
    sends : factor on the light that each site sends to others; None is 1.
    exactly : number of bounces, whatever the remainder.

    The remainder is estimated as a geometric series of the last bounce at each site, whose ratio is that of the last
    two bounces, summed over all sites, at most q. The iteration converges, since rows of G sum to at most 1 and
    reflectances are below 1: with Y the largest that the last bounce added to any site, all later ones add less than Y
    q / (1 - q), q being the product of the largest row sum and the largest reflectance. With fluorescence all power is
    assumed to be at the wavelength of the highest sensitivity.

    Raises
    ------
    InputError : `most` bounces do not suffice.
    """
    to_xyz = np.concatenate([np.asarray(fold).T for fold in folds]) / reference_lux
    return passed_on(
        operator, regions, regions.first(lux), to_xyz, white, reference_lux, enough, most, sends, None, exactly
    )


def passed_on(
    operator: Any,
    regions: Regions | RadiantRegions,
    first: Float[np.ndarray, "S K J"],
    to_xyz: Float[np.ndarray, "F 3"],
    white: Float[np.ndarray, "3"],
    reference_lux: float,
    enough: float = ENOUGH,
    most: int = MOST,
    sends: Float[np.ndarray, " S"] | None = None,
    beside: Float[np.ndarray, "S 3"] | None = None,
    bounces: int | None = None,
    then: Float[np.ndarray, "S K J"] | None = None,
) -> Interreflection:
    """Solve for interreflection from any initial radiosity `first`; see `interreflected`.

    to_xyz : XYZ from the coefficients of all spectra. beside : further XYZ of sites that is not reflected again.
    bounces : their number, whatever the remainder; None continues until `enough`. then : radiosity after the first
    bounce, if `first` is not entirely diffuse.
    """
    now = first
    total = now.copy()
    seen = _seen(total, to_xyz) + (0.0 if beside is None else beside)
    largest = float(operator.sum(axis=1).max()) if operator.shape[0] else 0.0
    q = largest * regions.largest
    left, before = 0.0, float(np.abs(_seen(now, to_xyz)).sum())
    for bounce in range((most if bounces is None else bounces) + 1):
        if bounce or then is None:
            sent = now.reshape(len(now), -1)
            arriving = operator @ (sent if sends is None else sent * sends[:, None])
            following = regions.reflected(np.asarray(arriving).reshape(now.shape))
        else:
            following = then
        gives = _seen(following, to_xyz)
        size = float(np.abs(gives).sum())
        share = min(size / before, q) if before > 0.0 else 0.0
        left = largest_difference(seen, gives / (1.0 - share), white, enough) if size > 0.0 else 0.0
        bound = float(regions.most_y(following, gives[:, 1], reference_lux).max(initial=0.0)) / (1.0 - q)
        if left <= enough if bounces is None else bounce == bounces:
            return Interreflection(bounce, first, total, left, bound)
        now, before = following, size
        total += now
        seen += gives
    words = f"ΔE94 {left:.2g} is still missing after {most} bounces"
    raise InputError("light that does not end", found=words, expected=f"at most {enough:g}", hint="allow more bounces")


def largest_difference(
    seen: Float[np.ndarray, "S 3"], more: Float[np.ndarray, "S 3"], white: Float[np.ndarray, "3"], enough: float
) -> float:
    """Return the largest ΔE94 of any site when `more` is added; of a subset of sites if that already exceeds
    `enough`.
    """
    some = slice(None, None, _FEW)
    found = float(delta_e_xyz(seen[some] + more[some], seen[some], white).max(initial=0.0))
    return found if found > enough else float(delta_e_xyz(seen + more, seen, white).max(initial=0.0))


def _seen(coefficients: Float[np.ndarray, "S K J"], to_xyz: Float[np.ndarray, "F 3"]) -> Float[np.ndarray, "S 3"]:
    return coefficients.reshape(len(coefficients), -1) @ to_xyz
