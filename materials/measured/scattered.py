"""BRDFs known at scattered pairs of directions, made continuous.

The interpolant works on log(f_r + floor) plus a multiple of log(cos theta_i cos theta_o), in which a lobe that spans
five decades is smooth, by kriging in coordinates with the symmetries of an isotropic surface (`kriging`). Violations of
reciprocity are modelled separately: a background of which the instrument subtracted too much is a constant radiance,
and so a term -k(lambda) / cos(theta_i) in f_r. It is estimated from swapped pairs and recorded; by default it is kept,
so that the BRDF follows the measurement, and `reciprocal` omits it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.wavelengths import interpolation_matrix, material_wavelengths
from ..core.brdf import Brdf, Lobe, eval_lit
from ..core.directions import half_difference, io_angles, io_from_half_difference, spherical
from .kriging import Kernel, Kriging, PairAngles, krige
from .lookup import multilinear, refined
from .measurement import STEEPEST, ScatteredMeasurement, estimated_background, prepared

__all__ = ["ScatteredBrdf", "ScatteredMeasurement", "estimated_background"]

# Exponent a of the cosines: what a lobe gains towards grazing is taken out before interpolating, and put back.
# Tuned like the scales of `kriging.Kernel`.
_COSINE_POWER = 0.56
# Added before the logarithm, 1/sr: below it (1 % of a white diffuser or so) interpolation turns linear, as CIE L* does.
_FLOOR = 0.006
# Nodes of the table: theta_h (asinh-spaced from _FINE), theta_d, phi_d in [0, pi/2]; refined by cubic splines.
_NODES = (72, 33, 16)
_REFINED = 3
_FINE = np.radians(3.0)
# Look-ups stop at the largest measured polar angle; nodes go on this far, so that the cells there are whole, but not
# up to the horizon.
_MARGIN = np.radians(6.0)
# A measurement along the normal alone still spans this, so that its table has cells.
_LEAST_RANGE = np.radians(1.0)
# Wavelengths per refinement: splines need many times the memory of their result.
_COLUMNS = 8
# Azimuths of the difference vector that stand for its circle: midpoints of the quarter turn that symmetry leaves.
_RING = tuple((np.arange(6) + 0.5) * np.pi / 12.0)


@dataclass(frozen=True, eq=False)
class ScatteredBrdf(Brdf):
    """A continuous isotropic BRDF through a `ScatteredMeasurement`, on the working wavelengths.

    Symmetric in the mirror plane; reciprocal but for `background`. Smooth, finite and never negative up to the horizon.

    Parameters
    ----------
    measurement : the scattered pairs.
    background : (L,) 1/sr at the measured wavelengths: the instrument's reading is the reciprocal f_r minus background
        / cos(theta_i). `from_measurement` estimates it.
    kernel : scales of the interpolation.
    reciprocal : omit the background: the BRDF is then exactly reciprocal, but deviates from the measurement.

    Polar angles are clamped to the largest measured one. Towards the light's own direction, closer than the smallest
        measured difference angle, the BRDF converges to the mean around that angle. Values stay within the measured
        range, except for the power of the cosines that a lobe gains towards grazing; beyond the measured wavelengths
        values are clamped. `notes` repeats this with this material's numbers.
    """

    NAME: ClassVar[str] = "scattered"
    isotropic = True

    measurement: ScatteredMeasurement
    background: Float[np.ndarray, " L"]
    kernel: Kernel = field(default_factory=Kernel)
    reciprocal: bool = False

    @classmethod
    def from_measurement(
        cls, measurement: ScatteredMeasurement, *, kernel: Kernel | None = None, reciprocal: bool = False
    ) -> ScatteredBrdf:
        """Estimate the background and interpolate; readings that say nothing of a picture are left out (`prepared`)."""
        measurement = prepared(measurement)
        return cls(measurement, estimated_background(measurement), kernel or Kernel(), reciprocal)

    def parameters(self) -> dict[str, Any]:
        """Return everything that `from_parameters` needs to rebuild this BRDF bit for bit: arrays, numbers and text."""
        measurement = self.measurement
        return {
            "measured_wavelengths_nm": measurement.wavelengths_nm,
            "wi": measurement.wi,
            "wo": measurement.wo,
            "values": measurement.values,
            "missing": measurement.missing.astype(np.uint8),
            "background": self.background,
            "kernel": self.kernel.array,
            "reciprocal": int(self.reciprocal),
            "name": measurement.name,
            "description": measurement.description,
            "measurement_notes": "\n".join(measurement.notes),
        }

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> ScatteredBrdf:
        """Return the BRDF that `parameters` came from."""
        missing = sorted({"measured_wavelengths_nm", "wi", "wo", "values", "missing", "background"} - set(parameters))
        if missing:
            raise InputError(
                "a scattered BRDF is not complete",
                field="parameters",
                found=sorted(parameters),
                expected=f"also {', '.join(missing)}",
            )
        notes = str(parameters.get("measurement_notes", ""))
        measurement = ScatteredMeasurement(
            np.asarray(parameters["measured_wavelengths_nm"], dtype=float),
            np.asarray(parameters["wi"], dtype=float),
            np.asarray(parameters["wo"], dtype=float),
            np.asarray(parameters["values"], dtype=float),
            np.asarray(parameters["missing"]).astype(bool),
            str(parameters.get("name", "")),
            str(parameters.get("description", "")),
            tuple(notes.split("\n")) if notes else (),
        )
        kernel = Kernel.from_array(parameters["kernel"]) if "kernel" in parameters else Kernel()
        background = np.asarray(parameters["background"], dtype=float)
        return cls(measurement, background, kernel, bool(parameters.get("reciprocal", 0)))

    @cached_property
    def wavelengths_nm(self) -> Float[np.ndarray, " L"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The working wavelengths, or those of the measurement if these are finer."""
        return material_wavelengths([self.measurement.wavelengths_nm])

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on assumptions, filled and extrapolated values."""
        low, high = self.measurement.wavelengths_nm[[0, -1]]
        kept = "left out, so that the BRDF is reciprocal" if self.reciprocal else "kept, as it was measured"
        return (
            *self.measurement.notes,
            f"polar angles beyond {np.degrees(self._largest):.1f} deg are held there; "
            "but for a lobe's gain towards grazing, f_r stays in its range",
            f"difference angles below {np.degrees(self._smallest):.1f} deg (viewer beside the light) are unmeasured: "
            "f_r settles on the mean around that angle",
            f"known from {low:g} to {high:g} nm; beyond, the end values are repeated",
            f"departure from reciprocity: up to {np.max(self.background):.5f} / cos(theta_i) 1/sr, {kept}",
        )

    def lobes(self) -> tuple[Lobe, ...]:
        """Return the whole, over half and difference angles: paints are lobes on a base too faint for a frame."""
        return (Lobe("hd", self),)

    def eval(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... L"]:
        """Evaluate f_r in 1/sr on `wavelengths_nm`, interpolated in a dense table of the interpolant."""
        return eval_lit(lambda i, o: self._resampled(self._looked_up(i, o)), len(self.wavelengths_nm), wi, wo)

    def eval_measured(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"], *, exact: bool = False
    ) -> Float[np.ndarray, "... L"]:
        """Evaluate f_r in 1/sr at the measured wavelengths; `exact` uses the interpolant, not its table (slow)."""
        evaluate = self._interpolated if exact else self._looked_up
        return eval_lit(evaluate, len(self.measurement.wavelengths_nm), wi, wo)

    @cached_property
    def _distinct(self) -> tuple[PairAngles, np.ndarray]:
        """Angles and (n,L) values of distinct pairs with any reading; NaN where all readings of a pair dropped out."""
        measurement = self.measurement
        keys = np.stack(io_angles(measurement.wi, measurement.wo), axis=-1)
        values = np.where(measurement.missing, np.nan, measurement.values)
        # An order of their own, so that the order of the rows makes no difference in any bit.
        order = np.lexsort((*values.T, *np.round(keys, 6).T))
        keys, values = keys[order], values[order]
        starts = np.concatenate([[True], (np.diff(np.round(keys, 6), axis=0) != 0).any(axis=1)])
        group = np.cumsum(starts) - 1
        known = np.zeros((group[-1] + 1, values.shape[1]))
        total = np.zeros_like(known)
        np.add.at(known, group, np.isfinite(values))
        np.add.at(total, group, np.nan_to_num(values))
        mean = np.divide(total, known, out=np.full_like(total, np.nan), where=known > 0)
        usable = np.isfinite(mean).any(axis=1)
        return _pair_angles(measurement.wi[order][starts][usable], measurement.wo[order][starts][usable]), mean[usable]

    @cached_property
    def _largest(self) -> float:
        at, _ = self._distinct
        return float(max(at.theta_i.max(), at.theta_o.max(), _LEAST_RANGE))

    @cached_property
    def _kriging(self) -> tuple[Kriging, np.ndarray, np.ndarray]:
        """Interpolant of the logarithm, and the range (L,), (L,) of its data."""
        at, values = self._distinct
        lifted = values + self.background / np.cos(at.theta_i)[:, None] + _FLOOR
        lifted = np.log(_filled(lifted, self.measurement.wavelengths_nm)) + self._log_cosines(at)
        return krige(self.kernel, at, lifted), lifted.min(axis=0), lifted.max(axis=0)

    def _log_cosines(self, at: PairAngles) -> Float[np.ndarray, "N 1"]:
        return _COSINE_POWER * np.log(np.cos(at.theta_i) * np.cos(at.theta_o))[:, None]

    @cached_property
    def _smallest(self) -> float:
        """Smallest measured difference angle, since instruments cannot look along their own light."""
        at, _ = self._distinct
        return float(at.theta_d.min())

    def _held(self, wi: np.ndarray, wo: np.ndarray, margin: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Clamp polar angles to the largest measured one, and a margin; azimuths stay."""
        most = min(self._largest + margin, STEEPEST)
        theta_i, theta_o, phi = io_angles(wi, wo)
        beyond = np.maximum(theta_i, theta_o) > most
        if beyond.any():
            wi, wo = wi.copy(), wo.copy()
            wi[beyond] = spherical(np.minimum(theta_i[beyond], most), np.zeros(beyond.sum()))
            wo[beyond] = spherical(np.minimum(theta_o[beyond], most), phi[beyond])
        return wi, wo

    def _logarithm(self, wi: np.ndarray, wo: np.ndarray) -> Float[np.ndarray, "N L"]:
        """Evaluate the kriged logarithm at clamped pairs.

        Towards the light's own direction, where nothing is measured, it converges to the mean around the smallest
        measured difference angle, which avoids an artificial peak.
        """
        theta_h, theta_d, phi_d, _ = half_difference(wi, wo)
        interpolate, _, _ = self._kriging

        def at(half: np.ndarray, difference: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
            return interpolate(_pair_angles(*self._held(*io_from_half_difference(half, difference, azimuth), _MARGIN)))

        least = self._smallest
        out = at(theta_h, np.maximum(theta_d, least), phi_d)
        inside = np.flatnonzero(theta_d < least)
        if len(inside):
            half, back = np.unique(theta_h[inside], return_inverse=True)
            ring = [at(half, np.full_like(half, least), np.full_like(half, azimuth)) for azimuth in _RING]
            mean = np.mean(ring, axis=0)[back]
            out[inside] = mean + ((theta_d[inside] / least) ** 2)[:, None] * (out[inside] - mean)
        return out

    def _finished(self, logarithm: np.ndarray, at: PairAngles) -> np.ndarray:
        _, least, most = self._kriging
        values = np.exp(np.clip(logarithm, least, most) - self._log_cosines(at)) - _FLOOR
        if not self.reciprocal:
            values -= self.background / np.cos(at.theta_i)[:, None]
        return np.maximum(values, 0.0)

    def _interpolated(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        wi, wo = self._held(wi, wo)
        return self._finished(self._logarithm(wi, wo), _pair_angles(wi, wo))

    @cached_property
    def _table(self) -> Float[np.ndarray, "H D P L"]:
        """The logarithm at the nodes, float32; those below the horizon continue it, so that cells there are whole."""
        theta_h = _FINE * np.sinh(np.linspace(0.0, np.arcsinh(0.5 * np.pi / _FINE), _NODES[0]))
        theta_d, phi_d = np.linspace(0.0, self._largest, _NODES[1]), np.linspace(0.0, 0.5 * np.pi, _NODES[2])
        nodes = [angle.ravel() for angle in np.meshgrid(theta_h, theta_d, phi_d, indexing="ij")]
        table = self._logarithm(*io_from_half_difference(*nodes)).reshape(*_NODES, -1)
        finer = tuple(_REFINED * (size - 1) + 1 for size in _NODES)
        out = np.empty((*finer, table.shape[-1]), dtype=np.float32)
        for start in range(0, table.shape[-1], _COLUMNS):
            columns = table[..., start : start + _COLUMNS]
            for axis in range(3):
                # Even about both ends of the azimuth by symmetry.
                columns = refined(columns, axis, _REFINED, "clamped" if axis == 2 else "not-a-knot")
            out[..., start : start + _COLUMNS] = columns
        return out

    def _looked_up(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        wi, wo = self._held(wi, wo)
        at = _pair_angles(wi, wo)
        theta_h, theta_d, phi_d, _ = half_difference(wi, wo)
        # Exchange adds pi, mirroring changes the sign: a quarter turn holds everything.
        phi_d = np.mod(phi_d, np.pi)
        phi_d = np.minimum(phi_d, np.pi - phi_d)
        half = np.arcsinh(theta_h / _FINE) / np.arcsinh(0.5 * np.pi / _FINE)
        return self._finished(multilinear(self._table, (half, theta_d / self._largest, phi_d / (0.5 * np.pi))), at)

    @cached_property
    def _resampling(self) -> tuple[np.ndarray, np.ndarray]:
        grid = self.measurement.wavelengths_nm
        smooth, linear = (interpolation_matrix(grid, self.wavelengths_nm, "hold", m) for m in ("auto", "linear"))
        return smooth.T, linear.T

    def _resampled(self, values: Float[np.ndarray, "N L"]) -> np.ndarray:
        """Interpolate at `wavelengths_nm`: Sprague, or linear for a spectrum that Sprague would take below zero."""
        smooth, linear = self._resampling
        out = values @ smooth
        bad = (out < 0).any(axis=1)
        if bad.any():
            out[bad] = values[bad] @ linear
        return out


def _pair_angles(wi: np.ndarray, wo: np.ndarray) -> PairAngles:
    theta_i, theta_o, _ = io_angles(wi, wo)
    theta_h, theta_d, _, _ = half_difference(wi, wo)
    return PairAngles(theta_i, theta_o, theta_h, theta_d)


def _filled(values: Float[np.ndarray, "N L"], wavelengths_nm: np.ndarray) -> Float[np.ndarray, "N L"]:
    """Interpolate dropped readings (NaN) along the wavelengths in the logarithm, clamped at the ends."""
    out = values.copy()
    for index in np.flatnonzero(np.isnan(values).any(axis=1)):
        known = np.isfinite(values[index])
        line = np.interp(wavelengths_nm[~known], wavelengths_nm[known], np.log(values[index, known]))
        out[index, ~known] = np.exp(line)
    return out
