"""Workbooks of spreadsheet programs that are known by their first bytes and not read, each with what to do about it."""

from __future__ import annotations

import re
import struct
import zipfile
from pathlib import Path
from typing import NamedTuple


class UnreadSheet(NamedTuple):
    """A kind of workbook that is not read.

    Parameters
    ----------
    name, hint : what people call it, and what to do with it.
    mark : pattern that its first bytes begin with.
    suffix : what its name ends in where its bytes are those of other files, too; "" where they tell.
    member : pattern that a member's name begins with, where it is a zip container.
    """

    name: str
    hint: str
    mark: bytes
    suffix: str = ""
    member: str = ""


_ANY_TEXT = rb"(?:\xef\xbb\xbf)?\s*"
SHEETS = (
    UnreadSheet("an Excel 97 workbook", "open it and save it as .xlsx", rb"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"),
    UnreadSheet("a workbook of Excel 5 or older", "open it and save it as .xlsx", rb"\x09[\x00\x02\x04\x08]", ".xls"),
    UnreadSheet(
        "a binary Excel workbook (.xlsb)", "open it and save it as .xlsx", rb"PK\x03\x04", member=r"xl/workbook\.bin"
    ),
    UnreadSheet(
        "an Excel 2003 workbook in XML",
        "open it and save it as .xlsx",
        _ANY_TEXT + rb'(?s:<\?xml.{0,200}?<\?mso-application\s+progid="Excel)',
    ),
    UnreadSheet(
        "a web page that is named as a workbook",
        "open it in a spreadsheet program and save it as .xlsx",
        _ANY_TEXT + rb"(?i:<!doctype html|<html|<table|<meta)",
        ".xls",
    ),
    UnreadSheet(
        "an OpenDocument spreadsheet",
        "open it and save it as .xlsx, or the sheet as CSV",
        rb"(?s:PK\x03\x04.{26}mimetypeapplication/vnd\.oasis\.opendocument\.spreadsheet)",
    ),
)


def unread_sheet(path: Path, head: bytes) -> UnreadSheet | None:
    """Find the kind of workbook that a file is, of those that are not read; None where it is none of them."""
    for sheet in SHEETS:
        if not re.match(sheet.mark, head) or not path.name.casefold().endswith(sheet.suffix):
            continue
        if not sheet.member or any(re.match(sheet.member, name) for name in members(path)):
            return sheet
    return None


def members(path: Path) -> tuple[str, ...]:
    """Return the names in a zip container, as far as it can be read."""
    try:
        with zipfile.ZipFile(path) as opened:
            return tuple(opened.namelist())
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError, EOFError, RuntimeError, struct.error):
        return ()
