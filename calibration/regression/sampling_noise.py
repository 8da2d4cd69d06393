"""Bounds of the difference of two layers by chance: order statistics of the noise that their files state.

A file states the mean and the 99th percentile of its pixels' error in ΔE. The ΔE of a pixel is modelled by Weibull's
distribution with these two, S(x) = exp(-(x / scale)^shape), whose tails match those of references: the shape is 1.1 to
1.6, where uniform noise would have 2. The bound of a statistic of n pixels is a high quantile of its order statistic:
that of the largest is at 1 - 1e-5 / n, far beyond the 99th percentile.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from .criteria import quantile_of, share_limit
from .row import LayerNoise

#: Standard deviations that a mean, a share or a percentile may lie above what is expected: 1 in 1000 lies beyond.
DEVIATIONS = 3.1
#: Share of pictures in which the largest pixel lies above its bound, where noise is as their files state.
EXCEEDED = 1e-5
#: Share by which a stated noise is too small: drawing ends where it seems small enough. Measured; 0 to 4 %.
UNDERSTATED = 0.05
# Shapes between which the distribution is looked for, and halvings.
_SHAPES, _HALVINGS = (0.15, 20.0), 60


@dataclass(frozen=True)
class Chance:
    """Distribution of the chance ΔE of a pixel, and the number of pixels; `scale` 0: no chance."""

    scale: float
    shape: float
    pixels: int

    @classmethod
    def of(cls, noises: Sequence[LayerNoise | None], pixels: int) -> Chance:
        """Combine the independent noises of layers into the chance of their difference, an upper bound.

        noises : of each layer, None without any. pixels : number compared, from which mean and percentile were
        estimated.
        """
        known = [one for one in noises if one is not None]
        mean, p99 = (math.hypot(*(getattr(one, name) for one in known)) for name in ("mean", "p99"))
        if not (mean > 0.0 and pixels):
            return cls(0.0, 1.0, pixels)
        first = _shape(p99 / mean)
        # Both figures are themselves drawn: of so many pixels, on as many sides.
        spread = _variation(first) / math.sqrt(pixels * len(known))
        mean *= 1.0 + UNDERSTATED + DEVIATIONS * spread
        density = first * math.log(100.0)
        p99 *= 1.0 + UNDERSTATED + DEVIATIONS * math.sqrt(99.0 / (pixels * len(known))) / density
        shape = _shape(p99 / mean)
        return cls(mean / math.gamma(1.0 + 1.0 / shape), shape, pixels)

    def floor(self, name: str) -> float:
        """Compute the bound by chance of a statistic such as "mean", "p99", "max" or "share over 1"."""
        if self.scale == 0.0:
            return 0.0
        if name == "mean":
            return self.mean * (1.0 + DEVIATIONS * _variation(self.shape) / math.sqrt(self.pixels))
        if name == "max":
            return self._beyond(EXCEEDED / self.pixels)
        limit = share_limit(name)
        if limit is not None:
            return min(self._off(math.exp(-((limit / self.scale) ** self.shape)), 1.0), 1.0)
        return self._beyond(max(self._off(1.0 - quantile_of(name), -1.0), EXCEEDED / self.pixels))

    def _off(self, share: float, sign: float) -> float:
        """Shift a fraction of all pixels by `DEVIATIONS`: its square root has one deviation at any size."""
        return max(math.sqrt(share) + sign * 0.5 * DEVIATIONS / math.sqrt(self.pixels), 0.0) ** 2

    @property
    def mean(self) -> float:
        """Mean ΔE of a pixel."""
        return self.scale * math.gamma(1.0 + 1.0 / self.shape)

    def _beyond(self, share: float) -> float:
        """Compute the ΔE exceeded by that fraction of pixels."""
        return self.scale * math.log(1.0 / share) ** (1.0 / self.shape)


def _shape(ratio: float) -> float:
    """Find Weibull's shape from the ratio of its 99th percentile to its mean; clamped to the ends of `_SHAPES`."""
    low, high = _SHAPES
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if math.log(100.0) ** (1.0 / middle) / math.gamma(1.0 + 1.0 / middle) > ratio:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def _variation(shape: float) -> float:
    """Standard deviation over mean."""
    first, second = (math.gamma(1.0 + one / shape) for one in (1.0, 2.0))
    return math.sqrt(max(second / first**2 - 1.0, 0.0))
