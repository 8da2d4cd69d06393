"""Mip-mapped factors: each averaged along its own axis, level by level, and interpolated between two levels.

A sample that covers a piece of surface needs a mean over directions. A sum of products has no cheap mean: here it is
approximated by the sum of products of each factor's own mean, which is exact if only one factor varies. The
approximation is best on surfaces curved both ways. On a rod a sample spans a line of directions, not a disc, and a
highlight far narrower than that line comes out too dark.

Level k averages over the angle that 2^k nodes span about each node, in the measure of directions on a surface. The
theta of a direction is its distance from a pole, and a sample covers a disc about it, of the same solid angle as the
square of that width: close to the pole most of the disc is far from it, so that a mean along theta alone would make a
highlight several times too bright. An azimuth is averaged evenly, around its period or folded at the mirror plane. A
level keeps `NODES_A_WIDTH` nodes per averaging width (the classic pyramid's one would blur twice as far again), and
continues beyond the end of an axis, where the last node is clamped, until its discs have left the axis. All levels take
four to five times the memory of the factors alone.

Twin of the levels in `factors.glsl`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from ..core.axes import Axis, FrameAngles

Factors = tuple[Float[np.ndarray, "_ R"], ...]

# Nodes that a level keeps to each width that it averages over, where the axis has as many.
NODES_A_WIDTH = 4
# Levels that a shader has room for: those of an axis of thousands of nodes.
MOST_LEVELS = 16
# Points of the numerical means to each node, and beyond the last one.
_POINTS = 16
_BEYOND = 1024
# Means per block: bounds memory.
_MEANS = 64
# Samples per block: their rows of factors stay in the second-level cache.
_BLOCK = 4096


@dataclass(frozen=True, eq=False)
class Levels:
    """Mip levels of an axis.

    sizes : nodes of each level, the first at the axis' first. spacings : of its nodes, in those of the axis; the first
    level is the axis itself.
    starts : row of each level's first node in `weights`.
    weights (sum of sizes, n) : from the nodes of the axis to those of all levels.
    """

    sizes: tuple[int, ...]
    spacings: tuple[float, ...]
    starts: tuple[int, ...]
    weights: Float[np.ndarray, "_ n"]


@lru_cache(maxsize=64)
def axis_levels(axis: Axis) -> Levels:
    """Compute the levels of an axis, up to the one that averages over all directions, which may exceed the axis."""
    steps, polar = axis.size - 1, axis.name.startswith("theta")
    # A disc of pi radians' radius, or a turn.
    all_of_it = np.pi * np.sqrt(np.pi) if polar else _turn(axis)
    means = _polar_means if polar else _azimuth_means
    sizes, spacings, weights = [axis.size], [1.0], [np.eye(axis.size)]
    while len(sizes) < MOST_LEVELS and width_of(axis, np.zeros(1), 2.0 ** (len(sizes) - 1))[0] < all_of_it:
        nodes = 2.0 ** len(sizes)
        spacings.append(max(1.0, nodes / NODES_A_WIDTH))
        last = _last_position(axis, nodes) if polar else steps
        position = spacings[-1] * np.arange(int(np.ceil(last / spacings[-1])) + 1)
        centre, width = _angle(axis, position), width_of(axis, position, nodes)
        blocks = [slice(start, start + _MEANS) for start in range(0, len(position), _MEANS)]
        found = np.concatenate([means(axis, centre[rows], width[rows]) for rows in blocks])
        weights.append(found / found.sum(axis=1, keepdims=True))
        sizes.append(len(position))
    stacked = np.concatenate(weights)
    stacked.setflags(write=False)
    starts = tuple(int(start) for start in np.cumsum([0, *sizes[:-1]]))
    return Levels(tuple(sizes), tuple(spacings), starts, stacked)


def pyramid(axes: Sequence[Axis], factors: Factors, half: bool) -> Factors:
    """Compute the nodes of all levels of every factor; rounded to 16 bits if factors are in half precision."""
    stacked = [axis_levels(axis).weights @ factor for axis, factor in zip(axes, factors, strict=True)]
    if half:
        stacked = [values.astype(np.float16).astype(np.float64) for values in stacked]
    return tuple(stacked)


def width_of(axis: Axis, position: Float[np.ndarray, "*n"], nodes: float) -> Float[np.ndarray, "*n"]:
    """Compute the radians from half of `nodes` before a node position to as many after it, mirrored below 0."""
    steps, half = axis.size - 1, 0.5 * nodes
    if axis.warp == "linear":
        return np.full_like(position, axis.maximum * nodes / steps)
    spread = np.where(position >= half, 2.0 * position * half, position**2 + half**2)
    return np.asarray(2.0 * axis.maximum * spread / steps**2)


def level_of(axis: Axis, position: Float[np.ndarray, " K"], width: Float[np.ndarray, " K"]) -> Float[np.ndarray, " K"]:
    """Return the fractional level that averages over `width` radians about a node position; inverse of `width_of`."""
    steps = axis.size - 1
    if axis.warp == "linear":
        nodes = width * (steps / axis.maximum)
    else:
        spread = width * (0.5 * steps**2 / axis.maximum)
        inner = spread > 2.0 * position**2
        beside = spread / np.where(inner, 1.0, np.maximum(position, 1e-30))
        nodes = np.where(inner, 2.0 * np.sqrt(np.maximum(spread - position**2, 0.0)), beside)
    last = len(axis_levels(axis).sizes) - 1
    return np.clip(np.log2(np.maximum(nodes, 1.0)), 0.0, last)


def filtered_values(
    axes: Sequence[Axis], factors: Factors, half: bool, at: FrameAngles, widths: Float[np.ndarray, "K axes"]
) -> Float[np.ndarray, "K R"]:
    """Multiply factors, each averaged over `widths` (radians, in the order of the axes), and the angles' scale."""
    tables = pyramid(axes, factors, half)
    steps = [np.diff(table, axis=0, append=table[-1:]) for table in tables]
    out = np.empty((len(at.scale), factors[0].shape[1]))
    for start in range(0, len(out), _BLOCK):
        rows = slice(start, start + _BLOCK)
        product = out[rows]
        product[:] = at.scale[rows, None]
        for number, (axis, table, step) in enumerate(zip(axes, tables, steps, strict=True)):
            position = _position(axis, at.angles[axis.name][rows])
            level = level_of(axis, position, widths[rows, number])
            fine = level.astype(np.intp)
            blend = (level - fine)[:, None]
            mean = _look_up(axis, table, step, position, fine)
            between = np.flatnonzero(blend[:, 0] > 0.0)
            coarse = _look_up(axis, table, step, position[between], fine[between] + 1)
            mean[between] += blend[between] * (coarse - mean[between])
            product *= mean
    return out


