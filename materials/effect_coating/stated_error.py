"""Estimated error of a reconstruction between its readings, from other models of the same readings.

Cross-validation does not predict it: on measured paints, the error at six angles left out one by one does not rank the
paints. The disagreement of models does, direction by direction (Spearman's rank correlation 0.6 to 0.7 over eleven
paints). Constants below are of these paints; the error of any one is predicted within a factor of about 2.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ...spectral.difference import delta_e_xyz
from ...spectral.folding import Folding
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ..core.protocol import LIGHTS, sphere_protocol
from .coated_pair import CoatedPair, aspecular
from .fit import AngleReadings, beside_coat, reconstructed
from .flake_tilt import FLOOR, FlakeTilt

#: Degrees from the mirror direction within which the coat's own reflection dominates, which was not measured.
FLARE = 7.0
OBSERVER = "1931_2"
# By the least number of readings: mean error over mean spread, and the factor below which nine tenths of the errors lie
# of the spread, or of `_LEAST` where it is less.
_BY_COUNT = ((9, 1.2, 2.0), (6, 1.4, 2.75), (0, 2.0, 3.3))
_LEAST = 2.0
# Exponents of the cosines in place of the chosen one.
_GRAZING = (0.0, -0.4)
_SPECTRA = 3
_PIXELS = 48
# Readings whose angles are this close, radians, count by their mean.
_ONE_ANGLE = np.radians(1.0)
Evaluate = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class StatedError:
    """Expected ΔE94 of a reconstruction on the sphere protocol, except within `FLARE` of the mirror direction.

    lights : names. mean, bound : for each the approximate mean, within a factor of 2; and the bound of some nine
    tenths.
    """

    lights: tuple[str, ...]
    mean: tuple[float, ...]
    bound: tuple[float, ...]

    def stored(self) -> dict[str, Any]:
        """Return the parts that a record keeps."""
        return {
            "expected.lights": " ".join(self.lights),
            "expected.mean": np.array(self.mean),
            "expected.bound": np.array(self.bound),
        }

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any]) -> StatedError | None:
        """Return the error among the stored fields of a record; None if there is none."""
        if "expected.lights" not in kept:
            return None
        figures = (tuple(float(one) for one in kept[f"expected.{name}"]) for name in ("mean", "bound"))
        return cls(tuple(str(kept["expected.lights"]).split()), *figures)


def stated_error(readings: AngleReadings, brdf: FlakeTilt) -> StatedError:
    """Estimate the error of `brdf` on the sphere protocol, under each light."""
    sphere = sphere_protocol(_PIXELS)
    seen = aspecular(sphere.wi, sphere.wo) > np.radians(FLARE)
    mean, bound = expected_errors(readings, brdf, sphere.wi[seen], sphere.wo[seen], LIGHTS)
    return StatedError(
        LIGHTS,
        tuple(float(one) for one in mean.mean(axis=1)),
        tuple(float(one) for one in bound.mean(axis=1)),
    )


def expected_errors(
    readings: AngleReadings,
    brdf: FlakeTilt,
    wi: Float[np.ndarray, "N 3"],
    wo: Float[np.ndarray, "N 3"],
    lights: Sequence[str] = LIGHTS,
) -> tuple[Float[np.ndarray, "M N"], Float[np.ndarray, "M N"]]:
    """Estimate ΔE94 of each pair of directions under M lights, and the bound of nine tenths of such errors."""
    folding = Folding(observer(OBSERVER), [illuminant(light) for light in lights], np.pi)
    weights = folding.weights(brdf.wavelengths_nm).reshape(len(brdf.wavelengths_nm), len(lights), 3)

    def colours(values: Float[np.ndarray, "N L"]) -> Float[np.ndarray, "M N 3"]:
        return np.einsum("nl,lmc->mnc", values * wi[:, 2:], weights)

    chosen = colours(brdf.eval(wi, wo))
    others = [colours(model(wi, wo)) for model in alternatives(readings, brdf)]
    whites = weights.sum(axis=0) / np.pi
    spread = np.array(
        [
            np.mean([delta_e_xyz(chosen[at], other[at], white) for other in others], axis=0)
            for at, white in enumerate(whites)
        ]
    )
    _, ratio, factor = next(row for row in _BY_COUNT if len(readings.values) >= row[0])
    return ratio * spread, factor * np.maximum(spread, _LEAST)


def alternatives(readings: AngleReadings, brdf: FlakeTilt) -> tuple[Evaluate, ...]:
    """Return five other models of the same readings.

    Curves over the aspecular angle and over tilt, three spectra over tilt, and flake-tilt BRDFs of other exponents of
    the cosines.
    """
    pair, coat = readings.pair, readings.pair.coat(brdf.coat_roughness, bool(brdf.needle))
    by_angle = _curve(aspecular(readings.wi, readings.wo), np.log(readings.lifted + FLOOR))
    rest = beside_coat(readings, coat) / _mirrors(pair)[:, None]
    lifted = 10.0 * FLOOR
    by_tilt = _curve(pair.tilt, np.log(rest + lifted))
    amounts, sizes, spectra = np.linalg.svd(rest, full_matrices=False)
    spectra = spectra[:_SPECTRA]
    by_amount = _curve(pair.tilt, (amounts * sizes)[:, :_SPECTRA])

    def aspecular_curve(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return np.maximum(np.exp(by_angle(aspecular(wi, wo))) - FLOOR, 0.0)

    def coated(body: Callable[[CoatedPair], np.ndarray]) -> Evaluate:
        def evaluate(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
            at = CoatedPair.of(wi, wo)
            gloss = at.coat(brdf.coat_roughness, bool(brdf.needle))
            return np.maximum(body(at), 0.0) * _mirrors(at)[:, None] + gloss[:, None]

        return evaluate

    tilt_curve = coated(lambda at: np.exp(by_tilt(at.tilt)) - lifted)
    three_spectra = coated(lambda at: by_amount(at.tilt) @ spectra)
    others = (reconstructed(readings, interference=brdf.interference, grazing=power).eval for power in _GRAZING)
    return (aspecular_curve, tilt_curve, three_spectra, *others)


def _mirrors(pair: CoatedPair) -> Float[np.ndarray, " N"]:
    """Evaluate the factor of flakes of any tilt, 1/sr."""
    return pair.through / (4.0 * pair.cosines)


def _curve(angle: Float[np.ndarray, " n"], values: Float[np.ndarray, "n K"]) -> Callable[[np.ndarray], np.ndarray]:
    """Interpolate values by angle with monotone cubics; clamped at the ends."""
    order = np.argsort(angle, kind="stable")
    angle, values = angle[order], values[order]
    group = np.concatenate([[0], np.cumsum(np.diff(angle) > _ONE_ANGLE)])
    count = np.bincount(group)
    nodes = np.bincount(group, angle) / count
    means = np.stack([np.bincount(group, column) / count for column in values.T], axis=1)
    if len(nodes) == 1:
        return lambda at: np.broadcast_to(means, (len(at), means.shape[1]))
    from scipy.interpolate import PchipInterpolator

    through = PchipInterpolator(nodes, means)
    return lambda at: through(np.clip(at, nodes[0], nodes[-1]))
