"""Spectra of measured colours inside and outside sRGB, such as those of pearls and lacquers.

The line from white through a chromaticity to the spectral locus leaves sRGB at an edge. Beyond that edge, a colour is
mixed from the colour on the edge and one near the locus, a bounded curve (Jakob and Hanika 2019, equation 2). Neither
is negative at any wavelength, nor is the mixture; both are exact under D65, and so is the mixture. Slightly outside the
ring of those curves colours become impossible: the excess of a channel below the ring is subtracted with the spectrum
of its primary there, which keeps the colour exact but makes the spectrum negative in places.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from jaxtyping import Float

from ..runtime.errors import InputError
from .observers import observer
from .upsampling import DEFAULT_METHOD, MISSED, Upsampling, sigmoid, sigmoid_coefficients, upsampling, xyz_from_rgb

# The ring's place between white and the spectral locus, 0 to 1; the wavelengths between which it follows the locus, nm,
# and not the line of purples; and its number of points.
_REACH, _FIRST_NM, _LAST_NM, _POINTS = 0.95, 400.0, 680.0, 64
# Largest channels at which curves are tried, from wide curves to narrow ones.
_LEVELS = (0.5, 0.3, 0.2, 0.1)
# The least way from the edge to the ring over which one changes into the other, as a share of that from white: about
# red they nearly meet, and noise would go from one to the other.
_LEAST_WAY = 0.2
# X + Y + Z below this share of the largest channel is rounding.
_NO_LIGHT = 1e-9


def spectra_of(rgb: Float[np.ndarray, "*batch 3"], method: str = DEFAULT_METHOD) -> Float[np.ndarray, "*batch L"]:
    """Upsample colours in linear sRGB, whose channels may be negative, to the working wavelengths.

    Colours without negative channels are upsampled by `method`. Twice the RGB is twice the spectrum.

    Raises
    ------
    UnknownNameError : there is no such method. InputError : a channel is NaN or infinite.
    """
    return _made(rgb, upsampling(method), None)


def folded_spectra_of(
    rgb: Float[np.ndarray, "*batch 3"], weights: Float[np.ndarray, "L C"], method: str = DEFAULT_METHOD
) -> Float[np.ndarray, "*batch C"]:
    """Compute `spectra_of(rgb) @ weights`, with spectra for colours with negative channels only; same errors."""
    return _made(rgb, upsampling(method), weights)


def _made(rgb: Float[np.ndarray, "*batch 3"], maker: Upsampling, weights: np.ndarray | None) -> np.ndarray:
    rgb = np.asarray(rgb, dtype=np.float64)
    if not np.isfinite(rgb).all():
        raise InputError("not a colour", field="rgb", found="NaN or infinity", expected="numbers")
    flat = rgb.reshape(-1, 3)
    within = np.maximum(flat, 0.0)
    out = maker.spectra(within) if weights is None else maker.folded(within, weights)
    outside = (flat < 0.0).any(axis=1)
    if outside.any():
        mixed = _mixed(flat[outside], maker)
        out[outside] = mixed if weights is None else mixed @ weights
    return out.reshape(*rgb.shape[:-1], out.shape[1])


def _mixed(rgb: Float[np.ndarray, "N 3"], maker: Upsampling) -> Float[np.ndarray, "N L"]:
    total = rgb @ xyz_from_rgb().sum(axis=0)
    # Black has no chromaticity: each channel takes its primary's spectrum.
    primaries = upsampling("mallett-yuksel").corners
    out = rgb @ primaries
    lit = total > _NO_LIGHT * np.abs(rgb).max(axis=1)
    total, place = total[lit, None], rgb[lit] / total[lit, None]
    white = 1.0 / xyz_from_rgb().sum()
    to_edge = white / (white - place.min(axis=1, keepdims=True))
    angles, corners, spectra = _ring()
    off = _chromaticities(place) - _chromaticities(np.full(3, white))
    after = np.searchsorted(angles, np.arctan2(off[:, 1], off[:, 0])) % len(angles)
    sides = np.stack([corners[after - 1], corners[after]], axis=-1)
    amounts = np.linalg.solve(sides, off[..., None])[..., 0]
    # Radius of the colour and of the edge; the ring is at 1.
    reach = amounts.sum(axis=1, keepdims=True)
    at_edge = to_edge * reach
    share = np.clip((reach - at_edge) / np.maximum(1.0 - at_edge, _LEAST_WAY), 0.0, 1.0)
    beyond = np.einsum("nk,nkl->nl", amounts / reach, np.stack([spectra[after - 1], spectra[after]], axis=1))
    edge = maker.spectra(np.maximum(white + to_edge * (place - white), 0.0))
    left = 1.0 - (at_edge + share * (1.0 - at_edge)) / reach
    out[lit] = total * ((1.0 - share) * edge + share * beyond + left * (place - white) @ primaries)
    return out


@cache
def _ring() -> tuple[Float[np.ndarray, " V"], Float[np.ndarray, "V 2"], Float[np.ndarray, "V L"]]:
    """Return angles about white, ascending, chromaticities (x, y) from it, and spectra of X + Y + Z = 1 under D65."""
    seen = observer("1931_2")
    pure = seen.cmfs[(seen.wavelengths_nm >= _FIRST_NM) & (seen.wavelengths_nm <= _LAST_NM)]
    locus = pure[:, :2] / pure.sum(axis=1, keepdims=True)
    locus = np.concatenate([locus, locus[:1]])
    # Even steps: wavelengths crowd at both ends.
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(locus, axis=0), axis=1))])
    places = along[-1] * np.arange(_POINTS) / _POINTS
    locus = np.stack([np.interp(places, along, column) for column in locus.T], axis=1)
    white = xyz_from_rgb().sum(axis=1)
    white = white[:2] / white.sum()
    corners = _REACH * (locus - white)
    angles = np.arctan2(corners[:, 1], corners[:, 0])
    order = np.argsort(angles)
    angles, corners = angles[order], corners[order]
    xyz = np.concatenate([white + corners, 1.0 - (white + corners).sum(axis=1, keepdims=True)], axis=1)
    rgb = np.linalg.solve(xyz_from_rgb(), xyz.T).T
    largest = rgb.max(axis=1, keepdims=True)
    curves, missed = np.zeros((len(rgb), 3)), np.full(len(rgb), np.inf)
    scale = np.ones((len(rgb), 1))
    for level in _LEVELS:
        left = missed > MISSED
        scale[left] = largest[left] / level
        curves[left], missed[left] = sigmoid_coefficients(rgb[left] / scale[left])
    if (missed > MISSED).any():
        raise ArithmeticError(f"no bounded curve has the colour {rgb[missed.argmax()]}")
    return angles, corners, scale * sigmoid(curves)


def _chromaticities(rgb: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 2"]:
    """Compute x and y of colours with X + Y + Z = 1."""
    return (rgb @ xyz_from_rgb().T)[..., :2]
