"""The page of a match: what a supplier signs, then every figure behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

import numpy as np

from ...spectral.adaptation import adaptation_matrix
from ...spectral.difference import xyz_from_lab
from ...spectral.illuminants import booth_words, illuminant
from ...spectral.measurement import crossed, remarks
from ...spectral.metamerism import Conditions
from ...spectral.observers import observer
from ...spectral.sample import Sample
from ..report.page import html_environment
from ..report.plots import pair_plot
from .batch import Batch
from .pairs import WORST_FIRST, MatchedPairs, MatchOptions, PairDifference
from .tolerance import Verdict

#: What a person may fill in beforehand; what is left open is a line to write on.
SIGNED = ("project", "part", "supplier", "instrument", "approved by", "date")
# Of these, what stands at the head of the sheet; the others at its foot.
_HEAD = 4
#: Conditions that have a column each; samples whose numbers stand in the drawings.
MOST_COLUMNS, MOST_NUMBERS = 3, 24
#: Samples that a summary names; letters of a name in a drawing, and samples whose names stand there.
MOST_NAMED, MOST_LETTERS, MOST_LABELS = 6, 14, 8
#: What is said where nothing is known of the instrument.
UNKNOWN = (
    "No repeatability of the instrument is known: figures stand without uncertainty, and no verdict allows for it."
)
#: Verdicts: how pages colour them, and a sign that needs no colour.
SIGNS = {"pass": ("pass", "✓"), "not resolved": ("near", "?"), "fail": ("over", "✕"), "not judged": ("", "·")}
# How drawings mark a sample: a dot, a ring, a cross.
_DOT = "M-2.6 0A2.6 2.6 0 1 0 2.6 0A2.6 2.6 0 1 0-2.6 0Z"
_MARKS = {"not resolved": ("open", _DOT), "fail": ("open", "M-3-3L3 3M3-3L-3 3")}
# Sizes of the spectra of a pair and of a batch in its order, SVG units, and nm that spectra are drawn at.
_PAIR_SIZE, _RUN_SIZE = (280.0, 74.0), (440.0, 90.0)
_DRAWN_NM = np.arange(400.0, 701.0, 10.0)
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
    samples: Sequence[MatchedPairs]
    asked: MatchOptions
    batches: Sequence[Batch | None] = ()
    signed: Mapping[str, str] = field(default_factory=dict)
    version: str = ""

    @property
    def verdict(self) -> Verdict:
        """Verdict of the sample that decides for all."""
        return next(iter(self.counts))

    @property
    def counts(self) -> dict[Verdict, int]:
        """Counts of samples by verdict, the worst first."""
        found = [one.verdict for one in self.samples]
        return {verdict: found.count(verdict) for verdict in WORST_FIRST if verdict in found}

    @property
    def summary(self) -> str:
        """One line: how many samples fail, pass or are not resolved, and the first of these under which conditions.

        Such as "1 of 3 fails: lot 3 under A, TL84".
        """
        total, verdict = len(self.samples), self.verdict
        deciding = [one for one in self.samples if one.verdict == verdict]
        count = len(deciding)
        words = {
            "fail": "fails" if count == 1 else "fail",
            "not resolved": "is not resolved" if count == 1 else "are not resolved",
            "pass": "passes" if count == 1 else "pass",
            "not judged": f"{'is' if count == 1 else 'are'} not judged: {self._why_not_judged}",
        }[verdict]
        line = f"{count} of {total} {words}"
        if verdict == "not judged":
            return line
        if open_ := self.counts.get("not judged"):
            line += f", {open_} {'is' if open_ == 1 else 'are'} not judged, as {self._why_not_judged}"
        if verdict == "pass":
            return line
        named = [f"{one.sample.name} under {self.under(one, verdict)}" for one in deciding[:MOST_NAMED]]
        more = f"; and {count - MOST_NAMED} more" if count > MOST_NAMED else ""
        return f"{line}: {'; '.join(named)}{more}"

    @property
    def _why_not_judged(self) -> str:
        return "no tolerance" if self.asked.tolerance is None else "a colour that was not measured judges none"

    def under(self, one: MatchedPairs, verdict: Verdict) -> str:
        """The conditions under which a sample has a verdict, without what all conditions share."""
        return self.short(tuple(found.conditions for found in one.differences if found.verdict == verdict))

    def short(self, conditions: Sequence[Conditions]) -> str:
        """Conditions in words, without the observer where all have the same one; "every light" where they are all."""
        every = self.asked.conditions
        if len(conditions) == len(every) > 1:
            return "all conditions"
        one_eye = len({where.observer for where in every}) == 1
        one_light = len({where.illuminant for where in every}) == 1
        parts = []
        for where in conditions:
            named = [where.geometry]
            named += [] if one_light and where.geometry else [where.illuminant]
            named += [] if one_eye else [where.observer]
            parts.append(" ".join(part for part in named if part))
        return ", ".join(parts)

    def html(self) -> str:
        """The page, self-contained."""
        return render_match_page(self)

    @property
    def crossed(self) -> tuple[str, ...]:
        """Readings that were compared although they were not measured alike, a sentence each."""
        return tuple(
            dict.fromkeys(words for one in self.samples for words in crossed(self.standard.side, one.sample.side))
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on how figures were calculated."""
        formulas = "; ".join(one.words for one in self.asked.formulas)
        known = self.asked.repeatability
        lamps = dict.fromkeys(booth_words(where.illuminant) for where in self.asked.conditions)
        lights = "; ".join(words for words in lamps if words)
        lights = f" ({lights})" if lights else ""
        found = [
            f"Sample minus standard, in CIELAB relative to each illuminant's white{lights}; no chromatic adaptation.",
            f"ΔE by {formulas}; the standard is the reference of those that are not symmetric.",
            UNKNOWN if known is None else f"Uncertainties: k = 2, {known.words}.",
        ]
        if self.asked.tolerance is not None:
            found.append(f"Tolerance: {self.asked.tolerance.words}, under every light and for every observer here.")
        sides = (self.standard, *(one.sample for one in self.samples))
        held = dict.fromkeys(f"{side.name}: {side.held}" for side in sides if side.held)
        told = dict.fromkeys(words for one in self.samples for words in remarks(self.standard.side, one.sample.side))
        said = dict.fromkeys(words for side in sides for words in side.notes)
        early = dict.fromkeys(words for one in self.samples if (words := _earlier(self.standard, one.sample)))
        return (*self.crossed, *found, *(f"{words}." for words in held), *told, *early, *said, *self.asked.notes)


