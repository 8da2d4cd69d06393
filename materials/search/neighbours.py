"""Neighbours of a material in a catalogue by appearance, or after an offset such as warmer and glossier.

A material is a point: CIELAB at 45:0, from its head, and gloss (`gloss`), for which its file is read. The distance of a
neighbour from the requested point, the reference, is

    distance^2 = ΔE94^2 + (stop x difference of gloss in stops)^2

The distance in colour alone is a lower bound: candidates are read in its order, until it exceeds the distance of the
last neighbour kept. The search is exact, and reads few files.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import cast

import numpy as np

from ...runtime.errors import InputError
from ...spectral.difference import delta_e_lab
from ..catalogue.catalogue import Catalogue
from ..catalogue.head_index import HeadIndex
from ..records.material import MaterialRecord
from ..records.models import SPECTRA
from ..records.query import Heads, Query, Summary
from .appearance_offset import STOP, Appearance, Wish, wished
from .gloss import record_gloss

# Materials looked up by their colour at first; eight times as many each time that these do not suffice.
_FIRST = 64


@dataclass(frozen=True, eq=False)
class Neighbour:
    """A material, its appearance, and its distance from the requested one."""

    summary: Summary
    look: Appearance
    distance: float


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Result of `like`.

    of : the queried material. wish : from its appearance to the target. own_distance : its own distance from the
    target. found : nearest first; with a wish, only those nearer than the material itself.
    looked_at : number of files read. left_out : ids of incomparable materials with the reason, by all heads, and by the
    files read. unusable : an error for each unreadable file.
    """

    of: Summary
    wish: Wish
    own_distance: float
    found: tuple[Neighbour, ...]
    looked_at: int
    left_out: dict[str, str]
    unusable: tuple[InputError, ...]


def like(
    catalogue: Catalogue,
    material_id: str,
    wish: Mapping[str, float | int] | None = None,
    limit: int = 12,
    stop: float = STOP,
    say: Callable[[str], None] = lambda line: None,
) -> Neighbours:
    """Find materials of the catalogue that look like one of them, offset by a wish.

    Parameters
    ----------
    wish : amounts by words of `appearance_offset.WORDS`, in CIELAB, of gloss in stops. None or nothing: its neighbours
        as it is.
    limit : largest number. stop : weight of a stop of gloss, in units of CIELAB. say : see `Catalogue.heads`.

    Raises
    ------
    UnknownNameError : no such material, no such word. InputError : a material without an appearance to start from,
        errors of `wished`, a stop below 0.
    """
    if not (np.isfinite(stop) and stop >= 0):
        raise InputError("unusable weight of gloss", field="stop", found=stop, expected="0 or more, in units of CIELAB")
    if limit < 1:
        raise InputError("unusable limit", field="limit", found=limit, expected="1 or more")
    own = catalogue.summary(material_id)
    start = unlike(own) or look_of(catalogue.load(material_id), own)
    if isinstance(start, str):
        expected = "a surface that reflects, with a colour of its own"
        raise InputError("no neighbours", field=material_id, found=start, expected=expected)
    way = wished(start, wish or {})
    heads = catalogue.heads(say)
    unusable = list(heads.unusable)
    left_out = {one.id: why for one in _without_look(heads) if one.id != material_id and (why := unlike(one))}
    own_distance = _distance(float(delta_e_lab(np.array(way.to.lab), np.array(start.lab))), start, way.to, stop)
    found: list[Neighbour] = []
    looked_at = 0
    farthest = own_distance if way.amounts else np.inf
    for one in _by_colour(heads, way.to.lab):
        if one.id == material_id or unlike(one):
            continue
        colour = cast(float, one.distance)
        if len(found) >= limit:
            farthest = min(farthest, found[-1].distance)
        if colour >= farthest:
            break
        looked_at += 1
        try:
            look = look_of(catalogue.load(one.id), one)
        except InputError as problem:
            unusable.append(problem)
            continue
        if isinstance(look, str):
            left_out[one.id] = look
            continue
        distance = _distance(colour, look, way.to, stop)
        if distance < farthest:
            found.append(Neighbour(one, look, distance))
            found.sort(key=lambda neighbour: (neighbour.distance, neighbour.summary.id))
            del found[limit:]
    return Neighbours(own, way, own_distance, tuple(found), looked_at, left_out, tuple(unusable))


def _without_look(heads: Heads | HeadIndex) -> tuple[Summary, ...]:
    """Return the materials that cannot be compared, sorted by id; see `unlike`."""
    asked = (Query(models=tuple(SPECTRA)), Query(quantities=("bispectral",)), Query(coloured=False))
    return Query().of({one.id: one for query in asked for one in heads.select(query)}.values())


def _by_colour(heads: Heads | HeadIndex, lab: tuple[float, float, float]) -> Iterator[Summary]:
    """Yield materials with a colour, nearest to `lab` first: a few are queried, and more on demand."""
    given, limit = 0, _FIRST
    while given < limit:
        nearest = heads.select(Query(near=lab, coloured=True, limit=limit))
        yield from nearest[given:]
        given, limit = limit, (8 * limit if len(nearest) == limit else 0)


def unlike(one: Summary) -> str | None:
    """Return why a material cannot be compared by appearance, judging by its head; None if it can."""
    if one.model in SPECTRA:
        return f"{SPECTRA[one.model].words}, not a surface"
    if one.quantity == "bispectral":
        return "fluorescent: its colour is that of one light"
    if one.lab is None:
        return "no colour is known of it"
    return None


def look_of(record: MaterialRecord, one: Summary) -> Appearance | str:
    """Return the appearance of a material, with the colour from its head; or the reason why it has none."""
    if one.lab is None or one.xyz is None:
        return "no colour is known of it"
    gloss = record_gloss(record, one.xyz[1])
    return gloss if isinstance(gloss, str) else Appearance(one.lab, gloss.stops, gloss.units)


def _distance(colour: float, look: Appearance, asked: Appearance, stop: float) -> float:
    return float(np.hypot(colour, stop * (look.gloss - asked.gloss)))
