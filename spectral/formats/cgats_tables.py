"""The syntax of CGATS.17 and its relatives: keywords, a data format, and sets of data, table after table."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from ...runtime.errors import InputError
from .shared.text import cell_number, read_lines, shortened

# A string, in which "" is a quotation mark, or a word; what follows # outside strings is a comment.
_TOKEN = re.compile(r'"((?:[^"]|"")*)"?|(#.*)|([^\s"]+)')
# Identifiers of a table after the first; there, another word alone is a keyword without a value.
_IDENTIFIER = re.compile(r"CGATS|ISO ?28178|IT8|CTI\d|CCSS|CCMX|SPECT$|CMF$|CAL$|MPP$", re.I)
# A field of two words without quotation marks: SPECTRAL_NM 380, or 380 nm.
_BEFORE = re.compile(r"SPECTRAL_?NM|SPECTRAL|SPECTRUM|SPEC|NM|R|LAMBDA|WL", re.I)
_LENGTH = re.compile(r"\d{3,4}(?:[.,]\d+)?")
_NUMBER_WITH_COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
# Keywords that say one thing of a table, and what differs in their parts; two of the latter, and of any others, add up.
_SAYS_ONE_THING = re.compile(
    r"SPECTRAL|MEAS|ILLUM|OBSERVER|FILTER|GEOMETRY|BACKING|CONDITION|DEVICE_CLASS|UNIT|MODE(?!L)|SPECULAR|POLARI|DISPLAY",
    re.I,
)

#: Fields in one format, and characters in one line.
MOST_FIELDS, LONGEST_LINE = 20_000, 4 * 2**20


@dataclass(frozen=True, eq=False)
class CgatsTable:
    """One table.

    Parameters
    ----------
    identifier : the word that starts the table; without one, that of the table before it holds, "" for the first.
    keywords : upper-case keyword to value; those of the table before hold unless this one has its own identifier.
    fields : names as written.
    rows : cells, one list a set, as many as there are fields.
    decimal : "." or ",".
    notes : counts that the file does not state.
    """

    identifier: str
    keywords: dict[str, str]
    fields: list[str]
    rows: list[list[str]]
    decimal: str
    notes: tuple[str, ...]

    def number(self, cell: str) -> float:
        """Return the number in a cell, NaN if there is none."""
        return cell_number(cell, self.decimal)


def tokens(line: str) -> list[str]:
    """Words and strings of a line, without its comment."""
    found = []
    for match in _TOKEN.finditer(line):
        if match[2] is not None:
            break
        found.append(match[3] if match[3] is not None else match[1].replace('""', '"'))
    return found


def read_tables(path: Path) -> list[CgatsTable]:
    """Return every table of a file.

    Raises
    ------
    InputError
        No data, a format and data that do not fit together, counts other than the file states, or an end that is
        missing.
    """
    lines = _numbered(read_lines(path))
    keywords: dict[str, str] = {}
    fields: list[str] = []
    tables: list[CgatsTable] = []
    identifier, counts, begun = "", {}, False
    stated: set[str] = set()
    for line_number, line in lines:
        words = tokens(line)
        if not words:
            continue
        key = words[0].upper()
        if key == "BEGIN_DATA_FORMAT":
            fields = _joined(_format(words[1:], lines, line_number))
        elif key == "BEGIN_DATA":
            if not fields:
                raise InputError(
                    "data without a format", field=f"line {line_number}", expected="BEGIN_DATA_FORMAT before"
                )
            tables.append(_table(identifier, dict(keywords), fields, counts, lines))
            counts, begun, stated = {}, False, set()
        elif key in ("NUMBER_OF_FIELDS", "NUMBER_OF_SETS"):
            count = _count(words, line_number)
            if counts.get(key, count) != count:
                raise _said_twice(key, line_number, str(counts[key]), str(count))
            counts[key] = count
        elif key == "KEYWORD":
            continue
        elif len(words) == 1 and not begun and (not tables or _IDENTIFIER.match(words[0])):
            identifier, keywords, fields, begun = words[0], {}, [], True
        else:
            value, before = " ".join(words[1:]), keywords.get(key, "") if key in stated else ""
            if before and value and value not in before.split("; "):
                if _SAYS_ONE_THING.search(key):
                    raise _said_twice(key, line_number, before, value)
                # A weighting function is stated a line each for the light and the observer.
                value = f"{before}; {value}"
            keywords[key], begun = value or before, True
            stated.add(key)
    if not tables:
        raise InputError(
            "no data in this CGATS file",
            found=f"a format of {len(fields)} fields" if fields else "keywords alone",
            expected="BEGIN_DATA_FORMAT and BEGIN_DATA, each with its end",
            hint="the file may be truncated; export it again",
        )
    return tables


def _numbered(lines: list[str]) -> Iterator[tuple[int, str]]:
    """Yield the lines with their numbers, each short enough to be one of a measurement."""
    for at, line in enumerate(lines, 1):
        if len(line) > LONGEST_LINE:
            raise InputError("a line is too long", field=f"line {at}", expected=f"{LONGEST_LINE} characters at most")
        yield at, line


def _said_twice(key: str, line_number: int, before: str, value: str) -> InputError:
    return InputError(
        "a keyword says two things",
        field=f"{key}, line {line_number}",
        found=f"{shortened(before, 60)} and {shortened(value, 60)}",
        expected="one of them",
        hint="take the line out that is wrong, or export the tables apart",
    )


def _count(words: list[str], line_number: int) -> int:
    if len(words) < 2 or not re.fullmatch(r"\d{1,9}", words[1]):
        raise InputError(
            "not a count",
            field=f"{words[0]}, line {line_number}",
            found=shortened(" ".join(words[1:])) or "nothing",
            expected="a whole number",
        )
    return int(words[1])


def _format(fields: list[str], lines: Iterator[tuple[int, str]], begun: int) -> list[str]:
    while "END_DATA_FORMAT" not in (field.upper() for field in fields[-1:]):
        following = next(lines, None)
        if following is None or len(fields) > MOST_FIELDS or following[1].lstrip()[:10].upper() == "BEGIN_DATA":
            raise InputError(
                "a data format without its end",
                field=f"BEGIN_DATA_FORMAT, line {begun}",
                found=f"{len(fields)} fields",
                expected=f"END_DATA_FORMAT after at most {MOST_FIELDS} fields",
                hint="the file may be truncated; export it again",
            )
        fields += tokens(following[1])
    return fields[:-1]


def _joined(fields: list[str]) -> list[str]:
    """Fields, with those of two words that lack their quotation marks as one, where there are several."""
    joined: list[str] = []
    lengths = 0
    for field in fields:
        last = joined[-1] if joined else ""
        if (_LENGTH.fullmatch(field) and _BEFORE.fullmatch(last)) or (
            field.lower() == "nm" and _LENGTH.fullmatch(last)
        ):
            joined[-1] = f"{last} {field}"
            lengths += 1
        else:
            joined.append(field)
    return joined if lengths > 1 else fields


def _table(
    identifier: str,
    keywords: dict[str, str],
    fields: list[str],
    counts: dict[str, int],
    lines: Iterator[tuple[int, str]],
) -> CgatsTable:
    declared = counts.get("NUMBER_OF_FIELDS")
    if declared not in (None, len(fields)):
        raise InputError(
            "the data format has not the number of fields that the file states",
            field="NUMBER_OF_FIELDS",
            found=f"{len(fields)} fields in the format",
            expected=f"{declared}, as stated",
            hint="export the file again, or correct the count",
        )
    rows, ended = _rows(fields, lines)
    stated = counts.get("NUMBER_OF_SETS")
    if not ended and stated != len(rows):
        raise InputError(
            "data without its end",
            field="END_DATA",
            found=f"{len(rows)} sets, then the end of the file",
            expected=f"{stated} sets and END_DATA" if stated is not None else "END_DATA",
            hint="the file is truncated; export it again",
        )
    if stated not in (None, len(rows)):
        raise InputError(
            "the data have not the number of sets that the file states",
            field="NUMBER_OF_SETS",
            found=f"{len(rows)} sets in the data",
            expected=f"{stated}, as stated",
            hint="the file may be truncated; export it again, or correct the count",
        )
    notes = [f"the file does not state {key}" for key in ("NUMBER_OF_FIELDS", "NUMBER_OF_SETS") if key not in counts]
    notes += [] if ended else ["END_DATA is missing; the number of sets is as stated"]
    comma = any(_NUMBER_WITH_COMMA.fullmatch(cell) for row in islice(rows, 50) for cell in row)
    return CgatsTable(identifier, keywords, fields, rows, "," if comma else ".", tuple(notes))


def _rows(fields: list[str], lines: Iterator[tuple[int, str]]) -> tuple[list[list[str]], bool]:
    """Sets of data up to END_DATA; a set may run over several lines, and names without quotes hold spaces where tabs
    part the cells.
    """
    rows: list[list[str]] = []
    pending: list[str] = []
    begun, ended = 0, False
    for line_number, line in lines:
        if not line.strip():
            continue
        if ended := line.strip().upper() == "END_DATA":
            break
        if "\t" in line and not pending:
            cells = [cell.strip().strip('"') for cell in line.rstrip("\r\n").split("\t")]
            if len(cells) == len(fields) + 1 and not cells[-1]:
                cells.pop()
            if len(cells) == len(fields):
                rows.append(cells)
                continue
        words = tokens(line)
        begun = begun if pending else line_number
        if pending and len(words) <= len(fields) < len(pending) + len(words):
            break
        pending += words
        if len(pending) > len(fields):
            break
        if len(pending) == len(fields):
            rows.append(pending)
            pending = []
    if pending:
        raise InputError(
            "a set does not fit the data format",
            field=f"line {begun}",
            found=f"{len(pending)} values",
            expected=f"{len(fields)} values, one a field",
            hint="the file may be truncated, or a name with spaces lacks its quotation marks",
        )
    return rows, ended
