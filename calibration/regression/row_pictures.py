"""Pictures of rows on a page: before, after, the map of ΔE94 between them, and further data of their pixels."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, UInt8

from ...spectral.adaptation import adaptation_matrix
from ...spectral.difference import lab_from_xyz
from ...spectral.formula import Formula
from ...spectral.srgb import linear_to_srgb
from ...spectral.upsampling import xyz_from_rgb
from ..report import coded_map, plots
from ..report.histogram import histogram
from .change import change
from .row import LayerKind, PixelLayer, Pixels, Row

# Less than this is no picture but a reading: it is enlarged to a patch.
_PATCH = 24


@dataclass(frozen=True)
class RowPicture:
    """One layer of one side as a WebP file for a page, and its size; `clipped` : share of it that sRGB cannot show."""

    file: bytes
    width: int
    height: int
    clipped: float


@dataclass(frozen=True, eq=False)
class ShownRow:
    """One layer of a pair of rows.

    map : PNG of their ΔE94, as of `coded_map`. full_size : height and width before the reduction for display.
    histogram : pixels by their ΔE94, as of `histogram`. lab : mean CIELAB of the compared pixels before.
    spectra : of the pixel of the largest change, wavelengths in nm (L,) and values (L,) before and after; or None.
    """

    layer: LayerKind
    before: RowPicture
    after: RowPicture
    map: bytes
    full_size: tuple[int, int]
    histogram: tuple[int, ...]
    lab: tuple[float, float, float]
    spectra: tuple[Float[np.ndarray, " L"], Float[np.ndarray, " L"], Float[np.ndarray, " L"]] | None = None


def shown(a: Row, b: Row, kind: LayerKind, scale: float, limit: float, side: int) -> ShownRow:
    """Make the pictures of one layer of a pair of rows.

    Parameters
    ----------
    scale : ΔE94 at the end of the map's scale. limit : ΔE94 in the middle of the histogram.
    side : longest side of the pictures, in pixels.
    """
    before, after = a.layers[kind].load(), b.layers[kind].load()
    moved = change(before, after, (Formula("CIE 1994"),), str(a.name), rounding=False)
    delta_e = moved.maps["CIE 1994"]
    known = np.isfinite(delta_e)
    lab = lab_from_xyz(before.xyz[known], before.white_xyz).astype(np.float64)
    lightness, red_green, yellow_blue = (lab.mean(axis=0) if len(lab) else np.full(3, np.nan)).tolist()
    return ShownRow(
        kind,
        _encoded(before, side),
        _encoded(after, side),
        coded_map.map_png(_patch(plots.reduce_map(delta_e, plots.fitted_size(delta_e.shape, side))), scale),
        (delta_e.shape[0], delta_e.shape[1]),
        histogram(delta_e, limit),
        (lightness, red_green, yellow_blue),
        _spectra(a.layers[kind], b.layers[kind], moved.worst),
    )


def alone(layer: PixelLayer, side: int) -> RowPicture:
    """Make the picture of a layer without a counterpart; `side` is the longest in pixels."""
    return _encoded(layer.load(), side)


def _encoded(pixels: Pixels, side: int) -> RowPicture:
    """Encode the picture, transparent where surfaces do not cover it, so that the page's grey shows."""
    share = np.clip(pixels.coverage, 0.0, 1.0)[..., None]
    if (share == 1.0).all():
        rgb, clipped = srgb(pixels)
    else:
        bare = np.divide(pixels.xyz, share, out=np.zeros(pixels.xyz.shape), where=share > 0.0)
        rgb, clipped = srgb(replace(pixels, xyz=bare))
        rgb = np.concatenate([rgb, np.rint(255.0 * share).astype(np.uint8)], axis=-1)
    reduced = _patch(plots.reduce_picture(rgb, plots.fitted_size(rgb.shape[:2], side)))
    return RowPicture(plots.lossless(reduced), reduced.shape[1], reduced.shape[0], clipped)


def _spectra(
    before: PixelLayer, after: PixelLayer, place: tuple[int, int]
) -> tuple[Float[np.ndarray, " L"], Float[np.ndarray, " L"], Float[np.ndarray, " L"]] | None:
    """Return both spectra on the wavelengths of the earlier one, if both sides have them."""
    if before.spectrum is None or after.spectrum is None:
        return None
    (nm, first), (other_nm, second) = before.spectrum(place), after.spectrum(place)
    return nm, first, np.interp(nm, other_nm, second, left=np.nan, right=np.nan)


def srgb(pixels: Pixels) -> tuple[UInt8[np.ndarray, "H W 3"], float]:
    """Encode for an sRGB display, adapted once (Bradford); return the codes, and the fraction of clipped pixels."""
    matrix = xyz_from_rgb()
    adapted = adaptation_matrix(pixels.white_xyz, matrix.sum(axis=1))
    linear = np.nan_to_num(pixels.xyz @ (np.linalg.inv(matrix) @ adapted).T, posinf=1.0, neginf=0.0)
    outside = ((linear < -1e-3) | (linear > 1.0 + 1e-3)).any(axis=-1)
    held = np.clip(linear, 0.0, 1.0)
    return np.rint(255.0 * linear_to_srgb(held)).astype(np.uint8), float(outside.mean())


def _patch(values: Float[np.ndarray, "H W"] | UInt8[np.ndarray, "H W 3"]) -> np.ndarray:
    height, width = values.shape[:2]
    if height > 1 and width > 1:
        return values
    return np.repeat(np.repeat(values, max(1, _PATCH // height), axis=0), max(1, _PATCH // width), axis=1)
