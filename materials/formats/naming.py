"""Names in files as readers use them: words for ids, and text that a record can hold."""

from __future__ import annotations

import hashlib
import re
import unicodedata

# Longer names make paths that some systems refuse.
_LONGEST_NAME = 80


def slug(name: str) -> str:
    """Return a name fit for an id: "5R 4/14" -> "5r-4-14"."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")


def id_word(name: str) -> str:
    """Return a name fit for an id, and the same each time: accents go; what has no Latin letters leaves digits of its
    hash.

    >>> id_word("Crème brûlée"), id_word("赤 1"), id_word("5R 4/14")
    ('creme-brulee', '1-b23441', '5r-4-14')
    """
    plain = "".join(sign for sign in unicodedata.normalize("NFKD", name) if not unicodedata.combining(sign))
    word = slug(plain)[:_LONGEST_NAME].strip("-")
    letters = "".join(sign for sign in plain if sign.isalnum())
    if word and len(word) < _LONGEST_NAME and re.fullmatch(r"[A-Za-z0-9]*", letters):
        return word
    digits = hashlib.sha256(unicodedata.normalize("NFC", name).encode("utf-8", "surrogatepass")).hexdigest()[:6]
    return f"{word or 'sample'}-{digits}"


def printable(text: str) -> str:
    """Text that any file can hold: NUL, and what is no whole character, as their codes.

    >>> printable("a\\0"), printable("\\udcff.brdf")
    ('a\\\\0', '\\\\udcff.brdf')
    """
    return text.replace("\0", "\\0").encode("utf-8", "backslashreplace").decode("utf-8")
