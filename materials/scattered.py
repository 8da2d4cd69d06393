"""BRDFs known at scattered pairs of directions, made continuous.

The interpolant works on log(f_r (cos theta_i cos theta_o)^a + ...), in which a lobe that spans five decades is smooth, by
kriging in coordinates with the symmetries of an isotropic surface (`kriging`). What of a measurement contradicts
reciprocity is modelled apart: a background that the instrument subtracted too much of is a constant radiance, and so
a term -k(lambda) / cos(theta_i) in f_r. It is estimated from swapped pairs and recorded; by default it is kept, so that
the BRDF follows the measurement, and `reciprocal` leaves it out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Bool, Float

from ..spectral.errors import InputError
from ..spectral.wavelengths import WORKING_WAVELENGTHS_NM, interpolation_matrix, validated_wavelengths
from .brdf import Brdf, Lobe, eval_lit
from .directions import half_difference, io_angles, io_from_half_difference
from .kriging import Kernel, Kriging, PairAngles, krige

# Directions are unit vectors to this.
_UNIT = 1e-6
# Exponent a of the cosines: what a lobe gains towards grazing is taken out before interpolating, and put back.
_COSINE_POWER = 0.27
# Added before the logarithm, 1/sr: below it (1 % of a white diffuser or so) interpolation turns linear, as CIE L* does.
_FLOOR = 0.008
# Nodes of the dense table: theta_h (asinh-spaced from _FINE), theta_d, phi_d in [0, pi/2].
_NODES = (112, 61, 13)
_FINE = np.radians(1.0)
# The background is estimated where specular lobes do not disturb the comparison of swapped pairs, from this many pairs.
_CLEAR_OF_LOBE = np.radians(20.0)
_ENOUGH_PAIRS = 30


@dataclass(frozen=True, eq=False)
class ScatteredMeasurement:
    """f_r at scattered direction pairs, as measured.

    Parameters
    ----------
    wavelengths_nm : (L,) ascending, nm, at the instrument's own sampling.
    wi, wo : (N,3) unit vectors above the surface, z the normal; in any order.
    values : (N,L) f_r in 1/sr, finite, not negative.
    missing : (N,L) True where the reading dropped out; the value there means nothing.
    name, description : what the file says of the sample.
    notes : what was assumed in reading it, in words.
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
            raise InputError("values do not fit the directions", field="values", found=self.values.shape,
                             expected=f"{expected}, one row a direction pair")
        for field, directions in (("wi", self.wi), ("wo", self.wo)):
            lengths = np.linalg.norm(directions, axis=-1)
            bad = ~((np.abs(lengths - 1) < _UNIT) & (directions[:, 2] > 0))
            if bad.any():
                raise InputError("not a direction above the surface", field=field, found=directions[bad][0].tolist(),
                                 expected="a unit vector with z > 0")
        measured = self.values[~self.missing]
        if not (np.isfinite(measured).all() and (measured >= 0).all()):
            bad = measured[~(measured >= 0) | ~np.isfinite(measured)][0]
            raise InputError("unusable f_r", field="values", found=bad, expected="finite, >= 0, 1/sr")
        if self.missing.all():
            raise InputError("nothing was measured", field="missing", found="every value missing",
                             expected="at least one direction pair")

    def __len__(self) -> int:
        return len(self.wi)

    def subset(self, rows: np.ndarray) -> ScatteredMeasurement:
        """The measurement at some of its direction pairs only."""
        return ScatteredMeasurement(self.wavelengths_nm, self.wi[rows], self.wo[rows], self.values[rows],
                                    self.missing[rows], self.name, self.description, self.notes)


