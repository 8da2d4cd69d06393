"""Error statistics of a picture: ΔE of every comparable pixel, and the few figures for signature."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from ...runtime.errors import ComparisonError, InputError
from ...spectral.difference import FormulaName, delta_e_xyz, lab_from_xyz, xyz_from_lab

# A pixel on a silhouette compares two ways of anti-aliasing, not two colours.
FULL_COVERAGE = 1.0 - 1e-3


@dataclass(frozen=True)
class DeltaEStatistics:
    """Mean, 95th and 99th percentile and maximum of a ΔE map.

    Parameters
    ----------
    mean, p95, p99, max : ΔE over the compared pixels that hold a number.
    pixels : how many those are.
    undefined : compared pixels without a number. They enter none of the figures, so a row that has any does not pass.
    """

    mean: float
    p95: float
    p99: float
    max: float
    pixels: int
    undefined: int = 0

    def __str__(self) -> str:
        figures = f"mean {self.mean:.3f}, p95 {self.p95:.3f}, p99 {self.p99:.3f}, max {self.max:.3f}"
        missing = f", {self.undefined} without a number" if self.undefined else ""
        return f"{figures} over {self.pixels} pixels{missing}"


@dataclass(frozen=True)
class SelfCheck:
    """A known difference injected into a picture, and the result of its comparison.

    Parameters
    ----------
    label : change of the reference, in words.
    expected : mean ΔE of the formula by hand.
    found : mean ΔE of the comparison.
    """

    label: str
    expected: float
    found: float

    @property
    def passed(self) -> bool:
        """True if the difference was reproduced to a thousandth of a ΔE unit."""
        return abs(self.found - self.expected) <= 1e-3


def compared_pixels(
    coverage: Float[np.ndarray, "H W"],
    reference_xyz: Float[np.ndarray, "H W 3"],
    sample_xyz: Float[np.ndarray, "H W 3"],
) -> Bool[np.ndarray, "H W"]:
    """Select pixels that the scene covers wholly and that are lit in either picture.

    A pixel that is exactly black in both agrees whatever the material is; counting it would flatter the mean. Only if
    every covered pixel is black, as on a surface that reflects nothing, are they all compared.
    """
    covered = coverage >= FULL_COVERAGE
    lit = covered & ((reference_xyz != 0).any(axis=-1) | (sample_xyz != 0).any(axis=-1))
    return lit if lit.any() else covered


def delta_e_map(
    reference_xyz: Float[np.ndarray, "H W 3"],
    sample_xyz: Float[np.ndarray, "_ _ 3"],
    white_xyz: Float[np.ndarray, "3"],
    coverage: Float[np.ndarray, "_ _"],
    method: FormulaName = "CIE 1994",
) -> Float[np.ndarray, "H W"]:
    """Compute ΔE (H,W) of two pictures of one scene under one light.

    NaN marks a pixel that is not compared, infinity a compared one without a number: a missing value is never mistaken
    for an agreement.

    Parameters
    ----------
    reference_xyz : the truth; CIE 1994 weighs by its chroma, so the two sides must not be swapped.
    sample_xyz : the picture that is judged.
    white_xyz : white of the light that both are seen under.
    coverage : fraction of each pixel that the scene covers; the smaller one if two renderers differ.

    Raises
    ------
    ComparisonError : the two sides share memory (a picture is not compared with itself), or differ in size.
    """
    if reference_xyz.shape != sample_xyz.shape or reference_xyz.shape[:-1] != coverage.shape:
        raise ComparisonError(
            f"pictures of different sizes cannot be compared: reference {reference_xyz.shape}, "
            f"sample {sample_xyz.shape}, coverage {coverage.shape}"
        )
    if np.may_share_memory(reference_xyz, sample_xyz):
        raise ComparisonError("reference and sample are the same array: a picture compared with itself says nothing")
    difference = delta_e_xyz(reference_xyz, sample_xyz, white_xyz, method)
    difference = np.where(np.isfinite(difference), difference, np.inf)
    return np.where(compared_pixels(coverage, reference_xyz, sample_xyz), difference, np.nan)


def delta_e_statistics(
    delta_e: Float[np.ndarray, "*batch"], compared: Bool[np.ndarray, "*batch"] | None = None
) -> DeltaEStatistics:
    """Compute statistics of a map of `delta_e_map`, over its compared pixels or those of them in `compared`.

    >>> delta_e_statistics(np.array([0.0, 1.0, np.nan, np.inf]))
    DeltaEStatistics(mean=0.5, p95=0.95, p99=0.99, max=1.0, pixels=2, undefined=1)

    Raises
    ------
    InputError : no pixel is left to compare.
    """
    chosen = delta_e[~np.isnan(delta_e) if compared is None else ~np.isnan(delta_e) & compared]
    values = chosen[np.isfinite(chosen)].astype(np.float64)
    if not values.size:
        raise InputError(
            "no pixel of the two pictures can be compared",
            found=f"{chosen.size} pixels, none with a number" if chosen.size else "no pixel that the scene covers",
            expected="a surface that wholly covers at least one pixel and holds numbers",
            hint="look at the pictures: is the camera on the part?",
        )
    p95, p99 = np.percentile(values, (95.0, 99.0))
    return DeltaEStatistics(
        mean=float(values.mean()),
        p95=float(p95),
        p99=float(p99),
        max=float(values.max()),
        pixels=int(values.size),
        undefined=int(chosen.size - values.size),
    )


def mean_shift(
    delta_e: Float[np.ndarray, "H W"], reference_lab: Float[np.ndarray, "H W 3"], sample_lab: Float[np.ndarray, "_ _ 3"]
) -> tuple[float, float, float] | None:
    """Average ΔL*, Δa*, Δb* of sample less reference over the pixels with a number; None without any."""
    off = (sample_lab - reference_lab)[np.isfinite(delta_e)]
    if not len(off):
        return None
    lightness, a, b = off.astype(np.float64).mean(axis=0).tolist()
    return lightness, a, b


def self_check(
    reference_xyz: Float[np.ndarray, "H W 3"],
    white_xyz: Float[np.ndarray, "3"],
    coverage: Float[np.ndarray, "H W"],
    delta: float = 1.0,
) -> tuple[SelfCheck, ...]:
    """Shift a reference by known amounts and compare these with the report's ΔE94.

    L* up by `delta` is ΔE94 = delta. C* up by `delta` at constant hue is delta / (1 + 0.045 C*) by the chroma of the
    *reference* (CIE 116-1995): it comes out wrong if the two sides are swapped or the white is another one. The shifted
    picture is stored as float32, as the renderers' pictures are.
    """
    lab = lab_from_xyz(reference_xyz, white_xyz)
    chroma = np.hypot(lab[..., 1], lab[..., 2])
    lighter = lab + np.array([delta, 0.0, 0.0])
    unit = np.where(chroma[..., None] > 1e-9, lab[..., 1:] / np.maximum(chroma, 1e-9)[..., None], [1.0, 0.0])
    stronger = np.concatenate([lab[..., :1], lab[..., 1:] + delta * unit], axis=-1)
    checks = []
    for label, shifted, by_hand in (
        (f"L* of every pixel raised by {delta:g}", lighter, np.full(chroma.shape, delta)),
        (f"C*ab of every pixel raised by {delta:g}, hue kept", stronger, delta / (1.0 + 0.045 * chroma)),
    ):
        sample = xyz_from_lab(shifted, white_xyz).astype(np.float32)
        found = delta_e_statistics(delta_e_map(reference_xyz, sample, white_xyz, coverage))
        counted = compared_pixels(coverage, reference_xyz, sample) & np.isfinite(by_hand)
        checks.append(SelfCheck(label, float(by_hand[counted].mean()), found.mean))
    return tuple(checks)


def verdict_limits(budget: float) -> tuple[float, float]:
    """Limits of p99 that a picture passes within, and is near within."""
    return budget, 1.5 * budget


def verdict(statistics: DeltaEStatistics, budget: float) -> Literal["pass", "near", "over"]:
    """`pass`: p99 within the budget; `near`: within one and a half budgets; `over`: beyond, or numbers missing."""
    if statistics.undefined or statistics.p99 > verdict_limits(budget)[1]:
        return "over"
    return "pass" if statistics.p99 <= budget else "near"


def beside(value: float, *limits: float) -> str:
    """Format a ΔE with two decimals, or with as many as show it on the correct side of each limit.

    >>> beside(0.302, 0.3), beside(0.302, 0.5), beside(0.3, 0.3), beside(0.0001, 0.3)
    ('0.302', '0.30', '0.30', '<0.01')
    """
    if 0.0 < value < 0.005 and all(limit >= 0.01 for limit in limits):
        return "<0.01"
    for decimals in range(2, 9):
        text = f"{value:.{decimals}f}"
        if all((float(text) > limit) == (value > limit) for limit in limits):
            return text
    return repr(value)
