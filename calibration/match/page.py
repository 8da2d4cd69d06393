"""Page of a match: a sheet for the supplier's signature, then every figure behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from itertools import pairwise, takewhile
from typing import Any

import numpy as np

from ...runtime.notebook import data_frame
from ...spectral.adaptation import adaptation_matrix
from ...spectral.difference import xyz_from_lab
from ...spectral.illuminants import booth_words, illuminant
from ...spectral.measurement import crossed, remarks
from ...spectral.metamerism import Conditions
from ...spectral.observers import observer
from ...spectral.sample import Sample
from ...spectral.srgb import linear_to_srgb
from ..report.page import html_environment
from ..report.plots import pair_plot
from ..report.review_data import LIGHT_ICONS
from ..report.review_facts import light_title, light_words, within_sentence
from ..report.row_name import short_observer
from .batch import Batch
from .pairs import WORST_FIRST, MatchedPairs, MatchOptions, PairDifference
from .table import as_html, headings, lines, plot
from .tolerance import VERDICT_WORDS, Verdict

#: Fields that a person may fill in beforehand; the others are lines to write on.
SIGNED = ("project", "part", "supplier", "instrument", "approved by", "date")
# Number of these at the head of the sheet; the others are at its foot.
_HEAD = 4
#: Conditions that have a column each; samples whose numbers stand in the drawings.
MOST_COLUMNS, MOST_NUMBERS = 3, 24
#: Samples of a verdict that a summary names; letters of a name in a drawing, and samples whose names stand there.
MOST_NAMED, MOST_LETTERS, MOST_LABELS = 6, 14, 8
# Conditions that a sentence names.
_MOST_PLACES = 4
#: Sentence for an instrument of unknown repeatability.
UNKNOWN = (
    "No repeatability of the instrument is known: figures stand without uncertainty, and no verdict allows for it."
)
# Icon and tint of the cells of each verdict; no hue stands beside a colour.
_LOOKS: dict[Verdict, tuple[str, str]] = {
    "pass": ("i-ok", "k0"),
    "not resolved": ("i-near", "k2"),
    "fail": ("i-warn", "k4"),
    "not judged": ("", "k0"),
}
# Marks of samples in drawings: a dot, a ring, a cross.
_DOT = "M-4 0A4 4 0 1 0 4 0A4 4 0 1 0-4 0Z"
_MARKS = {"not resolved": ("open", _DOT), "fail": ("open", "M-4-4L4 4M4-4L-4 4")}
# Sizes of the spectra of a pair, of a difference of spectra and of a batch in its order, SVG units, and nm that spectra
# are drawn at.
_PAIR_SIZE, _DIFFERENCE_SIZE, _RUN_SIZE = (280.0, 74.0), (460.0, 150.0), (440.0, 90.0)
_DRAWN_NM = np.arange(400.0, 701.0, 10.0)
# Ends of the parts of the spectrum in nm, and the colour of light of each.
_BANDS = ((490.0, "blue"), (570.0, "green"), (590.0, "yellow"), (620.0, "orange"), (np.inf, "red"))
# Share of the largest difference of two spectra that is spoken of, and that counts as a change of sign.
_SPOKEN, _CROSSING = 0.5, 0.3
# Half the width of a drawing, SVG units; samples are drawn within so much of it.
_HALF, _WITHIN = 130.0, 0.86
# Letters of a drawing are about so wide and high, SVG units.
_LETTER, _LINE = 6.4, 12.0
# Rounded steps of an axis, about four of them on each side.
_STEPS = (1.0, 2.0, 5.0, 10.0)
# Directions at the ends of each drawing's axes: across, and up.
_AB_ENDS, _LC_ENDS = ("greener", "redder", "bluer", "yellower"), ("greyer", "stronger", "darker", "lighter")


@dataclass(frozen=True, eq=False, repr=False)
class MatchReport:
    """Content of the page, the table and the JSON.

    batches : by conditions, in their order; none for a single sample. title : of the page. signed : by `SIGNED`.
    """

    standard: Sample
    samples: Sequence[MatchedPairs]
    asked: MatchOptions
    batches: Sequence[Batch | None] = ()
    signed: Mapping[str, str] = field(default_factory=dict)
    version: str = ""

    def to_pandas(self) -> Any:
        """Make a `pandas.DataFrame`, a line a sample and condition, as of `table`; raises where pandas is missing."""
        return data_frame(headings(self), lines(self))

    def plot(self, axes: Any = None) -> Any:
        """Draw samples around their standard, as `table.plot` does."""
        return plot(self, axes)

    def _repr_html_(self) -> str:
        return as_html(self, self.summary, self.facts)

    def __repr__(self) -> str:
        return f"<MatchReport of {len(self.samples)} beside {self.standard.name}: {self.summary}>"

    @property
    def verdict(self) -> Verdict:
        """Verdict of the deciding sample."""
        return next(iter(self.counts))

    @property
    def counts(self) -> dict[Verdict, int]:
        """Counts of samples by verdict, the worst first."""
        found = [one.verdict for one in self.samples]
        return {verdict: found.count(verdict) for verdict in WORST_FIRST if verdict in found}

    @property
    def worst_first(self) -> list[MatchedPairs]:
        """Samples in order of reading: failures first, with the largest differences first."""
        return sorted(self.samples, key=lambda one: (WORST_FIRST.index(one.verdict), -_largest(one.worst)))

    @property
    def summary(self) -> str:
        """State which samples fail, under which lights, and which pass, for page, print and terminal.

        Such as "lot 3 fails under tungsten lamp A (redder) but passes under daylight D65; 2 of 3 pass under every
        light".
        """
        if len(self.counts) == 1 and self.verdict == "not judged":
            count = len(self.samples)
            who = self.samples[0].sample.name if count == 1 else f"all {count}"
            return f"{who} {'is' if count == 1 else 'are'} not judged: {self._why_not_judged}"
        parts = [
            *self._named("fail", "fails", "fail"),
            *self._named("not resolved", "is too close to call", "are too close to call"),
        ]
        total, passing = len(self.samples), self.counts.get("pass", 0)
        if passing:
            who = f"{passing} of {total}" if passing < total else f"all {total}"
            if total == 1:
                who = self.samples[0].sample.name
            parts.append(f"{who} {'passes' if passing == 1 else 'pass'} under {self.places(self.asked.conditions)}")
        if unjudged := self.counts.get("not judged"):
            parts.append(f"{unjudged} {'is' if unjudged == 1 else 'are'} not judged: {self._why_not_judged}")
        return "; ".join(parts)

    @property
    def facts(self) -> str:
        """State the tolerance, the lights and the observer of the verdict, below it on the page."""
        asked = self.asked
        lights = _listed(list(dict.fromkeys(light_words(where.illuminant) for where in asked.conditions)))
        eyes = _listed(list(dict.fromkeys(short_observer(observer(where.observer).name) for where in asked.conditions)))
        judged = f"ΔE {asked.judging.name}"
        if asked.tolerance is not None:
            judged = f"Tolerance: {judged}, limit {asked.tolerance.limit:g}"
        several = " Each sample is judged by its worst light." if len(asked.conditions) > 1 and asked.tolerance else ""
        return f"{judged}, under {lights}, {eyes} observer.{several}"

    def _named(self, verdict: Verdict, one_does: str, several_do: str) -> list[str]:
        """List the samples of a verdict, grouped by its conditions."""
        deciding = [one for one in self.worst_first if one.verdict == verdict]
        groups: dict[str, list[MatchedPairs]] = {}
        for one in deciding[:MOST_NAMED]:
            where = tuple(found.conditions for found in one.differences if found.verdict == verdict)
            groups.setdefault(self.places(where), []).append(one)
        parts, shared = [], _shared_start([one.sample.name for one in self.samples])
        for where, some in groups.items():
            # The beginning that all names share is said once.
            first, *others = (one.sample.name for one in some)
            names = _listed([first, *(name[shared:] for name in others)])
            words = f"{names} {one_does if len(some) == 1 else several_do} under {where}"
            if len(some) == 1:
                (one,) = some
                words = f"{names} {one_does} under {self._towards(one, verdict)}"
                passed = tuple(found.conditions for found in one.differences if found.verdict == "pass")
                words += f" but passes under {self.places(passed)}" if passed else ""
            parts.append(words)
        if len(deciding) > MOST_NAMED:
            parts.append(f"{len(deciding) - MOST_NAMED} more {several_do}")
        return parts

    def _towards(self, one: MatchedPairs, verdict: Verdict) -> str:
        """List the conditions of a verdict with the direction under each: "tungsten lamp A (redder)"."""
        told = [each for each in one.directions if each.verdict == verdict]
        every = tuple(where for each in told for where in each.conditions)
        if len(told) > 1 and (len(every) == len(self.asked.conditions) or len(every) > _MOST_PLACES):
            most = within_sentence(self.place(one.worst.conditions))
            return f"{self.places(every)}, most under {most} ({one.worst.words})"
        return _listed([f"{self.places(each.conditions)} ({each.words})" for each in told])

    @property
    def _why_not_judged(self) -> str:
        return (
            "no tolerance was given" if self.asked.tolerance is None else "a colour that was not measured judges none"
        )

    def place(self, where: Conditions) -> str:
        """Describe conditions, without the observer if it is common to all: "Tungsten lamp A"."""
        every = self.asked.conditions
        one_eye = len({each.observer for each in every}) == 1
        one_light = len({each.illuminant for each in every}) == 1
        parts = [where.geometry]
        parts += [] if one_light and where.geometry else [light_words(where.illuminant)]
        parts += [] if one_eye else [short_observer(observer(where.observer).name)]
        return ", ".join(part for part in parts if part)

    def places(self, conditions: Sequence[Conditions]) -> str:
        """Describe conditions within a sentence; "every light" for all of them."""
        every = self.asked.conditions
        if len(conditions) == len(every) > 1:
            alike = len({(each.observer, each.geometry) for each in every}) == 1
            return "every light" if alike else "all conditions"
        if len(conditions) > _MOST_PLACES:
            return f"{len(conditions)} of {len(every)} conditions"
        return _listed([within_sentence(self.place(where)) for where in conditions])

    def html(self) -> str:
        """Return the page, self-contained."""
        return render_match_page(self)

    @property
    def crossed(self) -> tuple[str, ...]:
        """Sentences on differently measured readings that were compared nevertheless."""
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
    """State that a sample was measured before its standard; "" unless both dates show it."""
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
    """Render one self-contained HTML page."""
    shown = _shown(report)
    numbers = {id(one["matched"]): one["number"] for one in shown}
    signed = report.signed
    return (
        html_environment(signed=_signed, triple=_triple, capitalize_first=_capital, id=id)
        .get_template("match.html")
        .render(
            report=report,
            shown=shown,
            looks=_LOOKS,
            words=VERDICT_WORDS,
            fields=[(name, signed.get(name, "")) for name in SIGNED[:_HEAD]],
            signatures=[
                ("For the supplier", "", ""),
                ("Approved by", signed.get("approved by", ""), signed.get("date", "")),
            ],
            plots=[_plots(report, at, numbers) for at in _deciding_first(report)],
            half=_HALF,
            # Paper leaves out a long beginning that all names share.
            shared=_shared_start([one.sample.name for one in report.samples]),
            most_shared=MOST_LETTERS,
            columns=[(light_title(where.illuminant)[1], report.place(where)) for where in report.asked.conditions]
            if len(report.asked.conditions) <= MOST_COLUMNS
            else (),
            icons=LIGHT_ICONS,
            why=_why(report, shown[0]) if report.verdict == "fail" else None,
            difference=_DIFFERENCE_SIZE,
            indices=any(one["index"] for one in shown),
            whites=_white_columns(report),
            on_sheet=on_sheet(len(report.asked.conditions), bool(report.asked.whites)),
            pair=_PAIR_SIZE,
            run=_run([one.differences[0] for one in report.samples]),
        )
    )


def on_sheet(conditions: int, whites: bool = False) -> int:
    """Count the samples that fit on the printed sheet for signature, beside drawings, batch and signatures.

    whites : True if it shows whiteness or yellowness, which takes two lines per sample.
    """
    return max((20 - 2 * conditions) // (2 if whites else 1), 4)


def _shown(report: MatchReport) -> list[dict[str, Any]]:
    """Collect the content of the page for each sample beside its figures, numbered from the worst."""
    order = {id(one): at for at, one in enumerate(report.samples)}
    one_eye = len({one.observer for one in report.asked.conditions}) == 1
    worst_first, found = report.worst_first, []
    for number, one in enumerate(worst_first, 1):
        told = [index for index in one.indices if index.name.endswith("multiplicative") and index.value is not None]
        index = max(told, key=lambda index: index.value or 0.0, default=None)
        at = report.asked.conditions[0].geometry
        curves = [side.factor(_DRAWN_NM) for side in (report.standard.at(at), one.sample.at(at)) if side.readings]
        pairs = one.differences if len(one.differences) <= MOST_COLUMNS else (one.differences[0], one.worst)
        found.append(
            {
                "matched": one,
                "number": number,
                "order": order[id(one)],
                # The larger, the worse.
                "rank": len(worst_first) - number,
                "anchor": f"s{order[id(one)] + 1}",
                "cells": [(each, _swatches(each)) for each in pairs],
                "plot": pair_plot(_DRAWN_NM, curves[0], curves[1], _PAIR_SIZE) if len(curves) == 2 else None,
                "index": index,
                # A single observer needs no mention.
                "changed": "" if index is None else index.changed.split(", ")[0] if one_eye else index.changed,
            }
        )
    return found


def _why(report: MatchReport, shown: Mapping[str, Any]) -> dict[str, Any]:
    """Show the worst failing sample: both colours under the lights, and where the spectra deviate."""
    one: MatchedPairs = shown["matched"]
    worst = one.worst
    others = [each for each in one.differences if each is not worst]
    pairs = [(each, _swatches(each)) for each in (worst, *others)[:MOST_COLUMNS]]
    found: dict[str, Any] = {"name": one.sample.name, "pairs": pairs, "sentences": [], "plot": None}
    sides = [side.at(worst.conditions.geometry) for side in (report.standard, one.sample)]
    if not all(side.readings for side in sides):
        return found
    off = sides[1].factor(_DRAWN_NM) - sides[0].factor(_DRAWN_NM)
    largest = float(np.abs(off).max())
    if largest == 0.0:
        return found
    verb = "lets through" if sides[1].readings[0].quantity == "transmittance" else "reflects"
    found["sentences"] = [f"{one.sample.name} {verb} {_listed(_bands(off))} than the standard."]
    crosses = min(off.max(), -off.min()) >= _CROSSING * largest
    passed = tuple(each.conditions for each in one.differences if each.verdict == "pass")
    if passed and crosses:
        found["sentences"].append(
            f"Under {report.places(passed)} more and less cancel out, under "
            f"{within_sentence(report.place(worst.conditions))} they do not: another mixture of colorants, which a "
            "change of strength alone does not mend."
        )
    width, height = _DIFFERENCE_SIZE
    lamp = illuminant(worst.conditions.illuminant)
    power = np.interp(_DRAWN_NM, lamp.wavelengths_nm, lamp.samples, left=0.0, right=0.0)
    x = (_DRAWN_NM - _DRAWN_NM[0]) / (_DRAWN_NM[-1] - _DRAWN_NM[0]) * width
    lit = "".join(
        f"L{at:.1f} {height * (1.0 - 0.4 * value):.1f}" for at, value in zip(x, power / power.max(), strict=True)
    )
    curve = "L".join(f"{at:.1f} {0.5 * height * (1.0 - value / largest):.1f}" for at, value in zip(x, off, strict=True))
    found["plot"] = {
        "curve": f"M{curve}",
        "light": f"M0 {height:.1f}{lit}L{width:.1f} {height:.1f}Z",
        "lamp": report.place(worst.conditions),
        "top": f"{100.0 * largest:.2g} %",
        "ticks": [((nm - 400.0) / 300.0 * width, f"{nm:g}") for nm in (400.0, 500.0, 600.0, 700.0)],
    }
    return found


def _bands(off: np.ndarray) -> list[str]:
    """Describe the two largest wavelength ranges over which one spectrum is clearly above or below another."""
    clear = np.where(np.abs(off) >= _SPOKEN * np.abs(off).max(), np.sign(off), 0.0)
    edges = np.flatnonzero(np.diff(clear, prepend=0.0, append=0.0))
    runs = [(first, last - 1) for first, last in pairwise(edges.tolist()) if clear[first]]
    runs.sort(key=lambda run: -float(np.abs(off[run[0] : run[1] + 1]).sum()))
    found = []
    for first, last in runs[:2]:
        low, high = _DRAWN_NM[first], _DRAWN_NM[last]
        hue = next(word for end, word in _BANDS if 0.5 * (low + high) < end)
        reach = f"from {low:g} to {high:g} nm" if high > low else f"at {low:g} nm"
        found.append(f"{'more' if clear[first] > 0 else 'less'} {reach} ({hue})")
    return found


def _white_columns(report: MatchReport) -> list[dict[str, Any]]:
    """Return a column of the sheet for each requested scale, under the first conditions that it is defined for.

    Its name, the value of the standard, and the values of the samples by their identity.
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
    """Plot ΔL*, Δa* and Δb* of a batch in the given order, as lines; None for fewer than three."""
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
    """Return a difference to two decimals, with its sign.

    >>> _signed(-0.001), _signed(1.234)
    ('0.00', '+1.23')
    """
    words = f"{value:+.2f}"
    return "0.00" if words in ("+0.00", "-0.00") else words.replace("-", "\N{MINUS SIGN}")