@dataclass(frozen=True, eq=False)
class ScatteredBrdf(Brdf):
    """A continuous isotropic BRDF through a `ScatteredMeasurement`, on the working wavelengths.

    Symmetric in the mirror plane; reciprocal but for `background`. Smooth, finite and never negative up to the horizon.

    Parameters
    ----------
    measurement : what was measured.
    background : (L,) 1/sr at the measured wavelengths: the instrument's reading is the reciprocal f_r minus
        background / cos(theta_i). `from_measurement` estimates it.
    kernel : scales of the interpolation.
    reciprocal : leave the background out: the BRDF is then exactly reciprocal, and no longer what was measured.

    Beyond the largest measured polar angle, polar and difference angles are held there while the half angle runs on,
    so that a highlight keeps its shape; values never leave the measured range. Beyond the measured wavelengths the
    end values are held. `notes` repeats this with the numbers of this material.
    """

    NAME: ClassVar[str] = "scattered"
    isotropic = True

    measurement: ScatteredMeasurement
    background: Float[np.ndarray, " L"]
    kernel: Kernel = Kernel()
    reciprocal: bool = False

    @classmethod
    def from_measurement(
        cls, measurement: ScatteredMeasurement, *, kernel: Kernel | None = None, reciprocal: bool = False
    ) -> ScatteredBrdf:
        """Estimate the background and interpolate."""
        return cls(measurement, estimated_background(measurement), kernel or Kernel(), reciprocal)

    def parameters(self) -> dict[str, Any]:
        """Everything that `from_parameters` rebuilds this BRDF from, bit for bit: arrays, numbers and text."""
        told = self.measurement
        return {
            "measured_wavelengths_nm": told.wavelengths_nm,
            "wi": told.wi,
            "wo": told.wo,
            "values": told.values,
            "missing": told.missing.astype(np.uint8),
            "background": self.background,
            "kernel": self.kernel.array,
            "reciprocal": int(self.reciprocal),
            "name": told.name,
            "description": told.description,
            "measurement_notes": "\n".join(told.notes),
        }

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> ScatteredBrdf:
        """The BRDF that `parameters` came from."""
        missing = sorted({"measured_wavelengths_nm", "wi", "wo", "values", "missing", "background"} - set(parameters))
        if missing:
            raise InputError("a scattered BRDF is not complete", field="parameters", found=sorted(parameters),
                             expected=f"also {', '.join(missing)}")
        notes = str(parameters.get("measurement_notes", ""))
        measurement = ScatteredMeasurement(
            *(np.asarray(parameters[key], dtype=float) for key in ("measured_wavelengths_nm", "wi", "wo", "values")),
            np.asarray(parameters["missing"]).astype(bool),
            str(parameters.get("name", "")),
            str(parameters.get("description", "")),
            tuple(notes.split("\n")) if notes else (),
        )
        kernel = Kernel.from_array(parameters["kernel"]) if "kernel" in parameters else Kernel()
        background = np.asarray(parameters["background"], dtype=float)
        return cls(measurement, background, kernel, bool(parameters.get("reciprocal", 0)))

    @property
    def wavelengths_nm(self) -> Float[np.ndarray, " L"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        return WORKING_WAVELENGTHS_NM

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed, filled in or extrapolated, in words."""
        low, high = self.measurement.wavelengths_nm[[0, -1]]
        kept = "left out, so that the BRDF is reciprocal" if self.reciprocal else "kept, as it was measured"
        return (
            *self.measurement.notes,
            f"beyond theta = {np.degrees(self._largest):.1f} deg polar and difference angles are held there",
            f"known from {low:g} to {high:g} nm; beyond, the end values are held",
            f"departure from reciprocity: up to {np.max(self.background):.5f} / cos(theta_i) 1/sr, {kept}",
        )

    def lobes(self) -> tuple[Lobe, ...]:
        """One lobe over half/difference angles."""
        return (Lobe("hd", self),)

    def eval(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... L"]:
        """f_r in 1/sr on the working wavelengths, looked up in a dense table of the interpolant."""
        return eval_lit(lambda i, o: self._resampled(self._looked_up(i, o)), len(self.wavelengths_nm), wi, wo)

    def eval_measured(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"], *, exact: bool = False
    ) -> Float[np.ndarray, "... L"]:
        """f_r in 1/sr at the measured wavelengths; `exact` asks the interpolant itself and not its table (slow)."""
        evaluate = self._interpolated if exact else self._looked_up
        return eval_lit(evaluate, len(self.measurement.wavelengths_nm), wi, wo)

    @cached_property
    def _distinct(self) -> tuple[PairAngles, np.ndarray]:
        """Angles and (n,L) values of distinct pairs with any reading; NaN where all readings of a pair dropped out."""
        told = self.measurement
        keys = np.stack(io_angles(told.wi, told.wo), axis=-1)
        values = np.where(told.missing, np.nan, told.values)
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
        return _pair_angles(told.wi[order][starts][usable], told.wo[order][starts][usable]), mean[usable]

    @cached_property
    def _largest(self) -> float:
        at, _ = self._distinct
        return float(max(at.theta_i.max(), at.theta_o.max()))

    @cached_property
    def _kriging(self) -> tuple[Kriging, np.ndarray, np.ndarray]:
        """The interpolant of the logarithm, and the range (L,), (L,) of the logarithms that it goes through."""
        at, values = self._distinct
        lifted = values + self.background / np.cos(at.theta_i)[:, None] + _FLOOR
        lifted = np.log(_filled(lifted, self.measurement.wavelengths_nm)) + self._log_cosines(at)
        return krige(self.kernel, at.held(self._largest), lifted), lifted.min(axis=0), lifted.max(axis=0)

    def _log_cosines(self, at: PairAngles) -> Float[np.ndarray, "N 1"]:
        held = at.held(self._largest)
        return _COSINE_POWER * np.log(np.cos(held.theta_i) * np.cos(held.theta_o))[:, None]

    def _finished(self, logarithm: np.ndarray, at: PairAngles) -> np.ndarray:
        _, least, most = self._kriging
        values = np.exp(np.clip(logarithm, least, most) - self._log_cosines(at)) - _FLOOR
        if not self.reciprocal:
            values -= self.background / np.cos(np.minimum(at.theta_i, self._largest))[:, None]
        return np.maximum(values, 0.0)

    def _interpolated(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        at = _pair_angles(wi, wo)
        return self._finished(self._kriging[0](at.held(self._largest)), at)

    @cached_property
    def _table(self) -> Float[np.ndarray, "H D P L"]:
        """The logarithm at the nodes; those below the horizon continue it, so that cells at the horizon are whole."""
        theta_h = _FINE * np.sinh(np.linspace(0.0, np.arcsinh(0.5 * np.pi / _FINE), _NODES[0]))
        theta_d, phi_d = np.linspace(0.0, 0.5 * np.pi, _NODES[1]), np.linspace(0.0, 0.5 * np.pi, _NODES[2])
        nodes = [angle.ravel() for angle in np.meshgrid(theta_h, theta_d, phi_d, indexing="ij")]
        wi, wo = io_from_half_difference(*nodes)
        theta_i, theta_o, _ = io_angles(wi, wo)
        # The half and difference angles of the node itself: going through the directions would round them.
        at = PairAngles(theta_i, theta_o, nodes[0], nodes[1]).held(self._largest)
        return self._kriging[0](at).reshape(*_NODES, -1)

    def _looked_up(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        theta_h, theta_d, phi_d, _ = half_difference(wi, wo)
        # Exchange adds pi, mirroring changes the sign: a quarter turn holds everything.
        phi_d = np.mod(phi_d, np.pi)
        phi_d = np.minimum(phi_d, np.pi - phi_d)
        places = np.arcsinh(theta_h / _FINE) / np.arcsinh(0.5 * np.pi / _FINE), theta_d / (0.5 * np.pi)
        logarithm = _multilinear(self._table, (*places, phi_d / (0.5 * np.pi)))
        theta_i, theta_o, _ = io_angles(wi, wo)
        return self._finished(logarithm, PairAngles(theta_i, theta_o, theta_h, theta_d))

    @cached_property
    def _resampling(self) -> tuple[np.ndarray, np.ndarray]:
        grid = self.measurement.wavelengths_nm
        smooth, linear = (interpolation_matrix(grid, self.wavelengths_nm, "hold", m) for m in ("auto", "linear"))
        return smooth.T, linear.T

    def _resampled(self, values: Float[np.ndarray, "N L"]) -> np.ndarray:
        """On the working wavelengths: Sprague, and linear for a spectrum that Sprague would take below zero."""
        smooth, linear = self._resampling
        out = values @ smooth
        bad = (out < 0).any(axis=1)
        if bad.any():
            out[bad] = values[bad] @ linear
        return out


def estimated_background(measurement: ScatteredMeasurement) -> Float[np.ndarray, " L"]:
    """The k(lambda) >= 0 of f_r(i, o) - f_r(o, i) = -k (1/cos theta_i - 1/cos theta_o), 1/sr, by robust regression.

    Swapped pairs are interpolated linearly in the logarithm between the measured ones. 0 at wavelengths where fewer
    than 30 pairs can be compared.
    """
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import QhullError

    theta_i, theta_o, phi = io_angles(measurement.wi, measurement.wo)
    usable = ~measurement.missing & (measurement.values > 0)
    values = np.where(usable, measurement.values, 1.0)
    out = np.zeros(len(measurement.wavelengths_nm))
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
    """Slope of y = b x by iteratively reweighted least squares with Huber's weights."""
    weights = np.ones_like(x)
    slope = 0.0
    for _ in range(20):
        slope = float((weights * x) @ y / max((weights * x) @ x, 1e-300))
        residual = np.abs(y - slope * x)
        weights = np.minimum(1.0, 1.5 * np.median(residual) / np.maximum(residual, 1e-12))
    return slope


def _pair_angles(wi: np.ndarray, wo: np.ndarray) -> PairAngles:
    theta_i, theta_o, _ = io_angles(wi, wo)
    theta_h, theta_d, _, _ = half_difference(wi, wo)
    return PairAngles(theta_i, theta_o, theta_h, theta_d)


def _filled(values: Float[np.ndarray, "N L"], wavelengths_nm: np.ndarray) -> Float[np.ndarray, "N L"]:
    """Readings that dropped out (NaN), interpolated along the wavelengths in the logarithm, ends held."""
    out = values.copy()
    for index in np.flatnonzero(np.isnan(values).any(axis=1)):
        known = np.isfinite(values[index])
        line = np.interp(wavelengths_nm[~known], wavelengths_nm[known], np.log(values[index, known]))
        out[index, ~known] = np.exp(line)
    return out


def _multilinear(table: Float[np.ndarray, "H D P L"], places: tuple[np.ndarray, ...]) -> Float[np.ndarray, "N L"]:
    """Look-up at fractional places in [0, 1] of each axis."""
    flat = table.reshape(-1, table.shape[-1])
    below, beyond = [], []
    for place, size in zip(places, table.shape[:3], strict=True):
        position = np.clip(place, 0.0, 1.0) * (size - 1)
        index = np.minimum(position.astype(np.intp), size - 2)
        below.append(index)
        beyond.append(position - index)
    strides = (table.shape[1] * table.shape[2], table.shape[2], 1)
    corner = sum(index * stride for index, stride in zip(below, strides, strict=True))
    out = np.zeros((len(places[0]), table.shape[-1]))
    for offset in np.ndindex(2, 2, 2):
        share = np.ones(len(out))
        for step, fraction in zip(offset, beyond, strict=True):
            share = share * (fraction if step else 1.0 - fraction)
        out += share[:, None] * flat[corner + int(np.dot(offset, strides))]
    return out
