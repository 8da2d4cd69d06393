"""Every BTF by every method: bytes, seconds, milliseconds and errors, beside the bars."""

from __future__ import annotations

from collections.abc import Callable
from fnmatch import fnmatchcase
from pathlib import Path

from ...calibration.report.text_tables import columns
from ...runtime.errors import InputError
from . import cases as there_are
from . import spectral
from .cases import MEASURED, btf_cases
from .comparison import BALANCED, HARMONIC, HELD, Compared, Sky, rows_of
from .methods import methods
from .rows import OFFSETS, offsets, published, with_bars, within

Progress = Callable[[str], None]


def run(
    full: bool = False,
    data: Path | None = None,
    progress: Progress = lambda line: None,
    case: str | None = None,
    method: str | None = None,
    texels: int | None = None,
) -> dict:
    """Measure all there is.

    Parameters
    ----------
    full : larger crops, more BTFs and all methods. data : a folder with btf/ and light/, or None.
    case, method : only those whose names fit, `*` and `?` for anything; those of the full run too.
    texels : along each side of a crop of a measured BTF; None: `cases.CROP`.

    Returns
    -------
    dict : `rows`, for JSON; `missing`, measured BTFs whose files are not there; `claims` (`spectral.claims`). A row
    has `case`, `method`, `texels`, `bytes_per_texel`, `fit_cpu_seconds`, `fold_ms` (a light, before the first
    pixel), `ms_per_megapixel` (in numpy, on one core), `light`, `delta_e94` (`mean`, `p95`, `p99`), `epsilon`,
    `published_epsilon`, `registered`, `size`, `dictionary_bytes`, `offset` and `bar`; None where a figure has no
    meaning.

    Raises
    ------
    InputError : no case, or no method, fits.
    """
    chosen = [one for one in btf_cases(data, full or case is not None, texels) if _fits(one.name, case)]
    ways = methods(full or method is not None)
    if not chosen:
        names = ", ".join(one.name for one in btf_cases(data, True))
        raise InputError("no case is called so", field="--case", found=case, expected=names)
    names = sorted({HELD, BALANCED, HARMONIC, *spectral.NAMES}.union(*(rows_of(way) for way in ways)))
    if not any(_fits(name, method) for name in names):
        raise InputError("no method is called so", field="--method", found=method, expected=", ".join(names))
    there = {one.name for one in btf_cases(data, True)}
    sky, rows = Sky(data, progress), []
    for one in chosen:
        rows += Compared(one, lambda name: _fits(name, method), sky, progress).rows(ways)
        rows += spectral.spectral_rows(one, there_are.DIRECTIONS, lambda name: _fits(name, method))
    missing = [name for name in MEASURED if name not in there]
    return {"missing": missing, "rows": with_bars(rows), "claims": spectral.claims(rows)}


def _fits(name: str, pattern: str | None) -> bool:
    return pattern is None or fnmatchcase(name, pattern)


def report(figures: dict) -> str:
    """Return the figures as a table."""
    body = []
    for one in figures["rows"]:
        bar, kept = one["bar"], within(one)
        body.append(
            [
                one["case"], one["method"], one["size"] or "-", one["light"],
                *(_or_dash(one[name], form) for name, form in _FIGURES),
                *(f"{one['delta_e94'][name]:.2f}" for name in ("mean", "p95", "p99")),
                _or_dash(one["epsilon"], ".3f"), _or_dash(one["published_epsilon"], ".3f"),
                "-" if bar is None else f"{bar['mean']:g}/{bar['p95']:g}/{bar['p99']:g}{'' if kept else ' over'}",
            ]
        )  # fmt: skip
    headings = ["case", "method", "size", "light", "bytes", "fit CPU s", "fold ms", "ms/Mpx", "mean", "p95", "p99"]
    title = "ΔE94 against the images; bytes a texel, dictionaries and all; bars as mean/p95/p99"
    text = f"{title}\n{columns([*headings, 'epsilon', 'theirs', 'bar'], body, left=4)}\n\n{published()}"
    for case, found in offsets(figures["rows"]).items():
        text += f"\n{case}: the surface is {found:.2f} texels above the measured plane"
        if case in OFFSETS:
            expected, most = OFFSETS[case]
            kept = "kept" if abs(found - expected) <= most else "MISSED"
            text += f", {expected:g} within {most:g}: {kept}"
    for one in figures["claims"]:
        kept = "kept" if one["kept"] else "MISSED"
        text += f"\n{one['claim']}: {one['found']:.3f}, at most {one['bar']:g}: {kept}"
    if figures["missing"]:
        text += f"\n\nwithout {', '.join(figures['missing'])}: set METAMER_DATA to a folder with btf/ and light/"
    return text


# Figures of the table, and how each is written.
_FIGURES = (("bytes_per_texel", ".1f"), ("fit_cpu_seconds", ".1f"), ("fold_ms", ".1f"), ("ms_per_megapixel", ".0f"))


def _or_dash(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)
