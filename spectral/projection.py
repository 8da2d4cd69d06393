"""Projection from a finer grid of wavelengths to a coarser one by least squares, not by decimation.

Decimation keeps the noise and the edges of a fine measurement wherever they meet the coarse grid. Here the samples r on
the coarse grid are those for which interpolation_matrix(coarse, fine) @ r is closest to the measurement, by least
squares of the difference itself, and of its averages between neighbouring samples. These averages determine the result
under any lamp that is linear between samples of the coarse grid, as those of the CIE are.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from jaxtyping import Float

from .axis_letters import Wavelengths
from .wavelengths import (
    WORKING_WAVELENGTHS_NM,
    interpolation_matrix,
    is_finer,
    times_interpolation,
    validated_wavelengths,
)

# Weight of the squared average beside that of the squared difference. Under the CIE's lamps it more than halves the
# error, and under narrow lines it costs nothing; far larger weights change nothing.
_AVERAGES = 20.0
# Differences are looked at this many times a step of the coarse grid or more often.
_LOOKS = 4
# Points of a step, as shares of it.
_GAUSS = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3.0)
# Sweeps of coordinate descent, and the change after which it is at its end.
_SWEEPS, _SMALLEST = 2000, 1e-12


def projection_matrix(from_nm: Wavelengths, to_nm: Float[np.ndarray, "M"]) -> Float[np.ndarray, "M L"]:
    """Compute the matrix P from values on `from_nm` to `to_nm`: P @ values is `projected` without bounds.

    A linear map for whole tables of spectra. If `from_nm` is no finer than `to_nm` it is their interpolation. Beyond
    `from_nm` values are clamped; values beyond `to_nm` are ignored.

    >>> fine, coarse = np.arange(400.0, 501.0), np.arange(400.0, 501.0, 5.0)
    >>> float(np.abs(projection_matrix(fine, coarse) @ np.sin(fine / 30) - np.sin(coarse / 30)).max()) < 1e-3
    True
    """
    source, target = validated_wavelengths(from_nm), validated_wavelengths(to_nm)
    if not is_finer(source, target):
        return interpolation_matrix(source, target)
    return _least_squares(source.tobytes(), target.tobytes())[0].copy()


def projected(
    values: Float[np.ndarray, "*batch L"],
    from_nm: Wavelengths,
    to_nm: Float[np.ndarray, "M"],
    highest: float = np.inf,
) -> Float[np.ndarray, "*batch M"]:
    """Compute the samples on a coarser grid that best approximate `values`, within 0 to `highest` and without clipping.

    A spectrum with a steep edge, or with noise about black, would be closest with samples below zero or above
    `highest`. Its samples are then the closest within these bounds, by constrained least squares.
    """
    source, target = validated_wavelengths(from_nm), validated_wavelengths(to_nm)
    found = values @ projection_matrix(source, target).T
    if not is_finer(source, target):
        return found
    rows = found.reshape(-1, target.size)
    beyond = ((rows < 0.0) | (rows > highest)).any(axis=1)
    if beyond.any():
        rows[beyond] = _bounded(rows[beyond], _least_squares(source.tobytes(), target.tobytes())[1], highest)
    return rows.reshape(found.shape)


def tent_means(
    values: Float[np.ndarray, "*batch L"], from_nm: Wavelengths, to_nm: Float[np.ndarray, "M"]
) -> Float[np.ndarray, "*batch M"]:
    """Average values that are linear between samples, with tents over the wavelengths of `to_nm`.

    Weights fall from 1 at each wavelength to 0 at its neighbours.
    """
    source, target = validated_wavelengths(from_nm), validated_wavelengths(to_nm)
    at = _looked_at(source, target)
    steps = np.diff(at)[:, None]
    # Two points a piece integrate the product of two straight lines exactly.
    points = (at[:-1, None] + steps * _GAUSS).ravel()
    tents = interpolation_matrix(target, points, "hold", "linear") * np.repeat(0.5 * steps.ravel(), 2)[:, None]
    return values @ interpolation_matrix(source, points, "hold", "linear").T @ (tents / tents.sum(axis=0))


def finer_note(wavelengths_nm: Wavelengths) -> str | None:
    """Write the note on a material measured on these wavelengths; None where the working ones are no coarser."""
    if not is_finer(wavelengths_nm):
        return None
    step = float(np.diff(WORKING_WAVELENGTHS_NM).min())
    return (
        f"finer than {step:g} nm: the packs hold the nearest spectrum on that grid, the error is against every sample"
    )


@lru_cache(maxsize=16)
def _least_squares(source_bytes: bytes, target_bytes: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Return the projection (M,L), and its normal matrix (M,M)."""
    source, target = np.frombuffer(source_bytes), np.frombuffer(target_bytes)
    at = _looked_at(source, target)
    width = np.gradient(at)
    onto = interpolation_matrix(target, at)
    tents = interpolation_matrix(target, at, "hold", "linear") * width[:, None]
    share = tents.sum(axis=0)
    averages = tents.T / share[:, None]
    averaged = averages @ onto
    # Differences at every look count their width; of the average about each sample, its share of the range.
    seen = onto.T * width + _AVERAGES * (averaged.T * share) @ averages
    normal = seen @ onto
    return np.linalg.solve(normal, times_interpolation(seen, source, at)), normal


def _looked_at(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the wavelengths of comparison: samples of both within the coarse grid, and more where those are sparse."""
    inside = source[(source > target[0]) & (source < target[-1])]
    knots = np.unique(np.concatenate([target, inside]))
    pieces = np.ceil(np.diff(knots) / (np.diff(target).min() / _LOOKS) - 1e-9).astype(int).clip(1)
    starts, steps = np.repeat(knots[:-1], pieces), np.repeat(np.diff(knots) / pieces, pieces)
    number = np.arange(pieces.sum()) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    return np.append(starts + number * steps, knots[-1])


def _bounded(free: np.ndarray, normal: np.ndarray, highest: float) -> np.ndarray:
    """Minimise (x - free)^T normal (x - free) over rows x from 0 to `highest`, by coordinate descent."""
    found = np.clip(free, 0.0, highest)
    scale = np.diag(normal)
    slope = (found - free) @ normal
    for _ in range(_SWEEPS):
        largest = 0.0
        for column in range(len(scale)):
            step = np.clip(found[:, column] - slope[:, column] / scale[column], 0.0, highest) - found[:, column]
            found[:, column] += step
            slope += step[:, None] * normal[column]
            largest = max(largest, float(np.abs(step).max()))
        if largest <= _SMALLEST:
            break
    return found
