"""Description of a record for pages and terminals: its spectrum, trials, colours, packs and arrays, in words."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from ...spectral.formats.registry import SpectralEntry, StatedColour
from ...spectral.stated_colours import StatedComparison, compared
from .material import MaterialRecord
from .record_colour import radiance_factor_45_0
from .stored_array import StoredArray
from .stored_files import StoredFiles
from .trial_table import trial_table

# Figures of an error in a table of trials.
_ERRORS = ("mean", "p95", "p99", "maximum")


@dataclass(frozen=True, eq=False)
class ShownSpectrum:
    """Curve `values` (L,) at `wavelengths_nm` (L,), with its description."""

    wavelengths_nm: Float[np.ndarray, " L"]
    values: Float[np.ndarray, " L"]
    label: str


def shown_spectrum(record: MaterialRecord) -> ShownSpectrum:
    """Return the measured spectrum if the record has one, else pi f_r of the original data at annular 45:0."""
    spectrum = record.measured_spectrum()
    if spectrum is not None and spectrum.samples.ndim == 1:
        return ShownSpectrum(spectrum.wavelengths_nm, spectrum.samples, f"{spectrum.quantity}, as measured")
    brdf = record.brdf()
    label = "radiance factor at 45:0" + (" without fluorescence" if record.quantity == "bispectral" else "")
    return ShownSpectrum(brdf.wavelengths_nm, radiance_factor_45_0(brdf), label)


@dataclass(frozen=True)
class ShownColour:
    """Stated colour beside the one computed from the spectrum.

    `conditions` are light and observer, `assumed` a clause for each assumption about unstated ones.
    """

    conditions: str
    space: str
    stated: str
    recomputed: str
    delta_e94: str
    assumed: tuple[str, ...] = ()


def shown_colours(record: MaterialRecord) -> tuple[ShownColour, ...]:
    """Return every stated colour with its recomputation; raises `InputError` as `recomputed_colours` does."""
    return tuple(
        ShownColour(
            f"{one.illuminant or 'the light itself'}, {one.observer}",
            one.stated.space,
            two_decimals(one.stated.values),
            two_decimals(one.recomputed),
            f"{one.delta_e94:.2f}",
            one.assumed,
        )
        for one in recomputed_colours(record)
    )


def shown_conditions(colour: Mapping[str, Any]) -> str:
    """Describe the conditions of a `record_colour`: geometry, illuminant and observer, as far as it has them."""
    return ", ".join(colour[name] for name in ("geometry", "illuminant", "observer") if name in colour)


def two_decimals(values: Iterable[float]) -> str:
    """Return the numbers of a colour.

    >>> two_decimals([50.0, -1.25, 0.333])
    '50.00 -1.25 0.33'
    """
    return " ".join(f"{value:.2f}" for value in values)


def shown_reconstruction(record: MaterialRecord) -> dict[str, str]:
    """Describe the expected error of a BRDF reconstructed from readings at a few angles; nothing for other records."""
    from ..effect_coating.stated_error import FLARE, StatedError

    error = StatedError.from_stored(record.original)
    if error is None:
        return {}
    means, bounds = (
        ", ".join(f"{light} {value:.1f}" for light, value in zip(error.lights, each, strict=True))
        for each in (error.mean, error.bound)
    )
    again = np.asarray(record.original["reread_delta_e94"])
    angles = ", ".join(f"{value:.2f}" for value in again)
    return {
        "In between": f"about ΔE94 {means}, within a factor of 2; nine tenths below some {bounds}",
        "At readings": f"ΔE94 {angles}",
        "Not stated": f"within {FLARE:g}° of the mirror direction, where nothing was read",
    }


def shown_trials(record: MaterialRecord) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]:
    """Return headings and rows of the fit's trials: every plain field of `Trial`, and the ΔE94 of its error.

    Lobes count from 1; missing numbers are empty cells. An import stores no seconds, so that equal materials are equal
    files; there is no such column then.
    """
    trials = [replace(trial, lobe=trial.lobe + 1) for trial in record.trials]
    table = trial_table(trials)
    names = [name for name in table.dtype.names or () if "." not in name or name.removeprefix("error.") in _ERRORS]
    if not any(trial.seconds for trial in trials):
        names = [name for name in names if name != "seconds"]
    rows = tuple(tuple(_cell(table[name][row]) for name in names) for row in range(len(table)))
    return tuple(name.removeprefix("error.") for name in names), rows


def shown_values(values: Mapping[str, Any], left_out: Sequence[str] = ()) -> dict[str, str]:
    """Describe a record's parameters or measurement: arrays by their shape, numbers and text as they are.

    An array that stays in a file is described with that file.
    """
    found = {}
    for name, value in values.items():
        if isinstance(value, StoredFiles) and name not in left_out:
            found[name] = f"{_words(value, '')}, in {len(value.names)} files of {value.file}"
        elif isinstance(value, StoredArray) and name not in left_out:
            found[name] = f"{_words(value, '')}, in {value.file}"
        elif name not in left_out:
            array = np.asarray(value)
            short = array.ndim == 1 and array.size <= 4
            found[name] = " ".join(f"{one:g}" for one in array) if short else _words(array, value)
    return found


def _words(array: np.ndarray | StoredArray, value: Any) -> str:
    return f"{array.dtype} {' x '.join(map(str, array.shape))}" if array.ndim else str(value)


def _cell(value: np.generic) -> str:
    plain = value.item()
    if isinstance(plain, bool):
        return "yes" if plain else "no"
    if isinstance(plain, float):
        return f"{plain:.3f}" if not math.isnan(plain) else ""
    return plain.decode("utf-8") if isinstance(plain, bytes) else str(plain)


def stated_colours(original: Mapping[str, Any]) -> tuple[StatedColour, ...]:
    """Return stated colours as a record stores them.

    `stated.N.space`, `.values`, and `.illuminant` and `.observer` if stated.
    """
    numbers = sorted(
        int(name.split(".")[1])
        for name in original
        if name.startswith("stated.") and name.endswith(".space") and name.split(".")[1].isdecimal()
    )
    found = []
    for place in (f"stated.{number}." for number in numbers):
        space, values = original[f"{place}space"], original.get(f"{place}values", ())
        if space in ("XYZ", "Lab") and np.shape(values) == (3,):
            light, eye = (original.get(place + name) or None for name in ("illuminant", "observer"))
            found.append(StatedColour(space, np.asarray(values, dtype=np.float64), light, eye))
    return tuple(found)


def recomputed_colours(record: MaterialRecord) -> tuple[StatedComparison, ...]:
    """Return every stated colour of a record with the one computed from its spectrum; none without a single spectrum.

    Raises
    ------
    InputError : a colour is stated for a light or an observer that is not tabulated here.
    """
    spectrum, stated = record.measured_spectrum(), stated_colours(record.original)
    if spectrum is None or spectrum.samples.ndim != 1 or not stated:
        return ()
    return compared(SpectralEntry(record.id, spectrum, stated))
