"""Sampling noise of a reference: estimated from two halves, reduced to a target, and reported.

The two halves of an image are sampled independently in the same way. The error of their mean is distributed like half
their difference, which is the difference between one half and the mean. The ΔE94 of these two is reported, by pixel.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int

from ...spectral.difference import delta_e_xyz, lab_from_xyz

#: Share of the budget allowed for a reference's own noise, mean over pixels.
NOISE_SHARE = 0.1
#: Default of the largest number of directions of each kind per pixel and half.
MOST_DIRECTIONS = 4096
# Directions per pixel of the first round.
_FIRST_DIRECTIONS = 32
# Side of a tile of pixels that are refined together, and the share of the noise that remains after doubling its
# directions.
_TILE, _LEFT = 16, 0.6
# Assumed power of directions against noise: initially, and its range once measured.
_POWER, _POWERS = -np.log(2.0) / np.log(_LEFT), (0.8, 2.5)
# Coverage of judged pixels; others are darkened by premultiplication.
_WHOLE = 1.0 - 1e-3

#: Callback that receives the share done, 0 to 1.
Heard = Callable[[float], object]


def unheard(share: float) -> None:
    """Ignore the share done."""


@runtime_checkable
class Sums(Protocol):
    """Monte Carlo sums in two halves; `extend` reports the share of its own work done.

    directions (H W,) : number per pixel of each kind, in each half. covered (H W,) : mask of pixels that see a surface.
        halves (2, H, W, M, 3) : XYZ of each half.
    """

    directions: Int[np.ndarray, " P"]
    covered: Bool[np.ndarray, " P"]

    @property
    def halves(self) -> Float[np.ndarray, "2 H W M 3"]:
        """XYZ of each half, (2, H, W, M, 3)."""
        ...

    def extend(self, directions: int, pixels: Int[np.ndarray, " n"] | None = None, heard: Heard = unheard) -> None:
        """Continue pixels (ascending), with equal numbers of directions so far, to `directions`."""
        ...


class Together:
    """Several sums of one image, with the same number of directions per pixel."""

    def __init__(self, sums: Sequence[Sums]) -> None:
        self._sums = sums
        self.directions, self.covered = sums[0].directions, sums[0].covered

    @property
    def halves(self) -> Float[np.ndarray, "2 H W M 3"]:
        """Sum of the halves."""
        return np.sum([each.halves for each in self._sums], axis=0)

    def extend(self, directions: int, pixels: Int[np.ndarray, " n"] | None = None, heard: Heard = unheard) -> None:
        """Extend each of the sums."""
        for number, each in enumerate(self._sums):
            each.extend(directions, pixels, lambda share, number=number: heard((number + share) / len(self._sums)))


@dataclass(frozen=True)
class ReferenceNoiseEstimate:
    """Sampling noise of a reference's pixels, in ΔE94 over its wholly covered and lit pixels.

    mean, p99 : one per image; `aimed` : target of the largest mean.
    directions : largest number for a pixel, of both kinds and halves.
    limited : whether the limit of directions was reached before the target.
    """

    mean: tuple[float, ...]
    p99: tuple[float, ...]
    aimed: float
    directions: int
    limited: bool

    @property
    def words(self) -> str:
        """Description of the noise."""
        said = f"noise of ΔE94 {max(self.mean):.2g} (mean) and {max(self.p99):.2g} (p99)"
        said += f" with {self.directions:,} directions a pixel"
        return f"{said}, the most allowed: {self.aimed:.2g} was aimed at" if self.limited else said


@dataclass(frozen=True, eq=False)
class GatheredHalves:
    """Result of `draw_until_quiet`: XYZ (M, H, W, 3), noise ΔE94 (M, n) of judged pixels, and the number of
    directions.
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
    """Sample adaptively until the noise meets its target: each round doubles the directions of the noisiest tiles.

    beside : XYZ by other lights. aimed : target of the mean noise, ΔE94. most : largest number of directions of each
    kind and half. say : called with the estimated share done and a description; the share decreases if the noise falls
    more slowly than expected.
    """
    directions = min(_FIRST_DIRECTIONS, most)
    words, tiles = "drawing", _Tiles(coverage.shape)
    # Directions of all pixels so far, and in total, which is unknown until the noise is measured.
    drawn, total, first = 0, np.inf, None

    def draw(to: int, pixels: Int[np.ndarray, " n"]) -> None:
        """Sample and report progress."""
        nonlocal drawn
        more = int((to - sums.directions[pixels]).sum())
        sums.extend(to, pixels, lambda share: say(min((drawn + share * more) / total, 1.0), words))
        drawn += more

    draw(directions, np.flatnonzero(sums.covered))
    while True:
        halves = np.moveaxis(sums.halves, 3, 1)
        judged = _judged(halves, beside, coverage)
        off = noise_of(halves, beside, judged, whites)
        # The mean of few pixels is itself uncertain: two of its standard errors are added.
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
        # Extrapolated from the decrease of the noise so far; the next round is known.
        first = first or (drawn, noise)
        power = np.clip(np.log(drawn / first[0]) / np.log(first[1] / noise), *_POWERS) if noise < first[1] else _POWER
        total = min(drawn * (noise * uncertain / aimed) ** power, most * np.count_nonzero(sums.covered))
        total = max(total, drawn + int((doubled - sums.directions[further]).sum()))
        for had in np.unique(sums.directions[further]):
            draw(min(2 * int(had), most), further[sums.directions[further] == had])


