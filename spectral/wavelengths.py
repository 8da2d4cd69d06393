"""Wavelength grids, and resampling between them by a matrix."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float

from ..runtime.errors import InputError
from .axis_letters import Wavelengths

Extrapolation = Literal["hold", "zero", "error"]

#: The grid that materials are shaded on, nm.
WORKING_WAVELENGTHS_NM = np.arange(380.0, 781.0, 5.0)
#: Range of the standard observers' tables, nm.
SEEN_NM = (360.0, 830.0)
# Content expected of an axis of wavelengths, in words.
_NANOMETRES = "nanometres, such as 380 to 780"
# Samples beyond a range that interpolation within it takes, and those that Sprague's takes in all.
_NEIGHBOURS, _STENCIL = 3, 6
# Entries of a matrix that is made whole: 32 MB.
_LARGE = 1 << 22

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
            "wavelengths are not numbers",
            file=file,
            field=field,
            found=repr(wavelengths_nm)[:80],
            expected=_NANOMETRES,
            hint="give each wavelength as a number alone, without its unit",
        ) from None
    if grid.ndim != 1 or grid.size == 0:
        raise InputError(
            "no wavelength axis",
            file=file,
            field=field,
            found=f"shape {grid.shape}",
            expected="(L,), L >= 1",
            hint="give one list of wavelengths, one for each sample",
        )
    if not np.isfinite(grid).all():
        raise InputError(
            "a wavelength is not a finite number",
            file=file,
            field=field,
            found=grid[~np.isfinite(grid)][0],
            expected=_NANOMETRES,
            hint="correct that wavelength, or leave its sample out",
        )
    if grid.max() < 10.0:
        metres = 0.0 < grid.max() < 1e-5
        hint = "multiply them by 1e9" if metres else "multiply them by 1000"
        if grid.min() >= 1.0:
            hint += "; where they are electronvolts, nm = 1239.842 / eV"
        raise InputError(
            "wavelengths look like metres" if metres else "wavelengths look like micrometres",
            file=file,
            field=field,
            found=f"{grid.min():g} to {grid.max():g}",
            expected=_NANOMETRES,
            hint=hint,
        )
    if grid.min() < 10.0 or grid.min() > 20000.0:
        raise InputError(
            "wavelengths are not in nanometres",
            file=file,
            field=field,
            found=f"{grid.min():g} to {grid.max():g}",
            expected=_NANOMETRES,
            hint="wavelengths below 10 nm may be damaged: correct them, or leave their samples out"
            if grid.min() < 10.0
            else "convert them: picometres divided by 1000, or 1e7 divided by wavenumbers in 1/cm",
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
    """Return whether a grid has a constant step, to a thousandth of it."""
    steps = np.diff(wavelengths_nm)
    return steps.size > 0 and bool(np.ptp(steps) <= 1e-3 * steps.mean())


def is_finer(wavelengths_nm: Wavelengths, than_nm: Float[np.ndarray, "M"] = WORKING_WAVELENGTHS_NM) -> bool:
    """Return whether a grid is denser than another one anywhere within its range.

    >>> is_finer(np.arange(400.0, 701.0, 10.0)), is_finer(np.arange(380.0, 731.0, 10.0 / 3.0))
    (False, True)
    """
    if wavelengths_nm.size < 2 or than_nm.size < 2:
        return False
    within = (wavelengths_nm[1:] > than_nm[0]) & (wavelengths_nm[:-1] < than_nm[-1])
    return bool((np.diff(wavelengths_nm)[within] < 0.999 * np.diff(than_nm).min()).any())


def material_wavelengths(grids: Sequence[Float[np.ndarray, "_"]]) -> Float[np.ndarray, "M"]:
    """Return the grid on which a material stores spectra of these grids without loss.

    The working wavelengths or, if one of the spectra is finer, the grid common to all, within the observer's range.
    """
    if not any(is_finer(grid) for grid in grids):
        return WORKING_WAVELENGTHS_NM
    seen = []
    for grid in grids:
        first = max(int(np.searchsorted(grid, SEEN_NM[0])) - _NEIGHBOURS, 0)
        seen.append(grid[first : int(np.searchsorted(grid, SEEN_NM[1], "right")) + _NEIGHBOURS])
    return common_wavelengths(seen)


def common_wavelengths(grids: Sequence[Float[np.ndarray, "_"]]) -> Float[np.ndarray, "M"]:
    """Return a common grid for spectra of all these grids.

    If the grids are equal, that one. Else the uniform one of them that has every sample of all others, so that its own
    spectra are unchanged and the others lose no sample. Else every nanometre from the first to the last sample of any,
    the step of observers' tables, and the samples of finer ones.

    >>> common_wavelengths([np.arange(400.0, 701.0, 10.0), np.arange(380.0, 781.0, 5.0)]).size
    81
    """
    several = [grid for index, grid in enumerate(grids) if not any(np.array_equal(grid, g) for g in grids[:index])]
    if len(several) == 1:
        return several[0]
    for grid in several:
        if is_uniform(grid) and all(np.isin(other, grid).all() for other in several):
            return grid
    first, last = min(grid[0] for grid in several), max(grid[-1] for grid in several)
    every = np.arange(np.floor(first), np.ceil(last) + 1.0)
    return np.unique(np.concatenate([every, *(grid for grid in several if is_finer(grid, every))]))


def interpolation_matrix(
    from_nm: Wavelengths,
    to_nm: Float[np.ndarray, "M"],
    extrapolation: Extrapolation = "hold",
    method: Literal["auto", "sprague", "linear"] = "auto",
) -> Float[np.ndarray, "M L"]:
    """Compute the resampling matrix T: values on `to_nm` are T @ values on `from_nm`.

    Sprague's quintic (CIE 167:2005) on uniform grids of six samples or more, linear otherwise ("auto"). Each row inside
    the measured range sums to 1, so that a constant stays a constant.

    Parameters
    ----------
    extrapolation : beyond the measured range: the nearest sample ("hold"), 0 ("zero"), or an `InputError` ("error").
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
            method = "sprague" if is_uniform(source) and source.size >= _STENCIL else "linear"
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


