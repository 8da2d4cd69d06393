"""Decomposition of an environment: its bright parts as a few spherical Gaussians, and the remainder as an environment.

The bright part is the excess over the luminance that a given share of the sphere exceeds. The remainder is the map
clamped there: never negative, and together with the excess exactly the original light. Gaussians are fitted to the
excess by expectation maximisation of the von Mises-Fisher mixture (Banerjee, Dhillon, Ghosh and Sra 2005).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ...materials.core.spherical_gaussian import sphere_integral
from ...runtime.errors import InputError
from . import convolution, latlong
from .environment import EnvironmentLight

#: Share of the sphere that exceeds the threshold of brightness.
SHARE = 0.03
#: Rows of the map that Gaussians are fitted on: finer texels move them by less than they are wide.
ROWS = 128
# Steps of expectation maximisation; a lobe of less than this share of the whole is let go.
_STEPS, _LEAST_SHARE = 40, 1e-6


@dataclass(frozen=True, eq=False)
class BrightParts:
    """Lobes of luminance exp(lambda (v . p - 1)) times amplitude, in the world.

    axis (n, 3) : unit. sharpness (n,) : lambda > 0. amplitude (n, K) : cd/m^2, of each of the environment's spectra.
    """

    axis: Float[np.ndarray, "n 3"]
    sharpness: Float[np.ndarray, " n"]
    amplitude: Float[np.ndarray, "n K"]

    def luminance(self, directions: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N K"]:
        """Return the luminance of the lobes in unit world directions, cd/m^2."""
        apart = np.sum((directions[:, None] - self.axis) ** 2, axis=-1)
        return np.exp(-0.5 * self.sharpness * apart) @ self.amplitude


def taken_apart(
    environment: EnvironmentLight, count: int = 8, share: float = SHARE
) -> tuple[BrightParts, EnvironmentLight | None]:
    """Return at most `count` lobes for the bright part, and the remainder; None if none of that comes from above.

    share : of the sphere, in (0, 1]; with 1 the whole map is bright.

    Raises
    ------
    InputError : `count` below 1, or `share` out of range.
    """
    if count < 1:
        raise InputError("no lobes", field="count", found=count, expected="1 or more")
    if not 0.0 < share <= 1.0:
        raise InputError("not a share of the sphere", field="share", found=share, expected="more than 0, at most 1")
    fields = environment.fields
    weights = np.repeat(latlong.solid_angles(*fields.shape[1:])[:, None], fields.shape[2], axis=1)
    total = fields.sum(axis=0)
    kept = np.minimum(total, _exceeded(total, weights, share)) / np.where(total > 0.0, total, 1.0)
    bright, rest = fields * (1.0 - kept), fields * kept
    lobes = _fitted(bright, environment.world_from_map, count)
    # Light from above is what an environment is counted by.
    lux = float(environment._relative_illuminances(rest).sum())
    return lobes, replace(environment, fields=rest, illuminance_lux=lux) if lux > 0.0 else None


def _exceeded(total: np.ndarray, weights: np.ndarray, share: float) -> float:
    """Return the luminance that a share of the sphere exceeds."""
    if share == 1.0:
        return 0.0
    order = np.argsort(total, axis=None)[::-1]
    covered = np.cumsum(weights.ravel()[order])
    return float(total.ravel()[order[np.searchsorted(covered, share * covered[-1])]])


def _fitted(bright: np.ndarray, world_from_map: np.ndarray, count: int) -> BrightParts:
    bright = convolution.Resolutions(bright).at_least(min(ROWS, bright.shape[1]))
    height, width = bright.shape[1:]
    to = latlong.texel_directions(height, width).reshape(-1, 3) @ world_from_map.T
    power = bright.reshape(len(bright), -1) * np.repeat(latlong.solid_angles(height, width), width)
    lit = power.sum(axis=0) > 0.0
    to, power = to[lit], power[:, lit]
    weight = power.sum(axis=0)
    if not len(weight):
        return BrightParts(np.zeros((0, 3)), np.zeros(0), np.zeros((0, len(bright))))
    # A texel's own width: nothing is known to be narrower (the variance of a tent as wide as two of them).
    sharpest = 6.0 / (np.pi / height) ** 2
    axis, sharpness, member = _expected_mixture(to, weight, count, sharpest)
    return BrightParts(axis, sharpness, (power @ member).T / sphere_integral(sharpness)[:, None])


def _expected_mixture(
    to: Float[np.ndarray, "m 3"], weight: Float[np.ndarray, " m"], count: int, sharpest: float
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"], Float[np.ndarray, "m n"]]:
    """Fit axes, sharpness and memberships of at most `count` lobes by expectation maximisation.

    A von Mises-Fisher mixture: Banerjee, Dhillon, Ghosh and Sra 2005. to : unit directions; weight : of each, > 0.
    sharpest : largest sharpness of a lobe. A membership (m, n) is the fraction of a direction's weight that belongs to
    a lobe; each row sums to 1.
    """
    axis, sharpness = _starts(to, weight, count, sharpest)
    shares, member = np.full(len(axis), 1.0 / len(axis)), np.ones((len(to), len(axis)))
    for _ in range(_STEPS):
        apart = np.sum((to[:, None] - axis) ** 2, axis=-1)
        # ln of the normalised Gaussian, so that nothing far off underflows to nowhere.
        density = np.log(shares * sharpness / -np.expm1(-2.0 * sharpness)) - 0.5 * sharpness * apart
        member = np.exp(density - density.max(axis=1, keepdims=True))
        member /= member.sum(axis=1, keepdims=True)
        held = member * weight[:, None]
        sums = held.T @ to
        amount, length = held.sum(axis=0), np.linalg.norm(sums, axis=1)
        alive = (amount > _LEAST_SHARE * weight.sum()) & (length > 0.0)
        axis, mean = sums[alive] / length[alive, None], length[alive] / amount[alive]
        shares, member = amount[alive] / amount[alive].sum(), member[:, alive]
        # Banerjee et al. 2005, eq. 4.4.
        sharpness = np.clip(mean * (3.0 - mean**2) / np.maximum(1.0 - mean**2, 1e-12), 1e-3, sharpest)
    return axis, sharpness, member / member.sum(axis=1, keepdims=True)


def _starts(to: np.ndarray, weight: np.ndarray, count: int, sharpest: float) -> tuple[np.ndarray, np.ndarray]:
    """Choose initial axes, each with the largest product of weight and squared distance to those before."""
    chosen = [int(np.argmax(weight))]
    away = np.full(len(to), np.inf)
    while len(chosen) < min(count, len(to)):
        away = np.minimum(away, np.sum((to - to[chosen[-1]]) ** 2, axis=1))
        if not (weight * away).max() > 0.0:
            break
        chosen.append(int(np.argmax(weight * away)))
    return to[chosen], np.full(len(chosen), min(30.0, sharpest))
