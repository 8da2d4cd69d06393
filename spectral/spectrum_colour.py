"""Colour of a spectrum, its plot, and conversions to other libraries: implementation of the methods of `Spectrum`."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from ..runtime.errors import InputError
from ..runtime.notebook import new_axes
from .difference import lab_from_xyz
from .illuminants import as_light
from .observers import EFFICACY, Observer, observer
from .sample import check_covers
from .spectrum import Spectrum

# Size of a drawing in a notebook, SVG units, and the wavelengths that it shows at least.
_WIDTH, _HEIGHT, _SHOWN_NM = 260.0, 90.0, (400.0, 700.0)


def xyz(spectrum: Spectrum, light: object = None, eye: object = "1931_2") -> Float[np.ndarray, "... 3"]:
    """Compute XYZ (...,3) of a spectrum.

    Parameters
    ----------
    light : as of `illuminants.as_light`; None: D65. An emission is a light itself and needs none.
    eye : the name of an observer, or one.

    Returns
    -------
    Of reflectance, transmittance and radiance factor: relative to the perfect diffuser, Y = 1. Of an emission: Y in lm,
        per the area or angle of its watts (CIE 015:2018 eq. 7.1 with K_m).

    Raises
    ------
    InputError, UnknownNameError : a light for an emission; an unknown light or observer; too little of the visible.
    """
    seen_by = _observer(eye)
    if spectrum.quantity == "emission":
        if light is not None:
            raise InputError(
                "a light has no colour under a light",
                field="light",
                found=light if isinstance(light, str) else type(light).__name__,
                expected="none: xyz() of an emission is its own",
            )
        return EFFICACY * spectrum.samples @ seen_by.sensitivity(spectrum.wavelengths_nm).T
    check_covers(spectrum, None, "spectrum")
    return spectrum.samples @ seen_by.weights(as_light("D65" if light is None else light), spectrum.wavelengths_nm).T


def lab(spectrum: Spectrum, light: object = None, eye: object = "1931_2") -> Float[np.ndarray, "... 3"]:
    """Compute CIELAB (...,3) relative to the white of the light; parameters and errors as of `xyz`.

    Raises
    ------
    InputError : also an emission, which has no white.
    """
    if spectrum.quantity == "emission":
        raise InputError("a light has no CIELAB", field="quantity", found="emission", expected="what is lit by one")
    white = _observer(eye).white("D65" if light is None else light)
    return lab_from_xyz(xyz(spectrum, light, eye), white)


def _observer(eye: Any) -> Observer:
    return eye if isinstance(eye, Observer) else observer(str(eye) if isinstance(eye, int) else eye)


def to_colour(spectrum: Spectrum) -> Any:
    """Make colour-science's object of a spectrum (L,) or of several (n,L).

    Raises
    ------
    InputError : samples of more axes.
    """
    from .colour_library import colour_science

    colour, nm = colour_science(), spectrum.wavelengths_nm
    if spectrum.samples.ndim == 1:
        return colour.SpectralDistribution(spectrum.samples, nm)
    if spectrum.samples.ndim == 2:
        return colour.MultiSpectralDistributions(spectrum.samples.T, nm)
    raise InputError(
        "too many axes", field="samples", found=f"shape {spectrum.samples.shape}", expected="(L,) or (n, L)"
    )


def plot(spectrum: Spectrum, axes: Any = None, **style: Any) -> Any:
    """Draw curves over wavelengths with matplotlib.

    Parameters
    ----------
    axes : matplotlib's axes; None: new ones. style : as of its `plot`, such as label or color.

    Raises
    ------
    InputError : matplotlib is not installed.
    """
    axes = new_axes() if axes is None else axes
    axes.plot(spectrum.wavelengths_nm, spectrum.samples.reshape(-1, spectrum.wavelengths_nm.size).T, **style)
    axes.set_xlabel("wavelength / nm")
    axes.set_ylabel("spectral power / W nm⁻¹" if spectrum.quantity == "emission" else spectrum.quantity)
    if spectrum.quantity in ("reflectance", "transmittance"):
        axes.set_ylim(0.0, 1.0)
    return axes


def as_html(spectrum: Spectrum) -> str:
    """Write the curve, with a swatch of its colour under D65, as HTML for a notebook."""
    curves = spectrum.samples.reshape(-1, spectrum.wavelengths_nm.size)
    nm = spectrum.wavelengths_nm
    low, high = min(nm[0], _SHOWN_NM[0]), max(nm[-1], _SHOWN_NM[1])
    most = 1.0 if spectrum.quantity in ("reflectance", "transmittance") else max(float(curves.max()), 1e-300)
    lines = []
    for curve in curves[:8]:
        points = " ".join(
            f"{_WIDTH * (at - low) / (high - low):.1f},{_HEIGHT * (1.0 - value / most):.1f}"
            for at, value in zip(nm, curve, strict=True)
        )
        lines.append(f'<polyline points="{points}" fill="none" stroke="currentColor" stroke-width="1.5"/>')
    words = repr(spectrum).strip("<>")
    return (
        f'<figure style="margin:0">{_swatch(spectrum)}'
        f'<svg viewBox="0 -4 {_WIDTH:g} {_HEIGHT + 8:g}" width="{_WIDTH:g}" role="img" aria-label="{words}">'
        f'<path d="M0 {_HEIGHT:g}H{_WIDTH:g}" stroke="currentColor" opacity=".4"/>'
        f"{''.join(lines)}</svg><figcaption>{words}; {low:g} to {high:g} nm, 0 to {most:.3g}</figcaption></figure>"
    )


def _swatch(spectrum: Spectrum) -> str:
    """Draw the colour of one spectrum under D65, clipped to sRGB; nothing without a colour."""
    if spectrum.quantity == "emission" or spectrum.samples.ndim != 1:
        return ""
    try:
        seen = spectrum.xyz()
    except InputError:
        return ""
    return swatch(seen)


def swatch(seen: Float[np.ndarray, "3"]) -> str:
    """Draw XYZ under D65, Y = 1 white, as a square in sRGB, with a note if it is clipped."""
    from .colour_library import colour_science

    coded = colour_science().XYZ_to_sRGB(seen)
    red, green, blue = np.rint(255.0 * np.clip(coded, 0.0, 1.0)).astype(int)
    beyond = coded.min() < -0.005 or coded.max() > 1.005
    told = "colour under D65" + (", as near as sRGB comes" if beyond else "")
    return (
        f'<span role="img" aria-label="{told}" title="{told}" style="display:inline-block;width:64px;height:64px;'
        f'margin-right:12px;background:rgb({red},{green},{blue})"></span>'
    )
