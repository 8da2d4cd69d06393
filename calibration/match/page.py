"""The page of a match: what a supplier signs, then every figure behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...spectral.adaptation import adaptation_matrix
from ...spectral.difference import xyz_from_lab
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.sample import Sample
from ..page import html_environment
from .batch import Batch
from .pairs import WORST_FIRST, Asked, Difference, Matched
from .tolerance import Verdict

#: What a person may fill in beforehand; what is left open is a line to write on.
SIGNED = ("project", "part", "supplier", "instrument", "approved by", "date")
#: What is said where nothing is known of the instrument.
UNKNOWN = (
    "No repeatability of the instrument is known: figures stand without uncertainty, and no verdict allows for it."
)
#: Verdicts: how pages colour them, and a sign that needs no colour.
SIGNS = {"pass": ("pass", "✓"), "not resolved": ("near", "?"), "fail": ("over", "✕"), "not judged": ("", "·")}
# Half the width of a drawing, SVG units; samples are drawn within so much of it.
_HALF, _WITHIN = 130.0, 0.86
# Rounded steps of an axis, about four of them on each side.
_STEPS = (1.0, 2.0, 5.0, 10.0)


@dataclass(frozen=True, eq=False)
class MatchReport:
    """All that the page, the table and the JSON say.

    batches : by conditions, in their order; none of a single sample. title : of the page. signed : by `SIGNED`.
    """

    standard: Sample
    samples: Sequence[Matched]
    asked: Asked
    batches: Sequence[Batch | None] = ()
    signed: Mapping[str, str] = field(default_factory=dict)
    version: str = ""

    @property
    def verdict(self) -> Verdict:
        """That of the sample which decides for all."""
        found = {one.verdict for one in self.samples}
        return next(verdict for verdict in WORST_FIRST if verdict in found)

    def html(self) -> str:
        """The page, self-contained."""
        return render_match_page(self)

    @property
    def notes(self) -> tuple[str, ...]:
        """How figures came about, a sentence each."""
        formulas = "; ".join(one.words for one in self.asked.formulas)
        known = self.asked.repeatability
        found = [
            "Sample less standard, in CIELAB relative to the white of each illuminant; no chromatic adaptation.",
            f"ΔE by {formulas}; the standard is the reference of those that are not symmetric.",
            UNKNOWN if known is None else f"Uncertainties: k = 2, {known.words}.",
        ]
        if self.asked.tolerance is not None:
            found.append(f"Tolerance: {self.asked.tolerance.words}, under every light and for every observer here.")
        sides = (self.standard, *(one.sample for one in self.samples))
        held = dict.fromkeys(f"{side.name}: {side.held}" for side in sides if side.held)
        return (*found, *(f"{words}." for words in held))


def render_match_page(report: MatchReport) -> str:
    """One self-contained HTML page."""
    shown = sorted(report.samples, key=lambda one: (WORST_FIRST.index(one.verdict), -_largest(one.worst)))
    counts = {verdict: sum(one.verdict == verdict for one in shown) for verdict in WORST_FIRST}
    return (
        html_environment(signed=_signed)
        .get_template("match.html")
        .render(
            report=report,
            shown=shown,
            counts={verdict: count for verdict, count in counts.items() if count},
            signs=SIGNS,
            fields=[(name, report.signed.get(name, "")) for name in SIGNED],
            plots=[_plots(report, at) for at in range(len(report.asked.conditions))],
            half=_HALF,
            swatches=[_swatches(one.differences[0]) for one in shown],
        )
    )


def _largest(found: Difference) -> float:
    return next(iter(found.delta_e.values()))


def _signed(value: float) -> str:
    """A difference to two decimals, with its sign.

    >>> _signed(-0.001), _signed(1.234)
    ('0.00', '+1.23')
    """
    words = f"{value:+.2f}"
    return "0.00" if words in ("+0.00", "-0.00") else words.replace("-", "\N{MINUS SIGN}")


def _swatches(found: Difference) -> tuple[str, str]:
    """Standard and sample as sRGB shows them, adapted from the light's white to D65."""
    return tuple(_srgb(lab, found.white) for lab in (found.standard_lab, found.sample_lab))  # type: ignore[return-value]


def _srgb(lab: np.ndarray, white: np.ndarray) -> str:
    from ...spectral.colour_library import colour_science

    daylight = observer("1931_2").white(illuminant("D65"))
    seen = adaptation_matrix(white, daylight) @ xyz_from_lab(lab, white)
    codes = np.clip(colour_science().XYZ_to_sRGB(seen), 0.0, 1.0) * 255.0
    return "#{:02x}{:02x}{:02x}".format(*np.rint(codes).astype(int).tolist())


def _plots(report: MatchReport, at: int) -> dict[str, Any]:
    """Differences under one light: Δa* and Δb*, ΔC* and ΔL*, with the tolerance about the standard."""
    found = [one.differences[at] for one in report.samples]
    lab, white, tolerance = found[0].standard_lab, found[0].white, report.asked.tolerance
    chroma = float(np.hypot(lab[1], lab[2]))
    along = np.array([0.0, 1.0, 0.0]) if chroma == 0.0 else np.array([0.0, lab[1], lab[2]]) / chroma
    lightness, a, b = np.eye(3)
    planes = (
        ("Δa*", "Δb*", a, b, [(float(one.off.a), float(one.off.b)) for one in found]),
        ("ΔC*", "ΔL*", along, lightness, [(float(one.off.chroma), float(one.off.lightness)) for one in found]),
    )
    drawn = []
    for across, up, x, y, points in planes:
        outline = np.zeros((0, 2)) if tolerance is None else tolerance.outline(lab, white, x, y)
        drawn.append(_drawing(across, up, np.reshape(points, (-1, 2)), outline))
    return {
        "conditions": found[0].conditions,
        "planes": drawn,
        "names": [one.sample.name for one in report.samples],
    }


def _drawing(across: str, up: str, points: np.ndarray, outline: np.ndarray) -> dict[str, Any]:
    reach = float(np.abs(np.concatenate([points, outline])).max(initial=0.0)) or 1.0
    scale = _WITHIN * _HALF / reach
    decade = 10.0 ** np.floor(np.log10(reach / 4.0))
    step = next(one * decade for one in _STEPS if one * decade >= reach / 4.0)
    count = int(_HALF / scale / step)
    return {
        "across": across,
        "up": up,
        "ticks": [(number * step * scale, f"{number * step:g}") for number in range(-count, count + 1) if number],
        "points": (points * [scale, -scale]).tolist(),
        "outline": " ".join(f"{x:.2f},{y:.2f}" for x, y in (outline * [scale, -scale]).tolist()),
    }
