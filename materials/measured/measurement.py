"""Measured f_r at scattered pairs of directions, and its deviation from reciprocity."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from ...runtime.errors import InputError
from ...spectral.projection import projected
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM, validated_wavelengths
from ..core.directions import half_difference, io_angles

# Directions are unit vectors to this.
_UNIT = 1e-6
# The background is estimated where specular lobes do not disturb the comparison of swapped pairs, from this many pairs.
_CLEAR_OF_LOBE = np.radians(20.0)
_ENOUGH_PAIRS = 30
# Share of dropped readings above which the rest over-estimate it.
_MOST_MISSING = 0.1
# Polar angle beyond which nothing is seen: the cosines vanish, and instruments report no f_r there.
STEEPEST = np.radians(89.0)
# Readings kept beyond either end of the working wavelengths, for interpolation (Sprague).
_NEIGHBOURS = 3


@dataclass(frozen=True, eq=False)
class ScatteredMeasurement:
    """f_r at scattered direction pairs, as measured.

    Parameters
    ----------
    wavelengths_nm : (L,) ascending, nm, at the instrument's own sampling.
    wi, wo : (N,3) unit vectors above the surface, z the normal; in any order.
    values : (N,L) f_r in 1/sr, finite, not negative.
    missing : (N,L) True where the reading dropped out; the value there is meaningless. name, description : of the
        sample, from the file. notes : assumptions in reading it, in words.
    """

    wavelengths_nm: Float[np.ndarray, " L"]
    wi: Float[np.ndarray, "N 3"]
    wo: Float[np.ndarray, "N 3"]
    values: Float[np.ndarray, "N L"]
    missing: Bool[np.ndarray, "N L"]
    name: str = ""
    description: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        validated_wavelengths(self.wavelengths_nm)
        expected = (len(self.wi), len(self.wavelengths_nm))
        if self.values.shape != expected or self.missing.shape != expected or self.wo.shape != self.wi.shape:
            raise InputError(
                "values do not fit the directions",
                field="values",
                found=self.values.shape,
                expected=f"{expected}, one row a direction pair",
            )
        for name, directions in (("wi", self.wi), ("wo", self.wo)):
            lengths = np.linalg.norm(directions, axis=-1)
            bad = ~((np.abs(lengths - 1) < _UNIT) & (directions[:, 2] > 0))
            if bad.any():
                raise InputError(
                    "not a direction above the surface",
                    field=name,
                    found=directions[bad][0].tolist(),
                    expected="a unit vector with z > 0",
                )
        measured = self.values[~self.missing]
        if not (np.isfinite(measured).all() and (measured >= 0).all()):
            bad = measured[~(measured >= 0) | ~np.isfinite(measured)][0]
            raise InputError("unusable f_r", field="values", found=bad, expected="finite, >= 0, 1/sr")
        if self.missing.all():
            raise InputError(
                "nothing was measured",
                field="missing",
                found="every value missing",
                expected="at least one direction pair",
            )

    def __len__(self) -> int:
        return len(self.wi)

    def subset(self, rows: np.ndarray) -> ScatteredMeasurement:
        """Return the measurement at some of its direction pairs only."""
        return ScatteredMeasurement(
            self.wavelengths_nm,
            self.wi[rows],
            self.wo[rows],
            self.values[rows],
            self.missing[rows],
            self.name,
            self.description,
            self.notes,
        )


def prepared(measurement: ScatteredMeasurement) -> ScatteredMeasurement:
    """Return the measurement without data that no picture shows; `notes` lists the omissions.

    Pairs with a direction beyond 89 deg are dropped. If there are more wavelengths than in the working grid, those well
    outside it are dropped; if more remain, spectra are the nearest ones on that grid (`spectral.projection`), which
    bounds the cost.
    """
    steep = np.minimum(measurement.wi[:, 2], measurement.wo[:, 2]) < np.cos(STEEPEST)
    if steep.all():
        raise InputError(
            "every direction pair is at grazing", field="rows", found=len(steep), expected="polar angles below 89 deg"
        )
    if steep.any():
        note = f"{int(steep.sum())} direction pairs beyond 89 deg are left out"
        measurement = replace(measurement.subset(~steep), notes=(*measurement.notes, note))
    grid, working = measurement.wavelengths_nm, WORKING_WAVELENGTHS_NM
    if grid[0] > working[-1] or grid[-1] < working[0]:
        expected = f"some of {working[0]:g} to {working[-1]:g} nm"
        raise InputError(
            "nothing visible was measured",
            field="wavelengths",
            found=f"{grid[0]:g} to {grid[-1]:g} nm",
            expected=expected,
        )
    if len(grid) <= len(working):
        return measurement
    first, last = np.searchsorted(grid, working[0], "right") - 1, np.searchsorted(grid, working[-1])
    kept = np.arange(max(first - _NEIGHBOURS, 0), min(last + _NEIGHBOURS + 1, len(grid)))
    note = f"of {len(grid)} wavelengths, those around {working[0]:g} to {working[-1]:g} nm are used"
    if len(kept) <= len(working):
        return replace(
            measurement,
            wavelengths_nm=grid[kept],
            values=measurement.values[:, kept],
            missing=measurement.missing[:, kept],
            notes=(*measurement.notes, note),
        )
    return _on_working_grid(measurement, kept, note)


def _on_working_grid(measurement: ScatteredMeasurement, kept: Int[np.ndarray, " K"], note: str) -> ScatteredMeasurement:
    """Project the readings at `kept` to the working wavelengths; missing where none is within half a step.

    A gap between readings is bridged by a straight line.
    """
    grid, working = measurement.wavelengths_nm[kept], WORKING_WAVELENGTHS_NM
    step = float(working[1] - working[0])
    target = working[(working >= grid[0] - 0.5 * step) & (working <= grid[-1] + 0.5 * step)]
    known, values = ~measurement.missing[:, kept], measurement.values[:, kept].copy()
    for row in np.flatnonzero(known.any(axis=1) & ~known.all(axis=1)):
        values[row] = np.interp(grid, grid[known[row]], values[row, known[row]])
    near = np.abs(np.subtract.outer(grid, target)) <= 0.5 * step
    missing = ~(known @ near)
    found = np.where(missing, 0.0, projected(values, grid, target))
    said = f"{note}, as the nearest spectra in steps of {step:g} nm"
    return replace(measurement, wavelengths_nm=target, values=found, missing=missing, notes=(*measurement.notes, said))


def estimated_background(measurement: ScatteredMeasurement) -> Float[np.ndarray, " L"]:
    """Return the k(lambda) >= 0 of f_r(i, o) - f_r(o, i) = -k (1/cos theta_i - 1/cos theta_o), 1/sr, by robust
    regression.

    Swapped pairs are interpolated linearly in the logarithm between the measured ones. 0 at wavelengths where fewer
    than 30 pairs can be compared, and everywhere if more than a tenth of all readings dropped out.
    """
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import QhullError

    theta_i, theta_o, phi = io_angles(measurement.wi, measurement.wo)
    usable = ~measurement.missing & (measurement.values > 0)
    values = np.where(usable, measurement.values, 1.0)
    out = np.zeros(len(measurement.wavelengths_nm))
    if measurement.missing.mean() > _MOST_MISSING:
        return out
    order = np.lexsort((*values.T, phi, theta_o, theta_i))
    try:
        places = np.stack([theta_i, theta_o, 0.5 * phi], axis=-1)[order]
        logarithms = np.where(usable, np.log(values), np.nan)[order]
        swapped = np.exp(LinearNDInterpolator(places, logarithms)(places[:, [1, 0, 2]]))
    except (QhullError, ValueError):
        return out  # too few pairs, or all in one plane: nothing to compare
    cosine_i, cosine_o = np.cos(theta_i[order]), np.cos(theta_o[order])
    slope = 1.0 / cosine_i - 1.0 / cosine_o
    theta_h = half_difference(measurement.wi, measurement.wo)[0][order]
    for column in range(len(out)):
        rows = np.isfinite(swapped[:, column]) & usable[order, column] & (theta_h > _CLEAR_OF_LOBE)
        if rows.sum() >= _ENOUGH_PAIRS:
            difference = swapped[rows, column] - values[order][rows, column]
            out[column] = max(_robust_slope(slope[rows], difference), 0.0)
    return out


def _robust_slope(x: np.ndarray, y: np.ndarray) -> float:
    """Fit the slope of y = b x by iteratively reweighted least squares with Huber's weights."""
    weights = np.ones_like(x)
    slope = 0.0
    for _ in range(20):
        slope = float((weights * x) @ y / max((weights * x) @ x, 1e-300))
        residual = np.abs(y - slope * x)
        weights = np.minimum(1.0, 1.5 * np.median(residual) / np.maximum(residual, 1e-12))
    return slope
