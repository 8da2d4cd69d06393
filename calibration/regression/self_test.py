"""Self-test: a known difference injected into a row of every comparison, which must be found."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from ...spectral.difference import lab_from_xyz, xyz_from_lab
from ...spectral.formula import Formula
from ..report.statistics import FULL_COVERAGE, SelfCheck
from .change import change
from .row import Pixels

# Injected difference, in units of L*.
_RAISED = 1.0
# Pixels that are enough.
_MOST = 1 << 20


def injected(pixels: Pixels, formulas: Iterable[Formula], label: str) -> tuple[SelfCheck, ...]:
    """Raise L* of every pixel by 1; return the expected figure of each formula, by hand, and the one found.

    With a and b kept, every term except that of lightness is 0, so that the expected figure needs none of the tested
    code. CAM16-UCS has no such form; its pipeline is that of the others.
    """
    pixels, of = _some(pixels)
    lab = lab_from_xyz(pixels.xyz, pixels.white_xyz)
    raised = xyz_from_lab(lab + np.array([_RAISED, 0.0, 0.0]), pixels.white_xyz).astype(pixels.xyz.dtype)
    chosen = tuple(one for one in formulas if _by_hand(one) is not None)
    if not chosen:
        chosen = (Formula("CIE 1994"),)
    found = change(pixels, replace(pixels, xyz=raised), chosen, label, rounding=False)
    checks = []
    for one in chosen:
        hand = _by_hand(one)
        values = found.maps[one.name]
        compared = np.isfinite(values)
        if hand is None or not compared.any():
            continue
        expected = np.broadcast_to(hand(lab[..., 0]), values.shape)[compared].mean()
        words = f"L* of {of} of {label} raised by {_RAISED:g}, {one.name}"
        checks.append(SelfCheck(words, float(expected), float(values[compared].mean(dtype=np.float64))))
    return tuple(checks)


def _some(pixels: Pixels) -> tuple[Pixels, str]:
    """Return the tested rows of a large picture, about the middle, and their name."""
    height, width = pixels.coverage.shape
    rows = max(1, _MOST // width)
    if rows >= height:
        return pixels, "every pixel"
    part = slice((height - rows) // 2, (height - rows) // 2 + rows)
    mask = None if pixels.mask is None else pixels.mask[part]
    some = Pixels(pixels.xyz[part], pixels.coverage[part], pixels.white_xyz, pixels.unit_roundoff, mask=mask)
    return (some, f"rows {part.start} to {part.stop - 1}") if _covered(some) else (pixels, "every pixel")


def _covered(pixels: Pixels) -> bool:
    return bool((pixels.coverage >= FULL_COVERAGE).any())


def _by_hand(formula: Formula) -> Callable[[Float[np.ndarray, "*s"]], Float[np.ndarray, "*s"]] | None:
    """Compute ΔE of L* raised by `_RAISED` from the original L*."""
    if formula.name in ("CIE 1976", "CIE 1994"):
        return lambda lightness: np.full(np.shape(lightness), _RAISED)
    if formula.name == "CIE 2000":
        return _by_hand_2000
    if formula.cmc is not None:
        weight = formula.cmc[0]
        return lambda lightness: _RAISED / (weight * _cmc_scale(lightness))
    return None


def _by_hand_2000(lightness: Float[np.ndarray, "*s"]) -> Float[np.ndarray, "*s"]:
    """Compute S_L of CIE 142-2001 at the mean of both lightnesses."""
    off = (lightness + 0.5 * _RAISED - 50.0) ** 2
    return _RAISED / (1.0 + 0.015 * off / np.sqrt(20.0 + off))


def _cmc_scale(lightness: Float[np.ndarray, "*s"]) -> Float[np.ndarray, "*s"]:
    """Compute S_L of CMC (Clarke, McDonald and Rigg 1984)."""
    return np.where(lightness < 16.0, 0.511, 0.040975 * lightness / (1.0 + 0.01765 * lightness))