def times_interpolation(
    weights: Float[np.ndarray, "K M"], from_nm: Wavelengths, to_nm: Float[np.ndarray, "M"]
) -> Float[np.ndarray, "K L"]:
    """Compute weights @ interpolation_matrix(from_nm, to_nm), without storing the whole matrix."""
    if from_nm.size * to_nm.size <= _LARGE:
        return weights @ interpolation_matrix(from_nm, to_nm)
    found = np.zeros((len(weights), from_nm.size))
    method = "sprague" if is_uniform(from_nm) and from_nm.size >= _STENCIL else "linear"
    step = max(_LARGE // from_nm.size, 1)
    for start in range(0, to_nm.size, step):
        rows = slice(start, start + step)
        first, last = np.searchsorted(from_nm, to_nm[rows][[0, -1]])
        near = slice(max(int(first) - _STENCIL, 0), int(last) + _STENCIL)
        found[:, near] += weights[:, rows] @ interpolation_matrix(from_nm[near], to_nm[rows], "hold", method)
    return found


def _sprague_rows(size: int, index: np.ndarray, fraction: np.ndarray) -> np.ndarray:
    extended = np.zeros((size + 4, size))
    extended[2:-2] = np.eye(size)
    extended[:2, :6] = _SPRAGUE_EDGE
    extended[-2:, -6:] = _SPRAGUE_EDGE[::-1, ::-1]
    powers = fraction[:, None] ** np.arange(6)
    stencil = powers @ _SPRAGUE
    matrix = np.zeros((index.size, size))
    for sample in range(6):
        matrix += stencil[:, sample, None] * extended[index + sample]
    return matrix
