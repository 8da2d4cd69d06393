"""PNG files with 8 or 16 bits per channel and colour tags.

Standard displays are tagged by code points (chunk `cICP`), others by an ICC profile (`iCCP`): the given one, or a
matrix with curves derived from displayed colours.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt

from ...calibration.display.aim import PICTURE_WHITE_XYZ
from ...calibration.display.claims import CLAIMS, Claim
from ...calibration.display.icc import D50_XYZ, ENTRIES, encoded_profile
from ...runtime.errors import InputError
from ...runtime.files import written_whole
from ...spectral.adaptation import adaptation_matrix
from ...spectral.difference import delta_e_xyz
from ...spectral.formats.png_writer import png_bytes
from .transform import DisplayTransform

Chunks = list[tuple[bytes, bytes]]
# Luminance of white, cd/m2, of OpenColorIO's HDR displays, and peaks of the two HDR curves.
_REFERENCE, _PQ_PEAK, _HLG_PEAK = 100.0, 10000.0, 1000.0
# ΔE94 within which a display matches a standard; and mean ΔE94 of a profile above which it is useless.
_IS_STANDARD, _OF_NO_USE = 0.1, 2.0
# Largest ΔE94 of a profile without a note.
_SAID_FROM = 0.5
_REC_2020 = np.array([[0.708, 0.292], [0.17, 0.797], [0.131, 0.046]])


def _pq(codes: np.ndarray) -> np.ndarray:
    """Decode SMPTE ST 2084 to luminance relative to the reference white."""
    m1, m2, c1, c2, c3 = 2610 / 16384, 2523 / 32, 3424 / 4096, 2413 / 128, 2392 / 128
    root = codes ** (1.0 / m2)
    # c2 - c3 root is at least c2 - c3 = 0.16.
    return (np.maximum(root - c1, 0.0) / (c2 - c3 * root)) ** (1.0 / m1) * _PQ_PEAK / _REFERENCE


def _hlg(codes: np.ndarray) -> np.ndarray:
    """Decode ITU-R BT.2100-2, table 5, to the luminance of a display of 1,000 cd/m2, relative to the white."""
    a, b, c = 0.17883277, 0.28466892, 0.55991073
    scene = np.where(codes <= 0.5, codes**2 / 3.0, (np.exp((codes - c) / a) + b) / 12.0)
    luminance = scene @ np.array([0.2627, 0.6780, 0.0593])
    return scene * luminance[:, None] ** 0.2 * _HLG_PEAK / _REFERENCE


# Standard displays, with the code points of primaries and transfer (ITU-T H.273).
_SRGB, _P3 = CLAIMS["sRGB"], CLAIMS["P3"]
_STANDARDS = (
    (_SRGB, (1, 13)),
    (_P3, (12, 13)),
    (Claim("PQ", _REC_2020, _pq), (9, 16)),
    (Claim("PQ of P3", _P3.primaries, _pq), (12, 16)),
    (Claim("HLG", _REC_2020, _hlg), (9, 18)),
)


def quantise(rgb: Float[np.ndarray, "H W 3"], bits: int = 8) -> UInt[np.ndarray, "H W 3"]:
    """Round display-encoded RGB in [0, 1] to the nearest code value of 8 or 16 bits."""
    if bits not in (8, 16):
        raise InputError("a PNG holds 8 or 16 bits a channel", field="bits", found=bits, expected="8 or 16")
    top = (1 << bits) - 1
    codes = np.rint(np.clip(rgb.astype(np.float64), 0.0, 1.0) * top)
    return codes.astype(np.uint8 if bits == 8 else np.uint16)


def write_png(
    path: str | Path,
    rgb: Float[np.ndarray, "H W 3"],
    *,
    bits: int = 8,
    display: DisplayTransform | None = None,
    words: Sequence[str] = (),
) -> tuple[str, ...]:
    """Write display-encoded RGB as a PNG atomically, through a temporary file.

    It is tagged by the colours of codes on `display`, with `words` as its description. Returns notes on the tag.
    """
    chunks, said = colour_chunks(display) if display else ([], ())
    if words:
        chunks = [*chunks, (b"iTXt", b"Description\x00\x00\x00\x00\x00" + "\n".join(words).encode("utf-8"))]
    with written_whole(path) as beside:
        beside.write_bytes(png_bytes(quantise(rgb, bits), chunks))
    return said


def colour_chunks(display: DisplayTransform) -> tuple[Chunks, tuple[str, ...]]:
    """Return the PNG chunks that define the colours of a display's codes, and notes.

    `cICP` (ISO/IEC 15948:2024, 11.3.2.6) for a standard, with `sRGB` for that one; else `iCCP`.
    """
    if display.profile is not None:
        return _embedded(display.profile.name, display.profile.data), ()
    return _made_chunks(display)


@lru_cache(maxsize=8)
def _made_chunks(display: DisplayTransform) -> tuple[Chunks, tuple[str, ...]]:
    """Derive the chunks from displayed colours, cached per display."""
    steps = np.linspace(0.0, 1.0, 5)
    codes = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    try:
        shown = display.shown(codes).astype(np.float64)
    except InputError:
        return [], (f"The picture has no colour tag: {display.name} cannot say what its codes show.",)
    for standard, points in _STANDARDS:
        if delta_e_xyz(standard.xyz(codes), shown, PICTURE_WHITE_XYZ).max() <= _IS_STANDARD:
            named = (b"cICP", bytes([*points, 0, 1]))
            if standard is _SRGB:
                return [named, (b"sRGB", b"\x01")], ()
            # The profile is for readers without support of code points; HDR has none.
            return [named, *(_matrix_tag(display, codes, shown)[0] if standard is _P3 else [])], ()
    return _matrix_tag(display, codes, shown)


def _matrix_tag(
    display: DisplayTransform, codes: Float[np.ndarray, "N 3"], shown: Float[np.ndarray, "N 3"]
) -> tuple[Chunks, tuple[str, ...]]:
    """Make a matrix-and-curves profile from `shown`, XYZ-D65 of `codes`, without black, with the image white as D50."""
    ramp = np.linspace(0.0, 1.0, ENTRIES)
    black = display.shown(np.zeros((1, 3)))[0].astype(np.float64)
    columns, curves = np.empty((3, 3)), np.empty((3, ENTRIES))
    for channel in range(3):
        light = display.shown(ramp[:, None] * np.eye(3)[channel]).astype(np.float64) - black
        columns[channel] = light[-1]
        # A channel without light has no curve.
        size = light[-1] @ light[-1]
        curves[channel] = np.clip(light @ light[-1] / size, 0.0, 1.0) if size > 0.0 else ramp
    told = np.stack([np.interp(codes[:, at], ramp, curves[at]) for at in range(3)], axis=1) @ columns
    off = delta_e_xyz(shown, told, PICTURE_WHITE_XYZ)
    if off.mean() > _OF_NO_USE or columns.sum(axis=0).max() > 1.9:
        return [], (
            f"The picture has no colour tag: a matrix and curves tell what {display.name} shows to ΔE94 "
            f"{off.mean():.1f} on average, {off.max():.1f} at most; other programs will take it for sRGB.",
        )
    columns = columns @ adaptation_matrix(PICTURE_WHITE_XYZ, D50_XYZ).T
    data = encoded_profile(display.name, PICTURE_WHITE_XYZ, columns, curves)
    if off.max() <= _SAID_FROM:
        return _embedded(display.name, data), ()
    said = f"ΔE94 {off.mean():.2f} on average, {off.max():.2f} at most"
    return _embedded(display.name, data), (
        f"The profile in the picture is a matrix with curves, off by {said} from what {display.name} shows.",
    )


def _embedded(name: str, profile: bytes) -> Chunks:
    """Return the chunk of a profile; names have 1 to 79 Latin-1 letters, without spaces at their ends."""
    latin = " ".join(name.encode("latin-1", "replace").decode("latin-1").split())[:79].strip()
    latin = "".join(letter for letter in latin if letter.isprintable()) or "display"
    return [(b"iCCP", latin.encode("latin-1") + b"\0\0" + zlib.compress(profile, 9))]
