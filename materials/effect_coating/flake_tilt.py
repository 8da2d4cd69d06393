"""The flake-tilt BRDF: a clear coat over a matt body and flakes, corrected to go through readings at several angles.

With the tilt t and the incidence d of `CoatedPair`,

    f_r(lambda) = f_coat + B(lambda / c)          c = sqrt(1 - q sin^2 d)
    B(lambda)   = matt(lambda) n^2/pi T + flakes(lambda) T D(t) / (4 (cos i' + cos o'))

and both B and the sum are multiplied by the exponential of a Gaussian process over (sqrt t, d) through the logarithm of
readings over model. Tilt is used since readings lit at 45 degrees have tilts of 3.6 to 33 of the possible 41.8 degrees,
with nearly all of a picture between them. q shifts the spectrum of interference flakes towards blue at oblique
incidence, as thin films do. All of it is symmetric in light and viewer.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ..core.brdf import Brdf, Lobe, eval_lit
from .coated_pair import GRAZING, CoatedPair

#: Added to f_r before its logarithm, 1/sr: below it, 0.6 % of a white diffuser, corrections add rather than multiply.
FLOOR = 0.002
#: Lengths of the Gaussian process, radians: of the tilt, by its root, and of the incidence.
TILT_LENGTH, INCIDENCE_LENGTH = np.radians(3.0), np.radians(23.0)


@dataclass(frozen=True, eq=False)
class FlakeTilt(Brdf):
    """An effect coating reconstructed from readings at n angles; isotropic, reciprocal, never negative.

    Parameters
    ----------
    wavelengths_nm : (L,) ascending.
    coat_roughness : width of the coat's reflection, GGX; Beckmann of a `needle` (1, else 0), which the readings do not
        determine, too far from the mirror direction.
    flake_spread : GGX roughness of the flakes' tilts. interference : q, 0 for flakes that keep their colour.
    matt, flakes : (L,) of the body at normal incidence.
    tilts, incidences : (n,) of the readings, radians.
    body_weights, whole_weights : (n,L) of the Gaussian process that corrects the body, and of that which corrects all.
    scale : factor on the body, below 1 where it would reflect more than it receives. grazing : exponent of the cosines.
    floor, tilt_length, incidence_length : of the corrections (`FLOOR`, `TILT_LENGTH`, `INCIDENCE_LENGTH`), kept so that
        a record does not change with the constants of a version.
    """

    NAME: ClassVar[str] = "flake_tilt"
    isotropic = True

    wavelengths_nm: Float[np.ndarray, " L"]
    coat_roughness: float
    needle: int
    flake_spread: float
    interference: float
    matt: Float[np.ndarray, " L"]
    flakes: Float[np.ndarray, " L"]
    tilts: Float[np.ndarray, " n"]
    incidences: Float[np.ndarray, " n"]
    body_weights: Float[np.ndarray, "n L"]
    whole_weights: Float[np.ndarray, "n L"]
    scale: float = 1.0
    grazing: float = GRAZING
    floor: float = FLOOR
    tilt_length: float = float(TILT_LENGTH)
    incidence_length: float = float(INCIDENCE_LENGTH)

    def parameters(self) -> dict[str, Any]:
        """Return everything that `from_parameters` needs to rebuild this BRDF bit for bit."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> FlakeTilt:
        """Return the BRDF that `parameters` came from; raises `InputError` if one is missing."""
        names = [one.name for one in fields(cls)]
        if missing := sorted(set(names) - set(parameters)):
            raise InputError(
                "an effect coating is not complete",
                field="parameters",
                found=sorted(parameters),
                expected=f"also {', '.join(missing)}",
            )
        values: dict[str, Any] = {
            name: np.asarray(parameters[name], dtype=np.float64) if np.ndim(parameters[name]) else parameters[name]
            for name in names
        }
        return cls(**values)

    def lobes(self) -> tuple[Lobe, ...]:
        """Return the whole, over half and difference angles."""
        return (Lobe("hd", self),)

    def eval(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... L"]:
        """Evaluate f_r in 1/sr."""
        return eval_lit(self._lit, len(self.wavelengths_nm), wi, wo)

    def _lit(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        pair = CoatedPair.of(wi, wo)
        body, factor = self._parts(pair)
        coat = pair.coat(self.coat_roughness, bool(self.needle))[:, None] * factor
        return np.maximum(self.scale * body + coat, 0.0)

    def body(self, wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N L"]:
        """Return all but the coat's reflection, before `scale`, 1/sr."""
        return np.maximum(self._parts(CoatedPair.of(wi, wo))[0], 0.0)

    def _parts(self, pair: CoatedPair) -> tuple[Float[np.ndarray, "N L"], Float[np.ndarray, "N L"]]:
        """Return the body with both corrections, and the factor of the second one, which applies to the coat too."""
        lengths = (self.tilt_length, self.incidence_length)
        near = covariance(
            coordinates(pair.tilt, pair.incidence, lengths), coordinates(self.tilts, self.incidences, lengths)
        )
        body = np.outer(pair.matt(self.grazing), self.matt)
        body += np.outer(pair.flakes(self.flake_spread, self.grazing), self.flakes)
        body = np.maximum((body + self.floor) * np.exp(near @ self.body_weights) - self.floor, 0.0)
        if self.interference > 0.0:
            body = stretched(body, self.wavelengths_nm, 1.0 / shift(self.interference, pair.incidence))
        factor = np.exp(near @ self.whole_weights)
        return (body + self.floor) * factor - self.floor, factor


def coordinates(
    tilt: Float[np.ndarray, " N"],
    incidence: Float[np.ndarray, " N"],
    lengths: tuple[float, float] = (float(TILT_LENGTH), float(INCIDENCE_LENGTH)),
) -> Float[np.ndarray, "N 2"]:
    """Compute the coordinates of pairs for the Gaussian process, in units of its length scales."""
    return np.stack([np.sqrt(tilt / lengths[0]), incidence / lengths[1]], axis=1)


def covariance(one: Float[np.ndarray, "N 2"], other: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "N n"]:
    """Compute the Matérn covariance of degree 5/2 at unit length (Rasmussen and Williams 2006, eq. 4.17)."""
    far = np.sqrt(5.0 * np.sum((one[:, None] - other) ** 2, axis=-1))
    return (1.0 + far + far**2 / 3.0) * np.exp(-far)


def shift(interference: float, incidence: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    """Compute the wavelength of a feature relative to normal incidence.

    interference : q; of thin films (n_coat / n_film)^2.
    """
    return np.sqrt(1.0 - interference * np.sin(incidence) ** 2)


def stretched(
    values: Float[np.ndarray, "N L"], wavelengths_nm: Float[np.ndarray, " L"], by: Float[np.ndarray, " N"]
) -> Float[np.ndarray, "N L"]:
    """Resample each row of `values` at its wavelengths times a factor, linear between samples, clamped at the ends."""
    asked = np.clip(np.outer(by, wavelengths_nm), wavelengths_nm[0], wavelengths_nm[-1])
    cell = np.clip(np.searchsorted(wavelengths_nm, asked, side="right") - 1, 0, len(wavelengths_nm) - 2)
    share = (asked - wavelengths_nm[cell]) / np.diff(wavelengths_nm)[cell]
    rows = np.arange(len(values))[:, None]
    return values[rows, cell] * (1.0 - share) + values[rows, cell + 1] * share
