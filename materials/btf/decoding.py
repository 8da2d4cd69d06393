"""Decoding of images into reflectance."""

from __future__ import annotations

import io
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float, Shaped

from ...runtime.errors import InputError, UnknownNameError
from ...runtime.private_folder import file_of
from ...spectral.basis import SpectralBasis
from ...spectral.formats.exr import MAGIC, read_picture
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.upsampling import upsampling, xyz_from_rgb
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..svbrdf.textures import MOST_TEXELS, Texture, linear_of_codes

#: Encoding of light in an image: the curve of sRGB; linear; linear, as X, Y and Z of CIE 1931.
Encoding = Literal["srgb", "linear", "xyz"]
#: The one way of making spectra that keeps sums of images sums of spectra, so that three coefficients hold them.
LINEAR_UPLIFT = "mallett-yuksel"


@dataclass(frozen=True, eq=False)
class Coding:
    """Encoding of images.

    encoding : see `Encoding`.
    white : (1,) or (C,) linear value of a perfect diffuser lit and viewed along its normal; 1 is full scale.
    includes_cosine : True if measured values fall with cos(theta_i), as in a photograph.
    channels : names of an OpenEXR image's channels, in the order of wavelengths, or red, green and blue; empty for
        other formats, whose images are red, green and blue, or grey if each is of one wavelength.

    Raises
    ------
    InputError : an unknown encoding, a white that is not positive.
    """

    encoding: str
    white: Float[np.ndarray, " C"]
    includes_cosine: bool = True
    channels: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.encoding not in get_args(Encoding):
            raise UnknownNameError("encoding", self.encoding, get_args(Encoding))
        white = np.atleast_1d(np.asarray(self.white, dtype=np.float64))
        object.__setattr__(self, "white", white)
        if white.ndim != 1 or not (np.isfinite(white).all() and (white > 0.0).all()):
            raise InputError("not a white", field="white", found=white.tolist(), expected="positive numbers")

    def linear(self, data: bytes, file: Path, grey: bool = False) -> Float[np.ndarray, "H W C"]:
        """Decode an image to linear values, red, green and blue if it has colours; float64, not divided by the white.

        file : for messages. grey : the image is of one wavelength, and C is 1.

        Raises
        ------
        InputError : an unsupported or truncated image, values that are not finite, floats declared as sRGB.
        """
        return self.decoded(self.codes(data, file, grey), grey)

    def codes(self, data: bytes, file: Path, grey: bool = False) -> Shaped[np.ndarray, "H W C"]:
        """Return an image's stored values in the precision of its file, the input of `decoded`. See `linear`."""
        return self._of_exr(data, file) if data.startswith(MAGIC) else self._of_picture(data, file, grey)

    def decoded(self, codes: Shaped[np.ndarray, "*batch C"], grey: bool = False) -> Float[np.ndarray, "*batch D"]:
        """Convert stored values (`codes`) of some texels to linear values; float64."""
        if codes.dtype.kind == "f":
            found = codes.astype(np.float64)
        else:
            found = linear_of_codes(codes, "sRGB" if self.encoding == "srgb" else "linear")
            found = found[..., :1] if grey else found
        return found @ np.linalg.inv(xyz_from_rgb()).T if self.encoding == "xyz" and not grey else found

    def _of_picture(self, data: bytes, file: Path, grey: bool) -> Shaped[np.ndarray, "H W C"]:
        values = Texture("image", data, "sRGB" if self.encoding == "srgb" else "linear", file, "image").values
        floating = values.dtype.kind == "f"
        if floating and self.encoding == "srgb":
            raise _encoded_floats(file)
        # Alpha is no light.
        colours = values[..., :3] if values.shape[2] >= 3 else values[..., :1]
        if grey and (colours != colours[..., :1]).any():
            expected = "grey, as one wavelength is"
            raise InputError(
                "an image in colour", file=file, field="image", found="red, green, blue", expected=expected
            )
        if floating and not grey:
            colours = np.broadcast_to(colours, (*colours.shape[:2], 3))
        return np.ascontiguousarray(colours[..., :1] if grey else colours)

    def _of_exr(self, data: bytes, file: Path) -> Shaped[np.ndarray, "H W C"]:
        if self.encoding == "srgb":
            raise _encoded_floats(file)
        with file_of(data, "image.exr") as copy:
            try:
                picture = read_picture(copy, MOST_TEXELS)
            except InputError as reason:
                raise reason.at(file=file) from None
        lacking = [name for name in self.channels if name not in picture.channels]
        if lacking or not self.channels:
            found, expected = ", ".join(list(picture.channels)[:6]), f"channels {', '.join(self.channels[:6])}"
            raise InputError("channels unlike those of the other images", file=file, found=found, expected=expected)
        planes = [picture.channels[name] for name in self.channels]
        if len({plane.shape for plane in planes}) > 1 or not all(np.isfinite(plane).all() for plane in planes):
            expected = "finite numbers, channels of one size"
            raise InputError("not an image", file=file, found="other channels", expected=expected)
        found = np.stack(planes, axis=-1)
        return found if found.dtype.kind == "f" else found.astype(np.float64)

    def reflected(
        self, linear: Float[np.ndarray, "*batch C"], cosine: float | Float[np.ndarray, "..."]
    ) -> Float[np.ndarray, "*batch C"]:
        """Convert linear values to f_r cos(theta_i), 1/sr; `cosine` is that of the light and broadcasts to them."""
        return linear * ((1.0 if self.includes_cosine else cosine) / (np.pi * self.white))

    def reflectance(
        self, codes: Shaped[np.ndarray, "*batch C"], cosine: float | Float[np.ndarray, "..."], grey: bool = False
    ) -> Float[np.ndarray, "*batch D"]:
        """Convert stored values to f_r cos(theta_i), 1/sr, float32; large arrays go through a table of all codes."""
        every, channels = 1 << 8 * codes.dtype.itemsize, codes.shape[-1]
        alike = codes.dtype.kind == "u" and self.includes_cosine and self.encoding != "xyz"
        if not alike or codes.size <= every * channels:
            return self.reflected(self.decoded(codes, grey), cosine).astype(np.float32)
        numbers = np.repeat(np.arange(every, dtype=codes.dtype)[:, None], channels, axis=1)
        table = self.reflectance(numbers, 1.0, grey)
        found = np.empty((*codes.shape[:-1], table.shape[1]), np.float32)
        for band in range(table.shape[1]):
            found[..., band] = table[:, band].take(codes[..., min(band, channels - 1)])
        return found

    def band(self, number: int) -> Coding:
        """Return the coding of one wavelength alone."""
        return replace(self, white=self.white[min(number, len(self.white) - 1)][None])


