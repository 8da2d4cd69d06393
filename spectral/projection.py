"""Projection from a finer grid of wavelengths onto a coarser one: the samples whose interpolation is closest, not every
fifth one.

Picking samples keeps the noise and the edges of a fine measurement wherever they happen to meet the coarse grid. Here
the samples r on the coarse grid are those for which interpolation_matrix(coarse, fine) @ r is nearest to what was
measured, in the sense of least squares: of the difference itself, and of its averages between neighbouring samples.
The averages are all that a lamp sees which is linear between samples of the coarse grid, as those of the CIE are.
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
    """Matrix P that takes values on `from_nm` to `to_nm`: P @ values is what `projected` does without bounds.

    A linear map for whole tables of spectra. Where `from_nm` is no finer than `to_nm` it is their interpolation. Beyond
    `from_nm` the end values are held; what lies beyond `to_nm` counts for nothing.

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
    """Return the samples on a coarser grid that stand for `values` best: from 0 to `highest`, nothing cut off.

    A spectrum with a steep edge, or with noise about black, would be closest with samples below zero or above
    `highest`. Its samples are then the closest within these bounds: the others give way to those that meet one.
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
    """Means of what is linear between samples, weighted from 1 at each wavelength of `to_nm` to 0 at its neighbours."""
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
    """Return the projection (M,L), and the matrix (M,M) of its normal equations."""
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
    """Find where both are compared: at the samples of both within the coarse grid, and evenly where those are rare."""
    inside = source[(source > target[0]) & (source < target[-1])]
    knots = np.unique(np.concatenate([target, inside]))
    pieces = np.ceil(np.diff(knots) / (np.diff(target).min() / _LOOKS) - 1e-9).astype(int).clip(1)
    starts, steps = np.repeat(knots[:-1], pieces), np.repeat(np.diff(knots) / pieces, pieces)
    number = np.arange(pieces.sum()) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    return np.append(starts + number * steps, knots[-1])


def _bounded(free: np.ndarray, normal: np.ndarray, highest: float) -> np.ndarray:
    """Rows x from 0 to `highest` with the least (x - free)^T normal (x - free), by coordinate descent."""
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
