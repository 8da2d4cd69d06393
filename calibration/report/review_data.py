"""Data of the review page for its scripts: figures rounded for display, and the pictures."""

from __future__ import annotations

import base64
import shlex
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import coded_map, plots
from .histogram import BELOW
from .history import Run, earlier_figures
from .review_facts import SHIFT_FROM
from .review_words import LEVELS, SAID_FROM, screen_words
from .row import ReviewRow, WorstPixel
from .row_name import row_id, short_observer
from .statistics import verdict, verdict_limits

_NM = np.arange(380.0, 781.0, 5.0)
#: Icon of each kind of light.
LIGHT_ICONS = {"daylight": "i-day", "lamp": "i-bulb", "tube": "i-tube", "led": "i-led", "scene": "i-eye"}
#: By standing of the colour: badge beside each picture.
BADGES = {
    "measured": "Measured colour",
    "analytic": "Calculated colour",
    "uplifted": "Guessed from RGB",
    "reconstructed": "Rebuilt from photos",
    "unknown": "Origin of colour not stated",
}
# Headings of the answer on the standing of a colour, with that of the gloss behind it.
_COLOUR_IS = {
    "measured": "Colour measured",
    "analytic": "Colour calculated",
    "uplifted": "Colour guessed",
    "reconstructed": "Colour rebuilt",
    "unknown": "Colour: not stated where from",
}
_GLOSS_IS = {
    "measured": "gloss measured",
    "analytic": "gloss modelled",
    "uplifted": "gloss guessed",
    "reconstructed": "gloss rebuilt",
    "unknown": "gloss: not stated where from",
}
#: Labels in a row's files of pictures that are larger than those in the page, by view.
BESIDE = {"p": "picture WebP", "r": "reference WebP"}


def page_data(
    document: Mapping[str, Any], rows: Sequence[ReviewRow], title: str, history: Sequence[Run]
) -> tuple[dict[str, Any], list[dict[str, str]]]:
    """Collect the data for the page's scripts, and the pictures of each row in base64, by view."""
    budget = document["budget_delta_e94"]
    names = dict.fromkeys(colour["observer"] for one in document["materials"] for colour in one["colours"])
    observers = list(dict.fromkeys([rows[0].observer, *names]))
    lights = [_light(one) for one in document["lights"]]
    embedded = [_pictures(row) for row in rows]
    by_material: dict[str, dict[str, Any]] = {}
    for number, row in enumerate(rows):
        drawn = _row(row, number, budget, history)
        by_material.setdefault(row.material, {})[row.illuminant] = drawn
    data = {
        "title": title.removeprefix("Colour review: "),
        "verdict": document["verdict"],
        "facts": document["facts"],
        "limit": budget,
        "borderline": verdict_limits(budget)[1],
        "saidFrom": SAID_FROM,
        "screen": screen_words(document["display"]),
        "from": SHIFT_FROM,
        "shifted": bool(names),
        "observers": [short_observer(name) for name in observers],
        "lights": lights,
        "stepsBelow": BELOW,
        "codes": {
            **coded_map.code_words(budget),
            "over": list(plots.OVER_RGB),
            "clear": base64.b64encode(coded_map.clear_chunk()).decode("ascii"),
            "undefined": list(plots.UNDEFINED_RGB),
            "top": plots.SCALE_BUDGETS * budget,
        },
        "materials": [_material(one, by_material[one["id"]], rows) for one in document["materials"]],
    }
    return data, embedded


def _pictures(row: ReviewRow) -> dict[str, str]:
    files = {"p": row.picture, "r": row.reference, "d": row.delta_e_map, "m": row.mask}
    return {view: base64.b64encode(file).decode("ascii") for view, file in files.items() if file}


def _light(one: Mapping[str, Any]) -> dict[str, Any]:
    spd = None
    if one["spd"] is not None:
        power = np.interp(_NM, one["spd"]["wavelengths_nm"], one["spd"]["values"], left=0.0, right=0.0)
        spd = (power / max(power.max(), 1e-30)).round(3).tolist()
    icon = LIGHT_ICONS.get(one["kind"], "i-day")
    return {"id": one["name"], "name": one["title"], "icon": icon, "pictured": one["pictured"], "spd": spd}


