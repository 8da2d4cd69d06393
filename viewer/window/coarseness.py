"""Adaptive resolution of moving images, by measured frame times."""

from __future__ import annotations

import math

#: Largest side, in window pixels, of a pixel of a moving image.
COARSEST = 4
#: Largest seconds per moving image, and for trying a finer resolution.
SLOW, QUICK = 0.1, 0.06
# Target seconds per image, and the largest pixel side accepted for each.
_RATES = ((1.0 / 60.0, 2), (1.0 / 30.0, 3), (SLOW, COARSEST))
# Number of images at a resolution before another is chosen, since the first one allocates textures.
_PICTURES = 2


class Coarseness:
    """Side, in window pixels, of a pixel of a moving image.

    The finest resolution with 60 images per second, down to half of the window's; else with 30, down to a third; else
    one that is not slow. Untried resolutions are extrapolated from tried ones: an image's time falls at most in
    proportion to its pixels.

    >>> coarseness = Coarseness()
    >>> for seconds in (0.015, 0.015, 0.03, 0.03, 0.015, 0.015):
    ...     coarseness.took(seconds)
    >>> coarseness.pixels
    2
    """

    def __init__(self) -> None:
        self.pixels = 2
        self._shortest: dict[int, float] = {}
        self._count = 0

    def rest(self) -> None:
        """Discard measured times after a change of scene or size, or when the machine was busy."""
        self._shortest.clear()
        self._count = 0

    def took(self, seconds: float) -> None:
        """Record the time of an image and choose the next resolution."""
        now = self.pixels
        self._shortest[now] = min(seconds, self._shortest.get(now, seconds))
        self._count += 1
        if self._count >= _PICTURES or seconds > SLOW:
            self.pixels = self._chosen(seconds)
        if self.pixels != now:
            if self._count < _PICTURES:
                # An image during which shaders were compiled is not representative.
                del self._shortest[now]
            self._count = 0

    def _chosen(self, seconds: float) -> int:
        now, finer = self.pixels, self.pixels - 1
        if seconds > SLOW:
            return min(COARSEST, now + 1)
        if finer and finer not in self._shortest and self._expected(finer) <= QUICK:
            return finer
        for limit, coarsest in _RATES:
            for pixels in range(1, coarsest + 1):
                if self._at_least(pixels) <= limit:
                    return now + (pixels > now) - (pixels < now)
        return now

    def _expected(self, finer: int) -> float:
        """Estimate the seconds of an image at the next finer resolution, proportional to pixels unless a coarser one
        shows the share.
        """
        here, coarser = self._shortest[finer + 1], self._shortest.get(finer + 2)
        shares = [1.0 / pixels**2 for pixels in (finer, finer + 1, finer + 2)]
        if coarser is None:
            return here * shares[0] / shares[1]
        return here + max(here - coarser, 0.0) * (shares[0] - shares[1]) / (shares[1] - shares[2])

    def _at_least(self, pixels: int) -> float:
        """Return a lower bound of the seconds of an image at a resolution; infinite for one too fine to try."""
        if pixels in self._shortest:
            return self._shortest[pixels]
        finer = [taken * (one / pixels) ** 2 for one, taken in self._shortest.items() if one < pixels]
        return max(finer, default=math.inf)
