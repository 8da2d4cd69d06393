"""Wavelength grids, and moving values from one to another as a matrix."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float

from .errors import InputError
from .shapes import Wavelengths

Extrapolation = Literal["hold", "zero", "error"]

#: The grid that materials are stored and shaded on, nm.
WORKING_WAVELENGTHS_NM = np.arange(380.0, 781.0, 5.0)

# Sprague's quintic (CIE 167:2005, eq. 1-2): row p holds 24 a_p over the six samples r_-2 ... r_3.
_SPRAGUE = (
    np.array(
        [
            [0, 0, 24, 0, 0, 0],
            [2, -16, 0, 16, -2, 0],
            [-1, 16, -30, 16, -1, 0],
            [-9, 39, -70, 66, -33, 7],
            [13, -64, 126, -124, 61, -12],
            [-5, 25, -50, 50, -25, 5],
        ]
    )
    / 24.0
)
# The two points that CIE 167:2005 (table 1) puts before the first sample; mirrored, after the last.
_SPRAGUE_EDGE = np.array([[884, -1960, 3033, -2648, 1080, -180], [508, -540, 488, -367, 144, -24]]) / 209.0


def validated_wavelengths(
    wavelengths_nm: object, *, file: str | Path | None = None, field: str = "wavelengths_nm"
) -> Wavelengths:
    """Check a wavelength axis and return it as float64.

    Parameters
    ----------
    wavelengths_nm : (L,) strictly increasing, finite, nm.

    Raises
    ------
    InputError
        Not one-dimensional, not numbers, descending, duplicated, or in a unit other than nanometres.
    """
    try:
        grid = np.array(wavelengths_nm, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(
            "wavelengths are not numbers", file=file, field=field, found=repr(wavelengths_nm)[:80]
        ) from None
    if grid.ndim != 1 or grid.size == 0:
        raise InputError(
            "no wavelength axis", file=file, field=field, found=f"shape {grid.shape}", expected="(L,), L >= 1"
        )
    if not np.isfinite(grid).all():
        raise InputError(
            "a wavelength is not a finite number", file=file, field=field, found=grid[~np.isfinite(grid)][0]
        )
    if grid.max() < 10.0:
        metres = 0.0 < grid.max() < 1e-5
        raise InputError(
            "wavelengths look like metres" if metres else "wavelengths look like micrometres",
            file=file,
            field=field,
            found=f"{grid.min():g} to {grid.max():g}",
            expected="nanometres, such as 380 to 780",
            hint="multiply them by 1e9" if metres else "multiply them by 1000",
        )
    if grid.min() < 10.0 or grid.min() > 20000.0:
        raise InputError(
            "wavelengths are not in nanometres",
            file=file,
            field=field,
            found=f"{grid.min():g} to {grid.max():g}",
            expected="nanometres, such as 380 to 780",
        )
    steps = np.diff(grid)
    if (steps == 0).any():
        raise InputError(
            "a wavelength stands twice",
            file=file,
            field=field,
            found=f"{grid[:-1][steps == 0][0]:g} nm",
            expected="each wavelength once",
            hint="remove or average the repeated samples",
        )
    if (steps < 0).any():
        first = int(np.argmax(steps < 0))
        raise InputError(
            "wavelengths do not ascend",
            file=file,
            field=field,
            found=f"{grid[first]:g} nm followed by {grid[first + 1]:g} nm",
            expected="ascending wavelengths",
            hint="sort the samples by wavelength",
        )
    return grid


def is_uniform(wavelengths_nm: Wavelengths) -> bool:
    """Whether a grid has one step, to a thousandth of it."""
    steps = np.diff(wavelengths_nm)
    return steps.size > 0 and bool(np.ptp(steps) <= 1e-3 * steps.mean())


def interpolation_matrix(
    from_nm: Wavelengths,
    to_nm: Float[np.ndarray, "M"],
    extrapolation: Extrapolation = "hold",
    method: Literal["auto", "sprague", "linear"] = "auto",
) -> Float[np.ndarray, "M L"]:
    """Matrix T that resamples: values on `to_nm` are T @ values on `from_nm`.

    Sprague's quintic (CIE 167:2005) on uniform grids of six samples or more, linear otherwise ("auto").
    Each row inside the measured range sums to 1, so that a constant stays a constant.

    Parameters
    ----------
    extrapolation : what stands beyond the measured range: the nearest sample ("hold"), nothing ("zero"), or an
        `InputError` ("error").
    """
    source, target = validated_wavelengths(from_nm), validated_wavelengths(to_nm)
    outside = (target < source[0] - 1e-9) | (target > source[-1] + 1e-9)
    if outside.any() and extrapolation == "error":
        raise InputError(
            "wavelengths beyond the measured range",
            found=f"{target[0]:g} to {target[-1]:g} nm asked",
            expected=f"within {source[0]:g} to {source[-1]:g} nm",
            hint="name an extrapolation policy: 'hold' or 'zero'",
        )
    inside = np.clip(target, source[0], source[-1])
    if source.size == 1:
        matrix = np.ones((target.size, 1))
    else:
        if method == "auto":
            method = "sprague" if is_uniform(source) and source.size >= 6 else "linear"
        index = np.clip(np.searchsorted(source, inside, side="right") - 1, 0, source.size - 2)
        fraction = (inside - source[index]) / (source[index + 1] - source[index])
        matrix = np.zeros((target.size, source.size))
        rows = np.arange(target.size)
        if method == "linear":
            matrix[rows, index] = 1.0 - fraction
            matrix[rows, index + 1] += fraction
        else:
            matrix = _sprague_rows(source.size, index, fraction)
    if extrapolation == "zero":
        matrix[outside] = 0.0
    return matrix


def _sprague_rows(size: int, index: np.ndarray, fraction: np.ndarray) -> np.ndarray:
    extended = np.zeros((size + 4, size))
    extended[2:-2] = np.eye(size)
    extended[:2, :6] = _SPRAGUE_EDGE
    extended[-2:, -6:] = _SPRAGUE_EDGE[::-1, ::-1]
    powers = fraction[:, None] ** np.arange(6)
    stencil = powers @ _SPRAGUE
    return np.einsum("ms,msl->ml", stencil, extended[index[:, None] + np.arange(6)])