def _material(one: Mapping[str, Any], drawn: Mapping[str, Any], rows: Sequence[ReviewRow]) -> dict[str, Any]:
    colour, gloss = one["standing"]["colour"], one["standing"]["gloss"]
    colours: dict[str, dict[str, Any]] = {}
    for found in one["colours"]:
        colours.setdefault(short_observer(found["observer"]), {})[found["light"]] = _colour(found)
    if not colours:
        colours = _own_colours([row for row in rows if row.material == one["id"]])
    return {
        "id": one["id"],
        "name": one["title"],
        "family": one["family"],
        "standing": {
            "colour": colour,
            "icon": f"s-{colour}",
            "badge": BADGES[colour],
            "title": f"{_COLOUR_IS[colour]}, {_GLOSS_IS[gloss]}",
            "plain": one["standing"]["plain"],
        },
        "spectrum": _spectrum(one["spectrum"]),
        "source": one["source"],
        "licence": one["licence"],
        "colours": colours,
        "rows": dict(drawn),
    }


def _own_colours(rows: Sequence[ReviewRow]) -> dict[str, dict[str, Any]]:
    """Return colours from rows alone, without shifts."""
    found: dict[str, dict[str, Any]] = {}
    for row in rows:
        if row.colour is not None:
            told = {"lab": _rounded(row.colour.lab), "adapted": None, "shift": None, "swatch": row.swatch}
            found.setdefault(short_observer(row.observer), {})[row.illuminant] = told
    return found


def _colour(found: Mapping[str, Any]) -> dict[str, Any]:
    shift, adapted = found["shift"], found["adapted_lab"]
    return {
        "lab": _rounded(found["lab"]),
        "adapted": None if adapted is None else _rounded(adapted),
        "shift": None if shift is None else {"deltaE": round(shift["delta_e"], 4), "words": shift["words"]},
        "swatch": found["swatch"],
    }


def _spectrum(found: Mapping[str, Any] | None) -> dict[str, Any] | None:
    if found is None:
        return None
    nm, values = np.array(found["wavelengths_nm"]), np.array(found["values"])
    if nm.size > 2 * _NM.size:
        # Finer than a curve on a page shows.
        nm, values = _NM, np.interp(_NM, nm, values)
    return {
        "nm": nm.tolist(),
        "values": values.round(4).tolist(),
        "measured": found["measured_nm"],
        "quantity": found["quantity"],
    }


def _row(row: ReviewRow, number: int, budget: float, history: Sequence[Run]) -> dict[str, Any]:
    status, figures, noise, limits = verdict(row.statistics, budget), row.statistics, row.noise, row.limits
    files = {label: path for label, path in row.files.items() if label not in BESIDE.values()}
    window = None
    if "XYZ EXR" in files and "reference EXR" in files:
        window = shlex.join(["metamer", "view", files["reference EXR"], files["XYZ EXR"]])
    return {
        "picture": number,
        "beside": {view: row.files[label] for view, label in BESIDE.items() if label in row.files},
        "anchor": row_id(row.name),
        "status": status,
        "level": LEVELS[status],
        "mean": figures.mean,
        "p95": figures.p95,
        "p99": figures.p99,
        "max": figures.max,
        "pixels": figures.pixels,
        "undefined": figures.undefined,
        "noise": None if noise is None else {"mean": noise.mean, "limited": noise.limited},
        "limits": None
        if limits is None
        else {
            "below": limits.too_strong,
            "black": limits.below_black,
            "above": limits.above_white,
            "off": limits.mean_delta_e2000,
        },
        "notes": list(row.notes),
        "files": {"PNG": row.image, **files},
        "window": window,
        "seconds": dict(row.seconds),
        "histogram": list(row.histogram),
        "worst": None if row.worst is None else _worst(row.worst),
        "earlier": list(earlier_figures(history, row.name)),
        "around": []
        if row.colour is None
        else [[angle, round(float(lab[0]), 2)] for angle, _, lab in row.colour.around],
        "provenance": {key: text for key, text in row.provenance.items() if key not in ("Source", "Licence")},
    }


def _worst(worst: WorstPixel) -> dict[str, Any]:
    off = worst.picture_lab - worst.reference_lab
    words = " ".join(f"Δ{name} {value:+.2f}" for name, value in zip(("L*", "a*", "b*"), off, strict=True))
    curves = {"nm": worst.wavelengths_nm, "reference": worst.reference_factor, "picture": worst.picture_factor}
    return {
        "place": f"{worst.place[1]}, {worst.place[0]}",
        "deltaE": worst.delta_e94,
        "words": words.replace("-", "\N{MINUS SIGN}"),
        **{name: None if values is None else np.round(values, 4).tolist() for name, values in curves.items()},
    }


def _rounded(values: Any) -> list[float]:
    return np.round(np.asarray(values, dtype=np.float64), 4).tolist()
