"""Small pictures for a report: losslessly embedded renderings, ΔE maps with their colour scale, spectral curves."""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Iterable
from functools import cache
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from ...spectral.srgb import linear_to_srgb, srgb_to_linear

# The scale ends at this many budgets, the same for every map, so that rows compare at a glance.
SCALE_BUDGETS = 3.0
# Steps of the scale: a twentieth of the budget, finer than a map is read.
_STEPS = 60

# Dark to light: lightness alone orders the values, hue turns from blue to yellow near the budget.
_ANCHORS = (
    (0.0, (24, 26, 54)),
    (1 / 6, (36, 62, 112)),
    (1 / 3, (32, 118, 134)),
    (1 / 2, (84, 158, 108)),
    (2 / 3, (178, 186, 78)),
    (5 / 6, (234, 212, 108)),
    (1.0, (255, 243, 190)),
)
OVER_RGB = (214, 38, 60)
UNDEFINED_RGB = (255, 0, 255)
NOT_COMPARED_RGB = (128, 128, 128)

# Bytes of two lossless pictures and a coded map in a page, by pair and by pixel (3700 and 1.28 measured on the shipped
# materials in the open, 48 to 97 pixels wide; a booth's reference is noisier); and of the text of each.
_BYTES_PER_PAIR = 3700
_BYTES_PER_PIXEL = 1.6
_BYTES_OF_TEXT = 6400.0
_PAGE_BYTES = 5.8e6
_LEAST_SIDE, _LARGEST_SIDE = 56, 512


def embedded_side(pairs: int, text: float = _BYTES_OF_TEXT) -> int:
    """Return the longest side in pixels that keeps a page of `pairs` pairs below 6 MB: 512 for a few, never under 56.

    text : bytes of text per pair.
    """
    pixels = (_PAGE_BYTES / max(pairs, 1) - text - _BYTES_PER_PAIR) / _BYTES_PER_PIXEL
    return int(np.clip(math.sqrt(max(pixels, 0.0)), _LEAST_SIDE, _LARGEST_SIDE))


@cache
def scale_rgb() -> UInt8[np.ndarray, "steps 3"]:
    """Colours of the ΔE scale from 0 to `SCALE_BUDGETS` budgets, ordered by lightness."""
    position = np.linspace(0.0, 1.0, _STEPS)
    where = [anchor for anchor, _ in _ANCHORS]
    columns = [np.interp(position, where, [rgb[channel] for _, rgb in _ANCHORS]) for channel in range(3)]
    return np.rint(np.stack(columns, axis=-1)).astype(np.uint8)


def scale_words(budget: float) -> dict[str, Any]:
    """Return the scale for a page: its gradient, ticks in ΔE with their place in per cent, and the colours beyond
    it."""
    colours = [_hexadecimal(rgb) for rgb in scale_rgb().tolist()]
    parts = int(SCALE_BUDGETS)
    return {
        "gradient": ", ".join([*colours[::5], colours[-1]]),
        "ticks": [(100.0 * step / parts, f"{step * budget:g}") for step in range(parts + 1)],
        "top": f"{parts * budget:g}",
        "over": _hexadecimal(OVER_RGB),
        "undefined": _hexadecimal(UNDEFINED_RGB),
        "not_compared": _hexadecimal(NOT_COMPARED_RGB),
    }


def _hexadecimal(rgb: Iterable[int]) -> str:
    return "#{:02x}{:02x}{:02x}".format(*rgb)


def delta_e_picture(delta_e: Float[np.ndarray, "H W"], budget: float) -> UInt8[np.ndarray, "H W 3"]:
    """Colour a ΔE map: the scale, red beyond it, grey where not compared, magenta where a number is missing."""
    colours = np.concatenate([scale_rgb(), np.array([OVER_RGB, UNDEFINED_RGB, NOT_COMPARED_RGB], dtype=np.uint8)])
    with np.errstate(invalid="ignore"):
        step = np.floor(delta_e / (SCALE_BUDGETS * budget) * _STEPS)
    index = np.where(delta_e <= SCALE_BUDGETS * budget, np.minimum(step, _STEPS - 1), _STEPS)
    index = np.where(np.isinf(delta_e), _STEPS + 1, index)
    index = np.where(np.isnan(delta_e), _STEPS + 2, index)
    return colours[index.astype(np.intp)]


