"""BRDFs measured in three channels on the half/difference grid of the MERL data base, with made-up spectra.

Angles are measured, wavelengths are not: RGB is interpolated between the nodes and then upsampled to a reflectance
spectrum (`spectral.upsampling`, whose scale is free), so that a highlight of any height has the measured colour. The
2010 paper does the same with Smits' spectra (section 4.2).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Bool, Float

from ...runtime.errors import InputError
from ...spectral.folding import Folding
from ...spectral.upsampling import DEFAULT_METHOD, PRIMARIES, upsampling
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..core.axes import Axis
from ..core.brdf import Brdf, Lobe, eval_lit
from ..core.directions import half_difference, io_from_half_difference
from ..core.points import Points
from .lookup import multilinear

#: Nodes of theta_h, theta_d and phi_d.
SHAPE = (90, 90, 180)
_CHANNELS = ("red", "green", "blue")
_RIGHT = 0.5 * np.pi
# Weights of lines along theta_h, theta_d and phi_d in a gap, at the same distance in nodes.
_TRUST = (0.02, 1.0, 1.0)
# Angles of the last nodes: beyond, f_r is held.
_LAST_HALF, _LAST_DIFFERENCE = (89.0 / 90.0) ** 2 * _RIGHT, np.radians(89.0)
_AXES = (Axis("theta_h", 90, _LAST_HALF, "sqrt"), Axis("theta_d", 90, _LAST_DIFFERENCE), Axis("phi_d", 37, np.pi))


@dataclass(frozen=True, eq=False)
class MerlMeasurement:
    """f_r of the three channels, 1/sr, [theta_h][theta_d][phi_d][channel]; 0 or less: no reading."""

    name: str
    values: Float[np.ndarray, "90 90 180 3"]


@dataclass(frozen=True, eq=False)
class MerlBrdf(Brdf):
    """An isotropic, reciprocal, mirror-symmetric BRDF through a MERL table, on the working wavelengths.

    Parameters
    ----------
    values : f_r of red, green and blue, 1/sr, as in the file; 0 or less is no reading, never black.
    method : of upsampling; one of `spectral.upsampling.METHODS`.
    name : of the material.

    RGB is linear between nodes in sqrt(theta_h), theta_d and phi_d, and clamped beyond the last ones (88.0 and 89 deg).
        An isotropic surface with a mirror plane is equal at phi_d and at pi - phi_d: the mean of the two is used, so
        that a table without such noise is reproduced exactly at its nodes. `notes` states the difference, and how many
        missing readings were filled from their neighbours.
    """

    NAME: ClassVar[str] = "merl"
    isotropic = True

    values: Float[np.ndarray, "H D P 3"]
    method: str = DEFAULT_METHOD
    name: str = ""

    def __post_init__(self) -> None:
        if self.values.shape != (*SHAPE, 3):
            raise InputError("not a MERL table", field="values", found=self.values.shape, expected=str((*SHAPE, 3)))
        if not np.isfinite(self.values).all():
            raise InputError("not a finite number", field="values", found="NaN or infinity", expected="f_r, or -1")
        for channel, label in enumerate(_CHANNELS):
            if not (self.values[..., channel] > 0).any():
                raise InputError("a channel without any reading", field=label, found="0 and less", expected="f_r > 0")
        upsampling(self.method)

    @classmethod
    def from_measurement(cls, measurement: MerlMeasurement, method: str = DEFAULT_METHOD) -> MerlBrdf:
        """Return the BRDF through a measurement as `read_merl` gives it."""
        return cls(measurement.values, method, measurement.name)

    def parameters(self) -> dict[str, Any]:
        """Return everything that `from_parameters` needs to rebuild this BRDF bit for bit."""
        return {"values": self.values, "method": self.method, "name": self.name}

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> MerlBrdf:
        """Return the BRDF that `parameters` came from."""
        if "values" not in parameters:
            found = sorted(parameters)
            raise InputError("a MERL BRDF is not complete", field="parameters", found=found, expected="also values")
        values = np.asarray(parameters["values"], dtype=np.float64)
        return cls(values, str(parameters.get("method", DEFAULT_METHOD)), str(parameters.get("name", "")))

    @property
    def wavelengths_nm(self) -> Float[np.ndarray, " L"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The working wavelengths, to which its colours are uplifted."""
        return WORKING_WAVELENGTHS_NM

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on assumptions and filled values."""
        missing = int((self._dropped).sum())
        readings = 3 * int(_reachable().sum())
        pairs = np.sort(np.stack([self.values[:, :, 1:90], self.values[:, :, :90:-1]]), axis=0)
        low, high = (side[pairs[0] > 0] for side in pairs)
        apart = float(np.median(high / low - 1.0)) if low.size else 0.0
        return (
            f"{missing} of {readings} readings dropped out (0 or -1 in the file) and were taken from their neighbours",
            f"phi_d and pi - phi_d differ by {100 * apart:.1f} % (median): their mean counts",
            f"RGB is taken as {PRIMARIES}, which the file does not state; spectra by {self.method}",
        )

    def lobes(self) -> tuple[Lobe, ...]:
        """Return the whole, over half and difference angles: without a cosine even a diffuse body is one term.

        The axes have the table's own nodes, except that the fit halves the azimuth only once, and that phi_d is smooth
        enough for every fifth node.
        """
        return (Lobe("hd", self, _AXES),)

    def eval(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... L"]:
        """Evaluate f_r in 1/sr on the working wavelengths."""
        make = upsampling(self.method)
        return eval_lit(lambda i, o: make.spectra(self._looked_up(i, o)), len(self.wavelengths_nm), wi, wo)

    def xyz(self, points: Points, folding: Folding) -> Float[np.ndarray, "N M3"]:
        """Implement `Surface.xyz`; the upsampling spectra are folded before they are mixed."""
        weights = folding.weights(self.wavelengths_nm)
        folded = partial(upsampling(self.method).folded, weights=weights)
        return eval_lit(lambda i, o: folded(self._looked_up(i, o)), weights.shape[1], points.wi, points.wo)

    def eval_rgb(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... 3"]:
        """Evaluate f_r of red, green and blue in 1/sr."""
        return eval_lit(self._looked_up, 3, wi, wo)

    @cached_property
    def _dropped(self) -> Bool[np.ndarray, "90 90 180 3"]:
        """Mask of missing readings at nodes that some pair of directions has."""
        return (self.values <= 0) & _reachable()[..., None]

    @cached_property
    def _table(self) -> Float[np.ndarray, "90 90 91 3"]:
        """RGB at phi_d from 0 to 90 degrees, the mirrored halves averaged, without gaps."""
        known = self.values > 0
        mirror = -np.arange(91) % 180
        values, flags = np.where(known, self.values, 0.0), known.astype(np.float64)
        count = flags[:, :, :91] + flags[:, :, mirror]
        total = values[:, :, :91] + values[:, :, mirror]
        mean = np.divide(total, count, out=np.zeros_like(total), where=count > 0)
        return np.stack([_without_gaps(mean[..., channel]) for channel in range(3)], axis=-1)

    def _looked_up(self, wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        theta_h, theta_d, phi_d, _ = half_difference(wi, wo)
        # Exchange adds pi, mirroring changes the sign: a quarter turn holds everything.
        phi_d = np.mod(phi_d, np.pi)
        phi_d = np.minimum(phi_d, np.pi - phi_d)
        return multilinear(self._table, (np.sqrt(theta_h / _LAST_HALF), theta_d / _LAST_DIFFERENCE, phi_d / _RIGHT))


def node_angles() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return theta_h (90,), theta_d (90,) and phi_d (180,) of the nodes, radians."""
    return (np.arange(90) / 90.0) ** 2 * _RIGHT, np.radians(np.arange(90.0)), np.radians(np.arange(180.0))


