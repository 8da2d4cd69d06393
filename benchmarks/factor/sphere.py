"""XYZ on the sphere protocol from packs whose terms are worth any numbers, and errors by light."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from ...materials.core.fit_error import FitError
from ...materials.core.protocol import SphereProtocol
from ...materials.factored.pack import FactorPack


def pack_folds(packs: tuple[FactorPack, ...], protocol: SphereProtocol, light: str) -> list[Float[np.ndarray, "_ 3"]]:
    """Compute for each pack XYZ (R,3) of its terms under one light."""
    return [np.pi * pack.spectra @ protocol.under(light).weights(pack.palette.wavelengths_nm) for pack in packs]


def folded_xyz(
    packs: tuple[FactorPack, ...], protocol: SphereProtocol, weights: Sequence[Sequence[np.ndarray]]
) -> Float[np.ndarray, "M N 3"]:
    """M pictures; `weights[m][p]` (R,3) are the XYZ of pack p's terms in picture m."""
    xyz = np.zeros((len(weights), len(protocol.wi), 3))
    for number, pack in enumerate(packs):
        terms = pack.terms(protocol.points)
        for picture, of_packs in zip(xyz, weights, strict=True):
            terms.add_to(picture, of_packs[number][None])
    return xyz


def errors_by_light(
    protocol: SphereProtocol,
    lights: Sequence[str],
    reference: Float[np.ndarray, "M N 3"],
    sample: Float[np.ndarray, "M N 3"],
) -> dict[str, dict[str, float]]:
    """`statistics` of M pictures, by the light that each is seen under."""
    return {
        light: statistics(protocol.under(light).compare(*pair))
        for light, *pair in zip(lights, reference, sample, strict=True)
    }


def statistics(error: FitError) -> dict[str, float]:
    """ΔE94 by the names that the JSON has."""
    return {"mean": error.mean, "p95": error.p95, "p99": error.p99, "max": error.maximum}
