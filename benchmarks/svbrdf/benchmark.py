"""Every case by every method: how far off, how long, beside how far off the truth itself may be."""

from __future__ import annotations

from collections.abc import Callable
from fnmatch import fnmatchcase
from pathlib import Path

from ...calibration.text_tables import columns
from ...spectral.errors import InputError
from . import cases, meshes, rendering


def run(
    full: bool = False,
    data: Path | None = None,
    progress: Callable[[str], None] = lambda line: None,
    pattern: str | None = None,
) -> dict:
    """Render all there is.

    Parameters
    ----------
    full : more lights, lobes and points. data : a folder with light/ and meshes/, or None.
    pattern : only cases whose names fit, `*` and `?` for anything; those of the full run too.

    Returns
    -------
    dict for JSON: `missing` (files that cases would need) and `rows`. A row has `case`, `method`, `light`, `lobes`,
    `delta_e94` (`mean`, `p95`, `p99` over the points, against the truth), `reference_noise` (mean ΔE94 of a third of
    the difference to the truth from texels twice as wide), `cpu_seconds_per_1000_vertices` and `bytes_per_vertex` (of
    visibility, None where the case needs none or it is closed) and `ms_per_megapixel` (in numpy, on one core, without
    what is made once a light).

    Raises
    ------
    InputError : no case fits the pattern.
    """
    chosen = [
        one for one in cases.cases(full or pattern is not None) if pattern is None or fnmatchcase(one.name, pattern)
    ]
    if not chosen:
        names = sorted({one.name for one in cases.cases(True)})
        raise InputError("no case is called so", field="--case", found=pattern, expected=", ".join(names))
    return {"missing": _missing(data), "rows": list(rendering.rendered(chosen, full, data, progress))}


def _missing(data: Path | None) -> list[str]:
    """Lights and meshes whose files are not there."""
    lights, places = cases.lights(data), meshes.places(data)
    return [name for name in cases.FILES if name not in lights] + [name for name in meshes.FILES if name not in places]


def report(figures: dict) -> str:
    """The figures as a table."""
    body = [
        [
            row["case"], row["light"], row["method"], f"{row['lobes'] or '-'}",
            *(f"{row['delta_e94'][figure]:.2f}" for figure in ("mean", "p95", "p99")),
            f"{row['reference_noise']:.3f}", _or_dash(row["cpu_seconds_per_1000_vertices"], ".2f"),
            _or_dash(row["bytes_per_vertex"], ".0f"), _or_dash(row["ms_per_megapixel"], ".0f"),
        ]
        for row in figures["rows"]
    ]  # fmt: skip
    title = "ΔE94 against the truth, which is itself off by `noise`; CPU seconds for 1000 vertices and bytes a vertex"
    headings = ["case", "light", "method", "lobes", "mean", "p95", "p99", "noise", "CPU s", "bytes", "ms a megapixel"]
    text = f"{title}\n{columns(headings, body, left=3)}"
    if figures["missing"]:
        text += f"\n\nwithout {', '.join(figures['missing'])}: set METAMER_DATA to a folder with light/ and meshes/"
    return text


def _or_dash(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)