def _reachable() -> Bool[np.ndarray, "90 90 180"]:
    """Return the mask of nodes that some pair of directions above the horizon has."""
    wi, wo = io_from_half_difference(*np.meshgrid(*node_angles(), indexing="ij"))
    return (wi[..., 2] > 1e-9) & (wo[..., 2] > 1e-9)


def _without_gaps(values: Float[np.ndarray, "H D P"]) -> Float[np.ndarray, "H D P"]:
    """Replace every 0 by interpolation from the positive nodes around it.

    Along each axis a straight line in the logarithm between the nearest ones on both sides, or the nearest if there is
    one side only; nearer axes have more weight, and theta_h, along which a lobe falls by decades, less.
    """
    known = values > 0
    logarithm = np.log(np.where(known, values, 1.0))
    while not known.all():
        total, weight = np.zeros_like(logarithm), np.zeros_like(logarithm)
        for axis, trust in enumerate(_TRUST):
            for found, near in _lines(np.moveaxis(logarithm, axis, -1), np.moveaxis(known, axis, -1)):
                total += trust * np.moveaxis(found * near, -1, axis)
                weight += trust * np.moveaxis(near, -1, axis)
        fill = ~known & (weight > 0)
        logarithm[fill] = total[fill] / weight[fill]
        known = known | fill
    return np.exp(logarithm)


def _lines(logarithm: np.ndarray, known: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Interpolate along the last axis: values of the nearest known node below and above, and their weights.

    Weights of the two sides are 1 / distance, which makes their mean the straight line between them, times 1 / distance
    to the nearer one.
    """
    size = known.shape[-1]
    place = np.arange(size)
    below = np.maximum.accumulate(np.where(known, place, -1), axis=-1)
    above = np.minimum.accumulate(np.where(known, place, size)[..., ::-1], axis=-1)[..., ::-1]
    apart = np.stack([np.where(below >= 0, place - below, np.inf), np.where(above < size, above - place, np.inf)])
    inverse = 1.0 / np.maximum(apart, 1.0)
    sides = (np.maximum(below, 0), np.minimum(above, size - 1))
    return [
        (np.take_along_axis(logarithm, side, axis=-1), share * inverse.max(axis=0))
        for side, share in zip(sides, inverse, strict=True)
    ]
