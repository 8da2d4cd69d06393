"""Illuminants and light sources by the names of colour-science."""

from __future__ import annotations

from functools import cache

import numpy as np

from ..runtime.errors import InputError, UnknownNameError
from .colour_library import ColourTable, colour_tables
from .spectrum import Spectrum

# The short names of the CIE fluorescent series as most catalogues print them.
_ALIASES = {f"f{number}": f"FL{number}" for number in range(1, 13)}
#: Lamps of booths by the names that stand on them, and the CIE illuminants that stand for them: Philips' TL and
#: Westinghouse's Ultralume lamps, cool and warm white, as public tables of white points name F10 to F12, F2 and F4
#: (easyrgb.com, "Math"; torso.de, "Table of illuminants").
BOOTH_NAMES = {
    "TL84": "FL11",
    "CWF": "FL2",
    "TL83": "FL12",
    "U30": "FL12",
    "TL85": "FL10",
    "U50": "FL10",
    "U40": "FL11",
    "WWF": "FL4",
}
_ALIASES |= {name.casefold(): light for name, light in BOOTH_NAMES.items()}
# Lamps that no CIE illuminant stands for, each by its names on booths: a measured one of its kind, and what it is.
_LIKE_MEASURED = {
    ("TL830",): ("F32T8/TL830 (Triphosphor)", "3000 K"),
    ("U35", "TL835"): ("F32T8/TL835 (Triphosphor)", "3500 K"),
    ("U41", "TL840", "TL841"): ("F32T8/TL841 (Triphosphor)", "4100 K"),
    ("TL850",): ("F32T8/TL850 (Triphosphor)", "5000 K"),
    ("TL865", "TL86"): ("F32T8/TL865/PLUS (Triphosphor)", "6500 K"),
}
_TUNGSTEN_NAMES = ("INC", "INCA", "INCANDESCENTA", "TUNGSTEN", "F")
#: The horizon lamp of booths, which stands for the sun at its lowest, and its colour temperature (ASTM D1729).
HORIZON, HORIZON_K = "horizon", 2300.0


# Measured lamps of this process by folded name.
_measured: dict[str, Spectrum] = {}


@cache
def _tables() -> dict[str, tuple[str, ColourTable]]:
    """Return every light of colour-science by folded name: CIE illuminants first, then measured light sources."""
    every = colour_tables("SDS_LIGHT_SOURCES") | colour_tables("SDS_ILLUMINANTS")
    return {name.casefold(): (name, table) for name, table in every.items()}


def illuminant_names() -> tuple[str, ...]:
    """Names of the CIE and ISO illuminants that colour-science tabulates, in its order."""
    return tuple(colour_tables("SDS_ILLUMINANTS"))


def light_source_names() -> tuple[str, ...]:
    """Names of the measured light sources that colour-science tabulates, in its order."""
    return tuple(colour_tables("SDS_LIGHT_SOURCES"))


def illuminant(name: str) -> Spectrum:
    """Return the relative spectral power of an illuminant or light source, on its own wavelengths.

    Parameters
    ----------
    name : colour-science's key in any case; `F1` ... `F12` are `FL1` ... `FL12`. Names on booths, also as "TL-84" or
        "TL 84", are those of `BOOTH_NAMES`, and `horizon` is a Planckian radiator of `HORIZON_K`; a lamp is `Philips
        TL-84`.

    Raises
    ------
    UnknownNameError
        With the nearest names, or with the name to write for a booth's lamp that is no illuminant. InputError Not a
        name, but a lamp or another object.

    >>> illuminant("F11").quantity
    'emission'
    """
    if not isinstance(name, str):
        raise InputError(
            "not the name of an illuminant",
            field="illuminant",
            found=repr(name)[:80],
            expected='a name, such as "D65"',
            hint="a measured lamp is the light of metamer.render and of metamer.match, and of the lab(light) and "
            "xyz(light) of a spectrum",
        )
    return _measured.get(name.casefold()) or _illuminant(name)


