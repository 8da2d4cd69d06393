"""All bounces of light at once: what their sequence tends to, out of few of them.

Bounces v_(k+1) = A v_k become alike: what each adds to the next is soon the same pattern, and less. Sums of the first
of them, mixed so that what they leave is least (reduced rank extrapolation; Sidi, "Vector Extrapolation Methods with
Applications", SIAM 2017, section 2.3), are as near to the end as several times as many bounces: a closed box of white
0.99, of which each bounce keeps nearly all, takes a handful in place of some 600.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from ....lighting.transfer.bounces import ENOUGH, MOST, Interreflection, largest_difference
from ....lighting.transfer.regions import RadiantRegions, Regions
from ....runtime.errors import InputError

# Bounces that are mixed; then it begins anew with what they leave.
_DEPTH = 12
# Regularisation of all squares beside the largest, 1, so that no mixture hangs on rounding.
_STIFF = 1e-9
# Y from which on L* is a cubic root.
_DARK = 0.008856


def settled(
    operator: Any,
    regions: Regions | RadiantRegions,
    first: Float[np.ndarray, "S kinds J"],
    to_xyz: Float[np.ndarray, "F 3"],
    most_y: Float[np.ndarray, " F"],
    white: Float[np.ndarray, "3"],
    enough: float = ENOUGH,
    most: int = MOST,
    beside: Float[np.ndarray, "S 3"] | None = None,
) -> Interreflection:
    """Extrapolate the limit of `bounces.passed_on`, within ΔE94 `enough`.

    most_y : Y that 1 of each coefficient, of any sign, may have (`Coefficients.most_y`). Other parameters are those of
    `passed_on`. `left` is estimated of the residual, as a geometric series at the slowest pace of all bounces;
    `bound` holds for any.

    Raises
    ------
    InputError : `most` bounces are not enough.
    """
    to_xyz = to_xyz.astype(first.dtype)
    xyz = np.zeros((len(first), 3)) if beside is None else beside.astype(np.float64)
    reflected_most = (float(operator.sum(axis=1).max()) if len(first) else 0.0) * regions.largest
    total, pace, count, left = np.zeros_like(first), 0.0, 0, 0.0
    rest, rest_seen = first, _seen(first, to_xyz)
    while count < most and rest.any():
        bounces, seen = [rest], [rest_seen]
        mixture = counts = np.ones(1)
        important: np.ndarray | None = None
        squares = np.zeros((_DEPTH, _DEPTH))
        for depth in range(_DEPTH):
            sent = bounces[-1].reshape(len(first), -1)
            bounces.append(regions.reflected(np.asarray(operator @ sent).reshape(first.shape)))
            seen.append(_seen(bounces[-1], to_xyz))
            count += 1
            before, now = (float(np.abs(one).sum()) for one in seen[-2:])
            pace = max(pace, min(now / before, reflected_most)) if before > 0.0 else pace
            if important is None:
                important = np.maximum((xyz + seen[0] + seen[1])[:, 1:2], _DARK) ** (-4.0 / 3.0)
            weighted = seen[-1] * important
            squares[: depth + 1, depth] = squares[depth, : depth + 1] = [float((weighted * s).sum()) for s in seen[1:]]
            mixture = _least(squares[: depth + 1, : depth + 1])
            # Sums of bounces, mixed, are bounces that count as much as all sums that they are in.
            counts = np.cumsum(mixture[::-1])[::-1]
            rest_seen = _mixed(seen[1:], mixture)
            there = xyz + _mixed(seen[:-1], counts) + rest_seen
            left = largest_difference(there, rest_seen * (pace / (1.0 - pace)), white, enough)
            if left <= enough or count >= most:
                break
        total = total + _mixed(bounces[:-1], counts)
        xyz = xyz + _mixed(seen[:-1], counts)
        rest = _mixed(bounces[1:], mixture)
        if left <= enough:
            # Light of the largest amount which any site has of each coefficient.
            bound = float(np.abs(rest).max(axis=0).ravel() @ most_y) * reflected_most / (1.0 - reflected_most)
            return Interreflection(count, first, total + rest, left, bound)
    if not rest.any():
        return Interreflection(count, first, total, 0.0, 0.0)
    words = f"ΔE94 {left:.2g} is still missing after {most} bounces"
    raise InputError("light that does not end", found=words, expected=f"at most {enough:g}", hint="allow more bounces")


def _seen(coefficients: Float[np.ndarray, "S kinds J"], to_xyz: Float[np.ndarray, "F 3"]) -> Float[np.ndarray, "S 3"]:
    return (coefficients.reshape(len(coefficients), -1) @ to_xyz).astype(np.float64)


def _least(squares: Float[np.ndarray, "m m"]) -> Float[np.ndarray, " m"]:
    """Shares with the sum 1 of which the mixture has the least square; `squares` are products of each two."""
    size = np.sqrt(np.diag(squares))
    if not (size > 0.0).all():
        # Nothing comes of the last bounce.
        return (np.arange(len(size)) == np.flatnonzero(size == 0.0)[0]).astype(np.float64)
    alike = squares / np.outer(size, size) + _STIFF * np.eye(len(size))
    found = np.linalg.solve(alike, 1.0 / size) / size
    return found / found.sum()


def _mixed(vectors: Sequence[np.ndarray], shares: Float[np.ndarray, " m"]) -> np.ndarray:
    found = np.zeros_like(vectors[0])
    for vector, share in zip(vectors, shares.tolist(), strict=True):
        found += vector * np.asarray(share, dtype=found.dtype)
    return found
