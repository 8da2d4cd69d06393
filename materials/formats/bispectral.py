"""Fluorescent materials out of a bispectral OpenEXR picture (`spectral.formats.spectral_exr`): one a distinct pixel."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ...spectral.bispectral import Bispectral
from ...spectral.errors import InputError
from ...spectral.formats.spectral_exr import read_spectral_exr
from ..fluorescent import FluorescentLambert

# A picture of more surfaces than this is a texture, not a set of samples.
MOST_SURFACES = 64


def read_bispectral(path: Path) -> tuple[FluorescentLambert, ...]:
    """The distinct surfaces of the picture, in the order in which its rows show them.

    Raises
    ------
    InputError
        No re-radiation in the file, more than `MOST_SURFACES` distinct pixels, or a pixel that no surface can be.
    """
    image = read_spectral_exr(path)
    if image.reradiation is None:
        raise InputError(
            "no re-radiation", file=path, found="plain reflectance", expected="channels such as T.400,0nm.500,0nm"
        )
    pixels = image.reradiation.reshape(-1, image.spectrum.wavelengths_nm.size**2)
    _, first = np.unique(pixels, axis=0, return_index=True)
    if len(first) > MOST_SURFACES:
        raise InputError(
            "too many different pixels", file=path, found=len(first), expected=f"at most {MOST_SURFACES} surfaces"
        )
    width = image.spectrum.samples.shape[1]
    return tuple(FluorescentLambert(_placed(image.bispectral, path, *divmod(int(at), width))) for at in np.sort(first))


def _placed(bispectral: Callable[[int, int], Bispectral], path: Path, row: int, column: int) -> Bispectral:
    """The surface of a pixel; what is wrong with it is said with its place in the file."""
    try:
        return bispectral(row, column)
    except InputError as reason:
        raise InputError(
            reason.problem,
            file=path,
            field=f"pixel ({row}, {column})",
            found=reason.found,
            expected=reason.expected,
            hint=reason.hint,
        ) from None