def measured_lamp(name: str, lamp: Spectrum) -> str:
    """Give a measured lamp a name that `illuminant` knows during this process.

    Returns
    -------
    str : the name; with a number if an illuminant or another lamp has it.

    Raises
    ------
    InputError : a spectrum that is no emission.

    >>> from metamer.spectral.spectrum import Spectrum
    >>> measured_lamp("d65", Spectrum({400.0: 1.0, 700.0: 2.0}, quantity="emission"))
    'd65 (2)'
    """
    if lamp.quantity != "emission":
        raise InputError("not a lamp", field=name, found=f"a {lamp.quantity}", expected='quantity="emission"')
    number, called = 1, name
    while not _is_free(called, lamp):
        number += 1
        called = f"{name} ({number})"
    _measured[called.casefold()] = lamp
    return called


def _is_free(name: str, lamp: Spectrum) -> bool:
    """Return whether no other light has this name."""
    if (known := _measured.get(name.casefold())) is not None:
        alike = np.array_equal(known.wavelengths_nm, lamp.wavelengths_nm)
        return alike and np.array_equal(known.samples, lamp.samples)
    try:
        _illuminant(name)
    except UnknownNameError:
        return True
    return False


@cache
def _illuminant(name: str) -> Spectrum:
    folded = name.casefold()
    if folded == HORIZON:
        return _horizon()
    if (canonical := canonical_name(name)) != name:
        return _illuminant(canonical)
    if folded not in _tables():
        known = [*(label for label, _ in _tables().values()), *BOOTH_NAMES, HORIZON]
        raise UnknownNameError("illuminant", name, known).at(hint=_to_write(name))
    _, (nm, power) = _tables()[folded]
    return Spectrum.sampled(nm, power, "emission")


def as_light(light: object) -> Spectrum:
    """Return a light by its name, or by an argument of `Spectrum.of`: an emission in any unit.

    Raises
    ------
    UnknownNameError, InputError : as of `illuminant` and `Spectrum.of`.

    >>> as_light({400.0: 1.0, 700.0: 1.0})
    <Spectrum of emission, 400 to 700 nm: 2 samples>
    """
    return illuminant(light) if isinstance(light, str) else Spectrum.of(light, "emission")


def canonical_name(name: str) -> str:
    """Return the colour-science name of a light from any of its names: "FL11" for "TL84" and "F11".

    >>> canonical_name("tl84"), canonical_name("A")
    ('FL11', 'A')
    """
    return _ALIASES.get(name.casefold()) or _ALIASES.get(_on_booth(name).casefold(), name)


def booth_words(name: str) -> str:
    """Explain the name of a booth's lamp, such as "TL84 is CIE FL11"; "" for any other name."""
    if light := BOOTH_NAMES.get(_on_booth(name)):
        return f"{name} is CIE {light}"
    return f"{name} is a Planckian radiator of {HORIZON_K:g} K" if name.casefold() == HORIZON else ""


def _on_booth(name: str) -> str:
    """Normalise a name as written on booths: "TL 84" and "tl-84" are TL84, "Ultralume 3000" is U30."""
    plain = "".join(sign for sign in name.upper() if sign not in " -_")
    if plain.startswith("ULTRALUME"):
        return f"U{plain.removeprefix('ULTRALUME')[:2]}"
    return plain.removeprefix("PHILIPS") if plain.startswith("PHILIPSTL") and plain != "PHILIPSTL84" else plain


def _to_write(name: str) -> str | None:
    """Return what to write for a booth's lamp that is no illuminant, None for any other name."""
    plain = _on_booth(name)
    if plain in _TUNGSTEN_NAMES:
        return "A, where it is the tungsten lamp of a booth"
    found = (
        f"{lamp!r}, a measured lamp of {kelvin}" for names, (lamp, kelvin) in _LIKE_MEASURED.items() if plain in names
    )
    return next((f"no CIE illuminant stands for it; write {words}" for words in found), None)


@cache
def _horizon() -> Spectrum:
    from .colour_library import colour_science

    nm = np.arange(300.0, 831.0, 5.0)
    power = colour_science().colorimetry.planck_law(nm * 1e-9, HORIZON_K)
    return Spectrum.sampled(nm, power / power.max(), "emission")
