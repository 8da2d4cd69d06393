"""Bounds of the difference of two layers by chance: order statistics of the noise that their files state.

A file states the mean and the 99th percentile of ΔE by which its pixels are off. The ΔE of a pixel is taken to follow
Weibull's distribution with these two, S(x) = exp(-(x / scale)^shape), which has the tails that references have: the
shape is 1.1 to 1.6, where noise alike everywhere would have 2. What a statistic of n pixels may come to is the quantile
that its order statistic keeps below: that of the largest lies at 1 - 1e-5 / n, far beyond the 99th percentile.
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
    """The distribution of ΔE of one pixel by chance, and of how many pixels there are; `scale` 0: no chance."""

    scale: float
    shape: float
    pixels: int

    @classmethod
    def of(cls, noises: Sequence[LayerNoise | None], pixels: int) -> Chance:
        """Return the chance of the difference of layers, whose noises are independent; as large as what is stated
        allows.

        noises : of each layer, None where it has none. pixels : that are compared, from as many of which mean and
        percentile were estimated.
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
        """Return the bound of a statistic such as "mean", "p99", "max" or "share over 1" by chance."""
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
        """Return a share of all pixels, `DEVIATIONS` above or below it: its square root has one deviation at any
        size."""
        return max(math.sqrt(share) + sign * 0.5 * DEVIATIONS / math.sqrt(self.pixels), 0.0) ** 2

    @property
    def mean(self) -> float:
        """Mean ΔE of a pixel."""
        return self.scale * math.gamma(1.0 + 1.0 / self.shape)

    def _beyond(self, share: float) -> float:
        """ΔE beyond which such a share of pixels lies."""
        return self.scale * math.log(1.0 / share) ** (1.0 / self.shape)


def _shape(ratio: float) -> float:
    """Weibull's shape whose 99th percentile is so many times its mean; held at the ends of `_SHAPES`."""
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