def fitted_size(size: tuple[int, int], side: int) -> tuple[int, int]:
    """Return height and width of a picture of `size` with its longest side reduced to `side`; never enlarged."""
    scale = min(1.0, side / max(size))
    return max(1, round(size[0] * scale)), max(1, round(size[1] * scale))


def reduce_picture(rgb: UInt8[np.ndarray, "H W c"], size: tuple[int, int]) -> UInt8[np.ndarray, "h w c"]:
    """Average display-encoded sRGB by area in linear light, which keeps the code of a uniform colour.

    Colours of RGBA are weighted by their coverage.
    """
    if size == rgb.shape[:2]:
        return rgb
    linear = srgb_to_linear(np.arange(256) / 255.0)
    down, across = (_shares(*lengths) for lengths in zip(rgb.shape[:2], size, strict=True))
    covered = rgb[..., 3:] / 255.0 if rgb.shape[2] == 4 else np.ones((*rgb.shape[:2], 1))
    weighted = np.concatenate([linear[rgb[..., :3]] * covered, covered], axis=-1)
    summed = np.einsum("hH,HWc,wW->hwc", down, weighted, across, optimize=True)
    share = summed[..., 3:]
    mean = np.divide(summed[..., :3], share, out=np.zeros_like(summed[..., :3]), where=share > 0.0)
    encoded = linear_to_srgb(mean)
    if rgb.shape[2] == 4:
        encoded = np.concatenate([np.where(share > 0.0, encoded, 0.0), share], axis=-1)
    return np.rint(encoded * 255.0).astype(np.uint8)


