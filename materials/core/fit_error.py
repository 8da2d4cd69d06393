"""Measured error of a fast form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

# Figures of each light, in the order of `LightError`.
_FIGURES = ("mean", "p95", "p99", "maximum")
#: Budget of an import, ΔE94, 99th percentile: half of what a review accepts, since a picture adds errors of its own.
DEFAULT_BUDGET = 0.5
# Multiple of the budget from which a maximum is reported with its place.
_FAR = 10.0


@dataclass(frozen=True)
class LightError:
    """ΔE94 over the samples of a protocol under one light; `highlight`: p99 of the highlight's own pixels, if any."""

    light: str
    mean: float
    p95: float
    p99: float
    maximum: float
    highlight: float | None = None


@dataclass(frozen=True)
class FitError:
    """Measured error of a fast form against its original.

    mean, p95, p99, maximum : ΔE94 over the samples of `protocol`, under `light`, the worst of those judged, for
    `observer`; reference = the original at every wavelength. relative_error : norm of the tables' residuals over that
    of the tables, weighted by visibility. most_negative : lowest f_r cos(theta_i) pi of the packs at any wavelength,
    all over the hemispheres (0 if none is negative; a white diffuser facing the light is 1). largest : their largest,
    over the original's largest anywhere at the same wavelength; None if it was not searched for. Nothing is clipped.
    lights : the figures of every light judged, the worst included; empty if there was one. where : directions of light
    and view at the maximum, in words; None if they were not recorded. budget, score : ΔE94 that a fit aimed at, and the
    figure compared with it (`fitting.fit.Fit.score`); None without a fit. more_terms, more_score : the terms of one
    more step, and its estimated score; None if no terms were added.
    """

    mean: float
    p95: float
    p99: float
    maximum: float
    light: str
    observer: str
    protocol: str
    relative_error: float
    most_negative: float = 0.0
    largest: float | None = None
    lights: tuple[LightError, ...] = ()
    budget: float | None = None
    score: float | None = None
    more_terms: int | None = None
    more_score: float | None = None
    where: str | None = None

    def stored(self) -> dict[str, Any]:
        """Return the error as a form stores it: text, numbers and arrays."""
        kept = {name: value for name, value in vars(self).items() if name != "lights" and value is not None}
        if self.lights:
            columns = {name: [getattr(one, name) for one in self.lights] for name in _FIGURES}
            kept |= {name + "_by_light": np.array(each, dtype=np.float64) for name, each in columns.items()}
            kept["lights"] = "\n".join(one.light for one in self.lights)
        return kept

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any]) -> FitError:
        """Return the error whose `stored()` this is."""
        names = str(kept.get("lights", "")).split()
        columns = [kept[name + "_by_light"].tolist() for name in _FIGURES] if names else []
        lights = tuple(LightError(name, *each) for name, *each in zip(names, *columns, strict=True))
        figures = {name: kept[name] for name in cls.__dataclass_fields__ if name != "lights" and name in kept}
        return cls(**figures, lights=lights)

    @property
    def highlight(self) -> float | None:
        """Worst p99 of the highlight's own pixels under any light; None if the surface has no highlight."""
        return max((one.highlight for one in self.lights if one.highlight is not None), default=None)


class Farthest(Protocol):
    """Largest error of a fit, and its budget (`FitError`)."""

    @property
    def maximum(self) -> float | None:
        """ΔE94."""
        ...

    @property
    def light(self) -> str | None:
        """Light of the maximum."""
        ...

    @property
    def where(self) -> str | None:
        """Directions, in words."""
        ...

    @property
    def budget(self) -> float | None:
        """ΔE94; None without a fit."""
        ...


def far_off(fit: Farthest) -> str:
    """Describe a maximum beyond ten times the fit's own budget, with its directions if known; else return "".

    >>> far_off(FitError(0.1, 0.2, 0.4, 56.0, "A", "1931_2", "sphere", 0.0, where="light at 80.0°, 0°"))
    'up to ΔE94 56.0 under A: light at 80.0°, 0°'
    """
    budget = DEFAULT_BUDGET if fit.budget is None else fit.budget
    if fit.maximum is None or fit.maximum <= _FAR * budget:
        return ""
    return f"up to ΔE94 {fit.maximum:.1f} under {fit.light}" + (f": {fit.where}" if fit.where else "")
