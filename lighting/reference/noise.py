"""Sampling noise of a reference: found from two halves, kept below an aim, and stated.

The two halves of a picture are drawn alike and independently. Their difference tells the noise: the error of the mean
is spread as half the difference of the halves is, which is the difference of one half and the mean. ΔE94 of those two
is what is stated, by pixel.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int

from ...spectral.difference import delta_e_xyz, lab_from_xyz

#: Share of the budget that a reference's own noise may be, as the mean of its pixels.
NOISE_SHARE = 0.1
#: Directions of each kind for a pixel, in each half, after which no more are drawn.
MOST_DIRECTIONS = 4096
# Directions per pixel of the first round.
_FIRST_DIRECTIONS = 32
# Side of a square of pixels that get more directions together, and the share of the noise that twice as many leave.
_TILE, _LEFT = 16, 0.6
# Directions grow by this power of the noise that is to go: before it is known, and as it may turn out.
_POWER, _POWERS = -np.log(2.0) / np.log(_LEFT), (0.8, 2.5)
# Pixels that are covered as much are judged: others are dark by premultiplication.
_WHOLE = 1.0 - 1e-3

#: Hears the share that is done, 0 to 1.
Heard = Callable[[float], object]


def unheard(share: float) -> None:
    """Hear of no share."""


@runtime_checkable
class Sums(Protocol):
    """Sums over what is drawn, in two halves; `extend` tells the share of its own work that is done.

    directions (H W,) : how many each pixel has had of a kind, in each half. covered (H W,) : whether it meets anything.
    halves (2, H, W, M, 3) : XYZ by each half alone.
    """

    directions: Int[np.ndarray, " P"]
    covered: Bool[np.ndarray, " P"]

    @property
    def halves(self) -> Float[np.ndarray, "2 H W M 3"]:
        """XYZ by each half alone, (2, H, W, M, 3)."""
        ...

    def extend(self, directions: int, pixels: Int[np.ndarray, " n"] | None = None, heard: Heard = unheard) -> None:
        """Carry some pixels (ascending), all of which have had as many, on to so many."""
        ...


class Together:
    """Several sums of one picture, each pixel of which is drawn as often for each."""

    def __init__(self, sums: Sequence[Sums]) -> None:
        self._sums = sums
        self.directions, self.covered = sums[0].directions, sums[0].covered

    @property
    def halves(self) -> Float[np.ndarray, "2 H W M 3"]:
        """Halves of all."""
        return np.sum([each.halves for each in self._sums], axis=0)

    def extend(self, directions: int, pixels: Int[np.ndarray, " n"] | None = None, heard: Heard = unheard) -> None:
        """Each of them."""
        for number, each in enumerate(self._sums):
            each.extend(directions, pixels, lambda share, number=number: heard((number + share) / len(self._sums)))


@dataclass(frozen=True)
class ReferenceNoiseEstimate:
    """Sampling noise of a reference's pixels, in ΔE94 over its wholly covered and lit pixels.

    mean, p99 : one a picture; `aimed` : what the largest mean should not exceed.
    directions : drawn for a pixel at the most, of both kinds and in both halves.
    limited : whether no more were allowed although the noise was not yet as small as that.
    """

    mean: tuple[float, ...]
    p99: tuple[float, ...]
    aimed: float
    directions: int
    limited: bool

    @property
    def words(self) -> str:
        """Noise in words."""
        said = f"noise of ΔE94 {max(self.mean):.2g} (mean) and {max(self.p99):.2g} (p99)"
        said += f" with {self.directions:,} directions a pixel"
        return f"{said}, the most allowed: {self.aimed:.2g} was aimed at" if self.limited else said


@dataclass(frozen=True, eq=False)
class GatheredHalves:
    """Outcome of `draw_until_quiet`: XYZ (M, H, W, 3), ΔE94 (M, n) by which judged pixels are off, and how many
    directions were drawn.
    """

    xyz: Float[np.ndarray, "M H W 3"]
    off: Float[np.ndarray, "M n"]
    directions: int
    limited: bool


def draw_until_quiet(
    sums: Sums,
    beside: Float[np.ndarray, "M H W 3"],
    coverage: Float[np.ndarray, "H W"],
    whites: Float[np.ndarray, "M 3"],
    aimed: float,
    most: int,
    say: Callable[[float, str], None],
) -> GatheredHalves:
    """Draw, twice as much each time where there is most noise, until there is little.

    beside : what other lights give. aimed : mean ΔE94 of the noise. most : directions of each kind and half, at which
    it ends in any case. say : is told the share of all this that is done, about, and what is being done; a share falls
    where the noise falls more slowly than it did.
    """
    directions = min(_FIRST_DIRECTIONS, most)
    words, tiles = "drawing", _Tiles(coverage.shape)
    # Directions of all pixels so far, and in all: unknown before the noise is.
    drawn, total, first = 0, np.inf, None

    def draw(to: int, pixels: Int[np.ndarray, " n"]) -> None:
        """Draw, and tell how far that is."""
        nonlocal drawn
        more = int((to - sums.directions[pixels]).sum())
        sums.extend(to, pixels, lambda share: say(min((drawn + share * more) / total, 1.0), words))
        drawn += more

    draw(directions, np.flatnonzero(sums.covered))
    while True:
        halves = np.moveaxis(sums.halves, 3, 1)
        judged = _judged(halves, beside, coverage)
        off = noise_of(halves, beside, judged, whites)
        # The mean of few pixels is itself uncertain: two of its standard errors are counted with it.
        uncertain = 1.0 + 1.5 / np.sqrt(max(off.shape[1], 1))
        noise = float(off.mean(axis=1).max()) if off.size else 0.0
        enough = noise * uncertain <= aimed
        further = tiles.noisiest(off, judged, sums.covered & (sums.directions < most), aimed / uncertain)
        if enough or not len(further):
            return GatheredHalves(
                beside + halves.mean(axis=0), off, 4 * int(sums.directions.max(initial=0)), not enough
            )
        doubled = np.minimum(2 * sums.directions[further], most)
        so_far = 4 * int(doubled.max())
        words = f"drawing {so_far:,} directions a pixel; noise of ΔE94 {noise:.2g} so far, {aimed:.2g} is aimed at"
        # By how the noise falls as more are drawn; what comes next is known.
        first = first or (drawn, noise)
        power = np.clip(np.log(drawn / first[0]) / np.log(first[1] / noise), *_POWERS) if noise < first[1] else _POWER
        total = min(drawn * (noise * uncertain / aimed) ** power, most * np.count_nonzero(sums.covered))
        total = max(total, drawn + int((doubled - sums.directions[further]).sum()))
        for had in np.unique(sums.directions[further]):
            draw(min(2 * int(had), most), further[sums.directions[further] == had])


class _Tiles:
    """A picture in squares of `_TILE` pixels, which get more directions each where there is more noise.

    A square and no pixel says where more are drawn: a pixel whose halves agree by chance is not left as it is for that.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        rows, columns = (np.arange(size) // _TILE for size in shape)
        self._of = (rows[:, None] * (columns[-1] + 1) + columns).ravel()

    def noisiest(
        self,
        off: Float[np.ndarray, "M n"],
        judged: Bool[np.ndarray, "H W"],
        may: Bool[np.ndarray, " P"],
        aimed: float,
    ) -> Int[np.ndarray, " k"]:
        """Pixels, ascending, of so many of the noisiest squares that twice as many directions there should do.

        may : which pixels may have more.
        """
        count = int(self._of.max()) + 1
        of_judged = self._of[judged.ravel()]
        size = np.bincount(of_judged, minlength=count)
        worst = int(np.argmax(off.mean(axis=1))) if off.size else 0
        total = np.bincount(of_judged, off[worst], minlength=count)
        open_ = np.bincount(self._of, may, minlength=count) > 0
        # Squares without a judged pixel lie about the others and go with them.
        mean = np.where(size > 0, total / np.maximum(size, 1), np.inf)
        order = np.flatnonzero(open_)[np.argsort(-mean[open_], kind="stable")]
        left = total.sum() - np.cumsum((1.0 - _LEFT) * total[order])
        needed = int(np.searchsorted(-left, -aimed * size.sum())) + 1
        return np.flatnonzero(np.isin(self._of, order[:needed]) & may)


def _judged(
    halves: Float[np.ndarray, "2 M H W 3"], beside: Float[np.ndarray, "M H W 3"], coverage: Float[np.ndarray, "H W"]
) -> Bool[np.ndarray, "H W"]:
    """Wholly covered pixels (covered ones, where none is) that light reaches."""
    judged = coverage >= _WHOLE
    if not judged.any():
        judged = coverage > 0.0
    return judged & ((halves != 0.0).any(axis=(0, 1, 4)) | (beside != 0.0).any(axis=(0, 3)))


def noise_of(
    halves: Float[np.ndarray, "2 M H W 3"],
    beside: Float[np.ndarray, "M H W 3"],
    judged: Bool[np.ndarray, "H W"],
    whites: Float[np.ndarray, "M 3"],
) -> Float[np.ndarray, "M n"]:
    """ΔE94 by which each judged pixel is off by chance, in each picture; `beside` is what other lights give."""
    half, mean, more = (one[:, judged] for one in (halves[0], halves.mean(axis=0), beside))
    # Refuses a white that is none; relative to them, all pictures have one of 1.
    lab_from_xyz(whites, whites.min(axis=0))
    whole, part = (one / whites[:, None] for one in (mean + more, half + more))
    return np.ascontiguousarray(delta_e_xyz(whole, part, np.ones(3)))


def noise_stated(found: Sequence[GatheredHalves], aimed: float) -> ReferenceNoiseEstimate:
    """Return the noise of pictures that were made in parts, one above the other."""
    off = np.concatenate([one.off for one in found], axis=1)
    mean, p99 = (off.mean(axis=1), np.percentile(off, 99.0, axis=1)) if off.size else (np.zeros(len(off)),) * 2
    limited = any(one.limited for one in found)
    return ReferenceNoiseEstimate(
        tuple(mean.tolist()), tuple(p99.tolist()), aimed, max(one.directions for one in found), limited
    )
