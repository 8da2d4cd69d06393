"""Change of the colours of one layer, and the part of it that files cannot resolve."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Bool, Float

from ...runtime.errors import ComparisonError
from ...spectral.difference import lab_from_xyz
from ...spectral.formula import Formula
from ...spectral.image_difference import image_delta_e
from ..report.statistics import FULL_COVERAGE
from .row import Pixels

#: Whites of one light and observer may differ by this: single precision, and what readers round to.
WHITE_TOLERANCE = 1e-5
#: A pixel of which one side covers at least this much more than the other shows another shape.
RESHAPED = 0.5
# Pixels at once: some 150 MB of intermediates.
_BLOCK = 1 << 20
# Below so many pixels, double precision costs nothing.
_FEW = 4096
_IN_SINGLE = ("CIE 1994", "CIE 2000")
# Every way, but for its opposite, in which three numbers can be off at once: one of them is the farthest colour.
_CORNERS = ((1.0, -1.0, 1.0), (1.0, 1.0, 1.0), (1.0, 1.0, -1.0), (-1.0, 1.0, 1.0))
# Half steps (h,W,3) for either side, of a block of rows.
_Steps = Callable[[slice, tuple[int, ...]], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Change:
    """One layer of one row, before and after.

    Parameters
    ----------
    maps : ΔE (H,W) by the name of the formula; NaN is not compared, infinite has no number.
    floors : the same for rounding in both files, uniformly distributed: smaller differences are not significant.
    bounds : the same for the largest rounding in every pixel, which maxima are compared with; for the first formula,
        and for those whose maximum is requested.
    reshaped : fraction of the covered pixels whose coverage differs by more than half a pixel.
    identical : True if both have the same bytes.
    shift : mean ΔL*, Δa*, Δb* of the compared pixels. worst : row and column of the largest ΔE of the first formula.
    before_lab, after_lab : of that pixel.
    """

    maps: Mapping[str, Float[np.ndarray, "H W"]]
    floors: Mapping[str, Float[np.ndarray, "H W"]]
    bounds: Mapping[str, Float[np.ndarray, "H W"]]
    reshaped: float
    identical: bool
    shift: tuple[float, float, float]
    worst: tuple[int, int]
    before_lab: tuple[float, float, float]
    after_lab: tuple[float, float, float]


def change(
    before: Pixels,
    after: Pixels,
    formulas: Iterable[Formula],
    label: str,
    rounding: bool = True,
    largest: Iterable[Formula] = (),
) -> Change:
    """Compare two layers; `label` names the row in errors.

    Without `rounding`, there are no floors and bounds; bounds are computed for the first formula and for those in
    `largest`. Compared are pixels that both sides cover wholly, that belong to the row of either, and that are not
    black in both.

    Raises
    ------
    ComparisonError : other sizes, other whites, the same array twice, or no pixel that can be compared.
    """
    if before.xyz.shape != after.xyz.shape:
        a, b = (f"{one.shape[1]} x {one.shape[0]}" for one in (before.xyz, after.xyz))
        raise ComparisonError(f"{label}: pictures of different sizes\n  found: {a}; and {b}\n  expected: one size")
    if np.may_share_memory(before.xyz, after.xyz):
        raise ComparisonError(f"{label}: both sides are the same array: a comparison with itself says nothing")
    if not np.allclose(before.white_xyz, after.white_xyz, rtol=0.0, atol=WHITE_TOLERANCE):
        a, b = (", ".join(f"{value:.5f}" for value in one.white_xyz) for one in (before, after))
        raise ComparisonError(
            f"{label}: colours relative to different whites cannot be compared\n"
            f"  found: white XYZ {a}; and {b}\n"
            "  expected: one light and one observer for both sides, whatever they are called"
        )
    compared = _compared(before, after)
    if not compared.any():
        raise ComparisonError(f"{label}: no pixel is covered wholly on both sides")
    formulas = tuple(formulas)
    white = before.white_xyz
    maps = {one.name: _map(one, before.xyz, lambda block: after.xyz[block], white, compared) for one in formulas}
    identical = before.equals(after)
    floors, bounds = {}, {}
    if rounding:
        floors = _rounding(before, after, formulas, compared, _drawn)
        corners = [
            _rounding(before, after, dict.fromkeys((formulas[0], *largest)), compared, partial(_cornered, corner))
            for corner in _CORNERS
        ]
        # NaN is in the same pixels of all.
        bounds = {name: np.maximum.reduce([one[name] for one in corners]) for name in corners[0]}
    first = maps[formulas[0].name]
    at = np.unravel_index(int(np.argmax(np.where(np.isnan(first), -1.0, first))), first.shape)
    labs = [lab_from_xyz(one.xyz[at], white) for one in (before, after)]
    return Change(
        maps,
        floors,
        bounds,
        _reshaped(before, after),
        identical,
        _shift(before, after, compared),
        (int(at[0]), int(at[1])),
        _triple(labs[0]),
        _triple(labs[1]),
    )


def _triple(values: np.ndarray) -> tuple[float, float, float]:
    a, b, c = values.tolist()
    return a, b, c


def _compared(before: Pixels, after: Pixels) -> Bool[np.ndarray, "H W"]:
    covered = (before.coverage >= FULL_COVERAGE) & (after.coverage >= FULL_COVERAGE)
    # A black pixel that is black in both agrees whatever the material is.
    masks = [one.mask for one in (before, after)]
    if masks[0] is not None and masks[1] is not None:
        # A pixel dark on one side and lit on the other has changed.
        covered &= masks[0] | masks[1]
    lit = covered & ((before.xyz != 0).any(axis=-1) | (after.xyz != 0).any(axis=-1))
    return lit if lit.any() else covered


def _reshaped(before: Pixels, after: Pixels) -> float:
    either = (before.coverage > 0) | (after.coverage > 0)
    apart = np.abs(before.coverage - after.coverage) > RESHAPED
    return float(np.count_nonzero(apart)) / max(int(np.count_nonzero(either)), 1)


def _map(
    formula: Formula,
    reference: Float[np.ndarray, "H W 3"],
    sample: Callable[[slice], Float[np.ndarray, "h W 3"]],
    white: Float[np.ndarray, "3"],
    compared: Bool[np.ndarray, "H W"],
) -> Float[np.ndarray, "H W"]:
    """Compute ΔE of the compared pixels, in blocks of whole rows; `sample` returns those of a block."""
    height, width = compared.shape
    found = np.full((height, width), np.nan, np.float32 if compared.size >= _FEW else np.float64)
    rows = max(1, _BLOCK // width)
    for start in range(0, height, rows):
        block = slice(start, min(start + rows, height))
        chosen = compared[block]
        a, b = reference[block][chosen], sample(block)[chosen]
        if compared.size >= _FEW and formula.name in _IN_SINGLE:
            values = image_delta_e(lab_from_xyz(a, white), lab_from_xyz(b, white), formula.name)
        else:
            values = formula(a, b, white)
        found[block][chosen] = np.where(np.isfinite(values), values, np.inf)
    return found


def _rounding(
    before: Pixels, after: Pixels, formulas: Iterable[Formula], compared: Bool[np.ndarray, "H W"], how: _Steps
) -> dict[str, Float[np.ndarray, "H W"]]:
    """Compute ΔE of the first side against itself, with rounding errors on either side."""

    def moved(block: slice) -> Float[np.ndarray, "h W 3"]:
        xyz = before.xyz[block]
        ours, theirs = how(block, xyz.shape)
        if before.nudged is not None and after.nudged is not None:
            return before.nudged(block, ours - theirs)
        xyz = xyz + before.half_spacing(block) * ours - after.half_spacing(block) * theirs
        for one, steps in ((before, ours), (after, theirs)):
            if one.nudged is not None:
                xyz = xyz + one.nudged(block, steps) - one.xyz[block]
        return xyz

    return {one.name: _map(one, before.xyz, moved, before.white_xyz, compared) for one in formulas}


def _drawn(block: slice, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Draw half steps for either side uniformly; reproducible for each block."""
    draw = np.random.default_rng(block.start)
    return draw.uniform(-1.0, 1.0, shape), draw.uniform(-1.0, 1.0, shape)


def _cornered(
    corner: tuple[float, float, float], block: slice, shape: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the largest half steps, with opposite signs on the two sides."""
    del block
    steps = np.broadcast_to(corner, shape)
    return steps, -steps


def _shift(before: Pixels, after: Pixels, compared: Bool[np.ndarray, "H W"]) -> tuple[float, float, float]:
    """Average the shift of colours in blocks, as the maps are computed."""
    total, count = np.zeros(3), 0
    rows = max(1, _BLOCK // compared.shape[1])
    for start in range(0, compared.shape[0], rows):
        block = slice(start, start + rows)
        chosen = compared[block]
        a, b = (lab_from_xyz(one.xyz[block][chosen], before.white_xyz) for one in (before, after))
        known = np.isfinite(a).all(axis=-1) & np.isfinite(b).all(axis=-1)
        total += (b - a)[known].sum(axis=0)
        count += int(np.count_nonzero(known))
    return _triple(total / max(count, 1))
