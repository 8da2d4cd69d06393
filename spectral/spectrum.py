"""Spectrum with its axis and its quantity: the type at every interface."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Literal, cast, get_args

import numpy as np
from jaxtyping import Float

from ..runtime.errors import InputError
from .axis_letters import Wavelengths
from .foreign_spectra import KINDS, foreign_curves
from .projection import projected, tent_means
from .wavelengths import (
    WORKING_WAVELENGTHS_NM,
    Extrapolation,
    interpolation_matrix,
    is_finer,
    validated_wavelengths,
)

__all__ = ["WORKING_WAVELENGTHS_NM", "Quantity", "Spectrum", "interpolation_matrix", "validated_wavelengths"]

Quantity = Literal["reflectance", "transmittance", "radiance factor", "emission"]
# Quantities that may exceed 1: radiance factors compare with the perfect diffuser, which fluorescence, effect pigments
# and the side of the mirror exceed.
_UNBOUNDED = ("radiance factor", "emission")
# Below, numbers are rather percent than wavelengths, nm.
_SHORTEST_NM = 200.0
_ORDER = "samples come first: Spectrum(samples, wavelengths_nm), or Spectrum((wavelengths_nm, samples))"


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Spectrum:
    """Samples over wavelengths, and their quantity.

    Scripts may pass a single argument, as to `Spectrum.of`.

    Parameters
    ----------
    samples : (...,L) float64, finite. Reflectance and transmittance lie in [0, 1]; emission is not negative, in W.nm^-1
        per the area or solid angle that the owner states; nor is a radiance factor, which is relative to the perfect
        diffuser and may exceed 1.
    wavelengths_nm : (L,) nm, ascending, as returned by `validated_wavelengths`; spectra may share the array.
    quantity : "reflectance", "transmittance", "radiance factor" or "emission"; quantities never mix silently.

    Examples
    --------
    >>> grey = Spectrum.sampled([400.0, 700.0], [0.5, 0.5], "reflectance")
    >>> grey
    <Spectrum of reflectance, 400 to 700 nm: 2 samples>
    >>> grey.resampled(np.array([380.0, 550.0])).samples
    array([0.5, 0.5])
    >>> 0.5 * grey + 0.5 * Spectrum({400.0: 0.1, 700.0: 0.3})
    <Spectrum of reflectance, 400 to 700 nm: 2 samples>
    """

    samples: Float[np.ndarray, "..."]
    wavelengths_nm: Wavelengths
    quantity: Quantity

    # numpy's numbers and arrays leave products with a spectrum to it.
    __array_ufunc__ = None

    def __init__(self, samples: Any, wavelengths_nm: Any = None, quantity: Quantity = "reflectance") -> None:
        if wavelengths_nm is None:
            taken = Spectrum.of(samples, quantity)
            samples, wavelengths_nm, quantity = taken.samples, taken.wavelengths_nm, taken.quantity
        elif not isinstance(wavelengths_nm, np.ndarray) or not wavelengths_nm.size or wavelengths_nm.flat[0] < 10.0:
            try:
                wavelengths_nm = validated_wavelengths(wavelengths_nm)
            except InputError as reason:
                raise reason.at(hint=_ORDER if _is_axis(samples) else None) from None
        object.__setattr__(self, "samples", samples)
        object.__setattr__(self, "wavelengths_nm", wavelengths_nm)
        object.__setattr__(self, "quantity", quantity)
        try:
            self.__post_init__()
        except InputError as reason:
            # Percent are no wavelengths, but no smaller than some.
            percent = np.size(wavelengths_nm) and np.max(wavelengths_nm) < _SHORTEST_NM
            exchanged = percent and _is_axis(samples) and np.max(samples) >= _SHORTEST_NM
            raise reason.at(hint=_ORDER) if exchanged else reason from None

    def __post_init__(self) -> None:
        samples = np.asarray(self.samples, dtype=np.float64)
        object.__setattr__(self, "samples", samples)
        if self.quantity not in get_args(Quantity):
            raise InputError(
                "unknown quantity",
                field="quantity",
                found=repr(self.quantity),
                expected=", ".join(get_args(Quantity)),
            )
        if samples.ndim == 0 or samples.shape[-1] != self.wavelengths_nm.size:
            raise InputError(
                "values do not fit the wavelengths",
                field="values",
                found=f"shape {samples.shape}",
                expected=f"(..., {self.wavelengths_nm.size})",
            )
        check_values(samples, self.wavelengths_nm, self.quantity)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        """Return a copy of the samples, for functions of numpy: numbers without wavelengths and quantity."""
        if copy is False:
            raise ValueError("the samples of a spectrum are copied: ask for spectrum.samples")
        return np.array(self.samples, dtype=dtype)

    def __repr__(self) -> str:
        low, high = self.wavelengths_nm[[0, -1]]
        shape = " x ".join(map(str, self.samples.shape))
        return f"<Spectrum of {self.quantity}, {low:g} to {high:g} nm: {shape} samples>"

    @classmethod
    def sampled(cls, wavelengths_nm: object, values: object, quantity: Quantity = "reflectance") -> Spectrum:
        """Spectrum from samples: `wavelengths_nm` (L,) ascending nm, `values` (...,L)."""
        return cls(np.asarray(values, dtype=np.float64), validated_wavelengths(wavelengths_nm), quantity)

    @classmethod
    def of(cls, value: object, quantity: Quantity = "reflectance") -> Spectrum:
        """Make one spectrum from an object of another library, or of plain Python.

        Parameters
        ----------
        value : a `Spectrum`, which is returned as it is, or one of `foreign_spectra.KINDS`; values are fractions, of
            emission in any unit.

        Raises
        ------
        InputError : nothing of the kind, several spectra, or values that the quantity cannot have.

        >>> Spectrum.of({400.0: 0.2, 700.0: 0.4})
        <Spectrum of reflectance, 400 to 700 nm: 2 samples>
        """
        if isinstance(value, Spectrum):
            return value
        found = foreign_curves(value)
        if found is None or len(found) != 1:
            what = repr(value)[:80] if found is None else f"{len(found)} spectra"
            hint = "metamer.read_spectra(file) reads a file" if isinstance(value, str | Path) else None
            raise InputError(
                "no spectrum", field="value", found=what, expected=f"one of a Spectrum, {KINDS}", hint=hint
            )
        try:
            return cls.sampled(found[0][1], found[0][2], quantity)
        except InputError as reason:
            if found[0][1].max() < _SHORTEST_NM and found[0][2].min() >= _SHORTEST_NM:
                hint = "wavelengths come first in a pair: (wavelengths_nm, values)"
                raise reason.at(field="value", hint=hint) from None
            if quantity == "emission" or not (found[0][2] > 1.0).any():
                raise
            raise reason.at(hint=f'{reason.hint}; a lamp is a spectrum of quantity="emission"') from None

    def xyz(self, light: object = None, observer: object = "1931_2") -> Float[np.ndarray, "... 3"]:
        """Compute XYZ (...,3) as `spectrum_colour.xyz`: under D65 by default; Y = 1 is perfect white."""
        return _colour("xyz")(self, light, observer)

    def lab(self, light: object = None, observer: object = "1931_2") -> Float[np.ndarray, "... 3"]:
        """Compute CIELAB (...,3) relative to the white of the light; parameters and errors as of `xyz`."""
        return _colour("lab")(self, light, observer)

    def to_colour(self) -> Any:
        """Make a `colour.SpectralDistribution`, or of (n,L) samples `colour.MultiSpectralDistributions`."""
        return _colour("to_colour")(self)

    def plot(self, axes: Any = None, **style: Any) -> Any:
        """Draw the curve with matplotlib, as `spectrum_colour.plot`; returns the axes."""
        return _colour("plot")(self, axes, **style)

    def _repr_html_(self) -> str:
        return _colour("as_html")(self)

    def __mul__(self, other: object) -> Spectrum:
        """Multiply by a number, or by a spectrum on the same wavelengths: light by surface, filter by filter."""
        if isinstance(other, Spectrum):
            self._check_same_grid(other)
            emissions = [one for one in (self, other) if one.quantity == "emission"]
            if len(emissions) == 2:
                raise InputError("a product of two lights", field="quantity", expected="a light and what it meets")
            kinds = {self.quantity, other.quantity}
            both = self.quantity if len(kinds) == 1 else "emission" if emissions else "radiance factor"
            return Spectrum(self.samples * other.samples, self.wavelengths_nm, both)
        if not _is_number(other):
            return NotImplemented
        return Spectrum(self.samples * float(cast(float, other)), self.wavelengths_nm, self.quantity)

    __rmul__ = __mul__

    def __truediv__(self, other: object) -> Spectrum:
        """Divide by a number that is not 0."""
        if not _is_number(other):
            return NotImplemented
        if other == 0:
            raise InputError("a spectrum divided by 0", field="divisor", found=other, expected="another number")
        return self * (1.0 / float(cast(float, other)))

    def __add__(self, other: object) -> Spectrum:
        """Add a spectrum of the same quantity on the same wavelengths: lights, or parts of a mixture."""
        return self._combined(other, 1.0)

    def __sub__(self, other: object) -> Spectrum:
        """Subtract a spectrum of the same quantity on the same wavelengths; none may become negative."""
        return self._combined(other, -1.0)

    def _combined(self, other: object, sign: float) -> Spectrum:
        if not isinstance(other, Spectrum):
            return NotImplemented
        self._check_same_grid(other)
        if self.quantity != other.quantity:
            raise InputError("quantities do not mix", field="quantity", found=other.quantity, expected=self.quantity)
        return Spectrum(self.samples + sign * other.samples, self.wavelengths_nm, self.quantity)

    def _check_same_grid(self, other: Spectrum) -> None:
        if not np.array_equal(self.wavelengths_nm, other.wavelengths_nm):
            low, high = other.wavelengths_nm[[0, -1]]
            mine = self.wavelengths_nm
            raise InputError(
                "spectra on other wavelengths",
                field="wavelengths_nm",
                found=f"{low:g} to {high:g} nm, {other.wavelengths_nm.size} samples",
                expected=f"{mine[0]:g} to {mine[-1]:g} nm, {mine.size} samples",
                hint="resample one: other.resampled(one.wavelengths_nm)",
            )

    @property
    def key(self) -> tuple[bytes, bytes]:
        """Key that is equal for spectra of the same wavelengths and values, in any objects."""
        return self.wavelengths_nm.tobytes(), self.samples.tobytes()

    def resampled(self, wavelengths_nm: Wavelengths, extrapolation: Extrapolation = "hold") -> Spectrum:
        """Resample the spectrum; `projected` is for a coarser grid, which would lose detail between its samples.

        Reflectance, transmittance, radiance factor: Sprague (CIE 167:2005) on uniform grids, else linear. Emission:
        linear, so that a line never rings below zero. If Sprague leaves [0, 1] next to a steep edge (radiance factor:
        falls below 0), that spectrum is interpolated linearly instead: nothing is clipped.

        Parameters
        ----------
        extrapolation : beyond the measured range: hold the nearest value, "zero", or "error". `range_note` words it.
        """
        if np.array_equal(wavelengths_nm, self.wavelengths_nm):
            return self
        grid = self.wavelengths_nm
        linear = interpolation_matrix(grid, wavelengths_nm, extrapolation, "linear")
        values = self.samples @ linear.T
        if self.quantity != "emission":
            smooth = self.samples @ interpolation_matrix(grid, wavelengths_nm, extrapolation).T
            highest = np.inf if self.quantity in _UNBOUNDED else 1.0
            bounded = ((smooth >= 0) & (smooth <= highest)).all(axis=-1, keepdims=True)
            values = np.where(bounded, smooth, values)
        return Spectrum.sampled(wavelengths_nm, values, self.quantity)

    def projected(self, wavelengths_nm: Wavelengths) -> Spectrum:
        """Project the spectrum to a coarser grid by least squares (`projection.projected`), clamped at the ends.

        Reflectance and transmittance from 0 to 1, radiance factor from 0. If this one is no finer: `resampled`.

        Raises
        ------
        InputError : an emission, whose lines no coarser grid resolves. Fold it with an observer instead.
        """
        if self.quantity == "emission":
            raise InputError(
                "lamps are not thinned", field="quantity", found=self.quantity, expected="a reflectance", hint="fold it"
            )
        if not is_finer(self.wavelengths_nm, wavelengths_nm):
            return self.resampled(wavelengths_nm)
        highest = np.inf if self.quantity in _UNBOUNDED else 1.0
        values = projected(self.samples, self.wavelengths_nm, wavelengths_nm, highest)
        return Spectrum.sampled(wavelengths_nm, values, self.quantity)

    def averaged(self, wavelengths_nm: Wavelengths) -> Spectrum:
        """Average an emission on a coarser grid, with weights from 1 at each sample to 0 at the next one.

        The linear interpolant preserves the emission's power within the grid, and its centroid: lines between samples
        are distributed, where `resampled` misses them. If this one is no finer: `resampled`.
        """
        if not is_finer(self.wavelengths_nm, wavelengths_nm):
            return self.resampled(wavelengths_nm)
        return Spectrum.sampled(
            wavelengths_nm, tent_means(self.samples, self.wavelengths_nm, wavelengths_nm), self.quantity
        )

    def range_note(self, wavelengths_nm: Wavelengths, extrapolation: Extrapolation = "hold") -> str | None:
        """Describe the values that `resampled` extrapolates; None if the measurement covers the whole grid."""
        low, high = self.wavelengths_nm[[0, -1]]
        if wavelengths_nm[0] >= low and wavelengths_nm[-1] <= high:
            return None
        how = {"hold": "its end values are repeated", "zero": "it is taken as zero", "error": "that is an error"}[
            extrapolation
        ]
        return f"known from {low:g} to {high:g} nm; from {wavelengths_nm[0]:g} to {wavelengths_nm[-1]:g} nm, {how}"


def _colour(name: str) -> Callable[..., Any]:
    """Return a function of the module of colours, which imports this one and is loaded on demand."""
    return getattr(import_module(".spectrum_colour", __package__), name)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)


def as_float(number: int | float) -> float:
    """Convert a number to float; an integer beyond all floats becomes infinite, for later checks to refuse.

    >>> as_float(3), as_float(-(10**400))
    (3.0, -inf)
    """
    try:
        return float(number)
    except OverflowError:
        return math.inf if number > 0 else -math.inf


def check_values(
    values: np.ndarray,
    wavelengths_nm: Wavelengths,
    quantity: str,
    *,
    file: str | Path | None = None,
    field: str = "values",
) -> None:
    """Raise an `InputError` if samples (...,L) are invalid for their quantity."""

    if not np.isfinite(values).all():
        raise InputError(
            f"{quantity} is not a number",
            file=file,
            field=field,
            found=_first(~np.isfinite(values), values, wavelengths_nm),
            expected="finite values",
            hint="remove the sample or measure it again",
        )
    if (values < 0).any():
        raise InputError(
            f"negative {quantity}",
            file=file,
            field=field,
            found=_first(values < 0, values, wavelengths_nm),
            expected=">= 0",
            hint="subtract the dark reading properly, or remove the sample",
        )
    if quantity in _UNBOUNDED or not (values > 1.0 + 1e-9).any():
        return
    if values.max() > 2.0:
        raise InputError(
            f"{quantity} looks like percent",
            file=file,
            field=field,
            found=_first(values == values.max(), values, wavelengths_nm),
            expected="fractions from 0 to 1",
            hint="divide by 100",
        )
    raise InputError(
        f"{quantity} above 1",
        file=file,
        field=field,
        found=_first(values > 1.0 + 1e-9, values, wavelengths_nm),
        expected="from 0 to 1",
        hint="check the white calibration; fluorescence or gloss in the reading also does this",
    )


def _is_axis(values: Any) -> bool:
    """Return True for possible wavelengths."""
    try:
        validated_wavelengths(values)
    except InputError:
        return False
    return True


def _first(which: np.ndarray, values: np.ndarray, wavelengths_nm: Wavelengths) -> str:
    """Describe the first of some samples."""
    place = tuple(np.argwhere(which)[0])
    return f"{values[place]:g} at {wavelengths_nm[place[-1]]:g} nm"
