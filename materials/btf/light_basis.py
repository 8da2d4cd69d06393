"""Low-dimensional basis of environment light for BTFs.

The response of a BTF to light is its values under the measured lights times the light under each one's hat function
over the hemisphere (Mueller, Meseth and Klein 2004, section 4.1). Here light is looked up under spherical Gaussians
fixed in the surface's frame, and as moments on the surface; each hat is a least-squares sum of these over the whole
sphere, with 0 below the horizon. Among the combinations that occur in the BTF, a balanced basis of its rows against
likely light keeps the visible ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ..core.environment_form import bends
from .hemisphere import Hemisphere

#: Terms of the balanced basis: one less than spherical harmonics of order 5 have.
TERMS = 24
# One Gaussian per two measured lights, within these bounds; their sharpness, times their number.
_FEWEST, _MOST, _SHARPNESS = 8, 40, 0.5
# Gaussians stand above this z.
_LOWEST = 0.02
# Directions over the whole sphere that hats and functions are compared at.
_DIRECTIONS = 20000
# Ridge, relative to the mean of the diagonal: neighbouring Gaussians are nearly dependent.
_HELD = 1e-9
# Lights that the basis is balanced for: as narrow as a hat, and Gaussians of these sharpnesses; each from everywhere.
_LIGHTS = (32.0, 8.0, 2.0, 0.5)
# Rows are weighted by a power of their mean: L* is a cube root, so that dark rows count for more.
_POWER, _DARKEST = -2.0 / 3.0, 0.02


@dataclass(frozen=True, eq=False)
class LightFunctions:
    """Q Gaussians and nine moments that approximate the hats of Lt measured lights.

    axes (Q,3) : unit vectors. sharpness : lambda of all. hats (Lt,Q+9) : coefficients of each hat: first of normalised
    Gaussians, then of the cosine times each of `environment_form.bends`.
    """

    axes: Float[np.ndarray, "Q 3"]
    sharpness: float
    hats: Float[np.ndarray, "Lt F"]


def light_functions(lights: Hemisphere) -> LightFunctions:
    """Approximate the hats of some measured lights."""
    return nearest(lights, hats_at)


def nearest(
    lights: Hemisphere, wanted: Callable[[Hemisphere, Float[np.ndarray, "n 3"]], Float[np.ndarray, "n m"]]
) -> LightFunctions:
    """Choose light functions for some measured lights, and fit other functions in place of the hats by least squares.

    wanted : evaluates these functions at directions over the whole sphere.
    """
    count = int(np.clip(len(lights) // 2, _FEWEST, _MOST))
    axes, sharpness = spread(count, _LOWEST), _SHARPNESS * count
    around = spread(_DIRECTIONS, -1.0)
    functions, hats = _functions(around, axes, sharpness), wanted(lights, around)
    square = functions.T @ functions
    square[np.diag_indices_from(square)] += _HELD * np.trace(square) / len(square)
    return LightFunctions(axes, sharpness, np.linalg.solve(square, functions.T @ hats).T)


@dataclass(frozen=True, eq=False)
class LightBasis:
    """Basis of B terms for rows (Lt,) of a BTF's values.

    analysis, synthesis : (Lt,B). A row e has coefficients e @ analysis, and gathers e @ analysis @ synthesis.T @ light.
    """

    analysis: Float[np.ndarray, "Lt B"]
    synthesis: Float[np.ndarray, "Lt B"]

    @cached_property
    def size(self) -> int:
        """B."""
        return self.analysis.shape[1]


def balanced_lights(rows: Float[np.ndarray, "n Lt"], lights: Hemisphere, terms: int = TERMS) -> LightBasis:
    """Compute the balanced basis of a BTF's rows and of light that is equally likely from everywhere, narrow or wide.

    rows : each of one view, texel and coefficient, f_r cos(theta_i), 1/sr. Terms without effect are left out.
    """
    mean = np.abs(rows).mean(axis=1, keepdims=True) * np.pi
    weighed = rows * np.maximum(mean, _DARKEST) ** _POWER
    light = _likely(lights)
    rows_, squares, lights_ = np.linalg.svd(weighed @ light, full_matrices=False)
    kept = max(1, int(np.sum(squares[:terms] > 1e-9 * max(float(squares[0]), np.finfo(float).tiny))))
    root = np.sqrt(np.where(squares[:kept] > 0.0, squares[:kept], 1.0))
    return LightBasis(light @ lights_[:kept].T / root, weighed.T @ rows_[:, :kept] / root)


def spread(count: int, lowest: float) -> Float[np.ndarray, "n 3"]:
    """Spread unit vectors evenly over the sphere above z = `lowest`, on a golden spiral."""
    number = np.arange(count) + 0.5
    z = 1.0 - (1.0 - lowest) * number / count
    azimuth = np.pi * (1.0 + np.sqrt(5.0)) * number
    level = np.sqrt(1.0 - z * z)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), z], axis=1)


def _functions(
    directions: Float[np.ndarray, "n 3"], axes: Float[np.ndarray, "Q 3"], sharpness: float
) -> Float[np.ndarray, "n F"]:
    """Evaluate normalised Gaussians and bent cosines at directions."""
    norm = sharpness / (2.0 * np.pi * -np.expm1(-2.0 * sharpness))
    gaussians = norm * np.exp(sharpness * (directions @ axes.T - 1.0))
    return np.concatenate([gaussians, bends(directions) * np.maximum(directions[:, 2:], 0.0)], axis=1)


def hats_at(lights: Hemisphere, directions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n Lt"]:
    """Evaluate the hat function of each measured light at directions of the whole sphere."""
    found = np.zeros((len(directions), len(lights)))
    above = np.flatnonzero(directions[:, 2] > 0.0)
    index, share = lights.shares(directions[above], falling=True)
    for corner in range(3):
        np.add.at(found, (above, index[:, corner]), share[:, corner])
    return found


def _likely(lights: Hemisphere) -> Float[np.ndarray, "Lt m"]:
    """Return a factor L of the second moments L L^T of likely light under the hats."""
    around = spread(_DIRECTIONS // 8, -1.0)
    hats = hats_at(lights, around)
    total = hats.T @ hats / len(around)
    from_all = spread(_DIRECTIONS // 32, -1.0)
    for sharpness in _LIGHTS:
        weights = np.exp(sharpness * (from_all @ around.T - 1.0))
        each = (weights / weights.sum(axis=1, keepdims=True)) @ hats
        total += each.T @ each / len(from_all)
    squares, turn = np.linalg.eigh(total)
    return turn * np.sqrt(np.maximum(squares, 0.0))
