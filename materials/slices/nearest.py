"""Refinement of Gaussians to a slice: damped least squares of the visible difference.

Expectation-maximisation finds where Gaussians are needed, but leaves their sum off by tenths of the slice far from the
mirror direction, where a lamp beside a highlight reveals it. L* follows the cube root of Y, so that under a small lamp,
at any position, L* is off by the difference over the 2/3rd power of the slice's value there. Squares are divided by the
4/3rd power, of a slightly raised value, since a lamp is never the only light.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from .mixture import BLUNTEST, FARTHEST, Mixture

# Power of the density that squared differences are divided by; and the share of the slice's mean that is added to it.
_SEEN, _ELSEWHERE = 4.0 / 3.0, 0.1
# Cosine below the horizon down to which directions count as those as far above it.
_BELOW = 0.5
# Share of the weighted whole above which a direction counts.
_COUNTS = 1.0e-7
# Weight of the error of the sum: as of the same relative error in every direction.
_WHOLE = 1.0
# Damping of the first step, relative to the diagonal; its factors after a step that was worse, and one that was better;
# its bounds; and the longest step, of a logarithm or in Gaussian widths.
_DAMPING, _WORSE, _BETTER, _BOUNDS, _LONGEST = 1.0e-2, 8.0, 0.25, (1.0e-7, 1.0e6), 0.7
# Least progress, as a share of the squares that are left.
_PROGRESS = 1.0e-3
# Ridge that holds nearly equal parts together: of steps, relative to the largest diagonal; of spectra, to the mean one.
_STEP_RIDGE, _RIDGE = 1.0e-9, 1.0e-5
# Share of the largest derivative below which one counts as 0.
_NOTHING = 1.0e-30
# Least share of a part.
_LEAST = 1.0e-6


@dataclass(frozen=True, eq=False)
class Wanted:
    """Target of a mixture at S directions: f_r cos(theta_i), less the smooth part.

    directions (S,3), density (S,) : values of either sign, 0 below the horizon, where Gaussians reach.
    weights (S,) : of squared differences. energy : integral of the target; square : weight of the squared error of it.
    chosen, angles (A,) : mask of the directions that come first here, and solid angles, of all A directions.
    """

    directions: Float[np.ndarray, "S 3"]
    density: Float[np.ndarray, " S"]
    weights: Float[np.ndarray, " S"]
    chosen: Bool[np.ndarray, " _"]
    angles: Float[np.ndarray, " _"]
    energy: float
    square: float

    @classmethod
    def of(
        cls,
        directions: Float[np.ndarray, "A 3"],
        angles: Float[np.ndarray, " A"],
        density: Float[np.ndarray, " A"],
        there: Float[np.ndarray, " A"],
    ) -> Wanted:
        """Make the target from values at A directions.

        density : as above. angles : solid angles. there (A,) : total value in each direction, non-negative, some of it
        above 0.
        """
        mean = there @ angles / np.pi
        weights = angles / (there + _ELSEWHERE * mean) ** _SEEN
        counts = weights * there**2
        whole = counts.sum()
        chosen = counts > _COUNTS * whole
        square = float(_WHOLE * whole / (there @ angles) ** 2)
        below = chosen & (directions[:, 2] < _BELOW)
        return cls(
            np.concatenate([directions[chosen], directions[below] * (1.0, 1.0, -1.0)]),
            np.append(density[chosen], np.zeros(below.sum())),
            np.append(weights[chosen], weights[below]),
            *(chosen, angles, float(density @ angles), square),
        )

    def nearest(self, mixture: Mixture, rounds: int) -> Mixture:
        """Refine the mixture by at most `rounds` steps that reduce the error (Levenberg 1944, Marquardt 1963)."""
        found, damping = mixture, _DAMPING
        parts = _Parts.of(found, self.directions)
        off = self._off(parts)
        normal, slope = self._normal(parts, off)
        for _ in range(rounds):
            diagonal = np.diag(normal)
            ridge = damping * diagonal + _STEP_RIDGE * diagonal.max()
            step = np.clip(np.linalg.solve(normal + np.diag(ridge), -slope), -_LONGEST, _LONGEST)
            other = _Parts.of(_stepped(found, parts, step), self.directions)
            left = self._off(other)
            before, after = self._squares(off), self._squares(left)
            if not after < before:
                damping = min(damping * _WORSE, _BOUNDS[1])
                continue
            found, parts, off, damping = other.mixture, other, left, max(damping * _BETTER, _BOUNDS[0])
            if before - after < _PROGRESS * before:
                break
            normal, slope = self._normal(parts, off)
        return found

    def spectra(self, mixture: Mixture, values: Float[np.ndarray, "A C"]) -> Float[np.ndarray, "Q1 C"]:
        """Fit the total of each part, in C numbers whose mean is `density`, by least squares with exact integrals."""
        parts = _Parts.of(mixture, self.directions)
        each = np.concatenate([parts.lobes, parts.rest[None]])
        each[each < _NOTHING * each.max()] = 0.0
        # In units of the shares, so that the ridge holds all alike to one multiple of the mixture.
        weighted = each * self.weights
        normal = weighted @ each.T + self.square * np.outer(mixture.shares, mixture.shares)
        energy = self.angles @ values
        above = weighted[:, : int(self.chosen.sum())] @ values[self.chosen]
        right = above + self.square * np.outer(mixture.shares, energy)
        multiple = right.sum(axis=0) / normal.sum()
        ridge = _RIDGE * np.trace(normal) / len(normal)
        found = (
            np.linalg.solve(normal + ridge * np.eye(len(normal)), right + ridge * multiple) * mixture.shares[:, None]
        )
        return found + np.outer(mixture.shares / mixture.shares.sum(), energy - found.sum(axis=0))

    def _off(self, parts: _Parts) -> tuple[Float[np.ndarray, " S"], float]:
        """Compute the excess over the target: by direction, and of the integral."""
        return parts.lobes.sum(axis=0) + parts.rest - self.density, float(parts.mixture.shares.sum()) - self.energy

    def _squares(self, off: tuple[Float[np.ndarray, " S"], float]) -> float:
        return float(self.weights @ off[0] ** 2) + self.square * off[1] ** 2

    def _normal(
        self, parts: _Parts, off: tuple[Float[np.ndarray, " S"], float]
    ) -> tuple[Float[np.ndarray, "P P"], Float[np.ndarray, " P"]]:
        """Compute the Gauss-Newton matrix and half the gradient, by the parameters of `_stepped`."""
        by, all_of = parts.derivatives(self.directions)
        weighted = by * self.weights
        normal = weighted @ by.T + self.square * np.outer(all_of, all_of)
        return normal, weighted @ off[0] + self.square * off[1] * all_of


@dataclass(frozen=True, eq=False)
class _Parts:
    """Mixture evaluated at S directions: values of each Gaussian, cosines to its axis, and values of the cosine.

    sides (2,Q,3) : two unit vectors perpendicular to each Gaussian's axis.
    """

    mixture: Mixture
    lobes: Float[np.ndarray, "Q S"]
    cosines: Float[np.ndarray, "Q S"]
    rest: Float[np.ndarray, " S"]
    sides: Float[np.ndarray, "2 Q 3"]

    @classmethod
    def of(cls, mixture: Mixture, directions: Float[np.ndarray, "S 3"]) -> _Parts:
        lobes, rest = mixture.densities(np.ascontiguousarray(directions.T))
        axes = mixture.axes
        # Any that is not along the axis will do: the world's that is farthest from it.
        least = np.eye(3)[np.argmin(np.abs(axes), axis=1)]
        one = np.cross(axes, least)
        one /= np.linalg.norm(one, axis=1)[:, None]
        return cls(mixture, lobes, axes @ directions.T, rest, np.stack([one, np.cross(axes, one)]))

    def derivatives(
        self, directions: Float[np.ndarray, "S 3"]
    ) -> tuple[Float[np.ndarray, "P S"], Float[np.ndarray, " P"]]:
        """Differentiate by log-sharpness, by shifts along both sides in units of the width, and by log-shares.

        Returns the derivatives of the value in each direction, and of the sum.
        """
        sharpness, shares = self.mixture.sharpness, self.mixture.shares
        # Derivative, in logarithms, of lambda / (1 - exp(-2 lambda)), a Gaussian's normalisation.
        norm = 1.0 - 2.0 * sharpness / np.expm1(2.0 * np.minimum(sharpness, -FARTHEST))
        by_sharpness = self.lobes * (sharpness[:, None] * (self.cosines - 1.0) + norm[:, None])
        by_sides = [np.sqrt(sharpness)[:, None] * self.lobes * (side @ directions.T) for side in self.sides]
        by = np.concatenate([by_sharpness, *by_sides, self.lobes, self.rest[None]])
        # Products of tiny numbers are subnormal, below 1e-308, which is a hundred times as slow.
        by[np.abs(by) < _NOTHING * np.abs(by).max()] = 0.0
        return by, np.concatenate([np.zeros(3 * len(sharpness)), shares])


def _stepped(mixture: Mixture, parts: _Parts, step: Float[np.ndarray, " P"]) -> Mixture:
    """Apply a step in the parameters of `_Parts.derivatives`."""
    count = len(mixture.sharpness)
    widths = 1.0 / np.sqrt(mixture.sharpness)
    sides = step[count : 3 * count].reshape(2, count) * widths
    axes = mixture.axes + np.einsum("kq,kqj->qj", sides, parts.sides)
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    shares = mixture.shares * np.exp(step[3 * count :])
    sharpness = np.maximum(mixture.sharpness * np.exp(step[:count]), BLUNTEST)
    return Mixture(axes, sharpness, np.maximum(shares, _LEAST * shares.sum()))
