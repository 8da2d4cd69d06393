"""JCAMP-DX (.jdx, .dx): spectra of spectrometers as labelled text, their ordinates plain or packed (ASDF).

Each block, from ##TITLE= to ##END=, is a spectrum; a LINK block holds others. Its header states both units and factors,
the ends of its axis and how many points it has; every line of ordinates begins with its own abscissa, and one behind
differences repeats the last ordinate. All that is checked against one another, and nothing is mended.

Sources: R. S. McDonald and P. A. Wilks, "JCAMP-DX: A Standard Form for Exchange of Infrared Spectra in Computer
Readable Form", Applied Spectroscopy 42 (1988) 151-162; P. Lampen et al., "JCAMP-DX V.5.01", Pure and Applied Chemistry
71 (1999) 1549-1556. (The package `jcamp` prints where checks fail and goes on, and takes one digit of a count of
repetitions.)
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...runtime.errors import InputError
from .import_options import NO_ANSWER, ImportOptions
from .registry import SpectralFile, names_its_file
from .shared.decisions import (
    SETTLED_BY,
    Decision,
    Sign,
    ValueRange,
    decided,
    divisor_of,
    power_per_frequency,
    undecided,
)
from .shared.entry_rules import Gathering, in_visible
from .shared.text import head_text, is_jcamp, read_lines, shortened
from .shared.words import measured, names_derived, quantity_in, unit_in
from .shared.xml import kept
from .tables.axis import NANOMETRE, AxisUnit, axis_unit

NAME = "JCAMP-DX"
ASKS = True
SUFFIXES = (".jdx", ".dx", ".jcm", ".jcamp")

# Points of one spectrum, of which packed repetitions take no room in the file.
_MOST_POINTS = 100_000
# No measured number has such a power of ten.
_MOST_POWER = 60
_LABEL = re.compile(r"\s{0,99}##([^=\n]{0,200})=(.*)", re.S)
_LABELLED = re.compile(r"^\s{0,99}##\s?[A-Z$.][^=\n]{0,200}=", re.I | re.M)
_DATA = ("XYDATA", "XYPOINTS")
# Data that are no continuous spectrum.
_NO_SPECTRUM = {"NTUPLES": "pages of several variables", "PEAKTABLE": "a table of peaks", "PEAKASSIGNMENTS": "peaks"}
_OTHER_SPECTRA = re.compile(r"raman|\bnmr|nmr\b|mass spec|\b(?:epr|esr)\b|interferogram|x-?ray|chromato", re.I)
_FUNCTION = re.compile(r"kubelka|munk|\blog\b|\bK/S\b|emissivity", re.I)
_NUMBER = r"[+-]?(?:\d{1,40}\.?\d{0,40}|\.\d{1,40})(?:[Ee][+-]\d{1,3})?(?![\d.])"
# An ordinate: a difference, squeezed, a repetition, one that is missing, or a plain number.
_ORDINATE = re.compile(
    r"\s{0,999}(?:(?P<dif>[%J-Rj-r]\d{0,15})|(?P<sqz>[@A-Ia-i]\d{0,15})|(?P<dup>[S-Zs]\d{0,6})|(?P<gap>\?)|"
    rf"(?P<plain>{_NUMBER}))(?!\d)"
)
_ABSCISSA = re.compile(rf"\s{{0,999}}({_NUMBER})")
_STATED = re.compile(r"[+-]?(?:\d{1,40}[.,]?\d{0,40}|[.,]\d{1,40})(?:[Ee][+-]?\d{1,3})?")
# Leading digits in pseudo-digits, with their signs.
_DIGITS = {"@": "0", "%": "0"}
_DIGITS |= {letter: str(n) for n, letter in enumerate("ABCDEFGHI", 1)}
_DIGITS |= {letter: f"-{n}" for n, letter in enumerate("abcdefghi", 1)}
_DIGITS |= {letter: str(n) for n, letter in enumerate("JKLMNOPQR", 1)}
_DIGITS |= {letter: f"-{n}" for n, letter in enumerate("jklmnopqr", 1)}
_DIGITS |= {letter: str(n) for n, letter in enumerate("STUVWXYZs", 1)}
_DETAILS = {
    "DATATYPE": "data type", "ORIGIN": "origin", "OWNER": "owner", "DATE": "date", "LONGDATE": "date",
    "SPECTROMETERDATASYSTEM": "instrument", "INSTRUMENTPARAMETERS": "instrument parameters",
    "SAMPLEDESCRIPTION": "sample description", "SAMPLINGPROCEDURE": "sampling procedure", "RESOLUTION": "resolution",
    "PATHLENGTH": "path length", "DATAPROCESSING": "data processing", "XUNITS": "axis", "YUNITS": "units",
}  # fmt: skip


class _Written(NamedTuple):
    """A number as it is written: its value, and the unit of its last digit."""

    value: Fraction
    unit: Fraction

    @property
    def rounding(self) -> Fraction:
        """Largest error of a factor: half of its last digit where a program prints six or more, else none."""
        return self.unit / 2 if abs(self.value) >= 100_000 * self.unit else Fraction(0)

    @classmethod
    def of(cls, text: str) -> _Written:
        digits, _, exponent = text.replace(",", ".").upper().partition("E")
        power = int(exponent or 0)
        if abs(power) > _MOST_POWER:
            raise InputError("a number out of range", found=text, expected=f"a power of ten up to {_MOST_POWER}")
        return cls(Fraction(digits) * Fraction(10) ** power, Fraction(10) ** (power - len(digits.partition(".")[2])))


@dataclass
class _Block:
    """A block of labelled records, in normal form, each with the line that it begins at."""

    line: int
    records: dict[str, list[tuple[int, str]]] = field(default_factory=dict)
    closed: bool = False

    def text(self, label: str) -> str:
        """Return the first line of a record without comments, "" where there is none.

        Raises
        ------
        InputError
            It stands twice, with two values.
        """
        values = list(dict.fromkeys(_bare(text.split("\n", 1)[0]) for _, text in self.records.get(label, ())))
        if len(values) > 1:
            found = " and ".join(map(shortened, values[:2]))
            raise InputError("a record with two values", field=label, found=found, expected="one")
        return values[0] if values else ""

    def number(self, label: str) -> _Written | None:
        """Return the number of a record, None where there is none.

        Raises
        ------
        InputError
            It is no number.
        """
        text = self.text(label)
        if text and not _STATED.fullmatch(text):
            raise InputError("not a number", field=label, found=shortened(text), expected="a number")
        return _Written.of(text) if text else None

    def needed(self, label: str) -> _Written:
        """Return the number of a record that has to be there."""
        value = self.number(label)
        if value is None:
            raise InputError("a record is missing", field=label, expected=f"##{label}= and a number")
        return value


def recognises(path: Path, head: bytes) -> bool:
    """Text that begins with ##TITLE= or ##JCAMP-DX=, or labelled text that has the name of such a file."""
    text = head_text(head)
    return is_jcamp(text) or (path.suffix.casefold() in SUFFIXES and _LABELLED.search(text) is not None)


