"""Light from part to part: coefficients that travel, bounce by bounce, until what is left cannot be seen.

With radiosity B (S sites, J coefficients relative to a light's spectrum), c_0 = rho E_0 and c_(k+1) = O G c_k, where G
is the irradiance operator (`operator`) and O = A^T diag(rho) B the reflectance of a region in the basis
(`SpectralBasis.operator`). The interreflection of Sun et al. 2007 (eq. 4 and on) stops after two bounces, of which the
second is even over directions. Here, as many follow as change ΔE94 by more than is asked.
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

#: ΔE94 that bounces which are left out may change the brightest or darkest site by.
ENOUGH = 0.1
#: No scene of real surfaces needs as many: white of 0.99 in a closed box takes some 600.
MOST = 2000
# Stride of the sites that are tested first.
_FEW = 16


@dataclass(frozen=True, eq=False)
class Interreflection:
    """Radiosity of S sites.

    bounces : how many were followed. first, all (S,K,J) : after no bounce, and after all of them; lux of each light's
        spectrum that a perfect diffuser would have to receive to send out as much.
    left : ΔE94 that further bounces would change any site by, estimated; bound : what they could at most add to Y, of
        the reference illuminance.
    """

    bounces: int
    first: Float[np.ndarray, "S K J"]
    all: Float[np.ndarray, "S K J"]
    left: float
    bound: float

    @property
    def indirect(self) -> Float[np.ndarray, "S K J"]:
        """Light added by bounces."""
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
    """Follow light from site to site until no further bounce changes the colour of any site by ΔE94 `enough`.

    Parameters
    ----------
    operator : G (S,S) of `irradiance_operator`. lux : received of each of K spectra straight away.
    folds : of each spectrum, from coefficients to XYZ with Y = 1 of the perfect diffuser (`SpectralBasis.fold`,
        `RadiantRegions.folds`).
    white : XYZ that ΔE94 refers to, Y = 1. reference_lux : a perfect diffuser that receives this has Y = 1.
    sends : of each site, the share of its light that others receive; None is all.
    exactly : follow so many bounces, whatever is left.

    What is left is estimated as a geometric series of what the last bounce gave and the share by which it had become
    less, site by site at the slowest of all sites' shares. It ends, for sure, since rows of G sum to at most 1 and
    reflectances are below 1: whatever Y the last bounce gave the brightest site, all later ones add less than
    Y q / (1 - q) to any, q being the product of the largest of both. Where sites fluoresce, all of its power counts as
    what eyes see best.

    Raises
    ------
    InputError : `most` bounces are not enough.
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
    """`interreflected`, of any radiosity that there is `first`.

    to_xyz : what coefficients of all spectra come to. beside : XYZ that sites send out beside it, which is not passed
    on. bounces : follow so many, whatever is left; None goes on until `enough`. then : what sites make of it by the
    first bounce, where not all of it is even.
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
    """ΔE94 that `more` changes any site by; of a few of them where that is already more than `enough`."""
    some = slice(None, None, _FEW)
    found = float(delta_e_xyz(seen[some] + more[some], seen[some], white).max(initial=0.0))
    return found if found > enough else float(delta_e_xyz(seen + more, seen, white).max(initial=0.0))


def _seen(coefficients: Float[np.ndarray, "S K J"], to_xyz: Float[np.ndarray, "F 3"]) -> Float[np.ndarray, "S 3"]:
    return coefficients.reshape(len(coefficients), -1) @ to_xyz
