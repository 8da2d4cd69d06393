"""Work of an import on one material: the same function in this process, in another one, and on a cluster."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ...runtime.errors import MetamerError
from ..core.brdf import Brdf
from ..core.fast import Fast
from ..core.protocol import measured
from ..core.surface import Surface
from ..factored.pack import FactoredBrdf
from ..records.models import SPECTRA, rebuild
from ..records.source import MaterialSource
from .progress import Doing, Hears, in_bytes, share_done

if TYPE_CHECKING:
    from ..fitting.fit import Trial


@dataclass(frozen=True)
class FitResult:
    """Result of a fit: a fast form with its error, and the trials; or the `reason` why there is none.

    seconds : duration, for messages only; it is stored in no file: equal materials are equal bytes.
    """

    fast: Fast | None
    seconds: float
    reason: str = ""
    trials: tuple[Trial, ...] = ()


def fit_material(material: MaterialSource, budget: float, say: Hears = lambda doing: None) -> FitResult:
    """Fit one material; a spectrum without a surface has nothing to fit. What goes wrong is in `reason`.

    say : receives a description of the current work.
    """
    start = time.perf_counter()

    def done(fast: Fast | None = None, reason: str = "") -> FitResult:
        return FitResult(fast, time.perf_counter() - start, reason, tuple(trials))

    def tried(trial: Trial) -> None:
        trials.append(replace(trial, seconds=0.0))
        say(
            Doing(
                f"{trial.rank} {'term' if trial.rank == 1 else 'terms'} in {trial.frame}, p99 {trial.error.p99:.2f}",
                share_done(trials, budget),
            )
        )

    def doing(phase: str) -> None:
        say(Doing(phase, share_done(trials, budget, phase)))

    trials: list[Trial] = []
    if material.model in SPECTRA:
        return done()
    try:
        say(Doing("preparing"))
        read = material.heard(in_bytes("fitting", 0, say))
        original = rebuild(material.model, read.parameters)
        own = original.own_form(budget)
        if isinstance(own, Fast):
            return done(_with_slices(measured(own, original), original, budget))
        if not isinstance(original, Brdf):
            return done(reason=f"nothing fits a {material.model}: it has no fast form of its own")
        # An import that finds everything done does not wait for what fits.
        from ..fitting.fit import fit

        result = fit(original, budget=budget, tried=tried, doing=doing)
        doing("lobes for light from all around")
        return done(_with_slices(result.fast, original, budget))
    except MetamerError as reason:
        return done(reason=str(reason))
    except Exception as reason:
        # A defect of ours ends one material, not the import of a thousand.
        return done(reason=f"the fit broke down: {type(reason).__name__}: {reason}")


def _with_slices(fast: Fast, original: Surface, budget: float) -> Fast:
    """Attach the environment form of the original, for forms that store one."""
    return fast.with_slices_of(original, budget) if isinstance(fast, FactoredBrdf) else fast
