"""Error of factor packs, their cost to fit and to draw, and the cost of alternatives of the field.

One row a surface and light: packs fitted to a budget, beside the distribution-based BRDF, which was the baseline of
Schwenk 2010, and (on request) beside tensorly's decomposition of the paper's whole table. Errors are on the sphere
protocol, against the BRDF at every wavelength. Fluorescent surfaces are not fitted; their rows are drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...materials.analytic.fluorescent import FluorescentLambert
from ...materials.core.brdf import Brdf
from ...materials.core.protocol import LIGHT_ANGLES_DEG, sphere_protocol
from ...materials.factored.pack import FactorPack
from ...materials.fitting.fit import Fit, Trial, fit
from ...viewer.gl.backend import create_session
from ...viewer.render.session import RenderSession
from .. import filtering
from ..papers.distribution_based import fit_distribution
from . import growth as decompositions
from . import methods
from .case import Case
from .cases import chosen_cases
from .figures import PICTURE_LIGHTS_DEG, case_figures, fluorescent_figures
from .fluorescence import draw, fluorescence_figures, fluorescent_rows
from .memory import WatchedBrdf, table_bytes, timed_and_weighed
from .points import POINT_CASES, FittedPoint, case_points
from .sphere import errors_by_light
from .timing import Stopwatch

LIGHTS = ("D65", "FL11")
#: The surface whose table is decomposed at several sizes and ranks.
GROWTH_CASE = "ashikhmin-shirley-32"
# Terms that one texture of four channels holds: what the paper counts in.
TERMS_A_PACK = 4
# Across a sphere that fluorescent rows are judged on.
_DRAWN_PIXELS = 192
Say = Callable[[str], None]


def run(
    cases: Sequence[str] | None = None,
    *,
    lights: Sequence[str] = LIGHTS,
    data: Path | None = None,
    pixels: int = 512,
    picture_pixels: int = 180,
    budget: float | None = None,
    ranks: tuple[int, ...] | None = None,
    baseline: bool = False,
    points: bool = True,
    growth: bool = False,
    renderer: RenderSession | None = None,
    progress: Say = lambda line: None,
) -> dict:
    """Fit, judge and time every case.

    Parameters
    ----------
    cases : names from `cases`; None takes all.
    data : folder of measured data; its cases join in.
    pixels : of the sphere protocol that errors are counted on.
    picture_pixels : across a sphere in the figures; 0 draws none.
    budget, ranks : in place of the case's own budget and the fit's own numbers of terms.
    baseline : also let tensorly decompose the paper's table, half a minute a case.
    points : also measure speed against error, one point a configuration, the paper's own methods among them, and how
        a decomposition grows with resolution and rank.
    growth : the last two on tables of the paper's size and beyond, in place of smaller ones.

    Returns
    -------
    dict : `rows`, `points`, `packs_needed`, `speed`, `growth`, `fluorescence`, `renderer`, `timing`, `protocol`,
    `dbrdf`, `tensorly` are ready for JSON; `figures` are pictures and curves for the page, by case.
    """
    chosen = chosen_cases(cases, data)
    owns = renderer is None
    renderer = create_session(keeps_terms=False)[0] if renderer is None else renderer
    found = _Found()
    surfaces = []
    try:
        effort = methods.FULL if growth else methods.QUICK
        asked = (lights, pixels, picture_pixels, budget, ranks, baseline, points, effort)
        work = _Work(renderer, Stopwatch(renderer), *asked)
        for number, case in enumerate(chosen, 1):
            brdf = case.make()

            def say(line: str, prefix: str = f"{number}/{len(chosen)} {case.name}: ") -> None:
                progress(prefix + line)

            if isinstance(brdf, FluorescentLambert):
                work.fluorescent(case, brdf, found, say, progress)
                surfaces.append(brdf.bispectral)
            else:
                work.fitted(case, brdf, found, say, progress)
        if points:
            found.points += _filtering_points(renderer, progress)
    finally:
        if owns:
            renderer.close()
    if surfaces:
        found.fluorescence |= fluorescence_figures(surfaces, progress)
    if points or growth:
        (case,) = chosen_cases([GROWTH_CASE])
        found.growth = decompositions.growth(case.name, case.make(), full=growth, progress=progress)
    return {
        "rows": found.rows,
        "points": found.points,
        "packs_needed": found.packs_needed,
        "speed": found.speed,
        "growth": found.growth,
        "fluorescence": found.fluorescence,
        "renderer": renderer.name,
        "timing": Stopwatch.WORDS,
        "protocol": found.protocol,
        "dbrdf": "Ashikhmin and Premoze 2007; every wavelength its own p(h) and R_0, least squares in L*",
        "tensorly": f"parafac, rank {decompositions.PAPER_RANK}, {decompositions.ITERATIONS} iterations, io table "
        f"{' x '.join(map(str, decompositions.PAPER_SHAPE))}",
        "figures": found.figures,
    }


def texture_packs(packs: tuple[FactorPack, ...]) -> int:
    """Packs of four terms, as the paper counts."""
    return sum(-(-pack.rank // TERMS_A_PACK) for pack in packs)


@dataclass(eq=False)
class _Found:
    """Measurements so far."""

    rows: list[dict] = field(default_factory=list)
    points: list[dict] = field(default_factory=list)
    packs_needed: list[dict] = field(default_factory=list)
    speed: list[dict] = field(default_factory=list)
    growth: list[dict] = field(default_factory=list)
    fluorescence: dict[str, Any] = field(default_factory=lambda: {"without": []})
    figures: list[dict] = field(default_factory=list)
    protocol: str = ""


@dataclass(frozen=True, eq=False)
class _Work:
    """Measurement of each case; see `run`."""

    renderer: RenderSession
    stopwatch: Stopwatch
    lights: Sequence[str]
    pixels: int
    picture_pixels: int
    budget: float | None
    ranks: tuple[int, ...] | None
    baseline: bool
    points: bool
    effort: methods.Effort

    def fitted(self, case: Case, brdf: Brdf, into: _Found, say: Say, progress: Say) -> None:
        """Rows of a surface that packs are fitted to."""
        say("fitting")
        fitted, seconds, single, peak = timed_and_weighed(
            brdf, lambda it: self._fit_with_progress(case, it, say, progress)
        )
        milliseconds, held = self.stopwatch.milliseconds(fitted.fast.packs), table_bytes(brdf, fitted)
        say(f"{_words(fitted)} in {seconds:.1f} s; comparing")
        protocol = sphere_protocol(self.pixels, brdf.isotropic)
        into.protocol = protocol.text
        distribution = fit_distribution(brdf)
        speed = None
        if self.baseline and brdf.isotropic:
            say(f"tensorly, {decompositions.ITERATIONS} iterations on the whole table")
            speed = decompositions.speed_row(case.name, brdf)
            into.speed.append(speed)
        reference, other = (protocol.references(it, self.lights) for it in (brdf, distribution))
        sample = protocol.samples(fitted.fast, self.lights)
        errors, others = (errors_by_light(protocol, self.lights, reference, it) for it in (sample, other))
        for light, error in errors.items():
            into.rows.append(
                {
                    "case": case.name,
                    "light": light,
                    "frames": [pack.frame for pack in fitted.fast.packs],
                    "packs": texture_packs(fitted.fast.packs),
                    "rank": fitted.rank,
                    "fit_seconds": seconds,
                    "table_bytes": held,
                    "peak_bytes": peak,
                    "relative_error": fitted.error.relative_error,
                    "delta_e94": error,
                    "ms_per_megapixel": milliseconds,
                    "baseline": {
                        "tensorly_seconds": None if speed is None else speed["tensorly_seconds"],
                        "tensorly_relative_error": None if speed is None else speed["tensorly_relative_error"],
                        "dbrdf_delta_e94": others[light],
                    },
                }
            )
            progress(f"    {light}: ΔE94 p99 {error['p99']:.2f}, D-BRDF {others[light]['p99']:.2f}")
        if self.picture_pixels:
            into.figures.append(
                case_figures(case, brdf, fitted.fast.packs, distribution, self.lights, self.picture_pixels)
            )
        if self.points and case.name in POINT_CASES:
            say("speed against error")
            choice = POINT_CASES[case.name]
            own = FittedPoint(fitted, seconds, single.fast.packs)
            into.points += case_points(case.name, brdf, own, self.stopwatch, self.lights, progress, choice)
            tried = methods.method_points(case.name, brdf, self.stopwatch, self.lights, progress, self.effort)
            into.points += tried
            into.packs_needed += [
                {
                    "case": case.name,
                    "light": row["light"],
                    "p99": row["delta_e94"]["p99"],
                    "ours": row["packs"],
                    "paper_2010": case.packs_2010,
                    "needed": methods.packs_needed(tried, row["light"], row["delta_e94"]["p99"]),
                }
                for row in into.rows
                if row["case"] == case.name
            ]

    def fluorescent(self, case: Case, brdf: FluorescentLambert, into: _Found, say: Say, progress: Say) -> None:
        """Rows of a fluorescent surface, drawn against the full matrix."""
        say("drawing")
        drawn = draw(self.renderer, brdf, min(self.pixels, _DRAWN_PIXELS), LIGHT_ANGLES_DEG)
        rows, without = fluorescent_rows(case, brdf, drawn, self.stopwatch)
        into.rows += rows
        into.fluorescence["without"] += without
        for row, plain in zip(rows, without, strict=True):
            others = ", ".join(f"{name} {found['p99']:.2f}" for name, found in list(plain["delta_e94"].items())[1:])
            progress(f"    {row['light']}: ΔE94 p99 {row['delta_e94']['p99']:.2f}; without fluorescence: {others}")
        if self.picture_pixels:
            shown = draw(self.renderer, brdf, self.picture_pixels, PICTURE_LIGHTS_DEG)
            into.figures.append(fluorescent_figures(case, brdf, shown, self.picture_pixels))

    def _fit_with_progress(self, case: Case, brdf: Brdf, say: Say, progress: Say) -> Fit:
        """Return a fit that reports each trial; the second time, why it is run again: packs are left unrounded."""
        if isinstance(brdf, WatchedBrdf):
            say("fitting once more, to count bytes")
            return self._fit(case, brdf, precision="single")
        return self._fit(case, brdf, tried=lambda trial: progress(_trial_words(trial)))

    def _fit(self, case: Case, brdf: Brdf, **options: Any) -> Fit:
        if self.ranks is not None:
            options["ranks"] = self.ranks
        return fit(brdf, budget=case.budget if self.budget is None else self.budget, **options)


def _filtering_points(renderer: RenderSession, progress: Say) -> list[dict]:
    """Measure what filtering factors is worth, shaped as the other points; seconds to fit are none of its matter."""
    progress("filtering: speed against error")
    return [
        {
            **point,
            "case": f"filtering, {point['case']}",
            "rank": filtering.RANK,
            "fit_seconds": None,
            "delta_e94": {"D65": point["delta_e94"]},
        }
        for point in filtering.filtering_points(renderer, progress)
    ]


def _trial_words(trial: Trial) -> str:
    return f"    {trial.rank} {trial.frame} terms after {trial.seconds:.0f} s: ΔE94 p99 {trial.error.p99:.2f}"


def _words(found: Fit) -> str:
    frames = " + ".join(f"{pack.rank} {pack.frame}" for pack in found.fast.packs)
    return f"{frames} terms"
