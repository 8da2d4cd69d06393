"""Page of a comparison: the verdict, the worst rows with their pictures, and a line for every row."""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...runtime.wording import counted
from ...spectral.difference import differences
from ..report import coded_map, plots
from ..report.direction import direction
from ..report.histogram import histogram_plot
from ..report.history import Run, earlier_figures, trend_plot
from ..report.page import breakable, html_environment, row_id, scale_bar, window_command
from ..report.review_facts import light_words
from ..report.row_name import short_observer
from ..report.shift_plot import ShiftArrow, shift_plots
from ..report.statistics import beside
from .causes import VERDICTS, Cause, cause_of, state_words, tier_of, told_apart, verdicts, what_changed
from .comparison import PICTURE_ALONE, REFERENCE_CHANGED
from .result import STATES, Figures, Result, RowResult
from .row import ComparedSide, LayerKind, Row, RowName
from .row_pictures import ShownRow, alone, shown
from .words import common_parts, titles_of, verdict_words

#: Most rows with pictures, the worst ones.
MOST_PICTURES = 500
_PAIR_SIZE = (168.0, 62.0)
# Bytes of text for a pair of pictures; a row may have two.
_BYTES_OF_TEXT = 4500.0
# Headings of the page's two verdicts.
_HEADINGS: dict[Cause, dict[str, str]] = {
    "material": {
        "pass": "No colour moved beyond its limits",
        "warn": "Colours moved: look at them",
        "fail": "Colours moved beyond their limits",
    },
    "approximation": {
        "pass": "The approximation's error is within limits",
        "warn": "The approximation's error is near its limits",
        "fail": "The approximation's error is over its limits",
    },
}
# Words in the place of a verdict where nothing moved, or nothing is there to move.
_SAID = {"identical": "did not move", "same": "did not move", "removed": "gone", "added": "new"}
# Ends of the scale of maps, as multiples of a power of ten: a third of each is a short number.
_ENDS = (1.2, 1.5, 2.4, 3.0, 4.5, 6.0, 9.0, 12.0)
_LEAST_END = 0.15


@dataclass(frozen=True)
class _Sides:
    """Rows before and after by their names, and settings of pictures; scale : ΔE94 at the end of the maps' scale."""

    before: Mapping[RowName, Row]
    after: Mapping[RowName, Row]
    scale: float
    side: int
    single: bool

    def pair(self, row: RowResult) -> tuple[Row | None, Row | None]:
        """Return the pair of a row; two single pictures match whatever the second's name."""
        after = next(iter(self.after.values()), None) if self.single else self.after.get(row.name)
        return self.before.get(row.name), after


def render_page(
    result: Result,
    before: ComparedSide,
    after: ComparedSide,
    version: str,
    history: Sequence[Run] = (),
    progress: Callable[[int, int, str], None] = lambda done, total, what: None,
) -> str:
    """Render one self-contained HTML page.

    history : earlier comparisons with the same baseline, this one the last.

    Raises
    ------
    InputError : a picture that is missing since it was compared.
    """
    worst_first = result.worst_first
    pictured = {row.name for row in worst_first[:MOST_PICTURES]}
    scale = _end_of_scale(result) / plots.SCALE_BUDGETS
    pairs = sum(max(1, sum(one.moved for one in row.layers.values())) for row in result.rows if row.name in pictured)
    names: list[dict[RowName, Row]] = [{row.name: row for row in one.rows} for one in (before, after)]
    single = len(result.rows) == 1 and len(result.rows[0].layers) > 0
    sides = _Sides(names[0], names[1], scale, plots.embedded_side(pairs, _BYTES_OF_TEXT), single)
    common, titles = common_parts(result.rows), titles_of(result.rows)
    views = {}
    for number, row in enumerate(worst_first):
        views[row.name] = _view(row, sides, row.name in pictured, history)
        views[row.name] |= _named(row.name, common, titles) | {"rank": len(worst_first) - number}
        progress(number + 1, len(worst_first), str(row.name))
    lights = list(dict.fromkeys(row.name.light for row in result.rows))
    environment = html_environment(uri=plots.data_uri, breakable=breakable, signed=_signed, light=light_words)
    return environment.get_template("regression.html").render(
        result=result,
        outcome=verdict_words(result),
        boxes=_boxes(result),
        verdicts=VERDICTS,
        states=list(dict.fromkeys(view["state"] for view in views.values())),
        told=_verdicts_there(views.values()),
        common=str(common) if any(common) else "",
        cards=_cards(result, views, common),
        # Cards say it in sentences of their own.
        told_of=(REFERENCE_CHANGED, PICTURE_ALONE),
        moved=sum(view["moved"] for view in views.values()),
        lights=lights,
        other_facts={key: one for key, one in result.after.facts.items() if result.before.facts.get(key) != one},
        scale=plots.scale_words(scale),
        scale_bar=scale_bar(scale, limit=False),
        step=100.0 * coded_map.STEP_SHARE,
        codes=coded_map.code_words(scale) | {"clear": base64.b64encode(coded_map.clear_chunk()).decode("ascii")},
        shifts=_shifts(views.values(), lights),
        trend=trend_plot(history, "ΔE94 p99"),
        pair=_PAIR_SIZE,
        most=MOST_PICTURES,
        version=version,
    )