def reduce_map(delta_e: Float[np.ndarray, "H W"], size: tuple[int, int]) -> Float[np.ndarray, "h w"]:
    """Reduce a ΔE map by the maximum over all values in a pixel: a small map must not hide a bad pixel."""
    if size == delta_e.shape:
        return delta_e
    largest = np.where(np.isnan(delta_e), -1.0, delta_e)
    for axis, (length, wanted) in enumerate(zip(delta_e.shape, size, strict=True)):
        lines = np.moveaxis(largest, axis, 0)
        touched = [lines[one * length // wanted : -(-(one + 1) * length // wanted)] for one in range(wanted)]
        largest = np.moveaxis(np.stack([some.max(axis=0) for some in touched]), 0, axis)
    return np.where(largest < 0.0, np.nan, largest)


def _shares(length: int, wanted: int) -> Float[np.ndarray, "wanted length"]:
    """Compute the weight of each of `length` pixels in each of `wanted` equal parts of a line."""
    first = np.arange(wanted)[:, None] * length / wanted
    pixel = np.arange(length)
    covered = np.minimum(pixel + 1, first + length / wanted) - np.maximum(pixel, first)
    return np.maximum(covered, 0.0) * wanted / length


def mask_png(mask: UInt8[np.ndarray, "H W"], size: tuple[int, int] | None = None) -> bytes:
    """Encode a mask as a PNG that is transparent where it is 0; reduced to `size` without losing small parts."""
    from PIL import Image

    bits = np.zeros(mask.shape if size is None else size, dtype=np.uint8)
    for bit in (1, 2, 4):
        chosen = (mask & bit > 0).astype(np.float64)
        bits |= (bit * (chosen if size is None else reduce_map(chosen, size))).astype(np.uint8)
    image = Image.fromarray(bits, "P")
    # Two bits a pixel where they are enough, as nearly always.
    depth = 2 if bits.max(initial=0) < 4 else 4
    steps = np.linspace(0, 255, 1 << depth).astype(np.uint8)
    image.putpalette(np.repeat(steps, 3).tolist())
    stream = io.BytesIO()
    image.save(stream, "PNG", transparency=b"\x00" + b"\xff" * (len(steps) - 1), bits=depth, optimize=False)
    return stream.getvalue()


def lossless(rgb: UInt8[np.ndarray, "H W c"]) -> bytes:
    """Encode RGB or RGBA as a WebP file that decodes to exactly these code values."""
    from PIL import Image

    stream = io.BytesIO()
    # Effort 3 of 6 takes a tenth off effort 1; effort 4 takes one or two per cent more, in nearly twice the time.
    Image.fromarray(np.ascontiguousarray(rgb)).save(stream, "WEBP", lossless=True, method=3, quality=75, exact=True)
    return stream.getvalue()


def data_uri(picture: bytes, kind: str = "webp") -> str:
    """Return the picture, a file of that kind, as text for an `src` attribute."""
    return f"data:image/{kind};base64,{base64.b64encode(picture).decode('ascii')}"


def curve_path(
    wavelengths_nm: Float[np.ndarray, "L"],
    values: Float[np.ndarray, "L"],
    domain: tuple[float, float],
    top: float,
    size: tuple[float, float],
) -> str:
    """Make the SVG path of a spectrum in a box of `size`: `domain` nm across, 0 to `top` upwards, with gaps."""
    width, height = size
    x = (wavelengths_nm - domain[0]) / (domain[1] - domain[0]) * width
    y = height * (1.0 - values / top)
    words, pen_down = [], False
    for across, down in zip(x, y, strict=True):
        if not math.isfinite(down):
            pen_down = False
            continue
        words.append(f"{'L' if pen_down else 'M'}{across:.1f} {down:.1f}")
        pen_down = True
    return "".join(words)


def pair_plot(
    wavelengths_nm: Float[np.ndarray, "L"],
    first: Float[np.ndarray, "L"],
    second: Float[np.ndarray, "L"],
    size: tuple[float, float],
) -> dict[str, Any]:
    """Plot two spectra on one axis, which ends at the smallest round number above both."""
    highest = float(np.nanmax([first, second], initial=1e-6))
    decade = 10.0 ** math.floor(math.log10(highest))
    top = next(step * decade for step in (1.0, 2.0, 5.0, 10.0) if highest <= step * decade)
    low, high = float(wavelengths_nm[0]), float(wavelengths_nm[-1])
    paths = [curve_path(wavelengths_nm, np.maximum(one, 0.0), (low, high), top, size) for one in (first, second)]
    return {"first": paths[0], "second": paths[1], "top": f"{top:g}", "low": f"{low:g}", "high": f"{high:g}"}


def spectrum_plot(
    wavelengths_nm: Float[np.ndarray, "L"], values: Float[np.ndarray, "L"], label: str, size: tuple[float, float]
) -> dict[str, Any]:
    """Return curve and ticks of one spectrum; the axis ends at 1 unless the curve is very low or exceeds it."""
    width, height = size
    first, last = float(wavelengths_nm[0]), float(wavelengths_nm[-1])
    highest = float(np.nanmax(values, initial=0.0))
    top = next((step for step in (0.1, 0.25, 0.5, 1.0) if highest <= 0.95 * step), math.ceil(highest * 2.0) / 2.0)
    if 0.0 < highest < 0.01:
        # The power of a light, in whatever unit: a reflectance is hardly ever as low.
        decade = 10.0 ** math.floor(math.log10(highest))
        top = next((step * decade for step in (1.0, 2.0, 5.0) if highest <= step * decade), 10.0 * decade)
    ticks = range(math.ceil(first / 100.0) * 100, math.floor(last / 100.0) * 100 + 1, 100)
    return {
        "label": label,
        "path": curve_path(wavelengths_nm, values, (first, last), top, size),
        "width": width,
        "height": height,
        "x_ticks": [((tick - first) / (last - first) * width, tick) for tick in ticks],
        "y_ticks": [(height * (1.0 - part), f"{part * top:g}") for part in (0.0, 0.5, 1.0)],
        "first": first,
        "last": last,
    }
