"""Measured BRDFs of the RGL material data base (Dupuy and Jakob, ACM Transactions on Graphics 37(6), 2018).

The measurement lives on the unit square of each light direction, on which the normals that the light sees are uniform:
a pair of directions goes to its half vector m, that to (sqrt(2 theta / pi), phi / 2 pi + 1/2), and the density of the
visible normals maps this onto the square (`bilinear_warp`). The stored value, S, is the quotient of the measured
radiance and that of a mirror-like microfacet surface, so that

    f_r(wi, wo) cos(theta_o) = S(warp(m), wi) D(m) / (4 sigma(wi))

with the distribution of normals D and its area sigma projected towards wi. Isotropic materials take the azimuth of m
from that of wi. Everything is linear between nodes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.folding import Folding
from ...spectral.projection import finer_note
from ...spectral.saturated_colours import folded_spectra_of, spectra_of
from ...spectral.upsampling import DEFAULT_METHOD, PRIMARIES, upsampling
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM, material_wavelengths
from ..core.brdf import Brdf, Lobe, eval_lit
from ..core.directions import TAU, angles
from ..core.points import Points
from .bilinear_warp import BilinearWarp, Slices, bilinear
from .rgl_measurement import RglMeasurement

# cos(89.9 deg): beyond, the cosine that stored values are divided by is held, so that f_r stays finite.
_LEAST_COSINE = float(np.cos(np.radians(89.9)))
_FIELD = "field_"


@dataclass(frozen=True, eq=False)
class RglBrdf(Brdf):
    """The BRDF of an `RglMeasurement` on the working wavelengths; isotropic or anisotropic, as the file is.

    Parameters
    ----------
    measurement : the file's fields.
    method : of upsampling a file in RGB, one of `spectral.upsampling.METHODS`; spectra need none.

    f_r has no cosine: the viewer's, which stored values include, is divided out, beyond 89.9 deg that of 89.9 deg.
        Reciprocity and mirror symmetry are not enforced on the measurement. Light directions beyond the tabulated ones
        are clamped to the last. Negative channels of a file in RGB are colours outside sRGB, which `spectra_of` keeps.
    """

    NAME: ClassVar[str] = "rgl"

    measurement: RglMeasurement
    method: str = DEFAULT_METHOD

    def __post_init__(self) -> None:
        upsampling(self.method)
        if not self.measurement.isotropic:
            _ = self._reduction

    @classmethod
    def from_measurement(cls, measurement: RglMeasurement, method: str = DEFAULT_METHOD) -> RglBrdf:
        """Return the BRDF of a measurement as `read_rgl` gives it."""
        return cls(measurement, method)

    def parameters(self) -> dict[str, Any]:
        """Return everything that `from_parameters` needs to rebuild this BRDF bit for bit: all fields of the file."""
        fields = {_FIELD + name: value for name, value in self.measurement.fields.items()}
        return {"name": self.measurement.name, "method": self.method, **fields}

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> RglBrdf:
        """Return the BRDF that `parameters` came from; raises `InputError` where a field is missing."""
        fields = {
            name.removeprefix(_FIELD): np.asarray(value)
            for name, value in parameters.items()
            if name.startswith(_FIELD)
        }
        measurement = RglMeasurement(str(parameters.get("name", "")), fields)
        return cls(measurement, str(parameters.get("method", DEFAULT_METHOD)))

    @property
    def isotropic(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        """True if the measurement is."""
        return self.measurement.isotropic

    @cached_property
    def wavelengths_nm(self) -> Float[np.ndarray, " L"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The working wavelengths; or those of the file within the visible, if these are finer."""
        measured_nm = self.measurement.wavelengths_nm
        return WORKING_WAVELENGTHS_NM if measured_nm is None else material_wavelengths([measured_nm])

    @property
    def spectral(self) -> bool:
        """True if the file has spectra, False if it has RGB."""
        return self.measurement.wavelengths_nm is not None

    @property
    def channels(self) -> int:
        """Number of values per pair: wavelengths, or 3."""
        return self.measurement.values.shape[2]

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on assumptions and clamped values."""
        values, theta = self.measurement.values, np.degrees(self.measurement.fields["theta_i"])
        negative = int(np.sum(values < 0))
        measured_nm = self.measurement.wavelengths_nm
        if measured_nm is None:
            how = f"RGB is taken as {PRIMARIES}, which the file does not state; spectra by {self.method}"
        else:
            ends = f"{measured_nm[0]:g} to {measured_nm[-1]:g} nm"
            how = f"known from {ends}, linear between; beyond, the end values are repeated"
        finer = None if measured_nm is None else finer_note(measured_nm)
        kept = f"{negative} of {values.size} values are negative, down to {values.min():.3g}, and kept so"
        kept += ": colours outside sRGB" if measured_nm is None else ""
        return (
            how,
            *([finer] if finer else []),
            *([kept] if negative else []),
            f"light from {theta[0]:.1f} to {theta[-1]:.1f} deg; beyond, the end values are repeated",
            "stored values were divided by cos(theta_o), beyond 89.9 deg by that of 89.9 deg",
        )

    def lobes(self) -> tuple[Lobe, ...]:
        """Return the whole, over half and difference angles: lacquers and films peak about the half vector."""
        return (Lobe("hd", self),)

    def eval(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... L"]:
        """Evaluate f_r in 1/sr on `wavelengths_nm`."""
        if self.spectral:
            return eval_lit(lambda i, o: self._looked_up(self._resampled, i, o), len(self.wavelengths_nm), wi, wo)
        return eval_lit(
            lambda i, o: spectra_of(self._looked_up(self._stored, i, o), self.method), len(self.wavelengths_nm), wi, wo
        )

    def xyz(self, points: Points, folding: Folding) -> Float[np.ndarray, "N M3"]:
        """Implement `Surface.xyz`; upsampling spectra, or a spectral file's table, are folded before they are mixed."""
        weights = folding.weights(self.wavelengths_nm)
        if self.spectral:
            table = self._folded_table(weights)
            return eval_lit(lambda i, o: self._looked_up(table, i, o), weights.shape[1], points.wi, points.wo)
        return eval_lit(
            lambda i, o: folded_spectra_of(self._looked_up(self._stored, i, o), weights, self.method),
            weights.shape[1],
            points.wi,
            points.wo,
        )

    def eval_measured(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... C"]:
        """Evaluate f_r in 1/sr in the file's own channels: its wavelengths, or red, green and blue."""
        return eval_lit(lambda i, o: self._looked_up(self._stored, i, o), self.channels, wi, wo)

    def _looked_up(self, table: np.ndarray, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Interpolate f_r of pairs (N, 3) above the horizon, in the channels of `table` (S, H, W, C)."""
        theta_i, phi_i = angles(wi)
        theta_m, phi_m = angles(wi + wo)
        phi_i = np.where(phi_i > np.pi, phi_i - TAU, phi_i)
        if self.isotropic:
            phi_m = phi_m - phi_i
        else:
            phi_i, phi_m = self._folded(phi_i, phi_m)
        slices = self._slices(phi_i, theta_i)
        x, y = np.sqrt(2.0 / np.pi * theta_m), np.mod(phi_m / TAU + 0.5, 1.0)
        out = bilinear(table, *self._warp.uniform(x, y, slices), slices)
        scale = 1.0 / np.maximum(wo[:, 2], _LEAST_COSINE)
        if self.measurement.jacobian:
            fields, only = self.measurement.fields, [(np.zeros(len(wi), dtype=np.intp), np.ones(len(wi)))]
            density = bilinear(fields["ndf"][None, ..., None], x, y, only)[:, 0]
            lit_x, lit_y = np.sqrt(2.0 / np.pi * theta_i), np.mod(phi_i / TAU + 0.5, 1.0)
            area = 4.0 * bilinear(fields["sigma"][None, ..., None], lit_x, lit_y, only)[:, 0]
            # A surface that shows the light no area reflects none of it.
            scale = scale * np.divide(density, area, out=np.zeros_like(area), where=area > 0)
        out *= scale[:, None]
        return out

    @cached_property
    def _stored(self) -> Float[np.ndarray, "S H W C"]:
        values = self.measurement.values
        values = values.reshape(-1, *values.shape[2:])
        return np.ascontiguousarray(np.moveaxis(values, 1, -1), dtype=np.float64)

    def _folded_table(self, weights: Float[np.ndarray, "L M3"]) -> Float[np.ndarray, "S H W M3"]:
        """Return the table in colour, cached for the last lights."""
        if not self._last or self._last[0][0] is not weights:
            self._last[:] = [(weights, self._resampled @ weights)]
        return self._last[0][1]

    @cached_property
    def _last(self) -> list[tuple[np.ndarray, np.ndarray]]:
        return []

    @cached_property
    def _resampled(self) -> Float[np.ndarray, "S H W L"]:
        measured_nm = self.measurement.wavelengths_nm
        assert measured_nm is not None
        if np.array_equal(measured_nm, self.wavelengths_nm):
            return self._stored
        matrix = np.stack([np.interp(self.wavelengths_nm, measured_nm, unit) for unit in np.eye(len(measured_nm))])
        return self._stored @ matrix

    @cached_property
    def _warp(self) -> BilinearWarp:
        density = self.measurement.fields["vndf"]
        return BilinearWarp(density.reshape(-1, *density.shape[2:]))

    @cached_property
    def _reduction(self) -> int:
        """Number of repetitions of the tabulated azimuths per turn: 2 is half-turn symmetry, 4 two mirrors."""
        phi = self.measurement.fields["phi_i"].astype(np.float64)
        times = round(TAU / float(phi[-1] - phi[0]))
        if times not in (1, 2, 4):
            found = f"{np.degrees(phi[0]):.1f} to {np.degrees(phi[-1]):.1f} deg"
            raise InputError("azimuths of no known symmetry", field="phi_i", found=found, expected="360, 180 or 90 deg")
        return times

    def _folded(self, phi_i: np.ndarray, phi_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Map azimuths of the light and of the half vector to the tabulated range, by rotation and mirroring."""
        first = float(self.measurement.fields["phi_i"][0])
        if self._reduction == 1:
            return phi_i, phi_m
        turns = np.pi * np.floor((phi_i - first) / np.pi)
        phi_i, phi_m = phi_i - turns, phi_m - turns
        if self._reduction == 4:
            middle = first + 0.5 * np.pi
            beyond = phi_i > middle
            phi_i = np.where(beyond, 2.0 * middle - phi_i, phi_i)
            phi_m = np.where(beyond, 2.0 * middle - phi_m, phi_m)
        return phi_i, phi_m

    def _slices(self, phi_i: np.ndarray, theta_i: np.ndarray) -> Slices:
        """Return the tabulated light directions around these, as indices into (P x T,), and their weights."""
        fields = self.measurement.fields
        azimuths, polars = _around(fields["phi_i"], phi_i), _around(fields["theta_i"], theta_i)
        count = len(fields["theta_i"])
        return [(a * count + t, share_a * share_t) for a, share_a in azimuths for t, share_t in polars]


def _around(nodes: np.ndarray, x: np.ndarray) -> Slices:
    """Return the nodes on both sides of x and their weights; the end nodes beyond them."""
    if len(nodes) == 1:
        return [(np.zeros(len(x), dtype=np.intp), np.ones(len(x)))]
    nodes = nodes.astype(np.float64)
    low = np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, len(nodes) - 2)
    share = np.clip((x - nodes[low]) / (nodes[low + 1] - nodes[low]), 0.0, 1.0)
    return [(low, 1.0 - share), (low + 1, share)]
