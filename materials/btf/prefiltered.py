"""Prefiltered lobes for environment light, as a Gaussian and a bent cosine each.

Meseth, Mueller and Klein 2003 (section 5.2) look a lobe up in an environment prefiltered for its exponent, times the
cosine of its axis. A lobe is nearly a spherical Gaussian, which environments are prefiltered for here; but it ends at
the horizon, and below the lowest measured light it falls with the cosine. A cosine times polynomials
(`environment_form`), whose integral over light is known exactly, corrects for both: the least-squares sum of the two
over the whole sphere is tabulated by exponent and angle between axis and normal.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from ..core.environment_form import bends
from .light_basis import spread
from .quantisation import EXPONENTS

# Angles theta of axes to the normal, evenly in sin(theta / 2), and directions over the sphere.
_ANGLES, _DIRECTIONS = 65, 6000
# Gaussians to choose from: angles to the normal, degrees, and binary logarithms of lambda.
_TILTS, _SHARPNESS = np.arange(0.0, 90.0, 2.0), np.arange(-1.0, 8.0, 0.5)
# Polynomials of `bends` that are even in y: 1, x, z, xz, xx - yy, 3 zz - 1.
_EVEN = [0, 1, 3, 6, 7, 8]
# Weight of even light beside all directions.
_EVENLY = 3.0
# Ridge, relative to the functions' mean square: broad Gaussians are nearly bent cosines.
_HELD = 1e-6


@dataclass(frozen=True, eq=False)
class Prefiltered:
    """Prefiltered lobes of E exponents and m angles of an axis in the x-z plane; last the constant lobe, rho_d.

    The constant lobe is at angle 0.
    turn (E+1,m) : tilt of the Gaussian's axis from the normal beyond that of the lobe, radians. sharpness, value
    (E+1,m) : lambda of the Gaussian, and its integral. bent (E+1,m,6) : coefficients of the cosine's polynomials
    `_EVEN`.
    """

    turn: Float[np.ndarray, "E1 m"]
    sharpness: Float[np.ndarray, "E1 m"]
    value: Float[np.ndarray, "E1 m"]
    bent: Float[np.ndarray, "E1 m 6"]

    def matt(
        self, exponent: Int[np.ndarray, "*n"], angle: Int[np.ndarray, "*n"], axes: Float[np.ndarray, "*n 3"]
    ) -> Float[np.ndarray, "*n 9"]:
        """Compute the coefficients of all polynomials for lobes about any axes."""
        level = np.hypot(axes[..., 0], axes[..., 1])
        some = level > 0.0
        cos = np.divide(axes[..., 0], level, out=np.ones_like(level), where=some)
        sin = np.divide(axes[..., 1], level, out=np.zeros_like(level), where=some)
        one, x, z, xz, difference, third = np.moveaxis(self.bent[exponent, angle], -1, 0)
        turned = [one, x * cos, x * sin, z, 4.0 * difference * cos * sin, xz * sin, xz * cos]
        return np.stack([*turned, difference * (cos * cos - sin * sin), third], axis=-1)

    def axes(
        self, exponent: Int[np.ndarray, "*n"], angle: Int[np.ndarray, "*n"], axes: Float[np.ndarray, "*n 3"]
    ) -> Float[np.ndarray, "*n 3"]:
        """Compute the axes of the Gaussians for lobes about any axes."""
        turn, level = self.turn[exponent, angle], np.hypot(axes[..., 0], axes[..., 1])
        some = (level > 0.0)[..., None]
        out = np.divide(axes[..., :2], level[..., None], out=np.zeros_like(axes[..., :2]), where=some)
        cos, sin = np.cos(turn), np.sin(turn)
        farther, up = level * cos + axes[..., 2] * sin, axes[..., 2] * cos - level * sin
        return np.concatenate([out * farther[..., None], up[..., None]], axis=-1)

    def listed(self) -> np.ndarray:
        """Make the texture for `lobe_gathering.glsl`, three texels per angle and a row per exponent.

        Cosine and sine of the turn, 1 / lambda and the integral; then the polynomials' coefficients.
        """
        first = np.stack([np.cos(self.turn), np.sin(self.turn), 1.0 / self.sharpness, self.value], axis=-1)
        numbers = np.concatenate([first, self.bent, np.zeros((*self.turn.shape, 2))], axis=-1)
        return numbers.astype(np.float32).reshape(len(numbers), -1, 4)


def nearest_angle(axes: Float[np.ndarray, "*n 3"]) -> Int[np.ndarray, "*n"]:
    """Find the index of the tabulated angle nearest to each axis; sqrt((1 - z) / 2) is sin(theta / 2)."""
    half = np.sqrt(np.maximum(0.5 * (1.0 - axes[..., 2]), 0.0))
    return np.minimum(np.floor(half * (_ANGLES - 1) + 0.5), _ANGLES - 1).astype(np.int64)


@lru_cache(maxsize=8)
def prefiltered(lowest: float) -> Prefiltered:
    """Compute the table for lights measured down to this cosine; cached."""
    to = spread(2 * _DIRECTIONS, -1.0)
    # Lobes and functions are even in y.
    to = to[to[:, 1] >= 0.0]
    angles = 2.0 * np.arcsin(np.linspace(0.0, 1.0, _ANGLES))
    tilt, sharpness = (one.ravel() for one in np.meshgrid(np.radians(_TILTS), 2.0**_SHARPNESS, indexing="ij"))
    apart = np.outer(np.sin(tilt), to[:, 0]) + np.outer(np.cos(tilt), to[:, 2]) - 1.0
    norm = sharpness / (2.0 * np.pi * -np.expm1(-2.0 * sharpness))
    gaussians = _with_sum(norm[:, None] * np.exp(sharpness[:, None] * apart))
    matt = _with_sum(bends(to)[:, _EVEN].T * np.maximum(to[:, 2], 0.0))
    square = matt @ matt.T
    inverse = np.linalg.inv(square + _HELD * np.trace(square) / len(square) * np.eye(len(square)))
    # Residuals of Gaussians, and of lobes, beside the cosines.
    in_gaussians = gaussians @ matt.T @ inverse
    freed = gaussians - in_gaussians @ matt
    size = np.einsum("cd,cd->c", freed, gaussians) + _HELD * np.einsum("cd,cd->c", gaussians, gaussians)
    rows = []
    for lobes in map(_with_sum, _lobes(to, angles, lowest)):
        along = lobes @ freed.T
        gain = along * np.abs(along) / size
        # A lobe along the normal has no azimuth: its Gaussian is upright.
        gain[0, tilt > 0.0] = -np.inf
        best = gain.argmax(axis=1)
        value = along[np.arange(len(lobes)), best] / size[best]
        bent = lobes @ matt.T @ inverse - value[:, None] * in_gaussians[best]
        rows.append((tilt[best] - angles[: len(lobes)], sharpness[best], value, bent))
    # The last row has its first angle alone: no other is looked up.
    rows[-1] = tuple(np.repeat(one, _ANGLES, axis=0) for one in rows[-1])
    return Prefiltered(*(np.stack(part) for part in zip(*rows, strict=True)))


def _with_sum(functions: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "n d1"]:
    """Append to functions sampled at directions their integral under uniform light, as one more direction."""
    even = functions.sum(axis=1, keepdims=True) / functions.shape[1] ** 0.5
    return np.concatenate([functions, _EVENLY * even], axis=1)


def _lobes(to: Float[np.ndarray, "d 3"], angles: Float[np.ndarray, " m"], lowest: float):
    """Yield for each exponent the lobes at all angles of the axis, then the constant one, at directions, as lit."""
    low = to[:, 2] < lowest
    level = np.sqrt(np.maximum(1.0 - to[:, 2] ** 2, 0.0))
    inward = np.where(low, np.sqrt(1.0 - lowest * lowest) / np.where(level > 0.0, level, 1.0), 1.0)
    x, z = to[:, 0] * inward, np.where(low, lowest, to[:, 2])
    falling = np.where(low, np.maximum(to[:, 2], 0.0) / max(lowest, 1e-9), 1.0)
    cosine = np.maximum(np.outer(np.sin(angles), x) + np.outer(np.cos(angles), z), 0.0)
    for exponent in EXPONENTS:
        yield cosine**exponent * falling
    yield falling[None]