def _triple(lab: np.ndarray) -> str:
    """Format three numbers with a true minus sign."""
    return " ".join(f"{value:.2f}" for value in lab.tolist()).replace("-", "\N{MINUS SIGN}")


def _capital(words: str) -> str:
    """Capitalise the first letter only: names of standards stay as they are."""
    return words[:1].upper() + words[1:]


# Linear sRGB from XYZ, Y of white 1, as IEC 61966-2-1 rounds it.
_SRGB_FROM_XYZ = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])


def _swatches(found: PairDifference) -> tuple[str, str]:
    """Convert standard and sample to sRGB, adapted from the light's white to D65."""
    return tuple(_srgb(lab, found.white) for lab in (found.standard_lab, found.sample_lab))  # type: ignore[return-value]


def _srgb(lab: np.ndarray, white: np.ndarray) -> str:
    daylight = observer("1931_2").white(illuminant("D65"))
    seen = adaptation_matrix(white, daylight) @ xyz_from_lab(lab, white)
    linear = np.clip(_SRGB_FROM_XYZ @ seen, 0.0, 1.0)
    return "#{:02x}{:02x}{:02x}".format(*np.rint(linear_to_srgb(linear) * 255.0).astype(int).tolist())


def _plots(report: MatchReport, at: int, numbers: Mapping[int, int]) -> dict[str, Any]:
    """Plot differences under one light, Δa* and Δb*, ΔC* and ΔL*, with the tolerance about the standard.

    numbers : of samples, by their identity.
    """
    found = [one.differences[at] for one in report.samples]
    lab, white, tolerance = found[0].standard_lab, found[0].white, report.asked.tolerance
    chroma = float(np.hypot(lab[1], lab[2]))
    along = np.array([0.0, 1.0, 0.0]) if chroma == 0.0 else np.array([0.0, lab[1], lab[2]]) / chroma
    lightness, a, b = np.eye(3)
    planes = (
        ("a*, b*", _AB_ENDS, a, b, [(float(one.off.a), float(one.off.b)) for one in found]),
        ("C*, L*", _LC_ENDS, along, lightness, [(float(one.off.chroma), float(one.off.lightness)) for one in found]),
    )
    shared = _shared_start([one.sample.name for one in report.samples])
    labels = [_label(one.sample.name, shared, numbers[id(one)], len(report.samples)) for one in report.samples]
    drawn, geometry = [], found[0].conditions.geometry
    for axes, ends, x, y, points in planes:
        outline = np.zeros((0, 2)) if tolerance is None else tolerance.at(geometry).outline(lab, white, x, y)
        drawn.append({"axes": axes, "ends": ends} | _drawing(np.reshape(points, (-1, 2)), outline, labels))
    return {
        "place": report.place(found[0].conditions),
        "planes": drawn,
        "marks": [
            {"name": one.sample.name, "verdict": VERDICT_WORDS[each.verdict], "style": style, "path": path}
            for one, each in zip(report.samples, found, strict=True)
            for style, path in (_MARKS.get(each.verdict, ("", _DOT)),)
        ],
    }


