"""Pictures that hold a property of a material for each texel: decoded in full depth, and within bounds."""

from __future__ import annotations

import hashlib
import io
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any, Literal, NoReturn

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...runtime.private_folder import file_of
from ...spectral.formats.exr import MAGIC as EXR_MAGIC
from ...spectral.formats.exr import ExrPicture, read_picture
from ...spectral.formats.picture_header import exr_colours, is_srgb, other_than_srgb, profile_of
from ...spectral.srgb import srgb_to_linear

Encoding = Literal["sRGB", "linear"]

#: 8192 x 8192; a larger picture would take gigabytes once it is decoded.
MOST_TEXELS = 1 << 26
FORMATS = ("PNG", "JPEG", "WEBP", "TIFF", "BMP", "AVIF")
# First bytes of a JPEG; its header tells all that is asked before its pixels, so that it is opened once.
_JPEG = b"\xff\xd8"
_MODES = ("1", "L", "LA", "RGB", "RGBA", "P", "PA", "I;16", "I;16B", "I;16L", "I;16N", "I", "F")
_BLOCK = 1 << 16
_TOO_LARGE, _SMALLER = "too large a picture", "save the picture smaller"
_PROFILE = "the {} map carries a colour profile of its own, which is not applied: it is taken as {}"
_TURNED = (
    "the {} map says that it is to be turned (Exif, orientation {}), which is not applied: it is laid as it is stored"
)
# Exif tag of a picture's orientation; 1 is upright.
_ORIENTATION, _UPRIGHT = 0x0112, 1
_STATED = "the {} map says {}, which is not applied: it is taken as {}"
_AGAIN = "the picture is damaged or cut short: save or copy it again"


@dataclass(frozen=True)
class _Header:
    """Header of a picture's file.

    mode : Pillow's name for the kind of its values. halved : True if only 8 bits of 16 can be read, grey with alpha.
    stated : what it says of its colours beside a profile that is not sRGB, in words. orientation : Exif's number.
    """

    size: tuple[int, int]
    mime: str
    mode: str
    profile: bytes
    halved: bool
    stated: tuple[str, ...]
    orientation: int


