"""Spectral primaries of displays (ccss), and what two screens that match for one observer are to another."""

from __future__ import annotations

from dataclasses import dataclass
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
from .readings import ReadingSpectra


@dataclass(frozen=True, eq=False)
class Primaries:
    """Red, green and blue of a display. spectra : three rows, relative. name : as the file has it."""

    name: str
    spectra: ReadingSpectra
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
    """Read a ccss file: of its samples the three that span the largest triangle of chromaticities.

    Small negative values are noise of the instrument, and stay.

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
    return Primaries(name, ReadingSpectra(grid, values[[red, green, blue]]), notes)


def apart_for(one: Primaries, other: Primaries, matched: str, observer: str) -> float:
    """ΔE94 of the whites of two displays for an observer, both of them D65 for another; the first is the reference."""
    first, second = (each.white_for(matched).xyz(observer)[0] for each in (one, other))
    return float(delta_e_xyz(first, second, first))
