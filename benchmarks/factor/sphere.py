"""XYZ on the sphere protocol under several lights at once, from BRDFs and from packs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from ...materials.brdf import Brdf
from ...materials.factors import FactorPack, FitError, frame_angles
from ...materials.protocol import SphereProtocol

_BLOCK = 8192


def under(protocol: SphereProtocol, light: str) -> SphereProtocol:
    """The same samples under another light."""
    return replace(protocol, light=light)


def brdf_xyz(brdf: Brdf, protocol: SphereProtocol, lights: Sequence[str]) -> Float[np.ndarray, "M N 3"]:
    """XYZ of every sample under M lights; the BRDF is evaluated once."""
    weights = [np.pi * under(protocol, light).weights(brdf.wavelengths_nm) for light in lights]
    xyz = np.empty((len(lights), len(protocol.wi), 3))
    for start in range(0, len(protocol.wi), _BLOCK):
        rows = slice(start, start + _BLOCK)
        shaded = brdf.eval(protocol.wi[rows], protocol.wo[rows]) * protocol.wi[rows, 2:]
        for index, weight in enumerate(weights):
            xyz[index, rows] = shaded @ weight
    return xyz


def pack_xyz(
    packs: tuple[FactorPack, ...], protocol: SphereProtocol, lights: Sequence[str]
) -> Float[np.ndarray, "M N 3"]:
    """XYZ of every sample under M lights, from packs folded with each; the factors are looked up once."""
    return folded_xyz(packs, protocol, [folds(packs, protocol, light) for light in lights])


def folds(packs: tuple[FactorPack, ...], protocol: SphereProtocol, light: str) -> list[Float[np.ndarray, "_ 3"]]:
    """For each pack, XYZ (R,3) of its terms under one light."""
    return [
        np.pi * pack.basis.reconstruct(pack.spectral) @ under(protocol, light).weights(pack.basis.wavelengths_nm)
        for pack in packs
    ]


def folded_xyz(
    packs: tuple[FactorPack, ...], protocol: SphereProtocol, weights: Sequence[Sequence[np.ndarray]]
) -> Float[np.ndarray, "M N 3"]:
    """M pictures; `weights[m][p]` (R,3) are the XYZ of pack p's terms in picture m."""
    xyz = np.zeros((len(weights), len(protocol.wi), 3))
    for number, pack in enumerate(packs):
        for start in range(0, len(protocol.wi), _BLOCK):
            rows = slice(start, start + _BLOCK)
            at = frame_angles(pack.frame, protocol.wi[rows], protocol.wo[rows], pack.anisotropic)
            geometry = pack.geometry_at(at)
            for index, of_packs in enumerate(weights):
                xyz[index, rows] += geometry @ of_packs[number]
    return xyz


def errors_by_light(
    protocol: SphereProtocol,
    lights: Sequence[str],
    reference: Float[np.ndarray, "M N 3"],
    sample: Float[np.ndarray, "M N 3"],
) -> dict[str, dict[str, float]]:
    """`statistics` of M pictures, by the light that each is seen under."""
    return {
        light: statistics(under(protocol, light).compare(*pair))
        for light, *pair in zip(lights, reference, sample, strict=True)
    }


def statistics(error: FitError) -> dict[str, float]:
    """ΔE94 by the names that the JSON has."""
    return {"mean": error.mean, "p95": error.p95, "p99": error.p99, "max": error.maximum}
