"""Queries for materials by the heads of their files: only the first page of each is read."""

from __future__ import annotations

import fnmatch
import os
import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from ...runtime.errors import InputError, UnknownNameError
from ...runtime.remote import RemotePath, place
from .record_head import IMPORT_AGAIN, head_from, no_such_file, other_material, read_head
from .remote_heads import remote_heads
from .standing import standing_of

if TYPE_CHECKING:
    from ...spectral.difference import FormulaName

_DIGITS = re.compile(r"([0-9]+)")
#: Words of a summary, with the field of `Query` that asks for each.
WORDS = {"family": "families", "model": "models", "kind": "kinds", "quantity": "quantities"}
SORT_KEYS = ("id", "family", "model", "kind", "quantity", "error", "terms", "lightness", "chroma", "hue", "near")


@dataclass(frozen=True)
class Summary:
    """Summary of a material from the head of its file.

    Attributes
    ----------
    kind : of the provenance; quantity : "reflectance", "bispectral", "emission", "transmittance", "radiance factor".
    terms : (number of terms, frame) of each pack; precision : "single", "half" or "" without packs.
    mean, p95, p99, maximum : measured ΔE94 of the packs, under `light` for `observer`; None without any.
    where : directions of light and view at the maximum, in words; None if they were not recorded.
    lab, xyz : colour at 45:0 under D65, 1931 2 degrees (XYZ: Y of the perfect diffuser = 1); None without one.
    budget, score, more_terms, more_score : of the fit, see `FitError`; None without one.
    bytes : of the arrays before compression. distance : from the requested colour.
    """

    id: str
    path: str
    family: str
    model: str
    kind: str
    quantity: str
    licence: str
    terms: tuple[tuple[int, str], ...]
    precision: str
    mean: float | None
    p95: float | None
    p99: float | None
    maximum: float | None
    light: str | None
    observer: str | None
    lab: tuple[float, float, float] | None
    xyz: tuple[float, float, float] | None
    bytes: int
    source_hash: str
    checksum: str
    budget: float | None = None
    score: float | None = None
    more_terms: float | None = None
    more_score: float | None = None
    distance: float | None = None
    where: str | None = None

    @property
    def far_off(self) -> str:
        """Say where the maximum is, if it is more than ten of the fit's own budgets; else ""."""
        from ..core.fit_error import far_off

        return far_off(self)

    @property
    def standing(self) -> str:
        """The kind in one word: measured, analytic, uplifted or reconstructed."""
        return standing_of(self.kind)

    @property
    def file(self) -> Path:
        """The material's file."""
        return place(self.path)

    @property
    def rank(self) -> int:
        """Terms of all packs."""
        return sum(count for count, _ in self.terms)


@dataclass(frozen=True)
class Heads:
    """Heads of a catalogue's files, all read; `unusable` has an error for each unreadable one."""

    summaries: tuple[Summary, ...]
    unusable: tuple[InputError, ...] = ()

    def __len__(self) -> int:
        return len(self.summaries)

    def select(self, query: Query) -> tuple[Summary, ...]:
        """Summaries of the materials that fit, sorted."""
        return query.of(self.summaries)

    def words(self, name: str) -> frozenset[str]:
        """Return the existing families, models, kinds or quantities."""
        return frozenset(getattr(one, name) for one in self.summaries)


def read_heads(folder: Path, suffix: str) -> Heads:
    """Read the head of every material file below `folder`."""
    found: list[Summary] = []
    unusable: list[InputError] = []
    for _, one in summaries(folder, suffix):
        if isinstance(one, Summary):
            found.append(one)
        else:
            unusable.append(one)
    return Heads(tuple(found), tuple(unusable))


def summaries(
    folder: Path, suffix: str, wanted: Collection[str] | None = None
) -> Iterator[tuple[str, Summary | InputError]]:
    """Yield the id and the summary, or the error, of every material below `folder`, or of those `wanted`.

    Behind a URL, many heads are requested at once.
    """
    if isinstance(folder, RemotePath):
        files = [file for file in folder.files() if _is_material(file.name, suffix)]
        names = None if wanted is None else {f"{material_id}{suffix}" for material_id in wanted}
        heads = ((file.name, str(folder / file.name), begins) for file, begins in remote_heads(folder, files, names))
    else:
        heads = ((f"{material_id}{suffix}", file, None) for material_id, file in material_files(folder, suffix))
    for name, file, begins in heads:
        material_id = name[: -len(suffix)]
        if wanted is None or material_id in wanted:
            try:
                yield material_id, summary(material_id, file, begins)
            except InputError as reason:
                yield material_id, reason