@names_its_file
def read(path: Path, answer: ImportOptions = NO_ANSWER) -> SpectralFile:
    """Read the spectrum of each block, over wavelengths in nm; one that cannot be used is rejected alone.

    Parameters
    ----------
    answer : the quantity and scale of arbitrary units; the scale of numbers that hardly fit what is stated.

    Raises
    ------
    InputError
        No block with a spectrum, or none that can be used: headers that the data contradict, packed ordinates whose
        checks fail, absorbance, other axes than wavelengths and their reciprocals.
    """
    gathering = Gathering(path, NAME)
    blocks = _blocks(read_lines(path))
    if any(not block.closed for block in blocks):
        gathering.note("the file ends without ##END=; the points that its header states are all there")
    without = [block for block in blocks if not {*_DATA, *_NO_SPECTRUM} & set(block.records)]
    for block in blocks:
        if block in without:
            continue
        name = shortened(_bare(block.records.get("TITLE", [(0, "")])[0][1].split("\n", 1)[0]), 200) or path.stem
        try:
            _read_block(block, name, gathering, answer)
        except InputError as reason:
            place = f"{name}, ##{reason.field}" if reason.field else name
            gathering.rejected.append((name, reason.at(field=place)))
    inner = [block for block in without if block.text("DATATYPE").upper() != "LINK"]
    if inner and gathering.entries:
        gathering.note(f"{len(inner)} blocks without a spectrum are left out")
    if not gathering.entries and not gathering.rejected:
        raise InputError("no spectrum in this file", expected="a block with ##XYDATA= or ##XYPOINTS=")
    return gathering.finish()


