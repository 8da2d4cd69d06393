"""Colours that the header of a picture states: curves and primaries that are not sRGB's, and its ICC profile."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import lru_cache
from typing import Any

import numpy as np

from ..srgb import srgb_to_linear

# ITU-T H.273, tables 2 and 3; those of sRGB, and "unspecified", need no words.
_PRIMARIES = {4: "BT.470 M", 5: "BT.470 B/G", 6: "BT.601", 7: "SMPTE 240M", 8: "film", 9: "BT.2020", 10: "XYZ"}
_PRIMARIES |= {11: "DCI P3", 12: "Display P3", 22: "EBU 3213"}
_CURVES = {1: "the curve of BT.709", 4: "gamma 2.2", 5: "gamma 2.8", 6: "the curve of BT.601", 7: "SMPTE 240M"}
_CURVES |= {8: "linear", 9: "logarithmic", 10: "logarithmic", 11: "xvYCC", 14: "the curve of BT.2020"}
_CURVES |= {15: "the curve of BT.2020", 16: "PQ", 17: "gamma 2.6", 18: "HLG"}
_SRGB_PRIMARIES, _SRGB_CURVE, _UNSAID = 1, 13, 2
#: Red, green, blue and white of sRGB (IEC 61966-2-1), x and y.
SRGB_XY = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
# Headers hold chromaticities of three or four digits, and gamma as 1/2.2 for the curve of sRGB.
_XY_OFF, _GAMMA_OFF, _SRGB_GAMMA = 0.002, 0.02, 1 / 2.2
# Linear light of a gamma of 2.2 is off by 0.009 from that of sRGB, with primaries of BT.601 by 0.06, of P3 by 0.15.
_LIGHT_OFF = 0.02
_TORN_PROFILE = "a colour profile that cannot be read"
#: Beginnings of words on pictures for displays of high dynamic range: their codes are no sRGB of any sort.
HDR_LIGHT = "light of an HDR display"
HDR = (HDR_LIGHT, "PQ (", "HLG (")
# Mastering display and light levels (PNG 3, sections 11.3.2.7 and 11.3.2.8), also as drafts spelt them.
_HDR_CHUNKS = {b"mDCV", b"mDCv", b"cLLI", b"cLLi"}
_TGA_END = b"TRUEVISION-XFILE.\0"
_EXIF, _INTEROPERABILITY = 0x8769, 0xA005
_COLOUR_SPACE, _GAMMA, _WHITE, _PRIMARIES_TAG, _TRANSFER = 0xA001, 0xA500, 318, 319, 301


def other_than_srgb(picture: Any, data: bytes) -> tuple[str, ...]:
    """Words for each thing that the header of a picture states and that is not sRGB.

    Parameters
    ----------
    picture : the same picture, opened by Pillow.
    data : the file: PNG (cICP, iCCP, sRGB, gAMA, cHRM), AVIF (nclx), BMP, TGA, and whatever has Exif or TIFF's tags.
    """
    profiled = bool(picture.info.get("icc_profile"))
    if data.startswith(b"\x89PNG"):
        found = list(_of_png(dict(_png_chunks(data)), profiled))
    elif data[4:12] in (b"ftypavif", b"ftypavis"):
        place = data.find(b"colrnclx")
        codes = struct.unpack_from(">HH", data, place + 8) if 0 <= place <= len(data) - 12 else ()
        found = list(_of_codes(*codes, "nclx")) if codes else []
    elif data.startswith(b"\xff\xd8"):
        found = [_TORN_PROFILE] if b"ICC_PROFILE\0" in data and not profiled else []
    elif data.endswith(_TGA_END):
        found = list(_of_tga(data))
    else:
        found = list(_of_bmp(data)) if data.startswith(b"BM") else []
    with suppress(Exception):  # Exif that is damaged is no reason not to read the picture
        found += _of_tags(picture, data)
    return tuple(dict.fromkeys(found))


def profile_of(picture: Any, data: bytes) -> bytes:
    """Return the ICC profile that a picture's colours are by; empty where it has none, or cICP stands above it (PNG 3,
    section 12.1).
    """
    profile = picture.info.get("icc_profile")
    return profile if isinstance(profile, bytes) and _UNSAID in _code_points(data) else b""


def names_srgb(picture: Any, data: bytes) -> bool:
    """Return whether the header of a PNG says that its codes are sRGB's: by cICP, a profile or the chunk of that name.

    What else it says is not asked: see `other_than_srgb`.
    """
    if _UNSAID not in (codes := _code_points(data)):
        return codes == (_SRGB_PRIMARIES, _SRGB_CURVE)
    profile = profile_of(picture, data)
    return is_srgb(profile) if profile else "srgb" in picture.info


def _code_points(data: bytes) -> tuple[int, int]:
    """Return the numbers of primaries and curve that a PNG's cICP states."""
    coded = dict(_png_chunks(data)).get(b"cICP", b"") if data.startswith(b"\x89PNG") else b""
    return (coded[0], coded[1]) if len(coded) == 4 else (_UNSAID, _UNSAID)


