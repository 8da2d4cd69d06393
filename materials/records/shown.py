"""What a page or a terminal shows of a record: its one spectrum, its trials as a table, its arrays in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from ..directions import spherical
from .material import MaterialRecord
from .trial_table import trial_table

# Of an error, a table of trials shows these.
_ERRORS = ("mean", "p95", "p99", "maximum")


@dataclass(frozen=True, eq=False)
class ShownSpectrum:
    """One curve: `values` (L,) at `wavelengths_nm` (L,), and what it is."""

    wavelengths_nm: Float[np.ndarray, " L"]
    values: Float[np.ndarray, " L"]
    label: str


def shown_spectrum(record: MaterialRecord) -> ShownSpectrum:
    """The measured spectrum where the record keeps one, else pi f_r at 45:0 of the original data."""
    spectrum = record.spectrum()
    if spectrum is not None and spectrum.values.ndim == 1:
        return ShownSpectrum(spectrum.wavelengths_nm, spectrum.samples, f"{spectrum.quantity}, as measured")
    brdf = record.brdf()
    values = np.pi * brdf.eval(spherical(np.pi / 4, 0.0), spherical(0.0, 0.0))
    label = "radiance factor at 45:0" + (" without fluorescence" if record.quantity == "bispectral" else "")
    return ShownSpectrum(brdf.wavelengths_nm, np.asarray(values, dtype=np.float64), label)


def shown_trials(record: MaterialRecord) -> tuple[tuple[str, ...], tuple[tuple[Any, ...], ...]]:
    """Headings and rows of what the fit tried: every plain field of `Trial`, and of its error the ΔE94.

    Lobes count from 1. An import keeps no seconds, so that equal materials are equal files; no column then.
    """
    trials = [replace(trial, lobe=trial.lobe + 1) for trial in record.trials]
    table = trial_table(trials)
    names = [name for name in table.dtype.names or () if "." not in name or name.removeprefix("error.") in _ERRORS]
    if not any(trial.seconds for trial in trials):
        names = [name for name in names if name != "seconds"]
    rows = tuple(tuple(_cell(table[name][row]) for name in names) for row in range(len(table)))
    return tuple(name.removeprefix("error.") for name in names), rows


def shown_values(values: Mapping[str, Any], left_out: Sequence[str] = ()) -> dict[str, str]:
    """A record's parameters or measurement in words: arrays by their shape, numbers and text as they are."""
    found = {}
    for name, value in values.items():
        if name not in left_out:
            array = np.asarray(value)
            short = array.ndim == 1 and array.size <= 4
            found[name] = " ".join(f"{one:g}" for one in array) if short else _words(array, value)
    return found


def _words(array: np.ndarray, value: Any) -> str:
    return f"{array.dtype} {' x '.join(map(str, array.shape))}" if array.ndim else str(value)


def _cell(value: Any) -> Any:
    plain = value.item() if isinstance(value, np.generic) else value
    return plain.decode("utf-8") if isinstance(plain, bytes) else plain
