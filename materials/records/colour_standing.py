"""Standing of a material's colour and of its gloss, separately: as stated by its record, in words and in sentences."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, cast

import numpy as np

from ...spectral.sample import title_from_id
from .material import MaterialRecord

Standing = Literal["measured", "analytic", "uplifted", "reconstructed", "unknown"]
#: Standings of a colour that a description may state.
STANDINGS: tuple[Standing, ...] = ("measured", "analytic", "uplifted", "reconstructed")
#: Keys of a record's `original`: title and standing of the colour as its description states them, and the range
#: in nm (2,) over which that colour was measured.
TITLE, COLOUR, COLOUR_RANGE = "title", "colour", "colour_nm"
# Models whose directions were measured, whatever their spectra are.
_DIRECTIONAL = ("merl", "rgl", "scattered", "btf")
# Models of a measured colour that add no gloss.
_MATT = ("lambert", "fluorescent_lambert", "spectral_texture")


def colour_standing(record: MaterialRecord) -> Standing:
    """Return the standing of a material's colour; "unknown" if its record does not state it.

    A model with published spectra does not imply it; its description does (`COLOUR`).
    """
    stated = record.original.get(COLOUR)
    if stated in STANDINGS:
        return cast(Standing, stated)
    kind = record.provenance.standing
    if kind == "reconstructed":
        # Read at some angles, each reading a measurement; between them it is made up.
        return "measured" if record.model == "flake_tilt" else "reconstructed"
    return "unknown" if kind == "analytic" else cast(Standing, kind)


def gloss_standing(record: MaterialRecord) -> Standing:
    """Return the standing of a material's gloss: how it scatters light, apart from its colour."""
    if record.model in _DIRECTIONAL:
        return "measured"
    if record.provenance.standing == "reconstructed":
        return "reconstructed"
    return "analytic"


_COLOUR_WORDS: Mapping[str, str] = {
    "measured": "The colour was measured on a real sample",
    "analytic": "The colour is calculated, not measured: compare it with a sample",
    "uplifted": "The colour was guessed from RGB values: under another light it may be wrong",
    "reconstructed": "The colour was rebuilt from readings or photos: compare it with a sample",
    "unknown": "The record does not say whether the colour was measured",
}
_GLOSS_WORDS: Mapping[str, str] = {
    "measured": "How it shines was measured, too.",
    "analytic": "The finish (gloss) is a model: compare gloss with a real part.",
    "reconstructed": "How it shines was rebuilt from readings at some angles: compare gloss with a real part.",
    "unknown": "The record does not say where its gloss comes from.",
}
_MATT_WORDS = "Its gloss was not measured: it is drawn perfectly matt."


def standing_sentences(record: MaterialRecord) -> str:
    """Describe in plain sentences what of a material was measured."""
    colour, gloss = colour_standing(record), gloss_standing(record)
    at = f" ({record.provenance.geometry})" if colour == "measured" and record.provenance.geometry else ""
    matt = gloss == "analytic" and record.model in _MATT
    return f"{_COLOUR_WORDS[colour]}{at}. {_MATT_WORDS if matt else _GLOSS_WORDS[gloss]}"


def title_of(record: MaterialRecord) -> str:
    """Return a material's title: from its description or its file, else the last word of its id, spelt out.

    >>> from types import SimpleNamespace
    >>> title_of(SimpleNamespace(id="paint/signal-red", original={}))
    'Signal red'
    """
    for key in (TITLE, "name"):
        stated = record.original.get(key)
        if isinstance(stated, str) and stated.strip():
            return stated.strip()
    return title_from_id(record.id)


def measured_range(record: MaterialRecord) -> tuple[float, float] | None:
    """Return the range of wavelengths, nm, over which the colour was measured; None if the record does not state it."""
    stated = record.original.get(COLOUR_RANGE)
    if stated is None:
        spectrum = record.measured_spectrum() if colour_standing(record) == "measured" else None
        stated = None if spectrum is None else spectrum.wavelengths_nm
    if stated is None or not np.size(stated):
        return None
    return float(np.ravel(stated)[0]), float(np.ravel(stated)[-1])
