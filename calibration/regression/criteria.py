"""Criteria of rows, each a statistic of some rows by one formula with limits to warn and to fail."""

from __future__ import annotations

import fnmatch
import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError, UnknownNameError
from ...runtime.files import read_text
from ...spectral.formula import Formula, formula
from .row import RowName

Tier = Literal["pass", "warn", "fail"]
#: From the best to the worst.
TIERS: tuple[Tier, ...] = ("pass", "warn", "fail")
#: Statistics of a map of ΔE; "share over t" too.
STATISTICS = ("mean", "median", "p95", "p99", "max")
#: Statistic of pixels whose coverage differs, which have no ΔE.
RESHAPED = "reshaped"
#: Subjects of a criterion: change of pictures, references, readings; or the distance of pictures from references now.
SUBJECTS = ("picture", "reference", "reading", "approximation")
_SHARE = re.compile(r"share over (\d+(?:\.\d+)?)")
_QUANTILES = {"median": 50.0, "p95": 95.0, "p99": 99.0}
_KEYS = {"label", "subset", "statistic", "formula", "warn", "fail", "over"}
_SUBSET = {"of", "region", *RowName._fields}
_TOML = "criteria rows: [[criteria]] with label, statistic, warn and fail"

#: Left, top, right and bottom of a part of the picture, as shares of its width and height.
Region = tuple[float, float, float, float]


@dataclass(frozen=True)
class Criterion:
    """One criterion.

    Parameters
    ----------
    statistic : one of `STATISTICS`, "share over t" (of the pixels, from 0 to 1), or "reshaped" (a share, too).
    warn, fail : limits of the statistic, above which it warns or fails.
    of : of `SUBJECTS`; none means every change, and not the approximation.
    names : patterns for parts of the name of rows. region : of the picture, by its name.
    pooled : one figure over all rows, the statistic of their means, in place of one per row.
    """

    label: str
    statistic: str
    formula: Formula
    warn: float
    fail: float
    of: tuple[str, ...] = SUBJECTS[:3]
    names: Mapping[str, tuple[str, ...]] | None = None
    region: str | None = None
    pooled: bool = False

    def applies(self, name: RowName) -> bool:
        """Return whether it applies to a row of this name."""
        wanted = self.names or {}
        return all(any(fnmatch.fnmatchcase(getattr(name, part), p) for p in ps) for part, ps in wanted.items())

    def tier(self, value: float) -> Tier:
        """Judge a figure; NaN fails."""
        if not math.isfinite(value) or value > self.fail:
            return "fail"
        return "warn" if value > self.warn else "pass"

    @property
    def words(self) -> str:
        """The criterion in a line."""
        of = "" if self.statistic == RESHAPED else f" {self.formula.name}"
        return f"{self.statistic}{of}: warn above {self.warn:g}, fail above {self.fail:g}"


@dataclass(frozen=True)
class Criteria:
    """All criteria, the regions that they name, and the tiers of added and removed rows."""

    lines: tuple[Criterion, ...]
    regions: Mapping[str, Region]
    added: Tier = "warn"
    removed: Tier = "fail"

    @property
    def formulas(self) -> tuple[Formula, ...]:
        """Required formulas, ΔE94 first and always."""
        named = {one.formula.name: one.formula for one in self.lines}
        return tuple({"CIE 1994": Formula("CIE 1994"), **named}.values())

    @property
    def largest(self) -> tuple[Formula, ...]:
        """Criteria on the largest ΔE of a row."""
        return tuple({one.formula.name: one.formula for one in self.lines if one.statistic == "max"}.values())


def default_criteria() -> Criteria:
    """Return the default criteria: ΔE94 at the threshold of a trained eye."""
    in_94 = Formula("CIE 1994")
    return Criteria(
        (
            Criterion("average", "mean", in_94, 0.1, 0.5),
            Criterion("worst part", "p99", in_94, 0.3, 1.0),
            Criterion("single pixels", "max", in_94, 1.0, 3.0),
            Criterion("shape", RESHAPED, in_94, 0.001, 0.01),
        ),
        {},
    )


def statistic(name: str, values: Float[np.ndarray, " n"]) -> float:
    """Compute a statistic of ΔE values; NaN without any.

    >>> statistic("share over 1", np.array([0.5, 1.5])), statistic("median", np.array([1.0, 2.0, 4.0]))
    (0.5, 2.0)
    """
    if not values.size:
        return math.nan
    if (limit := share_limit(name)) is not None:
        return float(np.count_nonzero(values > limit)) / values.size
    if name == "mean":
        return float(values.mean(dtype=np.float64))
    if name == "max":
        return float(values.max())
    return float(np.percentile(values.astype(np.float64), _QUANTILES[name]))


def share_limit(name: str) -> float | None:
    """Return the ΔE of a statistic such as "share over 1"; None of any other."""
    found = _SHARE.fullmatch(name)
    return float(found[1]) if found else None


def quantile_of(name: str) -> float:
    """Return the fraction of pixels below a statistic such as "p95".

    >>> quantile_of("median"), quantile_of("p99")
    (0.5, 0.99)
    """
    return _QUANTILES[name] / 100.0


