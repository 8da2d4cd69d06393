"""The report's page: what the template shows, worked out from the rows, and nothing that the JSON does not say too."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Sequence
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import coded_map, plots
from .histogram import histogram_plot
from .history import Run, earlier_figures, trend_plot
from .rating import MOST, VERDICTS
from .row import ReviewRow, WorstPixel
from .shift_plot import Shift, shift_plots
from .statistics import beside, verdict

if TYPE_CHECKING:
    import jinja2
    from jinja2.bccache import Bucket
    from markupsafe import Markup

TEMPLATES = Path(__file__).with_name("templates")
SHOWN_WORST = 6

_PLOT_SIZE = (262.0, 132.0)
_PAIR_SIZE = (168.0, 62.0)
# Never the words and signs of a colour's verdict: a small error of the renderer does not approve a colour.
_VERDICTS = {
    "pass": ("error within budget", "●"),
    "near": ("error near budget", "▲"),
    "over": ("error over budget", "■"),
    "invalid": ("not valid", "✕"),
}
_HEADINGS = {
    "pass": "The renderer's error is within its budget",
    "near": "The renderer's error is near its budget",
    "over": "The renderer's error is over its budget",
    "invalid": "Not valid",
}


def html_environment(*folders: Path, **filters: Callable[..., Any]) -> jinja2.Environment:
    """Templates of the pages, and in `folders`: escaped, strict about names, with `de` for a ΔE and `filters`."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader([*folders, TEMPLATES]),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
        bytecode_cache=_compiled_templates(),
    )
    environment.filters.update({"de": _figure} | filters)
    return environment


@cache
def _compiled_templates() -> jinja2.BytecodeCache:
    """Keep the byte code of templates for all environments of this process; filters are looked up by name in each."""
    import jinja2

    class InMemory(jinja2.BytecodeCache):
        def __init__(self) -> None:
            self.code: dict[str, bytes] = {}

        def load_bytecode(self, bucket: Bucket) -> None:
            if bucket.key in self.code:
                bucket.bytecode_from_string(self.code[bucket.key])

        def dump_bytecode(self, bucket: Bucket) -> None:
            self.code[bucket.key] = bucket.bytecode_to_string()

    return InMemory()


def render_page(document: dict[str, Any], rows: Sequence[ReviewRow], title: str, history: Sequence[Run] = ()) -> str:
    """One self-contained HTML page for `document`, the content of `review.json`, and the rows that it was made from.

    `history` : runs, this one the last.
    """
    budget = document["budget_delta_e94"]
    # A figure over the budget is not written as the budget.
    figure = partial(_figure, limits=(budget, 1.5 * budget))
    environment = html_environment(de=figure, seconds=_seconds, uri=plots.data_uri, breakable=breakable)
    environment.globals["window"] = window_command
    cards = _cards(rows, budget, history)
    views = [view for card in cards for view in card["rows"]]
    counts = {word: sum(view["status"] == word for view in views) for word in ("pass", "near", "over")}
    return environment.get_template("report.html").render(
        title=title,
        document=document,
        cards=cards,
        counts=counts,
        total=len(views),
        headline=_headline(document, counts, len(views)),
        verdicts=_VERDICTS,
        headings=_HEADINGS,
        worst=sorted(views, key=_badness, reverse=True)[:SHOWN_WORST],
        largest=max(views, key=_p99),
        illuminants=_unique(row.illuminant for row in rows),
        observers=_unique(_observer(row.observer) for row in rows),
        whites=_whites(rows),
        mean=float(np.mean([row.statistics.mean for row in rows])),
        scale=plots.scale_words(budget),
        codes=coded_map.code_words(budget),
        step=100.0 * coded_map.STEP_SHARE,
        shifts=_shifts(rows, budget),
        trend=trend_plot(history, "ΔE94 p99"),
        pair=_PAIR_SIZE,
        budget=budget,
        most=MOST,
        said=_said(document["protocol"]),
        uncertain=max((row.noise.mean for row in rows if row.noise is not None), default=None),
    )


def _said(protocol: Sequence[dict[str, Any]]) -> str:
    """How many reviewers' ratings say what."""
    counts = {word: sum(one["verdict"] == word for one in protocol) for word in VERDICTS}
    return ", ".join(f"{count} {word}" for word, count in counts.items() if count)


def _headline(document: dict[str, Any], counts: dict[str, int], total: int) -> str:
    budget = f"ΔE94 {document['budget_delta_e94']:g}"
    if document["status"] == "invalid":
        return "The report's check of itself is missing or failed: do not rely on its figures."
    if counts["pass"] == total:
        return f"All {total} rows: at least 99 % of the lit surface is within {budget} of the reference."
    outside = [f"{counts[word]} {word}" for word in ("near", "over") if counts[word]]
    return f"{counts['pass']} of {total} rows are within the budget of {budget}; {' and '.join(outside)} it."


