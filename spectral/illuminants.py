"""Illuminants and light sources by the names that colour-science gives them."""

from __future__ import annotations

from functools import cache

from .errors import UnknownNameError
from .spectrum import Spectrum

# The short names of the CIE fluorescent series as most catalogues print them.
_ALIASES = {f"f{number}": f"FL{number}" for number in range(1, 13)}
# A lamp of booths that goes by its short name everywhere.
_ALIASES |= {"tl84": "Philips TL-84", "tl-84": "Philips TL-84"}


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
    name : colour-science's key in any case; `F1` ... `F12` are `FL1` ... `FL12`, `TL84` is `Philips TL-84`.

    Raises
    ------
    UnknownNameError
        With the nearest names.

    >>> illuminant("F11").quantity
    'emission'
    """
    folded = name.casefold()
    folded = _ALIASES.get(folded, folded).casefold()
    if folded not in _tables():
        raise UnknownNameError("illuminant", name, [label for label, _ in _tables().values()])
    _, table = _tables()[folded]
    return Spectrum.sampled(table.wavelengths, table.values, "emission")
