"""Characterisation of a display from readings: checks, removal of drift, choice of a model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.difference import delta_e_xyz
from .choice import choose
from .drift import without_drift
from .readings import Readings
from .record import DisplayRecord

# ΔE94 of a reading from the model, and times the median of all, from which on it is not the display's.
_MISREAD, _MISREAD_TIMES = 5.0, 10.0
# Shares of white's light: below the first a channel alone at full code is stuck; the least a brighter code must add.
_STUCK, _CLIPPED = 0.01, 0.002


@dataclass(frozen=True, eq=False)
class Characterised:
    """Result of a characterisation.

    record : of the display. warnings : those of its notes that cast doubt on the readings.
    """

    record: DisplayRecord
    warnings: tuple[str, ...]


def characterise(readings: Readings, name: str = "", model: str = "auto", observer: str | None = None) -> Characterised:
    """Characterise a display; return a record with notes on the readings.

    name : of the display, if "" that of the readings. observer : another than that of the readings, by their spectra.

    Raises
    ------
    InputError : too few patches, no white or black; a channel that is stuck; a model that cannot follow the display.
    """
    seen = readings.seen_by(observer) if observer else readings
    seen.white_xyz  # noqa: B018 (refuses readings without one)
    _refuse_stuck(seen)
    drift = without_drift(seen)
    whites = _other_whites(seen)
    try:
        choice = choose(drift.readings, model)
    except InputError as reason:
        raise (reason.at(hint=whites) if whites else reason) from None
    said = (
        whites, _exchanged(seen), _misread(drift.readings, choice.left),
        drift.warning, _clips(seen), choice.additivity.warning,
    )  # fmt: skip
    warnings = tuple(words for words in said if words)
    notes = [*readings.notes, drift.words]
    worst = int(np.argmax(choice.left))
    codes = ", ".join(f"{code:.3f}" for code in drift.readings.averaged().codes[worst])
    notes.append(
        f"the model is within ΔE94 {choice.left.mean():.2f} of its own readings on average, at most "
        f"{choice.left[worst]:.2f} at codes {codes}"
    )
    called = name or readings.display or "Display"
    kept = (*notes, *warnings)
    return Characterised(DisplayRecord.of(called, readings, drift.readings, choice, kept), warnings)


def _refuse_stuck(readings: Readings) -> None:
    """Refuse a channel whose code has no effect: a cable, a control, or a misplaced instrument."""
    averaged = readings.averaged()
    white = averaged.white_xyz[1]
    for at, channel in enumerate(("red", "green", "blue")):
        others = np.delete(averaged.codes, at, axis=1)
        widest, seen = 0.0, 0.0
        for row in range(len(averaged)):
            same = np.flatnonzero((np.abs(others - others[row]) < 1e-6).all(axis=1))
            apart = averaged.codes[same, at] - averaged.codes[row, at]
            most = int(np.argmax(apart))
            if apart[most] >= 0.5:
                widest = max(widest, float(apart[most]))
                seen = max(seen, float(np.abs(averaged.xyz[same[most]] - averaged.xyz[row]).max()))
        if widest >= 0.5 and seen < _STUCK * white:
            raise InputError(
                "a channel is stuck",
                file=readings.source or None,
                field=channel,
                found=f"XYZ changes by {seen:.3g} at most while the code changes by {widest:.0%} of full scale",
                expected=f"some light of {channel}",
                hint="check the cable, the controls of the display and the colour profile that is loaded",
            )


def _misread(readings: Readings, off: Float[np.ndarray, " N"]) -> str | None:
    """Name the reading farthest from the model, if it cannot belong to its code."""
    worst, usual = int(np.argmax(off)), float(np.median(off))
    if off[worst] < max(_MISREAD, _MISREAD_TIMES * usual):
        return None
    codes = ", ".join(f"{code:.3f}" for code in readings.averaged().codes[worst])
    return (
        f"the reading at codes {codes} is off the model by ΔE94 {off[worst]:.1f}, half of all by at most {usual:.2f}: "
        "it was exchanged, mistyped or misread, and bends everything; measure it again or leave it out"
    )


def _other_whites(readings: Readings) -> str | None:
    """Name a reading of white that differs from the others."""
    whites = readings.xyz[readings.whites]
    if len(whites) < 3:
        return None
    usual = np.median(whites, axis=0)
    off = delta_e_xyz(np.repeat(usual[None], len(whites), axis=0), whites, usual)
    if off.max() < _MISREAD:
        return None
    return (
        f"reading {readings.whites[int(np.argmax(off))] + 1}, of white, is ΔE94 {off.max():.1f} from the other "
        f"{len(whites) - 1} of it: it was exchanged or misread; measure it again or leave it out"
    )


def _exchanged(readings: Readings) -> str | None:
    """Report full red, green and blue that are not the reddest, greenest and bluest of the three."""
    light = readings.channel_light
    if light is None or not (light.sum(axis=1) > 0.0).all():
        return None
    x, y = (light[:, :2] / light.sum(axis=1, keepdims=True)).T
    if int(np.argmax(x)) == 0 and int(np.argmax(y)) == 1 and int(np.argmin(y)) == 2:
        return None
    places = ", ".join(f"{name} x {a:.3f} y {b:.3f}" for name, a, b in zip(("red", "green", "blue"), x, y, strict=True))
    return f"full {places}: columns of codes or of X, Y, Z are exchanged, or the display's cables are"


def _clips(readings: Readings) -> str | None:
    """Report greys or a channel that saturate before full code: a contrast that is set too high."""
    averaged = readings.averaged()
    grey = np.flatnonzero(np.ptp(averaged.codes, axis=1) < 1e-6)
    order = grey[np.argsort(averaged.codes[grey, 0])]
    codes, light = averaged.codes[order, 0], averaged.xyz[order, 1]
    if len(order) < 3:
        return None
    full = np.flatnonzero(light >= light[-1] * (1.0 - _CLIPPED))
    first = float(codes[full[0]])
    if first > 0.97:
        return None
    return f"greys from code {first:.0%} on are as bright as white: the display or its input clips there"