def material_files(folder: Path, suffix: str) -> Iterator[tuple[str, str]]:
    """Id and path of every material below `folder`; hidden files and folders are none."""
    if isinstance(folder, RemotePath):
        for file in folder.files():
            if _is_material(file.name, suffix):
                yield file.name[: -len(suffix)], str(folder / file.name)
        return
    top = os.fspath(folder)
    for where, folders, files in os.walk(top):
        folders[:] = [name for name in folders if not name.startswith(".")]
        inside = where[len(top) :].strip(os.sep).replace(os.sep, "/")
        for name in files:
            if name.endswith(suffix) and not name.startswith("."):
                stem = name[: -len(suffix)]
                yield (f"{inside}/{stem}" if inside else stem), f"{where}{os.sep}{name}"


def _is_material(name: str, suffix: str) -> bool:
    return name.endswith(suffix) and not any(part.startswith(".") for part in name.split("/"))


def summary(material_id: str, file: str | Path, begins: bytes | Exception | None = None) -> Summary:
    """Read the summary of one file; raises `InputError` for an unusable head, or one of another material.

    begins : its first bytes, or the error in reading them; None: they are read.
    """
    if isinstance(begins, Exception):
        raise no_such_file(file) if isinstance(begins, FileNotFoundError) else begins
    head = read_head(file) if begins is None else head_from(begins, file)
    if head.get("id") != material_id:
        raise other_material(file, head.get("id"), material_id)
    try:
        return _summary(head, file)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as reason:
        problem = "the head of the file is damaged"
        raise InputError(problem, file=file, found=str(reason), hint=IMPORT_AGAIN) from None


def _summary(head: dict[str, Any], file: str | Path) -> Summary:
    error, colour = head["error"] or {}, head["colour"] or {}
    words = ("id", "family", "model", "kind", "quantity", "licence", "precision", "source_hash", "checksum")
    fields: dict[str, Any] = {name: _text(head[name]) for name in words}
    figures = ("mean", "p95", "p99", "maximum", "budget", "score", "more_terms", "more_score")
    fields |= {name: _number(error.get(name)) for name in figures}
    return Summary(
        path=str(file),
        terms=tuple((int(count), _text(frame)) for count, frame in head["terms"]),
        lab=_three(colour.get("Lab")),
        xyz=_three(colour.get("XYZ")),
        bytes=sum(map(int, head["sizes"].values())),
        light=_text(error["light"]) if error else None,
        observer=_text(error["observer"]) if error else None,
        where=_text(error["where"]) if "where" in error else None,
        **fields,
    )


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r} where text is expected")
    return value


def _number(value: Any) -> float | None:
    return None if value is None else float(value)


def _three(values: Any) -> tuple[float, float, float] | None:
    if values is None:
        return None
    first, second, third = map(float, values)
    return first, second, third