def _bare(line: str) -> str:
    """Return a line without its comment."""
    return line.partition("$$")[0].strip()


def _blocks(lines: Sequence[str]) -> list[_Block]:
    """Blocks in the order of the file, those of a LINK after it."""
    blocks: list[_Block] = []
    opened: list[_Block] = []
    record: tuple[str, int, list[str]] | None = None

    def keep() -> None:
        if record is not None and opened:
            opened[-1].records.setdefault(record[0], []).append((record[1], "\n".join(record[2])))

    for number, line in enumerate(lines, 1):
        match = _LABEL.match(line)
        if match is None:
            if record is not None:
                record[2].append(line)
            continue
        keep()
        label = re.sub(r"[\s/_-]", "", match[1]).upper()
        record = None
        if label == "END":
            if opened:
                opened.pop().closed = True
            continue
        if not opened or (label == "TITLE" and "TITLE" in opened[-1].records):
            opened.append(_Block(number))
            blocks.append(opened[-1])
        record = (label, number, [match[2]])
    keep()
    return blocks


def _read_block(block: _Block, name: str, gathering: Gathering, answer: ImportOptions) -> None:
    """Take the spectrum of a block."""
    for label, called in _NO_SPECTRUM.items():
        if label in block.records:
            raise InputError(
                f"{called}, and no spectrum", field=label, found=f"##{label}=", expected="##XYDATA= or ##XYPOINTS="
            )
    kind = block.text("DATATYPE")
    if _OTHER_SPECTRA.search(kind):
        raise InputError(
            "not a spectrum over wavelengths of light",
            field="DATA TYPE",
            found=shortened(kind),
            expected="UV/VIS SPECTRUM or INFRARED SPECTRUM",
        )
    axis, units = _axis(block), block.text("YUNITS")
    decision = _decision(units, axis, answer)
    grid, values, in_order = _points(block)
    grid = axis.wavelengths_nm(grid)
    if axis is not NANOMETRE:
        gathering.note(f"the axis is in {axis.name} and converted: {axis.formula}", name)
    if not in_order:
        grid, values = gathering.ascending(name, grid, values)
    scale = None
    there = np.isfinite(values)
    if decision.quantity != "emission" and there.any():
        seen = in_visible(grid) & there
        said = ValueRange.of(values[seen if seen.any() else there], decision.quantity, decision.stated)
        stated = (unit_in(units) or "fraction") if decision.stated else unit_in(units)
        scale = divisor_of(said, stated, f"YUNITS {shortened(units, 40)}" if stated else "", answer)
    details = {
        called: shortened(_bare(block.records[label][0][1]), 200)
        for label, called in _DETAILS.items()
        if label in block.records
    }
    gathering.take(name, grid, values, decision, scale, details=kept(details))


def _axis(block: _Block) -> AxisUnit:
    words = block.text("XUNITS")
    axis = axis_unit(words)
    if axis is None or axis.is_slow:
        raise InputError(
            "not an axis of light" if words else "a record is missing",
            field="XUNITS",
            found=shortened(words),
            expected="NANOMETERS, MICROMETERS or 1/CM",
        )
    return axis


