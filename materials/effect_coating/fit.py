"""Fit of a flake-tilt BRDF to readings of one coating at several angles."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.angles import FEWEST, flop_weights
from ...spectral.difference import lab_from_xyz
from ..core.directions import spherical
from .coated_pair import GRAZING, CoatedPair
from .flake_tilt import FLOOR, FlakeTilt, coordinates, covariance, shift, stretched

#: Width of the coat's reflection where nothing tells it: that of a high-gloss lacquer, Beckmann.
ASSUMED_NEEDLE = 0.02
# Widths of a coat that readings can tell, and of the flakes' tilts (GGX).
_COATS = np.geomspace(0.1, 0.45, 10)
_SPREADS = np.geomspace(0.04, 0.75, 16)
# A narrower coat is taken where its evidence is within this factor of the best.
_AS_GOOD = 1.02
# Least share of a reading that is left for the body.
_LEAST_BODY = 0.03
_RIDGE = 2e-3
# Variance of noise over that of the Gaussian process, of the body and of the sum: readings are gone through.
_BODY_NOISE, _WHOLE_NOISE = 0.05, 0.001
# Interference is told where some readings are at nearly one tilt and at two incidences, degrees...
_ONE_TILT, _LARGEST_TILT, _TWO_INCIDENCES = 2.0, 16.0, 4.0
# ... and taken where it spares more than this share of what is to be corrected.
_SPARES = 0.1
_STEP = 0.1
_INTERFERENCES = np.arange(1, 14) * _STEP
# Nodes of the body's albedo: incidences, degrees, and directions of the viewer.
_INCIDENCES = (0.0, 20.0, 40.0, 60.0, 70.0, 80.0, 85.0)
_POLAR, _AZIMUTHS = 24, 16


@dataclass(frozen=True, eq=False)
class AngleReadings:
    """f_r of one coating at n distinct pairs of directions.

    wavelengths_nm : (L,). wi, wo : (n,3) above the horizon. values : (n,L) f_r in 1/sr; readings below 0 count as 0.
    """

    wavelengths_nm: Float[np.ndarray, " L"]
    wi: Float[np.ndarray, "n 3"]
    wo: Float[np.ndarray, "n 3"]
    values: Float[np.ndarray, "n L"]

    def __post_init__(self) -> None:
        if len(self.values) < FEWEST:
            raise InputError(
                "too few angles tell no BRDF",
                field="readings",
                found=f"{len(self.values)} angles",
                expected=f"{FEWEST} or more",
                hint="readings at two angles are judged each for itself: metamer match",
            )
        if not np.isfinite(self.values).all():
            raise InputError("a reading is no number", field="readings", found="NaN or infinite", expected="numbers")

    @cached_property
    def pair(self) -> CoatedPair:
        """The pairs within the coat."""
        return CoatedPair.of(self.wi, self.wo)

    @cached_property
    def lifted(self) -> Float[np.ndarray, "n L"]:
        """`values` clamped to 0 or more."""
        return np.maximum(self.values, 0.0)

    @property
    def lab(self) -> Float[np.ndarray, "n 3"]:
        """CIELAB of their radiance factors under D65 for 10 degrees."""
        weights = flop_weights(self.wavelengths_nm)
        return lab_from_xyz(np.pi * self.lifted @ weights.T, weights.sum(axis=1))

    @property
    def tell_interference(self) -> bool:
        """True if two readings have the same tilt at two incidences, as 45as15 and 45as-15 do.

        One angle alone cannot separate the flakes' colour from its shift with incidence.
        """
        tilt, incidence = np.degrees(self.pair.tilt), np.degrees(self.pair.incidence)
        return any(
            abs(tilt[one] - tilt[two]) < _ONE_TILT
            and max(tilt[one], tilt[two]) < _LARGEST_TILT
            and abs(incidence[one] - incidence[two]) > _TWO_INCIDENCES
            for one, two in combinations(range(len(tilt)), 2)
        )


@dataclass(frozen=True, eq=False)
class _Trials:
    """Arrays that every trial of coat and interference shares.

    flat (n,), leaning (S,n) : the matt body and flakes of each spread, 1/sr. weight (n,) : of the least squares.
    inverse (n,n) : of the Gram matrix with noise. coats : width, whether it is a needle, and the reflection (n,).
    """

    readings: AngleReadings
    flat: Float[np.ndarray, " n"]
    leaning: Float[np.ndarray, "S n"]
    weight: Float[np.ndarray, " n"]
    inverse: Float[np.ndarray, "n n"]
    coats: tuple[tuple[float, bool, Float[np.ndarray, " n"]], ...]

    @classmethod
    def of(cls, readings: AngleReadings, needle: float | None, grazing: float) -> _Trials:
        """Try one needle, or the assumed one and all wider coats."""
        pair = readings.pair
        wider = () if needle is not None else ((float(width), False) for width in _COATS)
        widths = ((ASSUMED_NEEDLE if needle is None else needle, True), *wider)
        return cls(
            readings,
            flat=pair.matt(grazing),
            leaning=np.stack([pair.flakes(spread, grazing) for spread in _SPREADS]),
            weight=(np.pi * readings.lifted @ flop_weights(readings.wavelengths_nm)[1] + 0.01) ** (-2.0 / 3.0),
            inverse=np.linalg.inv(_gram(pair, _BODY_NOISE)),
            coats=tuple((*width, pair.coat(*width)) for width in widths),
        )


@dataclass(frozen=True, eq=False)
class _Body:
    """Coat, flakes and body by least squares; `coat` and `model` (n,L) are coat and body at the readings.

    The body's is shifted to normal incidence.
    """

    roughness: float
    needle: bool
    spread: float
    interference: float
    matt: Float[np.ndarray, " L"]
    flakes: Float[np.ndarray, " L"]
    coat: Float[np.ndarray, " n"]
    model: Float[np.ndarray, "n L"]
    evidence: float


def reconstructed(
    readings: AngleReadings,
    *,
    needle: float | None = None,
    interference: float | None = None,
    grazing: float = GRAZING,
) -> FlakeTilt:
    """Fit a flake-tilt BRDF to readings.

    Parameters
    ----------
    needle : Beckmann width of a glossy coat, from its gloss; None: `ASSUMED_NEEDLE`, or a wider one if the readings
        imply it.
    interference : q; None: estimated from readings at one tilt and two incidences, 0 if there are none or they agree.
        It is meaningless for spectra synthesised from colours, and must be 0 there.
    grazing : exponent of the cosines on the body.

    Raises
    ------
    InputError : readings that cannot be used.
    """
    trials = _Trials.of(readings, needle, grazing)
    body = _body(trials, interference or 0.0)
    if interference is None and readings.tell_interference:
        moved = min((_body(trials, float(q)) for q in _INTERFERENCES), key=_evidence)
        near = (moved.interference - 0.5 * _STEP, moved.interference + 0.5 * _STEP)
        moved = min((moved, *(_body(trials, q) for q in near)), key=_evidence)
        if moved.evidence < (1.0 - _SPARES) * body.evidence:
            body = moved
    return _scaled(_corrected(readings, body, grazing))


def evidence(readings: AngleReadings, interference: float) -> float:
    """Compute how much correction readings need beyond the best coat, body and flakes."""
    return _body(_Trials.of(readings, None, GRAZING), interference).evidence


def _evidence(body: _Body) -> float:
    return body.evidence


def _body(trials: _Trials, interference: float) -> _Body:
    """Return the narrowest coat of nearly the best evidence, with its best spread of the flakes."""
    readings = trials.readings
    c = shift(interference, readings.pair.incidence)
    whole = stretched(readings.lifted, readings.wavelengths_nm, c)
    found = [_with_coat(trials, *coat, interference, c, whole) for coat in trials.coats]
    best = min(one.evidence for one in found)
    return next(one for one in found if one.evidence <= _AS_GOOD * best)


def _with_coat(
    trials: _Trials,
    roughness: float,
    needle: bool,
    coat: Float[np.ndarray, " n"],
    interference: float,
    c: Float[np.ndarray, " n"],
    whole: Float[np.ndarray, "n L"],
) -> _Body:
    """Fit matt and flakes, not below 0, at every wavelength by ridge regression, with the weights of L*.

    The spread is the one that needs the least correction: y^T (K + noise)^-1 y of the residual logarithms, the evidence
    of the correcting Gaussian process (Rasmussen and Williams 2006, eq. 2.30). c : factors of wavelengths by `shift`,
    by which `whole` are the readings shifted to normal incidence.
    """
    readings, flat, leaning, weight = trials.readings, trials.flat, trials.leaning, trials.weight
    rest = stretched(beside_coat(readings, coat), readings.wavelengths_nm, c)
    matt, flakes = _two_part_least_squares(weight * flat, weight * leaning, weight[:, None] * rest)
    model = flat[:, None] * matt[:, None] + leaning[..., None] * flakes[:, None]
    left = np.log((whole + FLOOR) / (model + coat[:, None] + FLOOR))
    evidence = np.sum(left * (trials.inverse @ left), axis=(1, 2))
    at = int(np.argmin(evidence))
    spread = float(_SPREADS[at])
    return _Body(
        roughness, needle, spread, interference, matt[at], flakes[at], coat, model[at], float(evidence[at])
    )  # fmt: skip


def _two_part_least_squares(
    first: Float[np.ndarray, " n"], second: Float[np.ndarray, "S n"], values: Float[np.ndarray, "n L"]
) -> tuple[Float[np.ndarray, "S L"], Float[np.ndarray, "S L"]]:
    """Fit non-negative amounts of two parts, for each of S second parts; if one would be negative, the other alone.

    The ridge is relative to each part's own square, so that the determinant is above 0.
    """
    one = (1.0 + _RIDGE) * (first @ first)
    two = (1.0 + _RIDGE) * np.sum(second**2, axis=1)[:, None]
    both = (second @ first)[:, None]
    with_one, with_two = first @ values, second @ values
    determinant = one * two - both**2
    a, b = (with_one * two - with_two * both) / determinant, (with_two * one - with_one * both) / determinant
    alone_a = np.broadcast_to(np.maximum(with_one / one, 0.0), a.shape)
    alone_b = np.maximum(with_two / two, 0.0)
    return np.where(b < 0.0, alone_a, np.maximum(a, 0.0)), np.where(a < 0.0, alone_b, np.maximum(b, 0.0))


def _corrected(readings: AngleReadings, body: _Body, grazing: float) -> FlakeTilt:
    """Correct the BRDF of a body to go through the readings: first the body, then the sum."""
    pair, nm = readings.pair, readings.wavelengths_nm
    rest = stretched(beside_coat(readings, body.coat), nm, shift(body.interference, pair.incidence))
    left = np.log((rest + FLOOR) / (body.model + FLOOR))
    brdf = FlakeTilt(
        wavelengths_nm=nm,
        coat_roughness=body.roughness,
        needle=int(body.needle),
        flake_spread=body.spread,
        interference=body.interference,
        matt=body.matt,
        flakes=body.flakes,
        tilts=pair.tilt,
        incidences=pair.incidence,
        body_weights=np.linalg.solve(_gram(pair, _BODY_NOISE), left),
        whole_weights=np.zeros_like(left),
        grazing=grazing,
    )
    left = np.log((readings.lifted + FLOOR) / (brdf.eval(readings.wi, readings.wo) + FLOOR))
    return replace(brdf, whole_weights=np.linalg.solve(_gram(pair, _WHOLE_NOISE), left))


def _scaled(brdf: FlakeTilt) -> FlakeTilt:
    """Darken the body where it would reflect more light than it receives at any wavelength."""
    most = float(body_albedo(brdf).max())
    return brdf if most <= 1.0 else replace(brdf, scale=1.0 / most)


def body_albedo(brdf: FlakeTilt) -> Float[np.ndarray, "I L"]:
    """Compute the fraction of light that the body reflects from each of seven incidences, before `scale`.

    Gauss-Legendre in sin^2(theta_o), in which cos(theta) dw is uniform, and evenly in azimuth.
    """
    nodes, shares = np.polynomial.legendre.leggauss(_POLAR)
    theta_o = np.arcsin(np.sqrt(0.5 * (nodes + 1.0)))
    azimuths = (np.arange(_AZIMUTHS) + 0.5) * np.pi / _AZIMUTHS
    wo = spherical(np.repeat(theta_o, _AZIMUTHS), np.tile(azimuths, _POLAR))
    weights = np.repeat(0.5 * np.pi * shares, _AZIMUTHS) / _AZIMUTHS
    wi = spherical(np.radians(_INCIDENCES), 0.0)
    return np.stack([weights @ brdf.body(np.broadcast_to(one, wo.shape), wo) for one in wi])


def beside_coat(readings: AngleReadings, coat: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n L"]:
    """Subtract the coat's reflection from the readings; a fraction is left for the body."""
    return np.maximum(readings.lifted - coat[:, None], _LEAST_BODY * readings.lifted)


def _gram(pair: CoatedPair, noise: float) -> Float[np.ndarray, "n n"]:
    at = coordinates(pair.tilt, pair.incidence)
    return covariance(at, at) + noise * np.eye(len(at))
