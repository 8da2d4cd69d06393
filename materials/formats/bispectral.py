"""Fluorescent materials from a bispectral OpenEXR picture (`spectral.formats.spectral_exr`): one per distinct pixel."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from ...runtime.errors import InputError
from ...spectral.bispectral import Bispectral
from ...spectral.formats.exr import channel_names, check_size
from ...spectral.formats.spectral_exr import read_spectral_exr
from ..analytic.fluorescent import FluorescentLambert
from ..records.material import Provenance
from ..records.source import MaterialSource, Rejected
from .measured_source import placed, sha256_of
from .naming import id_word, printable
from .reading_cost import ReadingCost, cost_of_picture

NAME = "bispectral OpenEXR"
SUFFIXES = (".exr",)
# A picture of more surfaces than this is a texture, not a set of samples.
MOST_SURFACES = 64
# A matrix of all pairs of wavelengths takes twice as many numbers as a file has channels: half a gigabyte.
MOST_SAMPLES = 1 << 25
_SHIFTED = re.compile(r"^(?:.*\.)?T\.[\d.,eE+-]+\w*(?:m|Hz)\.[\d.,eE+-]+\w*(?:m|Hz)$")


def recognises(path: Path, head: bytes) -> bool:
    """True for an OpenEXR picture with a channel such as T.400,0nm.500,0nm."""
    return any(_SHIFTED.match(name) for name in channel_names(path, head))


def reading_cost(path: Path) -> ReadingCost:
    """Estimate the cost of its pixels, as the header counts them."""
    return cost_of_picture(path)


def read_sources(path: Path, uplift: str) -> Iterator[MaterialSource | Rejected]:
    """One material a distinct pixel; `uplift` is not needed. Raises `InputError` as `read_bispectral` does."""
    surfaces = read_bispectral(path)
    content = sha256_of(path)
    for number, brdf in enumerate(surfaces, start=1):
        name = id_word(path.stem) + (f"-{number}" if len(surfaces) > 1 else "")
        provenance = Provenance(
            source=f"{printable(path.name)}, a bispectral OpenEXR picture, surface {number} of {len(surfaces)}",
            licence="not stated in the file",
            kind="measured",
            notes=f"taken to be perfectly diffuse + {printable(path.name)}: SHA-256 {content}",
        )
        parameters, original = brdf.parameters(), {"file": printable(path.name), "surface": number}
        yield MaterialSource(f"measured/{name}", "measured", brdf.NAME, parameters, provenance, path, original)


def read_bispectral(path: Path) -> tuple[FluorescentLambert, ...]:
    """Read the distinct surfaces of the picture, in the order of their first pixels.

    Raises
    ------
    InputError
        No re-radiation in the file, more than `MOST_SURFACES` distinct pixels, or a pixel that is no possible surface.
    """
    check_size(path, MOST_SAMPLES)
    expected, again = "a bispectral OpenEXR picture", "the picture is damaged or cut short: save or copy it again"
    try:
        with placed(path, "channels", again, expected):
            image = read_spectral_exr(path)
    except ValueError as reason:
        raise InputError(
            "channels do not go together", file=path, field="channels", found=str(reason), expected=expected, hint=again
        ) from None
    if image.reradiation is None:
        raise InputError(
            "no re-radiation",
            file=path,
            field="channels",
            found="plain reflectance",
            expected="channels such as T.400,0nm.500,0nm",
            hint="import it as a spectral picture",
        )
    pixels = image.reradiation.reshape(-1, image.spectrum.wavelengths_nm.size**2)
    _, first = np.unique(pixels, axis=0, return_index=True)
    if len(first) > MOST_SURFACES:
        raise InputError(
            "too many different pixels",
            file=path,
            field="pixels",
            found=len(first),
            expected=f"at most {MOST_SURFACES} surfaces",
            hint="cut out or average the patches that are materials of their own",
        )
    width = image.spectrum.samples.shape[1]
    return tuple(FluorescentLambert(_placed(image.bispectral, path, *divmod(int(at), width))) for at in np.sort(first))


def _placed(bispectral: Callable[[int, int], Bispectral], path: Path, row: int, column: int) -> Bispectral:
    """Make the surface of a pixel; errors state its place in the file."""
    try:
        return bispectral(row, column)
    except InputError as reason:
        hint = reason.hint or "correct the pixel in the program that wrote the picture"
        raise reason.at(file=path, field=f"pixel ({row}, {column})", hint=hint) from None
