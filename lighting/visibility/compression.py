"""Compression of maps of signed distances by principal components, with a byte or half a byte per term and site.

Weighted principal component analysis (Wang et al. 2009, eq. 24, minimises unweighted squares over the hemisphere):

- Distances are compressed, v = tanh(angle / `SOFT`), so that no terms are spent on distances to far boundaries.
- Weights are large near a boundary, where an error moves a shadow, and grow with the cosine above the horizon. Texels
  below it have no values of their own and almost no weight; the axes extrapolate them.

Axes and codes are fitted alternately, each by linear least squares with the other fixed. Finally the axes are rotated
so that codes decay as fast as possible. The first terms, which vary most, have a byte each, in steps of 1 / 127 of the
largest; the others half a byte, in steps of 1 / 7 of four times their root mean square, with the few beyond clamped.
Quantisation adds little to the truncation error.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from ..environment import octahedral
from ..vectors import dot
from .tracing import BELOW, MAP, texels

#: Signed angles are stored as tanh(angle / SOFT), radians.
SOFT = np.pi / 4.0
#: Largest number of terms, and of those of a vertex with two sites, as on sheets. Inside a car the error of direct
#: light (p95) is a twelfth lower with the former, and visibility takes a fifth longer to compute.
MOST_TERMS, FEW_TERMS = 96, 64
# Number of terms with a byte each, above `FEW_TERMS` terms and otherwise; multiples of 4, the channels of a texel.
_BYTES, _FEW_BYTES = 32, 16
# Angle from a boundary (rad) at which a texel's weight falls to 1/e; its floor far from boundaries; and below the
# horizon.
_NEAR, _OPEN, _UNSEEN = np.deg2rad(20.0), 0.1, 1e-3
# Weight of a texel at the horizon, to which its cosine is added.
_GRAZING = 0.1
# Truncation error, root mean square of compressed distances, that is accepted for fewer terms.
_LEFT_OUT = 0.01
# Alternations of axes and codes, and the ridge for axes that no weight determines.
_TURNS, _RIDGE = 2, 1e-4
# Steps of conjugate gradients for codes, and the side of the map of normals whose sites share a preconditioner: shadows
# agree with the exact solution to a hundredth, in a quarter of its time. The preconditioner's weights are those at this
# angle (rad) from a boundary.
_STEPS, _NORMALS, _USUAL = 4, 8, np.pi / 4.0
# Range of a half byte, -7 to 7, in root mean squares of its term.
_HALF, _REACH = 7, 4.0
# Codes packed per block: less than a megabyte.
_PACKED = 1024


@dataclass(frozen=True, eq=False)
class Basis:
    """Mean (texels,) and orthogonal axes (texels, K) of compressed distances, float32."""

    mean: Float[np.ndarray, " texels"]
    axes: Float[np.ndarray, "texels K"]

    def __reduce__(self) -> tuple:
        """Pickle without the inverses, which each process recomputes."""
        return Basis, (self.mean, self.axes)

    @cached_property
    def inverses(self) -> Float[np.ndarray, "normals K K"]:
        """Inverse normal matrices of the least squares, for sites of each direction of normals with typical weights."""
        normals = octahedral.texel_directions(_NORMALS).reshape(-1, 3)
        weights = importance(np.full((len(normals), MAP**2), _USUAL, dtype=np.float32), normals)
        matrices = np.stack([(self.axes.T * one) @ self.axes for one in weights])
        return np.linalg.inv(matrices.astype(np.float64)).astype(np.float32)

    @property
    def hidden(self) -> Float[np.ndarray, " K"]:
        """Code of a fully occluded site."""
        return (bent(np.full(MAP**2, -0.5 * np.pi, dtype=np.float32)) - self.mean) @ self.axes


def bent(distances: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Compress signed angles for storage."""
    return np.tanh(distances / SOFT)