def _deciding_first(report: MatchReport) -> list[int]:
    """Return indices of conditions: first those of the worst sample's largest difference, then the others in order."""
    places = range(len(report.asked.conditions))
    worst = max(report.samples, key=lambda one: (-WORST_FIRST.index(one.verdict), _largest(one.worst)))
    first = next(at for at in places if worst.differences[at] is worst.worst)
    return [first, *(at for at in places if at != first)] if worst.verdict == "fail" else list(places)


def _shared_start(names: Sequence[str]) -> int:
    """Count the letters of the leading words common to all names: 4 for "Lot 1" and "Lot 2"."""
    words = [name.split(" ") for name in names]
    shared = takewhile(lambda some: len(set(some)) == 1, zip(*(each[:-1] for each in words), strict=False))
    return sum(len(some[0]) + 1 for some in shared) if len(names) > 1 else 0


def _label(name: str, shared: int, number: int, count: int) -> str:
    """Label a dot: the sample's name if few share a drawing, else its number in the table, or nothing.

    Long names omit the common beginning, unless only a number would remain: it would be read as the table's.
    """
    if count > MOST_NUMBERS:
        return ""
    if count > MOST_LABELS:
        return str(number)
    if len(name) <= MOST_LETTERS:
        return name
    if name[shared:].strip().isdigit():
        return f"…{name[1 - MOST_LETTERS :]}"
    told = name[shared:]
    return told if len(told) <= MOST_LETTERS else f"{told[: MOST_LETTERS - 1]}…"