@dataclass(frozen=True, eq=False)
class Texture:
    """One map of a material.

    Parameters
    ----------
    slot : property in it: "base_color", "roughness", "normal", ...
    data : the file as it came.
    encoding : how its colours are encoded: "sRGB" (IEC 61966-2-1) or "linear"; alpha and floats always are linear.
    file, field : its place, for messages.
    """

    slot: str
    data: bytes
    encoding: Encoding
    file: Path
    field: str

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the file."""
        return hashlib.sha256(self.data).hexdigest()

    @property
    def mime(self) -> str:
        """MIME type of the file, such as "image/png"; raises `InputError` if it is not a supported picture."""
        return "image/x-exr" if self._exr else self._header.mime

    @cached_property
    def size(self) -> tuple[int, int]:
        """(H, W)."""
        return self.values.shape[:2] if self._exr else self._header.size

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on assumptions about the picture."""
        coloured = self.encoding == "sRGB"
        if self._exr:
            stated = ", ".join(exr_colours(self._exr_picture.attributes)) if coloured else ""
            return (_STATED.format(self.slot, stated, "linear, of the primaries of sRGB"),) if stated else ()
        notes = [f"the {self.slot} map has 16 bits, of which 8 are averaged"] if self._header.halved else []
        if self._header.orientation != _UPRIGHT:
            notes.append(_TURNED.format(self.slot, self._header.orientation))
        taken = "linear, of the primaries of sRGB" if self.floating else "sRGB"
        if coloured and self._header.profile and not is_srgb(self._header.profile):
            notes.append(_PROFILE.format(self.slot, taken))
        if coloured and self._header.stated:
            notes.append(_STATED.format(self.slot, ", ".join(self._header.stated), taken))
        return tuple(notes)

    @property
    def floating(self) -> bool:
        """True if values are floats; raises `InputError` as `mime` does."""
        return self._exr or self._header.mode == "F"

    @cached_property
    def values(self) -> np.ndarray:
        """(H, W, C) as stored, uint8, uint16 or float32; C is 1 grey, 2 with alpha, 3 colour, 4 with alpha.

        Raises
        ------
        InputError
            Not a picture that is read, more than `MOST_TEXELS`, cut short; floats that are NaN or infinite.
        """
        values = self._exr_values() if self._exr else self._decoded()
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            self._refuse("not a finite number", "NaN or infinity", "finite values", "save the map without such texels")
        return values

    def band(self, number: int, rows: slice, size: tuple[int, int] | None = None) -> Float[np.ndarray, "h W"]:
        """Return one channel, 0 red to 3 alpha, as fractions; grey serves as every colour, and a missing alpha is 1.

        rows : of a picture of `size`, which this one is laid over, each of its texels covering several; None: its own.
        """
        channels = self.values.shape[2]
        chosen = self._laid_over(rows, size or self.size)
        if number == 3:
            return _fractions(chosen[..., -1]) if channels in (2, 4) else np.ones(chosen.shape[:2])
        return _fractions(chosen[..., number if channels >= 3 else 0])

    def linear(self, rows: slice, size: tuple[int, int] | None = None) -> Float[np.ndarray, "h W 3"]:
        """Return linear red, green and blue; `rows` and `size` as in `band`."""
        return linear_of_codes(self._laid_over(rows, size or self.size), self.encoding)

    def _laid_over(self, rows: slice, size: tuple[int, int]) -> np.ndarray:
        if size == self.size:
            return self.values[rows]
        down = np.arange(rows.start, rows.stop) * self.size[0] // size[0]
        return self.values[down][:, np.arange(size[1]) * self.size[1] // size[1]]

    @property
    def _formats(self) -> tuple[str, ...]:
        # A TGA has no mark of its own: any bytes may pass for one.
        return (*FORMATS, "TGA") if self.file.suffix.lower() == ".tga" else FORMATS

    @property
    def _exr(self) -> bool:
        return self.data.startswith(EXR_MAGIC)

    @cached_property
    def _exr_picture(self) -> ExrPicture:
        with file_of(self.data, "map.exr") as copy:
            try:
                return read_picture(copy, MOST_TEXELS * 4)
            except InputError as reason:
                found, expected = reason.found, reason.expected or "a whole OpenEXR picture"
                self._refuse(reason.problem, found, expected, reason.hint or _AGAIN)

    def _exr_values(self) -> np.ndarray:
        picture = self._exr_picture
        names = {name.rpartition(".")[2].upper(): name for name in reversed(list(picture.channels))}
        wanted = next((set_ for set_ in ("RGBA", "RGB", "YA", "Y") if set(set_) <= set(names)), "")
        only = tuple(picture.channels) if len(picture.channels) == 1 else tuple(names[letter] for letter in wanted)
        if not only:
            found = ", ".join(list(picture.channels)[:6]) or "no channels"
            self._refuse("not a colour or grey picture", found, "channels R, G, B or Y", "save the map as RGB")
        planes = [picture.channels[name].astype(np.float32) for name in only]
        if len({plane.shape for plane in planes}) > 1:
            self._refuse("channels of different sizes", f"{planes[0].shape} and others", "one size", "save it as RGB")
        return np.stack(planes, axis=-1)

    @cached_property
    def _header(self) -> _Header:
        """Header of the file, read before the pixels, within bounds."""
        from PIL import Image

        with _guarded(self), Image.open(io.BytesIO(self.data), formats=self._formats) as picture:
            return self._header_of(picture)

    def _header_of(self, picture: Any) -> _Header:
        from PIL import Image

        width, height = picture.size
        profile = profile_of(picture, self.data)
        halved = _raw_mode(picture).startswith("LA;16")
        mode, mime = picture.mode, Image.MIME.get(str(picture.format), "image/x-tga")
        stated = other_than_srgb(picture, self.data)
        orientation = _UPRIGHT
        if picture.format != "TIFF":  # Pillow turns TIFFs
            with suppress(Exception):  # Exif that is damaged is no reason not to read the picture
                orientation = int(picture.getexif().get(_ORIENTATION, _UPRIGHT))
        if width * height > MOST_TEXELS:
            expected = f"at most {MOST_TEXELS} texels, such as 8192 x 8192"
            self._refuse(_TOO_LARGE, f"{width} x {height}", expected, _SMALLER)
        if mode not in _MODES:
            hint = "save it as RGB, with 8 or 16 bits a channel"
            self._refuse("colours of an unknown kind", mode, "grey or RGB", hint)
        return _Header((height, width), mime, mode, profile, halved, stated, orientation)

    def _decoded(self) -> np.ndarray:
        from PIL import Image

        if not self.data.startswith(_JPEG):
            _ = self._header
        with _guarded(self):
            with Image.open(io.BytesIO(self.data), formats=self._formats) as picture:
                if "_header" not in vars(self):
                    vars(self)["_header"] = self._header_of(picture)
                key, mode, raw = picture.info.get("transparency"), picture.mode, _raw_mode(picture)
                fine = raw.startswith(("RGB;16", "RGBA;16", "RGBX;16"))
                # A key of 16 bits is looked for among values of 16 bits.
                keyed = key is not None and mode in ("1", "L", "RGB") and not fine
                if _is_planar(picture) and mode in ("RGB", "RGBA"):
                    hint = "save it with interleaved channels, or as PNG"
                    self._refuse("one plane a channel, of 16 bits", "a planar TIFF", "interleaved channels", hint)
                white_is_0 = getattr(picture, "tag_v2", {}).get(262) == 0
                if picture.format == "TIFF" and (mode == "I" or (mode == "F" and white_is_0)):
                    found = "white as 0, in floats" if mode == "F" else "a sign, or 32 bits"
                    self._refuse("whole numbers on no scale", found, "8 or 16 bits, or floats", "save it with 16 bits")
                high = np.asarray(picture.convert("RGBA") if keyed or mode in ("P", "PA") else picture)
            if fine:
                with Image.open(io.BytesIO(self.data), formats=self._formats) as picture:
                    picture.tile = [tile._replace(args=_other_end(tile.args)) for tile in picture.tile]
                    high = (high.astype(np.uint16) << 8) | np.asarray(picture)
        if high.dtype == bool:
            high = high.astype(np.uint8) * np.uint8(255)
        if high.dtype.kind in "iu" and high.dtype.itemsize > 1:
            high = high.astype(np.uint16)
        if raw.startswith("I;12"):
            high = (high << 4) | (high >> 8)
        if high.dtype == np.uint16 and white_is_0:
            high = np.uint16(65535) - high
        high = high[..., None] if high.ndim == 2 else high
        if key is not None and high.dtype == np.uint16:
            there = (high != np.asarray(key)).any(axis=-1, keepdims=True)
            high = np.concatenate([high, there * np.uint16(65535)], axis=-1)
        return high

    def _refuse(self, problem: str, found: object, expected: str, hint: str) -> NoReturn:
        raise InputError(problem, file=self.file, field=self.field, found=found, expected=expected, hint=hint)


@contextmanager
def _guarded(texture: Texture) -> Iterator[None]:
    """Convert any failure on a picture's bytes within the context to an `InputError` that names it."""
    from PIL import Image

    place = {"file": texture.file, "field": texture.field}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except Image.DecompressionBombError as reason:
        expected = f"at most {MOST_TEXELS} texels, such as 8192 x 8192"
        found = str(reason).split(",")[0]
        raise InputError(_TOO_LARGE, **place, found=found, expected=expected, hint=_SMALLER) from None
    except InputError:
        raise
    except Exception as reason:  # Pillow's readers let any exception out where bytes are not what they say
        known = ", ".join((*FORMATS, "OpenEXR"))
        found = "no picture of a known format" if isinstance(reason, Image.UnidentifiedImageError) else str(reason)
        problem = "the picture cannot be read"
        raise InputError(problem, **place, found=found[:160], expected=known, hint=_AGAIN) from None


def linear_of_codes(codes: np.ndarray, encoding: Encoding) -> Float[np.ndarray, "*batch 3"]:
    """Decode (..., C) values, as in `Texture.values`, to linear red, green and blue."""
    chosen = codes[..., :3] if codes.shape[-1] >= 3 else np.repeat(codes[..., :1], 3, axis=-1)
    if encoding == "linear" or chosen.dtype.kind == "f":
        return _fractions(chosen)
    return _linear_codes(8 * chosen.dtype.itemsize)[chosen]


@cache
def _linear_codes(bits: int) -> Float[np.ndarray, " codes"]:
    """Tabulate the linear light of every sRGB code: one power per code rather than per texel."""
    return srgb_to_linear(np.arange(1 << bits) / ((1 << bits) - 1))


def blocks(height: int, width: int) -> list[slice]:
    """Divide the rows of a picture into slices of some 65 000 texels, whose floats fit into a processor's cache."""
    step = max(1, _BLOCK // max(1, width))
    return [slice(start, min(start + step, height)) for start in range(0, height, step)]


def _fractions(values: np.ndarray) -> np.ndarray:
    return values.astype(np.float64) / (np.iinfo(values.dtype).max if values.dtype.kind == "u" else 1.0)


def _raw_mode(picture: object) -> str:
    tiles = getattr(picture, "tile", None) or [None]
    args = getattr(tiles[0], "args", None)
    return str(args[0] if isinstance(args, tuple) and args else args)


def _is_planar(picture: object) -> bool:
    """Return True for a TIFF of separate planes of more than 8 bits, which Pillow would mix up."""
    tags = getattr(picture, "tag_v2", {})
    return tags.get(284) == 2 and max(tags.get(258, (8,))) > 8


def _other_end(args: object) -> object:
    """Return arguments of Pillow's decoder that select the other byte of 16-bit values; it keeps only the first."""
    mode = str(args[0] if isinstance(args, tuple) else args)
    native = "L" if sys.byteorder == "little" else "B"
    end = mode[-1] if mode[-1] in "BL" else native
    turned = mode[:-1] + ("L" if end == "B" else "B")
    return (turned, *args[1:]) if isinstance(args, tuple) else turned
