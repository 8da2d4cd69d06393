"""Text as instruments and spreadsheets write it: encodings, lines, numbers."""

from __future__ import annotations

import math
import re
import unicodedata
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from ....runtime.errors import InputError
from ....runtime.files import existing_file
from .languages import words_spoken

#: Bytes and lines; a text that is larger is no measurement that a person meant to import.
LARGEST, MOST_LINES = 256 * 2**20, 1_000_000

_LINE_END = re.compile(r"\r\n|\r|\n")
_WIDE = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}
# Encodings of older systems, by region; and the bytes that are looked through for words.
_LEGACY = ("cp1252", "cp1250", "cp1251", "cp1254", "koi8-r", "cp932", "gb18030", "euc_jp", "big5")
_SPOKEN = 1 << 14
_FULL_WIDTH = {code: code - 0xFEE0 for code in range(0xFF01, 0xFF5F)} | {0x3000: " ", 0x339A: "nm"}
# Characters that no text holds: controls other than tab, line and page ends, escape.
_BINARY = re.compile(r"[\x00-\x08\x0e-\x1a\x1c-\x1f]")

# Filler of fixed fields of a text, and the least number of characters between two runs of it.
_FILLED = re.compile(rb"\0+")
_LEAST_BETWEEN = 20

_JCAMP = re.compile(r"\s{0,99}##\s?(?:TITLE|JCAMP-?DX)\s{0,9}=", re.I)

_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
# A power of ten: behind a sign of multiplication or division or a word for one, before a unit, or alone in brackets.
_RAISED_TEN = r"10 ?(?:\^|\*\*) ?\(?[-−+]?\d{1,2}\)?|10?(?:[.,]0)?e[-−+]?\d{1,2}"
_TEN = rf"(?:{_RAISED_TEN}|0[.,]0*1(?!\d)|10+(?![\d.,]))"
_TENTHS = {"tenth": 1, "ten": 1, "hundredth": 2, "hundred": 2, "thousandth": 3, "thousand": 3}
_TIMES = (
    r"(?<![A-Za-z\d])(?<!\d )x|[·÷]|(?<!\d)(?<!\d )[×*]|times|\bby|scal\w{1,3}(?: factor)?\W{1,3}|"
    r"mult\w+\W{1,3}|(?<!ance )\bfactor\W{1,3}|(?<!\d)(?<!\d )(?<!(?-i:[A-Z]))(?: /|/)|"
    r"(?<![A-Za-z])[RT] ?/|(?<!\d)1 ?[/:]"
)
# A power that may be two: 10e-3.
_UNCLEAR = 99

#: Spellings of "no value here" in a cell.
MISSING = frozenset({"", "-", "--", "---", "nan", "na", "n/a", "n.a.", "#n/a", "null", "none", "nil", "."})


def _decoded(data: bytes) -> str | None:
    """Text of bytes: UTF-8, UTF-16 with a byte-order mark, or an older encoding; None if it is no text.

    Letters and their marks are one character each, and signs of full width are as any others.
    """
    if encoding := _WIDE.get(data[:2]):
        text = data[2:].decode(encoding, errors="replace")
    else:
        # Fixed fields of a header are filled up with NUL, which parts what stands before and behind it; half of a text
        # in UTF-16 without its mark is NUL, too.
        if data.count(b"\0"):
            data, runs = _FILLED.subn(b" ", data)
            if _LEAST_BETWEEN * runs > len(data):
                return None
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = _legacy_decoded(data)
    if _BINARY.search(text):
        return None
    return text if text.isascii() else unicodedata.normalize("NFC", text).translate(_FULL_WIDTH)


def _legacy_decoded(data: bytes) -> str:
    """Text in the encoding of an older system: the one in which most of the words that files have are found."""
    start = data[:_SPOKEN]
    found = {encoding: words_spoken(start.decode(encoding, errors="ignore")) for encoding in _LEGACY}
    best = max(_LEGACY, key=found.__getitem__)
    if found[best] and best != "cp1252":
        return data.decode(best, errors="replace")
    try:
        return data.decode("cp1252")
    except UnicodeDecodeError:
        return data.decode("latin-1")


