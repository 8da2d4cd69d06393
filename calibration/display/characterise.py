"""Characterisation of a display from readings: what speaks against them, drift taken out, a model chosen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...runtime.errors import InputError
from .choice import choose
from .drift import without_drift
from .readings import Readings
from .record import DisplayRecord

# Of white: light that no channel may be below alone at full code, and what a brighter code must add.
_STUCK, _CLIPPED = 0.01, 0.002


@dataclass(frozen=True, eq=False)
class Characterised:
    """record : of the display. warnings : of its notes, those that speak against the readings."""

    record: DisplayRecord
    warnings: tuple[str, ...]


def characterise(readings: Readings, name: str = "", model: str = "auto", observer: str | None = None) -> Characterised:
    """A record with everything that has to be said of the readings.

    name : of the display, as the readings have it where it is "". observer : another than they are of, from spectra.

    Raises
    ------
    InputError : too few patches, no white or black; a channel that is stuck; a model that cannot follow the display.
    """
    seen = readings.seen_by(observer) if observer else readings
    seen.white_xyz  # noqa: B018 (refuses readings without one)
    _refuse_stuck(seen)
    drift = without_drift(seen)
    choice = choose(drift.readings, model)
    warnings = tuple(words for words in (drift.warning, _clips(seen), choice.additivity.warning) if words)
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
    """A channel whose code changes nothing: a cable, a control, or an instrument that looks elsewhere."""
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


def _clips(readings: Readings) -> str | None:
    """Greys or a channel that are as bright before full code: a contrast that is set too high."""
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
