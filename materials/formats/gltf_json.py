"""Addressed JSON: values from an untrusted file, each with its place for errors."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from ...runtime.errors import InputError
from ...spectral.spectrum import as_float

# A file of more values than this takes more memory as Python objects than a texture set does.
MOST_VALUES = 4_000_000
Real = float | int
# Floats of 32 bits, printed: 1 may come out a hair larger.
_ROUNDING = 1e-6


@dataclass(frozen=True)
class JsonNode:
    """JSON object {} of a file, and its place: "materials[2].pbrMetallicRoughness"."""

    file: Path
    place: str
    values: dict[str, Any]

    def refuse(
        self, name: str, problem: str, found: object, expected: str, hint: str = "export the file again"
    ) -> NoReturn:
        """Raise an `InputError` about the value of that name."""
        raise InputError(problem, file=self.file, field=self._at(name), found=found, expected=expected, hint=hint)

    def has(self, name: str) -> bool:
        """Return whether the object has that name."""
        return name in self.values

    def child(self, name: str) -> JsonNode:
        """Return the object of that name, empty if there is none."""
        value = self.values.get(name, {})
        if not isinstance(value, dict):
            self.refuse(name, "not an object", _shown(value), "{ ... }")
        return JsonNode(self.file, self._at(name), value)

    def children(self, name: str) -> list[JsonNode]:
        """Return the objects in the list of that name; none without one."""
        values = self.values.get(name, [])
        if not isinstance(values, list) or not all(isinstance(value, dict) for value in values):
            self.refuse(name, "not a list of objects", _shown(values), "[{ ... }, ...]")
        return [JsonNode(self.file, f"{self._at(name)}[{number}]", value) for number, value in enumerate(values)]

    def text(self, name: str, default: str = "") -> str:
        """Return the text of that name; anything else is refused."""
        value = self.values.get(name, default)
        if not isinstance(value, str):
            self.refuse(name, "not text", _shown(value), "text in quotes")
        return value

    def number(self, name: str, default: Real, low: Real = 0.0, high: Real = math.inf) -> float:
        """Return a finite number from `low` to `high`."""
        return self._number(name, self.values.get(name, default), low, high)

    def numbers(self, name: str, default: tuple[Real, ...], low: Real = 0.0, high: Real = math.inf) -> list[float]:
        """Return a list of as many numbers as `default` has."""
        values = self.values.get(name, list(default))
        if not isinstance(values, list) or len(values) != len(default):
            self.refuse(name, "not a list of that length", _shown(values), f"{len(default)} numbers")
        return [self._number(f"{name}[{at}]", value, low, high) for at, value in enumerate(values)]

    def whole(self, name: str, default: int | None = None, below: int | None = None) -> int:
        """Return a whole number from 0 to below `below`; refused if it is missing and has no default."""
        value, limit = self.values.get(name, default), sys.maxsize if below is None else below
        if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < limit:
            expected = "0, 1, 2, ..." if below is None else f"0, 1, 2, ..., less than {below}"
            self.refuse(name, "not an index or a size" if name in self.values else "missing", _shown(value), expected)
        return value

    def _number(self, name: str, value: Any, low: Real, high: Real) -> float:
        number = as_float(value) if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
        if low - _ROUNDING <= number <= high + _ROUNDING:
            number = min(max(number, low), high)
        if not (math.isfinite(number) and low <= number <= high):
            expected = f"a number from {low:g} to {high:g}" if high < math.inf else f"a number, {low:g} or more"
            self.refuse(name, "out of its domain", _shown(value), expected)
        return number

    def _at(self, name: str) -> str:
        return f"{self.place}.{name}" if self.place else name


def parsed(raw: bytes, file: Path) -> JsonNode:
    """Return the object that is the whole of a JSON text; raises `InputError` naming `file`."""
    weight = sum(raw.count(sign) for sign in (b",", b"[", b"{"))
    if weight > MOST_VALUES:
        raise InputError(
            "too many values",
            file=file,
            field="JSON",
            found=weight,
            expected=f"at most {MOST_VALUES}",
            hint="export the materials without the geometry",
        )
    try:
        root = json.loads(raw.decode("utf-8-sig"), parse_constant=_no_number)
    except (ValueError, RecursionError) as reason:
        raise InputError(
            "not valid JSON",
            file=file,
            field="JSON",
            found=f"{reason}"[:200] or type(reason).__name__,
            expected="an object { ... } in UTF-8",
            hint="the file is damaged or cut short: export or copy it again",
        ) from None
    node = JsonNode(file, "", {"JSON": root})
    return JsonNode(file, "", root) if isinstance(root, dict) else node.child("JSON")


def compact(value: Any) -> str:
    """Return a value as JSON in one line of ASCII, its keys sorted."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"))


def _no_number(word: str) -> NoReturn:
    raise ValueError(f"{word} is not a number of JSON")


def _shown(value: Any) -> str:
    return "nothing" if value is None else repr(value)[:80]