def _decision(units: str, axis: AxisUnit, answer: ImportOptions) -> Decision:
    """Return the quantity by YUNITS; arbitrary units are what a person says."""
    named, place = quantity_in(units), "YUNITS"
    if named in ("absorbance", "index") or _FUNCTION.search(units) or names_derived(units):
        raise InputError(
            "not a reflectance or a transmittance, but a function of one",
            field=place,
            found=shortened(units),
            expected="REFLECTANCE or TRANSMITTANCE, as fractions or in percent",
            hint="in the program of the spectrometer, export it as reflectance or transmittance",
        )
    quantity = measured(named)
    signs = [Sign("units", quantity, f"{place} {shortened(units, 40)}", True)] if quantity else []
    decision = decided(signs, [], answer, place)
    if decision is None:
        found = shortened(units) or "no YUNITS"
        raise undecided(signs, place).at(
            found=found,
            expected="REFLECTANCE, TRANSMITTANCE or a spectral power",
            hint=f"{SETTLED_BY}; and --scale percent or fraction where it is no emission",
        )
    if decision.quantity == "emission" and axis.reciprocal:
        raise power_per_frequency(place, f"{shortened(units) or 'no unit'} over {axis.name}")
    return decision


def _points(block: _Block) -> tuple[np.ndarray, np.ndarray, bool]:
    """Abscissas (L,) in the file's unit, ordinates (L,) with their factor, and whether these stand in order."""
    label = next(label for label in _DATA if label in block.records)
    if len(block.records[label]) > 1 or all(label in block.records for label in _DATA):
        raise InputError("two sets of data in one block", field=label, found="two", expected="one")
    start, text = block.records[label][0]
    first, *lines = text.split("\n")
    form = re.sub(r"\s", "", _bare(first)).upper()
    rows = [(start + row, bare) for row, line in enumerate(lines, 1) if (bare := _bare(line))]
    stated = [block.text(each) for each in ("FIRSTX", "LASTX", "XFACTOR", "YFACTOR", "DELTAX", "FIRSTY")]
    if any("," in words for words in stated):
        rows = [(row, line.replace(",", ".")) for row, line in rows]
    if form == "(X++(Y..Y))":
        grid, raw = _equal_steps(block, rows, label)
    elif form == "(XY..XY)":
        grid, raw = _pairs(block, rows, label)
    else:
        raise InputError(
            "not a form of spectra", field=label, found=shortened(form), expected="(X++(Y..Y)) or (XY..XY)"
        )
    factor = block.number("YFACTOR")
    if factor is None and form == "(X++(Y..Y))":
        block.needed("YFACTOR")
    factor = factor or _Written(Fraction(1), Fraction(0))
    if factor.value == 0:
        raise InputError("a factor of nothing", field="YFACTOR", found="0", expected="any other number")
    _check_ordinates(block, raw, factor)
    values = np.array([np.nan if one is None else float(one.value * factor.value) for one in raw])
    return grid, values, form == "(X++(Y..Y))"