@lru_cache(maxsize=64)
def is_srgb(profile: bytes) -> bool:
    """Return whether an ICC profile gives codes the colours that sRGB gives them, whatever it calls itself.

    Colours are compared in linear light, within what tells a gamma of 2.2 from the curve of sRGB. A profile that cannot
    be read is none of sRGB.
    """
    from PIL import Image, ImageCms

    steps = np.linspace(0, 255, 6).astype(np.uint8)
    try:
        stated = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        grey = stated.profile.xcolor_space == "GRAY"
        codes = steps[None] if grey else np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(1, -1, 3)
        picture, srgb = Image.fromarray(codes), ImageCms.createProfile("sRGB")
        intent = ImageCms.Intent.RELATIVE_COLORIMETRIC
        transform = ImageCms.buildTransform(stated, srgb, picture.mode, "RGB", renderingIntent=intent)
        shown = np.asarray(ImageCms.applyTransform(picture, transform))
    except (ImageCms.PyCMSError, OSError, ValueError):
        return False
    meant = codes[..., None] if grey else codes
    return bool(np.abs(srgb_to_linear(shown / 255.0) - srgb_to_linear(meant / 255.0)).max() <= _LIGHT_OFF)


def exr_colours(attributes: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the same of the attributes of an OpenEXR file, whose colours are taken to be linear sRGB."""
    said = []
    xy = attributes.get("chromaticities")
    if xy is not None:
        said += _of_xy([float(value) for value in _flat(xy)], "chromaticities")
    name = attributes.get("colorInteropID")
    if isinstance(name, str) and name not in ("", "data", "unknown") and not name.startswith("lin_rec709"):
        said.append(f"{name} (colorInteropID)")
    if attributes.get("acesImageContainerFlag") and xy is None:
        said.append("primaries of ACES (acesImageContainerFlag)")
    return tuple(said)


def _flat(values: Any) -> Iterator[Any]:
    """Yield the numbers of chromaticities, whether they come in pairs or in a row."""
    for value in values if hasattr(values, "__iter__") else (values,):
        if hasattr(value, "__iter__"):
            yield from value
        else:
            yield value


def _png_chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Return the chunks of few bytes; the first of a kind comes last."""
    found, at = [], 8
    while at + 8 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        if kind != b"IDAT":
            found.append((kind, data[at + 8 : at + 8 + length]))
        at += 12 + length
    return reversed(found)


def _of_png(chunks: dict[bytes, bytes], profiled: bool) -> Iterator[str]:
    """Yield words on PNG chunks, in the order in which the specification (PNG 3, section 12.1) lets one stand for all.

    profiled : whether there is a profile that can be unpacked.
    """
    coded = chunks.get(b"cICP", b"")
    coded = coded if len(coded) == 4 else bytes([_UNSAID, _UNSAID, 0, 1])
    yield from _of_codes(coded[0], coded[1], "cICP")
    if coded[1] == _UNSAID and (levels := _HDR_CHUNKS & chunks.keys()):
        yield f"{HDR_LIGHT}, and not by which curve ({', '.join(sorted(key.decode() for key in levels))})"
    if coded[2]:
        yield f"brightness and colour apart, by matrix number {coded[2]} (cICP)"
    if not coded[3]:
        yield "numbers of video range (cICP)"
    if profiled or _UNSAID not in coded[:2]:
        return
    if b"iCCP" in chunks:
        yield _TORN_PROFILE
    beside = " beside sRGB" if b"sRGB" in chunks else ""
    if coded[1] == _UNSAID and len(gamma := chunks.get(b"gAMA", b"")) == 4:
        yield from (words + beside for words in _of_gamma(int.from_bytes(gamma, "big") / 100_000, "gAMA"))
    if coded[0] == _UNSAID and len(xy := chunks.get(b"cHRM", b"")) == 32:
        white_first = [value / 100_000 for value in struct.unpack(">8I", xy)]
        yield from (words + beside for words in _of_xy(white_first[2:] + white_first[:2], "cHRM"))


def _of_codes(primaries: int, curve: int, source: str) -> Iterator[str]:
    if primaries not in (_SRGB_PRIMARIES, _UNSAID):
        yield f"primaries of {_PRIMARIES.get(primaries, f'number {primaries}')} ({source})"
    if curve not in (_SRGB_CURVE, _UNSAID):
        yield f"{_CURVES.get(curve, f'curve number {curve}')} ({source})"


def _of_gamma(exponent: float, source: str) -> Iterator[str]:
    """Yield words on the exponent that encodes light: 1 is linear, 1/2.2 as good as sRGB; 0 says nothing."""
    if exponent > 0.0 and abs(exponent - _SRGB_GAMMA) > _GAMMA_OFF:
        yield f"linear ({source} 1)" if exponent == 1.0 else f"gamma {1 / exponent:.3g} ({source} {exponent:g})"


def _of_xy(xy: list[float], source: str) -> Iterator[str]:
    if any(xy) and (len(xy) != 8 or any(abs(a - b) > _XY_OFF for a, b in zip(xy, SRGB_XY, strict=True))):
        pairs = ", ".join(f"{x:.4g} {y:.4g}" for x, y in zip(xy[::2], xy[1::2], strict=False))
        yield f"primaries and white {pairs} ({source})"


def _of_bmp(data: bytes) -> Iterator[str]:
    """Yield words on BMP headers with a colour space (BITMAPV4HEADER, 108 bytes, and BITMAPV5HEADER, 124)."""
    if len(data) < 14 + 108 or int.from_bytes(data[14:18], "little") < 108:
        return
    kind = data[70:74]
    if kind == b"\0\0\0\0":
        ends = [value / (1 << 30) for value in struct.unpack_from("<9i", data, 74)]
        gammas = [value / 65536 for value in struct.unpack_from("<3I", data, 110)]
        sums = [sum(ends[k : k + 3]) for k in (0, 3, 6)]
        if all(sums):
            xy = [
                value
                for k, total in zip((0, 3, 6), sums, strict=True)
                for value in (ends[k] / total, ends[k + 1] / total)
            ]
            white = [sum(ends[k::3]) for k in range(3)]
            yield from _of_xy([*xy, white[0] / sum(white), white[1] / sum(white)], "calibrated BMP")
        if all(gammas):
            yield from _of_gamma(1 / gammas[0], "calibrated BMP")
    elif kind in (b"DEBM", b"KNIL"):
        yield "a colour profile (BMP)"


def _of_tga(data: bytes) -> Iterator[str]:
    """Yield words on the gamma of a TGA of version 2, a ratio of two numbers in its extension area."""
    place = int.from_bytes(data[-26:-22], "little")
    if 0 < place <= len(data) - 482:
        above, below = struct.unpack_from("<HH", data, place + 478)
        if above and below:
            yield from _of_gamma(below / above, "TGA")


def _of_tags(picture: Any, data: bytes) -> Iterator[str]:
    """Yield words on Exif and on TIFF's own tags."""
    tags = picture.getexif()
    if data.startswith(b"\x89PNG"):
        # It may stand behind the pixels, where Pillow has not been yet.
        tags.load(dict(_png_chunks(data)).get(b"eXIf", b""))
    if not tags:
        return
    exif = tags.get_ifd(_EXIF)
    space, other = exif.get(_COLOUR_SPACE), tags.get_ifd(_INTEROPERABILITY).get(1)
    if space == 2 or str(other).startswith("R03"):
        yield "Adobe RGB (Exif)"
    elif space == 0xFFFF and not picture.info.get("icc_profile"):
        yield "colours that are not sRGB (Exif: uncalibrated)"
    if exif.get(_GAMMA):
        yield from _of_gamma(1 / float(exif[_GAMMA]), "Exif")
    white, ends = tags.get(_WHITE), tags.get(_PRIMARIES_TAG)
    if ends is not None and len(ends) == 6:
        yield from _of_xy([*map(float, ends), *map(float, white or SRGB_XY[6:])], "TIFF")
    elif white is not None and len(white) == 2:
        yield from _of_xy([*SRGB_XY[:6], *map(float, white)], "TIFF")
    if tags.get(_TRANSFER) is not None:
        yield "a curve of its own (TIFF: TransferFunction)"
