"""Readings of a display: the codes sent, and the XYZ measured by an instrument."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, Int

from ...runtime.errors import InputError
from ...spectral.observers import EFFICACY, observer

# Codes nearer than this are one patch: a quarter of a step of 12 bits.
_SAME_CODE = 1.0 / 16384.0
# Share of the largest luminance by which an instrument's noise may go below zero.
_NEGATIVE_SHARE = 1e-3


@dataclass(frozen=True, eq=False)
class ReadingSpectra:
    """Spectral radiance (N,L), W/(sr m2 nm), one row per reading; small negative values are noise and are kept."""

    wavelengths_nm: Float[np.ndarray, " L"]
    radiance: Float[np.ndarray, "N L"]

    def xyz(self, observer_name: str) -> Float[np.ndarray, "N 3"]:
        """Compute XYZ with Y in cd/m2 (CIE 015:2018 eq. 7.1 with K_m)."""
        weights = observer(observer_name).sensitivity(self.wavelengths_nm)
        return EFFICACY * self.radiance @ weights.T


@dataclass(frozen=True, eq=False)
class Readings:
    """Patches of one display in the order in which they were shown.

    Parameters
    ----------
    codes : (N,3) sent to the display, 0 to 1.
    xyz : (N,3) measured; Y in cd/m2, or relative to white = 100 if `absolute` is false.
    source : file, for messages.
    display, instrument, observer : as stated by the file, else "".
    absolute : True if XYZ are cd/m2.
    spectra : radiance of the same readings, if the instrument provided it.
    primaries : spectra (M,L) of the display's primaries and of mixtures of them, in any unit, if known from elsewhere.
    measured : time, ISO 8601, as stated by the file, else "".
    details : other content of the file.
    notes : assumptions, conversions and corrections, a sentence each.
    repeats : number of readings averaged in each.
    """

    codes: Float[np.ndarray, "N 3"]
    xyz: Float[np.ndarray, "N 3"]
    source: str = ""
    display: str = ""
    instrument: str = ""
    observer: str = "1931_2"
    absolute: bool = True
    spectra: ReadingSpectra | None = None
    measured: str = ""
    details: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    repeats: Int[np.ndarray, " N"] | int = 1
    primaries: ReadingSpectra | None = None

    def __post_init__(self) -> None:
        _check(self)

    def __len__(self) -> int:
        return len(self.codes)

    @property
    def groups(self) -> tuple[Float[np.ndarray, "M 3"], Int[np.ndarray, " N"]]:
        """Distinct patches in order of first appearance, and the patch of each reading."""
        rounded = np.round(self.codes / _SAME_CODE).astype(np.int64)
        _, first, which = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
        rank = np.empty(len(first), dtype=np.int64)
        rank[np.argsort(first)] = np.arange(len(first))
        return self.codes[np.sort(first)], rank[which.reshape(-1)]

    @property
    def whites(self) -> Int[np.ndarray, " W"]:
        """Indices of the readings of full white."""
        return np.flatnonzero((self.codes >= 1.0 - _SAME_CODE).all(axis=1))

    @property
    def blacks(self) -> Int[np.ndarray, " B"]:
        """Indices of the readings of code 0."""
        return np.flatnonzero((self.codes <= _SAME_CODE).all(axis=1))

    @property
    def white_xyz(self) -> Float[np.ndarray, "3"]:
        """Mean of the readings of white.

        Raises
        ------
        InputError : there is none.
        """
        if not self.whites.size:
            raise InputError(
                "no reading of white",
                file=self.source or None,
                field="codes",
                found=f"largest codes {np.array2string(self.codes.max(axis=0), precision=3)}",
                expected="at least one reading of full red, green and blue together",
                hint="measure white as well; `metamer display patches` has it among its patches",
            )
        return self.xyz[self.whites].mean(axis=0)

    @property
    def channel_light(self) -> Float[np.ndarray, "3 3"] | None:
        """XYZ of full red, green and blue alone, a row each, less black if it was read; None if one is missing."""
        averaged = self.averaged()
        alone = [np.flatnonzero((np.abs(averaged.codes - unit) < 1e-6).all(axis=1)) for unit in np.eye(3)]
        if not all(rows.size for rows in alone):
            return None
        black = averaged.xyz[averaged.blacks].mean(axis=0) if averaged.blacks.size else np.zeros(3)
        return np.stack([averaged.xyz[rows[0]] for rows in alone]) - black

    def averaged(self) -> Readings:
        """Average the readings of each patch, in order of first appearance."""
        codes, which = self.groups
        if len(codes) == len(self):
            return self
        count = np.bincount(which)[:, None]
        xyz = np.stack([np.bincount(which, self.xyz[:, at]) for at in range(3)], axis=1) / count
        spectra = self.spectra
        if spectra is not None:
            summed = np.zeros((len(codes), spectra.radiance.shape[1]))
            np.add.at(summed, which, spectra.radiance)
            spectra = replace(spectra, radiance=summed / count)
        return replace(self, codes=codes, xyz=xyz, spectra=spectra, repeats=count[:, 0])

    def taken(self, which: Int[np.ndarray, " M"] | np.ndarray) -> Readings:
        """Select some of the readings, by index or mask."""
        spectra = self.spectra
        if spectra is not None:
            spectra = replace(spectra, radiance=spectra.radiance[which])
        repeats = self.repeats if isinstance(self.repeats, int) else self.repeats[which]
        return replace(self, codes=self.codes[which], xyz=self.xyz[which], spectra=spectra, repeats=repeats)

    def seen_by(self, name: str) -> Readings:
        """Return the same readings for another observer.

        Raises
        ------
        InputError : there are no spectra, so that XYZ for other observers are unknown.
        """
        if observer(name).name == observer(self.observer).name:
            return self
        if self.spectra is None:
            raise InputError(
                "readings of another observer",
                file=self.source or None,
                field="observer",
                found=f"XYZ of {observer(self.observer).name}, without spectra",
                expected=f"spectra, or XYZ of {observer(name).name}",
                hint="measure with a spectrometer, or take the observer that was measured for",
            )
        return replace(self, xyz=self.spectra.xyz(name), observer=name)

    @property
    def repeatability(self) -> Float[np.ndarray, "3"] | None:
        """Relative standard deviation of repeated readings; None without repeats of bright patches.

        Patches below a hundredth of white are left out, since their noise is not proportional to the reading.
        """
        codes, which = self.groups
        bright = self.xyz[:, 1] > 0.01 * self.xyz[:, 1].max()
        squares, freedom = np.zeros(3), 0
        for patch in range(len(codes)):
            mine = self.xyz[(which == patch) & bright]
            if len(mine) > 1:
                squares += np.sum((mine / mine.mean(axis=0) - 1.0) ** 2, axis=0)
                freedom += len(mine) - 1
        return np.sqrt(squares / freedom) if freedom else None


def _check(readings: Readings) -> None:
    codes, xyz, where = readings.codes, readings.xyz, readings.source or None
    if codes.shape != xyz.shape or codes.ndim != 2 or not len(codes):
        raise InputError(
            "no readings",
            file=where,
            field="codes and XYZ",
            found=f"{codes.shape} codes, {xyz.shape} XYZ",
            expected="three codes and XYZ of each patch, one patch at least",
        )
    for name, values in (("codes", codes), ("XYZ", xyz)):
        if not np.isfinite(values).all():
            row = int(np.argwhere(~np.isfinite(values))[0, 0])
            raise InputError(
                "not a number",
                file=where,
                field=f"{name} of reading {row + 1}",
                found=np.array2string(values[row], precision=4),
                expected="three numbers",
                hint="remove the reading, or measure the patch again",
            )
    if codes.min() < 0.0 or codes.max() > 1.0:
        raise InputError(
            "codes beyond their scale",
            file=where,
            field="codes",
            found=f"{codes.min():g} to {codes.max():g} of full scale",
            expected="0 to 1 of full scale",
            hint="say which number is full scale: --codes 1, 100, 255 or 1023",
        )
    largest = float(xyz[:, 1].max())
    if largest <= 0.0:
        raise InputError(
            "no patch sends any light",
            file=where,
            field="XYZ",
            found=f"largest Y {largest:g}",
            expected="a display that is switched on, and an instrument in front of it",
        )
    low = np.flatnonzero(xyz.min(axis=1) < -_NEGATIVE_SHARE * largest)
    if low.size:
        row = int(low[0])
        raise InputError(
            "a negative reading",
            file=where,
            field=f"XYZ of reading {row + 1}, codes {np.array2string(codes[row], precision=3)}",
            found=np.array2string(xyz[row], precision=4),
            expected=f"0 or more; noise down to {-_NEGATIVE_SHARE * largest:.2g} is let pass",
            hint="calibrate the instrument's dark level, and measure again",
        )