def read_criteria(path: Path) -> Criteria:
    """Return the criteria of a TOML file, such as

        [[criteria]]
        label = "paint, on average"
        subset = { material = "paint/*", light = ["D65", "A"], of = "picture" }
        statistic = "mean"
        formula = "CIE 2000"
        warn = 0.1
        fail = 0.5

    Raises
    ------
    InputError : no TOML, a key that is not known, a limit that is no number, warn above fail.
    """
    try:
        document = tomllib.loads(read_text(path))
    except tomllib.TOMLDecodeError as reason:
        raise InputError("the criteria cannot be read", file=path, found=str(reason), expected="TOML") from None
    try:
        # A suite's file holds its criteria, too.
        _check_keys(document, {"criteria", "regions", "rows", "suite"}, "the file")
        return criteria_of(document)
    except InputError as reason:
        raise reason.at(file=path) from None


def criteria_of(document: Mapping[str, Any]) -> Criteria:
    """Return the criteria of a document that has been read: its `criteria`, `regions` and `rows`.

    Raises
    ------
    InputError : as `read_criteria`.
    """
    lines = document.get("criteria", [])
    if not isinstance(lines, list) or not lines:
        raise InputError("no criteria", field="criteria", found=lines, expected=_TOML)
    regions = {str(name): _region(name, found) for name, found in _table(document, "regions").items()}
    rows = _table(document, "rows")
    _check_keys(rows, {"added", "removed"}, "rows")
    for key, found in rows.items():
        if found not in TIERS:
            raise UnknownNameError("tier", str(found), TIERS, field=f"rows.{key}")
    return Criteria(
        tuple(_criterion(index, line, regions) for index, line in enumerate(lines)),
        regions,
        rows.get("added", "warn"),
        rows.get("removed", "fail"),
    )


def _table(document: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    found = document.get(key, {})
    if not isinstance(found, Mapping):
        raise InputError("not a table", field=key, found=found, expected=f"[{key}]")
    return found


def _check_keys(found: Mapping[str, Any], known: set[str], field: str) -> None:
    for key in found:
        if key not in known:
            raise UnknownNameError("key", key, sorted(known), field=field)


def _region(name: str, found: Any) -> Region:
    numbers = found if isinstance(found, list) and all(isinstance(one, int | float) for one in found) else []
    if len(numbers) != 4 or not (0 <= numbers[0] < numbers[2] <= 1 and 0 <= numbers[1] < numbers[3] <= 1):
        raise InputError(
            "not a part of a picture",
            field=f"regions.{name}",
            found=found,
            expected="[left, top, right, bottom] as shares from 0 to 1, such as [0.25, 0.25, 0.75, 0.75]",
        )
    left, top, right, bottom = map(float, numbers)
    return left, top, right, bottom


def _criterion(index: int, line: Any, regions: Mapping[str, Region]) -> Criterion:
    field = f"criteria[{index}]"
    if not isinstance(line, Mapping):
        raise InputError("not a criterion", field=field, found=line, expected=_TOML)
    _check_keys(line, _KEYS, field)
    name = line.get("statistic")
    if not (name in STATISTICS or name == RESHAPED or (isinstance(name, str) and _SHARE.fullmatch(name))):
        known = (*STATISTICS, "share over 1.0", RESHAPED)
        raise UnknownNameError("statistic", str(name), known, field=f"{field}.statistic")
    warn, fail = (_limit(line, key, field) for key in ("warn", "fail"))
    if warn > fail:
        found = f"warn {warn:g}, fail {fail:g}"
        raise InputError("warns later than it fails", field=field, found=found, expected="warn <= fail")
    try:
        by = formula(str(line.get("formula", "CIE 1994")))
    except InputError as reason:
        raise reason.at(field=f"{field}.formula") from None
    over = line.get("over", "pixels")
    if over not in ("pixels", "rows") or (over == "rows" and name == RESHAPED):
        raise InputError(
            "not what a statistic is taken of", field=f"{field}.over", found=over, expected='"pixels" or "rows"'
        )
    of, names, region = _subset(line.get("subset", {}), f"{field}.subset", regions)
    return Criterion(str(line.get("label", name)), name, by, warn, fail, of, names, region, over == "rows")


def _limit(line: Mapping[str, Any], key: str, field: str) -> float:
    found = line.get(key)
    if isinstance(found, bool) or not isinstance(found, int | float) or not 0 <= found < math.inf:
        raise InputError("not a limit", field=f"{field}.{key}", found=found, expected="a number, 0 or above")
    return float(found)


def _subset(
    found: Any, field: str, regions: Mapping[str, Region]
) -> tuple[tuple[str, ...], Mapping[str, tuple[str, ...]], str | None]:
    if not isinstance(found, Mapping):
        raise InputError("not a subset", field=field, found=found, expected='a table such as { material = "paint/*" }')
    _check_keys(found, _SUBSET, field)
    of = _texts(found.get("of", SUBJECTS[:3]), f"{field}.of")
    for one in of:
        if one not in SUBJECTS:
            raise UnknownNameError("subject", one, SUBJECTS, field=f"{field}.of")
    region = found.get("region")
    if region is not None and region not in regions:
        raise UnknownNameError("region", str(region), regions, field=f"{field}.region")
    names = {part: _texts(found[part], f"{field}.{part}") for part in RowName._fields if part in found}
    return of, names, region


def _texts(found: Any, field: str) -> tuple[str, ...]:
    texts = (found,) if isinstance(found, str) else found
    if not (isinstance(texts, Sequence) and texts and all(isinstance(one, str) for one in texts)):
        raise InputError("not a name", field=field, found=found, expected="a name, a pattern, or a list of them")
    return tuple(texts)