def straight(values: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Return signed angles from stored values, which interpolation and rounding may carry slightly beyond those of pi /
    2.
    """
    most = np.tanh(0.5 * np.pi / SOFT)
    return np.clip(SOFT * np.arctanh(np.clip(values, -most, most)), -0.5 * np.pi, 0.5 * np.pi)


def straightening(values: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Differentiate signed angles with respect to stored values; 0 where these are clamped."""
    held = np.abs(values) >= np.tanh(0.5 * np.pi / SOFT)
    return np.where(held, 0.0, SOFT / (1.0 - np.square(np.where(held, 0.0, values))))


def importance(
    distances: Float[np.ndarray, "n texels"], normals: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "n texels"]:
    """Return the weights of texels at sites with these normals."""
    sines = normals.astype(np.float32) @ texels().T
    weights = np.exp(np.abs(distances) * np.float32(-1.0 / _NEAR))
    weights += np.float32(_OPEN)
    weights *= np.maximum(sines, np.float32(0.0)) + np.float32(_GRAZING)
    weights[sines <= -BELOW] = _UNSEEN
    return weights


def code_bytes(terms: int) -> int:
    """Count the bytes of one site's codes."""
    whole = whole_bytes(terms)
    return whole + (terms - whole) // 2


def whole_bytes(terms: int) -> int:
    """Count the terms that have a byte each."""
    return min(terms, _BYTES if terms > FEW_TERMS else _FEW_BYTES)


def fitted_basis(
    values: Float[np.ndarray, "n texels"],
    weights: Float[np.ndarray, "n texels"],
    normals: Float[np.ndarray, "n 3"],
    dark: Bool[np.ndarray, " n"],
    most: int = MOST_TERMS,
) -> tuple[Basis, Float[np.ndarray, "n K"]]:
    """Fit the basis of compressed distances of n sites, with the fewest terms of acceptable truncation error, and the
    sites' codes.

    dark : fully occluded sites, which share one code. most : largest number of terms.
    """
    basis = _principal(values, most)
    if not basis.axes.shape[1]:
        return basis, np.zeros((len(values), 0), dtype=np.float32)
    # Dark sites are merged into one, the last, with the sum of their weights.
    light, some = np.flatnonzero(~dark), np.flatnonzero(dark)
    count, row = np.ones(len(light)), np.cumsum(~dark) - 1
    if len(some):
        values = np.concatenate([values[light], values[some[:1]]])
        weights = np.concatenate([weights[light], weights[some].sum(axis=0, keepdims=True)])
        row[some], count = len(light), np.append(count, len(some))

    def codes_in(basis: Basis) -> Float[np.ndarray, "m K"]:
        found = encoded(basis, values[: len(light)], weights[: len(light)], normals[light])
        return np.concatenate([found, basis.hidden[None]]) if len(some) else found

    for _ in range(_TURNS):
        basis = _turned(basis, codes_in(basis), values, weights)
    codes = codes_in(basis)
    middle = np.average(codes, axis=0, weights=count).astype(np.float32)
    spread = (codes - middle).astype(np.float64)
    most_first = np.linalg.eigh((count * spread.T) @ spread)[1][:, ::-1].astype(np.float32)
    basis = Basis(basis.mean + basis.axes @ middle, np.ascontiguousarray(basis.axes @ most_first))
    codes = ((codes - middle) @ most_first)[row]
    codes[dark] = basis.hidden
    return basis, codes


def quick_basis(values: Float[np.ndarray, "n texels"], dark: Bool[np.ndarray, " n"], most: int = MOST_TERMS) -> Basis:
    """Find a basis of compressed distances of n sites in a fifth of the time: unweighted principal axes.

    Its truncation error for these sites, and for those between them, equals that of `fitted_basis` for a whole scene.
    """
    # Both extremes, all free and all hidden, are always included.
    ends = np.float32(np.tanh(0.5 * np.pi / SOFT)) * np.array([[1.0], [-1.0]], np.float32)
    known = np.concatenate([values[~dark], np.broadcast_to(ends, (2, MAP**2))])
    return _principal(known, most)


def _principal(values: Float[np.ndarray, "n texels"], most: int) -> Basis:
    """Return the fewest principal axes of compressed distances with an acceptable truncation error."""
    from scipy.linalg import eigh

    mean = values.mean(axis=0)
    spread = values - mean
    covariance, last = spread.T @ spread / len(values), values.shape[1] - 1
    variances, axes = eigh(covariance, subset_by_index=[max(last + 1 - most, 0), last], driver="evr")
    variances, axes = np.maximum(variances[::-1], 0.0), axes[:, ::-1]
    left = np.trace(covariance) - np.cumsum(np.concatenate([[0.0], variances]))
    needed = np.count_nonzero(left > _LEFT_OUT**2 * values.shape[1])
    terms = min(most, -(-needed // 4) * 4)
    return Basis(mean.astype(np.float32), np.ascontiguousarray(axes[:, :terms], dtype=np.float32))


def encoded(
    basis: Basis,
    values: Float[np.ndarray, "n texels"],
    weights: Float[np.ndarray, "n texels"],
    normals: Float[np.ndarray, "n 3"],
) -> Float[np.ndarray, "n K"]:
    """Encode values by weighted least squares, with a few steps of preconditioned conjugate gradients.

    The unweighted projection is the starting point, and remains where weights determine nothing. Sites of similar
    normals have similar weights, and share a preconditioner.
    """
    if not basis.axes.shape[1]:
        return np.zeros((len(values), 0), dtype=np.float32)
    facing = octahedral.texel_at(normals.astype(np.float32), _NORMALS)
    order = np.argsort(facing, kind="stable")
    alike = [
        (some, facing[some[0]]) for some in np.split(order, np.flatnonzero(np.diff(facing[order])) + 1) if len(some)
    ]

    def preconditioned(rows: Float[np.ndarray, "n K"]) -> Float[np.ndarray, "n K"]:
        found = np.empty_like(rows)
        for some, direction in alike:
            found[some] = rows[some] @ basis.inverses[direction]
        return found

    axes, off = basis.axes, values - basis.mean
    codes = off @ axes
    left = (weights * (off - codes @ axes.T)) @ axes
    way = preconditioned(left)
    size = dot(left, way)
    for _ in range(_STEPS):
        pushed = (weights * (way @ axes.T)) @ axes
        along = dot(way, pushed)
        # `along` is 0 only if no residual is left.
        share = np.divide(size, along, out=np.zeros_like(size), where=along > 0.0)[:, None]
        codes += share * way
        left -= share * pushed
        eased = preconditioned(left)
        before, size = size, dot(left, eased)
        way = eased + np.divide(size, before, out=np.zeros_like(size), where=before > 0.0)[:, None] * way
    return codes


def pack_codes(
    codes: Float[np.ndarray, "S K"],
) -> tuple[Int[np.ndarray, "S B"], UInt8[np.ndarray, "S H"], Float[np.ndarray, " K"]]:
    """Quantise codes to integers, with a step size for each term.

    Returns
    -------
    whole (S, B) : the first `whole_bytes` terms, from -127 to 127.
    halves (S, (K - B) / 2) : two of the other terms per byte, the first in the lower half: 1 to 15, with 8 for 0.
    steps (K,) : step sizes.
    """
    whole = whole_bytes(codes.shape[1])
    largest, squares = np.zeros(whole, dtype=codes.dtype), np.zeros(codes.shape[1] - whole)
    for start in range(0, len(codes), _PACKED):
        some = codes[start : start + _PACKED]
        np.maximum(largest, np.abs(some[:, :whole]).max(axis=0), out=largest)
        squares += np.square(some[:, whole:], dtype=np.float64).sum(axis=0)
    usual = np.sqrt(squares / max(len(codes), 1)) * (_REACH / _HALF)
    steps = np.concatenate([largest / 127.0, usual])
    steps = np.where(steps > 0.0, steps, 1.0)
    large = np.empty((len(codes), whole), dtype=np.int8)
    small = np.empty((len(codes), len(squares) // 2), dtype=np.uint8)
    for start in range(0, len(codes), _PACKED):
        some = slice(start, start + _PACKED)
        number = np.rint(codes[some] / steps)
        large[some] = number[:, :whole]
        number = np.clip(number[:, whole:], -_HALF, _HALF) + 8.0
        small[some] = number[:, ::2] + 16.0 * number[:, 1::2]
    return large, small, steps.astype(np.float32)


def unpack_codes(whole: Int[np.ndarray, "*n B"], halves: UInt8[np.ndarray, "*n H"]) -> Float[np.ndarray, "*n K"]:
    """Return the integers of all terms, as float32."""
    small = np.stack([halves & 15, halves >> 4], axis=-1).reshape(*halves.shape[:-1], -1)
    return np.concatenate([whole.astype(np.float32), small.astype(np.float32) - np.float32(8.0)], axis=-1)


def _turned(basis: Basis, codes: np.ndarray, values: np.ndarray, weights: np.ndarray) -> Basis:
    """Refit the basis to the codes found with the given one, and orthogonalise its axes."""
    extended = np.concatenate([codes, np.ones((len(codes), 1), dtype=np.float32)], axis=1)
    before = np.concatenate([basis.axes, basis.mean[:, None]], axis=1)
    # Weak ridge towards the previous axes, for texels that hardly any site sees.
    hold = 1e-5 * len(values)
    right = (weights * values).T @ extended + np.float32(hold) * before
    solved = _solved(weights.T, _products(extended), right, hold)
    axes, _ = np.linalg.qr(solved[:, :-1])
    return Basis(np.ascontiguousarray(solved[:, -1]), np.ascontiguousarray(axes))


def _products(known: Float[np.ndarray, "m K"]) -> Float[np.ndarray, "m P"]:
    """Multiply every pair of columns, in the order of `_packing`."""
    across = np.ascontiguousarray(known.T)
    row, column = _packing(len(across))
    found = np.empty((len(row), len(known)), dtype=known.dtype)
    for number, (one, other) in enumerate(zip(row, column, strict=True)):
        np.multiply(across[one], across[other], out=found[number])
    return found.T


@lru_cache(maxsize=4)
def _packing(terms: int) -> tuple[Int[np.ndarray, " P"], Int[np.ndarray, " P"]]:
    """Return the row and column indices of a symmetric matrix's lower triangle in rectangular full packed storage.

    Source: Gustavson et al., ACM TOMS 37(2), 2010: a triangle's room, and level 3 BLAS in it.
    """
    from scipy.linalg.lapack import dtrttf

    number = np.arange(float(terms * terms)).reshape(terms, terms)
    packed, _ = dtrttf(number, uplo="L")
    return tuple(np.divmod(packed.astype(np.int64), terms))


def _solved(
    weights: Float[np.ndarray, "n m"],
    products: Float[np.ndarray, "m P"],
    right: Float[np.ndarray, "n K"],
    hold: float,
) -> Float[np.ndarray, "n K"]:
    """Solve (known^T diag(w) known + ridge) x = right for each row w of weights.

    products : see `_products`. One multiplication computes the matrices of all rows, as triangles packed for LAPACK.
    """
    from scipy.linalg.lapack import spftrf, spftrs

    terms = right.shape[1]
    row, column = _packing(terms)
    triangles = weights @ products
    triangles[:, row == column] += np.float32(_RIDGE + hold)
    found = np.empty((len(weights), terms), dtype=np.float32)
    for number, (triangle, one) in enumerate(zip(triangles, right.astype(np.float32), strict=True)):
        factor, failed = spftrf(terms, triangle, uplo="L")
        if failed:
            # Too nearly singular for a Cholesky factorisation in float32.
            whole = np.zeros((terms, terms))
            whole[row, column] = whole[column, row] = triangle
            found[number] = np.linalg.lstsq(whole, one.astype(np.float64), rcond=None)[0]
        else:
            found[number] = spftrs(terms, factor, one, uplo="L")[0].ravel()
    return found
