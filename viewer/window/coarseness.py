"""Resolution of a moving picture: as many pixels as leave it fluent, by what pictures have taken."""

from __future__ import annotations

import math

#: Pixels of the window along a side of one of a moving picture, at most.
COARSEST = 4
#: Seconds that a moving picture may take at most, and one of an untried finer resolution.
SLOW, QUICK = 0.1, 0.06
# Seconds a picture, as few as there are, and the pixels along a side that they are worth at most.
_RATES = ((1.0 / 60.0, 2), (1.0 / 30.0, 3), (SLOW, COARSEST))
# Pictures of a resolution before another is chosen: the first one makes textures.
_PICTURES = 2


class Coarseness:
    """Pixels of the window along a side of one of a moving picture.

    The finest resolution of 60 pictures a second, down to half of the window's; where none is, of 30, down to a third;
    else one that is not slow. Resolutions not tried yet are judged by those that were: a picture's time falls at most
    with its pixels.

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
        """Forget what pictures took: another scene, another size, or the machine was busy."""
        self._shortest.clear()
        self._count = 0

    def took(self, seconds: float) -> None:
        """Choose the resolution of the next picture, after one of the present resolution."""
        now = self.pixels
        self._shortest[now] = min(seconds, self._shortest.get(now, seconds))
        self._count += 1
        if self._count >= _PICTURES or seconds > SLOW:
            self.pixels = self._chosen(seconds)
        if self.pixels != now:
            if self._count < _PICTURES:
                # One picture that compiled shaders says nothing of the others.
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
        """Return what a picture of the next finer resolution takes, in seconds, as if all of the time went into pixels
        unless a coarser one tells which share.
        """
        here, coarser = self._shortest[finer + 1], self._shortest.get(finer + 2)
        shares = [1.0 / pixels**2 for pixels in (finer, finer + 1, finer + 2)]
        if coarser is None:
            return here * shares[0] / shares[1]
        return here + max(here - coarser, 0.0) * (shares[0] - shares[1]) / (shares[1] - shares[2])

    def _at_least(self, pixels: int) -> float:
        """Return what a picture of that resolution takes at least, in seconds; infinite for one too fine to try."""
        if pixels in self._shortest:
            return self._shortest[pixels]
        finer = [taken * (one / pixels) ** 2 for one, taken in self._shortest.items() if one < pixels]
        return max(finer, default=math.inf)