@lru_cache(maxsize=2)  # each reader in turn asks for the same one
def head_text(head: bytes) -> str:
    """Return the start of a file as text, "" if it is no text; the character that is cut at its end does no harm."""
    if head[:2] in _WIDE:
        head = head[: len(head) // 2 * 2]
    else:
        for cut in range(1, 4):  # a UTF-8 character has four bytes at most
            if len(head) > cut and head[-cut] >= 0xC0:
                head = head[:-cut]
                break
    return _decoded(head) or ""


def is_jcamp(text: str) -> bool:
    """Return whether a text begins as JCAMP-DX: packed ordinates, with units and factors of its own, are no table."""
    return bool(_JCAMP.match(text))


def read_lines(path: str | Path) -> list[str]:
    """Lines of a text file without their ends.

    Raises
    ------
    InputError
        There is no such file, or it is empty, binary, unreadable or larger than `LARGEST`.
    """
    path = existing_file(path)
    try:
        size = path.stat().st_size
        if size > LARGEST:
            raise InputError(
                "too large for a text of spectra",
                found=f"{size / 2**20:.0f} MB",
                expected=f"at most {LARGEST // 2**20} MB",
                hint="split the file, or export fewer spectra at a time",
            )
        data = path.read_bytes()
    except OSError as reason:
        raise InputError("the file cannot be read", found=reason.strerror) from None
    if not data.strip():
        raise InputError(
            "the file is empty",
            found="nothing but white space" if data else "0 bytes",
            expected="text with numbers in it",
            hint="export or copy it again",
        )
    count = max(data.count(b"\n"), data.count(b"\r"))
    if count > MOST_LINES:
        raise InputError(
            "too many lines for a text of spectra",
            found=f"{count} lines",
            expected=f"at most {MOST_LINES}",
            hint="split the file, or export fewer spectra at a time",
        )
    text = _decoded(data)
    if text is None:
        raise InputError("not a text file", found=f"first bytes {data[:8]!r}", expected="text with numbers in columns")
    return _LINE_END.split(text)


def cell_number(cell: str, decimal: str = ".") -> float:
    """Return the number in a cell that has `decimal` for its decimal mark; NaN if it is none, or not finite."""
    if decimal == ",":
        if "." in cell or cell.endswith(","):
            return math.nan
        cell = cell.replace(",", ".")
    try:
        value = float(cell.replace("\u2212", "-").replace("\u2013", "-"))
    except ValueError:
        return math.nan
    return value if math.isfinite(value) and "_" not in cell else math.nan


def is_number(word: str) -> bool:
    """Return True if Python reads a number of a word, with a point for its decimal mark, finite or not."""
    try:
        float(word)
    except ValueError:
        return False
    return True


def is_missing(cell: str) -> bool:
    """Return whether a cell says that there is no value."""
    return cell.strip().casefold() in MISSING


def one_line(words: str) -> str:
    """Words with single spaces, no longer than any header: what patterns are tried on stays small."""
    return " ".join(words[:8000].split())


class PowerOfTen(NamedTuple):
    """A power of ten in words, without its sign, and whether a unit is behind it, or a sign of division before it."""

    power: int
    of_unit: bool = False
    over: bool = False


def power_of_ten(words: str, units: str) -> PowerOfTen | None:
    """Find the power of ten that words multiply or divide something by; of two that may be meant, a large one.

    units : pattern of what it may stand before.

    >>> power_of_ten("Wavelength x10 (nm)", "nm"), power_of_ten("0.1 nm", "nm"), power_of_ten("R D65/10", "nm")
    (PowerOfTen(power=1, of_unit=False, over=False), PowerOfTen(power=1, of_unit=True, over=False), None)
    """
    found = _tenfold(units).search(lowered(one_line(words)))
    if found is None:
        return None
    if found["tenths"]:
        return PowerOfTen(_TENTHS[found["tenths"].lower()], True)
    text = next(filter(None, found.groups())).replace(",", ".").replace("−", "-")
    raised = re.search(r"[\^*]\D*(\d+)", text)
    if raised or not re.match("10.*e", text, re.I):
        power = int(raised[1]) if raised else abs(round(math.log10(float(text))))
    else:
        power = _UNCLEAR
    over = re.match(r"\W*(?:[RT] ?)?[/÷]", found[0], re.I) is not None or "divided" in words
    return PowerOfTen(power, found["before"] is not None, over)


@lru_cache(maxsize=4)
def _tenfold(units: str) -> re.Pattern[str]:
    behind = rf"(?![\d°]| ?[A-Za-z°µμ])(?! ?(?:{units}))|(?= ?(?:{units}))"
    return re.compile(
        rf"\b(?P<tenths>{'|'.join(_TENTHS)})s?(?: of|\W*$)|(?:{_TIMES}) ?\(?(?P<times>{_TEN})(?:{behind})|"
        rf"(?<![\w.,])(?P<before>{_TEN}) ?[x×*·]? ?(?:{units})|"
        rf"[\[(] ?(0[.,]0*1) ?[\])]|(?<![\w.,])({_RAISED_TEN})(?:{behind})",
        re.I,
    )


def lowered(words: str) -> str:
    """Return words with raised digits, as in 10⁻⁹, behind a sign for a power."""
    return re.sub("[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+", lambda match: f"^{match[0].translate(_RAISED)}", words)


def shortened(words: str, most: int = 80) -> str:
    """Words on one line that a message or a detail can hold."""
    line = " ".join(words.split())
    return line if len(line) <= most else line[: most - 1] + "…"
