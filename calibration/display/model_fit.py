"""Models fitted to readings, the simplest first."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from .curves import NEARLY_STRAIGHT, Curve, GainOffsetGamma, MeasuredCurve
from .model import FLOOR, DisplayModel, Residual, features, light_of, roots
from .readings import Readings

# Weights of cube roots as CIELAB has them: L*, a*, b* of the roots of X, Y, Z.
_LAB = np.array([[0.0, 116.0, 0.0], [500.0, -500.0, 0.0], [0.0, 200.0, -200.0]])
# Weight of the prior beside the readings: it keeps gains and gammas without readings near those of displays.
_PRIOR = 0.02
# Codes of a ramp that a measured curve needs at least, its ends among them.
_FEWEST_ON_A_RAMP = 5
# Points that a measured curve is kept as.
_FINE = 65
# Smoothing that is tried, relative to a plain sum of squares.
_SMOOTHING = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
#: Patches that have two channels or three at once, away from grey, before pairwise minima may be fitted.
FEWEST_MIXED = 12
#: Patches below which nothing is fitted.
FEWEST_PATCHES = 9


def fit(name: str, readings: Readings) -> DisplayModel:
    """Fit one model of `MODELS` to averaged readings.

    Raises
    ------
    InputError : too few patches, or not those that the model needs.
    """
    if len(readings) < FEWEST_PATCHES:
        raise InputError(
            "too few patches for a model of a display",
            file=readings.source or None,
            field="patches",
            found=f"{len(readings)} different ones",
            expected=f"{FEWEST_PATCHES} at least; 51 to 125 are usual",
            hint="`metamer display patches -n 125 --for characterise` writes such a set",
        )
    if not readings.blacks.size:
        raise InputError(
            "no reading of black",
            file=readings.source or None,
            field="codes",
            found=f"smallest codes {np.array2string(readings.codes.min(axis=0), precision=3)}",
            expected="at least one reading of code 0, 0, 0",
            hint="measure black as well: what the display leaks is part of every colour",
        )
    return MODELS[name].fitted(readings)


def why_not(name: str, readings: Readings) -> str | None:
    """Return why a model cannot be fitted to these readings; None if it can."""
    return MODELS[name].lacks(readings)


def _gog(readings: Readings, count: int, name: str) -> DisplayModel:
    return replace(_gains(readings, count), name=name)


@lru_cache(maxsize=4)  # several models of the same readings begin with it
def _gains(readings: Readings, count: int) -> DisplayModel:
    """Fit gains, gammas and the mixture jointly, by least squares of visible differences."""
    from scipy.optimize import least_squares

    codes, xyz, white = readings.codes, readings.xyz, readings.white_xyz
    seen, weights = roots(xyz, white), _seen_weights(xyz, white)
    usual_curve = GainOffsetGamma(1.0, 2.2)
    start = (usual_curve, usual_curve, usual_curve)
    begun = _mixture(start, readings, count, 1.0) / white
    usual = np.concatenate([np.ones(3), np.full(3, 2.2), np.ones(1)])

    def curves(parameters: np.ndarray) -> tuple[Curve, Curve, Curve]:
        red, green, blue = (GainOffsetGamma(float(parameters[at]), float(parameters[3 + at])) for at in range(3))
        return red, green, blue

    def off(parameters: np.ndarray) -> np.ndarray:
        made = features(light_of(curves(parameters), codes), count, parameters[6]) @ parameters[7:].reshape(count, 3)
        seen_off = np.einsum("nij,nj->ni", weights, np.cbrt(made + FLOOR) - seen)
        return np.concatenate([seen_off.ravel(), _PRIOR * (parameters[:7] - usual)])

    low = np.concatenate([np.full(3, 0.7), np.full(3, 1.0), [0.5], np.full(3 * count, -np.inf)])
    high = np.concatenate([np.full(3, 1.3), np.full(3, 4.0), [2.0], np.full(3 * count, np.inf)])
    found = least_squares(off, np.concatenate([usual, begun.ravel()]), bounds=(low, high), x_scale="jac", max_nfev=60).x
    mixture = found[7:].reshape(count, 3) * white
    return DisplayModel("gog", curves(found), mixture, white, power=float(found[6]))


def _seen_weights(xyz: np.ndarray, white: np.ndarray) -> Float[np.ndarray, "N 3 3"]:
    """Return matrices from differences of cube roots to ΔL*, Δa* and Δb*, the latter two over 1 + 0.045 C*."""
    lab = roots(xyz, white) @ _LAB.T
    scale = 1.0 / (1.0 + 0.045 * np.hypot(lab[:, 1], lab[:, 2]))
    return _LAB * np.stack([np.ones_like(scale), scale, scale], axis=1)[:, :, None]


def _mixture(
    curves: tuple[Curve, Curve, Curve], readings: Readings, count: int, power: float
) -> Float[np.ndarray, "F 3"]:
    """Fit the mixture by least squares, each reading weighted by the visibility of its errors."""
    codes, xyz, white = readings.codes, readings.xyz, readings.white_xyz
    made = features(light_of(curves, codes), count, power)
    slope = np.sqrt(readings.repeats)[..., None] / (3.0 * roots(xyz, white) ** 2)
    columns = [np.linalg.lstsq(made * s[:, None], x * s, rcond=None)[0] for x, s in zip(xyz.T, slope.T, strict=True)]
    return np.stack(columns, axis=1)


def _ramps(readings: Readings) -> list[np.ndarray]:
    """Return the readings of each channel alone, by index."""
    off = readings.codes <= 0.0
    return [np.flatnonzero(off[:, (at + 1) % 3] & off[:, (at + 2) % 3]) for at in range(3)]


def _measured_curves(readings: Readings) -> tuple[Curve, Curve, Curve]:
    """Fit curves through the ramps: residuals of gains, offsets and gammas are interpolated, not steep curves."""
    codes, xyz = readings.codes, readings.xyz
    black = xyz[readings.blacks].mean(axis=0)
    usual = _gains(readings, 4).curves
    curves = []
    for at, ramp in enumerate(_ramps(readings)):
        full = xyz[ramp[np.argmax(codes[ramp, at])]] - black
        light = (xyz[ramp] - black) @ full / (full @ full)
        curves.append(_through(codes[ramp, at], light, usual[at]))
    red, green, blue = curves
    return red, green, blue


def _through(codes: np.ndarray, light: np.ndarray, usual: Curve) -> MeasuredCurve:
    from scipy.interpolate import PchipInterpolator

    order = np.argsort(codes)
    codes, light = codes[order], np.maximum(light[order], 0.0) ** NEARLY_STRAIGHT
    off = light - usual.at(codes) ** NEARLY_STRAIGHT
    off[0] = off[-1] = 0.0
    fine = np.linspace(0.0, 1.0, _FINE) ** 1.5
    drawn = np.maximum(usual.at(fine) ** NEARLY_STRAIGHT + PchipInterpolator(codes, off)(fine), 0.0)
    drawn[0], drawn[-1] = 0.0, 1.0
    return MeasuredCurve(fine, np.minimum(np.maximum.accumulate(drawn), 1.0) ** (1.0 / NEARLY_STRAIGHT))


def _matrix(readings: Readings, name: str, count: int) -> DisplayModel:
    """Fit measured curves, then the mixture by least squares over all patches, and the best power."""
    from scipy.optimize import minimize_scalar

    curves, codes, xyz, white = _measured_curves(readings), readings.codes, readings.xyz, readings.white_xyz

    def made(power: float) -> DisplayModel:
        return DisplayModel(name, curves, _mixture(curves, readings, count, power), white, power=power)

    def left(power: float) -> float:
        return float(np.sum((roots(made(power).mixed(codes), white) - roots(xyz, white)) ** 2))

    if count == 4:
        return made(1.0)
    return made(float(minimize_scalar(left, bounds=(0.5, 2.0), method="bounded").x))


def _bent(readings: Readings, name: str, count: int) -> DisplayModel:
    """Fit measured curves if there are ramps, else gains and gammas; a mixture; and a spline of its residuals."""
    base = _gog(readings, count, name) if _lacks_ramps(readings) else _matrix(readings, name, count)
    return _with_residual(base, readings)


def _with_residual(model: DisplayModel, readings: Readings) -> DisplayModel:
    """Add a spline of a model's residuals, as smooth as cross-validation favours."""
    left = roots(readings.xyz, readings.white_xyz) - roots(model.mixed(readings.codes), readings.white_xyz)
    weights, parts = _seen_weights(readings.xyz, readings.white_xyz), folds(readings, 5)
    # The mean of many readings, as white's is, has less noise to be smoothed.
    noise = np.broadcast_to(1.0 / np.asarray(readings.repeats), len(left))
    best, least = _SMOOTHING[0], np.inf
    for smoothing in _SMOOTHING:
        total = 0.0
        for held in parts:
            kept = np.setdiff1d(np.arange(len(left)), held)
            spline = Residual.through(readings.codes[kept], left[kept], smoothing * noise[kept])
            off = np.einsum("nij,nj->ni", weights[held], spline.at(readings.codes[held]) - left[held])
            total += float(np.sum(np.sqrt(np.sum(off**2, axis=1))))
        if total < least:
            best, least = smoothing, total
    return replace(model, residual=Residual.through(readings.codes, left, best * noise))


