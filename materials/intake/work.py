"""The work of an import on one material: the same function in this process, in another one, and on a cluster."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ...spectral.errors import MetamerError
from ..factors import FactorPack, FitError
from ..records.models import SPECTRA, rebuild
from ..source import MaterialSource
from .doing import Doing, Hears, in_bytes, share_done

if TYPE_CHECKING:
    from ..fitting.fit import Trial


@dataclass(frozen=True)
class Fitted:
    """What comes back: packs, their error and what was tried; or, in `reason`, why there are none.

    seconds : how long it took. It is told to people, and stands in no file: equal materials are equal bytes.
    """

    packs: tuple[FactorPack, ...]
    error: FitError | None
    seconds: float
    reason: str = ""
    trials: tuple[Trial, ...] = ()


def fit_material(material: MaterialSource, budget: float, say: Hears = lambda doing: None) -> Fitted:
    """Fit one material; a spectrum without a surface has nothing to fit. What goes wrong is in `reason`.

    told : hears what the fit is at.
    """
    start = time.perf_counter()

    def done(packs: tuple[FactorPack, ...] = (), error: FitError | None = None, reason: str = "") -> Fitted:
        return Fitted(packs, error, time.perf_counter() - start, reason, tuple(trials))

    def tried(trial: Trial) -> None:
        trials.append(replace(trial, seconds=0.0))
        say(
            Doing(
                f"{trial.rank} {'term' if trial.rank == 1 else 'terms'} in {trial.frame}, p99 {trial.error.p99:.2f}",
                share_done(trials, budget),
            )
        )

    def doing(phase: str) -> None:
        say(Doing(phase, share_done(trials, budget)))

    trials: list[Trial] = []
    if material.model in SPECTRA:
        return done()
    try:
        say(Doing("preparing"))
        read = material.heard(in_bytes("fitting", 0, say))
        brdf = rebuild(material.model, read.parameters)
        measured_packs = getattr(brdf, "measured_packs", None)
        if measured_packs is not None:
            return done(*measured_packs())
        # An import that finds everything done does not wait for what fits.
        from ..fitting.fit import fit

        result = fit(brdf, budget=budget, tried=tried, doing=doing)
        return done(result.packs, result.error)
    except MetamerError as reason:
        return done(reason=str(reason))
    except Exception as reason:
        # A defect of ours ends one material, not the import of a thousand.
        return done(reason=f"the fit broke down: {type(reason).__name__}: {reason}")
