"""Errors of Metamer, each with the subject, the value found, the expectation and the next step."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from copy import copy
from pathlib import Path

# Most names given in full.
_FEW = 8
# Command that lists the names of a kind that has more.
_LISTED_BY = {
    "illuminant": "metamer names",
    "booth": "metamer names",
    "material": "metamer catalogue list",
    "file, illuminant or emission of the catalogue": "metamer names",
}
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]")
_CONTROL_IN_LINES = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


def visible(text: str, *, lines: bool = False) -> str:
    """Escape control characters, so that the content of a file cannot control a terminal.

    lines : keep tabs and line feeds.

    >>> visible("red\\x1b[31m")
    'red\\\\x1b[31m'
    """
    pattern = _CONTROL_IN_LINES if lines else _CONTROL
    return pattern.sub(lambda found: repr(found[0])[1:-1], text)


class MetamerError(Exception):
    """Failure that a user can act on; `exit_code` is that of the command."""

    exit_code = 4

    def __reduce__(self) -> tuple:
        # The default calls the class with the message alone, which not every one takes: it would end a worker process.
        return _revived, (type(self), self.args, self.__dict__)


def _revived(kind: type[MetamerError], args: tuple, state: dict) -> MetamerError:
    error = kind.__new__(kind, *args)
    error.__dict__.update(state)
    return error


class UsageError(MetamerError):
    """Error of contradictory or missing arguments of a command."""

    exit_code = 64


class ComparisonError(MetamerError):
    """Error of two sides that cannot be compared."""

    exit_code = 3


class InputError(MetamerError):
    """Error of an unusable file or value; of an option (`field` is `--NAME`, no `file`) it is wrong usage.

    Parameters
    ----------
    problem : description, as one clause without a full stop.
    file, field : a path, and a key, column, channel or argument inside it.
    found, expected : the value found, and the accepted ones.
    hint : the user's next step.
    named_in : the file and place that name `file`, if the user wrote that one.
    """

    def __init__(
        self,
        problem: str,
        *,
        file: str | Path | None = None,
        field: str | None = None,
        found: object = None,
        expected: str | None = None,
        hint: str | None = None,
        named_in: str | None = None,
    ) -> None:
        self.problem, self.file, self.field = problem, file, field
        self.found, self.expected, self.hint, self.named_in = found, expected, hint, named_in
        where = ": ".join(visible(str(part)) for part in (file, field) if part is not None)
        lines = [f"{where}: {problem}" if where else problem]
        lines += [
            f"  {label}: {visible(str(value), lines=True)}"
            for label, value in (("found", found), ("expected", expected), ("named in", named_in), ("try", hint))
            # An empty word would stand behind its label as nothing.
            if value is not None and str(value)
        ]
        super().__init__("\n".join(lines))
        # The value of an option, and no file's.
        wrong_usage = file is None and (field or "").startswith("--")
        self.exit_code = UsageError.exit_code if wrong_usage else MetamerError.exit_code

    def at(
        self,
        *,
        file: str | Path | None = None,
        field: str | None = None,
        found: object = None,
        expected: str | None = None,
        hint: str | None = None,
        named_in: str | None = None,
        problem: str | None = None,
    ) -> InputError:
        """Return the same failure, of the same class, with missing parts added; None leaves a part unchanged."""
        given = {"file": file, "field": field, "found": found, "expected": expected, "hint": hint}
        given |= {"named_in": named_in}
        parts = {name: getattr(self, name) if value is None else value for name, value in given.items()}
        placed = copy(self)
        InputError.__init__(placed, self.problem if problem is None else problem, **parts)
        return placed


class NoRoomError(InputError):
    """Error of a full disk, on which further writes would fail as well."""


class UnknownNameError(InputError):
    """Error of a name that is not in a list; the message suggests the nearest ones."""

    def __init__(
        self,
        kind: str,
        name: str,
        known: Iterable[str],
        *,
        file: str | Path | None = None,
        field: str | None = None,
    ) -> None:
        self.kind, self.name, self.known = kind, name, tuple(known)
        by_folded = {candidate.casefold(): candidate for candidate in self.known}
        self.nearest = [
            by_folded[hit] for hit in difflib.get_close_matches(name.casefold(), by_folded, n=3, cutoff=0.4)
        ]
        expected = ", ".join(self.known) or "a known name, but there are none here"
        if len(self.known) > _FEW:
            some = "" if self.nearest else f", such as {', '.join(self.known[: _FEW // 2])}"
            listed = f"; `{_LISTED_BY[kind]}` lists them" if kind in _LISTED_BY else ""
            expected = f"one of {len(self.known)} known names{some}{listed}"
        listed = f"`{_LISTED_BY[kind]}` lists what there is" if not self.known and kind in _LISTED_BY else None
        hint = f"nearest: {', '.join(self.nearest)}" if self.nearest else listed
        super().__init__(f"unknown {kind}", file=file, field=field, found=repr(name), expected=expected, hint=hint)