def _to_look_at(row: RowResult) -> bool:
    return row.tier != "pass" or row.state not in ("identical", "same")


def _named(name: RowName, common: RowName, titles: Mapping[str, str]) -> dict[str, str]:
    """Name a row: its material, its light, and the other parts that differ between rows."""
    own = name.without(common)
    light = light_words(name.light)
    rest = [light, short_observer(own.observer), own.scene, own.view]
    heading, under = titles[name.material] or str(name), " · ".join(part for part in rest if part)
    return {"heading": heading, "under": under, "title": f"{heading} under {light}" if light else heading}


def _end_of_scale(result: Result) -> float:
    """Choose the end of the maps' scale, ΔE94: a round number, no smaller than the p99 of any changed layer."""
    found = [one.p99 for row in result.rows for one in row.layers.values() if one.moved and math.isfinite(one.p99)]
    largest = max(found, default=0.0)
    if largest <= _LEAST_END:
        return _LEAST_END
    decade = 10.0 ** math.floor(math.log10(largest))
    return next(one * decade for one in _ENDS if one * decade >= largest * (1.0 - 1e-9))


def _boxes(result: Result) -> list[dict[str, Any]]:
    """Return the two verdicts: on materials, and on the approximation if it can be separated."""
    found = []
    causes: list[Cause] = ["material", "approximation"] if told_apart(result) else ["material"]
    for cause in causes:
        tier = tier_of(result, cause)
        rows = [row for row in result.rows if cause_of(row) == cause]
        if cause == "material":
            counts = [(sum(row.state == state for row in rows), state) for state in STATES]
            words = ", ".join(f"{count} {state}" for count, state in counts if count and state != "worse")
            says = [f"{words}, of {len(result.rows)} rows." if words else "No row of it moved."]
            free = sum(row.unasked and row.state not in ("identical", "same") for row in result.rows)
            if free:
                says.append(f"{free} of those that moved are held against no criterion.")
            if len(causes) == 1:
                says.append("No side has references: what the approximation costs cannot be told apart here.")
        else:
            says = [_moved_words(rows), *_error_words(result)]
        found.append({"cause": cause, "tier": tier, "heading": _HEADINGS[cause][tier], "words": says})
    return found


def _moved_words(rows: Sequence[RowResult]) -> str:
    if not rows:
        return "In no row did the picture alone move."
    counts: dict[str, int] = {}
    for row in rows:
        counts[state_words(row)] = counts.get(state_words(row), 0) + 1
    told = ", ".join(f"{words} in {count}" for words, count in counts.items())
    return f"The picture alone moved in {counted(len(rows), 'row')}: {told}."


def _error_words(result: Result) -> list[str]:
    offs = [row.approximation for row in result.rows if row.approximation is not None]
    if not offs:
        return []
    before, after = (max(off[index] for off in offs) for index in (0, 1))
    return [f"Picture and its own reference: ΔE94 p99 at most {beside(before)} before, {beside(after)} after."]


def _verdicts_there(views: Iterable[dict[str, Any]]) -> list[str]:
    """List the words of the occurring verdicts, for the page's menu."""
    found = {words for view in views for words in view["words"]}
    return [words for tiers in VERDICTS.values() for words, *_ in tiers.values() if words in found]


def _view(row: RowResult, sides: _Sides, pictured: bool, history: Sequence[Run]) -> dict[str, Any]:
    """Collect the content of a row: its changed layers with map and both pictures, or else one picture."""
    cause = cause_of(row)
    a, b = sides.pair(row)
    moved: list[LayerKind] = [kind for kind, one in row.layers.items() if one.moved or one.undefined]
    if row.tier != "pass" and not moved:
        moved = [kind for kind, one in row.layers.items() if not one.identical]
    layers, single = [], None
    if pictured and moved and a is not None and b is not None:
        layers = [_layer(row, kind, a, b, sides, cause) for kind in moved]
    elif pictured and (there := b or a) is not None:
        single = alone(min(there.layers.items(), key=lambda one: one[0] == "reference")[1], sides.side)
    figures = [row.layers[kind] for kind in moved] or list(row.layers.values())
    return {
        "row": row,
        "id": row_id(f"row:{row.name}"),
        "cause": cause,
        "state": state_words(row),
        # The error alone is judged where nothing moved, or nothing could.
        "words": [
            VERDICTS[whose][tier][0]
            for whose, tier in verdicts(row).items()
            if row.state not in _SAID or (whose, cause) == ("approximation", "material")
        ],
        "said": _SAID.get(row.state, ""),
        "moved": _to_look_at(row),
        "changed": what_changed(row),
        "verdicts": [(cause, tier) for cause, tier in verdicts(row).items()],
        "layers": layers,
        "single": single,
        "which": "before" if b is None else "after" if a is None else "before and after",
        "p99": max((one.p99 for one in figures), default=None),
        "mean": max((one.mean for one in figures), default=None),
        "max": max((one.max for one in figures), default=None),
        "undefined": sum(one.undefined for one in row.layers.values()),
        "asked": [one for one in row.asked if one.tier != "pass"],
        "earlier": earlier_figures(history, str(row.name)),
    }