@dataclass(frozen=True)
class Query:
    """Query of materials, with their order. Patterns may contain * and ?; case is ignored; any of several may match.

    Parameters
    ----------
    ids, families, models, kinds, quantities : patterns, one or several; everything matches without any. The kind
        "uplifted" matches every method of uplifting.
    max_error : largest ΔE94 p99; materials without a measured error do not match. coloured : True if CIELAB at 45:0 is
        known.
    near, within : CIELAB at 45:0 under D65, and the largest ΔE from it; `near` is the reference. Alone, `near` sorts.
    formula : of that ΔE, "CIE 1976", "CIE 1994" or "CIE 2000".
    sort : "error" by ΔE94 p99, "near" by the distance from `near` (the default where it is given, else the id).
        Materials without a value to sort by come last, also when reversed.
    limit : largest number, after sorting.
    """

    ids: str | Sequence[str] = ()
    families: str | Sequence[str] = ()
    models: str | Sequence[str] = ()
    kinds: str | Sequence[str] = ()
    quantities: str | Sequence[str] = ()
    max_error: float | None = None
    near: tuple[float, float, float] | None = None
    within: float | None = None
    formula: str = "CIE 1994"
    sort: str | None = None
    reverse: bool = False
    limit: int | None = None
    coloured: bool | None = None

    def __post_init__(self) -> None:
        for name in ("ids", "families", "models", "kinds", "quantities"):
            patterns = getattr(self, name)
            object.__setattr__(self, name, (patterns,) if isinstance(patterns, str) else tuple(patterns))
        if self.sort is not None and self.sort not in SORT_KEYS:
            raise UnknownNameError("order", self.sort, SORT_KEYS, field="sort")
        if self.near is None and (self.within is not None or self.sort == "near"):
            expected = "near = (L, a, b)"
            raise InputError("a distance from nowhere", field="near", found="no colour", expected=expected)
        if self.limit is not None and self.limit < 0:
            raise InputError("unusable limit", field="limit", found=self.limit, expected="0 or more")

    def of(self, summaries: Iterable[Summary]) -> tuple[Summary, ...]:
        """Select the summaries that match, sorted."""
        found = [one for one in summaries if self._fits(one)]
        if self.near is not None:
            found = self._measured(found, self.near)
        found.sort(key=lambda one: (order_key(one.id), one.id))
        order = self.sort or ("id" if self.near is None else "near")
        if order == "id":
            return tuple((found[::-1] if self.reverse else found)[: self.limit])
        value = SORTED_BY[order]
        known = [one for one in found if value(one) is not None]
        known.sort(key=value, reverse=self.reverse)
        return tuple((known + [one for one in found if value(one) is None])[: self.limit])

    def _fits(self, one: Summary) -> bool:
        return (
            _any_fits(one.id, self.ids)
            and all(self.takes(name, getattr(one, name)) for name in WORDS)
            and (self.max_error is None or (one.p99 is not None and one.p99 <= self.max_error))
            and (self.coloured is None or self.coloured == (one.lab is not None))
        )

    def takes(self, name: str, word: str) -> bool:
        """Return whether a family, model, kind or quantity (`name`) matches."""
        patterns = getattr(self, WORDS[name])
        return _any_fits(word, patterns) or (name == "kind" and _any_fits(word.partition("(")[0], patterns))

    def _measured(self, found: list[Summary], near: tuple[float, float, float]) -> list[Summary]:
        """Attach the distances; only materials within the limit, if there is one."""
        import numpy as np

        from ...spectral.difference import delta_e_lab

        coloured = [one for one in found if one.lab is not None]
        labs = np.array([one.lab for one in coloured], dtype=float).reshape(-1, 3)
        far = delta_e_lab(np.broadcast_to(near, labs.shape), labs, cast("FormulaName", self.formula))
        placed = [replace(one, distance=float(d)) for one, d in zip(coloured, far, strict=True)]
        if self.within is not None:
            return [one for one in placed if one.distance is not None and one.distance <= self.within]
        return placed + [one for one in found if one.lab is None]


def _any_fits(word: str, patterns: Sequence[str]) -> bool:
    return not patterns or any(fnmatch.fnmatchcase(word.casefold(), pattern.casefold()) for pattern in patterns)


def order_key(text: str) -> str:
    """Return a text that sorts by words and whole numbers in turn: "x2" comes before "x10".

    >>> order_key("x2") < order_key("x10") < order_key("xa")
    True
    """
    # A number is told by its length first; it ends a word, and so comes before whatever goes on with it.
    return _DIGITS.sub(lambda found: f"\0{len(digits := found[0].lstrip('0')):04}{digits}", text)


def _chroma(one: Summary) -> float | None:
    return None if one.lab is None else (one.lab[1] ** 2 + one.lab[2] ** 2) ** 0.5


def _hue(one: Summary) -> float | None:
    import math

    return None if one.lab is None else math.degrees(math.atan2(one.lab[2], one.lab[1])) % 360.0


#: Sort keys of a summary, by the names of `Query.sort`; None if it has none.
SORTED_BY: dict[str, Any] = {
    "family": lambda one: one.family,
    "model": lambda one: one.model,
    "kind": lambda one: one.kind,
    "quantity": lambda one: one.quantity,
    "error": lambda one: one.p99,
    "terms": lambda one: one.rank,
    "lightness": lambda one: None if one.lab is None else one.lab[0],
    "chroma": _chroma,
    "hue": _hue,
    "near": lambda one: one.distance,
}