class _Tiles:
    """Tiles of `_TILE` x `_TILE` pixels for adaptive sampling.

    Tiles decide, not pixels, since the halves of single pixels may agree by chance.
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
        """Return the pixels, ascending, of the fewest noisiest tiles for which doubled directions should suffice.

        may : mask of pixels below the limit.
        """
        count = int(self._of.max()) + 1
        of_judged = self._of[judged.ravel()]
        size = np.bincount(of_judged, minlength=count)
        worst = int(np.argmax(off.mean(axis=1))) if off.size else 0
        total = np.bincount(of_judged, off[worst], minlength=count)
        open_ = np.bincount(self._of, may, minlength=count) > 0
        # Tiles without a judged pixel surround the others and are refined with them.
        mean = np.where(size > 0, total / np.maximum(size, 1), np.inf)
        order = np.flatnonzero(open_)[np.argsort(-mean[open_], kind="stable")]
        left = total.sum() - np.cumsum((1.0 - _LEFT) * total[order])
        needed = int(np.searchsorted(-left, -aimed * size.sum())) + 1
        return np.flatnonzero(np.isin(self._of, order[:needed]) & may)


def _judged(
    halves: Float[np.ndarray, "2 M H W 3"], beside: Float[np.ndarray, "M H W 3"], coverage: Float[np.ndarray, "H W"]
) -> Bool[np.ndarray, "H W"]:
    """Return a mask of lit pixels that are wholly covered, or covered at all if none is."""
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
    """Estimate the noise of each judged pixel in each image, ΔE94; `beside` is XYZ by other lights."""
    half, mean, more = (one[:, judged] for one in (halves[0], halves.mean(axis=0), beside))
    # Refuses an invalid white; values are made relative to the whites.
    lab_from_xyz(whites, whites.min(axis=0))
    whole, part = (one / whites[:, None] for one in (mean + more, half + more))
    return np.ascontiguousarray(delta_e_xyz(whole, part, np.ones(3)))


def noise_stated(found: Sequence[GatheredHalves], aimed: float) -> ReferenceNoiseEstimate:
    """Combine the noise of images rendered in bands."""
    off = np.concatenate([one.off for one in found], axis=1)
    mean, p99 = (off.mean(axis=1), np.percentile(off, 99.0, axis=1)) if off.size else (np.zeros(len(off)),) * 2
    limited = any(one.limited for one in found)
    return ReferenceNoiseEstimate(
        tuple(mean.tolist()), tuple(p99.tolist()), aimed, max(one.directions for one in found), limited
    )
