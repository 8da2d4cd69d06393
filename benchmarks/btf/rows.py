"""Rows of figures: what is said of each method, and what it is held to."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from ...calibration.report.text_tables import columns
from ...materials.btf.images import BtfImages
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.srgb import linear_to_srgb
from ...spectral.upsampling import xyz_from_rgb
from ..papers.btf_fields import judged

#: Reconstruction of the texels of an image: view, light -> f_r cos(theta_i).
Reconstruct = Callable[[int, int], Float[np.ndarray, "H W J"]]


class Bar(NamedTuple):
    """ΔE94 that a method is to stay within, and bytes a texel."""

    mean: float
    p95: float
    p99: float
    bytes_per_texel: float = np.inf


#: Largest error allowed to methods, by case: from trials on crops of 128 x 128 texels, before the product's own fits.
BARS: Mapping[tuple[str, str], Bar] = {
    ("wool", "lpca"): Bar(2.1, 4.7, 6.8, 30.0),
    ("corduroy", "lpca"): Bar(2.0, 4.6, 7.0, 30.0),
    ("wool", "rfnl-2"): Bar(4.7, 10.2, 15.0, 1134.0),
    ("corduroy", "rfnl-2"): Bar(5.1, 11.5, 16.0, 1134.0),
    ("wool", "held-views"): Bar(4.4, 9.8, 15.5),
    ("corduroy", "held-views"): Bar(4.4, 10.4, 17.5),
    ("wool", "held-lpca"): Bar(4.4, 9.8, 15.5),
    ("corduroy", "held-lpca"): Bar(4.4, 10.4, 17.5),
    ("wool", "held-rfnl-2"): Bar(4.4, 9.8, 15.5),
    ("corduroy", "held-rfnl-2"): Bar(4.4, 10.4, 17.5),
    ("wool", "light-basis-16"): Bar(0.6, 2.1, 4.3),
    ("corduroy", "light-basis-16"): Bar(0.6, 2.2, 4.8),
    ("wool", "end-to-end"): Bar(1.5, 3.7, 5.8, 30.0),
    ("corduroy", "end-to-end"): Bar(1.5, 3.6, 6.1, 30.0),
}
#: Height of surfaces above the measured plane found in those trials, texels, and its tolerance.
OFFSETS: Mapping[str, tuple[float, float]] = {"wool": (4.0, 0.5), "corduroy": (5.5, 0.5)}
# Texels of the smallest crop that they hold for.
_TEXELS = 128 * 128


def btf_row(
    case: str,
    method: str,
    light: str,
    texels: int,
    delta_e94: tuple[float, float, float],
    *,
    bytes_per_texel: float | None = None,
    fit_cpu_seconds: float | None = None,
    fold_ms: float | None = None,
    ms_per_megapixel: float | None = None,
    registered: bool = False,
    epsilon: float | None = None,
    size: str | None = None,
    dictionary_bytes: int | None = None,
    offset: float | None = None,
) -> dict:
    """Make a row for JSON.

    texels : of the whole. delta_e94 : mean, 95th and 99th percentile. registered : whether the truth is registered
    images. epsilon : mean absolute difference of encoded red, green and blue; beside it is what its paper has for the
    same material, from other files. size : of several forms of one method this one's. dictionary_bytes : of what
    all texels share but their clusters' parts of it. offset : texels that images were moved by to be registered.
    """
    mean, p95, p99 = (float(one) for one in delta_e94)
    return {
        "case": case,
        "method": method,
        "texels": texels,
        "bytes_per_texel": bytes_per_texel,
        "fit_cpu_seconds": fit_cpu_seconds,
        "fold_ms": fold_ms,
        "ms_per_megapixel": ms_per_megapixel,
        "light": light,
        "delta_e94": {"mean": mean, "p95": p95, "p99": p99},
        "epsilon": epsilon,
        "published_epsilon": published_epsilon(case, method),
        "registered": registered,
        "size": size,
        "dictionary_bytes": dictionary_bytes,
        "offset": offset,
        "bar": None,
    }


def with_bars(rows: Sequence[dict]) -> list[dict]:
    """Return the rows, each bar beside the one that is held to it.

    Of forms of several sizes it is the best of those that are small enough, and where none is the smallest. Crops of
    fewer texels than `BARS` is for have too few to share a dictionary, and are held to nothing.
    """
    found: list[dict[str, Any]] = [{**one, "bar": None} for one in rows]
    for (case, method), bar in BARS.items():
        some = [one for one in found if (one["case"], one["method"]) == (case, method) and one["texels"] >= _TEXELS]
        if not some:
            continue
        held: dict = {"mean": bar.mean, "p95": bar.p95, "p99": bar.p99}
        if np.isfinite(bar.bytes_per_texel):
            held["bytes_per_texel"] = bar.bytes_per_texel
        small = [one for one in some if (one["bytes_per_texel"] or 0.0) <= bar.bytes_per_texel]
        best = min(small, key=lambda one: one["delta_e94"]["mean"]) if small else min(some, key=_bytes)
        best["bar"] = held
    return found


def offsets(rows: Sequence[Mapping]) -> dict[str, float]:
    """Return by case how far its surface was found above the measured plane, texels."""
    return {one["case"]: one["offset"] for one in rows if one["offset"] is not None}


def _bytes(figures: Mapping) -> float:
    return figures["bytes_per_texel"]


def within(figures: Mapping) -> bool | None:
    """Return whether a row keeps to its bar; None where it has none."""
    bar = figures["bar"]
    if bar is None:
        return None
    kept = all(figures["delta_e94"][name] <= bar[name] for name in ("mean", "p95", "p99"))
    return kept and ("bytes_per_texel" not in bar or figures["bytes_per_texel"] <= bar["bytes_per_texel"])


def seen_error(images: BtfImages, reconstruct: Reconstruct) -> tuple[tuple[float, float, float], float]:
    """ΔE94 under D65 (`judged`), and epsilon of the same images.

    Epsilon is the mean absolute difference of Meseth, Mueller and Klein 2003 (section 5), of numbers from 0 to 1 that
    are encoded as their images are, by sRGB's curve.
    """
    light, seen = illuminant("D65"), observer("1931_2")
    to_rgb = np.pi * images.basis.fold(light, seen).T @ np.linalg.inv(xyz_from_rgb()).T
    off: list[float] = []

    def heard(view: int, lit: int) -> Float[np.ndarray, "H W J"]:
        made = reconstruct(view, lit)
        off.append(float(np.abs(_encoded(made @ to_rgb) - _encoded(images.image(view, lit) @ to_rgb)).mean()))
        return made

    found = judged(images, heard)
    return (found.mean, found.p95, found.p99), float(np.mean(off))


def _encoded(linear: Float[np.ndarray, "H W 3"]) -> Float[np.ndarray, "H W 3"]:
    # An image holds no number below 0 and none above full scale.
    return linear_to_srgb(np.clip(linear, 0.0, 1.0))


#: Methods of the columns of `EPSILON`, by the names that they have here.
METHODS = ("lafortune without scales", "lafortune", "rfp", "rfnl-2")
#: Mean epsilon of Meseth, Mueller and Klein 2003 (table 1): four lobes of Lafortune's without and with scales, RFP, and
#: RFNL of two lobes.
EPSILON: Mapping[str, tuple[float, float, float, float]] = {
    "proposte": (0.0978, 0.0794, 0.0689, 0.0736),
    "wool": (0.0788, 0.0693, 0.0719, 0.0582),
    "stone": (0.0904, 0.0816, 0.0797, 0.0640),
    "corduroy": (0.1114, 0.0859, 0.0513, 0.0537),
    "aluminium": (0.0572, 0.0558, 0.0846, 0.0479),
}
# Figures of the same paper (section 5.3) and of Mueller, Meseth and Klein 2004 (section 5.3), which state no other
# error.
_NOTES = (
    "Meseth 2003: 365 MB for 256 x 256 texels and 81 fields in 32 bits; 21 fps under a point light and 14 fps in an "
    "environment, GeForce FX 5800",
    "Müller 2004: 16 clusters of 4 components, 16.9 MB; 0.8 s for a light, 12 fps, GeForce FX 5900; no error is given",
)


def published_epsilon(case: str, method: str) -> float | None:
    """Return what the paper has for a material and a method of these names; None for others."""
    if case not in EPSILON or method not in METHODS:
        return None
    return EPSILON[case][METHODS.index(method)]


def published() -> str:
    """Return all of it, as a table."""
    body = [[material, *(f"{value:.3f}" for value in values)] for material, values in EPSILON.items()]
    title = "As published: epsilon of Meseth et al. 2003, of the same materials from other files"
    return "\n".join([title, columns(["material", *METHODS], body), *_NOTES])
