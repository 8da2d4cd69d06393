"""The same packs on other grids: finer, or only as far as lights of pictures stand; and packs of one grid as one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...spectral.palette import Palette
from ..core.axes import Axis, Frame
from ..factored.pack import FactorPack
from .axis_samples import AxisSamples
from .visible_pairs import FARTHEST_LIGHT


def finer(pack: FactorPack, most: int) -> FactorPack:
    """Return the same function on axes with a node between any two; an axis that would have more than `most` stays."""
    axes, factors = [], []
    for axis, factor in zip(pack.axes, pack.factors, strict=True):
        if 2 * axis.size - 1 <= most:
            axis = replace(axis, size=2 * axis.size - 1)
            between = np.empty((axis.size, pack.rank))
            between[::2], between[1::2] = factor, 0.5 * (factor[1:] + factor[:-1])
            factor = between
        axes.append(axis)
        factors.append(factor)
    return replace(pack, axes=tuple(axes), factors=tuple(factors), precision="single")


def axes_up_to_farthest_light(frame: Frame, axes: tuple[Axis, ...]) -> tuple[Axis, ...]:
    """Return the grid with theta_d, in frame hd, only as far as lights of samples stand; beyond, factors are held
    constant.
    """
    if frame != "hd" or axes[1].maximum <= 0.5 * FARTHEST_LIGHT:
        return axes
    return (axes[0], replace(axes[1], maximum=0.5 * FARTHEST_LIGHT), *axes[2:])


def up_to_farthest_light(pack: FactorPack) -> FactorPack:
    """Return the pack on `axes_up_to_farthest_light`, the same function up to there."""
    axes = axes_up_to_farthest_light(pack.frame, pack.axes)
    if axes is pack.axes:
        return pack
    position = pack.axes[1].position(axes[1].nodes)
    factor = AxisSamples.of(position, pack.axes[1].size, False).interpolated(pack.factors[1])
    factors = (pack.factors[0], factor, *pack.factors[2:])
    return replace(pack, axes=axes, factors=factors, precision="single")


def merged(packs: tuple[FactorPack, ...]) -> tuple[FactorPack, ...]:
    """One pack for each frame and grid, in the order in which they first appear."""
    groups: dict[tuple, list[FactorPack]] = {}
    for pack in packs:
        groups.setdefault((pack.frame, pack.axes), []).append(pack)
    return tuple(
        replace(
            group[0],
            factors=tuple(np.hstack(columns) for columns in zip(*(pack.factors for pack in group), strict=True)),
            palette=Palette.of(np.vstack([pack.spectra for pack in group])),
        )
        for group in groups.values()
    )
