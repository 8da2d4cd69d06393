"""Page of the report: the template's content, derived from the rows, with no facts beyond the JSON."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Callable, Sequence
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...spectral.observers import observer_title
from . import plots
from .history import Run, trend_plot
from .rating import MOST, VERDICTS
from .review_data import page_data
from .review_facts import SHIFT_ADAPTATION, SHIFT_FROM
from .review_words import screen_name
from .row import ReviewRow
from .row_name import row_id
from .shift_plot import ShiftArrow, shift_plots
from .statistics import beside, verdict, verdict_limits

if TYPE_CHECKING:
    import jinja2
    from jinja2.bccache import Bucket
    from markupsafe import Markup

TEMPLATES = Path(__file__).with_name("templates")

_STATUS_ICONS = {"pass": "i-ok", "near": "i-near", "over": "i-warn", "invalid": "i-warn"}


def html_environment(*folders: Path, **filters: Callable[..., Any]) -> jinja2.Environment:
    """Make the template environment for `folders`: escaped, strict about names, with `de` for a ΔE and `filters`."""
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
    """Cache the byte code of templates for all environments of this process; filters are looked up by name in each."""
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
    """Render one self-contained HTML page for `document`, the content of `review.json`, and its rows.

    history : runs, this one the last.
    """
    budget = document["budget_delta_e94"]
    # A figure over the budget is not written as the budget.
    figure = partial(_figure, limits=verdict_limits(budget))
    environment = html_environment(de=figure, breakable=breakable)
    data, embedded = page_data(document, rows, title, history)
    pictured = [light for light in data["lights"] if light["pictured"]]
    return environment.get_template("review.html").render(
        title=title,
        heading=data["title"],
        document=document,
        data=script_json(data),
        embedded=script_json(embedded),
        status_icon=_STATUS_ICONS[document["status"]],
        # The keys of the first nine.
        pictured=[
            (one["id"], _light_words(one["name"], one["id"]), str(number) if number < 10 else "", one["icon"])
            for number, one in enumerate(pictured, start=1)
        ],
        pictured_plain=[(one["id"], one["name"], "", one["icon"]) for one in pictured],
        observers=[(name, name, "", "") for name in data["observers"]],
        screen=screen_name(document["display"]),
        shift_words=f"ΔE2000 from the colour under {SHIFT_FROM}, after complete adaptation by {SHIFT_ADAPTATION}",
        scale=plots.scale_words(budget),
        scale_bar=scale_bar(budget),
        whites=_whites(rows),
        shifts=_shifts(rows, budget),
        trend=trend_plot(history, "ΔE94 p99"),
        budget=budget,
        borderline=verdict_limits(budget)[1],
        most=MOST,
        said=_said(document["protocol"]),
        uncertain=max((row.noise.mean for row in rows if row.noise is not None), default=None),
    )


def _light_words(title: str, name: str) -> Markup:
    """Return a light's title and, if there is room and the title lacks it, its name."""
    from markupsafe import Markup, escape

    return escape(title) if name in title else Markup('{}<span class="long"> {}</span>').format(title, name)


def script_json(value: Any) -> Markup:
    """Encode JSON for a script element, so that nothing in it ends the element."""
    from markupsafe import Markup

    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e"))


def scale_bar(budget: float, limit: bool = True) -> Markup:
    """Return the scale of all maps: steps, red beyond, ticks at whole budgets, the first marked if a `limit`."""
    from markupsafe import Markup

    words = plots.scale_words(budget)
    ramp = Markup("").join(
        Markup('<i style="background:rgb{}"></i>').format(tuple(c)) for c in plots.scale_rgb()[::3].tolist()
    )
    ticks = Markup("").join(
        Markup('<span style="left:{:.1f}%">{}{}</span>').format(at, label, " limit" if limit and number == 1 else "")
        for number, (at, label) in enumerate(words["ticks"])
    )
    label = f"Scale of the difference map: ΔE94 from 0, dark, to {words['top']}, light; red is above"
    return Markup(
        '<div class="scale"><div class="ramp" role="img" aria-label="{}">{}<i class="over"></i></div>'
        '<div class="ticks" aria-hidden="true">{}</div></div>'
    ).format(label, ramp, ticks)


def _said(protocol: Sequence[dict[str, Any]]) -> str:
    """State the verdicts of ratings, and by how many reviewers."""
    counts = {word: sum(one["verdict"] == word for one in protocol) for word in VERDICTS}
    return ", ".join(f"{count} {word}" for word, count in counts.items() if count)


def _shifts(rows: Sequence[ReviewRow], budget: float) -> list[tuple[str, dict[str, Any]]]:
    """Plot the pictures' colour errors by light: an arrow per material."""
    found = []
    for light in _unique(row.illuminant for row in rows):
        told = [
            ShiftArrow(
                row.material, row.colour.lab.tolist(), row.shift, verdict(row.statistics, budget), row_id(row.name)
            )
            for row in rows
            if row.illuminant == light and row.colour is not None and row.shift is not None
        ]
        plots_of = shift_plots(told)
        if plots_of is not None:
            found.append((light, plots_of))
    return found


def _whites(rows: Sequence[ReviewRow]) -> list[str]:
    words = []
    for row in rows:
        if row.white_xyz is not None:
            x, y = row.white_xyz[:2] / row.white_xyz.sum()
            white = " ".join(f"{value:.4f}" for value in row.white_xyz)
            observer = observer_title(row.observer)
            words.append(f"{row.illuminant}, {observer}: XYZ {white} (x {x:.4f}, y {y:.4f})")
    return _unique(words)


def _unique(words: Any) -> list[str]:
    return list(dict.fromkeys(words))


def _figure(value: float, limits: tuple[float, ...] = ()) -> str:
    """Format ΔE with two decimals, more near a limit; a small difference is not shown as 0."""
    return beside(value, *limits)


def window_command(reference: str | Path, picture: str | Path) -> Markup:
    """Return the command that opens a reference and a picture, one beside the other, in the review window.

    >>> str(window_command("a.exr", "b c.exr"))
    '<code>metamer view a.exr &#39;b c.exr&#39;</code>'
    """
    from markupsafe import Markup

    return Markup("<code>{}</code>").format(shlex.join(["metamer", "view", str(reference), str(picture)]))


def breakable(name: str) -> Markup:
    """Return a long identifier that may wrap after its separators."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"([/_.-])", r"\1<wbr>", str(escape(name))))