def _look_up(
    axis: Axis,
    table: Float[np.ndarray, "_ R"],
    step: Float[np.ndarray, "_ R"],
    position: Float[np.ndarray, " K"],
    level: Int[np.ndarray, " K"],
) -> Float[np.ndarray, "K R"]:
    levels = axis_levels(axis)
    place = position / np.array(levels.spacings)[level]
    place = np.minimum(place, np.array(levels.sizes)[level] - 1)
    below = place.astype(np.intp)
    node = below + np.array(levels.starts)[level]
    # The step from a level's last node leads into the next level, and is taken no part of: the fraction there is 0.
    value = step.take(node, axis=0)
    value *= (place - below)[:, None]
    value += table.take(node, axis=0)
    return value


def _position(axis: Axis, angle: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Compute `Axis.position`, continued beyond the last node."""
    if axis.periodic:
        return axis.position(angle)
    u = angle / axis.maximum
    return np.asarray((u if axis.warp == "linear" else np.sqrt(u)) * (axis.size - 1))


def _turn(axis: Axis) -> float:
    return axis.maximum if axis.periodic else 2.0 * np.pi


def _last_position(axis: Axis, nodes: float) -> float:
    """Find where the disc of a level no longer overlaps a polar axis, or the horizon."""
    steps, reach = axis.size - 1, nodes / np.sqrt(np.pi)
    horizon = 0.5 * np.pi / axis.maximum
    if axis.warp == "linear":
        return min(steps + reach, max(steps * horizon, steps))
    return min(reach + np.hypot(reach, steps), max(steps * np.sqrt(horizon), steps))


def _angle(axis: Axis, position: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    u = position / (axis.size - 1)
    return axis.maximum * (u if axis.warp == "linear" else u * u)


def _polar_means(
    axis: Axis, centre: Float[np.ndarray, " m"], width: Float[np.ndarray, " m"]
) -> Float[np.ndarray, "m n"]:
    """Compute weights of the nodes for means over spherical discs: circles about the pole, by the fraction inside."""
    steps = axis.size - 1
    edges = _angle(axis, np.arange(steps * _POINTS + 1) / _POINTS)
    # Beyond the axis' end, where the last node holds.
    edges = np.append(edges, np.geomspace(axis.maximum, max(axis.maximum, np.pi), _BEYOND + 1)[1:])
    theta, band = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
    place = axis.position(theta)
    radius = np.minimum(width / np.sqrt(np.pi), np.pi)[:, None]
    # The law of haversines gives half the angle that the disc spans on a circle.
    inside = np.sin(0.5 * radius) ** 2 - np.sin(0.5 * (theta - centre[:, None])) ** 2
    around = np.sin(theta) * np.sin(centre)[:, None]
    share = np.divide(inside, around, out=np.where(inside > 0.0, 1.0, 0.0), where=around > 0.0)
    area = np.arcsin(np.sqrt(np.clip(share, 0.0, 1.0))) * (np.sin(theta) * band)
    below = np.minimum(place.astype(np.intp), steps - 1)
    hats = np.zeros((len(place), axis.size))
    hats[np.arange(len(place)), below] = 1.0 - (place - below)
    hats[np.arange(len(place)), below + 1] = place - below
    return area @ hats


def _azimuth_means(
    axis: Axis, centre: Float[np.ndarray, " m"], width: Float[np.ndarray, " m"]
) -> Float[np.ndarray, "m n"]:
    """Compute weights of the nodes for even means over an azimuth."""
    steps = axis.size - 1
    width = np.minimum(width, _turn(axis))
    most = int(np.ceil(np.max(width) / axis.maximum * steps)) * _POINTS
    across = (np.arange(most) + 0.5) / most - 0.5
    phi = centre[:, None] + across * width[:, None]
    if not axis.periodic:
        phi = np.mod(phi, 2.0 * np.pi)
        if axis.maximum <= np.pi * (1.0 + 1e-9):
            phi = np.minimum(phi, 2.0 * np.pi - phi)
    place = axis.position(phi)
    below = np.minimum(place.astype(np.intp), steps - 1)
    row = np.broadcast_to(np.arange(len(centre))[:, None], below.shape) * axis.size
    weights = np.zeros(len(centre) * axis.size)
    for node, share in ((below, 1.0 - (place - below)), (below + 1, place - below)):
        weights += np.bincount((row + node).ravel(), share.ravel(), minlength=len(weights))
    return weights.reshape(len(centre), axis.size)
