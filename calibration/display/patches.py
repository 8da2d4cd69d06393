"""Test patches to measure: corners, greys, ramps, and a space-filling set."""

from __future__ import annotations

from typing import Literal

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError

Purpose = Literal["characterise", "verify", "uniformity"]
#: Fewest patches of a set: corners and one grey.
FEWEST = 9
# Most of a set: an instrument takes a second or more for each.
MOST = 5000
# Shares of greys, and of each channel alone, among the patches beyond the corners.
_GREYS, _RAMP = 0.13, 0.07
# A grey that tells whether the display, or what feeds it, clips before white.
_NEARLY_WHITE = 0.95
# Nodes along an edge of the grid that the farthest point is looked for on, and where verification looks: between them.
_GRID, _BETWEEN = 17, 12


def patches(count: int, purpose: Purpose = "characterise", white_every: int = 8) -> Float[np.ndarray, "N 3"]:
    """Choose codes from 0 to 1, in display order.

    `count` different ones; full white is first and last, and repeated after every `white_every` of them, so that drift
    can be removed. Sets for verification share only white and black with sets for characterisation. For uniformity it
    is white, mid grey and black, to be measured at each place of a grid.

    Raises
    ------
    InputError : fewer than 9, or more than 5000.
    """
    if not FEWEST <= count <= MOST:
        raise InputError("not a number of patches", field="-n", found=count, expected=f"{FEWEST} to {MOST}")
    if purpose == "uniformity":
        return np.repeat(np.array([[1.0], [0.5], [0.0]]), 3, axis=1)
    chosen = _characterising(count) if purpose == "characterise" else _verifying(count)
    rest = chosen[~(chosen >= 1.0).all(axis=1)]
    # Light and dark take turns, so that no part of the cube is measured at the end alone.
    rest = rest[np.random.default_rng(count).permutation(len(rest))]
    white = np.ones((1, 3))
    parts = [white]
    for start in range(0, len(rest), white_every):
        parts += [rest[start : start + white_every], white]
    return np.concatenate(parts)


def _corners() -> np.ndarray:
    return np.array([[r, g, b] for r in (0.0, 1.0) for g in (0.0, 1.0) for b in (0.0, 1.0)])


def _characterising(count: int) -> np.ndarray:
    found = _corners()
    beyond = count - len(found)
    greys, each = max(round(_GREYS * beyond), 1), round(_RAMP * beyond)
    levels = np.append(_inner(greys - 1), _NEARLY_WHITE)
    found = np.concatenate([found, np.repeat(levels[:, None], 3, axis=1)])
    for at in range(3):
        ramp = np.zeros((each, 3))
        ramp[:, at] = _inner(each)
        found = np.concatenate([found, ramp])
    return _filled(found, count, np.linspace(0.0, 1.0, _GRID))


def _verifying(count: int) -> np.ndarray:
    """Return primaries and secondaries again, greys between those of the other set, and inner colours."""
    corners = _corners()
    greys = (np.arange(max((count - len(corners)) // 4, 1)) + 0.62) / (max((count - len(corners)) // 4, 1) + 0.5)
    found = np.concatenate([corners, np.repeat(greys[greys < 1.0][:, None], 3, axis=1)])
    return _filled(found, count, (np.arange(_BETWEEN) + 0.5) / _BETWEEN)


def _inner(count: int) -> np.ndarray:
    """Space codes between 0 and 1, denser in the dark, where curves bend most."""
    return (np.arange(1, count + 1) / (count + 1)) ** 1.25


def _filled(found: np.ndarray, count: int, levels: np.ndarray) -> np.ndarray:
    """Extend the set, until it is large enough, by the node of a grid farthest from all of it (Gonzalez 1985)."""
    grid = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1).reshape(-1, 3)
    apart = np.min(np.sum((grid[:, None] - found[None]) ** 2, axis=-1), axis=1)
    while len(found) < count:
        at = int(np.argmax(np.round(apart, 12)))
        found = np.concatenate([found, grid[at : at + 1]])
        apart = np.minimum(apart, np.sum((grid - grid[at]) ** 2, axis=1))
    return found[:count]
