"""Spectral primaries of displays (ccss), and observer metamerism between two displays."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from ...runtime.errors import InputError
from ...runtime.files import existing_file
from ...spectral.difference import delta_e_xyz
from ...spectral.formats.cgats_bands import bands, grid_of
from ...spectral.formats.cgats_tables import read_tables
from ...spectral.formats.registry import names_its_file
from .aim import d65_xyz
from .readings import Readings, ReadingSpectra

# ΔE94 from which on a full channel is another display's: those of five kinds of display are 3 to 15 apart.
_ANOTHER = 5.0


@dataclass(frozen=True, eq=False)
class Primaries:
    """Red, green and blue of a display.

    Parameters
    ----------
    name : from the file.
    spectra : of the three, a row each, relative.
    samples : all non-zero spectra of the file; if more than three, of mixtures too.
    """

    name: str
    spectra: ReadingSpectra
    samples: ReadingSpectra
    notes: tuple[str, ...] = ()

    def white_for(self, observer: str) -> ReadingSpectra:
        """Return the spectrum (1,L) of a white that is D65 to an observer.

        Raises
        ------
        InputError : no amounts of these primaries make it.
        """
        amounts = np.linalg.solve(self.spectra.xyz(observer).T, d65_xyz(observer))
        if not (amounts > 0.0).all():
            raise InputError(
                "these primaries do not make a white",
                file=self.name,
                field=observer,
                found=np.array2string(amounts, precision=3),
                expected="red, green and blue around D65",
            )
        return ReadingSpectra(self.spectra.wavelengths_nm, amounts[None] @ self.spectra.radiance)


@names_its_file
def read_primaries(path: Path) -> Primaries:
    """Read a ccss file; the primaries are the three samples with the largest triangle of chromaticities.

    Small negative values are noise of the instrument, and are kept.

    Raises
    ------
    InputError : no such file, not of spectra, or fewer than three.
    """
    path = existing_file(path)
    tables = [table for table in read_tables(path) if bands(table)]
    if len(tables) != 1 or len(tables[0].rows) < 3:
        rows = ", ".join(str(len(table.rows)) for table in tables) or "no"
        raise InputError(
            "not the primaries of a display",
            field="BEGIN_DATA",
            found=f"{rows} spectra",
            expected="one table with spectra of red, green and blue at least",
            hint="a .ccss file, as ArgyllCMS's ccxxmake writes it",
        )
    table = tables[0]
    fields = bands(table)
    grid, order = grid_of(table, fields)
    values = np.array([[table.number(row[fields[at].column]) for at in order] for row in table.rows])
    if not np.isfinite(values).all():
        raise InputError("not a number", field="BEGIN_DATA", expected="a number in every spectral field")
    spectra = ReadingSpectra(grid, values)
    xyz = spectra.xyz("1931_2")
    bright = np.flatnonzero(xyz[:, 1] > 0.01 * xyz[:, 1].max())
    if bright.size < 3:
        raise InputError("fewer than three spectra with light", field="BEGIN_DATA", expected="red, green and blue")
    xy = xyz[:, :2] / np.maximum(xyz.sum(axis=1, keepdims=True), 1e-12)

    def area(three: tuple[int, ...]) -> float:
        one, other = xy[three[1]] - xy[three[0]], xy[three[2]] - xy[three[0]]
        return abs(float(one[0] * other[1] - one[1] * other[0]))

    chosen = max(combinations(bright.tolist(), 3), key=area)
    red = max(chosen, key=lambda at: xy[at, 0])
    green, blue = sorted((at for at in chosen if at != red), key=lambda at: -xy[at, 1])
    name = table.keywords.get("DISPLAY") or table.keywords.get("DESCRIPTOR") or path.stem
    notes = () if len(values) == 3 else (f"of {len(values)} spectra those with the purest colours were taken",)
    pure, lit = (ReadingSpectra(grid, values[rows]) for rows in ([red, green, blue], bright))
    return Primaries(name, pure, lit, notes)


def with_primaries(readings: Readings, primaries: Primaries) -> Readings:
    """Add the spectra of their display's primaries to readings, which permits aims for other observers.

    Raises
    ------
    InputError : the readings have spectra of their own; the primaries are another display's.
    """
    name, where = primaries.name, readings.source or None
    if readings.spectra is not None:
        raise InputError(
            "readings that have spectra of their own",
            file=where,
            field="--primaries",
            found=f"{len(readings)} spectra, and those of {name}",
            expected="XYZ alone, as a colorimeter gives them",
            hint="leave --primaries out: the readings tell more",
        )
    light = readings.channel_light
    said = f"for other observers: {len(primaries.samples.radiance)} spectra of {name}"
    if light is None:
        said += ", not held against the readings, which have no full red, green and blue"
    else:
        theirs = primaries.spectra.xyz(readings.observer)
        apart = delta_e_xyz(light, theirs * (light[:, 1:2] / theirs[:, 1:2]), readings.white_xyz)
        worst = int(np.argmax(apart))
        found = f"full {('red', 'green', 'blue')[worst]} is ΔE94 {apart[worst]:.1f} from that of {name}"
        if apart[worst] >= _ANOTHER:
            raise InputError(
                "primaries of another display",
                file=where,
                field="--primaries",
                found=found,
                expected=f"less than {_ANOTHER:g} for each of red, green and blue, as bright as each other",
                hint="take the .ccss of this display, or leave --primaries out",
            )
        said += f"; {found}, the other two are nearer"
    return replace(readings, primaries=primaries.samples, notes=(*readings.notes, said))


def apart_for(one: Primaries, other: Primaries, matched: str, observer: str) -> float:
    """Compute ΔE94 of two displays' whites for an observer, both D65 for another; the first is the reference."""
    first, second = (each.white_for(matched).xyz(observer)[0] for each in (one, other))
    return float(delta_e_xyz(first, second, first))