def _drawing(points: np.ndarray, outline: np.ndarray, labels: Sequence[str]) -> dict[str, Any]:
    reach = float(np.abs(np.concatenate([points, outline])).max(initial=0.0)) or 1.0
    scale = _WITHIN * _HALF / reach
    decade = 10.0 ** np.floor(np.log10(reach / 4.0))
    step = next(one * decade for one in _STEPS if one * decade >= reach / 4.0)
    placed = points * [scale, -scale]
    return {
        "step": f"{step:g}",
        "bar": step * scale,
        "points": [
            (x, y, text, *at)
            for (x, y), text, at in zip(placed.tolist(), labels, _labelled(placed, labels), strict=True)
        ],
        "outline": " ".join(f"{x:.2f},{y:.2f}" for x, y in (outline * [scale, -scale]).tolist()),
    }


def _labelled(points: np.ndarray, labels: Sequence[str]) -> list[tuple[float, float, str]]:
    """Place each label beside its dot, avoiding dots and labels if possible: offset, anchor."""
    dots = [(x - 5.0, y - 5.0, x + 5.0, y + 5.0) for x, y in points.tolist()]
    taken: list[tuple[float, float, float, float]] = []
    found = []
    for number, ((x, y), text) in enumerate(zip(points.tolist(), labels, strict=True)):
        wide = _LETTER * len(text)
        sides = (
            (8.0, 4.0, "start", x + 8.0, y - 6.0),
            (-8.0, 4.0, "end", x - 8.0 - wide, y - 6.0),
            (0.0, -8.0, "middle", x - 0.5 * wide, y - 8.0 - _LINE),
            (0.0, 17.0, "middle", x - 0.5 * wide, y + 6.0),
        )
        others = [*taken, *(dot for index, dot in enumerate(dots) if index != number)]
        boxes = [(left, top, left + wide, top + _LINE) for *_, left, top in sides]
        free = (at for at, box in enumerate(boxes) if not any(_overlap(box, other) for other in others))
        chosen = next(free, 0)
        if text:
            taken.append(boxes[chosen])
        found.append(sides[chosen][:3])
    return found


def _overlap(one: tuple[float, float, float, float], other: tuple[float, float, float, float]) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def _listed(words: Sequence[str]) -> str:
    """Join names for a sentence: "a, b and c"."""
    return " and ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)
