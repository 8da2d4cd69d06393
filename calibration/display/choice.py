"""Choice of the best model of a display by cross-validation, and its reason in a sentence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError, UnknownNameError
from ...spectral.difference import delta_e_xyz
from .additivity import Additivity, additivity
from .model import DisplayModel
from .model_fit import MODELS, fit, folds, why_not
from .readings import Readings

# Parts that patches are held back in, one after the other.
_PARTS = 6


@dataclass(frozen=True, eq=False)
class ModelChoice:
    """Chosen model, and the reason.

    Parameters
    ----------
    model : fitted to all readings.
    held_back : by name, mean ΔE94 of held-out patches; no accuracy, since the models were fitted to fewer patches.
    left_out : by name, why a model could not be fitted.
    additivity : of the channels, as far as the readings show it.
    reason : as a sentence.
    left : (N,) ΔE94 of the readings themselves.
    """

    model: DisplayModel
    held_back: Mapping[str, float]
    left_out: Mapping[str, str]
    additivity: Additivity
    reason: str
    left: Float[np.ndarray, " N"]


def choose(readings: Readings, name: str = "auto") -> ModelChoice:
    """Choose the requested model, or the simplest within one standard error of the best.

    The error is ΔE94 relative to the display's own white, the reading as the reference, by six-fold cross-validation
    (Hastie, Tibshirani and Friedman 2009, 7.10). The standard error is that of the difference from the best, patch by
    patch, which cancels the difficulty common to all models.

    Raises
    ------
    InputError : too few patches; the requested model cannot be fitted, or is a matrix for a display whose channels do
        not add up.
    """
    if name not in ("auto", *MODELS):
        raise UnknownNameError("model of a display", name, ("auto", *MODELS), field="--model")
    averaged = readings.averaged()
    sums = additivity(averaged)
    left_out = {one: reason for one in MODELS if (reason := why_not(one, averaged)) is not None}
    if name != "auto":
        return _asked(name, averaged, sums, left_out)
    parts = folds(averaged, _PARTS)
    if len(parts) < _PARTS or min(len(part) for part in parts) < 2:
        only = next(one for one in MODELS if one not in left_out)
        model = fit(only, averaged)
        _refuse_sums(model, sums, averaged)
        reason = f"{only}: with {len(averaged)} patches nothing can be held back to choose by"
        return ModelChoice(model, {}, left_out, sums, reason, _off(model, averaged))
    apart = _held_back([one for one in MODELS if one not in left_out], averaged, parts)
    means = {one: float(values.mean()) for one, values in apart.items()}
    best = min(means, key=lambda one: means[one])
    spread = {one: float((each - apart[best]).std(ddof=1) / np.sqrt(len(each))) for one, each in apart.items()}
    # A display whose channels do not add up is never left to a matrix, whatever a few patches say.
    able = [one for one in apart if not (sums.refuses and one in _MATRICES)] or [best]
    taken = next((one for one in able if means[one] <= means[best] + spread[one]), best)
    model = fit(taken, averaged)
    _refuse_sums(model, sums, averaged)
    return ModelChoice(model, means, left_out, sums, _reason(taken, best, means, spread[taken]), _off(model, averaged))


_MATRICES = ("gog", "matrix-trc")


def _asked(name: str, readings: Readings, sums: Additivity, left_out: Mapping[str, str]) -> ModelChoice:
    if name in left_out:
        others = ", ".join(one for one in MODELS if one not in left_out)
        raise InputError(
            "the readings are not enough for this model",
            file=readings.source or None,
            field="--model",
            found=f"{name}: {left_out[name]}",
            expected=f"one of {others}, or auto" if others else "more patches",
            hint="measure the set that `metamer display patches -n 125` writes",
        )
    model = fit(name, readings)
    _refuse_sums(model, sums, readings)
    return ModelChoice(model, {}, left_out, sums, f"{name}: asked for", _off(model, readings))


def _refuse_sums(model: DisplayModel, sums: Additivity, readings: Readings) -> None:
    if model.is_additive and sums.refuses:
        raise InputError(
            "a matrix cannot follow this display: its channels do not add up",
            file=readings.source or None,
            field="--model",
            found=f"{model.name}; {sums.words}",
            expected="a model that is no matrix: residual or minima",
            hint="--model auto, with a set of patches that mixes channels",
        )


def _held_back(names: list[str], readings: Readings, parts: list[np.ndarray]) -> dict[str, np.ndarray]:
    """Compute ΔE94 of every held-out patch, by model."""
    found: dict[str, list[np.ndarray]] = {name: [] for name in names}
    for held in parts:
        known = readings.taken(np.setdiff1d(np.arange(len(readings)), held))
        unseen = readings.taken(held)
        for name in names:
            found[name].append(_off(fit(name, known), unseen, readings.white_xyz))
    return {name: np.concatenate(values) for name, values in found.items()}


def _off(model: DisplayModel, readings: Readings, white: np.ndarray | None = None) -> np.ndarray:
    white = readings.white_xyz if white is None else white
    return delta_e_xyz(readings.xyz, model.xyz(readings.codes), white)


def _reason(taken: str, best: str, means: Mapping[str, float], spread: float) -> str:
    others = ", ".join(f"{one} {value:.2f}" for one, value in means.items() if one != taken)
    said = f"{taken} ({MODELS[taken].words}): ΔE94 {means[taken]:.2f} on patches held back"
    if taken == best:
        return f"{said}, the least{f'; {others}' if others else ''}"
    return f"{said}, the simplest within one standard error ({spread:.2f}) of the least; {others}"