def _layer(row: RowResult, kind: LayerKind, a: Row, b: Row, sides: _Sides, cause: Cause) -> dict[str, Any]:
    found = row.layers[kind]
    limit = _limit(row, kind) or sides.scale
    one = shown(a, b, kind, sides.scale, limit, sides.side)
    off = np.subtract(found.after_lab, found.before_lab)
    return {
        "kind": kind,
        "cause": cause,
        "figures": found,
        "words": _direction(found, one),
        "shown": one,
        "reading": one.full_size == (1, 1),
        "histogram": histogram_plot(one.histogram, limit),
        "limit": f"{limit:g}" if _limit(row, kind) else "",
        "worst": " ".join(f"Δ{name} {_signed(value)}" for name, value in zip(("L*", "a*", "b*"), off, strict=True)),
        "spectra": None if one.spectra is None else plots.pair_plot(*one.spectra, _PAIR_SIZE),
        "clipped": max(one.before.clipped, one.after.clipped),
        "window": _window(a.layers[kind].file, b.layers[kind].file),
    }


def _direction(found: Figures, one: ShownRow) -> str:
    """Describe the mean direction of the change, "" if it has no number."""
    before = np.asarray(one.lab)
    after = before + found.shift
    if not np.isfinite(after).all():
        return ""
    return direction(before, differences(before, after), found.floor_mean)


def _window(before: Path | None, after: Path | None) -> str | None:
    """Return the command that opens both pictures in the review window; None unless both are OpenEXR files."""
    files = [one for one in (before, after) if one is not None and one.suffix.lower() == ".exr"]
    return window_command(*files) if len(files) == 2 else None


def _limit(row: RowResult, kind: LayerKind) -> float | None:
    """Return the ΔE94 at which a criterion warns for pixels of a layer, preferably that of p99."""
    found = {
        one.criterion.statistic: one.criterion.warn
        for one in row.asked
        if one.of == kind and one.criterion.formula.name == "CIE 1994" and one.criterion.warn > 0
    }
    return next((found[name] for name in ("p99", "p95", "max", "mean", "median") if name in found), None)


def _cards(result: Result, views: Mapping[RowName, dict[str, Any]], common: RowName) -> list[dict[str, Any]]:
    """Return one card per group of rows that differ only in light, the worst first; `order` is the original place."""
    groups: dict[RowName, list[dict[str, Any]]] = {}
    for row in result.rows:
        groups.setdefault(row.name._replace(light=""), []).append(views[row.name])
    cards = []
    for order, (name, own) in enumerate(groups.items(), 1):
        title = " · ".join(part for part in name.without(common) if part) or name.material or str(name)
        own.sort(key=lambda view: -view["rank"])
        cards.append(
            {
                "name": str(RowName(title, "", "")),
                "title": own[0]["heading"],
                "anchor": f"m{order}",
                "order": order,
                "rows": own,
                "mean": max((view["mean"] for view in own if view["mean"] is not None), default=None),
                "max": max((view["max"] for view in own if view["max"] is not None), default=None),
            }
        )
    return sorted(cards, key=lambda card: max(view["rank"] for view in card["rows"]), reverse=True)


def _shifts(views: Any, lights: Sequence[str]) -> list[tuple[str, dict[str, Any]]]:
    """Plot colour shifts by light, an arrow per row."""
    found = []
    for light in lights:
        told = []
        for view in views:
            row: RowResult = view["row"]
            if row.name.light != light or not view["layers"]:
                continue
            layer = next((one for one in view["layers"] if one["kind"] != "picture"), view["layers"][0])
            figures: Figures = layer["figures"]
            one: ShownRow = layer["shown"]
            tier = verdicts(row).get(view["cause"], "pass")
            style = f"{view['cause']} {VERDICTS[view['cause']][tier][2]}"
            told.append(ShiftArrow(row.name.material or str(row.name), one.lab, figures.shift, style, view["id"]))
        plots_of = shift_plots(told)
        if plots_of is not None:
            found.append((light, plots_of))
    return found


def _signed(value: float) -> str:
    """Format a value with its sign and as many decimals as needed."""
    if not math.isfinite(value):
        return "no number"
    text = f"{value:+.2f}" if abs(value) >= 0.005 else f"{value:+.1g}"
    return "0" if float(text) == 0.0 else text.replace("-", "\N{MINUS SIGN}")