def _cards(rows: Sequence[ReviewRow], budget: float, history: Sequence[Run]) -> list[dict[str, Any]]:
    """One card a material, the worst first; `order` is its place in the review."""
    cards: list[dict[str, Any]] = []
    for order, material in enumerate(_unique(row.material for row in rows), start=1):
        anchor = f"m{order}"
        own = [row for row in rows if row.material == material]
        views = [{"row": row, "anchor": anchor, "status": verdict(row.statistics, budget)} for row in own]
        for view in views:
            view["observer"] = _observer(view["row"].observer)
            view["colour"] = _colour(view["row"])
            view["id"] = row_id(view["row"].name)
            view["histogram"] = histogram_plot(view["row"].histogram, budget)
            view["worst"] = _worst(view["row"].worst)
            view["earlier"] = earlier_figures(history, view["row"].name)
        worst = max(views, key=_badness)
        cards.append(
            {
                "material": material,
                "anchor": anchor,
                "order": order,
                "rows": views,
                "worst": worst,
                "mean": max(row.statistics.mean for row in own),
                "max": max(row.statistics.max for row in own),
                "swatches": [(row.illuminant, row.swatch) for row in own if row.swatch is not None],
                "plot": next((_plot(row) for row in own if row.reflectance is not None), None),
                "provenance": {label: text for row in own for label, text in row.provenance.items()},
            }
        )
    return sorted(cards, key=lambda card: _badness(card["worst"]), reverse=True)


def row_id(name: str) -> str:
    """What a link leads to: a row's name without white space, which an address would not keep."""
    return re.sub(r"\s", "_", name)


def _shifts(rows: Sequence[ReviewRow], budget: float) -> list[tuple[str, dict[str, Any]]]:
    """By light, where the pictures lie off: an arrow a material."""
    found = []
    for light in _unique(row.illuminant for row in rows):
        told = [
            Shift(row.material, row.colour.lab.tolist(), row.shift, verdict(row.statistics, budget), row_id(row.name))
            for row in rows
            if row.illuminant == light and row.colour is not None and row.shift is not None
        ]
        plots_of = shift_plots(told)
        if plots_of is not None:
            found.append((light, plots_of))
    return found


def _worst(worst: WorstPixel | None) -> dict[str, Any] | None:
    """What is said of the worst pixel, with its spectra where there are any."""
    if worst is None:
        return None
    curves = (worst.wavelengths_nm, worst.reference_factor, worst.picture_factor)
    plot = None if any(one is None for one in curves) else plots.pair_plot(*curves, _PAIR_SIZE)  # type: ignore[arg-type]
    off = worst.picture_lab - worst.reference_lab
    words = " ".join(f"Δ{name} {value:+.2f}" for name, value in zip(("L*", "a*", "b*"), off, strict=True))
    return {
        "place": f"{worst.place[1]}, {worst.place[0]}",
        "words": words.replace("-", "\N{MINUS SIGN}"),
        "plot": plot,
        "delta_e": worst.delta_e94,
    }


def _colour(row: ReviewRow) -> str:
    """`L* 41.2 a* 30.1 b* -12.0` with a real minus, or nothing."""
    if row.colour is None:
        return ""
    named = zip(("L*", "a*", "b*"), row.colour.lab, strict=True)
    return " ".join(f"{name} {value:.1f}" for name, value in named).replace("-", "\N{MINUS SIGN}")


def _p99(view: dict[str, Any]) -> float:
    return view["row"].statistics.p99


def _badness(view: dict[str, Any]) -> tuple[bool, float]:
    statistics = view["row"].statistics
    return statistics.undefined > 0, statistics.p99


def _plot(row: ReviewRow) -> dict[str, Any]:
    assert row.wavelengths_nm is not None and row.reflectance is not None
    return plots.spectrum_plot(row.wavelengths_nm, row.reflectance, row.reflectance_label, _PLOT_SIZE)


def _whites(rows: Sequence[ReviewRow]) -> list[str]:
    words = []
    for row in rows:
        if row.white_xyz is not None:
            x, y = row.white_xyz[:2] / row.white_xyz.sum()
            white = " ".join(f"{value:.4f}" for value in row.white_xyz)
            observer = _observer(row.observer)
            words.append(f"{row.illuminant}, {observer}: XYZ {white} (x {x:.4f}, y {y:.4f})")
    return _unique(words)


def _observer(name: str) -> str:
    """`CIE 1931 2°` for colour-science's `CIE 1931 2 Degree Standard Observer`."""
    return name.replace(" Degree Standard Observer", "°")


def _unique(words: Any) -> list[str]:
    return list(dict.fromkeys(words))


def _figure(value: float, limits: tuple[float, ...] = ()) -> str:
    """ΔE to two decimals, more beside a limit; a small difference is not written as none."""
    return beside(value, *limits)


def window_command(reference: str | Path, picture: str | Path) -> Markup:
    """Return the command that opens a reference and a picture, one beside the other, in the review window.

    >>> str(window_command("a.exr", "b c.exr"))
    '<code>metamer view a.exr &#39;b c.exr&#39;</code>'
    """
    from markupsafe import Markup

    return Markup("<code>{}</code>").format(shlex.join(["metamer", "view", str(reference), str(picture)]))


def breakable(name: str) -> Markup:
    """A long identifier that may wrap after its separators."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"([/_.-])", r"\1<wbr>", str(escape(name))))


def _seconds(value: float) -> str:
    return f"{value * 1000.0:.0f} ms" if value < 1.0 else f"{value:.1f} s"
