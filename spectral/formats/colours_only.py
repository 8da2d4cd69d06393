"""Colours without spectra, as many standards come: XYZ or CIELAB in CGATS, CxF3 or a table, or in a few words."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...runtime.errors import InputError
from ...runtime.files import existing_file
from ..measurement import Measurement
from .cgats import conditions_of, illuminant_of, observer_of, recognises
from .cgats_tables import read_tables
from .cxf import colours_without_spectra
from .cxf import recognises as is_cxf
from .import_options import NO_ANSWER, ImportOptions
from .registry import HEAD, StatedColour
from .shared.text import read_lines
from .shared.words import colour_axis, illuminant_in, observer_in, stated_colours
from .tables.dialect import Dialect, dialects_of
from .tables.one_reading import check_whole
from .tables.section import ragged, trimmed

_WORDS = re.compile(r"(lab|lch|xyz)\s*:\s*([^@]+?)\s*(?:@\s*(\S+?)\s*/\s*(\S+))?$", re.I)
_NAMES = ("SAMPLE_NAME", "SAMPLE_ID", "NAME", "ID", "SAMPLE", "PATCH_NAME", "SAMPLE_LOC")
_LIKE = "lab:52.1,10.3,-5.6@D65/1964_10"


class Coloured(NamedTuple):
    """A name, the colours stated of it, and what the file says of how they were measured."""

    name: str
    stated: tuple[StatedColour, ...]
    details: Mapping[str, str]

    @property
    def measurement(self) -> Measurement:
        """The conditions that the details state."""
        return Measurement.of(None, self.details, self.name)


def colour_in(text: str) -> StatedColour | None:
    """The colour that a person writes, such as "lab:52.1,10.3,-5.6@D65/1964_10"; None where the text is none.

    Raises
    ------
    InputError : not three numbers, or no illuminant and observer: a colour without them is not one.
    """
    match = _WORDS.match(text.strip())
    if match is None:
        return None
    space, numbers, light, eye = match.groups()
    if light is None:
        raise InputError(
            "a colour without its illuminant and observer",
            field="colour",
            found=text,
            expected=f"such as {_LIKE}",
        )
    try:
        values = np.array([float(part) for part in numbers.split(",")])
    except ValueError:
        values = np.empty(0)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise InputError(
            "not a colour", field="colour", found=text, expected="three numbers", hint=f"write it as {_LIKE}"
        )
    if space.lower() == "lch":
        turn = np.radians(values[2])
        values = np.array([values[0], values[1] * np.cos(turn), values[1] * np.sin(turn)])
    return StatedColour("XYZ" if space.lower() == "xyz" else "Lab", values, light, eye)


def read_colours(path: str | Path, answer: ImportOptions = NO_ANSWER) -> tuple[Coloured, ...]:
    """Read the colours that a file states by name; what it leaves open of illuminant and observer is the answer's.

    Raises
    ------
    InputError : the file states no colours.
    """
    path = existing_file(path)
    with path.open("rb") as file:
        head = file.read(HEAD)
    if is_cxf(path, head):
        found = [Coloured(*one) for one in colours_without_spectra(path)]
    elif recognises(path, head):
        found = _cgats(path)
    else:
        found = _table(path)
    if not found:
        raise InputError(
            "no colours in this file",
            file=path,
            expected="spectra, or columns such as LAB_L, LAB_A, LAB_B",
            hint="export the measurement with its spectra",
        )
    light, eye = answer.colours_for or (None, None)
    return tuple(
        one._replace(
            stated=tuple(
                replace(each, illuminant=each.illuminant or light, observer=each.observer or eye) for each in one.stated
            )
        )
        for one in found
    )


def _cgats(path: Path) -> list[Coloured]:
    found = []
    for table in read_tables(path):
        details = conditions_of(table)
        light, eye = illuminant_of(table), observer_of(table)
        upper = [field.upper() for field in table.fields]
        name_at = next((upper.index(name) for name in _NAMES if name in upper), None)
        for place, row in enumerate(table.rows, 1):
            cells = {
                field: table.number(cell) for field, cell in zip(table.fields, row, strict=True) if colour_axis(field)
            }
            if colours := stated_colours(cells, light, eye):
                name = row[name_at] if name_at is not None else f"{path.stem} {place}"
                found.append(Coloured(name, colours, details))
    return found


def _table(path: Path) -> list[Coloured]:
    """A header of names, L*, a* and b*, and a row each; the light and the observer stand anywhere above or in it."""
    lines = [(at, line) for at, line in enumerate(read_lines(path), 1) if line.strip()]
    # White space is in names, too.
    dialect = next((one for one in dialects_of([line for _, line in lines]) if one.delimiter), Dialect(",", "."))
    rows = [(at, trimmed(dialect.cells(line))) for at, line in lines]
    for start, (_, header) in enumerate(rows):
        if sum(colour_axis(cell) is not None for cell in header) < 3:
            continue
        above = " ".join(" ".join(row) for _, row in rows[: start + 1])
        light, eye = illuminant_in(above), observer_in(above)
        details = {"format": "CSV"} | dict(labelled for _, row in rows[:start] if (labelled := _labelled(row)))
        found = []
        for at, row in rows[start + 1 :]:
            if len(row) > len(header):
                raise ragged(at, len(row), len(header), row)
            of_colours = {head: cell for head, cell in zip(header, row, strict=False) if colour_axis(head)}
            check_whole(list(of_colours.values()), dialect, at)
            cells = {head: dialect.number(cell) for head, cell in of_colours.items()}
            names = [c for h, c in zip(header, row, strict=False) if not colour_axis(h) and c.strip()]
            if colours := stated_colours(cells, light, eye):
                found.append(Coloured(names[0] if names else f"{path.stem} {len(found) + 1}", colours, details))
        return found
    return []


def _labelled(row: list[str]) -> tuple[str, str] | None:
    """A label and its words in a line above a table, in two cells or in one; None where it has no label."""
    words = [cell.strip() for cell in row if cell.strip()]
    label, mark, rest = (words or [""])[0].partition(":")
    if mark and rest.strip():
        return label.strip(), rest.strip()
    return (label.strip(), words[1]) if len(words) == 2 else None