def uplifted_basis() -> SpectralBasis:
    """Make the basis in which linear red, green and blue are coefficients of spectra, by `LINEAR_UPLIFT`.

    Mallett and Yuksel 2019: three spectra whose sum is 1. The analysis returns the colour of any spectrum under D65, so
    that uplifted colours round-trip.
    """
    spectra = upsampling(LINEAR_UPLIFT).corners.T
    colours = np.linalg.solve(xyz_from_rgb(), observer("1931_2").weights(illuminant("D65"), WORKING_WAVELENGTHS_NM)).T
    # The table's rounding moves colours by some 1e-5.
    analysis = colours @ np.linalg.inv(spectra.T @ colours)
    return SpectralBasis("uplifted", WORKING_WAVELENGTHS_NM, analysis, spectra)


def is_grey(data: bytes) -> bool:
    """Return whether an image that is not OpenEXR has a single colour channel."""
    from PIL import Image

    try:
        with Image.open(io.BytesIO(data)) as picture:
            return picture.mode in ("1", "L", "LA", "I", "F") or picture.mode.startswith("I;16")
    except Exception:  # a file that is no image is refused when it is decoded
        return False


def _encoded_floats(file: Path) -> InputError:
    return InputError(
        "floats are linear, and not sRGB",
        file=file,
        field="encoding",
        found="srgb",
        expected="linear, or xyz",
        hint="say --encoding linear, or xyz where red, green and blue hold X, Y and Z",
    )