def folds(readings: Readings, count: int) -> list[np.ndarray]:
    """Divide patches for cross-validation, spread over the cube; corners are in no part, to avoid extrapolation."""
    inner = np.flatnonzero(~np.isin(readings.codes, (0.0, 1.0)).all(axis=1))
    order = inner[np.lexsort(np.round(readings.codes[inner], 6).T)]
    return [part for at in range(count) if len(part := order[at::count])]


def mixed(readings: Readings) -> int:
    """Count the patches with two or three channels that are not grey."""
    return int(np.count_nonzero(((readings.codes > 0.0).sum(axis=1) > 1) & (np.ptp(readings.codes, axis=1) > 0.02)))


@dataclass(frozen=True)
class Kind:
    """Kind of model: its description, its fit, and its requirements."""

    words: str
    fitted: Callable[[Readings], DisplayModel]
    lacks: Callable[[Readings], str | None]


def _lacks_ramps(readings: Readings) -> str | None:
    fewest = min(len(ramp) for ramp in _ramps(readings))
    ends = all(readings.codes[ramp, at].max(initial=0.0) >= 1.0 for at, ramp in enumerate(_ramps(readings)))
    if fewest < _FEWEST_ON_A_RAMP or not ends:
        return f"a ramp of each channel alone from 0 to full code, {_FEWEST_ON_A_RAMP} patches at least, is not there"
    return None


def _lacks_mixed(readings: Readings) -> str | None:
    count = mixed(readings)
    return None if count >= FEWEST_MIXED else f"only {count} patches mix channels, {FEWEST_MIXED} are needed"


#: The models by name, simpler ones first: of equally good ones the first is taken.
MODELS: dict[str, Kind] = {
    "gog": Kind("gain, offset and gamma, then a matrix", lambda r: _gog(r, 4, "gog"), lambda r: None),
    "matrix-trc": Kind("measured tone curves, then a matrix", lambda r: _matrix(r, "matrix-trc", 4), _lacks_ramps),
    "residual": Kind(
        "tone curves, a matrix, and a smooth spline of what that leaves",
        lambda r: _bent(r, "residual", 4),
        _lacks_mixed,
    ),
    "minima": Kind(
        "tone curves, what pairs of channels give together, and a smooth spline of what that leaves",
        lambda r: _bent(r, "minima", 8),
        _lacks_mixed,
    ),
}