def _equal_steps(
    block: _Block, rows: Sequence[tuple[int, str]], label: str
) -> tuple[np.ndarray, list[_Written | None]]:
    """Points at equal steps from FIRSTX to LASTX, each line checked against its abscissa."""
    first, last, factor = block.needed("FIRSTX"), block.needed("LASTX"), block.needed("XFACTOR")
    count = _count(block.needed("NPOINTS"))
    step = (last.value - first.value) / (count - 1)
    if step == 0:
        raise InputError("an axis of one value", field="LASTX", found=f"{float(last.value):g}", expected="not FIRSTX")
    delta = block.number("DELTAX")
    if delta is not None:
        drift = abs(abs(delta.value) - abs(step)) * (count - 1)
        if drift > delta.unit / 2 * (count - 1) + abs(step) / 2:
            raise InputError(
                "the step is not that of the axis",
                field="DELTAX",
                found=f"{float(delta.value):.10g}",
                expected=f"{float(step):.10g}: FIRSTX {float(first.value):.10g} to LASTX {float(last.value):.10g} "
                f"in NPOINTS {count}",
            )
    raw: list[_Written | None] = []
    differing = False
    by_ends = by_delta = True
    for number, line in rows:
        match = _ABSCISSA.match(line)
        if match is None:
            raise InputError(
                "no abscissa", field=f"{label}, line {number}", found=shortened(line, 40), expected="X, then Y"
            )
        place = len(raw) - (1 if differing else 0)
        abscissa = _Written.of(match[1])
        _check_abscissa(abscissa, factor.value, first.value + place * step, abs(step), f"{label}, line {number}")
        off, near = abscissa.value * factor.value - first.value, abs(abscissa.unit * factor.value) + first.unit
        if not raw and abs(off) > 0.75 * near + abs(abscissa.value) * factor.rounding:
            raise _two_things("FIRSTX", first.value, first.value + off, "X of the first line")
        near = (near + last.unit) / 2 + abs(abscissa.value) * factor.rounding
        by_ends &= abs(off - place * step) <= near
        # The step has the sign of the axis, whatever DELTAX is written with.
        by_delta &= delta is not None and abs(abs(off) - place * abs(delta.value)) <= near
        ordinates, ends_in_difference = _ordinates(line[match.end() :], count + 1, f"{label}, line {number}")
        if differing:
            check, *ordinates = ordinates
            if check is None or raw[-1] is None or check.value != raw[-1].value:
                raise InputError(
                    "the check of the line before fails",
                    field=f"{label}, line {number}",
                    found="?" if check is None else f"{float(check.value):g}",
                    expected="the last ordinate once more: "
                    + ("?" if raw[-1] is None else f"{float(raw[-1].value):g}"),
                    hint="the file is damaged: export it again",
                )
        raw += ordinates
        differing = ends_in_difference
        if len(raw) > count:
            break
    _check_count(len(raw), count, label)
    if delta is not None and by_delta and not by_ends:
        end = first.value + (count - 1) * (abs(delta.value) if step > 0 else -abs(delta.value))
        raise _two_things("LASTX", last.value, end, "FIRSTX, DELTAX and X of each line")
    return np.array([float(first.value + place * step) for place in range(count)]), raw


def _two_things(label: str, found: Fraction, expected: Fraction, by: str) -> InputError:
    return InputError(
        "the header and the lines say two things",
        field=label,
        found=f"{float(found):.10g}",
        expected=f"{float(expected):.10g}, by {by}",
        hint="the file is damaged: export it again",
    )


def _check_abscissa(written: _Written, factor: Fraction, expected: Fraction, step: Fraction, place: str) -> None:
    """Refuse a line whose abscissa is not that of its point: half a step off, where its digits can tell so much."""
    found, unit = written.value * factor, abs(written.unit * factor)
    error = abs(found - expected)
    # Rounded or cut off at its last digit.
    if error <= max(step, unit) / 2 or (error < unit and abs(found) < abs(expected)):
        return
    raise InputError(
        "the abscissa of a line is not that of its point",
        field=place,
        found=f"{float(found):.10g}",
        expected=f"{float(expected):.10g}, by FIRSTX, LASTX, NPOINTS and XFACTOR",
        hint="a line is missing, doubled or damaged, or the header is wrong: export it again",
    )


def _ordinates(text: str, most: int, place: str) -> tuple[list[_Written | None], bool]:
    """Return the ordinates of a line, None where one is missing, and whether it ends in a difference."""
    out: list[_Written | None] = []
    at, step, kind = 0, 0, ""
    while at < len(text):
        match = _ORDINATE.match(text, at)
        found = match.lastgroup if match is not None else None
        if match is None or found is None:
            raise InputError("not an ordinate", field=place, found=shortened(text[at : at + 30]), expected="a number")
        word, at = match[found], match.end()
        if found == "plain":
            out.append(_Written.of(word))
        elif found == "gap":
            out.append(None)
        else:
            value = int(_DIGITS[word[0]] + word[1:])
            last = out[-1] if out else None
            whole = last is not None and last.value.denominator == 1
            if found == "sqz":
                out.append(_Written(Fraction(value), Fraction(1)))
            elif found == "dif" and last is not None and whole:
                step = value
                out.append(_Written(last.value + step, Fraction(1)))
            elif found == "dup" and out and kind != "dup" and value >= 1 and len(out) + value - 1 <= most:
                change = step if kind == "dif" else 0
                for _ in range(value - 1):
                    last = out[-1]
                    out.append(
                        None if last is None else last if not change else _Written(last.value + change, last.unit)
                    )
                # The repetition of a difference is one.
                found = "dif" if kind == "dif" else "dup"
            else:
                raise InputError(
                    "a difference or a repetition of nothing that it can be of",
                    field=place,
                    found=word,
                    expected=f"a whole number before it, and at most {most} ordinates",
                )
        kind = found
        if len(out) > most:
            break
    if not out:
        raise InputError("no ordinate in a line", field=place, expected="X, then Y")
    return out, kind == "dif"