def _earlier(standard: Sample, sample: Sample) -> str:
    """A sentence on a sample that was measured before its standard; "" where both dates do not say so."""
    first, second = (side.details.get("measured", "") for side in (standard, sample))
    try:
        dates = [datetime.fromisoformat(text).replace(tzinfo=None) for text in (first, second)]
    except ValueError:
        return ""
    if dates[1] >= dates[0]:
        return ""
    return (
        f"{sample.name} of {sample.source} was measured before its standard, at {second} and {first}: check which of "
        "the two is the standard."
    )


def render_match_page(report: MatchReport) -> str:
    """One self-contained HTML page."""
    conditions = report.asked.conditions
    worst_first = sorted(report.samples, key=lambda one: (WORST_FIRST.index(one.verdict), -_largest(one.worst)))
    shown = _shown(report, worst_first)
    numbers = {id(one["matched"]): one["number"] for one in shown}
    signed = report.signed
    return (
        html_environment(signed=_signed, triple=_triple, capitalize_first=_capital, id=id)
        .get_template("match.html")
        .render(
            report=report,
            shown=shown,
            counts=report.counts,
            signs=SIGNS,
            fields=[(name, signed.get(name, "")) for name in SIGNED[:_HEAD]],
            signatures=[
                ("For the supplier", "", ""),
                ("Approved by", signed.get("approved by", ""), signed.get("date", "")),
            ],
            plots=[_plots(report, at, numbers) for at in _deciding_first(report)],
            half=_HALF,
            columns=conditions if len(conditions) <= MOST_COLUMNS else (),
            indices=any(one["index"] for one in shown),
            whites=_white_columns(report),
            on_sheet=on_sheet(len(conditions), bool(report.asked.whites)),
            pair=_PAIR_SIZE,
            run=_run([one.differences[0] for one in report.samples]),
        )
    )


