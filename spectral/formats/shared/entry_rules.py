"""Spectra as a reader finds them become entries: one set of rules for what is converted, said and refused."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ....runtime.errors import InputError
from ...spectrum import Quantity, Spectrum, check_values
from ...wavelengths import validated_wavelengths
from ..registry import SpectralEntry, SpectralFile, StatedColour
from .decisions import Decision, Divisor, taken_words
from .text import shortened

#: Spectra in one file, and samples in all of them together.
MOST_SPECTRA, MOST_SAMPLES = 100_000, 50_000_000
# No spectrometer has more pixels, and what resamples a spectrum takes memory by the product of both sides' samples.
_FINEST = 5000

# Depth below zero allowed to a dark reading: as a share of the peak for emission, of 1 for the rest.
_DARK_EMISSION, _DARK = 0.05, 0.01
# The most that a reflectance above 1 may be and pass for a radiance factor: gloss and effect pigments reach a few, and
# percent that were taken for fractions are far above.
_LARGEST_FACTOR = 10.0
# No measured value in any unit in use is larger; beyond it, squares leave float64.
_LARGEST = 1e30
#: Values at or below this one are flags of libraries for "deleted", such as -1.23e34 of the USGS.
DELETED = -1e30
# A reading above zeros that does not come near them: as a share of the largest, and in steps to the next.
_NEAR_ZERO, _STEPS = 0.01, 4.0
# Wavelengths that make a colour. Beyond them a spectrometer may read noise, over a white that gave no light either.
_VISIBLE = (380.0, 780.0)
# Wavelengths that are kept of spectra of more than `_FINEST` samples, with room for the ends of interpolation.
_NEAR = (300.0, 1100.0)
# Largest transmittance of clear glass, with the error of an instrument.
_CLEAR = 1.01


def in_visible(grid: np.ndarray) -> np.ndarray:
    """Select the wavelengths (L,), in nm, that make a colour."""
    return (grid >= _VISIBLE[0]) & (grid <= _VISIBLE[1])


class Gathering:
    """The entries of one file, those that were refused, and notes, each kind said once with the names it is about."""

    def __init__(self, path: Path, format_name: str) -> None:
        self.path, self.format = path, format_name
        self.entries: list[SpectralEntry] = []
        self.rejected: list[tuple[str, InputError]] = []
        self._notes: dict[str, list[str]] = {}
        self._samples = 0
        self._grids: dict[bytes, np.ndarray] = {}

    def note(self, sentence: str, name: str | None = None) -> None:
        """Say something of the file, or of one of its spectra."""
        names = self._notes.setdefault(sentence, [])
        if name is not None:
            names.append(name)

    def ascending(self, name: str, grid: np.ndarray, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points (L,) that each state their wavelength, in the order of these, with a note where the file has another.

        Only for formats whose points stand alone: in a table, wavelengths out of order are a mistake.
        """
        if not (np.diff(grid) < 0).any():
            return grid, samples
        self.note("points stand in another order in the file and were sorted by wavelength", name)
        order = np.argsort(grid, kind="stable")
        return grid[order], samples[order]

    def add(
        self,
        name: str,
        wavelengths_nm: object,
        values: object,
        quantity: Quantity,
        *,
        divisor: float = 1.0,
        stated: tuple[StatedColour, ...] = (),
        details: Mapping[str, str] | None = None,
        taken: str = "",
    ) -> None:
        """Take one spectrum: `values` (L,) over `divisor` at `wavelengths_nm` (L,), NaN where there is no sample.

        Descending wavelengths are turned round, samples without a value left out, readings of nothing that fall a
        little below zero taken as zero, and a reflectance above 1 called a radiance factor, each with a note. What
        cannot be used goes among `rejected`. `taken` is kept beside it.
        """
        name = shortened(name, 200)
        grid, samples = np.asarray(wavelengths_nm, dtype=np.float64), np.asarray(values, dtype=np.float64)
        self._samples += samples.size
        if len(self.entries) + len(self.rejected) >= MOST_SPECTRA or self._samples > MOST_SAMPLES:
            raise InputError(
                "too many spectra in one file",
                found=f"more than {MOST_SPECTRA} spectra or {MOST_SAMPLES} samples",
                hint="split the file",
            )
        said = dict(details or {})
        try:
            spectrum = self._spectrum(name, grid, samples, divisor, quantity, said)
        except InputError as reason:
            self.rejected.append((name, reason))
            return
        if taken and spectrum.quantity != quantity:
            taken = f"{spectrum.quantity}, above 1; {taken}"
        self.entries.append(SpectralEntry(name, spectrum, stated, said, taken))

    def take(
        self,
        name: str,
        wavelengths_nm: object,
        values: object,
        decision: Decision,
        scale: Divisor | None,
        **beside: Any,
    ) -> None:
        """`add` one spectrum of what was decided, on its scale, which an emission has not; `beside` is passed on."""
        if scale and scale.note:
            self.note(scale.note)
        self.add(
            name,
            wavelengths_nm,
            values,
            decision.quantity,
            divisor=scale.by if scale else 1.0,
            taken=taken_words(decision, None if decision.quantity == "emission" else scale),
            **beside,
        )

    def add_of_format(
        self,
        name: str,
        wavelengths_nm: object,
        values: object,
        quantity: Quantity,
        scale: Divisor | None,
        **beside: Any,
    ) -> None:
        """`add` one spectrum of what its format says, on the scale that a person may say instead."""
        answered = scale if scale and scale.words.startswith("--scale") else None
        taken = taken_words(Decision(quantity, answered.words, False), answered._replace(words="")) if answered else ""
        if scale and scale.note:
            self.note(scale.note)
        divisor = scale.by if scale else 1.0
        self.add(name, wavelengths_nm, values, quantity, divisor=divisor, taken=taken, **beside)

    def _spectrum(
        self, name: str, grid: np.ndarray, samples: np.ndarray, divisor: float, quantity: Quantity, said: dict[str, str]
    ) -> Spectrum:
        deleted = samples <= DELETED
        if deleted.any():
            self.note("samples that the file flags as deleted (-1.23e34) are left out", name)
            grid, samples = _without(deleted, "deleted samples", grid, samples, said)
        missing = np.isnan(samples)
        if missing.any():
            self.note("samples without a value are left out", name)
            grid, samples = _without(missing, "missing samples", grid, samples, said)
        if grid.size > 1 and (np.diff(grid) < 0).all():
            self.note("wavelengths descend in the file and are turned round", name)
            grid, samples = grid[::-1], samples[::-1]
        _check_enough(samples, name)
        beyond = ~(np.abs(samples) < _LARGEST)
        if beyond.any():
            raise InputError(
                "a value is out of range",
                field=name,
                found=f"{samples[beyond][0]:g}",
                expected=f"less than {_LARGEST:g}",
            )
        grid, samples = validated_wavelengths(grid, field=name), samples / divisor
        grid, samples = self._without_noise(name, grid, samples, quantity, said)
        grid, samples = self._near_visible(name, grid, samples, said)
        _check_enough(samples, name)
        negative = samples < 0.0
        floor = _DARK_EMISSION * float(samples.max()) if quantity == "emission" else _DARK
        if negative.any() and samples.min() >= -floor:
            self.note("values a little below zero, readings of nothing, are taken as zero", name)
            said["negative samples"] = f"{np.count_nonzero(negative)} of {samples.size}, down to {samples.min():.3g}"
            samples = np.maximum(samples, 0.0)
        if quantity == "transmittance" and 1.0 < samples.max() <= _CLEAR:
            self.note("transmittance a little above 1, within the error of a reading, is taken as 1", name)
            said["samples above 1"] = f"{np.count_nonzero(samples > 1.0)} of {samples.size}, up to {samples.max():.4g}"
            samples = np.minimum(samples, 1.0)
        if quantity == "reflectance" and samples.max() > _LARGEST_FACTOR:
            raise InputError(
                "reflectance looks like percent",
                field=name,
                found=f"{samples.max():g}" + (f", divided by {divisor:g} already" if divisor != 1.0 else ""),
                expected=f"fractions of 1; radiance factors up to {_LARGEST_FACTOR:g}",
                hint="correct the unit or the norm that the file states",
            )
        if quantity == "reflectance" and samples.max() > 1.0 + 1e-9 and samples.min() >= 0.0:
            self.note("reflectance above 1 is held as a radiance factor", name)
            quantity = "radiance factor"
        check_values(samples, grid, quantity, field=name)
        largest = float(samples.max()) if quantity == "emission" else 1.0
        if _breaks_off(samples, largest) or _breaks_off(samples[::-1], largest):
            self.note("zeros at an end, to which readings do not fall, are taken as read; leave such cells empty", name)
        return Spectrum(samples, self._shared(grid, name), quantity)

    def _without_noise(
        self, name: str, grid: np.ndarray, samples: np.ndarray, quantity: Quantity, said: dict[str, str]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Samples less those beyond the visible that the quantity cannot be, where all visible ones can."""
        if quantity == "emission":
            wrong = samples < -_DARK_EMISSION * float(samples.max())
        else:
            limit = {"reflectance": 1.0 + 1e-9, "transmittance": _CLEAR}.get(quantity, np.inf)
            wrong = (samples < -_DARK) | (samples > limit)
        seen = in_visible(grid)
        if not wrong.any() or not seen.any() or wrong[seen].any():
            return grid, samples
        low, high = _VISIBLE
        self.note(f"samples beyond {low:g} to {high:g} nm that no {quantity} can be, noise, are left out", name)
        span = f"{samples[wrong].min():.3g} to {samples[wrong].max():.3g}"
        said["noise beyond the visible"] = f"{np.count_nonzero(wrong)} of {wrong.size} samples, {span}"
        return grid[~wrong], samples[~wrong]

    def _near_visible(
        self, name: str, grid: np.ndarray, samples: np.ndarray, said: dict[str, str]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Samples less those far from the visible, where a spectrometer of the infrared took more than are kept."""
        low, high = _NEAR
        near = (grid >= low) & (grid <= high)
        if grid.size <= _FINEST or near.all() or not near.any():
            return grid, samples
        self.note(f"samples beyond {low:g} to {high:g} nm, which make no colour, are left out: they are too many", name)
        said["samples beyond the visible"] = f"{np.count_nonzero(~near)} of {grid.size}, to {grid[-1]:g} nm"
        return grid[near], samples[near]

    def _shared(self, grid: np.ndarray, name: str) -> np.ndarray:
        """One array for all spectra on the same wavelengths."""
        key = grid.tobytes()
        if key not in self._grids:
            if grid.size > _FINEST:
                raise InputError(
                    "sampled too finely",
                    field=name,
                    found=f"{grid.size} samples",
                    expected=f"at most {_FINEST} samples a spectrum",
                    hint="export at 1 nm",
                )
            self._grids[key] = grid
        return self._grids[key]

    def finish(self, details: Mapping[str, str] | None = None) -> SpectralFile:
        """Return the file as read.

        Raises
        ------
        InputError
            No spectrum of it can be used: the reason of the first.
        """
        if not self.entries:
            if not self.rejected:
                raise InputError("no spectra in this file", expected="at least one spectrum")
            first = self.rejected[0][1]
            if len(self.rejected) == 1:
                raise first
            problem = f"none of {len(self.rejected)} spectra can be used, the first for this: {first.problem}"
            raise first.at(problem=problem)
        names = [entry.name for entry in self.entries]
        if len(set(names)) < len(names):
            self.note("some spectra share a name; they stay apart, in the order of the file")
        notes = tuple(_sentence(sentence, about, len(names)) for sentence, about in self._notes.items())
        rejected = tuple((name, reason.at(file=self.path)) for name, reason in self.rejected)
        return SpectralFile(self.format, tuple(self.entries), dict(details or {}), notes, rejected)


def _breaks_off(samples: np.ndarray, largest: float) -> bool:
    """Return whether samples (L,) begin with two zeros or more, and those behind do not come near them, as a share of
    the largest that there may be.
    """
    begun = samples.nonzero()[0][:1]
    if samples[:2].any() or not begun.size or begun[0] + 1 >= samples.size:
        return False
    first, second = samples[begun[0] : begun[0] + 2]
    return bool(first > _NEAR_ZERO * largest and first > _STEPS * abs(second - first))


def _check_enough(samples: np.ndarray, name: str) -> None:
    if samples.size < 2:
        raise InputError("not a spectrum", field=name, found=f"{samples.size} samples", expected="two samples or more")


def _without(
    wrong: np.ndarray, called: str, grid: np.ndarray, samples: np.ndarray, said: dict[str, str]
) -> tuple[np.ndarray, np.ndarray]:
    said[called] = f"{np.count_nonzero(wrong)} of {wrong.size}"
    return grid[~wrong], samples[~wrong]


def _sentence(sentence: str, names: list[str], everything: int) -> str:
    if not names or (len(names) == everything == 1):
        return sentence
    if len(names) >= everything:
        return f"{sentence} (all {everything} spectra)"
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return f"{sentence} ({', '.join(names[:3])}{more})"
