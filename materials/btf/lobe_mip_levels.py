"""Mip levels of lobes: lobes of the same rank are merged over texels, and amplitudes refitted.

A mean of lobes is not a lobe. The widest lobes of the texels, the second widest, and so on are each replaced by one
lobe with the moments of all: axis and width follow from the mean of their directions, as for normals (Toksvig 2005; Han
et al. 2007). max(axis . l, 0)^n has the integral 2 pi / (n + 1), and its mean direction is (n + 1) / (n + 2) times its
axis. Amplitudes are then fitted by least squares to the mean values of the texels under the measured lights.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int8, UInt8

from ..svbrdf.texels import levels_of
from .lobe_amplitudes import Equations, weights_of
from .lobes import lobe_values
from .quantisation import LEAST, MOST, coded_axes, coded_exponents, decoded_axes, decoded_exponents


class LobesOfView(NamedTuple):
    """Lobes of a view at one level, stored as in `LobeField`."""

    axes: UInt8[np.ndarray, "H W G k 2"]
    exponents: UInt8[np.ndarray, "H W G k2"]
    amplitudes: Int8[np.ndarray, "H W k1 J"]
    largest: Float[np.ndarray, "k1 J"]


def lobes_from_afar(
    axes: Float[np.ndarray, "H W G k 3"],
    exponents: Float[np.ndarray, "H W G k"],
    amplitudes: Float[np.ndarray, "H W k1 J"],
    lights: Float[np.ndarray, "Lt 3"],
    to_y: Float[np.ndarray, " J"],
) -> list[LobesOfView]:
    """Make the coarser levels of a view's texels, each half as many each way, down to a single one.

    lights : measured directions. to_y : weights from coefficients to luminance.
    """
    height, width, sets, lobes = exponents.shape
    size = amplitudes.shape[3]
    values = _values(axes, exponents, amplitudes, lights).reshape(height, width, -1)
    moments = _moments(axes, exponents, amplitudes, to_y).reshape(height, width, -1)
    found = []
    for mean, moment in zip(levels_of(values)[1:], levels_of(moments)[1:], strict=True):
        texels = mean.shape[0] * mean.shape[1]
        codes = _lobes(moment.reshape(texels, sets, lobes, 4))
        some = mean.reshape(texels, len(lights), size).astype(np.float32)
        equations, weights = Equations(texels, lobes + 1, sets, size), weights_of(some @ to_y)
        for one in range(sets):
            mine = slice(0, size) if sets == 1 else slice(one, one + 1)
            coded = decoded_axes(codes[0][:, one]), decoded_exponents(codes[1][:, one], lobes)
            equations.add(slice(None), one, lobe_values(*coded, lights), weights, some[..., mine])
        largest, whole = equations.rounded()
        kept = [part.reshape(*mean.shape[:2], *part.shape[1:]) for part in (*codes, whole)]
        found.append(LobesOfView(kept[0], kept[1], kept[2], largest))
    return found


def _values(
    axes: Float[np.ndarray, "H W G k 3"],
    exponents: Float[np.ndarray, "H W G k"],
    amplitudes: Float[np.ndarray, "H W k1 J"],
    lights: Float[np.ndarray, "Lt 3"],
) -> Float[np.ndarray, "H W Lt J"]:
    """Compute the values of each texel under each light."""
    lobes = lobe_values(axes, exponents, lights)
    of_lobes = amplitudes[:, :, 1:].astype(np.float32)
    if lobes.shape[2] == 1:
        found = lobes[:, :, 0].swapaxes(2, 3) @ of_lobes
    else:
        found = np.einsum("hwjkl,hwkj->hwlj", lobes, of_lobes, optimize=True)
    found += amplitudes[:, :, None, 0]
    return found


def _moments(
    axes: Float[np.ndarray, "H W G k 3"],
    exponents: Float[np.ndarray, "H W G k"],
    amplitudes: Float[np.ndarray, "H W k1 J"],
    to_y: Float[np.ndarray, " J"],
) -> Float[np.ndarray, "H W G k 4"]:
    """Compute for each lobe, widest first, its integral over 2 pi, and that times its mean direction."""
    given = amplitudes[:, :, 1:].astype(np.float32)
    shown = (given @ to_y)[:, :, None] if exponents.shape[2] == 1 else given.swapaxes(2, 3)
    much = np.abs(shown) / (exponents + 1.0)
    towards = axes * (much * (exponents + 1.0) / (exponents + 2.0))[..., None]
    order = np.argsort(exponents, axis=3, kind="stable")[..., None]
    return np.take_along_axis(np.concatenate([much[..., None], towards], axis=4), order, axis=3)


def _lobes(
    moments: Float[np.ndarray, "T G k 4"],
) -> tuple[UInt8[np.ndarray, "T G k 2"], UInt8[np.ndarray, "T G k2"]]:
    """Fit axes and exponents of lobes to moments; without any energy the lobe is arbitrary."""
    much, towards = moments[..., 0], moments[..., 1:]
    length = np.linalg.norm(towards, axis=-1)
    there = length > 0.0
    axes = np.where(there[..., None], towards, (0.0, 0.0, 1.0)) / np.where(there, length, 1.0)[..., None]
    mean = np.divide(length, much, out=np.full_like(much, 2.0 / 3.0), where=there)
    # (n + 1) / (n + 2) = mean; below 1/2 is no lobe so wide, and at 1 there is no width.
    exponents = (2.0 * mean - 1.0) / np.maximum(1.0 - mean, 1e-6)
    return coded_axes(axes), coded_exponents(np.clip(exponents, LEAST, MOST))
