"""Rows as pictures on a page: before, after, and the map of ΔE94 between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8

from ...spectral.adaptation import adaptation_matrix
from ...spectral.formula import Formula
from ...spectral.upsampling import xyz_from_rgb
from .. import coded_map, plots
from .change import change
from .row import LayerKind, Pixels, Row

# Less than this is no picture but a reading: it is enlarged to a patch.
_PATCH = 24


@dataclass(frozen=True)
class Shown:
    """One layer as files for a page: WebP before and after, PNG map, and its size.

    clipped : share of the colours that sRGB cannot show.
    """

    layer: LayerKind
    before: str
    after: str
    map: str
    width: int
    height: int
    clipped: float


def shown(a: Row, b: Row, kind: LayerKind, limit: float, side: int) -> Shown:
    """One layer of a pair of rows; the map's scale is made for a ΔE94 of `limit`, `side` is the longest in pixels."""
    before, after = a.layers[kind].load(), b.layers[kind].load()
    delta_e = change(before, after, (Formula("CIE 1994"),), str(a.name), rounding=False).maps["CIE 1994"]
    size = plots.fitted_size(delta_e.shape, side)
    pictures, clipped = [], []
    for one in (before, after):
        rgb, share = srgb(one)
        pictures.append(_patch(plots.reduce_picture(rgb, size)))
        clipped.append(share)
    reduced = _patch(plots.reduce_map(delta_e, size))
    return Shown(
        kind,
        plots.data_uri(plots.lossless(pictures[0])),
        plots.data_uri(plots.lossless(pictures[1])),
        plots.data_uri(coded_map.map_png(reduced, limit), "png"),
        reduced.shape[1],
        reduced.shape[0],
        max(clipped),
    )


def srgb(pixels: Pixels) -> tuple[UInt8[np.ndarray, "H W 3"], float]:
    """Codes for an sRGB display, adapted once (Bradford), and the share of pixels that were clipped to it."""
    matrix = xyz_from_rgb()
    adapted = adaptation_matrix(pixels.white_xyz, matrix.sum(axis=1))
    linear = np.nan_to_num(pixels.xyz @ (np.linalg.inv(matrix) @ adapted).T, posinf=1.0, neginf=0.0)
    outside = ((linear < -1e-3) | (linear > 1.0 + 1e-3)).any(axis=-1)
    held = np.clip(linear, 0.0, 1.0)
    encoded = np.where(held <= 0.0031308, 12.92 * held, 1.055 * np.maximum(held, 1e-9) ** (1 / 2.4) - 0.055)
    return np.rint(255.0 * encoded).astype(np.uint8), float(outside.mean())


def _patch(values: Float[np.ndarray, "H W"] | UInt8[np.ndarray, "H W 3"]) -> np.ndarray:
    height, width = values.shape[:2]
    if height > 1 and width > 1:
        return values
    return np.repeat(np.repeat(values, max(1, _PATCH // height), axis=0), max(1, _PATCH // width), axis=1)
