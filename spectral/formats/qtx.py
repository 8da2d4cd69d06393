"""Datacolor QTX: text with a section a standard or a batch, FIELD=value a line, reflectance in percent.

A section `[STANDARD_DATA 0]` or `[BATCH_DATA 0]` has the fields STD_ or BAT_: NAME, REFLPOINTS, REFLLOW and
REFLINTERVAL (count, first wavelength and step in nm), R (the values) and VIEWING (mode, aperture, specular component,
ultraviolet). A line may end with a comma.

Source: Datacolor, "QTX File Specification".
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...runtime.errors import InputError
from ..spectrum import Quantity
from .import_options import NO_ANSWER, ImportOptions
from .registry import SpectralFile, StatedColour, names_its_file
from .shared.colour_words import illuminant_in, observer_in, stated_colours
from .shared.decisions import Decision, Sign, ValueRange, decided, divisor_of
from .shared.entry_rules import Gathering, in_visible
from .shared.text import cell_number, head_text, read_lines, shortened
from .shared.words import quantity_in
from .shared.xml import kept

NAME = "Datacolor QTX"
ASKS = True
SUFFIXES = (".qtx",)

_SECTION = re.compile(r"\s{0,99}\[\s?([A-Za-z]\w{0,60})(?:\s[^\]\n]{0,60})?\][\s,;]{0,9}$", re.M)
_KINDS = {"STANDARD_DATA": ("STD", "standard"), "BATCH_DATA": ("BAT", "batch")}
# More points than any spectrophotometer has; wavelengths of light in nm.
_MOST_POINTS, _SHORTEST_NM, _LONGEST_NM = 5000, 100.0, 20_000.0
_COLOURS = ("X", "Y", "Z", "CIEL", "CIEA", "CIEB")
_APERTURE = re.compile(r"(?<![A-Z])(?:XUS|US|VS|S|M|L|XL|VL)AV(?![A-Z])", re.I)
_ULTRAVIOLET = re.compile(r"\bUV[ _]{0,2}(inc|exc|cal|[34]\d0)|\b(\d{1,3})\s?% ?UV\b", re.I)


@dataclass
class _Section:
    """A section: its kind, the line of its heading, and the values of each field."""

    kind: str
    line: int
    fields: dict[str, list[str]] = field(default_factory=dict)

    def text(self, name: str) -> str:
        """Return the value of a field, "" where there is none.

        Raises
        ------
        InputError
            It has two values.
        """
        values = list(dict.fromkeys(self.fields.get(name, ())))
        if len(values) > 1:
            raise InputError(
                "a field with two values", field=name, found=" and ".join(map(shortened, values[:2])), expected="one"
            )
        return values[0] if values else ""


def recognises(path: Path, head: bytes) -> bool:
    """Text with the heading of a standard or a batch, or one that is named .qtx."""
    text = head_text(head)
    return any(kind.upper() in _KINDS for kind in _SECTION.findall(text)) or (
        path.suffix.casefold() in SUFFIXES and bool(text)
    )


@names_its_file
def read(path: Path, answer: ImportOptions = NO_ANSWER) -> SpectralFile:
    """Read the standards and batches of a file, in its order; one that is no spectrum is rejected alone.

    Parameters
    ----------
    answer : the scale of one whose numbers hardly are percent; decimal mark of one that parts values by commas.

    Raises
    ------
    InputError
        No section of a standard or a batch, or none that can be used.
    """
    gathering = Gathering(path, NAME)
    header, sections, passed = _sections(read_lines(path))
    samples = [section for section in sections if section.kind in _KINDS]
    if not samples:
        raise InputError(
            "no standards and no batches",
            field="section",
            found=", ".join(f"[{section.kind}]" for section in sections[:6]) or "no section",
            expected="[STANDARD_DATA 0] or [BATCH_DATA 0]",
        )
    if others := sorted({section.kind for section in sections} - set(_KINDS)):
        gathering.note(f"sections of something else are left out: {', '.join(others[:6])}")
    if passed:
        gathering.note(f"{passed} lines that are no FIELD=value are passed over")
    usable: list[tuple[str, np.ndarray, np.ndarray, Decision, dict[str, str], tuple[StatedColour, ...]]] = []
    standard = ""
    for section in samples:
        prefix, called = _KINDS[section.kind]
        name = shortened(" / ".join(dict.fromkeys(section.fields.get(f"{prefix}_NAME", ()))), 200)
        if prefix == "STD":
            standard = name
        try:
            grid, values = _spectrum(section, prefix, gathering, answer)
            decision = _decision(section, prefix, answer)
            usable.append(
                (name, grid, values, decision, _details(section, prefix, called, standard), _colours(section, prefix))
            )
        except InputError as reason:
            place = f"{name or f'[{section.kind}]'}, line {section.line}"
            gathering.rejected.append((name, reason.at(field=f"{place}: {reason.field}" if reason.field else place)))
    for quantity in dict.fromkeys(decision.quantity for _, _, _, decision, _, _ in usable):
        alike = [one for one in usable if one[3].quantity == quantity]
        scale = None
        if quantity != "emission":
            grids, every = np.concatenate([one[1] for one in alike]), np.concatenate([one[2] for one in alike])
            seen = in_visible(grids)
            range_of_values = ValueRange.of(every[seen] if seen.any() else every, quantity, True)
            scale = divisor_of(range_of_values, "percent", f"the format ({NAME})", answer)
        for name, grid, values, decision, details, colours in alike:
            gathering.take(name or path.stem, grid, values, decision, scale, details=details, stated=colours)
    return gathering.finish(header)


def _sections(lines: Sequence[str]) -> tuple[dict[str, str], list[_Section], int]:
    """Fields above the first section, the sections, and how many lines are neither a heading nor a field."""
    header = _Section("", 0)
    sections, passed = [header], 0
    for number_of_line, line in enumerate(lines, 1):
        if (heading := _SECTION.match(line)) is not None:
            sections.append(_Section(heading[1].upper(), number_of_line))
            continue
        key, equals, value = line.partition("=")
        if equals and key.strip():
            value = value.strip().rstrip(",").strip()
            sections[-1].fields.setdefault(key.strip().upper(), []).append(value)
        elif line.strip(" ,;\t"):
            passed += 1
    about = {key.casefold(): shortened(", ".join(values)) for key, values in header.fields.items()}
    return kept(about), sections[1:], passed


def _spectrum(
    section: _Section, prefix: str, gathering: Gathering, answer: ImportOptions
) -> tuple[np.ndarray, np.ndarray]:
    """Wavelengths (L,) in nm and values (L,) as they stand in the file."""
    numbers = {}
    limits = {"POINTS": (2, _MOST_POINTS), "LOW": (_SHORTEST_NM, _LONGEST_NM), "INTERVAL": (0.0, _LONGEST_NM)}
    for what, (least, most) in limits.items():
        name = f"{prefix}_REFL{what}"
        text = section.text(name)
        value = cell_number(text, "," if "," in text else ".")
        if not least <= value <= most or value == 0.0 or (what == "POINTS" and not value.is_integer()):
            expected = f"{'a whole number' if what == 'POINTS' else 'nm'} from {least:g} to {most:g}"
            problem = "not such a number" if text else "a field is missing"
            raise InputError(problem, field=name, found=shortened(text), expected=expected)
        numbers[what] = value
    count = int(numbers["POINTS"])
    grid = numbers["LOW"] + numbers["INTERVAL"] * np.arange(count)
    if grid[-1] > _LONGEST_NM:
        raise InputError(
            "no wavelengths of light",
            field=f"{prefix}_REFLINTERVAL",
            found=f"{count} points from {grid[0]:g} to {grid[-1]:g} nm",
            expected=f"up to {_LONGEST_NM:g} nm",
        )
    return grid, _values(section.text(f"{prefix}_R"), count, f"{prefix}_R", gathering, answer)


def _values(text: str, count: int, name: str, gathering: Gathering, answer: ImportOptions) -> np.ndarray:
    """Return the `count` values of a list: parted by commas, or by semicolons, tabs or spaces with either decimal mark.

    Commas that part values and are their decimal marks as well are read where digits behind them are those of no whole
    percentage, or where a person says so.
    """
    if not text:
        raise InputError("no reflectance", field=name, expected=f"{count} values in percent")
    apart = re.split(r"[;\t]", text.rstrip("; \t"))
    by_comma = [cell.strip() for cell in text.split(",")]
    for cells in (apart, by_comma, text.split()):
        for mark in "." if cells is by_comma else ".,":
            if (
                len(cells) == count
                and not np.isnan(values := np.array([cell_number(cell, mark) for cell in cells])).any()
            ):
                return values
    if len(by_comma) == 2 * count and all(cell.isdecimal() for cell in by_comma):
        if answer.decimal == "comma" or any(map(_is_of_decimals, by_comma[1::2])):
            gathering.note("commas part the values and are their decimal marks, by the number of points stated")
            return np.array(
                [float(f"{whole}.{part}") for whole, part in zip(by_comma[::2], by_comma[1::2], strict=True)]
            )
        raise InputError(
            "decimal commas among commas, or twice the values?",
            field=name,
            found=f"{shortened(text, 40)}: {len(by_comma)} numbers",
            expected=f"{count} values, by the number of points stated",
            hint="say --decimal comma where the commas are decimal marks as well",
        )
    cells = apart if len(apart) > 1 else by_comma if len(by_comma) > 1 else text.split()
    wrong = [cell for cell in cells if not any(np.isfinite(cell_number(cell, mark)) for mark in ".,")]
    raise InputError(
        "not the values that are stated",
        field=name,
        found=repr(shortened(wrong[0], 40)) if wrong else f"{len(cells)} values",
        expected=f"{count} numbers, by {name[:3]}_REFLPOINTS",
    )


def _is_of_decimals(digits: str) -> bool:
    """Return whether digits are decimals: a percentage has three at most, and does not begin with 0."""
    return len(digits) > 3 or (len(digits) > 1 and digits[0] == "0")


def _decision(section: _Section, prefix: str, answer: ImportOptions) -> Decision:
    """Return the quantity by the mode of viewing, and reflectance where that says none."""
    name = f"{prefix}_VIEWING"
    viewing = section.text(name)
    sent, named = re.search(r"%\s?T\b|\btrans", viewing, re.I) is not None, quantity_in(viewing)
    if named in ("absorbance", "index", "emission") or (sent and re.search(r"%\s?R\b", viewing, re.I)):
        raise InputError(
            "not the mode of a reflectance or a transmittance", field=name, found=viewing, expected="%R or %T"
        )
    quantity: Quantity = "transmittance" if sent else "reflectance"
    words = f"{name} {shortened(viewing, 60)!r}" if sent else f"the format ({NAME})"
    decision = decided([Sign("format", quantity, words, True)], [], answer, name)
    assert decision is not None
    return decision


def _details(section: _Section, prefix: str, called: str, standard: str) -> dict[str, str]:
    """Whatever else is said of a sample, by its field without the prefix; the standard of a batch by its name."""
    skipped = {f"{prefix}_{part}" for part in ("NAME", "R", "REFLPOINTS", "REFLINTERVAL", "REFLLOW")}
    details = {"kind": called, "units": "%"}
    if called == "batch":
        details["standard"] = shortened(", ".join(section.fields.get("STD_NAME", ())) or standard)
        skipped.add("STD_NAME")
    viewing = section.text(f"{prefix}_VIEWING")
    apertures = {found.upper() for found in _APERTURE.findall(viewing)}
    if len(apertures) == 1:
        details["aperture"] = apertures.pop()
    if ultraviolet := _ULTRAVIOLET.search(viewing):
        word = (ultraviolet[1] or f"{ultraviolet[2]}%").casefold()
        cut = f"cut {word} nm" if word.isdecimal() else word
        details["uv"] = {"inc": "included", "exc": "excluded", "cal": "calibrated"}.get(word, cut)
    for key, values in section.fields.items():
        label = key.removeprefix(f"{prefix}_").replace("_", " ").casefold()
        if key not in skipped:
            details.setdefault({"inst type": "instrument"}.get(label, label), shortened(", ".join(values), 200))
    return kept(details)


def _colours(section: _Section, prefix: str) -> tuple[StatedColour, ...]:
    """Return the colours that a section states beside its reflectance, for the light and observer of its ILLNAME."""
    named = ", ".join(section.fields.get("ILLNAME", ()))
    axes = {f"{prefix}_{axis}": axis for axis in _COLOURS}
    cells = {
        {"CIEL": "L*", "CIEA": "a*", "CIEB": "b*"}.get(axis, axis): cell_number(section.fields[key][0])
        for key, axis in axes.items()
        if len(section.fields.get(key, ())) == 1
    }
    return () if "," in named else stated_colours(cells, illuminant_in(named), observer_in(named))
