"""Illuminants and light sources by the names that colour-science gives them."""

from __future__ import annotations

from functools import cache

import numpy as np

from ..runtime.errors import UnknownNameError
from .spectrum import Spectrum

# The short names of the CIE fluorescent series as most catalogues print them.
_ALIASES = {f"f{number}": f"FL{number}" for number in range(1, 13)}
#: Lamps of booths by the names that stand on them, which are those of CIE illuminants.
BOOTH_NAMES = {"TL84": "FL11", "CWF": "FL2"}
_ALIASES |= {name.casefold(): light for name, light in BOOTH_NAMES.items()}
#: The horizon lamp of booths, which stands for the sun at its lowest, and its colour temperature (ASTM D1729).
HORIZON, HORIZON_K = "horizon", 2300.0


@cache
def _tables() -> dict:
    """Every light of colour-science by folded name: CIE illuminants first, then measured light sources."""
    from .colour_library import colour_science

    colour = colour_science()
    lights = {}
    for group in (colour.SDS_LIGHT_SOURCES, colour.SDS_ILLUMINANTS):
        lights.update({name.casefold(): (name, group[name]) for name in group})
    return lights


def illuminant_names() -> tuple[str, ...]:
    """Names of the CIE and ISO illuminants that colour-science tabulates, in its order."""
    from .colour_library import colour_science

    return tuple(colour_science().SDS_ILLUMINANTS)


def light_source_names() -> tuple[str, ...]:
    """Names of the measured light sources that colour-science tabulates, in its order."""
    from .colour_library import colour_science

    return tuple(colour_science().SDS_LIGHT_SOURCES)


@cache
def illuminant(name: str) -> Spectrum:
    """Relative spectral power of an illuminant or light source, on its own wavelengths.

    Parameters
    ----------
    name : colour-science's key in any case; `F1` ... `F12` are `FL1` ... `FL12`. Of the names on booths, `TL84` is
        `FL11`, `CWF` is `FL2`, and `horizon` is a Planckian radiator of `HORIZON_K`; a lamp is `Philips TL-84`.

    Raises
    ------
    UnknownNameError
        With the nearest names.

    >>> illuminant("F11").quantity
    'emission'
    """
    folded = name.casefold()
    if folded in _ALIASES:
        return illuminant(_ALIASES[folded])
    if folded == HORIZON:
        return _horizon()
    if folded not in _tables():
        known = [*(label for label, _ in _tables().values()), *BOOTH_NAMES, HORIZON]
        raise UnknownNameError("illuminant", name, known)
    _, table = _tables()[folded]
    return Spectrum.sampled(table.wavelengths, table.values, "emission")


def canonical_name(name: str) -> str:
    """The name that colour-science gives a light, of another that it has: "FL11" for "TL84" and "F11".

    >>> canonical_name("tl84"), canonical_name("A")
    ('FL11', 'A')
    """
    return _ALIASES.get(name.casefold(), name)


def booth_words(name: str) -> str:
    """Explain the name of a booth's lamp, such as "TL84 is CIE FL11"; "" for any other name."""
    light = next((light for booth, light in BOOTH_NAMES.items() if booth.casefold() == name.casefold()), "")
    if light:
        return f"{name} is CIE {light}"
    return f"{name} is a Planckian radiator of {HORIZON_K:g} K" if name.casefold() == HORIZON else ""


@cache
def _horizon() -> Spectrum:
    from .colour_library import colour_science

    nm = np.arange(300.0, 831.0, 5.0)
    power = colour_science().colorimetry.planck_law(nm * 1e-9, HORIZON_K)
    return Spectrum.sampled(nm, power / power.max(), "emission")