def _pairs(block: _Block, rows: Sequence[tuple[int, str]], label: str) -> tuple[np.ndarray, list[_Written | None]]:
    """Points that state their abscissas, against FIRSTX, LASTX and NPOINTS where the header has them."""
    words: list[str] = []
    for number, line in rows:
        here = [word for word in re.split(r"[\s,;]+", line) if word]
        wrong = next(
            (
                word
                for place, word in enumerate(here)
                if not (re.fullmatch(_NUMBER, word) or (word == "?" and place % 2))
            ),
            None,
        )
        if wrong is not None or len(here) % 2:
            raise InputError(
                "not pairs of numbers",
                field=f"{label}, line {number}",
                found=shortened(line if wrong is None else wrong, 40),
                expected="X, Y pairs: two numbers each",
            )
        words += here
        if len(words) > 2 * _MOST_POINTS:
            break
    stated = block.number("NPOINTS")
    if stated is not None or not words:
        _check_count(len(words) // 2, _count(stated or block.needed("NPOINTS")), label)
    factor = block.number("XFACTOR") or _Written(Fraction(1), Fraction(0))
    abscissas = [_Written.of(word) for word in words[::2]]
    for end, at in (("FIRSTX", 0), ("LASTX", -1)):
        said = block.number(end)
        found = abscissas[at].value * factor.value
        near = abs(abscissas[at].unit * factor.value) + abs(abscissas[at].value) * factor.rounding
        if said is not None and abs(said.value - found) > near + said.unit:
            raise InputError(
                "the header and the points say two things",
                field=end,
                found=f"{float(said.value):.10g}",
                expected=f"{float(found):.10g}, by {label} and XFACTOR",
            )
    grid = np.array([float(one.value * factor.value) for one in abscissas])
    return grid, [None if word == "?" else _Written.of(word) for word in words[1::2]]


def _count(stated: _Written) -> int:
    if stated.value.denominator != 1 or not 2 <= stated.value <= _MOST_POINTS:
        raise InputError(
            "not a number of points",
            field="NPOINTS",
            found=f"{float(stated.value):g}",
            expected=f"a whole number from 2 to {_MOST_POINTS}",
        )
    return int(stated.value)


def _check_count(found: int, stated: int, label: str) -> None:
    if found != stated:
        raise InputError(
            "not as many points as are stated",
            field="NPOINTS",
            found=f"{stated}, and {'more' if found > stated else found} in {label}",
            expected="as many as there are points",
            hint="the file is cut short or damaged: export it again",
        )


def _check_ordinates(block: _Block, raw: Sequence[_Written | None], factor: _Written) -> None:
    """Compare FIRSTY, MAXY and MINY with the ordinates, to the digits that all of them have."""
    there = [one for one in raw if one is not None]
    if not there:
        raise InputError("no ordinates", field="YDATA", found="? alone", expected="numbers")
    most, least = max(there, key=lambda one: one.value), min(there, key=lambda one: one.value)
    if factor.value < 0:
        most, least = least, most
    for label, one in (("FIRSTY", raw[0]), ("MAXY", most), ("MINY", least)):
        stated = block.number(label)
        if stated is None or one is None:
            continue
        found = one.value * factor.value
        near = stated.unit / 2 + abs(one.unit * factor.value) + abs(one.value) * factor.rounding
        error = abs(stated.value - found)
        # Rounded or cut off at its last digit.
        if error > near and not (error < stated.unit and abs(stated.value) < abs(found)):
            raise InputError(
                "the header and the ordinates say two things",
                field=label,
                found=f"{float(stated.value):.10g}",
                expected=f"{float(found):.10g}, by the data and YFACTOR",
            )
