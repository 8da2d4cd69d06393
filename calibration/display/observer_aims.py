"""Aims of a display for observers other than that of its characterisation: the same tables after a matrix.

Light is additive in XYZ of any observer. If three channels and a leak make all spectra of a display, its XYZ for one
observer follow exactly from those for another by a matrix and an offset; with a fourth emitter approximately, with an
error measured on the spectra of the readings.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ...spectral.difference import delta_e_xyz
from ...spectral.observers import OBSERVERS, observer
from .aim import Aim, Black, aimed, aimed_at, d65_xyz, largest_luminance
from .readings import Readings
from .record import DisplayRecord

# Share of white that is added to luminances which readings are weighted by, as an eye weighs them (CIELAB's power).
_FLOOR, _POWER = 0.01, -2.0 / 3.0


@dataclass(frozen=True, eq=False)
class ObserverAim:
    """Aim for a further observer.

    Parameters
    ----------
    observer : by short name. aim : of the display for this observer.
    front : (3,4) matrix and offset, from XYZ-D65 of pictures for this observer to equivalent XYZ-D65 for the display's
        first aim.
    mean_off, largest_off : ΔE94 of the readings' XYZ by the matrix from those by their spectra.
    """

    observer: str
    aim: Aim
    front: Float[np.ndarray, "3 4"]
    mean_off: float
    largest_off: float

    @property
    def words(self) -> str:
        """Description of its white, and of the accuracy of its matrix."""
        off = f"ΔE94 {self.mean_off:.2f} on average, {self.largest_off:.2f} at most"
        return f"{self.aim.words}; by a matrix, off its spectra by {off}"

    def for_first(
        self, xyz_d65: Float[np.ndarray, "*batch 3"], black: Black = "absolute"
    ) -> Float[np.ndarray, "*batch 3"]:
        """Convert XYZ-D65 for this observer, with a treatment of black, to XYZ-D65 for the first aim."""
        moved = self.aim.xyz(xyz_d65, black) @ np.linalg.inv(self.aim.adapted).T
        return moved @ self.front[:, :3].T + self.front[:, 3]


def observer_aims(record: DisplayRecord) -> tuple[ObserverAim, ...]:
    """Return the aims for all other observers; none where neither the readings nor the primaries have spectra.

    D65 is that of each observer, as bright as requested or possible. Another white remains the same light.
    """
    readings = record.readings
    if readings.spectra is None and readings.primaries is None:
        return ()
    others = [short for short, name in OBSERVERS.items() if name != observer(readings.observer).name]
    return tuple(_aim(record, short) for short in others)


def _aim(record: DisplayRecord, short: str) -> ObserverAim:
    asked, absolute, first = record.settings, record.readings.absolute, record.aim
    seen, off = seen_by(record.readings, short)
    model = replace(record.model, seen=seen)
    if asked.white == "d65":
        luminance = asked.luminance and min(asked.luminance, largest_luminance(model, d65_xyz(short)))
        aim = aimed(model, "d65", luminance, absolute, short)
    else:
        aim = aimed_at(model, seen[:, :3] @ first.white_xyz + seen[:, 3], asked.white, absolute)
    back = np.linalg.inv(seen[:, :3] @ first.adapted)
    front = np.column_stack([back @ aim.adapted, -back @ seen[:, 3]])
    return ObserverAim(short, aim, front, float(off.mean()), float(off.max()))


def seen_by(readings: Readings, name: str) -> tuple[Float[np.ndarray, "3 4"], Float[np.ndarray, " N"]]:
    """Fit the matrix and offset from XYZ of readings to those of an observer; return them, and ΔE94 of each spectrum.

    Both are in the unit of the readings; the fit is to the spectra of the readings or else of the primaries.
    """
    spectra, whites = readings.spectra, readings.whites
    if spectra is None:
        assert readings.primaries is not None
        spectra = readings.primaries
        whites = np.argmax(spectra.xyz(readings.observer)[:, 1:2], axis=0)
    own, wanted = (spectra.xyz(one) for one in (readings.observer, name))
    # Spectra may be in a unit of their own.
    scale = readings.white_xyz[1] / own[whites, 1].mean()
    own, wanted = scale * own, scale * wanted
    white = wanted[whites].mean(axis=0)
    # A leak has a spectrum of its own, which primaries do not tell.
    leak = np.full(len(own), float(readings.spectra is not None))
    terms = np.column_stack([own, leak])
    weights = (np.maximum(own[:, 1:2], 0.0) / own[:, 1].max() + _FLOOR) ** _POWER
    seen = np.linalg.lstsq(terms * weights, wanted * weights, rcond=None)[0].T
    return seen, delta_e_xyz(wanted, terms @ seen.T, white)