def on_sheet(conditions: int, whites: bool = False) -> int:
    """Count the samples that the sheet to sign has room for beside drawings, batch and signatures, when printed.

    whites : whether whiteness or yellowness stand beside them, which takes two lines a sample.
    """
    return max((20 - 2 * conditions) // (2 if whites else 1), 4)


def _shown(report: MatchReport, worst_first: Sequence[MatchedPairs]) -> list[dict[str, Any]]:
    """Of each sample what the page shows beside its figures; its number is its place among the worst."""
    order = {id(one): at for at, one in enumerate(report.samples)}
    one_eye = len({one.observer for one in report.asked.conditions}) == 1
    found = []
    for number, one in enumerate(worst_first, 1):
        told = [index for index in one.indices if index.name.endswith("multiplicative") and index.value is not None]
        index = max(told, key=lambda index: index.value or 0.0, default=None)
        at = report.asked.conditions[0].geometry
        curves = [side.factor(_DRAWN_NM) for side in (report.standard.at(at), one.sample.at(at)) if side.readings]
        found.append(
            {
                "matched": one,
                "number": number,
                "order": order[id(one)],
                # The larger, the worse.
                "rank": len(worst_first) - number,
                "anchor": f"s{order[id(one)] + 1}",
                "swatches": _swatches(one.differences[0]),
                "plot": pair_plot(_DRAWN_NM, curves[0], curves[1], _PAIR_SIZE) if len(curves) == 2 else None,
                "index": index,
                # Where there is one observer it goes without saying.
                "changed": "" if index is None else index.changed.split(", ")[0] if one_eye else index.changed,
            }
        )
    return found


def _white_columns(report: MatchReport) -> list[dict[str, Any]]:
    """A column of the sheet for each scale that was asked for, under the first conditions that it is told for: its
    name, what the standard has, and what each sample has, by their identity.
    """
    found = []
    for first in {white.name: white for white in reversed(report.samples[0].whites)}.values():
        of_samples = {
            id(one): white
            for one in report.samples
            for white in one.whites
            if (white.name, white.conditions) == (first.name, first.conditions)
        }
        told = next((white for white in of_samples.values() if white.standard is not None), first)
        found.append({"name": first.name, "conditions": first.conditions, "standard": told, "of": of_samples})
    return found[::-1]


def _run(found: Sequence[PairDifference]) -> dict[str, Any] | None:
    """ΔL*, Δa* and Δb* of a batch in the order given, as lines; None of fewer than three."""
    if len(found) < 3:
        return None
    offs = np.array([[float(one.off.lightness), float(one.off.a), float(one.off.b)] for one in found])
    reach = max(float(np.abs(offs).max()), 1e-3)
    width, height = _RUN_SIZE
    x = np.linspace(0.0, width, len(found))
    y = 0.5 * height * (1.0 - offs / reach)
    # Names at the ends of lines, no two on top of each other.
    places = y[-1].copy()
    for one, other in zip(np.argsort(y[-1])[:-1], np.argsort(y[-1])[1:], strict=True):
        places[other] = max(places[other], places[one] + 10.0)
    lines = [
        {
            "name": name,
            "style": style,
            "path": "M" + "L".join(f"{one:.1f} {other:.1f}" for one, other in zip(x, y[:, axis], strict=True)),
            "label_at": float(places[axis]) + 3.5,
        }
        for axis, (name, style) in enumerate((("ΔL*", "solid"), ("Δa*", "dashed"), ("Δb*", "dotted")))
    ]
    ticks = [(0.0, f"{reach:.2g}"), (0.5 * height, "0"), (height, f"\N{MINUS SIGN}{reach:.2g}")]
    return {"width": width, "height": height, "zero": 0.5 * height, "lines": lines, "ticks": ticks}


def _largest(found: PairDifference) -> float:
    return next(iter(found.delta_e.values()))


def _signed(value: float) -> str:
    """A difference to two decimals, with its sign.

    >>> _signed(-0.001), _signed(1.234)
    ('0.00', '+1.23')
    """
    words = f"{value:+.2f}"
    return "0.00" if words in ("+0.00", "-0.00") else words.replace("-", "\N{MINUS SIGN}")


def _triple(lab: np.ndarray) -> str:
    """Three numbers with a real minus."""
    return " ".join(f"{value:.2f}" for value in lab.tolist()).replace("-", "\N{MINUS SIGN}")


def _capital(words: str) -> str:
    """The first letter alone in upper case: names of standards stay as they are."""
    return words[:1].upper() + words[1:]


def _swatches(found: PairDifference) -> tuple[str, str]:
    """Standard and sample as sRGB shows them, adapted from the light's white to D65."""
    return tuple(_srgb(lab, found.white) for lab in (found.standard_lab, found.sample_lab))  # type: ignore[return-value]


def _srgb(lab: np.ndarray, white: np.ndarray) -> str:
    from ...spectral.colour_library import colour_science

    daylight = observer("1931_2").white(illuminant("D65"))
    seen = adaptation_matrix(white, daylight) @ xyz_from_lab(lab, white)
    codes = np.clip(colour_science().XYZ_to_sRGB(seen), 0.0, 1.0) * 255.0
    return "#{:02x}{:02x}{:02x}".format(*np.rint(codes).astype(int).tolist())


def _plots(report: MatchReport, at: int, numbers: Mapping[int, int]) -> dict[str, Any]:
    """Differences under one light: Δa* and Δb*, ΔC* and ΔL*, with the tolerance about the standard; `numbers` : of
    samples, by their identity.
    """
    found = [one.differences[at] for one in report.samples]
    lab, white, tolerance = found[0].standard_lab, found[0].white, report.asked.tolerance
    chroma = float(np.hypot(lab[1], lab[2]))
    along = np.array([0.0, 1.0, 0.0]) if chroma == 0.0 else np.array([0.0, lab[1], lab[2]]) / chroma
    lightness, a, b = np.eye(3)
    planes = (
        ("Δa*", "Δb*", a, b, [(float(one.off.a), float(one.off.b)) for one in found]),
        ("ΔC*", "ΔL*", along, lightness, [(float(one.off.chroma), float(one.off.lightness)) for one in found]),
    )
    drawn, geometry = [], found[0].conditions.geometry
    for across, up, x, y, points in planes:
        outline = np.zeros((0, 2)) if tolerance is None else tolerance.at(geometry).outline(lab, white, x, y)
        drawn.append(_drawing(across, up, np.reshape(points, (-1, 2)), outline))
    return {
        "conditions": found[0].conditions,
        "planes": drawn,
        "marks": [
            {
                "name": one.sample.name,
                "verdict": one.differences[at].verdict,
                "number": _label(one, numbers[id(one)], len(report.samples)),
                "style": style,
                "path": path,
            }
            for one in report.samples
            for style, path in (_MARKS.get(one.differences[at].verdict, ("", _DOT)),)
        ],
    }


def _deciding_first(report: MatchReport) -> list[int]:
    """Places of conditions: first those under which the worst sample is farthest off, then the others in order."""
    places = range(len(report.asked.conditions))
    worst = max(report.samples, key=lambda one: (-WORST_FIRST.index(one.verdict), _largest(one.worst)))
    first = next(at for at in places if worst.differences[at] is worst.worst)
    return [first, *(at for at in places if at != first)] if worst.verdict == "fail" else list(places)


def _label(one: MatchedPairs, number: int, count: int) -> str:
    """Label of a dot: the sample's name where few share a drawing, else its number, or nothing."""
    if count > MOST_NUMBERS:
        return ""
    name = one.sample.name
    if count > MOST_LABELS:
        return str(number)
    return name if len(name) <= MOST_LETTERS else f"{name[: MOST_LETTERS - 1]}…"


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
